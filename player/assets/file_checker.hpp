#pragma once
// Checks files on threads while others are drawn already: first those whose pieces are wanted first, and the
// others only once begin_rest() is called, so that the first picture shares its processors with none of them.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

namespace paradize::assets {

/// Threads to read `files` files: at most one per processor.
std::size_t loader_threads(std::size_t files);

class FileChecker {
  public:
    /// Checks one file. Runs on the threads. Throws what is wrong with it, also when `stop` is requested.
    using Check = std::function<void(std::uint32_t file, const std::stop_token &stop)>;

    /// `files`: their numbers, from 0 to `count` - 1, each once. The others count as checked. `check` runs
    /// once for each file, in this order unless order() says otherwise.
    FileChecker(std::vector<std::uint32_t> files, std::size_t count, Check check);
    ~FileChecker();
    FileChecker(const FileChecker &) = delete;
    FileChecker &operator=(const FileChecker &) = delete;

    /// Replaces what is checked first. At most one entry per file counts.
    void order(std::span<const std::uint32_t> files);
    /// Lets the threads check what is not ordered; those that do have a lower priority. wait() does so if a
    /// file is wrong, finish() always.
    void begin_rest();
    /// As begin_rest(), on all threads: the caller waits for all files before it draws.
    void begin_all();
    bool checked(std::uint32_t file) const;
    /// Waits until the file is checked. Throws Error if a file is wrong: the first of
    /// them in the order of the constructor, whatever the threads do.
    void wait(std::uint32_t file);
    /// Waits for all files. Throws like wait().
    void finish();
    /// Waits for nothing. Returns true if all files are checked. Throws like wait().
    bool finished();

  private:
    enum class State : std::uint8_t { waiting, running, checked, wrong };
    void work(bool takes_rest, const std::stop_token &stop);
    const std::uint32_t *next(bool takes_rest);
    std::optional<std::string> error_of(std::uint32_t file, const std::stop_token &stop) const;
    bool error_known() const;
    void throw_error() const;

    const std::vector<std::uint32_t> files_;
    const Check check_;
    mutable std::mutex mutex_; // guards all below but the threads
    std::condition_variable_any changed_;
    bool rest_ = false;                // files that are not ordered are checked, too
    bool all_waited_for_ = false;      // all threads check them
    std::vector<State> states_;        // per number
    std::vector<std::size_t> places_;  // per number: its place in files_
    std::vector<std::string> errors_;  // per place
    std::vector<std::uint32_t> first_; // checked before the others
    std::size_t cursor_ = 0;           // no file before this place waits
    std::size_t left_ = 0;             // files that are neither checked nor wrong
    std::size_t first_error_;          // place of the first wrong file; later ones are not checked
    std::vector<std::jthread> threads_;
};

} // namespace paradize::assets
