#include "assets/glb.hpp"

#include "assets/json_reader.hpp"
#include "assets/limits.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

namespace paradize::assets {

namespace {

constexpr std::uint32_t glb_magic = 0x46546C67;  // "glTF"
constexpr std::uint32_t json_chunk = 0x4E4F534A; // "JSON"
constexpr std::uint32_t bin_chunk = 0x004E4942;  // "BIN\0"
constexpr std::size_t max_glb_entries = 1 << 20; // a terrain tile has six accessors per patch
constexpr long long max_count = 1LL << 31;
constexpr long long byte_type = 5120;
constexpr long long ubyte_type = 5121;
constexpr long long short_type = 5122;
constexpr long long ushort_type = 5123;
constexpr long long float_type = 5126;
constexpr long long uint_type = 5125;

constexpr double max_uv_per_m = 1e30;  // limit of texture coordinates per metre
constexpr std::size_t max_sharing = 4; // limit of all levels' bytes, as a multiple of the buffer's size

/// Returns the bytes of a component, or 0 if glTF has no such type.
constexpr std::size_t size_of(long long component) {
    switch (component) {
    case byte_type:
    case ubyte_type:
        return 1;
    case short_type:
    case ushort_type:
        return 2;
    case uint_type:
    case float_type:
        return 4;
    default:
        return 0;
    }
}

/// The integer types that an attribute may have besides float32, and whether they are normalized. A subset of
/// KHR_mesh_quantization.
struct AttributeTypes {
    std::string_view key;
    const char *type;
    std::size_t components;
    long long narrow, wide;
    bool normalized;
};
constexpr std::array<AttributeTypes, 7> attributes_known{
    {{"POSITION", "VEC3", 3, ushort_type, ushort_type, false},
     {"NORMAL", "VEC3", 3, byte_type, short_type, true},
     {"TANGENT", "VEC4", 4, byte_type, short_type, true},
     {"TEXCOORD_0", "VEC2", 2, ushort_type, ushort_type, true},
     {"TEXCOORD_1", "VEC2", 2, ushort_type, ushort_type, true},
     {"COLOR_0", "VEC4", 4, ubyte_type, ushort_type, true},
     {"_SWAY", "VEC2", 2, ubyte_type, ubyte_type, true}}};

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t offset) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

struct Chunks {
    std::string_view json;
    std::span<const std::byte> bin;
};

Chunks split(std::span<const std::byte> file, const std::string &name) {
    const auto refuse = [&](const std::string &what) { throw Error(name + ": " + what); };
    if (file.size() < glb_header_bytes || word_at(file, 0) != glb_magic) {
        refuse("is not a GLB file (" + std::to_string(file.size()) + " bytes, wrong or truncated header)");
    }
    if (word_at(file, 4) != 2) {
        refuse("header: version " + std::to_string(word_at(file, 4)) + ", must be 2");
    }
    if (word_at(file, 8) != file.size()) {
        refuse("header: says " + std::to_string(word_at(file, 8)) + " bytes, the file has " +
               std::to_string(file.size()));
    }
    const std::size_t json_bytes = word_at(file, 12);
    if (word_at(file, 16) != json_chunk || json_bytes > file.size() - glb_header_bytes) {
        refuse("first chunk: must be JSON; says " + std::to_string(json_bytes) + " bytes, " +
               std::to_string(file.size() - glb_header_bytes) + " bytes follow its header");
    }
    Chunks out;
    out.json = {reinterpret_cast<const char *>(file.data()) + glb_header_bytes, json_bytes};
    const std::size_t next = glb_header_bytes + json_bytes;
    if (next == file.size()) {
        return out;
    }
    if (json_bytes % 4 != 0 || file.size() - next < 8 || word_at(file, next + 4) != bin_chunk) {
        refuse("second chunk: must be a BIN chunk at a multiple of 4 bytes, is at byte " +
               std::to_string(next) + " of " + std::to_string(file.size()));
    }
    if (word_at(file, next) > file.size() - next - 8) {
        refuse("second chunk: says " + std::to_string(word_at(file, next)) + " bytes, " +
               std::to_string(file.size() - next - 8) + " bytes follow its header");
    }
    out.bin = file.subspan(next + 8, word_at(file, next));
    return out;
}

class Reader {
  public:
    Reader(const JsonObject &root, std::span<const std::byte> bin)
        : bin_(bin), accessors_(root.array("accessors", max_glb_entries)),
          views_(root.array("bufferViews", max_glb_entries)), meshes_(root.array("meshes", max_glb_entries)) {
        const std::vector<JsonObject> buffers = root.objects("buffers", 1);
        if (buffers.size() != 1 || buffers[0].has("uri")) {
            root.fail("buffers", "must be the one buffer in the BIN chunk");
        }
        const auto bytes =
            static_cast<std::size_t>(buffers[0].integer("byteLength", 1, static_cast<long long>(bin.size())));
        bin_ = bin.first(bytes);
        for (const JsonObject &material : root.objects("materials", max_glb_entries)) {
            materials_.push_back(material.text_or("name", ""));
        }
        if (materials_.empty()) {
            root.fail("materials", "are missing");
        }
    }

