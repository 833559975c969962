#pragma once
// One artifact with its GPU objects. Scenes that share an artifact share the item.

#include "assets/loaded_artifact.hpp"
#include "gl/buffer.hpp"
#include "gl/handle.hpp"
#include "streaming/streamed_mesh.hpp"
#include "streaming/streamed_tile.hpp"
#include "streaming/streamer.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace paradize {

/// Where geometry lies on the device.
struct GeometryPools {
    std::shared_ptr<GeometryPool> meshes, patches;

    std::uint64_t unused_bytes() const { return meshes->unused_bytes() + patches->unused_bytes(); }
};

struct StreamItem {
    /// Creates what is needed before the first piece is uploaded. Throws Error if the driver cannot draw it.
    StreamItem(const assets::Artifact &artifact, assets::LoadedArtifact opened, const GeometryPools &pools);

    /// Creates the GPU objects of a piece. `all_follow`: all others of the artifact come soon, and none is
    /// evicted, so that a texture gets room for its finer mips as well.
    void begin(std::uint32_t piece_index, bool all_follow);
    void upload(const assets::UploadChunk &chunk, const gl::Source &from);
    /// Makes an uploaded piece visible.
    void finish(std::uint32_t piece_index);
    /// A texture's coarser mips are copied: on the device or, where there is no room for the copy, through
    /// `held`, for which the driver waits for the device. nullptr: on the device.
    void evict(std::uint32_t piece_index, std::vector<std::byte> *held);

    assets::LoadedArtifact loaded; // its file is released when everything is uploaded
    StreamedTexture texture;
    gl::Texture finer; // replaces the texture once its finest level is uploaded; or that has room for it
    StreamedMesh mesh;
    StreamedTile tile;
    assets::ArtifactKind kind;
    std::optional<int> max_level; // coarsest mip to sample
    std::size_t pieces_left = 0;
    bool drawn = true; // something in its scene refers to it

  private:
    std::uint32_t finer_from_ = 0; // level of the file that is level 0 of `finer`
    void make_texture();
    void evict_mips(std::uint32_t finest, std::uint32_t coarser, std::vector<std::byte> *held);
};

} // namespace paradize
