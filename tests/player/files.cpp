#include "files.hpp"

#include "assets/sha256.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <zstd.h>

namespace paradize::test {

namespace {

template <typename T>
void put(Bytes &out, T value) {
    out.resize(out.size() + sizeof value);
    std::memcpy(out.data() + out.size() - sizeof value, &value, sizeof value);
}

template <typename T>
void put_at(Bytes &out, std::size_t offset, T value) {
    std::memcpy(out.data() + offset, &value, sizeof value);
}

} // namespace

Bytes ktx2_file(assets::PixelFormat format, std::uint32_t width_px, std::uint32_t height_px,
                std::uint32_t faces) {
    const auto levels = static_cast<std::uint32_t>(std::bit_width(std::max(width_px, height_px)));
    Bytes out;
    for (const unsigned char byte :
         {0xABU, 0x4BU, 0x54U, 0x58U, 0x20U, 0x32U, 0x30U, 0xBBU, 0x0DU, 0x0AU, 0x1AU, 0x0AU}) {
        out.push_back(static_cast<std::byte>(byte));
    }
    for (const std::uint32_t word : {static_cast<std::uint32_t>(format), 1U, width_px, height_px, 0U, 0U,
                                     faces, levels, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U}) {
        put(out, word);
    }
    out.resize(80 + 24 * levels);
    const assets::BlockShape block = assets::block_shape(format);
    for (std::uint32_t level = levels; level-- > 0;) {
        const std::uint64_t across = (std::max(1U, width_px >> level) + block.edge_px - 1) / block.edge_px;
        const std::uint64_t down = (std::max(1U, height_px >> level) + block.edge_px - 1) / block.edge_px;
        const std::uint64_t bytes = across * down * block.bytes * faces;
        out.resize((out.size() + 15) / 16 * 16);
        put_at(out, 80 + 24 * level, std::uint64_t{out.size()});
        put_at(out, 88 + 24 * level, bytes);
        put_at(out, 96 + 24 * level, bytes);
        for (std::uint64_t i = 0; i < bytes; ++i) {
            out.push_back(static_cast<std::byte>((i + level) % 256));
        }
    }
    return out;
}

Bytes zstd_frame(std::span<const std::byte> bytes, bool says_size) {
    const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx *)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_contentSizeFlag, says_size ? 1 : 0);
    Bytes out(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress2(context.get(), out.data(), out.size(), bytes.data(), bytes.size()));
    return out;
}

Bytes zstd_ktx2_file(assets::PixelFormat format, std::uint32_t width_px, std::uint32_t height_px,
                     std::uint32_t faces) {
    return zstd_of(ktx2_file(format, width_px, height_px, faces));
}

Bytes zstd_of(const Bytes &plain) {
    std::uint32_t levels = 0;
    std::memcpy(&levels, plain.data() + 40, sizeof levels);
    Bytes out(plain.begin(), plain.begin() + 80 + 24 * static_cast<std::ptrdiff_t>(levels));
    put_at(out, 44, std::uint32_t{2});
    for (std::uint32_t level = levels; level-- > 0;) {
        std::uint64_t at = 0;
        std::uint64_t length = 0;
        std::memcpy(&at, plain.data() + 80 + 24 * level, sizeof at);
        std::memcpy(&length, plain.data() + 88 + 24 * level, sizeof length);
        const Bytes frame = zstd_frame(std::span(plain).subspan(at, length));
        put_at(out, 80 + 24 * level, std::uint64_t{out.size()});
        put_at(out, 88 + 24 * level, std::uint64_t{frame.size()});
        out.insert(out.end(), frame.begin(), frame.end());
    }
    return out;
}

Bytes with_frame(const Bytes &file, std::span<const std::byte> frame) {
    std::uint64_t at = 0;
    std::memcpy(&at, file.data() + 80, sizeof at);
    Bytes out(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(at));
    put_at(out, 88, std::uint64_t{frame.size()});
    out.insert(out.end(), frame.begin(), frame.end());
    return out;
}

std::string replaced(std::string text, const std::string &from, const std::string &to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos)
        throw std::invalid_argument(from + " is not in the text");
    return text.replace(at, from.size(), to);
}

std::string glb_json(bool two_levels) {
    std::string lod = two_levels ? R"(,"extensions":{"MSFT_lod":{"ids":[1]}})" : "";
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"lod0","mesh":0)" +
           lod + R"(},{"name":"lod1","mesh":1}],
"materials":[{"name":"wood","extras":{"center":[0,0,0]}},{"name":"leaf","extras":{"center":[0.5,0,-0.5]}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0},
{"attributes":{"POSITION":0,"NORMAL":1},"indices":3,"material":1}]},
{"primitives":[{"attributes":{"POSITION":4},"indices":2,"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]},
{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"},
{"bufferView":2,"byteOffset":6,"componentType":5123,"count":3,"type":"SCALAR"},
{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":48},
{"buffer":0,"byteOffset":96,"byteLength":12}],
"buffers":[{"byteLength":108}]})";
}

Bytes glb_file(const std::string &json, std::uint16_t last_index) {
    Bytes bin;
    for (const float value : {-1.0F, 0.0F, -1.0F, 1.0F, 0.0F, -1.0F, -1.0F, 0.0F, 1.0F, 1.0F, 0.0F, 1.0F}) {
        put(bin, value);
    }
    for (int i = 0; i < 4; ++i) {
        put(bin, 0.0F);
        put(bin, 1.0F);
        put(bin, 0.0F);
    }
    for (const std::uint16_t index : std::array<std::uint16_t, 6>{0, 2, 1, 1, 2, last_index}) {
        put(bin, index);
    }
    std::string padded = json;
    padded.resize((json.size() + 3) / 4 * 4, ' ');
    Bytes out;
    put(out, std::uint32_t{0x46546C67});
    put(out, std::uint32_t{2});
    put(out, static_cast<std::uint32_t>(28 + padded.size() + bin.size()));
    put(out, static_cast<std::uint32_t>(padded.size()));
    put(out, std::uint32_t{0x4E4F534A});
    const auto *raw = reinterpret_cast<const std::byte *>(padded.data());
    out.insert(out.end(), raw, raw + padded.size());
    put(out, static_cast<std::uint32_t>(bin.size()));
    put(out, std::uint32_t{0x004E4942});
    out.insert(out.end(), bin.begin(), bin.end());
    return out;
}

namespace {

Bytes sky_file() {
    return ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 6);
}

} // namespace

