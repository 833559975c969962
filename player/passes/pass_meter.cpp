#include "passes/pass_meter.hpp"

#include <epoxy/gl.h>

#include <chrono>
#include <ctime>

namespace paradize {

double now_ms() {
    using namespace std::chrono;
    return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}

namespace {

double thread_ms() {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

} // namespace

CpuTimer::CpuTimer(double &sum_ms) : sum_ms_(sum_ms), since_ms_(thread_ms()) {}

CpuTimer::~CpuTimer() {
    sum_ms_ += thread_ms() - since_ms_;
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
