#include "assets/file_checker.hpp"

#include "assets/thread_priority.hpp"
#include "error.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace paradize::assets {

std::size_t loader_threads(std::size_t files) {
    constexpr unsigned max_threads = 8;
    return std::min<std::size_t>(files, std::clamp(std::thread::hardware_concurrency(), 1U, max_threads));
}

FileChecker::FileChecker(std::vector<std::uint32_t> files, std::size_t count, Check check)
    : files_(std::move(files)), check_(std::move(check)), states_(count, State::checked), places_(count),
      errors_(files_.size()), left_(files_.size()), first_error_(files_.size()) {
    first_.reserve(files_.size() + 1); // and one that is waited for
    for (std::size_t place = 0; place < files_.size(); ++place) {
        states_[files_[place]] = State::waiting;
        places_[files_[place]] = place;
    }
    const std::size_t threads = loader_threads(files_.size());
    for (std::size_t i = 0; i < threads; ++i) {
        // One thread is free for what is needed now. The others yield to it and to drawing.
        const bool takes_rest = i != 0 || threads == 1;
        threads_.emplace_back([this, takes_rest](const std::stop_token &stop) { work(takes_rest, stop); });
    }
}

FileChecker::~FileChecker() {
    for (std::jthread &thread : threads_) {
        thread.request_stop(); // all threads stop before the first is joined
    }
}

void FileChecker::order(std::span<const std::uint32_t> files) {
    const std::lock_guard lock(mutex_);
    changed_.notify_all();
    first_.assign(files.begin(),
                  files.begin() + static_cast<std::ptrdiff_t>(std::min(files.size(), files_.size())));
}

/// Returns the file to check next, or nullptr if there is none.
const std::uint32_t *FileChecker::next(bool takes_rest) {
    const auto waits = [&](std::uint32_t file) {
        return states_[file] == State::waiting && places_[file] < first_error_;
    };
    if (const auto found = std::ranges::find_if(first_, waits); found != first_.end()) {
        return &*found;
    }
    while (cursor_ < files_.size() && states_[files_[cursor_]] != State::waiting) {
        ++cursor_;
    }
    return ((rest_ && takes_rest) || all_waited_for_) && cursor_ < first_error_ ? &files_[cursor_] : nullptr;
}

std::optional<std::string> FileChecker::error_of(std::uint32_t file, const std::stop_token &stop) const {
    try {
        check_(file, stop);
        return std::nullopt;
    } catch (const std::exception &error) { // the drawing thread throws it
        return error.what();
    }
}

void FileChecker::work(bool takes_rest, const std::stop_token &stop) {
    if (takes_rest) {
        yield_to_drawing();
    }
    std::unique_lock lock(mutex_);
    while (true) {
        const std::uint32_t *found = nullptr;
        changed_.wait(lock, stop, [&] {
            found = next(takes_rest);
            return found != nullptr || cursor_ >= first_error_;
        });
        if (found == nullptr || stop.stop_requested()) {
            return; // nothing is left
        }
        const std::uint32_t file = *found;
        states_[file] = State::running;
        lock.unlock();
        const std::optional<std::string> error = error_of(file, stop);
        lock.lock();
        states_[file] = error ? State::wrong : State::checked;
        --left_;
        if (error) {
            rest_ = all_waited_for_ = true; // a file before it may be wrong, too
            errors_[places_[file]] = *error;
            first_error_ = std::min(first_error_, places_[file]);
        }
        changed_.notify_all();
    }
}

/// True if a file is wrong and all before it are checked.
bool FileChecker::error_known() const {
    return first_error_ < files_.size() &&
           std::all_of(files_.begin(), files_.begin() + static_cast<std::ptrdiff_t>(first_error_),
                       [&](std::uint32_t file) { return states_[file] == State::checked; });
}

void FileChecker::throw_error() const {
    if (error_known()) {
        throw Error(errors_[first_error_]);
    }
}

bool FileChecker::checked(std::uint32_t file) const {
    const std::lock_guard lock(mutex_);
    return states_[file] == State::checked;
}

void FileChecker::wait(std::uint32_t file) {
    std::unique_lock lock(mutex_);
    if (states_[file] == State::waiting && std::ranges::find(first_, file) == first_.end()) {
        first_.insert(first_.begin(), file);
        changed_.notify_all();
    }
    changed_.wait(lock, [&] { return states_[file] == State::checked || error_known(); });
    if (states_[file] != State::checked) {
        throw_error();
    }
}

void FileChecker::begin_rest() {
    const std::lock_guard lock(mutex_);
    if (!rest_) {
        rest_ = true;
        changed_.notify_all();
    }
}

void FileChecker::begin_all() {
    const std::lock_guard lock(mutex_);
    if (!all_waited_for_) {
        rest_ = all_waited_for_ = true;
        changed_.notify_all();
    }
}

void FileChecker::finish() {
    begin_all();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return left_ == 0 || error_known(); });
    throw_error();
}

bool FileChecker::finished() {
    const std::lock_guard lock(mutex_);
    throw_error();
    return left_ == 0;
}

} // namespace paradize::assets
