#pragma once
// A file that appears whole or not at all: it is written under a hidden name beside its place, then renamed.

#include <filesystem>
#include <string>

namespace paradize {

class NewFile {
  public:
    /// Makes missing folders.
    explicit NewFile(std::filesystem::path path);
    /// Removes what was written, unless commit() was called.
    ~NewFile();
    NewFile(const NewFile &) = delete;
    NewFile &operator=(const NewFile &) = delete;

    /// Write here.
    const std::filesystem::path &part() const { return part_; }
    /// Throws Error.
    void commit();
    /// Throws Error that the file cannot be written, why, and what to do. error: errno of the write that
    /// failed; 0: unknown, and `why` says it.
    [[noreturn]] void fail(int error, const std::string &why = "") const;

  private:
    std::filesystem::path path_, part_;
};

} // namespace paradize
