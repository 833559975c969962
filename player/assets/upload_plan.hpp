#pragma once
// In which pieces and in which order baked files go to the GPU. Knows no GL.

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::assets {

/// A piece is at most this long, unless one row of blocks is longer.
inline constexpr std::size_t chunk_bytes = std::size_t{1} << 20U;
/// Mips up to this edge count as coarse and go before everything fine.
inline constexpr std::uint32_t coarse_edge_px = 64;

/// Attributes of a mesh level in the order of gl::Attribute; indices follow, one part per primitive.
inline constexpr std::uint32_t mesh_attributes = 6;
std::span<const std::byte> mesh_attribute(const GlbLevel &level, std::uint32_t attribute);

struct UploadChunk {
    std::uint32_t artifact = 0; // index into SceneFile::artifacts
    std::uint32_t level = 0;
    std::uint32_t part = 0;   // texture: face; mesh: attribute, or mesh_attributes + primitive
    std::uint32_t offset = 0; // texture: first row of texels; mesh: byte inside the part
    std::uint32_t rows = 0;   // texture: rows of texels
    bool last = false;        // the level is complete with this piece
    bool coarse = false;
    std::span<const std::byte> bytes;
    const Ktx2Level *inflate = nullptr; // the supercompressed level that begins with this piece
    bool inflated = false;              // the piece is of a supercompressed level
    bool released = false;              // its bytes were given back, and are read again before it
    bool reload = false;                // the first of its file that is absent
};

/// Append an artifact's pieces, coarsest level first; they point into the texture or mesh, which outlives
/// them.
void plan_texture(const Ktx2 &texture, std::uint32_t artifact, std::vector<UploadChunk> &chunks);
void plan_mesh(const Glb &mesh, std::uint32_t artifact, std::vector<UploadChunk> &chunks);
/// A tile of the terrain, its patches in the order of the file; the first `coarse` of them count as coarse.
void plan_patches(const Glb &tile, std::size_t coarse, std::uint32_t artifact,
                  std::vector<UploadChunk> &chunks);
/// Coarse pieces first; otherwise the order stays.
void order_chunks(std::vector<UploadChunk> &chunks);

} // namespace paradize::assets
