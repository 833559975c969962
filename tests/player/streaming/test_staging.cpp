#include "streaming/staging.hpp"

#include "context.hpp"
#include "gl/buffer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

using namespace paradize;

namespace {

/// A device that does its commands some time after they were given.
struct SlowDevice {
    std::uint64_t given = 0, done = 0;
};

struct SlowFence {
    const SlowDevice *device = nullptr;
    std::uint64_t behind = 0;
    bool passed() const { return device->done >= behind; }
};

} // namespace

TEST_CASE("staging: no part is used again before the device has read it, however late that is") {
    std::mt19937 random(9); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same frames in every run
    struct Read {
        const std::byte *bytes = nullptr;
        std::size_t size = 0;
        std::byte filled{};
    };
    std::vector<std::byte> memory(100000);
    assets::StagingRing ring;
    ring.open(memory);
    FencedParts<SlowFence> in_use;
    SlowDevice device;
    std::vector<Read> reads; // one per command
    int wrong = 0, from_ring = 0;
    for (int frame = 0; frame < 3000; ++frame) {
        for (std::uint64_t some = random() % 8; some-- > 0 && device.done < device.given; ++device.done) {
            const Read &read = reads[device.done];
            wrong += std::count(read.bytes, read.bytes + read.size, read.filled) ==
                             static_cast<std::ptrdiff_t>(read.size)
                         ? 0
                         : 1;
        }
        in_use.free_passed();
        for (std::uint64_t pieces = random() % 6; pieces-- > 0;) {
            const std::size_t size = 1 + random() % 9000;
            assets::StagedBytes part = ring.take(size);
            if (part.get_deleter().ring == nullptr) {
                continue; // GL copies at once
            }
            ++from_ring;
            reads.push_back({part.get(), size, static_cast<std::byte>(random())});
            std::fill_n(part.get(), size, reads.back().filled);
            ++device.given;
            in_use.add(std::move(part));
        }
        if (in_use.needs_fence()) {
            in_use.put({&device, device.given});
        }
        CHECK_FALSE(in_use.needs_fence());
    }
    CHECK(wrong == 0);
    CHECK(from_ring > 3000);
    device.done = device.given;
    in_use.free_passed();
    CHECK(ring.close()); // nothing is left in use
}

TEST_CASE("staging: what lies in the mapped buffer reaches other buffers, round after round") {
    if (!test::have_context() || !epoxy_has_gl_extension("GL_ARB_buffer_storage")) {
        return;
    }
    constexpr std::size_t bytes = 5000;
    Staging staging;
    CHECK_FALSE(staging.is_open());
    CHECK(staging.source(staging.ring().take(bytes), 7).buffer == 0);
    staging.open(3 * bytes);
    REQUIRE(staging.is_open());
    const gl::Buffer to = gl::make_buffer(GL_COPY_WRITE_BUFFER, bytes, gl::Usage::fixed);
    std::array<std::byte, bytes> found{};
    int wrong = 0, mapped = 0;
    for (int round = 0; round < 100; ++round) {
        staging.begin_frame();
        assets::StagedBytes staged = staging.ring().take(bytes);
        for (std::size_t i = 0; i < bytes; ++i) {
            staged[i] = static_cast<std::byte>(i * 7 + static_cast<std::size_t>(round));
        }
        for (const auto &[first, count] : {std::pair<std::size_t, std::size_t>{0, 1001}, {1001, 3999}}) {
            const gl::Source source = staging.source(staged, first);
            mapped += source.buffer != 0 ? 1 : 0;
            gl::write_buffer(GL_COPY_WRITE_BUFFER, to, first, source, count);
        }
        staging.finish(std::move(staged));
        staging.end_frame();
        glGetBufferSubData(GL_COPY_WRITE_BUFFER, 0, bytes, found.data());
        for (std::size_t i = 0; i < bytes; ++i) {
            wrong += found[i] == static_cast<std::byte>(i * 7 + static_cast<std::size_t>(round)) ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
    CHECK(mapped == 200);
    staging.close();
    CHECK(staging.is_open()); // its last part waits for its fence
    glFinish();
    staging.begin_frame();
    staging.close();
    CHECK_FALSE(staging.is_open());
    test::throw_on_error();
}