    GlbLevel level(const JsonObject &node) {
        GlbLevel out;
        out.name = node.text_or("name", "");
        const JsonObject mesh = meshes_[index(node, "mesh", meshes_.size())];
        std::optional<long long> vertices_from;
        for (const JsonObject &primitive : mesh.objects("primitives", max_glb_entries)) {
            const JsonObject attributes = primitive.object("attributes");
            if (primitive.integer_or("mode", 0, 6, 4) != 4) {
                primitive.fail("mode", "must be 4 (triangles)");
            }
            const long long positions = attributes.integer("POSITION", 0, max_count);
            if (vertices_from.value_or(positions) != positions) {
                primitive.fail("attributes", "primitives of one level must share their vertices");
            }
            if (!vertices_from) {
                read_attributes(attributes, out);
                vertices_from = positions;
            }
            read_indices(primitive, out);
        }
        if (out.primitives.empty()) {
            mesh.fail("primitives", "are missing");
        }
        return out;
    }

    std::vector<std::string> materials() const { return materials_; }

    /// Reads what the bake measured of the materials that this level draws.
    std::vector<MaterialMeasure> measures(const JsonObject &root, const GlbLevel &coarsest) const {
        std::vector<MaterialMeasure> out(materials_.size());
        const JsonArray entries = root.array("materials", max_glb_entries);
        for (const GlbPrimitive &primitive : coarsest.primitives) {
            const JsonObject extras = entries[primitive.material].object("extras");
            MaterialMeasure &measure = out[primitive.material];
            const std::vector<double> center = extras.numbers("center", 3, -max_length_m, max_length_m);
            measure.center = {center[0], center[1], center[2]};
            if (!coarsest.uvs.empty()) {
                measure.uv_per_m = static_cast<float>(extras.number("uv_per_m", 0.0, max_uv_per_m));
            }
            if (!coarsest.uvs1.empty()) {
                measure.uv1_per_m = static_cast<float>(extras.number("uv1_per_m", 0.0, max_uv_per_m));
            }
        }
        return out;
    }

    /// Adds the node's level. All levels must have the same scale and translation.
    void add(const JsonObject &node, Glb &glb) {
        for (const char *key : {"matrix", "rotation"}) {
            if (node.has(key)) {
                node.fail(key, "is not supported: meshes may have scale and translation only");
            }
        }
        QuantisationGrid grid;
        const auto read = [&](const char *key, double low, auto &out) {
            if (node.has(key)) {
                const std::vector<double> numbers = node.numbers(key, out.size(), low, max_position_m);
                std::transform(numbers.begin(), numbers.end(), out.begin(), [&](double number) {
                    return static_cast<std::remove_reference_t<decltype(out[0])>>(number);
                });
            }
        };
        read("scale", std::numeric_limits<float>::min(), grid.step);
        read("translation", -max_position_m, grid.origin);
        if (!glb.levels.empty() && grid != glb.grid) {
            node.fail("scale", "and translation must be those of the other levels");
        }
        glb.grid = grid;
        glb.levels.push_back(level(node));
        check_bounds(node, grid, glb.levels.back());
    }

