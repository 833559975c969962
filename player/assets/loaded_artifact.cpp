#include "assets/loaded_artifact.hpp"

#include "assets/payload.hpp"
#include "assets/sha256.hpp"
#include "error.hpp"

#include <algorithm>
#include <span>

namespace paradize::assets {

namespace {

struct Rows {
    std::size_t first = 0, count = 0;
};

/// Returns the rows of scene.json's patch table that belong to a tile.
Rows rows_of(const Terrain &terrain, std::uint32_t tile) {
    const auto [first, end] = std::ranges::equal_range(terrain.patches.tile, tile);
    return {static_cast<std::size_t>(first - terrain.patches.tile.begin()),
            static_cast<std::size_t>(end - first)};
}

/// Returns the first patch whose node in the tile has another name, or rows.count if all names fit.
std::size_t first_other(const Glb &glb, const Rows &rows) {
    std::size_t i = 0;
    while (i < rows.count && glb.levels[i].name == "patch" + std::to_string(rows.first + i)) {
        ++i;
    }
    return i;
}

void open_tile(const Terrain &terrain, std::uint32_t index, LoadedArtifact &out) {
    const TerrainPatches &patches = terrain.patches;
    const Rows rows = rows_of(terrain, *out.tile);
    if (rows.count == 0) {
        throw Error(out.path + ": scene.json has no patch in this tile of the terrain");
    }
    out.glb =
        read_glb_nodes(out.file.bytes(), out.path, std::span(patches.node).subspan(rows.first, rows.count));
    if (const std::size_t i = first_other(out.glb, rows); i < rows.count) {
        throw Error(out.path + ": node " + out.glb.levels[i].name + ": scene.json says that it is patch" +
                    std::to_string(rows.first + i) + bake_again);
    }
    const std::span<const std::int32_t> parent_diamond =
        std::span(patches.parent_diamond).subspan(rows.first, rows.count);
    const auto roots = static_cast<std::size_t>(std::ranges::count(parent_diamond, std::int32_t{-1}));
    plan_patches(out.glb, roots, index, out.chunks);
}

/// Throws Error when the hashes differ.
void check_hash(const std::string &found, const std::string &expected, const std::string &path) {
    if (found != expected) {
        // tells two files apart, unless their hashes were made to look alike
        constexpr std::size_t digits = 12;
        const bool alike = found.starts_with(expected.substr(0, digits));
        const auto shown = [&](const std::string &hex) {
            return alike ? hex : hex.substr(0, digits) + "...";
        };
        throw Error(path + ": is damaged or was replaced: its SHA-256 is " + shown(found) +
                    ", scene.json says " + shown(expected) + bake_again);
    }
}

} // namespace

FileBytes read_artifact(const Artifact &artifact, const std::filesystem::path &folder,
                        const std::stop_token &stop) {
    const std::filesystem::path path = folder / artifact.file;
    Sha256 hash;
    FileBytes out(path, {.exactly = artifact.bytes}, [&](std::span<const std::byte> part) {
        if (stop.stop_requested()) {
            throw Error(path.string() + ": loading was cancelled");
        }
        hash.add(part);
    });
    check_hash(hash.hex(), artifact.sha256, path.string());
    return out;
}

void release_fine(LoadedArtifact &loaded) {
    const std::byte *const start = loaded.file.bytes().data();
    std::size_t keep_bytes = 0;
    for (const UploadChunk &chunk : loaded.chunks) {
        if (chunk.coarse && (!chunk.inflated || chunk.inflate != nullptr)) {
            const std::span<const std::byte> bytes = chunk.inflated ? chunk.inflate->compressed : chunk.bytes;
            keep_bytes = std::max(keep_bytes, static_cast<std::size_t>(bytes.data() + bytes.size() - start));
        }
    }
    const auto first = std::ranges::find(loaded.chunks, false, &UploadChunk::coarse);
    // Sounds and files with only coarse data have nothing to release.
    if (first == loaded.chunks.end() || !loaded.file.release_from(loaded.path, keep_bytes)) {
        return;
    }
    first->reload = true;
    for (UploadChunk &chunk : loaded.chunks) {
        chunk.released = !chunk.coarse;
    }
}

std::string reload_fine(LoadedArtifact &loaded) {
    try {
        Sha256 hash;
        loaded.file.reload(loaded.path, [&](std::span<const std::byte> part) { hash.add(part); });
        check_hash(hash.hex(), loaded.sha256, loaded.path);
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

bool fits_tile(const Glb &glb, const Terrain &terrain, std::uint32_t tile) {
    const Rows rows = rows_of(terrain, tile);
    return glb.levels.size() == rows.count && first_other(glb, rows) == rows.count;
}

std::optional<std::uint32_t> tile_of(const SceneFile &scene, const Artifact &artifact) {
    if (!scene.terrain) {
        return std::nullopt;
    }
    const std::vector<std::string> &tiles = scene.terrain->tiles;
    const auto found = std::ranges::find(tiles, artifact.name);
    return found == tiles.end() ? std::nullopt
                                : std::optional(static_cast<std::uint32_t>(found - tiles.begin()));
}

LoadedArtifact load_artifact(const SceneFile &scene, std::uint32_t index, const std::filesystem::path &folder,
                             const std::stop_token &stop) {
    const Artifact &artifact = scene.artifacts[index];
    LoadedArtifact out;
    out.path = (folder / artifact.file).string();
    out.sha256 = artifact.sha256;
    out.file = read_artifact(artifact, folder, stop);
    out.tile = tile_of(scene, artifact);
    if (out.tile) {
        open_tile(*scene.terrain, index, out);
        check_mesh(out.glb, out.path);
    } else if (artifact.kind == ArtifactKind::mesh) {
        out.glb = read_glb(out.file.bytes(), out.path);
        check_mesh(out.glb, out.path);
        plan_mesh(out.glb, index, out.chunks);
    } else if (artifact.kind == ArtifactKind::sound) {
        out.file.release(); // read again when the sound is played
    } else {
        out.ktx = read_ktx2(out.file.bytes(), out.path);
        const bool cube = artifact.kind == ArtifactKind::cubemap;
        if (cube != (out.ktx.faces == 6)) {
            throw Error(out.path + ": has " + std::to_string(out.ktx.faces) + " faces, a " +
                        (cube ? "cube map has 6" : "texture has 1"));
        }
        check_texels(out.ktx, out.path);
        plan_texture(out.ktx, index, out.chunks);
    }
    return out;
}

} // namespace paradize::assets
