#pragma once
// Measures the duration of each pass.

#include <cstddef>
#include <vector>

namespace paradize {

/// Milliseconds of each pass of one frame. The device finishes each pass before the next one starts, so that
/// the sum exceeds a normal frame, whose passes overlap. Views that a pass draws (shadow map, mirror) count
/// as its own time.
class PassMeter {
  public:
    explicit PassMeter(std::size_t passes) : ms_(passes) {}
    /// Waits for the device and starts the clock.
    void start();
    /// Waits for the device and adds the time since the last start() or stop() to `pass`.
    void stop(std::size_t pass);
    const std::vector<double> &ms() const { return ms_; }

  private:
    std::vector<double> ms_;
    double since_ms_ = 0.0;
};

/// A monotonic clock in milliseconds.
double now_ms();

/// Adds the processor time that this thread takes during its lifetime to a sum of milliseconds.
class CpuTimer {
  public:
    explicit CpuTimer(double &sum_ms);
    CpuTimer(const CpuTimer &) = delete;
    CpuTimer &operator=(const CpuTimer &) = delete;
    ~CpuTimer();

  private:
    double &sum_ms_;
    double since_ms_;
};

} // namespace paradize
