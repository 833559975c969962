#include "assets/scene/fields.hpp"

#include <algorithm>

namespace paradize::assets {

namespace {

constexpr std::size_t max_tiles = 4096;
constexpr std::size_t max_patches = 1 << 20;
constexpr int max_floor_cells = 256; // along a side
constexpr long long max_levels = 64;

/// Reads the columns of a table. All must have the same length.
class Table {
  public:
    Table(const JsonObject &from, std::size_t most) : from_(from), most_(most) {}

    template <typename T>
    void integers(std::string_view key, long long low, long long high, std::vector<T> &out) {
        const std::vector<long long> column = from_.integers(key, most_, low, high);
        check_length(key, column.size());
        out.reserve(column.size());
        for (const long long value : column) {
            out.push_back(static_cast<T>(value));
        }
    }

    void lengths(std::string_view key, std::vector<float> &out) {
        const std::vector<double> column = from_.column(key, most_, 0.0, max_length_m);
        check_length(key, column.size());
        out.assign(column.begin(), column.end());
    }

    void positions(std::string_view key, std::vector<glm::vec3> &out) {
        const std::vector<double> column = from_.flat_rows(key, most_, 3, -max_length_m, max_length_m);
        check_length(key, column.size() / 3);
        out.reserve(column.size() / 3);
        for (std::size_t i = 0; i + 2 < column.size(); i += 3) {
            out.emplace_back(column[i], column[i + 1], column[i + 2]);
        }
    }

    /// Throws Error for row `row` of a column.
    [[noreturn]] void fail(std::string_view key, std::size_t row, const std::string &what) const {
        from_.fail(std::string(key) + "[" + std::to_string(row) + "]", what);
    }

  private:
    void check_length(std::string_view key, std::size_t length) {
        if (rows_ != none && rows_ != length) {
            from_.fail(key, "has " + std::to_string(length) + " entries, the columns before it have " +
                                std::to_string(rows_));
        }
        rows_ = length;
    }

