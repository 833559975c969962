#pragma once
// Zstandard (RFC 8878), as KTX2's supercompression scheme 2 uses it: one frame a level.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

struct ZSTD_DCtx_s;

namespace paradize::assets {

/// Empty when a frame may hold `expected` bytes (it says so, or does not say); else what is wrong with it.
/// Looks at the frame's header only.
std::string frame_error(std::span<const std::byte> frame, std::uint64_t expected);

/// Unpacks frames; one thread at a time.
class Inflater {
  public:
    Inflater();
    ~Inflater();
    Inflater(const Inflater &) = delete;
    Inflater &operator=(const Inflater &) = delete;
    /// Fills `out` from one frame, and never writes beyond it. Empty when the frame held exactly that; else
    /// what is wrong with it, and `out` then holds anything.
    std::string inflate(std::span<const std::byte> frame, std::span<std::byte> out);

  private:
    std::unique_ptr<ZSTD_DCtx_s, void (*)(ZSTD_DCtx_s *)> context_;
};

} // namespace paradize::assets
