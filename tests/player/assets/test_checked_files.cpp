// The next start knows which versions of files were checked, and no others.
#include "assets/checked_files.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <string>
#include <sys/stat.h>
#include <vector>

using namespace paradize;
namespace fs = std::filesystem;

namespace {

constexpr assets::FileStamp version{7, 42, 1000, 2'000'000'000, 3'000'000'000};
constexpr std::int64_t later_ns = 60'000'000'000;

assets::Artifact artifact(char digit = 'a') {
    assets::Artifact out;
    out.kind = assets::ArtifactKind::texture;
    out.sha256 = std::string(64, digit);
    return out;
}

void write_record(const fs::path &record, const assets::Artifact &checked) {
    assets::CheckedFiles files(record, "a player");
    files.add(checked, version, later_ns);
    files.save(true);
}

} // namespace

TEST_CASE("checked files: the next start of the same player knows this version of a file, and no other") {
    const test::Folder folder;
    const fs::path record = folder.path() / "new/record";
    write_record(record, artifact());
    CHECK(assets::CheckedFiles(record, "a player").holds(artifact(), version));
    CHECK_FALSE(assets::CheckedFiles(record, "another player").holds(artifact(), version));
    CHECK_FALSE(assets::CheckedFiles(folder.path() / "none", "a player").holds(artifact(), version));
    assets::CheckedFiles files(record, "a player");
    for (std::size_t i = 0; i < version.size(); ++i) {
        assets::FileStamp other = version;
        ++other[i];
        CHECK_FALSE(files.holds(artifact(), other));
    }
    CHECK_FALSE(files.holds(artifact('b'), version));
    assets::Artifact mesh = artifact();
    mesh.kind = assets::ArtifactKind::mesh;
    CHECK_FALSE(files.holds(mesh, version));
}

TEST_CASE("checked files: a file so young that a change might not alter its times is forgotten") {
    const test::Folder folder;
    const fs::path record = folder.path() / "record";
    assets::CheckedFiles files(record, "a player");
    files.add(artifact(), {}, later_ns);
    files.add(artifact(), version, version[4] + 2'900'000'000);
    files.save(true);
    CHECK_FALSE(fs::exists(record));
    files.add(artifact(), version, version[4] + 3'100'000'000);
    files.save(true);
    CHECK(assets::CheckedFiles(record, "a player").holds(artifact(), version));
}

TEST_CASE("checked files: a record forgets what a start has not named, unless that ended early") {
    for (const bool all : {true, false}) {
        const test::Folder folder;
        const fs::path record = folder.path() / "record";
        write_record(record, artifact('a'));
        {
            assets::CheckedFiles files(record, "a player");
            files.add(artifact('b'), version, later_ns);
            files.save(all);
        }
        assets::CheckedFiles files(record, "a player");
        CHECK(files.holds(artifact('a'), version) != all);
        CHECK(files.holds(artifact('b'), version));
    }
}

TEST_CASE("checked files: where no record can be written, nothing is known and nothing fails") {
    const test::Folder folder;
    folder.write("file", std::string("no folder"));
    write_record(folder.path() / "file/record", artifact());
    CHECK_FALSE(assets::CheckedFiles(folder.path() / "file/record", "a player").holds(artifact(), version));
    assets::CheckedFiles nameless("", "a player");
    nameless.add(artifact(), version, later_ns);
    nameless.save(true);
}

TEST_CASE("checked files: a record that is no plain file, or too large, is not read, and is replaced") {
    const test::Folder folder;
    const fs::path record = folder.path() / "record";
    const auto replaced = [&] {
        CHECK_FALSE(assets::CheckedFiles(record, "a player").holds(artifact(), version));
        write_record(record, artifact());
        return assets::CheckedFiles(record, "a player").holds(artifact(), version);
    };
    REQUIRE(::mkfifo(record.c_str(), 0600) == 0);
    CHECK(replaced());
    fs::resize_file(record, assets::CheckedFiles::most_bytes + 1);
    CHECK(replaced());
    fs::remove(record);
    fs::create_directory(record);
    CHECK_FALSE(replaced());
    CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1); // no half is left
}

TEST_CASE("checked files: the records that were used last are kept, and so is all that is no record") {
    const test::Folder folder;
    const auto name = [](std::size_t i) {
        const std::string digits = std::to_string(i);
        return std::string(64 - digits.size(), 'a') + digits + ".checked";
    };
    const auto age = [&](const fs::path &path, std::size_t s) {
        fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::seconds(s));
    };
    const std::vector<std::string> others = {"letter.txt", std::string(64, 'a'),
                                             std::string(64, 'a') + ".png", std::string(63, 'a') + ".checked",
                                             std::string(65, 'a') + ".checked"};
    for (const std::string &other : others) {
        age(folder.write(other, std::string("not ours")), 9000);
    }
    fs::create_directory(folder.path() / (std::string(64, 'b') + ".checked"));
    fs::create_symlink("letter.txt", folder.path() / (std::string(64, 'c') + ".checked"));
    for (std::size_t i = 0; i < assets::CheckedFiles::most_records; ++i) {
        write_record(folder.path() / name(i), artifact());
        age(folder.path() / name(i), 1000 - i);
    }
    {
        assets::CheckedFiles used(folder.path() / name(0), "a player");
        CHECK(used.holds(artifact(), version));
        used.save(true);
    }
    write_record(folder.path() / name(1000), artifact());
    CHECK(fs::exists(folder.path() / name(0)));
    CHECK_FALSE(fs::exists(folder.path() / name(1)));
    CHECK(fs::exists(folder.path() / name(2)));
    CHECK(fs::exists(folder.path() / name(1000)));
    for (const std::string &other : others) {
        CHECK(fs::exists(folder.path() / other));
    }
    CHECK(fs::is_directory(folder.path() / (std::string(64, 'b') + ".checked")));
    CHECK(fs::is_symlink(folder.path() / (std::string(64, 'c') + ".checked")));
}
