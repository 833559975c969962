#pragma once
// Checks the numbers in a file before they are drawn: when the file is loaded or a level decompressed, never
// per frame.

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"

#include <string>

namespace paradize::assets {

/// Throws Error for a position outside the accessor's bounds, a normal or tangent that is not of unit length,
/// a texture coordinate or colour out of range, an index beyond the vertices, and any value that is not
/// finite. The message names node, attribute or primitive, and vertex or index.
void check_mesh(const Glb &glb, const std::string &name);

/// The same for one level.
void check_level(const GlbLevel &level, const std::string &name);

/// Returns what is wrong with a level's texels (face, texel, channel), or an empty text. Only float formats
/// can be wrong.
std::string texel_error(const Ktx2Level &level);
/// Throws Error for the first error in the levels that are not supercompressed.
void check_texels(const Ktx2 &ktx, const std::string &name);

} // namespace paradize::assets