assets::Ktx2 read_ktx2(std::span<const std::byte> file, const std::string &name) {
    assets::Ktx2 out = assets::read_ktx2_front(file, name);
    assets::check_frames(out, name);
    return out;
}

std::string sha256_of(std::span<const std::byte> bytes) {
    assets::Sha256 hash;
    hash.add(bytes);
    return hash.hex();
}

std::string identity(std::span<const std::byte> file) {
    return R"("sha256": ")" + sha256_of(file) + R"(", "bytes": )" + std::to_string(file.size());
}

std::string SceneText::str() const {
    return R"({"format": "paradize-scene", "version": )" + version + "," + extra +
           R"("name": "test", "exposure": 1.0, "viewport": [64, 36], "lod_error_px": 1.0, "poster_s": 1.0,
"artifacts": {"sky": {"file": "sky.ktx2", "kind": "cubemap", )" +
           identity(sky_file()) + R"(, "tier": "balanced",
  "errors": {}, "first_needed_s": 0},
 "quad_mesh": {"file": "quad_mesh.glb", "kind": "mesh", )" +
           identity(glb_file(glb_json())) + R"(}, "quad_color": {"file": ")" + color_name +
           R"(", "kind": "texture", )" + identity(color_file) + R"(,
  "levels": [], "max_level": 3, "gutter": {"islands": 1}}},
"streaming": )" +
           streaming + R"(,
"sun": {"direction": [0, 1, 0], "color": [1, 1, 1], "intensity": 3, "angular_diameter_rad": 0.0093},
"ambient": {"color": [1, 1, 1], "intensity": 0.5}, "fog": {"color": [1, 1, 1], "density_per_m": 0.001},
"wind": {"direction": [0.6, -0.8], "speed_m_per_s": 5, "gust_m": 20},
"sky": {"cubemap": "sky"}, "shadow": )" +
           shadow + R"(, "reflection": {"scale": 0.5}, "refraction": null, "terrain": null, "water": null,
"objects": [{"name": "quad", "mesh": "quad_mesh",
 "center": [0, 0, 0], "radius_m": 1.5, "lods": [{"node": "lod0", "error_m": 0}, {"node": "lod1", "error_m": 0.1}],
 "materials": {"leaf": {"color": [1, 1, 1], "opacity": 0.5, "maps": {"color": )" +
           color + R"(, "normal": null, "height": null, "gloss": null, "occlusion": null, "emission": null},
  "wrap": ["clamp", "mirror"], "nearest": true, "metalness": 0.25, "emission": [1, 2, 3], "occlusion_strength": 0.75,
  "parallax_scale": 0, "parallax_bias": 0, "parallax_limit": 0.25, "specular": 0.5, "smoothness": 0.7,
  "two_sided": true, "translucency": 0.25, "alpha_mode": "mask", "alpha_cutoff": 0.5, "vertex_colors": true,
  "vertex_lit": true}},
 "sway": {"lean_m": 0.5, "flutter_m": 0.25},
 "instances": [{"position": [0, 0, 0], "rotation": [0, 0.6, 0, 0.8], "scale": [2, 2, -3]}]}],
"particles": [], "sounds": [], "music": null,
"flight": {"duration_s": 10, "fov_rad": 0.9, "near_m": 0.5, "far_m": 100,
 "segments": [{"eye": [[0, 5, 0, 0], [2, 0, 0, 0], [5, 0, 0, 0]], "target": [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]],
   "roll": [0, 0, 0, 0]},
  {"eye": [[5, -5, 0, 0], [2, 0, 0, 0], [5, 0, 0, 0]], "target": [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]],
   "roll": [0, 0, 0, 0]}],
 "time_table": [[0, 0, 0.2], [5, 1, 0.2], [10, 2, 0.2]]}})";
}

Folder::Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "paradize-test-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) {
        throw std::runtime_error("no temporary folder");
    }
    path_ = pattern;
}

Folder::~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path Folder::write(const std::string &name, std::span<const std::byte> bytes) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream out(path_ / name, std::ios::binary);
    out.write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path_ / name;
}

std::filesystem::path Folder::write(const std::string &name, const std::string &text) const {
    return write(name, std::as_bytes(std::span(text)));
}

void write_scene(const Folder &folder, const SceneText &text) {
    folder.write("scene.json", text.str());
    folder.write("sky.ktx2", sky_file());
    folder.write(text.color_name, text.color_file);
    folder.write("quad_mesh.glb", glb_file(glb_json()));
}

} // namespace paradize::test
