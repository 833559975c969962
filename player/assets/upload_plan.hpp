#pragma once
// Splits baked files into pieces, and these into chunks for the upload to the GPU. Uses no GL.

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

/// Largest piece of a terrain tile, unless a single patch is larger: fine enough to follow the eye, coarse
/// enough for few draw calls.
inline constexpr std::size_t patches_bytes = std::size_t{256} << 10U;

/// Number of vertex attributes of a mesh level, in the order of gl::Attribute. The indices of each primitive
/// follow as further parts.
inline constexpr std::uint32_t mesh_attributes = 7;
std::span<const std::byte> mesh_attribute(const GlbLevel &level, std::uint32_t attribute);
std::span<const std::byte> mesh_part(const GlbLevel &level, std::uint32_t part);

/// One upload to the GPU.
struct UploadChunk {
    std::uint32_t level = 0;  // of the texture or mesh; of a terrain tile: the patch
    std::uint32_t part = 0;   // texture: face; mesh: attribute, or mesh_attributes + primitive
    std::uint32_t offset = 0; // texture: first row of texels; mesh: byte inside the part
    std::uint32_t rows = 0;   // texture: rows of texels
    std::span<const std::byte> bytes;
};

/// The unit of loading, upload and eviction: the coarse mips of a texture, one finer mip, one level of
/// detail of a mesh, or neighbouring patches of a terrain tile.
struct Piece {
    std::uint32_t first_level = 0, levels = 0; // of the file
    std::uint32_t first_chunk = 0, chunks = 0; // entries of UploadPlan::chunks
    std::uint64_t bytes = 0;                   // on the GPU
    bool coarse = false;                       // uploaded before everything that is not
};

/// The pieces of an artifact, coarse before fine. The chunks point into its file, or into the memory that its
/// levels are decompressed to.
struct UploadPlan {
    std::vector<UploadChunk> chunks;
    std::vector<Piece> pieces;

    std::span<const UploadChunk> chunks_of(const Piece &piece) const {
        return std::span(chunks).subspan(piece.first_chunk, piece.chunks);
    }
};

UploadPlan plan_texture(const Ktx2 &texture);
UploadPlan plan_mesh(const Glb &mesh);
/// Plans a terrain tile. The first `roots` patches are coarse. A piece holds at most chunk_bytes or one
/// patch.
UploadPlan plan_patches(const Glb &tile, std::size_t roots);

} // namespace paradize::assets
