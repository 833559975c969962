#pragma once
// Small baked files in memory, and temporary folders.

#include "assets/ktx2.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace paradize::test {

using Bytes = std::vector<std::byte>;

/// A KTX2 file with all mips; byte i of level n is (i + n) mod 256.
Bytes ktx2_file(assets::PixelFormat format, std::uint32_t width_px, std::uint32_t height_px,
                std::uint32_t faces = 1);

/// The same, compressed with Zstandard.
Bytes zstd_ktx2_file(assets::PixelFormat format, std::uint32_t width_px, std::uint32_t height_px,
                     std::uint32_t faces = 1);
/// Compresses each level of an uncompressed KTX2 file.
Bytes zstd_of(const Bytes &plain);
/// Compresses `bytes` to one Zstandard frame, with or without its content size.
Bytes zstd_frame(std::span<const std::byte> bytes, bool says_size = true);
/// Returns the file with the frame of level 0 (the last in the file) replaced.
Bytes with_frame(const Bytes &file, std::span<const std::byte> frame);

/// Reads a whole KTX2 file, the headers of its compressed levels included. Spans point into `file`.
assets::Ktx2 read_ktx2(std::span<const std::byte> file, const std::string &name);

/// The SHA-256 of `bytes` in 64 hex digits.
std::string sha256_of(std::span<const std::byte> bytes);

/// The text with the first `from` in it, which must be there, replaced by `to`.
std::string replaced(std::string text, const std::string &from, const std::string &to);

/// JSON of a GLB with one or two levels of detail: a quad with two materials, and a triangle. `last_index`
/// replaces the last index of level 0.
std::string glb_json(bool two_levels = true);
Bytes glb_file(const std::string &json, std::uint16_t last_index = 3);

/// Returns "sha256" and "bytes" of an artifact as in scene.json.
std::string identity(std::span<const std::byte> file);

/// The text of a scene.json with one object, one sky and a circular flight. Its parts are JSON.
struct SceneText {
    std::string version = "10";
    std::string shadow = R"({"size": 64, "extent_m": 10, "center": [0, 0, 0], "blur_distance_m": 5})";
    std::string streaming = R"(["sky", "quad_mesh", "quad_color"])";
    std::string color = R"("quad_color")";
    std::string color_name = "quad_color.ktx2";
    Bytes color_file = ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
    std::string extra; // members of the root, each followed by a comma
    std::string str() const;
};

/// A temporary folder that is deleted with its content.
class Folder {
  public:
    Folder();
    ~Folder();
    Folder(const Folder &) = delete;
    Folder &operator=(const Folder &) = delete;
    std::filesystem::path path() const { return path_; }
    std::filesystem::path write(const std::string &name, std::span<const std::byte> bytes) const;
    std::filesystem::path write(const std::string &name, const std::string &text) const;

  private:
    std::filesystem::path path_;
};

/// Writes scene.json and its three artifacts.
void write_scene(const Folder &folder, const SceneText &text = {});

} // namespace paradize::test
