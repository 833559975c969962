#include "streaming/schedule.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

using namespace paradize;

namespace {

/// Objects on a line, each with a chain of levels, and a camera that flies along it.
struct World {
    struct Object {
        float at_m = 0.0F;
        std::uint32_t first = 0, count = 0; // pieces, coarse before fine
    };
    std::vector<Object> objects;
    std::vector<ScheduledPiece> pieces;
    std::vector<float> errors_m; // while the piece is absent
    std::vector<Need> needs;

    World(std::mt19937 &random, int count, bool working_bytes) {
        const auto below = [&](unsigned limit) { return static_cast<unsigned>(random() % limit); };
        for (int i = 0; i < count; ++i) {
            const std::uint32_t levels = 1 + below(5);
            objects.push_back(
                {static_cast<float>(below(1000)), static_cast<std::uint32_t>(pieces.size()), levels});
            std::uint64_t before = 0;
            for (std::uint32_t level = 0; level < levels; ++level) {
                ScheduledPiece piece;
                piece.bytes = (std::uint64_t{1} << level) * (50 + below(100));
                piece.coarse = level == 0;
                piece.working_bytes = working_bytes ? before : 0;
                if (level != 0) {
                    piece.parents = {static_cast<std::uint32_t>(pieces.size()) - 1};
                }
                before += piece.bytes;
                errors_m.push_back(64.0F / static_cast<float>(1U << (2 * level)));
                pieces.push_back(piece);
            }
        }
        needs.resize(pieces.size());
    }

    void look(float camera_m, float later_m) {
        for (const Object &object : objects) {
            for (std::uint32_t i = object.first; i < object.first + object.count; ++i) {
                // what lies behind the camera is not seen
                const auto error = [&](float eye_m) {
                    const float distance_m = object.at_m - eye_m;
                    return distance_m < 0.0F ? 0.0F : errors_m[i] * 30.0F / std::max(distance_m, 1.0F);
                };
                needs[i] = {error(camera_m), 0.5F * error(later_m)};
            }
        }
    }

    std::uint64_t total() const {
        std::uint64_t out = 0;
        for (const ScheduledPiece &piece : pieces) {
            out += piece.bytes;
        }
        return out;
    }
};

/// Carries out a plan. At most `limit` bytes are loaded. At no moment, with the copies that evictions and
/// uploads need, is more on the device than the budget and coarse pieces of what is seen.
void obey(Schedule &schedule, const World &world, std::uint64_t limit) {
    const std::uint64_t budget = schedule.budget_bytes();
    for (const std::uint32_t piece : schedule.evictions()) {
        CHECK(schedule.bytes_while_evicted(piece) <= std::max(budget, schedule.used_bytes()));
        schedule.set_absent(piece);
    }
    for (std::uint32_t i = 0; i < world.pieces.size() && schedule.used_bytes() > budget; ++i) {
        CHECK((!schedule.resident(i) || world.needs[i].now > 1.0F));
    }
    std::uint64_t loaded = 0;
    for (const std::uint32_t piece : schedule.loads()) {
        loaded += world.pieces[piece].bytes;
        if (loaded > limit) {
            return;
        }
        REQUIRE(schedule.can_load(piece));
        schedule.set_loading(piece);
        CHECK((schedule.used_bytes() <= budget ||
               (world.pieces[piece].coarse && world.needs[piece].now > 1.0F)));
        schedule.set_resident(piece);
    }
}

} // namespace

