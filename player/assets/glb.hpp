#pragma once
// Reads GLB (glTF 2.0) meshes as the bake writes them: one node per level of detail, linked by MSFT_lod
// (pipeline/paradize/formats/FORMAT.md). Not a general glTF reader.

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize::assets {

struct GlbPrimitive {
    std::uint32_t material = 0;         // index into Glb::materials
    std::span<const std::byte> indices; // uint16 or uint32, whole triangles
    std::uint32_t count = 0;
};

/// Layout of an attribute in its bytes.
struct GlbFormat {
    // glTF component type, same as GL's: 5120 to 5123 for 8 and 16 bits, 5126 for float32
    std::uint32_t component = 5126;
    bool normalized = false;
    std::uint32_t stride = 0; // bytes from one vertex to the next

    bool operator==(const GlbFormat &) const = default;
};

/// Transform of the positions: metres = origin + step * position. Positions are metres (step 1, origin 0) or
/// quantised values.
struct QuantisationGrid {
    std::array<float, 3> step{1.0F, 1.0F, 1.0F};
    std::array<double, 3> origin{};

    bool operator==(const QuantisationGrid &) const = default;
};

/// Attributes are float32 or quantised to 8 or 16 bits (KHR_mesh_quantization). An attribute that the mesh
/// lacks is empty.
struct GlbLevel {
    std::string name;
    std::uint32_t vertices = 0;
    std::array<float, 3> low{}, high{};   // bounds stated by the positions' accessor
    std::span<const std::byte> positions; // 3 components per vertex
    std::span<const std::byte> normals;   // 3
    std::span<const std::byte> tangents;  // 4
    std::span<const std::byte> uvs;       // 2
    std::span<const std::byte> uvs1;      // 2
    std::span<const std::byte> colors;    // 4
    std::span<const std::byte> sway;      // 2
    std::array<GlbFormat, 7> formats;     // of the attributes above, in this order
    std::uint32_t index_bytes = 2;        // 2 or 4, the same in all primitives
    std::vector<GlbPrimitive> primitives;
};

/// The bake's measures of a material's triangles in the coarsest level.
struct MaterialMeasure {
    glm::vec3 center{0.0F}; // the middle of their box, in the positions' own units
    // Texture coordinates per metre where they are stretched: a twentieth of the area has fewer. 0: unknown.
    float uv_per_m = 0.0F;
    float uv1_per_m = 0.0F; // of the second ones
};

struct Glb {
    std::vector<std::string> materials;
    std::vector<MaterialMeasure> measures; // one per material; empty for a tile
    std::vector<GlbLevel> levels;          // level 0, the finest, comes first
    QuantisationGrid grid;                 // of all levels
};

/// The result's spans point into `file`. Does not check the vertices and indices; check_mesh() does. Throws
/// Error with the place.
Glb read_glb(std::span<const std::byte> file, const std::string &name);

/// read_glb() and read_glb_nodes() use only the first glb_front_bytes() bytes of the file, which its first
/// glb_header_bytes bytes tell.
inline constexpr std::size_t glb_header_bytes = 20;
std::size_t glb_front_bytes(std::span<const std::byte> header);

/// Reads a terrain tile: `levels` are the meshes of these nodes, in this order. The glTF scene is ignored.
Glb read_glb_nodes(std::span<const std::byte> file, const std::string &name,
                   std::span<const std::uint32_t> nodes);

} // namespace paradize::assets
