#include "passes/pass_meter.hpp"

#include <epoxy/gl.h>

#include <chrono>

namespace paradize {

double now_ms() {
    using namespace std::chrono;
    return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}

void PassMeter::start() {
    glFinish();
    since_ms_ = now_ms();
}

void PassMeter::stop(std::size_t pass) {
    glFinish();
    const double now = now_ms();
    ms_[pass] += now - since_ms_;
    since_ms_ = now;
}

} // namespace paradize
