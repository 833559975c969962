#pragma once
// An artifact's file in memory, found to be the one that scene.json names, with what it holds.

#include "assets/file_bytes.hpp"
#include "assets/glb.hpp"
#include "assets/ktx2.hpp"
#include "assets/scene_file.hpp"
#include "assets/upload_plan.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace paradize::assets {

struct LoadedArtifact {
    std::string path;
    std::string sha256;                // that scene.json states
    FileBytes file;                    // what the rest points into; of a sound released
    Ktx2 ktx;                          // of a texture or cube map
    Glb glb;                           // of a mesh or tile
    std::optional<std::uint32_t> tile; // index into Terrain::tiles
    std::vector<UploadChunk> chunks;
};

/// Reads the file whole and compares its SHA-256 with scene.json's. Throws Error; also when it is asked to
/// stop.
FileBytes read_artifact(const Artifact &artifact, const std::filesystem::path &folder,
                        const std::stop_token &stop = {});

/// The same, and reads and checks what it holds. Throws Error.
LoadedArtifact load_artifact(const SceneFile &scene, std::uint32_t index, const std::filesystem::path &folder,
                             const std::stop_token &stop = {});

/// Gives back the memory of everything fine: its pieces are absent until reload_fine().
void release_fine(LoadedArtifact &loaded);
/// Reads that again, and compares the whole file with its SHA-256 once more. What is wrong; empty: nothing.
std::string reload_fine(LoadedArtifact &loaded);

/// Are the tile's levels the patches that scene.json has in this tile, in their order?
bool fits_tile(const Glb &glb, const Terrain &terrain, std::uint32_t tile);

/// Index into Terrain::tiles; none: the artifact is no tile.
std::optional<std::uint32_t> tile_of(const SceneFile &scene, const Artifact &artifact);

} // namespace paradize::assets