  private:
    /// Checks that the bounds of the positions are within max_position_m.
    static void check_bounds(const JsonObject &node, const QuantisationGrid &grid, const GlbLevel &level) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const float bound : {level.low[axis], level.high[axis]}) {
                const double place =
                    grid.origin[axis] + static_cast<double>(grid.step[axis]) * static_cast<double>(bound);
                if (std::abs(place) > max_position_m) {
                    node.fail("scale", "and translation carry a bound of the positions, " + shortest(bound) +
                                           ", to " + shortest(place) + " m, must stay within " +
                                           shortest(max_position_m) + " m of the origin");
                }
            }
        }
    }

    static std::size_t index(const JsonObject &from, std::string_view key, std::size_t size) {
        return static_cast<std::size_t>(from.integer(key, 0, static_cast<long long>(size) - 1));
    }

    struct Accessor {
        std::span<const std::byte> bytes;
        std::uint32_t count = 0;
        long long component = 0;
        bool normalized = false;
        std::size_t stride = 0;
    };

    Accessor accessor(const JsonObject &from, std::string_view key, const char *type,
                      std::size_t components) const {
        const JsonObject entry = accessors_[index(from, key, accessors_.size())];
        Accessor out;
        out.component = entry.integer("componentType", 0, 65535);
        out.count = static_cast<std::uint32_t>(entry.integer("count", 1, max_count));
        if (entry.text("type") != type || entry.has("sparse")) {
            entry.fail("type", std::string("must be ") + type + ", not sparse");
        }
        out.normalized = entry.boolean_or("normalized", false);
        const std::size_t component_bytes = size_of(out.component);
        if (component_bytes == 0) {
            entry.fail("componentType", "must be one of 5120 to 5123, 5125 and 5126");
        }
        const JsonObject view = views_[index(entry, "bufferView", views_.size())];
        // Vertices are aligned to four bytes, indices are tightly packed.
        const std::size_t packed = component_bytes * components;
        const std::size_t stride = components == 1 ? packed : (packed + 3) / 4 * 4;
        out.stride = stride;
        const auto most = static_cast<long long>(bin_.size());
        const auto start = static_cast<std::size_t>(view.integer_or("byteOffset", 0, most, 0));
        const auto length = static_cast<std::size_t>(view.integer("byteLength", 1, most));
        const auto within = static_cast<std::size_t>(entry.integer_or("byteOffset", 0, most, 0));
        view.integer("buffer", 0, 0);
        const auto given_stride =
            static_cast<std::size_t>(view.integer_or("byteStride", 0, 252, static_cast<long long>(packed)));
        if (given_stride != stride) {
            view.fail("byteStride", "is " + std::to_string(given_stride) + ", must be " +
                                        std::to_string(stride) + " (tightly packed)");
        }
        if (length > bin_.size() - start) {
            view.fail("byteLength", std::to_string(length) + " bytes from byte " + std::to_string(start) +
                                        " on exceed a buffer of " + std::to_string(bin_.size()));
        }
        const std::uint64_t needed = std::uint64_t{out.count} * stride;
        if (within > length || needed > length - within) {
            entry.fail("count", std::to_string(out.count) + " entries of " + std::to_string(stride) +
                                    " bytes from byte " + std::to_string(within) + " on exceed a view of " +
                                    std::to_string(length));
        }
        if ((start + within) % component_bytes != 0) {
            entry.fail("byteOffset", "byte " + std::to_string(start + within) +
                                         " of the buffer, must be a multiple of " +
                                         std::to_string(component_bytes));
        }
        out.bytes = bin_.subspan(start + within, static_cast<std::size_t>(needed));
        return out;
    }

    static void bounds(const JsonObject &accessor, std::string_view key, std::array<float, 3> &out) {
        const std::vector<double> numbers = accessor.numbers(key, out.size(), -max_length_m, max_length_m);
        std::ranges::transform(numbers, out.begin(),
                               [](double number) { return static_cast<float>(number); });
    }

    /// Limits shared bytes. Otherwise a small file could describe a huge mesh.
    void count_bytes(const JsonObject &from, std::string_view key, std::size_t bytes) {
        used_bytes_ += bytes;
        if (used_bytes_ > max_sharing * bin_.size()) {
            from.fail(key, "all levels so far use " + std::to_string(used_bytes_) +
                               " bytes, the buffer has " + std::to_string(bin_.size()) + ", the limit is " +
                               std::to_string(max_sharing) + " times as many");
        }
    }

    void read_attributes(const JsonObject &attributes, GlbLevel &out) {
        const std::array<std::span<const std::byte> *, attributes_known.size()> parts{
            &out.positions, &out.normals, &out.tangents, &out.uvs, &out.uvs1, &out.colors, &out.sway};
        for (std::size_t part = 0; part < parts.size(); ++part) {
            const AttributeTypes &known = attributes_known[part];
            if (part != 0 && !attributes.has(known.key)) {
                continue;
            }
            const Accessor found = accessor(attributes, known.key, known.type, known.components);
            const bool quantised = found.component == known.narrow || found.component == known.wide;
            if (!quantised && found.component != float_type) {
                attributes.fail(known.key, "has the component type " + std::to_string(found.component));
            }
            if (found.normalized != (quantised && known.normalized)) {
                attributes.fail(known.key,
                                found.normalized ? "must not be normalized" : "must be normalized");
            }
            if (part == 0) {
                const JsonObject entry = accessors_[index(attributes, known.key, accessors_.size())];
                bounds(entry, "min", out.low);
                bounds(entry, "max", out.high);
            }
            if (part != 0 && found.count != out.vertices) {
                attributes.fail(known.key, "has " + std::to_string(found.count) + " entries, POSITION has " +
                                               std::to_string(out.vertices));
            }
            count_bytes(attributes, known.key, found.bytes.size());
            out.vertices = found.count;
            *parts[part] = found.bytes;
            out.formats[part] = {static_cast<std::uint32_t>(found.component), found.normalized,
                                 static_cast<std::uint32_t>(found.stride)};
        }
    }

    void read_indices(const JsonObject &primitive, GlbLevel &out) {
        const Accessor indices = accessor(primitive, "indices", "SCALAR", 1);
        if ((indices.component != ushort_type && indices.component != uint_type) || indices.normalized ||
            indices.count % 3 != 0) {
            primitive.fail("indices", "must be whole triangles of uint16 or uint32");
        }
        const std::uint32_t bytes = indices.component == ushort_type ? 2 : 4;
        if (!out.primitives.empty() && bytes != out.index_bytes) {
            primitive.fail("indices", "must have one type in all primitives of a level");
        }
        out.index_bytes = bytes;
        count_bytes(primitive, "indices", indices.bytes.size());
        const long long last = static_cast<long long>(materials_.size()) - 1;
        out.primitives.push_back({static_cast<std::uint32_t>(primitive.integer_or("material", 0, last, 0)),
                                  indices.bytes, indices.count});
    }

    std::span<const std::byte> bin_;
    std::size_t used_bytes_ = 0; // of all levels so far
    JsonArray accessors_, views_, meshes_;
    std::vector<std::string> materials_;
};

