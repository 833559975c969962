#pragma once
// Measures of a mesh's materials that the player needs before its levels are on the GPU.

#include "assets/glb.hpp"

#include <glm/vec3.hpp>

#include <vector>

namespace paradize::assets {

/// Of the triangles of one material in the coarsest level.
struct MaterialMeasure {
    glm::vec3 center{0.0F}; // the middle of their box, in the positions' own units
    // Texture coordinates per metre where they are stretched: a twentieth of the area has fewer. 0: unknown.
    float uv_per_m = 0.0F;
    float second_uv_per_m = 0.0F; // of the second ones
};

/// Returns one entry per material. The mesh must have passed check_mesh(), and its coarsest level be in
/// memory.
std::vector<MaterialMeasure> measure_materials(const Glb &glb);

} // namespace paradize::assets
