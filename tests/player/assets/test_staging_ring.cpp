#include "assets/staging_ring.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <random>
#include <thread>
#include <vector>

using namespace paradize;

namespace {

using Memory = std::array<std::byte, 64 * 100>;

bool lies_in(const Memory &memory, const assets::StagedBytes &part) {
    return part.get() >= memory.data() && part.get() < memory.data() + memory.size();
}

} // namespace

TEST_CASE("staging ring: no part overlaps one that is in use, however they are freed, and all lie inside") {
    std::mt19937 random(3); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same parts in every run
    struct Used {
        assets::StagedBytes bytes;
        std::size_t size = 0;
        std::byte filled{};
    };
    Memory memory;
    assets::StagingRing ring;
    std::vector<Used> used;
    int from_ring = 0, wrapped = 0, wrong = 0;
    const std::byte *last = nullptr;
    ring.open(memory);
    for (int i = 0; i < 20000; ++i) {
        if (used.size() < 12 && random() % 5 < 3) {
            const std::size_t size = 1 + random() % (random() % 8 == 0 ? memory.size() + 100 : 900);
            Used next{ring.take(size), size, static_cast<std::byte>(random())};
            std::fill_n(next.bytes.get(), size, next.filled);
            if (lies_in(memory, next.bytes)) {
                wrong += next.bytes.get() + size <= memory.data() + memory.size() ? 0 : 1;
                wrapped += next.bytes.get() < last ? 1 : 0;
                last = next.bytes.get();
                ++from_ring;
            }
            used.push_back(std::move(next));
        } else if (!used.empty()) { // mostly the oldest
            const std::size_t at = random() % 3 == 0 ? random() % used.size() : 0;
            const Used &freed = used[at];
            wrong += std::count(freed.bytes.get(), freed.bytes.get() + freed.size, freed.filled) ==
                             static_cast<std::ptrdiff_t>(freed.size)
                         ? 0
                         : 1; // another part has written into it
            used.erase(used.begin() + static_cast<std::ptrdiff_t>(at));
        }
    }
    CHECK(wrong == 0);
    CHECK(from_ring > 5000);
    CHECK(wrapped > 300);
}

TEST_CASE(
    "staging ring: the heap has what is larger than the ring, or comes while the ring is full or shut") {
    Memory memory;
    assets::StagingRing ring;
    CHECK_FALSE(lies_in(memory, ring.take(10)));
    ring.open(memory);
    CHECK_FALSE(lies_in(memory, ring.take(memory.size() + 1)));
    assets::StagedBytes whole = ring.take(memory.size());
    CHECK(lies_in(memory, whole));
    CHECK_FALSE(lies_in(memory, ring.take(1)));
    CHECK_FALSE(ring.close());
    whole.reset();
    assets::StagedBytes nothing = ring.take(0); // a part of its own
    assets::StagedBytes next = ring.take(1);
    CHECK((lies_in(memory, nothing) && lies_in(memory, next) && nothing.get() != next.get()));
    nothing.reset();
    CHECK_FALSE(ring.close());
    next.reset();
    CHECK(ring.close());
    CHECK_FALSE(lies_in(memory, ring.take(10)));
}

TEST_CASE(
    "staging ring: a free part waits for the older ones, and more parts than it counts are the heap's") {
    Memory memory;
    assets::StagingRing ring;
    ring.open(memory);
    assets::StagedBytes oldest = ring.take(64 * 60);
    assets::StagedBytes middle = ring.take(64 * 20);
    const assets::StagedBytes last = ring.take(64 * 20);
    middle.reset(); // in the midst
    CHECK_FALSE(lies_in(memory, ring.take(64)));
    const std::byte *const first = oldest.get();
    oldest.reset();
    CHECK(ring.take(64 * 80).get() == first); // both at once
    std::vector<std::byte> large(64 * 2 * assets::StagingRing::most_parts);
    assets::StagingRing many;
    many.open(large);
    std::vector<assets::StagedBytes> parts;
    for (std::size_t i = 0; i < assets::StagingRing::most_parts; ++i) {
        parts.push_back(many.take(1));
        CHECK(parts.back().get() == large.data() + 64 * i);
    }
    parts.push_back(many.take(1));
    CHECK(parts.back().get_deleter().ring == nullptr);
}

TEST_CASE("staging ring: threads take and free at the same time") { // most useful with the thread sanitizer
    Memory memory;
    assets::StagingRing ring;
    ring.open(memory);
    std::atomic<int> wrong{0};
    const auto work = [&](std::byte mine) {
        for (int i = 0; i < 2000; ++i) {
            const std::size_t size = 1 + static_cast<std::size_t>(i) % 700;
            assets::StagedBytes part = ring.take(size);
            std::fill_n(part.get(), size, mine);
            std::this_thread::yield();
            if (std::count(part.get(), part.get() + size, mine) != static_cast<std::ptrdiff_t>(size)) {
                ++wrong;
            }
        }
    };
    {
        const std::jthread other(work, std::byte{1});
        work(std::byte{2});
    }
    CHECK(wrong == 0);
    CHECK(ring.close());
}
