#include "app/progress.hpp"

namespace paradize {

namespace {
constexpr double between_ms = 5000.0;
}

Progress::Progress(std::size_t frames, double now_ms)
    : frames_(frames), start_ms_(now_ms), said_ms_(now_ms) {}

std::optional<double> Progress::drawn(double now_ms) {
    ++count_;
    if (count_ >= frames_ || now_ms - said_ms_ < between_ms) {
        return std::nullopt;
    }
    said_ms_ = now_ms;
    const double frame_s = (now_ms - start_ms_) / static_cast<double>(count_) / 1000.0;
    return frame_s * static_cast<double>(frames_ - count_);
}

} // namespace paradize
