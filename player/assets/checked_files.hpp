#pragma once
// Which files of a scene were checked by an earlier start of this player: they are not read for a check again
// while their device, inode, size and times stay the same.

#include "assets/file_bytes.hpp"
#include "assets/scene/file.hpp"

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>

namespace paradize::assets {

class CheckedFiles {
  public:
    /// Records of so many scenes are kept, those that were used last.
    static constexpr std::size_t most_records = 64;
    /// A larger record is not read: some 100,000 files.
    static constexpr std::uintmax_t most_bytes = std::uintmax_t{16} << 20U;

    /// Reads the scene's record in the folder $PARADIZE_CHECKED (empty: nowhere), by default
    /// $XDG_CACHE_HOME/paradize/checked or ~/.cache/paradize/checked. Nothing is known where there is none,
    /// or where another player has written it.
    explicit CheckedFiles(const std::filesystem::path &scene_folder);
    /// The same with a record of the caller's choice (records are named by 64 hex digits and ".checked":
    /// others are never removed), and with what tells one player from another.
    CheckedFiles(std::filesystem::path record, std::string player);

    /// True if this version of the artifact's file was checked. Any thread may call it.
    bool holds(const Artifact &artifact, const FileStamp &stamp);
    /// The file was checked at `now_ns` (since 1970). Forgotten if its stamp is zero or so young that a
    /// change might not alter it. Any thread may call it.
    void add(const Artifact &artifact, const FileStamp &stamp, std::int64_t now_ns);
    /// Writes the record, if it has changed. `all`: of every file of the scene holds() or add() was called,
    /// so that others are forgotten. Where it cannot be written, the next start checks more files. Any thread
    /// may call it.
    void save(bool all) noexcept;

  private:
    void write(const std::set<std::string> &lines) const;

    const std::filesystem::path record_; // empty: none
    const std::string player_;
    std::set<std::string> known_; // a line for each file
    std::mutex mutex_;            // guards what follows
    std::set<std::string> current_;
};

} // namespace paradize::assets
