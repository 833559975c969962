#include "assets/inflate.hpp"

#include "error.hpp"

#include <zstd.h>

namespace paradize::assets {

std::string frame_error(std::span<const std::byte> frame, std::uint64_t expected) {
    const unsigned long long stated_bytes = ZSTD_getFrameContentSize(frame.data(), frame.size());
    if (stated_bytes == ZSTD_CONTENTSIZE_ERROR) {
        return "is not a Zstandard frame";
    }
    // A skippable frame states 0, and no level is empty.
    if (stated_bytes != ZSTD_CONTENTSIZE_UNKNOWN && stated_bytes != expected) {
        return "its Zstandard frame says " + std::to_string(stated_bytes) + " bytes, expected " +
               std::to_string(expected);
    }
    return {};
}

Inflater::Inflater() : context_(ZSTD_createDCtx(), [](ZSTD_DCtx_s *context) { ZSTD_freeDCtx(context); }) {
    if (context_ == nullptr) {
        throw Error("no memory for Zstandard");
    }
}

Inflater::~Inflater() = default;

std::string Inflater::inflate(std::span<const std::byte> frame, std::span<std::byte> out) {
    const std::size_t length = ZSTD_findFrameCompressedSize(frame.data(), frame.size());
    if (ZSTD_isError(length) != 0U) {
        return std::string("its Zstandard frame is damaged: ") + ZSTD_getErrorName(length);
    }
    if (length != frame.size()) {
        return std::to_string(frame.size() - length) + " bytes follow its Zstandard frame";
    }
    const std::size_t made =
        ZSTD_decompressDCtx(context_.get(), out.data(), out.size(), frame.data(), frame.size());
    if (ZSTD_isError(made) != 0U) {
        return std::string("its Zstandard frame is damaged: ") + ZSTD_getErrorName(made);
    }
    if (made != out.size()) {
        return "its Zstandard frame holds " + std::to_string(made) + " bytes, expected " +
               std::to_string(out.size());
    }
    return {};
}

} // namespace paradize::assets
