#pragma once
// How far a run is whose frames no window shows.

#include <cstddef>
#include <optional>

namespace paradize {

class Progress {
  public:
    /// `frames`: those that the run draws. `now_ms`: its start.
    Progress(std::size_t frames, double now_ms);
    /// One more is drawn. Returns the seconds until all are, if the others take as long: every five seconds,
    /// but not with the last. Else nothing.
    std::optional<double> drawn(double now_ms);
    std::size_t count() const { return count_; }
    std::size_t frames() const { return frames_; }

  private:
    std::size_t count_ = 0;
    std::size_t frames_;
    double start_ms_;
    double said_ms_;
};

} // namespace paradize
