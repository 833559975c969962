#pragma once
// Zstandard (RFC 8878) as in KTX2's supercompression scheme 2: one frame per level.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

struct ZSTD_DCtx_s;

namespace paradize::assets {

/// Checks the header of a frame. Returns an empty text if it states `expected` bytes or no size, else what is
/// wrong.
std::string frame_error(std::span<const std::byte> frame, std::uint64_t expected);

/// Decompresses frames. Use one object per thread.
class Inflater {
  public:
    Inflater();
    ~Inflater();
    Inflater(const Inflater &) = delete;
    Inflater &operator=(const Inflater &) = delete;
    /// Decompresses one frame into `out`. Returns an empty text if the frame held exactly out.size() bytes,
    /// else what is wrong; `out` is then undefined. Never writes past `out`.
    std::string inflate(std::span<const std::byte> frame, std::span<std::byte> out);

  private:
    std::unique_ptr<ZSTD_DCtx_s, void (*)(ZSTD_DCtx_s *)> context_;
};

} // namespace paradize::assets
