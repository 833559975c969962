#pragma once
// An artifact's file in memory, checked against scene.json, with its parsed content.

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
    std::string sha256;                // from scene.json
    FileBytes file;                    // the other members point into it; released for a sound
    Ktx2 ktx;                          // of a texture or cube map
    Glb glb;                           // of a mesh or tile
    std::optional<std::uint32_t> tile; // index into Terrain::tiles
    std::vector<UploadChunk> chunks;
};

/// Reads the whole file and checks its SHA-256. Throws Error, also when `stop` is requested.
FileBytes read_artifact(const Artifact &artifact, const std::filesystem::path &folder,
                        const std::stop_token &stop = {});

/// Reads the file, parses its content and checks it. Throws Error.
LoadedArtifact load_artifact(const SceneFile &scene, std::uint32_t index, const std::filesystem::path &folder,
                             const std::stop_token &stop = {});

/// Frees the fine data. Its chunks are marked as released until reload_fine().
void release_fine(LoadedArtifact &loaded);
/// Reads the fine data again and checks the file's SHA-256 once more. Returns what went wrong, or an empty
/// text.
std::string reload_fine(LoadedArtifact &loaded);

/// True if the tile's levels are the patches that scene.json lists for this tile, in the same order.
bool fits_tile(const Glb &glb, const Terrain &terrain, std::uint32_t tile);

/// Returns the index into Terrain::tiles, or nullopt if the artifact is not a tile.
std::optional<std::uint32_t> tile_of(const SceneFile &scene, const Artifact &artifact);

} // namespace paradize::assets
