#include "passes/pass_meter.hpp"

#include "gl/timestamp.hpp"

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

PassMeter::PassMeter(std::size_t passes, MeterClock clock)
    : passes_(passes), clock_(clock), ms_(passes + 3) {}

void PassMeter::start() {
    glFinish();
    since_ms_ = now_ms();
    if (clock_ == MeterClock::device) {
        stops_.clear();
        stop(0);
    }
}

void PassMeter::stop(std::size_t part) {
    if (clock_ == MeterClock::device) {
        gl::ask_timestamp(stops_.emplace_back(part, gl::Query::create()).second);
        return;
    }
    glFinish();
    const double now = now_ms();
    ms_[part] += now - since_ms_;
    since_ms_ = now;
}

std::vector<double> PassMeter::ms() const {
    std::vector<double> out = ms_;
    for (std::size_t i = 1; i < stops_.size(); ++i) {
        const std::uint64_t from = gl::read_timestamp(stops_[i - 1].second);
        const std::uint64_t to = gl::read_timestamp(stops_[i].second);
        out[stops_[i].first] += to > from ? static_cast<double>(to - from) * 1e-6 : 0.0;
    }
    return out;
}

} // namespace paradize
