#pragma once
// A sound file that libsndfile has open.

#include <memory>
#include <sndfile.h>

namespace paradize {

struct CloseSound {
    void operator()(SNDFILE *file) const { sf_close(file); }
};
using OpenSound = std::unique_ptr<SNDFILE, CloseSound>;

} // namespace paradize
