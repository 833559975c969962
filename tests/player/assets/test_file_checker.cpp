// Files are checked on threads; most useful with the thread sanitizer.
#include "assets/file_checker.hpp"
#include "error.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

using namespace paradize;

namespace {

constexpr std::uint32_t count = 40;

std::vector<std::uint32_t> all_files() {
    std::vector<std::uint32_t> out(count);
    std::iota(out.begin(), out.end(), 0U);
    return out;
}

std::string error_of(auto &&call) {
    try {
        call();
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("file checker: each file is checked once, and those that are ordered come first") {
    std::mutex mutex;
    std::vector<std::uint32_t> done;
    std::atomic<bool> go{false};
    assets::FileChecker checker(all_files(), count, [&](std::uint32_t file, const std::stop_token &) {
        go.wait(false);
        const std::lock_guard lock(mutex);
        done.push_back(file);
    });
    checker.order(std::vector<std::uint32_t>{37, 12, 30});
    go.store(true);
    go.notify_all();
    for (const std::uint32_t file : {37U, 12U, 30U}) {
        checker.wait(file);
        CHECK(checker.checked(file));
    }
    CHECK_FALSE(checker.finished());
    CHECK(done.size() == 3); // the others wait
    checker.begin_rest();
    checker.finish();
    CHECK(checker.finished());
    REQUIRE(done.size() == count);
    std::ranges::sort(done);
    CHECK(done == all_files());
}

TEST_CASE("file checker: of several wrong files the first is told, whatever the order and the threads do") {
    for (int round = 0; round < 200; ++round) {
        assets::FileChecker checker(all_files(), count, [](std::uint32_t file, const std::stop_token &) {
            if (file % 10 == 7) {
                throw Error("file " + std::to_string(file));
            }
        });
        checker.order(std::vector<std::uint32_t>{37, 27, 39, 3});
        CHECK(error_of([&] { checker.wait(37); }) == "file 7");
        CHECK(error_of([&] { checker.finish(); }) == "file 7");
        CHECK(error_of([&] { checker.finished(); }) == "file 7");
        CHECK_FALSE(checker.checked(7));
        CHECK(checker.checked(3));
    }
}

TEST_CASE("file checker: files that are not listed count as checked, and no file at all is fine") {
    assets::FileChecker some({2}, 4, [](std::uint32_t, const std::stop_token &) {});
    CHECK(some.checked(0));
    some.wait(2); // waiting is ordering
    CHECK(some.finished());
    assets::FileChecker none({}, 4, [](std::uint32_t, const std::stop_token &) {});
    none.finish();
    CHECK(none.finished());
}

TEST_CASE("file checker: its end cancels what is being checked") {
    std::atomic<int> begun{0};
    {
        assets::FileChecker checker(all_files(), count, [&](std::uint32_t, const std::stop_token &stop) {
            begun.fetch_add(1);
            begun.notify_all();
            while (!stop.stop_requested()) {
                std::this_thread::yield();
            }
        });
        checker.begin_rest();
        begun.wait(0);
    }
    CHECK(begun.load() <= static_cast<int>(assets::loader_threads(count)));
}

TEST_CASE("file checker: where all are waited for, every thread checks what is not ordered") {
    std::atomic<bool> go{false};
    std::atomic<unsigned> begun{0};
    assets::FileChecker checker(all_files(), count, [&](std::uint32_t, const std::stop_token &) {
        ++begun;
        go.wait(false);
    });
    checker.begin_all();
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (begun < assets::loader_threads(count) && std::chrono::steady_clock::now() < end) {
        std::this_thread::yield();
    }
    CHECK(begun == assets::loader_threads(count));
    go.store(true);
    go.notify_all();
    checker.finish();
    CHECK(begun == count);
}

TEST_CASE("file checker: a file that is ordered waits for none that is not") {
    if (assets::loader_threads(count) == 1) {
        return; // one thread checks both
    }
    std::atomic<bool> go{false};
    std::atomic<unsigned> begun{0};
    assets::FileChecker checker(all_files(), count, [&](std::uint32_t file, const std::stop_token &) {
        ++begun;
        if (file != 39) {
            go.wait(false);
        }
    });
    checker.begin_rest();
    while (begun + 1 < assets::loader_threads(count)) { // all threads that take what is not ordered
        std::this_thread::yield();
    }
    checker.order(std::vector<std::uint32_t>{39});
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!checker.checked(39) && std::chrono::steady_clock::now() < end) {
        std::this_thread::yield();
    }
    CHECK(checker.checked(39));
    go.store(true);
    go.notify_all();
    checker.finish();
    CHECK(begun == count);
}
