#pragma once
// Are the numbers that a file holds numbers that can be drawn? Looked at once, when the file is opened or a
// level inflated: never in a frame.

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"

#include <string>

namespace paradize::assets {

/// Throws Error, with node, attribute or primitive, and vertex or index, for a position outside the bounds
/// that its accessor states, a normal or tangent that is not of unit length, a texture coordinate or colour
/// out of range, an index beyond the vertices; and for everything that is not finite.
void check_mesh(const Glb &glb, const std::string &name);

/// What is wrong with the texels of a level, with face, texel and channel; empty: nothing. Only floats can be
/// wrong: any bits of the other formats are a colour.
std::string texel_error(const Ktx2Level &level);
/// Throws Error for the first fault in the levels that are not supercompressed.
void check_texels(const Ktx2 &ktx, const std::string &name);

} // namespace paradize::assets
