#pragma once
// GLB (glTF 2.0) meshes as the bake writes them: one node per level of detail, tied by MSFT_lod
// (pipeline/paradize/formats/FORMAT.md). Not a reader of glTF at large.

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

/// float32 attributes, tightly packed; empty when the mesh has none.
struct GlbLevel {
    std::string name;
    std::uint32_t vertices = 0;
    std::span<const std::byte> positions; // 3 floats per vertex
    std::span<const std::byte> normals;   // 3
    std::span<const std::byte> tangents;  // 4
    std::span<const std::byte> uvs;       // 2
    std::span<const std::byte> uvs1;      // 2
    std::span<const std::byte> colors;    // 4
    std::uint32_t index_bytes = 2;        // 2 or 4, the same for all primitives
    std::vector<GlbPrimitive> primitives;
};

struct Glb {
    std::vector<std::string> materials;
    std::vector<GlbLevel> levels; // level 0, the finest, first
};

/// Spans point into `file`. Indices are not compared with the count of vertices here (that would read the
/// whole file): first_bad_index() does it, piece by piece, before the upload. Throws Error with the place.
Glb read_glb(std::span<const std::byte> file, const std::string &name);

/// Place in `indices` of the first index that is not below `vertices`, or -1.
std::ptrdiff_t first_bad_index(std::span<const std::byte> indices, std::uint32_t index_bytes,
                               std::uint32_t vertices);

} // namespace paradize::assets
