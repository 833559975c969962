#pragma once
// GLB (glTF 2.0) meshes as the bake writes them: one node per level of detail, tied by MSFT_lod
// (pipeline/paradize/formats/FORMAT.md). Not a reader of glTF at large.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize::assets {

struct GlbPrimitive {
    std::uint32_t material = 0;         // index into Glb::materials
    std::span<const std::byte> indices; // uint16 or uint32, a multiple of three of them
    std::uint32_t count = 0;
};

/// How the numbers of an attribute lie in its bytes.
struct GlbFormat {
    std::uint32_t component = 5126; // glTF's, which is GL's: 5120 to 5123 for 8 and 16 bits, 5126 float32
    bool normalized = false;
    std::uint32_t stride = 0; // bytes from one vertex to the next

    bool operator==(const GlbFormat &) const = default;
};

/// Where a mesh stands in its object or in the world: metres = origin + step * position. Positions are metres
/// (step 1, origin 0) or codes of a lattice.
struct QuantizationGrid {
    std::array<float, 3> step{1.0F, 1.0F, 1.0F};
    std::array<double, 3> origin{};

    bool operator==(const QuantizationGrid &) const = default;
};

/// Attributes as float32, or as codes of 8 and 16 bits (KHR_mesh_quantization); empty when the mesh has none.
struct GlbLevel {
    std::string name;
    std::uint32_t vertices = 0;
    std::array<float, 3> low{}, high{};   // min and max that the positions' accessor states
    std::span<const std::byte> positions; // 3 per vertex
    std::span<const std::byte> normals;   // 3
    std::span<const std::byte> tangents;  // 4
    std::span<const std::byte> uvs;       // 2
    std::span<const std::byte> uvs1;      // 2
    std::span<const std::byte> colors;    // 4
    std::array<GlbFormat, 6> formats;     // of the above, in their order
    std::uint32_t index_bytes = 2;        // 2 or 4, the same for all primitives
    std::vector<GlbPrimitive> primitives;
};

struct Glb {
    std::vector<std::string> materials;
    std::vector<GlbLevel> levels; // level 0, the finest, first
    QuantizationGrid grid;        // of all levels
};

/// Spans point into `file`. The numbers in them are not looked at here: check_mesh() does that. Throws Error
/// with the place.
Glb read_glb(std::span<const std::byte> file, const std::string &name);

/// The same of a tile of the terrain: `levels` are the meshes of these nodes, in this order; the scene is not
/// looked at.
Glb read_glb_nodes(std::span<const std::byte> file, const std::string &name,
                   std::span<const std::uint32_t> nodes);

} // namespace paradize::assets
