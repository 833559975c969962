#include "assets/file_bytes.hpp"
#include "assets/json_reader.hpp"
#include "assets/scene_file.hpp"
#include "assets/sha256.hpp"
#include "error.hpp"
#include "files.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <sys/stat.h>
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

bool contains(const std::string &text, const std::string &part) {
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("SHA-256: the digests of FIPS 180-4, in one part or many") {
    const std::string abc = "abc";
    CHECK(assets::sha256_of(std::as_bytes(std::span(abc))) ==
          "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(assets::sha256_of({}) == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    const std::string million(1000000, 'a');
    assets::Sha256 hash;
    for (std::size_t at = 0; at < million.size(); at += 997) {
        hash.add(
            std::as_bytes(std::span(million)).subspan(at, std::min<std::size_t>(997, million.size() - at)));
    }
    CHECK(hash.hex() == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
    CHECK(hash.hex() == assets::sha256_of({})); // the hash restarts
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

TEST_CASE("files: a released part is read again part by part, and kept bytes are not overwritten") {
    const test::Folder folder;
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    test::Bytes bytes((std::size_t{2} << 20U) + 3 * page);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        bytes[i] = static_cast<std::byte>(i * 31 >> 3U);
    }
    const std::filesystem::path path = folder.write("a", bytes);
    assets::FileBytes file(path);
    // rounded up to whole pages, this keeps everything
    CHECK_FALSE(file.release_from(path, bytes.size() - page + 1));
    CHECK(file.release_from(path, (std::size_t{1} << 20U) + 1));
    const std::size_t kept = (std::size_t{1} << 20U) + page;
    CHECK(std::ranges::equal(file.bytes().first(kept), std::span(bytes).first(kept)));
    std::filesystem::remove(path); // the open descriptor keeps the content
    test::Bytes parts;
    file.reload(
        "a", [&](std::span<const std::byte> part) { parts.insert(parts.end(), part.begin(), part.end()); });
    CHECK(parts == bytes);
    CHECK(std::ranges::equal(file.bytes(), bytes));
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
