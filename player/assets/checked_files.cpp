#include "assets/checked_files.hpp"

#include "assets/sha256.hpp"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <span>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

namespace paradize::assets {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view suffix = ".checked";

// The coarsest steps of a time stamp are those of FAT, 2 s.
constexpr std::int64_t stamp_step_ns = 3'000'000'000;

std::string text_of(const FileStamp &stamp) {
    std::string out;
    for (const std::int64_t number : stamp) {
        out += ' ' + std::to_string(number);
    }
    return out;
}

std::string line_of(const Artifact &artifact, const FileStamp &stamp) {
    return artifact.sha256 + ' ' + std::to_string(static_cast<int>(artifact.kind)) + text_of(stamp);
}

fs::path records() {
    if (const char *named = std::getenv("PARADIZE_CHECKED"); named != nullptr) {
        return named;
    }
    if (const char *cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/') {
        return fs::path(cache) / "paradize/checked";
    }
    const char *home = std::getenv("HOME");
    return home != nullptr && *home == '/' ? fs::path(home) / ".cache/paradize/checked" : fs::path();
}

fs::path record_of(const fs::path &scene_folder) {
    std::error_code failed;
    const std::string path = fs::canonical(scene_folder, failed).string();
    const fs::path folder = records();
    if (failed || folder.empty()) {
        return {};
    }
    Sha256 hash;
    hash.add(std::as_bytes(std::span(path)));
    return folder / (hash.hex() + std::string(suffix));
}

/// Another player may check more.
std::string this_player() {
    const FileStamp stamp = stamp_of("/proc/self/exe");
    return stamp == FileStamp{} ? "" : "paradize-player" + text_of(stamp);
}

/// Of a record, or of one that was not written to its end. Nothing else in the folder is ours.
bool is_record(const fs::directory_entry &entry) {
    constexpr std::size_t digits = 64;
    const std::string name = entry.path().filename().string();
    return entry.symlink_status().type() == fs::file_type::regular &&
           name.find_first_not_of("0123456789abcdef") == digits && name.substr(digits).starts_with(suffix);
}

void remove_oldest(const fs::path &folder) {
    std::vector<std::pair<fs::file_time_type, fs::path>> all;
    for (const fs::directory_entry &entry : fs::directory_iterator(folder)) {
        if (is_record(entry)) {
            all.emplace_back(entry.last_write_time(), entry.path());
        }
    }
    std::ranges::sort(all);
    for (std::size_t i = 0; i + CheckedFiles::most_records < all.size(); ++i) {
        fs::remove(all[i].second);
    }
}

} // namespace

CheckedFiles::CheckedFiles(const fs::path &scene_folder)
    : CheckedFiles(record_of(scene_folder), this_player()) {}

CheckedFiles::CheckedFiles(fs::path record, std::string player)
    : record_(player.empty() ? fs::path() : std::move(record)), player_(std::move(player)) {
    std::error_code failed;
    if (fs::file_size(record_, failed) > most_bytes) { // so is what is no plain file
        return;
    }
    std::ifstream file(record_);
    std::string line;
    if (std::getline(file, line) && line == player_) {
        while (std::getline(file, line)) {
            known_.insert(line);
        }
    }
}

bool CheckedFiles::holds(const Artifact &artifact, const FileStamp &stamp) {
    const std::string line = line_of(artifact, stamp);
    if (!known_.contains(line)) {
        return false;
    }
    const std::lock_guard lock(mutex_);
    current_.insert(line);
    return true;
}

void CheckedFiles::add(const Artifact &artifact, const FileStamp &stamp, std::int64_t now_ns) {
    const std::int64_t changed_ns = std::max(stamp[3], stamp[4]); // its bytes or links
    if (!record_.empty() && stamp != FileStamp{} && now_ns - changed_ns > stamp_step_ns) {
        const std::lock_guard lock(mutex_);
        current_.insert(line_of(artifact, stamp));
    }
}

void CheckedFiles::save(bool all) noexcept {
    try {
        const std::lock_guard lock(mutex_);
        if (record_.empty()) {
            return;
        }
        std::set<std::string> lines = current_;
        if (!all) {
            lines.insert(known_.begin(), known_.end());
        }
        if (lines != known_) {
            write(lines);
        } else if (!lines.empty()) {
            fs::last_write_time(record_, fs::file_time_type::clock::now()); // used
        }
    } catch (const std::exception &) { // a record saves time alone
    }
}

void CheckedFiles::write(const std::set<std::string> &lines) const {
    fs::create_directories(record_.parent_path());
    std::string half = record_.string() + ".XXXXXX";
    const int made = ::mkstemp(half.data());
    if (made < 0) {
        return;
    }
    ::close(made);
    std::ofstream file(half);
    file << player_ << '\n';
    for (const std::string &line : lines) {
        file << line << '\n';
    }
    file.close();
    std::error_code failed;
    if (file) {
        fs::rename(half, record_, failed);
    }
    if (!file || failed) {
        fs::remove(half, failed);
        return;
    }
    remove_oldest(record_.parent_path());
}

} // namespace paradize::assets