TEST_CASE("schedule: flying cameras never lose what they see, and memory stays within the limit") {
    std::mt19937 random(7); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same worlds in every run
    std::uint64_t evictions = 0, coarse_evictions = 0;
    for (int trial = 0; trial < 60; ++trial) {
        World world(random, 30, trial % 2 == 0);
        const std::uint64_t budget = world.total() * (1 + random() % 80) / 100;
        Schedule schedule(world.pieces, budget);
        float camera_m = 0.0F;
        for (int frame = 0; frame < 120; ++frame) {
            camera_m += static_cast<float>(random() % 200) / 10.0F - (frame % 40 == 39 ? 300.0F : 0.0F);
            world.look(camera_m, camera_m + 40.0F);
            schedule.plan(world.needs, 4000);
            evictions += schedule.evictions().size();
            std::uint64_t used = schedule.used_bytes();
            for (const std::uint32_t piece : schedule.evictions()) {
                REQUIRE(schedule.resident(piece));
                CHECK(world.needs[piece].now <= 1.0F); // it is not seen at this size
                coarse_evictions += world.pieces[piece].coarse ? 1 : 0;
                const bool is_parent = piece + 1 < world.pieces.size() && !world.pieces[piece + 1].coarse;
                if (is_parent && schedule.resident(piece + 1)) { // its child goes first
                    const auto begin = schedule.evictions().begin();
                    const auto self = std::find(begin, schedule.evictions().end(), piece);
                    CHECK(std::find(begin, self, piece + 1) != self);
                }
                used -= world.pieces[piece].bytes;
            }
            for (const std::uint32_t piece : schedule.loads()) {
                CHECK_FALSE(schedule.resident(piece));
                used += world.pieces[piece].bytes;
                if (!(world.pieces[piece].coarse && world.needs[piece].now > 1.0F)) {
                    CHECK(used + world.pieces[piece].working_bytes <= budget);
                }
            }
            obey(schedule, world, 2000);
        }
        // A camera that stands still ends the loading, and nothing moves to and fro.
        for (int frame = 0; frame < 200; ++frame) {
            schedule.plan(world.needs, 4000);
            obey(schedule, world, 4000);
        }
        schedule.plan(world.needs, 4000);
        CHECK(schedule.loads().empty());
        CHECK(schedule.evictions().empty());
    }
    CHECK(evictions > 500); // the limit is felt
    CHECK(coarse_evictions > 50);
}

TEST_CASE("schedule: a coarse piece goes only for one that is needed now, after all that is needed less") {
    std::vector<ScheduledPiece> pieces(4, ScheduledPiece{.bytes = 40, .coarse = true, .parents = {}});
    pieces[1] = {.bytes = 40, .parents = {0}};
    Schedule schedule(pieces, 120);
    for (const std::uint32_t piece : {0U, 1U, 2U}) {
        schedule.set_loading(piece);
        schedule.set_resident(piece);
    }
    std::vector<Need> needs{{0.0F, 9.0F}, {0.0F, 9.0F}, {0.0F, 0.0F}, {0.0F, 5.0F}};
    schedule.plan(needs, 1000); // needed soon: waits for room
    CHECK(schedule.evictions().empty());
    needs[3] = {2.0F, 0.0F};
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{3}));
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{2}));
    needs[2] = {2.0F, 0.0F};
    schedule.plan(needs, 1000); // then what is needed soon, the finer piece first
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{1}));
}

TEST_CASE("schedule: what is needed now takes the room of what is needed soon, however large its error") {
    Schedule schedule(std::vector<ScheduledPiece>(3, ScheduledPiece{.bytes = 40, .parents = {}}), 80);
    std::vector<Need> needs{{0.0F, 99.0F}, {0.0F, 9.0F}, {1.1F, 0.0F}};
    for (const std::uint32_t piece : {0U, 1U}) {
        schedule.set_loading(piece);
        schedule.set_resident(piece);
    }
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{2}));
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{1}));
    needs[2] = {0.0F, 17.0F}; // less than twice the error of piece 1: not worth a swap
    schedule.plan(needs, 1000);
    CHECK(schedule.evictions().empty());
    needs[2] = {0.0F, 19.0F};
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{1}));
}

