#pragma once
// Maps KTX2 formats to GL, allocates textures and uploads rows.

#include "assets/ktx2.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <string>

namespace paradize {

enum class Storage { immutable, mutable_levels };
/// Returns immutable if the driver has ARB_texture_storage.
Storage best_storage();

/// Allocates all levels; nothing can be sampled yet. Repeat and trilinear, cube maps clamp. Throws Error if
/// the driver does not support the format or the size.
gl::Texture allocate_texture(const assets::Ktx2 &ktx, const std::string &file, Storage storage);

/// Creates a one-texel placeholder: mid grey, or zero for signed and two-channel maps.
gl::Texture neutral_texture(const assets::Ktx2 &ktx);

/// Uploads rows of one level and face. Leaves the texture bound to the active unit.
void upload_rows(const gl::Texture &texture, const assets::Ktx2 &ktx, const assets::UploadChunk &chunk);

} // namespace paradize
