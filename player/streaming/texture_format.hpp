#pragma once
// Maps KTX2 formats to GL, allocates textures and uploads rows.

#include "assets/ktx2.hpp"
#include "assets/upload_plan.hpp"
#include "gl/buffer.hpp"
#include "gl/handle.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace paradize {

enum class Storage { immutable, mutable_levels };
/// Returns immutable if the driver has ARB_texture_storage.
Storage best_storage();

/// Throws Error if the driver does not support the texture's format or size.
void check_support(const assets::Ktx2 &ktx, const std::string &file);

/// Allocates the levels from `first_level` of the file on, as levels 0, 1 ... of the texture. Nothing can be
/// sampled until make_sampled(). Repeat and trilinear, cube maps clamp.
gl::Texture allocate_texture(const assets::Ktx2 &ktx, std::uint32_t first_level, Storage storage);
/// A texture and the level of the file that is its level 0.
struct LevelsFrom {
    const gl::Texture &texture;
    std::uint32_t first_level = 0;
};
/// Makes the levels of the file from `finest` on visible. While finer ones are missing, `max_level` is the
/// coarsest level of the file to sample: samplers count from the finest one that is visible.
void make_sampled(const assets::Ktx2 &ktx, LevelsFrom levels, std::uint32_t finest,
                  std::optional<int> max_level);

/// Copies the levels that both have, on the device where the driver has ARB_copy_image.
void copy_levels(const assets::Ktx2 &ktx, LevelsFrom from, LevelsFrom to);
/// The same without ARB_copy_image.
void copy_levels_by_memory(const assets::Ktx2 &ktx, LevelsFrom from, LevelsFrom to);
/// Reads the levels from `first` of the file on into `out`, finest first, and writes what was read. Reading
/// waits for the device.
void read_levels(const assets::Ktx2 &ktx, LevelsFrom from, std::uint32_t first, std::vector<std::byte> &out);
void write_levels(const assets::Ktx2 &ktx, LevelsFrom to, std::uint32_t first,
                  std::span<const std::byte> bytes);

/// Creates a one-texel placeholder: mid grey, or zero for signed and two-channel maps.
gl::Texture neutral_texture(const assets::Ktx2 &ktx);

/// Uploads rows of one level and face. `from` has the chunk's bytes. Leaves the texture bound to the active
/// unit.
void upload_rows(LevelsFrom to, const assets::Ktx2 &ktx, const assets::UploadChunk &chunk,
                 const gl::Source &from);

} // namespace paradize