TEST_CASE("schedule: while all that is seen fits, hardly a piece moves twice along a flight") {
    std::mt19937 random(5); // NOLINT(cert-msc32-c,cert-msc51-cpp)
    std::uint64_t uploads = 0, sights = 0;
    for (int trial = 0; trial < 20; ++trial) {
        World world(random, 30, false);
        std::vector<bool> was_needed(world.pieces.size());
        std::uint64_t most = 0;
        for (int frame = 0; frame < 2000; ++frame) {
            world.look(0.5F * static_cast<float>(frame), 0.5F * static_cast<float>(frame) + 40.0F);
            std::uint64_t needed = 0;
            for (std::size_t i = 0; i < world.pieces.size(); ++i) {
                const bool is_needed = world.needs[i].now > 1.0F || world.needs[i].soon > 1.0F;
                needed += world.needs[i].now > 1.0F ? world.pieces[i].bytes : 0;
                sights += is_needed && !was_needed[i] ? 1 : 0;
                was_needed[i] = is_needed;
            }
            most = std::max(most, needed);
        }
        Schedule schedule(world.pieces, most + most / 10);
        for (int frame = 0; frame < 2000; ++frame) {
            world.look(0.5F * static_cast<float>(frame), 0.5F * static_cast<float>(frame) + 40.0F);
            schedule.plan(world.needs, world.total());
            uploads += schedule.loads().size();
            obey(schedule, world, world.total());
            schedule.count_needs(world.needs);
            CHECK(schedule.worst_error() == 0.0F); // though what is needed soon wants the room
        }
    }
    CHECK(uploads < 2 * sights);
}

TEST_CASE("schedule: what goes beyond the limit is evicted when it is seen no more") {
    std::vector<ScheduledPiece> pieces(3, ScheduledPiece{.bytes = 60, .coarse = true, .parents = {}});
    Schedule schedule(pieces, 100);
    std::vector<Need> needs(3, Need{2.0F, 0.0F});
    schedule.plan(needs, 1000);
    REQUIRE(schedule.loads().size() == 3); // there is nothing to see without them
    for (const std::uint32_t piece : schedule.loads()) {
        schedule.set_loading(piece);
        schedule.set_resident(piece);
    }
    CHECK(schedule.used_bytes() == 180);
    needs[0] = needs[1] = {0.0F, 3.0F};
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{1, 0}));
}

TEST_CASE("schedule: what would go for a piece that does not fit even so may go for a smaller one") {
    std::vector<ScheduledPiece> pieces(4);
    pieces[0].bytes = pieces[1].bytes = 60;
    pieces[2].bytes = 1000;
    pieces[3].bytes = 80;
    Schedule schedule(pieces, 150);
    for (const std::uint32_t piece : {0U, 1U}) {
        schedule.set_loading(piece);
        schedule.set_resident(piece);
    }
    schedule.plan(std::vector<Need>{{0.0F, 0.0F}, {0.0F, 2.0F}, {9.0F, 0.0F}, {5.0F, 0.0F}}, 5000);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{3}));
    CHECK(std::ranges::equal(schedule.evictions(), std::vector<std::uint32_t>{0}));
}

TEST_CASE("schedule: something of everything that is seen comes first, then the largest error") {
    std::mt19937 random(3); // NOLINT(cert-msc32-c,cert-msc51-cpp)
    World world(random, 20, false);
    world.look(200.0F, 240.0F);
    Schedule schedule(world.pieces, 0);
    schedule.plan(world.needs, 1 << 30);
    REQUIRE(schedule.loads().size() == world.pieces.size()); // without a limit all are loaded in the end
    const auto group = [&](std::uint32_t piece) {
        const Need &need = world.needs[piece];
        return need.now > 1.0F              ? world.pieces[piece].coarse ? 0 : 1
               : need.soon > 1.0F           ? 2
               : world.pieces[piece].coarse ? 3
                                            : 4;
    };
    const auto error = [&](std::uint32_t piece) {
        const Need &need = world.needs[piece];
        return need.now > 1.0F ? need.now : need.soon > 1.0F ? need.soon : 0.0F;
    };
    for (std::size_t i = 1; i < schedule.loads().size(); ++i) {
        const std::uint32_t a = schedule.loads()[i - 1];
        const std::uint32_t b = schedule.loads()[i];
        CHECK(group(a) <= group(b));
        CHECK((group(a) != group(b) || error(a) >= error(b)));
    }
}

