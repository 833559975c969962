#pragma once
// What each pass of a frame costs.

#include <cstddef>
#include <vector>

namespace paradize {

/// Milliseconds of each pass of one frame, each waited for: their sum is more than an ordinary frame, whose
/// passes overlap. What a pass lets others draw for it (the shadow map, the mirror) is its own.
class PassMeter {
  public:
    explicit PassMeter(std::size_t passes) : ms_(passes) {}
    /// Waits for the device; the clock runs from here.
    void start();
    /// Waits for the device; all since the last start or stop was this pass.
    void stop(std::size_t pass);
    const std::vector<double> &ms() const { return ms_; }

  private:
    std::vector<double> ms_;
    double since_ms_ = 0.0;
};

/// A clock that only goes forward, milliseconds.
double now_ms();

} // namespace paradize