    static constexpr std::size_t none = static_cast<std::size_t>(-1);
    const JsonObject &from_;
    std::size_t most_;
    std::size_t rows_ = none;
};

std::string labelled(const char *what, std::uint64_t value) {
    return std::string(what) + " " + std::to_string(value);
}

template <typename T>
void check_sorted(const Table &table, const char *key, const std::vector<T> &column) {
    const auto falls = std::ranges::adjacent_find(column, std::ranges::greater());
    if (falls != column.end()) {
        const auto row = static_cast<std::size_t>(falls - column.begin()) + 1;
        table.fail(key, row, labelled("is", column[row]) + labelled(", must not be below", column[row - 1]));
    }
}

/// Checks that patches and diamonds form one tree: each patch is one level below its parent diamond.
void check_tree(const Table &patch_table, const Table &diamond_table, const TerrainPatches &patches,
                const TerrainDiamonds &diamonds) {
    struct DiamondLinks {
        int patches = 0;  // that the diamond replaces
        int children = 0; // that the diamond creates
    };
    std::vector<DiamondLinks> links(diamonds.size());
    for (std::size_t row = 0; row < patches.size(); ++row) {
        const std::uint32_t level = patches.level[row];
        if (patches.parent_diamond[row] < 0) {
            if (level != 0) {
                patch_table.fail("made_by", row, labelled("is -1, a root, but the patch has level", level));
            }
        } else {
            const auto parent = static_cast<std::size_t>(patches.parent_diamond[row]);
            if (diamonds.level[parent] + 1 != level) {
                patch_table.fail("made_by", row,
                                 labelled("names a diamond of level", diamonds.level[parent]) +
                                     labelled(", the patch has level", level));
            }
            links[parent].children += 1;
        }
        if (patches.diamond[row] >= 0) {
            const auto diamond = static_cast<std::size_t>(patches.diamond[row]);
            if (diamonds.level[diamond] != level) {
                patch_table.fail("diamond", row,
                                 labelled("names a diamond of level", diamonds.level[diamond]) +
                                     labelled(", the patch has level", level));
            }
            links[diamond].patches += 1;
        }
        if (row > 0 && patches.tile[row] == patches.tile[row - 1] &&
            patches.node[row] <= patches.node[row - 1]) {
            patch_table.fail("node", row,
                             labelled("is", patches.node[row]) +
                                 labelled(", must be above the", patches.node[row - 1]) + " before it");
        }
    }
    for (std::size_t row = 0; row < diamonds.size(); ++row) {
        const DiamondLinks &link = links[row];
        if (link.patches < 1 || link.patches > 2 || link.children < 1 || link.children > 2 * link.patches) {
            diamond_table.fail("level", row,
                               "the diamond has " + std::to_string(link.patches) + " patches and " +
                                   std::to_string(link.children) +
                                   " children, must have one or two patches and one or two children of each");
        }
    }
}

void read_patches(const JsonObject &from, std::size_t tiles, Terrain &out) {
    const JsonObject diamond_from = from.object("diamonds");
    const JsonObject patch_from = from.object("patches");
    Table diamond_table(diamond_from, max_patches);
    TerrainDiamonds &diamonds = out.diamonds;
    diamond_table.integers("level", 0, max_levels, diamonds.level);
    diamond_table.lengths("error_m", diamonds.error_m);
    diamond_table.positions("center", diamonds.center);
    diamond_table.lengths("radius_m", diamonds.radius_m);
    diamond_from.reject_unknown_keys();
    check_sorted(diamond_table, "level", diamonds.level);

    Table table(patch_from, max_patches);
    TerrainPatches &patches = out.patches;
    const auto last = static_cast<long long>(diamonds.size()) - 1;
    table.integers("tile", 0, static_cast<long long>(tiles) - 1, patches.tile);
    table.integers("node", 0, static_cast<long long>(max_patches) - 1, patches.node);
    table.integers("level", 0, max_levels, patches.level);
    table.integers("made_by", -1, last, patches.parent_diamond);
    table.integers("diamond", -1, last, patches.diamond);
    table.positions("center", patches.center);
    table.lengths("radius_m", patches.radius_m);
    table.lengths("error_m", patches.error_m);
    patch_from.ignore({"first_needed_s"}); // for `paradize explain`
    patch_from.reject_unknown_keys();
    if (patches.size() == 0) {
        patch_from.fail("tile", "has no patch");
    }
    check_sorted(table, "tile", patches.tile);
    check_sorted(table, "level", patches.level);
    check_tree(table, diamond_table, patches, diamonds);
}

void read_tiles(const SceneFile &scene, const JsonObject &from, Terrain &out) {
    out.tiles = from.texts("tiles", max_tiles);
    for (std::size_t i = 0; i < out.tiles.size(); ++i) {
        const std::string path = "tiles[" + std::to_string(i) + "]";
        const Artifact *artifact = scene.find_artifact(out.tiles[i]);
        if (artifact == nullptr || artifact->kind != ArtifactKind::mesh) {
            from.fail(path, "names \"" + out.tiles[i] + "\", which is not an artifact of the right kind");
        }
        if (std::ranges::find(out.tiles.begin(), out.tiles.begin() + static_cast<std::ptrdiff_t>(i),
                              out.tiles[i]) != out.tiles.begin() + static_cast<std::ptrdiff_t>(i)) {
            from.fail(path, "names \"" + out.tiles[i] + "\" twice");
        }
    }
    if (out.tiles.empty()) {
        from.fail("tiles", "is empty");
    }
    read_patches(from, out.tiles.size(), out);
    if (const auto demand = from.object_or_none("demand")) {
        out.trimmed_patches = static_cast<std::uint64_t>(demand->integer("left_out", 0, 1LL << 40));
        demand->ignore({"finest_level", "finest_s", "left_out_bytes"}); // for `paradize explain`
        demand->reject_unknown_keys();
    }
}

void read_floor(const JsonObject &root, Terrain &out) {
    const auto from = root.object_or_none("floor");
    if (!from) {
        return;
    }
    TerrainFloor &floor = out.floor;
    floor.columns = static_cast<int>(from->integer("columns", 1, max_floor_cells));
    floor.cell_m = pair(*from, "cell_m", 1e-6, max_length_m);
    const auto most = static_cast<std::size_t>(max_floor_cells * max_floor_cells);
    const std::vector<double> highest = from->column("highest_m", most, -max_length_m, max_length_m);
    const auto columns = static_cast<std::size_t>(floor.columns);
    if (highest.empty() || highest.size() % columns != 0) {
        from->fail("highest_m", "has " + std::to_string(highest.size()) +
                                    " entries, must be whole rows of `columns`, " +
                                    std::to_string(floor.columns));
    }
    floor.rows = static_cast<int>(highest.size() / columns);
    floor.highest_m.assign(highest.begin(), highest.end());
    from->reject_unknown_keys();
}

} // namespace

void read_terrain(const JsonObject &root, SceneFile &out) {
    const auto from = root.object_or_none("terrain");
    if (!from) {
        return;
    }
    Terrain value;
    read_tiles(out, *from, value);
    value.light_sets = light_sets_of(out, *from, value.patches.size());
    value.sand_color = required_artifact(out, *from, "sand_color", ArtifactKind::texture);
    value.sand_normal = optional_artifact(out, *from, "sand_normal", ArtifactKind::texture);
    value.effect_color = optional_artifact(out, *from, "effect_color", ArtifactKind::texture);
    value.effect_normal = optional_artifact(out, *from, "effect_normal", ArtifactKind::texture);
    value.sand_repeat = real(*from, "sand_repeat", 1e-3, 1e6);
    value.mix_low_m = real(*from, "mix_low_m", -max_length_m, max_length_m);
    value.mix_high_m = real(*from, "mix_high_m", -max_length_m, max_length_m);
    value.specular = real_or(*from, "specular", 0.0, 1e3, value.specular);
    value.smoothness = real_or(*from, "smoothness", 0.0, 1.0, value.smoothness);
    value.wet_high_m = real_or(*from, "wet_high_m", 0.0, max_length_m, value.wet_high_m);
    value.wet_darkness = real_or(*from, "wet_darkness", 0.0, 1.0, value.wet_darkness);
    value.wet_smoothness = real_or(*from, "wet_smoothness", 0.0, 1.0, value.wet_smoothness);
    value.size_m = pair(*from, "size_m", 1e-6, max_length_m);
    value.height_range_m = pair(*from, "height_range_m", -max_length_m, max_length_m);
    read_floor(*from, value);
    from->reject_unknown_keys();
    out.terrain = std::move(value);
}

} // namespace paradize::assets
