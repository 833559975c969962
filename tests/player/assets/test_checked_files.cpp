// The next start knows which versions of files were checked, and no others.
#include "assets/checked_files.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

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
    files.save();
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
    files.save();
    CHECK_FALSE(fs::exists(record));
    files.add(artifact(), version, version[4] + 3'100'000'000);
    files.save();
    CHECK(assets::CheckedFiles(record, "a player").holds(artifact(), version));
}

TEST_CASE("checked files: a record keeps what its last start has named") {
    const test::Folder folder;
    const fs::path record = folder.path() / "record";
    write_record(record, artifact('a'));
    {
        assets::CheckedFiles files(record, "a player");
        files.add(artifact('b'), version, later_ns);
        files.save();
    }
    assets::CheckedFiles files(record, "a player");
    CHECK_FALSE(files.holds(artifact('a'), version));
    CHECK(files.holds(artifact('b'), version));
}

TEST_CASE("checked files: where no record can be written, nothing is known and nothing fails") {
    const test::Folder folder;
    folder.write("file", std::string("no folder"));
    write_record(folder.path() / "file/record", artifact());
    CHECK_FALSE(assets::CheckedFiles(folder.path() / "file/record", "a player").holds(artifact(), version));
    assets::CheckedFiles nameless("", "a player");
    nameless.add(artifact(), version, later_ns);
    nameless.save();
}

TEST_CASE("checked files: the records that were written last are kept") {
    const test::Folder folder;
    for (std::size_t i = 0; i < assets::CheckedFiles::most_records; ++i) {
        const fs::path record = folder.path() / ("old" + std::to_string(i));
        write_record(record, artifact());
        fs::last_write_time(record, fs::last_write_time(record) - std::chrono::seconds(100 - i));
    }
    write_record(folder.path() / "new", artifact());
    CHECK_FALSE(fs::exists(folder.path() / "old0"));
    CHECK(fs::exists(folder.path() / "old1"));
    CHECK(fs::exists(folder.path() / "new"));
    std::size_t count = 0;
    for ([[maybe_unused]] const fs::directory_entry &entry : fs::directory_iterator(folder.path())) {
        ++count;
    }
    CHECK(count == assets::CheckedFiles::most_records);
}
