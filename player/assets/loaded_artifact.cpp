#include "assets/loaded_artifact.hpp"

#include "assets/payload.hpp"
#include "assets/sha256.hpp"
#include "error.hpp"

#include <algorithm>
#include <exception>
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

void open_tile(const Terrain &terrain, LoadedArtifact &out) {
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
    out.plan = plan_patches(out.glb, roots);
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

void free_memory(LoadedArtifact &loaded, bool may_stay_open) {
    Sha256 hash;
    bool again = false;
    const FileBytes::OnBytes add = [&](std::span<const std::byte> part) {
        hash.add(part);
        again = true;
    };
    loaded.file.free_memory(loaded.path, add, may_stay_open);
    if (again) {
        check_hash(hash.hex(), loaded.sha256, loaded.path);
    }
}

bool is_compressed(const LoadedArtifact &loaded, const Piece &piece) {
    return !loaded.ktx.levels.empty() && !loaded.ktx.levels[piece.first_level].compressed.empty();
}

bool needs_staging(const LoadedArtifact &loaded, const Piece &piece) {
    return !loaded.file.in_memory() || is_compressed(loaded, piece);
}

namespace {

class Stager {
  public:
    Stager(const LoadedArtifact &loaded, StageMemory &memory, std::span<std::byte> out)
        : loaded_(loaded), memory_(memory), left_(out) {}

    void add_mip(std::uint32_t index) {
        Ktx2Level level = loaded_.ktx.levels[index];
        if (level.compressed.empty()) {
            level.bytes = read(level.bytes);
        } else {
            const std::span<std::byte> out = take(level.bytes.size());
            memory_.frame.resize(level.compressed.size());
            loaded_.file.read(offset_of(level.compressed), memory_.frame);
            if (const std::string error = memory_.inflater.inflate(memory_.frame, out); !error.empty()) {
                throw Error(loaded_.path + ": level " + std::to_string(index) + ": " + error + bake_again);
            }
            level.bytes = out;
        }
        if (const std::string error = texel_error(level); !error.empty()) {
            throw Error(loaded_.path + ": level " + std::to_string(index) + ": " + error);
        }
    }

    void add_level(std::uint32_t index) {
        GlbLevel &level = memory_.level;
        level = loaded_.glb.levels[index];
        for (std::span<const std::byte> *part : {&level.positions, &level.normals, &level.tangents,
                                                 &level.uvs, &level.uvs1, &level.colors, &level.sway}) {
            *part = read(*part);
        }
        for (GlbPrimitive &primitive : level.primitives) {
            primitive.indices = read(primitive.indices);
        }
        check_level(level, loaded_.path);
    }

  private:
    std::size_t offset_of(std::span<const std::byte> part) const {
        return static_cast<std::size_t>(part.data() - loaded_.file.bytes().data());
    }
    std::span<std::byte> take(std::size_t size) {
        const std::span<std::byte> out = left_.first(size);
        left_ = left_.subspan(size);
        return out;
    }
    std::span<const std::byte> read(std::span<const std::byte> part) {
        if (part.empty()) {
            return part; // a missing attribute
        }
        const std::span<std::byte> out = take(part.size());
        loaded_.file.read(offset_of(part), out);
        return out;
    }

    const LoadedArtifact &loaded_;
    StageMemory &memory_;
    std::span<std::byte> left_;
};

} // namespace

StagedPiece stage(const LoadedArtifact &loaded, const Piece &piece, StageMemory &memory, StagingRing *ring) {
    StagedPiece out;
    try {
        out.bytes = ring == nullptr ? heap_bytes(piece.bytes) : ring->take(piece.bytes);
        Stager stager(loaded, memory, {out.bytes.get(), piece.bytes});
        if (loaded.glb.levels.empty()) {
            for (std::uint32_t i = piece.first_level + piece.levels; i-- > piece.first_level;) {
                stager.add_mip(i);
            }
        } else {
            for (std::uint32_t i = piece.first_level; i < piece.first_level + piece.levels; ++i) {
                stager.add_level(i);
            }
        }
    } catch (const SourceError &error) { // both are reported by the drawing thread
        out.error = error.what();
        out.file_failed = true;
    } catch (const std::exception &error) {
        out.error = error.what();
    }
    return out;
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

namespace {

void open_content(const SceneFile &scene, const Artifact &artifact, LoadedArtifact &out) {
    if (artifact.kind == ArtifactKind::sound) {
        return;
    }
    if (artifact.kind == ArtifactKind::mesh) {
        out.file.read_front(out.path, glb_header_bytes);
        out.file.read_front(out.path, glb_front_bytes(out.file.bytes()));
        if (out.tile) {
            open_tile(*scene.terrain, out);
            return;
        }
        out.glb = read_glb(out.file.bytes(), out.path);
        out.plan = plan_mesh(out.glb);
        return;
    }
    out.file.read_front(out.path, ktx2_header_bytes);
    out.file.read_front(out.path, ktx2_front_bytes(out.file.bytes()));
    out.ktx = read_ktx2_front(out.file.bytes(), out.path);
    const bool cube = artifact.kind == ArtifactKind::cubemap;
    if (cube != (out.ktx.faces == 6)) {
        throw Error(out.path + ": has " + std::to_string(out.ktx.faces) + " faces, a " +
                    (cube ? "cube map has 6" : "texture has 1"));
    }
    out.plan = plan_texture(out.ktx);
}

} // namespace

LoadedArtifact open_artifact(const SceneFile &scene, std::uint32_t index, const std::filesystem::path &folder,
                             const std::stop_token &stop, std::optional<ReservedMemory> memory) {
    const Artifact &artifact = scene.artifacts[index];
    LoadedArtifact out;
    out.path = (folder / artifact.file).string();
    out.sha256 = artifact.sha256;
    out.tile = tile_of(scene, artifact);
    out.file = FileBytes::reserve(out.path, {.exactly = artifact.bytes}, std::move(memory));
    try {
        open_content(scene, artifact, out);
    } catch (const Error &error) {
        read_artifact(artifact, folder, stop); // throws if the file is not the one that was baked
        throw Error(with_bake_again(error.what()));
    }
    if (!artifact.drawn) {
        out.plan = {};
    }
    return out;
}

void check_artifact(const Artifact &artifact, LoadedArtifact &loaded, bool may_keep_open,
                    const std::stop_token &stop) {
    std::optional<Sha256> hash(std::in_place);
    const FileBytes::OnBytes add = [&](std::span<const std::byte> part) {
        if (stop.stop_requested()) {
            throw Error(loaded.path + ": loading was cancelled");
        }
        hash->add(part);
    };
    if (may_keep_open && artifact.drawn && loaded.file.read_through(loaded.path, add)) {
        check_hash(hash->hex(), loaded.sha256, loaded.path); // stage() checks what it reads
    } else {
        hash.emplace();
        loaded.file.read_all(loaded.path, add);
        check_hash(hash->hex(), loaded.sha256, loaded.path);
        check_mesh(loaded.glb, loaded.path);
        check_frames(loaded.ktx, loaded.path);
        check_texels(loaded.ktx, loaded.path);
    }
    if (!artifact.drawn || artifact.kind == ArtifactKind::sound) { // a sound is read again when it is played
        loaded.file.release();
    }
}

} // namespace paradize::assets
