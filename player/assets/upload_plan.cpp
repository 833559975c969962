#include "assets/upload_plan.hpp"

#include <algorithm>

namespace paradize::assets {

std::span<const std::byte> mesh_part(const GlbLevel &level, std::uint32_t part) {
    return part < mesh_attributes ? mesh_attribute(level, part)
                                  : level.primitives[part - mesh_attributes].indices;
}

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
    case 6:
        return level.sway;
    default:
        return {};
    }
}

namespace {

/// Adds the chunks from `first` on to the last piece.
void close_piece(UploadPlan &plan, std::size_t first) {
    Piece &piece = plan.pieces.back();
    for (std::size_t i = first; i < plan.chunks.size(); ++i) {
        piece.bytes += plan.chunks[i].bytes.size();
        ++piece.chunks;
    }
}

void plan_mip(const Ktx2 &texture, std::uint32_t index, UploadPlan &plan) {
    const BlockShape block = block_shape(texture.format);
    const Ktx2Level &level = texture.levels[index];
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
            chunk.level = index;
            chunk.part = face;
            chunk.offset = static_cast<std::uint32_t>(row) * block.edge_px;
            chunk.rows =
                std::min(static_cast<std::uint32_t>(rows) * block.edge_px, level.height_px - chunk.offset);
            chunk.bytes = bytes.subspan(row * row_bytes, rows * row_bytes);
            plan.chunks.push_back(chunk);
        }
    }
}

void plan_level(const GlbLevel &level, std::uint32_t index, UploadPlan &plan) {
    const auto parts = mesh_attributes + static_cast<std::uint32_t>(level.primitives.size());
    for (std::uint32_t part = 0; part < parts; ++part) {
        const std::span<const std::byte> bytes = mesh_part(level, part);
        for (std::size_t at = 0; at < bytes.size(); at += chunk_bytes) {
            UploadChunk chunk;
            chunk.level = index;
            chunk.part = part;
            chunk.offset = static_cast<std::uint32_t>(at);
            chunk.bytes = bytes.subspan(at, std::min(chunk_bytes, bytes.size() - at));
            plan.chunks.push_back(chunk);
        }
    }
}

std::size_t bytes_of(const GlbLevel &level) {
    std::size_t bytes = 0;
    for (std::uint32_t part = 0; part < mesh_attributes + level.primitives.size(); ++part) {
        bytes += mesh_part(level, part).size();
    }
    return bytes;
}

} // namespace

UploadPlan plan_texture(const Ktx2 &texture) {
    UploadPlan plan;
    for (auto i = static_cast<std::uint32_t>(texture.levels.size()); i-- > 0;) {
        const Ktx2Level &level = texture.levels[i];
        const bool coarse = std::max(level.width_px, level.height_px) <= coarse_edge_px;
        const auto first = static_cast<std::uint32_t>(plan.chunks.size());
        if (!coarse || plan.pieces.empty()) {
            plan.pieces.push_back({.first_chunk = first, .coarse = plan.pieces.empty()});
        }
        plan.pieces.back().first_level = i;
        ++plan.pieces.back().levels;
        plan_mip(texture, i, plan);
        close_piece(plan, first);
    }
    return plan;
}

UploadPlan plan_mesh(const Glb &mesh) {
    UploadPlan plan;
    for (auto i = static_cast<std::uint32_t>(mesh.levels.size()); i-- > 0;) {
        const auto first = static_cast<std::uint32_t>(plan.chunks.size());
        plan.pieces.push_back(
            {.first_level = i, .levels = 1, .first_chunk = first, .coarse = plan.pieces.empty()});
        plan_level(mesh.levels[i], i, plan);
        close_piece(plan, first);
    }
    return plan;
}

UploadPlan plan_patches(const Glb &tile, std::size_t roots) {
    UploadPlan plan;
    for (std::uint32_t i = 0; i < tile.levels.size(); ++i) {
        const auto first = static_cast<std::uint32_t>(plan.chunks.size());
        const bool coarse = i < roots;
        if (plan.pieces.empty() || coarse != plan.pieces.back().coarse ||
            plan.pieces.back().bytes + bytes_of(tile.levels[i]) > patches_bytes) {
            plan.pieces.push_back({.first_level = i, .first_chunk = first, .coarse = coarse});
        }
        ++plan.pieces.back().levels;
        plan_level(tile.levels[i], i, plan);
        close_piece(plan, first);
    }
    return plan;
}

} // namespace paradize::assets