void check_version(const JsonObject &root) {
    if (root.object("asset").text("version") != "2.0") {
        root.fail("asset", "version must be 2.0");
    }
}

} // namespace

std::size_t glb_front_bytes(std::span<const std::byte> header) {
    constexpr std::size_t chunk_header_bytes = 8; // of the BIN chunk
    return header.size() < glb_header_bytes ? header.size()
                                            : glb_header_bytes + word_at(header, 12) + chunk_header_bytes;
}

Glb read_glb_nodes(std::span<const std::byte> file, const std::string &name,
                   std::span<const std::uint32_t> nodes) {
    const Chunks chunks = split(file, name);
    const JsonDocument document(chunks.json, name);
    const JsonObject root = document.root();
    check_version(root);
    Reader reader(root, chunks.bin);
    const JsonArray all = root.array("nodes", max_glb_entries);
    Glb out;
    out.materials = reader.materials();
    out.levels.reserve(nodes.size());
    for (const std::uint32_t node : nodes) {
        if (node >= all.size()) {
            root.fail("nodes", "has " + std::to_string(all.size()) + " entries, scene.json names entry " +
                                   std::to_string(node) + " (the first is 0) as a patch");
        }
        reader.add(all[node], out);
    }
    return out;
}

Glb read_glb(std::span<const std::byte> file, const std::string &name) {
    const Chunks chunks = split(file, name);
    const JsonDocument document(chunks.json, name);
    const JsonObject root = document.root();
    check_version(root);
    Reader reader(root, chunks.bin);
    const JsonArray nodes = root.array("nodes", max_glb_entries);
    const auto last_node = static_cast<long long>(nodes.size()) - 1;
    const std::vector<JsonObject> scenes = root.objects("scenes", max_glb_entries);
    const auto scene =
        static_cast<std::size_t>(root.integer_or("scene", 0, static_cast<long long>(scenes.size()) - 1, 0));
    if (scenes.empty()) {
        root.fail("scenes", "are missing");
    }
    const std::vector<long long> roots = scenes[scene].integers("nodes", max_glb_entries, 0, last_node);
    if (roots.size() != 1) {
        scenes[scene].fail("nodes", "must name one node, level 0");
    }
    Glb out;
    out.materials = reader.materials();
    const JsonObject finest = nodes[static_cast<std::size_t>(roots[0])];
    reader.add(finest, out);
    if (finest.has("extensions") && finest.object("extensions").has("MSFT_lod")) {
        const JsonObject lod = finest.object("extensions").object("MSFT_lod");
        for (const long long id : lod.integers("ids", 64, 0, last_node)) {
            reader.add(nodes[static_cast<std::size_t>(id)], out);
        }
    }
    out.measures = reader.measures(root, out.levels.back());
    return out;
}

} // namespace paradize::assets
