#pragma once
// An artifact's file with its parsed content. It is opened first: its headers say what it holds. Before any
// of it is used, the whole file is read and checked against scene.json.

#include "assets/file_bytes.hpp"
#include "assets/glb.hpp"
#include "assets/inflate.hpp"
#include "assets/ktx2.hpp"
#include "assets/scene/file.hpp"
#include "assets/staging_ring.hpp"
#include "assets/upload_plan.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
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
    UploadPlan plan;
    std::int64_t checked_ns = 0; // when its check began: now_ns()
};

/// Reads the whole file and checks its SHA-256. Throws Error, also when `stop` is requested.
FileBytes read_artifact(const Artifact &artifact, const std::filesystem::path &folder,
                        const std::stop_token &stop = {});

/// Reads and parses the headers of the file. The other bytes are zero, but for those that came with the
/// headers. If the headers are broken, the whole file is read, and a wrong hash is reported first. memory: of
/// the artifact's bytes; std::nullopt: it is made. Throws Error.
LoadedArtifact open_artifact(const SceneFile &scene, std::uint32_t index, const std::filesystem::path &folder,
                             const std::stop_token &stop = {},
                             std::optional<ReservedMemory> memory = std::nullopt);

/// Reads the whole file of an opened artifact and checks its SHA-256 and every number in it. If it
/// `may_keep_open`, is drawn and has not changed for 3 s, it takes no memory, and its numbers are checked by
/// stage(), which reads from it.
/// Throws Error, also when `stop` is requested.
void check_artifact(const Artifact &artifact, LoadedArtifact &loaded, bool may_keep_open = false,
                    const std::stop_token &stop = {});

/// Frees the file's memory. stage() reads from the file then, which stays open if it may, else is opened for
/// each piece. Throws Error if the file has changed.
void free_memory(LoadedArtifact &loaded, bool may_stay_open);

/// A piece in memory, ready for upload.
struct StagedPiece {
    StagedBytes bytes;        // the piece's chunks one after the other
    std::string error;        // empty: no error
    bool file_failed = false; // the error: the file cannot be read any more, or has changed
};

/// True if the file holds the piece's levels supercompressed.
bool is_compressed(const LoadedArtifact &loaded, const Piece &piece);
/// True if stage() is needed before the piece's chunks can be uploaded: they are compressed or not in memory.
bool needs_staging(const LoadedArtifact &loaded, const Piece &piece);
/// Memory that stage() uses again for the next piece, so that it allocates little.
struct StageMemory {
    Inflater inflater;
    std::vector<std::byte> frame; // compressed
    GlbLevel level;
};
/// Copies, reads or decompresses a piece into a part of `ring`; nullptr: onto the heap. What is read again is
/// checked again.
StagedPiece stage(const LoadedArtifact &loaded, const Piece &piece, StageMemory &memory,
                  StagingRing *ring = nullptr);

/// True if the tile's levels are the patches that scene.json lists for this tile, in the same order.
bool fits_tile(const Glb &glb, const Terrain &terrain, std::uint32_t tile);

/// Returns the index into Terrain::tiles, or nullopt if the artifact is not a tile.
std::optional<std::uint32_t> tile_of(const SceneFile &scene, const Artifact &artifact);

} // namespace paradize::assets
