#include "app/new_file.hpp"

#include "error.hpp"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace paradize {

NewFile::NewFile(std::filesystem::path path) : path_(std::move(path)), part_(path_) {
    std::error_code ignored; // writing fails then, and says why
    if (path_.has_parent_path()) {
        std::filesystem::create_directories(path_.parent_path(), ignored);
    }
    std::string hidden(1, '.');
    hidden += path_.filename().string();
    hidden += '.';
    hidden += std::to_string(::getpid());
    part_.replace_filename(hidden);
}

NewFile::~NewFile() {
    std::error_code ignored;
    std::filesystem::remove(part_, ignored);
}

void NewFile::commit() {
    std::error_code failure;
    std::filesystem::rename(part_, path_, failure);
    if (failure) {
        fail(failure.value());
    }
}

void NewFile::fail(int error, const std::string &why) const {
    const char *const mend = error == ENOSPC || error == EDQUOT ? "free space there, or "
                             : error == EFBIG                   ? "allow larger files (`ulimit -f`), or "
                                                                : "";
    throw Error(path_.string() + ": cannot write: " + (error != 0 ? std::strerror(error) : why) + "; " +
                mend + "name another file");
}

} // namespace paradize
