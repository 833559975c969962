#include "assets/glb.hpp"

#include "assets/json_reader.hpp"
#include "error.hpp"

#include <cstring>
#include <optional>

namespace paradize::assets {

namespace {

constexpr std::uint32_t glb_magic = 0x46546C67;  // "glTF"
constexpr std::uint32_t json_chunk = 0x4E4F534A; // "JSON"
constexpr std::uint32_t bin_chunk = 0x004E4942;  // "BIN\0"
constexpr std::size_t most_entries = 1 << 16;
constexpr long long most_count = 1LL << 31;
constexpr long long float_type = 5126;
constexpr long long ushort_type = 5123;
constexpr long long uint_type = 5125;

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
    if (file.size() < 20 || word_at(file, 0) != glb_magic) {
        refuse("is no GLB file");
    }
    if (word_at(file, 4) != 2) {
        refuse("header: version " + std::to_string(word_at(file, 4)) + ", must be 2");
    }
    if (word_at(file, 8) != file.size()) {
        refuse("header: says " + std::to_string(word_at(file, 8)) + " bytes, the file has " +
               std::to_string(file.size()));
    }
    const std::size_t json_bytes = word_at(file, 12);
    if (word_at(file, 16) != json_chunk || json_bytes > file.size() - 20) {
        refuse("first chunk: is no complete JSON chunk");
    }
    Chunks out;
    out.json = {reinterpret_cast<const char *>(file.data()) + 20, json_bytes};
    const std::size_t next = 20 + json_bytes;
    if (next == file.size()) {
        return out;
    }
    if (json_bytes % 4 != 0 || file.size() - next < 8 || word_at(file, next + 4) != bin_chunk ||
        word_at(file, next) > file.size() - next - 8) {
        refuse("second chunk: is no complete BIN chunk");
    }
    out.bin = file.subspan(next + 8, word_at(file, next));
    return out;
}

class Reader {
  public:
    Reader(const JsonObject &root, std::span<const std::byte> bin)
        : bin_(bin), accessors_(root.objects("accessors", most_entries)),
          views_(root.objects("bufferViews", most_entries)), meshes_(root.objects("meshes", most_entries)) {
        const std::vector<JsonObject> buffers = root.objects("buffers", 1);
        if (buffers.size() != 1 || buffers[0].has("uri")) {
            root.fail("buffers", "must be the one buffer in the BIN chunk");
        }
        const auto bytes =
            static_cast<std::size_t>(buffers[0].integer("byteLength", 1, static_cast<long long>(bin.size())));
        bin_ = bin.first(bytes);
        if (root.has("materials")) {
            for (const JsonObject &material : root.objects("materials", most_entries)) {
                materials_.push_back(material.text_or("name", ""));
            }
        }
        if (materials_.empty()) {
            materials_.emplace_back();
        }
    }

    GlbLevel level(const JsonObject &node) const {
        GlbLevel out;
        out.name = node.text_or("name", "");
        const JsonObject &mesh = meshes_[index(node, "mesh", meshes_.size())];
        std::optional<long long> vertices_from;
        std::size_t room = bin_.size();
        for (const JsonObject &primitive : mesh.objects("primitives", most_entries)) {
            const JsonObject attributes = primitive.object("attributes");
            if (primitive.integer_or("mode", 0, 6, 4) != 4) {
                primitive.fail("mode", "must be 4 (triangles)");
            }
            const long long positions = attributes.integer("POSITION", 0, most_count);
            if (vertices_from.value_or(positions) != positions) {
                primitive.fail("attributes", "primitives of one level must share their vertices");
            }
            if (!vertices_from) {
                read_attributes(attributes, out);
                vertices_from = positions;
            }
            read_indices(primitive, room, out);
        }
        if (out.primitives.empty()) {
            mesh.fail("primitives", "are missing");
        }
        return out;
    }

    std::vector<std::string> materials() const { return materials_; }

  private:
    static std::size_t index(const JsonObject &from, std::string_view key, std::size_t size) {
        return static_cast<std::size_t>(from.integer(key, 0, static_cast<long long>(size) - 1));
    }

    struct Accessor {
        std::span<const std::byte> bytes;
        std::uint32_t count = 0;
        long long component = 0;
    };

    Accessor accessor(const JsonObject &from, std::string_view key, const char *type,
                      std::size_t components) const {
        const JsonObject &entry = accessors_[index(from, key, accessors_.size())];
        Accessor out;
        out.component = entry.integer("componentType", 0, 65535);
        out.count = static_cast<std::uint32_t>(entry.integer("count", 1, most_count));
        if (entry.text("type") != type || entry.has("sparse") || entry.boolean_or("normalized", false)) {
            entry.fail("type", std::string("must be ") + type + ", neither sparse nor normalized");
        }
        const std::size_t component_bytes = out.component == ushort_type ? 2 : 4;
        if (out.component != float_type && out.component != ushort_type && out.component != uint_type) {
            entry.fail("componentType", "must be 5123, 5125 or 5126");
        }
        const JsonObject &view = views_[index(entry, "bufferView", views_.size())];
        const std::size_t stride = component_bytes * components;
        const auto most = static_cast<long long>(bin_.size());
        const auto start = static_cast<std::size_t>(view.integer_or("byteOffset", 0, most, 0));
        const auto length = static_cast<std::size_t>(view.integer("byteLength", 1, most));
        const auto within = static_cast<std::size_t>(entry.integer_or("byteOffset", 0, most, 0));
        if (view.integer("buffer", 0, 0) != 0 ||
            static_cast<std::size_t>(view.integer_or("byteStride", 0, 252, static_cast<long long>(stride))) !=
                stride) {
            view.fail("byteStride", "must be that of tightly packed data, " + std::to_string(stride));
        }
        const std::uint64_t needed = std::uint64_t{out.count} * stride;
        if (length > bin_.size() - start || within > length || needed > length - within ||
            (start + within) % component_bytes != 0) {
            entry.fail("count", std::to_string(needed) + " bytes at " + std::to_string(start) + " + " +
                                    std::to_string(within) + " do not lie, aligned, in a view of " +
                                    std::to_string(length) + " and a buffer of " +
                                    std::to_string(bin_.size()));
        }
        out.bytes = bin_.subspan(start + within, static_cast<std::size_t>(needed));
        return out;
    }

