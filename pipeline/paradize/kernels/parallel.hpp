// Work shared out to threads. What a part does must not depend on which thread does it: then the results are
// the same with one and with many.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace paradize {

// Calls work(hand) for every hand in [0, hands), each on a thread of its own, the first on this one, and
// those that the system has no thread for. An exception of any is thrown again here, after all have ended.
template <typename Work>
void on_threads(std::size_t hands, Work &&work) {
    std::vector<std::exception_ptr> failures(hands);
    std::vector<std::thread> others;
    others.reserve(hands);
    const auto run = [&](std::size_t hand) {
        try {
            work(hand);
        } catch (...) {
            failures[hand] = std::current_exception();
        }
    };
    for (std::size_t hand = 1; hand < hands; ++hand) {
        try {
            others.emplace_back(run, hand);
        } catch (const std::system_error &) {
            run(hand);
        }
    }
    if (hands > 0) {
        run(0);
    }
    for (std::thread &other : others) {
        other.join();
    }
    for (const std::exception_ptr &failure : failures) {
        if (failure) {
            std::rethrow_exception(failure);
        }
    }
}

inline std::size_t hands_for(std::size_t parts, int threads) {
    return std::min<std::size_t>(threads < 1 ? 1 : static_cast<std::size_t>(threads), parts);
}

// Calls work(first, last) for consecutive runs of rows that cover [0, rows), one for each of at most
// `threads` threads.
template <typename Work>
void for_rows(std::size_t rows, int threads, Work &&work) {
    const std::size_t hands = hands_for(rows, threads);
    if (hands <= 1) {
        work(std::size_t{0}, rows);
        return;
    }
    on_threads(hands, [&](std::size_t hand) { work(rows * hand / hands, rows * (hand + 1) / hands); });
}

// Calls work(index) once for every index in [0, count), each taken as one of at most `threads` threads
// becomes free.
template <typename Work>
void for_each_job(std::size_t count, int threads, Work &&work) {
    std::atomic<std::size_t> next{0};
    on_threads(hands_for(count, threads), [&](std::size_t) {
        try {
            for (std::size_t index = next++; index < count; index = next++) {
                work(index);
            }
        } catch (...) {
            next = count; // the others need not begin another
            throw;
        }
    });
}

} // namespace paradize
