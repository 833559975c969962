#include "assets/checked_files.hpp"

#include "assets/sha256.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <span>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

namespace paradize::assets {

namespace {

namespace fs = std::filesystem;

// The coarsest steps of a time stamp are those of FAT, 2 s.
constexpr std::int64_t young_ns = 3'000'000'000;

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
    return folder / hash.hex();
}

/// Another player may check more.
std::string this_player() {
    const FileStamp stamp = stamp_of("/proc/self/exe");
    return stamp == FileStamp{} ? "" : "paradize-player" + text_of(stamp);
}

void remove_oldest(const fs::path &folder) {
    std::error_code failed;
    std::vector<std::pair<fs::file_time_type, fs::path>> all;
    for (const fs::directory_entry &entry : fs::directory_iterator(folder, failed)) {
        all.emplace_back(entry.last_write_time(failed), entry.path());
    }
    std::ranges::sort(all);
    for (std::size_t i = 0; i + CheckedFiles::most_records < all.size(); ++i) {
        fs::remove(all[i].second, failed);
    }
}

} // namespace

CheckedFiles::CheckedFiles(const fs::path &scene_folder)
    : CheckedFiles(record_of(scene_folder), this_player()) {}

CheckedFiles::CheckedFiles(fs::path record, std::string player)
    : record_(player.empty() ? fs::path() : std::move(record)), player_(std::move(player)) {
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
    const auto changed_ns = std::max(stamp[3], stamp[4]);
    if (stamp != FileStamp{} && now_ns - changed_ns > young_ns) {
        const std::lock_guard lock(mutex_);
        current_.insert(line_of(artifact, stamp));
    }
}

void CheckedFiles::save() {
    const std::lock_guard lock(mutex_);
    if (record_.empty() || current_ == known_) {
        return;
    }
    std::error_code failed;
    fs::create_directories(record_.parent_path(), failed);
    const fs::path half = record_.string() + '.' + std::to_string(::getpid());
    {
        std::ofstream file(half);
        file << player_ << '\n';
        for (const std::string &line : current_) {
            file << line << '\n';
        }
        if (!file.flush()) {
            fs::remove(half, failed);
            return;
        }
    }
    fs::rename(half, record_, failed);
    remove_oldest(record_.parent_path());
}

} // namespace paradize::assets
