#include "assets/upload_plan.hpp"

#include <algorithm>

namespace paradize::assets {

std::span<const std::byte> mesh_attribute(const GlbLevel &level, std::uint32_t attribute) {
    switch (attribute) {
    case 0:
        return level.positions;
    case 1:
        return level.normals;
    case 2:
        return level.tangents;
    case 3:
        return level.uvs;
    case 4:
        return level.uvs1;
    case 5:
        return level.colors;
    default:
        return {};
    }
}

void plan_texture(const Ktx2 &texture, std::uint32_t artifact, std::vector<UploadChunk> &chunks) {
    const BlockShape block = block_shape(texture.format);
    for (std::size_t i = texture.levels.size(); i-- > 0;) {
        const Ktx2Level &level = texture.levels[i];
        const std::size_t across = (level.width_px + block.edge_px - 1) / block.edge_px;
        const std::size_t down = (level.height_px + block.edge_px - 1) / block.edge_px;
        const std::size_t row_bytes = across * block.bytes;
        const std::size_t rows_per_chunk = std::max<std::size_t>(1, chunk_bytes / row_bytes);
        for (std::uint32_t face = 0; face < texture.faces; ++face) {
            const std::span<const std::byte> bytes =
                level.bytes.subspan(face * down * row_bytes, down * row_bytes);
            for (std::size_t row = 0; row < down; row += rows_per_chunk) {
                const std::size_t rows = std::min(rows_per_chunk, down - row);
                UploadChunk chunk;
                chunk.artifact = artifact;
                chunk.level = static_cast<std::uint32_t>(i);
                chunk.part = face;
                chunk.offset = static_cast<std::uint32_t>(row) * block.edge_px;
                chunk.rows = std::min(static_cast<std::uint32_t>(rows) * block.edge_px,
                                      level.height_px - chunk.offset);
                chunk.last = face + 1 == texture.faces && row + rows == down;
                chunk.coarse = std::max(level.width_px, level.height_px) <= coarse_edge_px ||
                               i + 1 == texture.levels.size();
                chunk.bytes = bytes.subspan(row * row_bytes, rows * row_bytes);
                chunk.inflated = !level.compressed.empty();
                chunk.inflate = chunk.inflated && face == 0 && row == 0 ? &level : nullptr;
                chunks.push_back(chunk);
            }
        }
    }
}

namespace {

void plan_level(const GlbLevel &level, std::size_t index, bool coarse, std::uint32_t artifact,
                std::vector<UploadChunk> &chunks) {
    const auto parts = mesh_attributes + static_cast<std::uint32_t>(level.primitives.size());
    for (std::uint32_t part = 0; part < parts; ++part) {
        const std::span<const std::byte> bytes = part < mesh_attributes
                                                     ? mesh_attribute(level, part)
                                                     : level.primitives[part - mesh_attributes].indices;
        for (std::size_t at = 0; at < bytes.size(); at += chunk_bytes) {
            UploadChunk chunk;
            chunk.artifact = artifact;
            chunk.level = static_cast<std::uint32_t>(index);
            chunk.part = part;
            chunk.offset = static_cast<std::uint32_t>(at);
            chunk.coarse = coarse;
            chunk.bytes = bytes.subspan(at, std::min(chunk_bytes, bytes.size() - at));
            // Every level has positions and at least one primitive, so its last chunk is one of indices.
            chunk.last = part + 1 == parts && at + chunk.bytes.size() == bytes.size();
            chunks.push_back(chunk);
        }
    }
}

} // namespace

void plan_mesh(const Glb &mesh, std::uint32_t artifact, std::vector<UploadChunk> &chunks) {
    for (std::size_t i = mesh.levels.size(); i-- > 0;) {
        plan_level(mesh.levels[i], i, i + 1 == mesh.levels.size(), artifact, chunks);
    }
}

void plan_patches(const Glb &tile, std::size_t coarse, std::uint32_t artifact,
                  std::vector<UploadChunk> &chunks) {
    for (std::size_t i = 0; i < tile.levels.size(); ++i) {
        plan_level(tile.levels[i], i, i < coarse, artifact, chunks);
    }
}

void order_chunks(std::vector<UploadChunk> &chunks) {
    std::stable_partition(chunks.begin(), chunks.end(),
                          [](const UploadChunk &chunk) { return chunk.coarse; });
}

} // namespace paradize::assets
