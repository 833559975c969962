// Numbered jobs shared out to threads, each taken as one becomes free. What a job does must not depend on
// which thread takes it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace paradize::terrain {

// Calls work(index) once for every index in [0, count), at most `threads` at once. An exception of any is
// thrown again here, after all have ended.
template <typename Work>
void for_each_job(std::size_t count, int threads, Work &&work) {
    const std::size_t hands =
        std::min<std::size_t>(threads < 1 ? 1 : static_cast<std::size_t>(threads), count);
    std::atomic<std::size_t> next{0};
    std::vector<std::exception_ptr> failures(std::max<std::size_t>(hands, 1));
    const auto run = [&](std::size_t hand) {
        try {
            for (std::size_t index = next++; index < count; index = next++) {
                work(index);
            }
        } catch (...) {
            failures[hand] = std::current_exception();
            next = count;
        }
    };
    std::vector<std::thread> others;
    for (std::size_t hand = 1; hand < hands; ++hand) {
        others.emplace_back(run, hand);
    }
    run(0);
    for (std::thread &other : others) {
        other.join();
    }
    for (const std::exception_ptr &failure : failures) {
        if (failure) {
            std::rethrow_exception(failure);
        }
    }
}

} // namespace paradize::terrain
