#pragma once
// From what KTX2 says to what GL takes.

#include "assets/ktx2.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <string>

namespace paradize {

enum class Storage { immutable, mutable_levels };
/// Immutable where the driver has ARB_texture_storage.
Storage best_storage();

/// Storage for all levels; nothing can be sampled yet. Repeats and filters trilinearly; cube maps clamp.
/// Throws Error when the driver does not sample the format or the size.
gl::Texture allocate_texture(const assets::Ktx2 &ktx, const std::string &file, Storage storage);

/// One texel that stands in until data is there: mid grey, or zero for signed and two-channel maps.
gl::Texture neutral_texture(const assets::Ktx2 &ktx);

/// Uploads rows of one level and face. Leaves the texture bound to the active unit.
void upload_rows(const gl::Texture &texture, const assets::Ktx2 &ktx, const assets::UploadChunk &chunk);

} // namespace paradize
