// Rows of an image shared out to threads. Every row is computed the same way whatever the number of threads,
// so the bytes are the same with one and with many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

// A wider clone of a hot loop, chosen at run time. No clone may fuse multiplication and addition (the build
// says -ffp-contract=off), so all clones give the same bits.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__clang__)
#define PARADIZE_CLONES __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#else
#define PARADIZE_CLONES
#endif

namespace paradize::maps {

// Calls work(first, last) for consecutive runs of rows that cover [0, rows); at most `threads` at once.
// An exception of any run is thrown again here, after all have ended.
template <typename Work>
void for_rows(std::size_t rows, int threads, Work &&work) {
    const std::size_t runs = std::min<std::size_t>(threads < 1 ? 1 : static_cast<std::size_t>(threads), rows);
    if (runs <= 1) {
        work(std::size_t{0}, rows);
        return;
    }
    std::vector<std::exception_ptr> failures(runs);
    std::vector<std::thread> others;
    others.reserve(runs - 1);
    const auto run = [&](std::size_t index) {
        try {
            work(rows * index / runs, rows * (index + 1) / runs);
        } catch (...) {
            failures[index] = std::current_exception();
        }
    };
    for (std::size_t index = 1; index < runs; ++index) {
        others.emplace_back(run, index);
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

} // namespace paradize::maps
