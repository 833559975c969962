// The loader's thread beside the drawing thread; most useful with the thread sanitizer.
#include "assets/piece_loader.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

using namespace paradize;

namespace {

constexpr std::uint32_t pieces = 16;

// Bytes and text tell which piece it is.
assets::StagedPiece numbered(std::uint32_t piece) {
    assets::StagedPiece out;
    out.bytes = assets::heap_bytes(1000);
    std::fill_n(out.bytes.get(), 1000, static_cast<std::byte>(piece));
    out.error = std::to_string(piece);
    return out;
}

} // namespace

TEST_CASE("piece loader: the piece that is taken is the one that was ordered, however often orders change") {
    assets::PieceLoader loader(pieces,
                               [](std::uint32_t piece, assets::StageMemory &) { return numbered(piece); });
    std::mt19937 random(5); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same orders in every run
    std::vector<std::uint32_t> all(pieces);
    std::iota(all.begin(), all.end(), 0U);
    int wrong = 0;
    for (int round = 0; round < 2000; ++round) {
        std::ranges::shuffle(all, random);
        const std::vector<std::uint32_t> orders(all.begin(), all.begin() + 1 + round % pieces);
        loader.order(orders);
        for (std::uint32_t i = pieces; i-- > orders.size();) {
            wrong += loader.ready(all[i]) ? 1 : 0; // not ordered any more
        }
        for (std::size_t i = 0; i < orders.size(); i += 3) {     // the others are dropped by the next orders
            while (round % 2 == 0 && !loader.ready(orders[i])) { // as a frame that does not wait asks
                std::this_thread::yield();
            }
            const assets::StagedPiece staged = loader.take(orders[i]);
            wrong += staged.error == std::to_string(orders[i]) ? 0 : 1;
            wrong += staged.bytes && staged.bytes[999] == static_cast<std::byte>(orders[i]) ? 0 : 1;
            wrong += loader.ready(orders[i]) ? 1 : 0;
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE(
    "piece loader: a piece that is cancelled while it is staged is not kept, and can be ordered again") {
    std::atomic<int> begun{0};
    std::atomic<bool> go{false};
    assets::PieceLoader loader(pieces, [&](std::uint32_t piece, assets::StageMemory &) {
        begun.fetch_add(1);
        begun.notify_one();
        go.wait(false);
        return numbered(piece);
    });
    loader.order(std::vector<std::uint32_t>{3});
    begun.wait(0); // piece 3 is being staged
    loader.order(std::vector<std::uint32_t>{4});
    go.store(true);
    go.notify_one();
    CHECK(loader.take(4).error == "4");
    CHECK_FALSE(loader.ready(3));
    loader.order(std::vector<std::uint32_t>{3});
    CHECK(loader.take(3).error == "3");
    CHECK(begun.load() == 3);
}

TEST_CASE("piece loader: a piece that is taken without an order is staged all the same") {
    assets::PieceLoader loader(pieces,
                               [](std::uint32_t piece, assets::StageMemory &) { return numbered(piece); });
    CHECK(loader.take(7).error == "7");
    loader.order(std::vector<std::uint32_t>{1, 2});
    CHECK(loader.take(3).error == "3");
    CHECK(loader.take(2).error == "2");
    CHECK(loader.take(1).error == "1");
}

TEST_CASE("piece loader: new orders of many staged pieces take less time than to sort them ten times") {
    constexpr std::uint32_t many = 40000;
    assets::PieceLoader loader(many,
                               [](std::uint32_t, assets::StageMemory &) { return assets::StagedPiece(); });
    std::vector<std::uint32_t> orders(many);
    std::iota(orders.begin(), orders.end(), 0U);
    loader.order(orders);
    while (!loader.ready(many - 1)) {
        std::this_thread::yield();
    }
    const auto used_ms = [](const auto &work) { // of this thread's processor time
        timespec from{}, to{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &from);
        work();
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &to);
        return static_cast<double>(to.tv_sec - from.tv_sec) * 1e3 +
               static_cast<double>(to.tv_nsec - from.tv_nsec) * 1e-6;
    };
    std::ranges::shuffle(orders, std::mt19937(5));
    std::vector<std::uint32_t> sorted;
    const double order_ms = used_ms([&] { loader.order(orders); });
    const double sort_ms = used_ms([&] {
        for (int i = 0; i < 10; ++i) {
            sorted = orders;
            std::ranges::sort(sorted);
        }
    });
    CAPTURE(order_ms);
    CAPTURE(sort_ms);
    CHECK(order_ms < sort_ms); // ten sorts; one search for each piece takes ten times as long
    CHECK(loader.ready(0));
}
