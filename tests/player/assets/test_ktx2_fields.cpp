// Sets every number in a KTX2 file to its extreme values.
#include "assets/inflate.hpp"
#include "assets/ktx2.hpp"
#include "error.hpp"
#include "files.hpp"

#include <cstring>
#include <doctest/doctest.h>
#include <limits>
#include <vector>

using namespace paradize;
using assets::PixelFormat;

namespace {

constexpr std::size_t level_count = 5;

template <typename T>
test::Bytes with(test::Bytes file, std::size_t at, T value) {
    std::memcpy(file.data() + at, &value, sizeof value);
    return file;
}

/// Values around 0, the file size, half the range, the whole range and powers of two, where arithmetic may
/// overflow.
template <typename T>
std::vector<T> ends(std::size_t length) {
    std::vector<T> out;
    const T top = std::numeric_limits<T>::max();
    for (const T near : {T{0}, static_cast<T>(length), static_cast<T>(top / 2), top, T{1} << 16U,
                         static_cast<T>(T{1} << 31U), static_cast<T>(top - length)}) {
        for (const int step : {-2, -1, 0, 1, 2}) {
            out.push_back(static_cast<T>(near + static_cast<T>(step))); // wraps around to the other extreme
        }
    }
    return out;
}

/// The file is read and decompressed without leaving its bytes, or rejected by name.
void check_harmless(const test::Bytes &wrong) {
    try {
        const assets::Ktx2 ktx = test::read_ktx2(wrong, "wrong.ktx2");
        assets::Inflater inflater;
        for (const assets::Ktx2Level &level : ktx.levels) {
            const auto held = level.compressed.empty() ? level.bytes : level.compressed;
            CHECK(held.data() >= wrong.data());
            CHECK(held.data() + held.size() <= wrong.data() + wrong.size());
            if (!level.compressed.empty()) {
                // ASan checks the accesses
                static_cast<void>(inflater.inflate(level.compressed, level.inflated));
            }
        }
    } catch (const Error &error) {
        CHECK(std::string(error.what()).starts_with("wrong.ktx2: "));
    }
}

} // namespace

TEST_CASE("KTX2: every field at its extreme values is rejected by name or harmless") {
    for (const test::Bytes &file : {test::ktx2_file(PixelFormat::rg8_snorm, 16, 8),
                                    test::zstd_ktx2_file(PixelFormat::rg8_snorm, 16, 8)}) {
        for (std::size_t at = 12; at < 64; at += 4) {
            for (const auto value : ends<std::uint32_t>(file.size())) {
                check_harmless(with(file, at, value));
            }
        }
        for (std::size_t at = 64; at < 80 + 24 * level_count; at += 8) {
            for (const auto value : ends<std::uint64_t>(file.size())) {
                check_harmless(with(file, at, value));
            }
        }
    }
}

TEST_CASE("KTX2: an offset and a length whose sum overflows stay inside the file") {
    for (const test::Bytes &file : {test::ktx2_file(PixelFormat::rg8_snorm, 16, 8),
                                    test::zstd_ktx2_file(PixelFormat::rg8_snorm, 16, 8)}) {
        for (std::size_t entry = 80; entry < 80 + 24 * level_count; entry += 24) {
            for (const auto offset : ends<std::uint64_t>(file.size())) {
                const test::Bytes moved = with(file, entry, offset);
                check_harmless(moved);
                for (const auto length : ends<std::uint64_t>(file.size())) {
                    check_harmless(with(moved, entry + 8, length));
                }
            }
        }
    }
}