TEST_CASE(
    "schedule: the worst error under a limit is that of the best choice that shows something of everything, "
    "found by brute force") {
    std::mt19937 random(11); // NOLINT(cert-msc32-c,cert-msc51-cpp)
    int limited = 0;
    for (int trial = 0; trial < 500; ++trial) {
        World world(random, 3, false);
        if (world.pieces.size() > 14) {
            continue;
        }
        world.look(static_cast<float>(random() % 500), 0.0F);
        for (Need &need : world.needs) {
            need.soon = 0.0F;
        }
        const std::uint64_t budget = world.total() * (30 + random() % 60) / 100;
        float best = 1e9F;
        for (std::uint32_t chosen = 0; chosen < 1U << world.pieces.size(); ++chosen) {
            std::uint64_t bytes = 0;
            float worst = 0.0F;
            bool valid = true;
            for (std::uint32_t i = 0; i < world.pieces.size(); ++i) {
                if ((chosen >> i & 1U) == 0) {
                    // something of everything that is seen is there in any case
                    valid = valid && !(world.pieces[i].coarse && world.needs[i].now > 1.0F);
                    worst = std::max(worst, world.needs[i].now > 1.0F ? world.needs[i].now : 0.0F);
                    continue;
                }
                bytes += world.pieces[i].bytes;
                valid = valid && std::ranges::all_of(world.pieces[i].parents, [&](std::uint32_t parent) {
                            return (chosen >> parent & 1U) != 0;
                        });
            }
            if (valid && bytes <= budget) {
                best = std::min(best, worst);
            }
        }
        Schedule schedule(world.pieces, budget);
        for (int frame = 0; frame < 50; ++frame) {
            schedule.plan(world.needs, 500);
            obey(schedule, world, 500 + world.total());
        }
        schedule.plan(world.needs, 500);
        if (schedule.used_bytes() <= budget) { // else coarse pieces alone exceed it
            CHECK(schedule.worst_error() == best);
            limited += best > 0.0F ? 1 : 0;
        }
    }
    CHECK(limited > 20);
}

TEST_CASE("schedule: the working bytes of a piece that is half uploaded leave less room for others") {
    std::vector<ScheduledPiece> pieces(3, ScheduledPiece{.bytes = 40, .working_bytes = 20, .parents = {}});
    pieces[2].working_bytes = 0;
    Schedule schedule(pieces, 120);
    const std::vector<Need> needs{{0.0F, 2.0F}, {4.0F, 0.0F}, {3.0F, 0.0F}};
    schedule.set_loading(0);
    CHECK(schedule.used_bytes() == 60);
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{1})); // 60 + 40 + 20
    schedule.set_loading(1);
    CHECK(schedule.used_bytes() == 120);
    schedule.set_resident(0);
    schedule.set_resident(1);
    CHECK(schedule.used_bytes() == 80);
    schedule.plan(needs, 1000);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{2}));
}

TEST_CASE("schedule: a piece that is given up is planned no more, nor what depends on it") {
    std::vector<ScheduledPiece> pieces(3);
    for (std::uint32_t i = 0; i < 3; ++i) {
        pieces[i].bytes = 10;
        pieces[i].coarse = i == 0;
    }
    pieces[2].parents = {1};
    Schedule schedule(pieces, 0);
    CHECK(schedule.give_up(1));
    CHECK_FALSE(schedule.give_up(1));
    const std::vector<Need> needs(3, Need{5.0F, 5.0F});
    schedule.plan(needs, 100);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{0}));
}

TEST_CASE("schedule: in the order of the file needs change nothing but the error that is told") {
    std::vector<ScheduledPiece> pieces(4);
    for (std::uint32_t i = 0; i < 4; ++i) {
        pieces[i].bytes = 10;
        pieces[i].coarse = i % 2 == 0;
    }
    Schedule schedule(pieces, 0, UploadOrder::file);
    const std::vector<Need> needs{{0.0F, 0.0F}, {2.0F, 0.0F}, {0.0F, 0.0F}, {9.0F, 0.0F}};
    schedule.plan(needs, 100);
    CHECK(std::ranges::equal(schedule.loads(), std::vector<std::uint32_t>{0, 2, 1, 3}));
    CHECK(schedule.worst_error() == 9.0F);
    schedule.set_loading(3);
    schedule.set_resident(3);
    schedule.count_needs(needs);
    CHECK(schedule.worst_error() == 2.0F);
    CHECK(schedule.needed_bytes() == 20);
}
