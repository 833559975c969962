#include "assets/file_bytes.hpp"
#include "assets/json_reader.hpp"
#include "assets/loaded_artifact.hpp"
#include "assets/scene/file.hpp"
#include "assets/sha256.hpp"
#include "error.hpp"
#include "files.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <doctest/doctest.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

using namespace paradize;

namespace {

std::string error(const std::filesystem::path &path, assets::FileSize size = {}) {
    try {
        const assets::FileBytes bytes(path, size);
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

/// Reads 100 bytes, which are 7s, at a place of a file whose memory is freed.
std::string error_of_read(const assets::FileBytes &file, std::size_t at) {
    test::Bytes part(100);
    try {
        file.read(at, part);
    } catch (const assets::SourceError &error) {
        return error.what();
    }
    CHECK(part == test::Bytes(100, std::byte{7}));
    return "";
}

bool contains(const std::string &text, const std::string &part) {
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("SHA-256: the digests of FIPS 180-4, in one part or many") {
    const std::string abc = "abc";
    CHECK(test::sha256_of(std::as_bytes(std::span(abc))) ==
          "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(test::sha256_of({}) == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    const std::string million(1000000, 'a');
    assets::Sha256 hash;
    for (std::size_t at = 0; at < million.size(); at += 997) {
        hash.add(
            std::as_bytes(std::span(million)).subspan(at, std::min<std::size_t>(997, million.size() - at)));
    }
    CHECK(hash.hex() == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
    CHECK(hash.hex() == test::sha256_of({})); // the hash restarts
}

TEST_CASE("files: the bytes are the file's, part by part, and stay when it changes") {
    const test::Folder folder;
    test::Bytes bytes((std::size_t{3} << 20U) + 17);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        bytes[i] = static_cast<std::byte>(i * 31 >> 3U);
    }
    const std::filesystem::path path = folder.write("a", bytes);
    test::Bytes parts;
    const assets::FileBytes file(path, {.exactly = bytes.size()}, [&](std::span<const std::byte> part) {
        parts.insert(parts.end(), part.begin(), part.end());
    });
    CHECK(parts == bytes);
    std::filesystem::resize_file(path, 5);
    std::filesystem::remove(path);
    CHECK(std::ranges::equal(file.bytes(), bytes));
}

TEST_CASE("files: of one so young that a change might not alter its times no stamp is believed") {
    const test::Folder folder;
    constexpr std::int64_t young_ns = 20'000'000;
    bool in_time = false;
    for (int i = 0; i < 20 && !in_time; ++i) {
        const std::filesystem::path path = folder.write("a", test::Bytes(100, std::byte{7}));
        const assets::FileBytes file(path);
        in_time = assets::now_ns() - assets::stamp_of(path).back() < young_ns;
        CHECK((!in_time || file.stamp() == assets::FileStamp{}));
    }
    CHECK(in_time);
    const std::filesystem::path old = folder.write("b", test::Bytes(100, std::byte{7}));
    std::this_thread::sleep_for(std::chrono::nanoseconds(2 * young_ns));
    CHECK(assets::FileBytes(old).stamp() == assets::stamp_of(old));
}

TEST_CASE("files: one that was replaced since it was checked keeps no memory and is refused, however young") {
    const test::Folder folder;
    test::SceneText text;
    test::write_scene(folder, text);
    const assets::SceneFile scene = assets::parse_scene(text.str(), "scene.json");
    const assets::Artifact &color = *scene.find_artifact("quad_color");
    const auto index = static_cast<std::uint32_t>(&color - scene.artifacts.data());
    assets::LoadedArtifact loaded = assets::open_artifact(scene, index, folder.path());
    assets::check_artifact(color, loaded);
    text.color_file.back() ^= std::byte{1};
    folder.write(color.file, text.color_file);
    CHECK_THROWS_AS(assets::free_memory(loaded, true), Error); // its hash or its times are others
}

TEST_CASE("files: freed bytes are read again from the open file, even if it is deleted") {
    const test::Folder folder;
    test::Bytes bytes((std::size_t{2} << 20U) + 17);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        bytes[i] = static_cast<std::byte>(i * 31 >> 3U);
    }
    const std::filesystem::path path = folder.write("a", bytes);
    assets::FileBytes file(path);
    CHECK(file.in_memory());
    const auto matches = [&](std::size_t at, std::size_t size) {
        test::Bytes part(size);
        file.read(at, part);
        return std::ranges::equal(part, std::span(bytes).subspan(at, size));
    };
    CHECK(matches(1000, 1 << 20));
    test::Bytes again; // the file is a few milliseconds old: it is read once more
    file.free_memory(
        path, [&](std::span<const std::byte> part) { again.insert(again.end(), part.begin(), part.end()); });
    CHECK((again.empty() || again == bytes));
    CHECK_FALSE(file.in_memory());
    CHECK(file.bytes().size() == bytes.size());
    std::filesystem::remove(path);
    CHECK(matches(0, bytes.size()));
    CHECK(matches(bytes.size() - 5, 5));
}

TEST_CASE("files: freed bytes of a file that was changed, cut or replaced are refused") {
    const test::Folder folder;
    const test::Bytes bytes(10000, std::byte{7});
    const auto message = [&](const auto &change, std::size_t at) -> std::string {
        const std::filesystem::path path = folder.write("a", bytes);
        assets::FileBytes file(path);
        file.free_memory(path, {});
        change(path);
        return error_of_read(file, at);
    };
    CHECK(message([](const auto &) {}, 9000).empty());
    CHECK(contains(message([](const auto &path) { std::filesystem::resize_file(path, 5000); }, 9000),
                   "a: ended at byte 9000 of 10000 while it was read"));
    CHECK(contains(message([](const auto &path) { std::filesystem::resize_file(path, 5000); }, 100),
                   "a: was changed while it was played; bake the scene again"));
    CHECK(contains(message([&](const auto & /*path*/) { folder.write("a", bytes); }, 100),
                   "a: was changed while it was played"));
    // A new file of the same name is not read: the open one is.
    CHECK(message(
              [&](const auto &path) {
                  folder.write("b", test::Bytes(10, std::byte{1}));
                  std::filesystem::rename(folder.path() / "b", path);
              },
              9000)
              .empty());
    const std::filesystem::path path = folder.write("c", bytes);
    assets::FileBytes replaced(path);
    folder.write("d", test::Bytes(10000, std::byte{8}));
    std::filesystem::rename(folder.path() / "d", path);
    assets::Sha256 hash;
    bool refused = false;
    try {
        replaced.free_memory(path, [&](std::span<const std::byte> part) { hash.add(part); });
    } catch (const Error &error) {
        refused = contains(error.what(), "c: was changed after it was checked");
    }
    CHECK((refused || hash.hex() == test::sha256_of(test::Bytes(10000, std::byte{8}))));
}

TEST_CASE(
    "files: one that may not stay open is opened again for each part, and only the checked version is") {
    const test::Folder folder;
    const test::Bytes bytes(10000, std::byte{7});
    const auto message = [&](const auto &change, std::size_t at) -> std::string {
        const std::filesystem::path path = folder.write("a", bytes);
        assets::FileBytes file(path);
        file.free_memory(path, {}, false);
        CHECK_FALSE(file.in_memory());
        CHECK(
            std::ranges::none_of(std::filesystem::directory_iterator("/proc/self/fd"), [&](const auto &open) {
                std::error_code gone; // the folder's own descriptor
                return std::filesystem::read_symlink(open, gone) == path;
            }));
        change(path);
        return error_of_read(file, at);
    };
    CHECK(message([](const auto &) {}, 9000).empty());
    CHECK(message([](const auto &path) { std::filesystem::create_hard_link(path, path.string() + "b"); }, 0)
              .empty());
    const std::string changed = "a: was changed while it was played; bake the scene again";
    CHECK(
        contains(message([](const auto &path) { std::filesystem::resize_file(path, 5000); }, 9000), changed));
    CHECK(contains(message([](const auto &path) { std::filesystem::remove(path); }, 100), changed));
    const auto folder_there = [](const auto &path) {
        std::filesystem::remove(path);
        std::filesystem::create_directory(path);
    };
    CHECK(contains(message(folder_there, 100), changed));
    std::filesystem::remove(folder.path() / "a");
    const auto pipe_there = [](const auto &path) {
        std::filesystem::remove(path);
        REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
    };
    CHECK(contains(message(pipe_there, 100), changed));
    std::filesystem::remove(folder.path() / "a");
    const auto replaced = [&](const auto &path) {
        folder.write("c", test::Bytes(10000, std::byte{8}));
        std::filesystem::rename(folder.path() / "c", path);
    };
    CHECK(contains(message(replaced, 100), changed));
}

TEST_CASE("files: there is no memory to free of one that was released, and it does not stay open") {
    const test::Folder folder;
    const std::filesystem::path path = folder.write("a", test::Bytes(10000, std::byte{7}));
    for (const bool may_stay_open : {true, false}) {
        assets::FileBytes file(path);
        file.release();
        file.free_memory(path, {}, may_stay_open);
        CHECK(file.in_memory());
        CHECK(file.bytes().empty());
    }
}

TEST_CASE("files: a version that is known is kept open unread, and another one is not") {
    const test::Folder folder;
    test::Bytes bytes(10000, std::byte{7});
    const std::filesystem::path path = folder.write("a", bytes);
    const assets::FileStamp version = assets::stamp_of(path);
    assets::FileBytes file = assets::FileBytes::reserve(path);
    for (std::size_t i = 0; i < version.size(); ++i) {
        assets::FileStamp other = version;
        ++other[i];
        CHECK_FALSE(file.keep_open(path, other));
    }
    CHECK_FALSE(file.keep_open(folder.path() / "none", version));
    CHECK(file.in_memory());
    CHECK(file.keep_open(path, version));
    CHECK_FALSE(file.in_memory());
    CHECK(file.stamp() == version);
    std::filesystem::remove(path);
    test::Bytes part(100);
    file.read(9000, part);
    CHECK(part == test::Bytes(100, std::byte{7}));
    // Its front is of the file that was replaced meanwhile.
    folder.write("b", bytes);
    assets::FileBytes replaced = assets::FileBytes::reserve(folder.path() / "b");
    bytes[5] = std::byte{8};
    folder.write("b", bytes);
    CHECK_FALSE(replaced.keep_open(folder.path() / "b", assets::stamp_of(folder.path() / "b")));
    CHECK(replaced.in_memory());
}

TEST_CASE("files: one that has not changed for 3 s is read through without memory, and stays open") {
    const char *shaders = std::getenv("PARADIZE_SHADERS");
    REQUIRE(shaders != nullptr);
    const std::filesystem::path path = std::filesystem::path(shaders) / "README.md"; // of the project: old
    const assets::FileBytes whole(path);
    assets::FileBytes file = assets::FileBytes::reserve(path);
    test::Bytes parts;
    const auto add = [&](std::span<const std::byte> part) {
        parts.insert(parts.end(), part.begin(), part.end());
    };
    REQUIRE(file.read_through(path, add));
    CHECK(std::ranges::equal(parts, whole.bytes()));
    CHECK_FALSE(file.in_memory());
    CHECK(file.stamp() == assets::stamp_of(path));
    CHECK(std::ranges::all_of(file.bytes(), [](std::byte byte) { return byte == std::byte{0}; }));
    test::Bytes tail(100);
    file.read(whole.bytes().size() - tail.size(), tail);
    CHECK(std::ranges::equal(tail, whole.bytes().last(tail.size())));
    // A young file is not even read: a change within the same second might leave its times as they are.
    const test::Folder folder;
    const std::filesystem::path young = folder.write("a", test::Bytes(10000, std::byte{7}));
    assets::FileBytes changing = assets::FileBytes::reserve(young);
    parts.clear();
    CHECK_FALSE(changing.read_through(young, add));
    CHECK(parts.empty());
    CHECK(changing.in_memory());
    // A front of another file is noticed.
    const std::filesystem::path alike = folder.write("b", test::Bytes(whole.bytes().size(), std::byte{7}));
    assets::FileBytes other = assets::FileBytes::reserve(alike);
    CHECK_THROWS_WITH_AS(other.read_through(path, add), doctest::Contains("b: was changed while it was read"),
                         Error);
}

TEST_CASE("files: irregular and empty files and wrong sizes are rejected, and a pipe does not block") {
    const test::Folder folder;
    CHECK(contains(error(folder.path() / "none"), "none: No such file"));
    CHECK(contains(error(folder.path()), "is a folder; move it away; bake the scene again"));
    CHECK(contains(error("/dev/zero"), "is not a regular file"));
    const auto pipe = folder.path() / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    CHECK(contains(error(pipe), "is not a regular file"));
    CHECK(contains(error(folder.write("empty", std::string())), "is empty"));
    const auto file = folder.write("file", std::string("1234"));
    CHECK(contains(error(file, {.exactly = 5}), "has 4 bytes, scene.json says 5; bake the scene again"));
    CHECK(contains(error(file, {.exactly = 3}), "has 4 bytes, scene.json says 3; bake the scene again"));
    CHECK(error(file, {.exactly = 4}).empty());
    CHECK(error(file, {.max = 4}).empty());
    CHECK(contains(error(file, {.max = 3}), "has 4 bytes, the limit is 3"));
    std::filesystem::resize_file(file, (std::uint64_t{1} << 32U) + 1); // a sparse file, needs no disk space
    CHECK(contains(error(file), "has 4294967297 bytes, the limit is 4294967296"));
}

TEST_CASE("files: a scene.json above the limit is rejected before it is read") {
    const test::Folder folder;
    const auto file = folder.write("scene.json", std::string("{"));
    std::filesystem::resize_file(file, assets::max_json_bytes + 1);
    CHECK_THROWS_WITH_AS(assets::read_scene(file),
                         doctest::Contains("has 67108865 bytes, the limit is 67108864"), Error);
}

TEST_CASE("files: the front is read before the rest, and must still be there when all is read") {
    const test::Folder folder;
    test::Bytes bytes((std::size_t{1} << 20U) + 100, std::byte{3});
    const std::filesystem::path path = folder.write("a", bytes);
    assets::FileBytes file = assets::FileBytes::reserve(path, {.exactly = bytes.size()});
    CHECK(file.bytes().size() == bytes.size());
    CHECK(std::ranges::equal(file.bytes().first(4096), std::span(bytes).first(4096)));
    CHECK(file.bytes()[4096] == std::byte{0});
    file.read_front(path, 5000);
    file.read_front(path, 10); // was read
    CHECK(std::ranges::equal(file.bytes().first(5000), std::span(bytes).first(5000)));
    CHECK(file.bytes()[5000] == std::byte{0});
    SUBCASE("unchanged") {
        assets::Sha256 hash;
        file.read_all(path, [&](std::span<const std::byte> part) { hash.add(part); });
        CHECK(hash.hex() == test::sha256_of(bytes));
        CHECK(std::ranges::equal(file.bytes(), bytes));
    }
    SUBCASE("changed in front") {
        bytes[4999] = std::byte{4};
        folder.write("a", bytes);
        CHECK_THROWS_WITH_AS(file.read_all(path, {}),
                             doctest::Contains("a: was changed while it was read; bake the scene again"),
                             Error);
    }
    SUBCASE("shorter") {
        std::filesystem::resize_file(path, 500);
        CHECK_THROWS_WITH_AS(file.read_all(path, {}), doctest::Contains("a: ended at byte 500 of "), Error);
        CHECK_THROWS_WITH_AS(file.read_front(path, 6000), doctest::Contains("a: ended at byte 5000 of "),
                             Error);
    }
    SUBCASE("all is front") {
        file.read_front(path, bytes.size() + 1);
        CHECK(std::ranges::equal(file.bytes(), bytes));
    }
}

TEST_CASE("files: memories side by side are zero, apart, and freed one by one") {
    constexpr std::array<std::size_t, 3> sizes{5000, 1, 4096};
    std::vector<assets::ReservedMemory> memories = assets::ReservedMemory::side_by_side(sizes);
    REQUIRE(memories.size() == sizes.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const std::span<std::byte> bytes = memories[i].bytes();
        REQUIRE(bytes.size() == sizes[i]);
        CHECK(std::ranges::all_of(bytes, [](std::byte byte) { return byte == std::byte{0}; }));
        std::ranges::fill(bytes, std::byte(i + 1));
    }
    { const assets::ReservedMemory freed = std::move(memories[1]); }
    memories[0].release();
    CHECK(memories[0].bytes()[4999] == std::byte{0});
    CHECK(memories[2].bytes()[0] == std::byte{3});
    CHECK(memories[2].bytes()[4095] == std::byte{3});
    const std::vector<std::size_t> too_large(70, std::size_t{1} << 42U);
    CHECK(assets::ReservedMemory::side_by_side(too_large).empty());
    CHECK(assets::ReservedMemory::side_by_side({}).empty());
}