    void read_attributes(const JsonObject &attributes, GlbLevel &out) const {
        const auto floats = [&](std::string_view key, const char *type, std::size_t components) {
            const Accessor found = accessor(attributes, key, type, components);
            if (found.component != float_type) {
                attributes.fail(key, "must be float32");
            }
            if (out.vertices != 0 && found.count != out.vertices) {
                attributes.fail(key, "has " + std::to_string(found.count) + " entries, POSITION has " +
                                         std::to_string(out.vertices));
            }
            out.vertices = found.count;
            return found.bytes;
        };
        const auto maybe = [&](std::string_view key, const char *type, std::size_t components) {
            return attributes.has(key) ? floats(key, type, components) : std::span<const std::byte>();
        };
        out.positions = floats("POSITION", "VEC3", 3);
        out.normals = maybe("NORMAL", "VEC3", 3);
        out.tangents = maybe("TANGENT", "VEC4", 4);
        out.uvs = maybe("TEXCOORD_0", "VEC2", 2);
        out.uvs1 = maybe("TEXCOORD_1", "VEC2", 2);
        out.colors = maybe("COLOR_0", "VEC4", 4);
    }

    void read_indices(const JsonObject &primitive, std::size_t &room, GlbLevel &out) const {
        const Accessor indices = accessor(primitive, "indices", "SCALAR", 1);
        if (indices.component == float_type || indices.count % 3 != 0) {
            primitive.fail("indices", "must be whole triangles of uint16 or uint32");
        }
        const std::uint32_t bytes = indices.component == ushort_type ? 2 : 4;
        if (!out.primitives.empty() && bytes != out.index_bytes) {
            primitive.fail("indices", "must have one type in all primitives of a level");
        }
        out.index_bytes = bytes;
        // Primitives that share indices would make a small file a large mesh.
        if (indices.bytes.size() > room) {
            primitive.fail("indices", "the level's primitives have more indices than the buffer holds");
        }
        room -= indices.bytes.size();
        const long long last = static_cast<long long>(materials_.size()) - 1;
        out.primitives.push_back({static_cast<std::uint32_t>(primitive.integer_or("material", 0, last, 0)),
                                  indices.bytes, indices.count});
    }

    std::span<const std::byte> bin_;
    std::vector<JsonObject> accessors_, views_, meshes_;
    std::vector<std::string> materials_;
};

} // namespace

Glb read_glb(std::span<const std::byte> file, const std::string &name) {
    const Chunks chunks = split(file, name);
    const JsonDocument document(chunks.json, name);
    const JsonObject root = document.root();
    if (root.object("asset").text("version") != "2.0") {
        root.fail("asset", "version must be 2.0");
    }
    const Reader reader(root, chunks.bin);
    const std::vector<JsonObject> nodes = root.objects("nodes", most_entries);
    const auto last_node = static_cast<long long>(nodes.size()) - 1;
    const std::vector<JsonObject> scenes = root.objects("scenes", most_entries);
    const auto scene =
        static_cast<std::size_t>(root.integer_or("scene", 0, static_cast<long long>(scenes.size()) - 1, 0));
    if (scenes.empty()) {
        root.fail("scenes", "are missing");
    }
    const std::vector<long long> roots = scenes[scene].integers("nodes", most_entries, 0, last_node);
    if (roots.size() != 1) {
        scenes[scene].fail("nodes", "must name one node, level 0");
    }
    Glb out;
    out.materials = reader.materials();
    const JsonObject &finest = nodes[static_cast<std::size_t>(roots[0])];
    out.levels.push_back(reader.level(finest));
    if (finest.has("extensions") && finest.object("extensions").has("MSFT_lod")) {
        const JsonObject lod = finest.object("extensions").object("MSFT_lod");
        for (const long long id : lod.integers("ids", 64, 0, last_node)) {
            out.levels.push_back(reader.level(nodes[static_cast<std::size_t>(id)]));
        }
    }
    return out;
}

std::ptrdiff_t first_bad_index(std::span<const std::byte> indices, std::uint32_t index_bytes,
                               std::uint32_t vertices) {
    const std::size_t count = indices.size() / index_bytes;
    for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t value = 0; // little-endian: two bytes fill the low half
        std::memcpy(&value, indices.data() + i * index_bytes, index_bytes);
        if (value >= vertices) {
            return static_cast<std::ptrdiff_t>(i);
        }
    }
    return -1;
}

} // namespace paradize::assets
