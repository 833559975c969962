#pragma once
// Splits baked files into chunks and orders them for upload to the GPU. Uses no GL.

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::assets {

/// Largest chunk, unless a single row of blocks is larger.
inline constexpr std::size_t chunk_bytes = std::size_t{1} << 20U;
/// Mips up to this edge count as coarse and are uploaded before everything fine.
inline constexpr std::uint32_t coarse_edge_px = 64;

/// Number of vertex attributes of a mesh level, in the order of gl::Attribute. The indices of each primitive
/// follow as further parts.
inline constexpr std::uint32_t mesh_attributes = 6;
std::span<const std::byte> mesh_attribute(const GlbLevel &level, std::uint32_t attribute);

struct UploadChunk {
    std::uint32_t artifact = 0; // index into SceneFile::artifacts
    std::uint32_t level = 0;
    std::uint32_t part = 0;   // texture: face; mesh: attribute, or mesh_attributes + primitive
    std::uint32_t offset = 0; // texture: first row of texels; mesh: byte inside the part
    std::uint32_t rows = 0;   // texture: rows of texels
    bool last = false;        // this chunk completes the level
    bool coarse = false;
    std::span<const std::byte> bytes;
    const Ktx2Level *inflate = nullptr; // compressed level that starts with this chunk; nullptr: none
    bool inflated = false;              // the chunk belongs to a compressed level
    bool released = false;              // its bytes were freed and must be reloaded first
    bool reload = false;                // the first released chunk of its file
};

/// These append the chunks of an artifact, coarsest level first. The chunks point into `texture` or `mesh`,
/// which must outlive them.
void plan_texture(const Ktx2 &texture, std::uint32_t artifact, std::vector<UploadChunk> &chunks);
void plan_mesh(const Glb &mesh, std::uint32_t artifact, std::vector<UploadChunk> &chunks);
/// Appends the chunks of a terrain tile, patches in file order. The first `coarse` patches count as coarse.
void plan_patches(const Glb &tile, std::size_t coarse, std::uint32_t artifact,
                  std::vector<UploadChunk> &chunks);
/// Moves coarse chunks to the front and keeps the order otherwise.
void order_chunks(std::vector<UploadChunk> &chunks);

} // namespace paradize::assets
