#pragma once
// Measures the duration of each pass.

#include "gl/handle.hpp"

#include <cstddef>
#include <utility>
#include <vector>

namespace paradize {

/// The clock: the device, while it draws as always; or the processor, which waits after each part
/// until the device has finished it, so that the sum exceeds a normal frame, whose parts overlap.
enum class MeterClock { device, processor };

/// Milliseconds of each part of one frame. Parts 0 to passes - 1 are the passes; views that a pass draws
/// (shadow map, mirror) count as its own time. The others are the work between them.
class PassMeter {
  public:
    PassMeter(std::size_t passes, MeterClock clock);
    std::size_t views() const { return passes_; }       // choosing what to draw
    std::size_t clear() const { return passes_ + 1; }   // of the main view's target
    std::size_t resolve() const { return passes_ + 2; } // of its samples

    void start();
    /// Adds the time since the last start() or stop() to `part`.
    void stop(std::size_t part);
    /// Waits for the device.
    std::vector<double> ms() const;

  private:
    std::size_t passes_;
    MeterClock clock_;
    std::vector<double> ms_;
    double since_ms_ = 0.0;
    std::vector<std::pair<std::size_t, gl::Query>> stops_; // of the device; the first one is the start
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
