// Thousands of seeded mutations of every file type of the player. Each is rejected by name, or read
// completely, inside its bytes, as numbers that can be drawn. Most useful with the sanitizers.
#include "assets/inflate.hpp"
#include "assets/loaded_artifact.hpp"
#include "assets/payload.hpp"
#include "error.hpp"
#include "files.hpp"
#include "scene/flight.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

using namespace paradize;
using assets::PixelFormat;

namespace {

constexpr int rounds = 1500; // per file

/// Random numbers from a seed. The distributions of the standard library differ between implementations.
class Random {
  public:
    explicit Random(unsigned seed) : engine_(seed) {}
    std::size_t below(std::size_t count) { return engine_() % count; }

  private:
    std::mt19937 engine_;
};

/// Applies one to four changes: bits, bytes, words at extreme values, ranges that are copied, deleted or
/// doubled, truncation.
void mutate(test::Bytes &bytes, Random &random) {
    constexpr std::array<std::uint32_t, 8> words{0,          1,          0x7FFFFFFF, 0x80000000,
                                                 0xFFFFFFFF, 0x7FC00000, 0x7149F2CA, 65536};
    for (std::size_t change = 1 + random.below(4); change > 0 && bytes.size() > 8; --change) {
        const std::size_t at = random.below(bytes.size() - 4);
        const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        const auto length =
            static_cast<std::ptrdiff_t>(1 + random.below(std::min<std::size_t>(64, bytes.size() - at)));
        switch (random.below(7)) {
        case 0:
            *place ^= static_cast<std::byte>(1U << random.below(8));
            break;
        case 1:
            *place = static_cast<std::byte>(random.below(256));
            break;
        case 2:
            std::memcpy(bytes.data() + at, &words[random.below(words.size())], 4);
            break;
        case 3:
            std::copy_n(place, std::min(length, bytes.end() - place),
                        bytes.begin() + static_cast<std::ptrdiff_t>(random.below(
                                            bytes.size() - static_cast<std::size_t>(length) + 1)));
            break;
        case 4:
            bytes.erase(place, place + length);
            break;
        case 5: {
            const test::Bytes part(place, place + length);
            bytes.insert(place, part.begin(), part.end());
            break;
        }
        default:
            bytes.resize(random.below(8) == 0 ? at : bytes.size());
        }
    }
}

/// Mutates a text such that it often stays JSON: replaces numbers and words.
void mutate_text(std::string &text, Random &random) {
    constexpr std::array<const char *, 16> values{
        "1e30", "-1e30", "1e400", "-1",   "0",    "1.5",   "4294967296",  "1e-320",
        "null", "[]",    "{}",    "\"\"", "true", "[[0]]", "\"\\u0000\"", "\"sky\""};
    for (std::size_t change = 1 + random.below(3); change > 0; --change) {
        std::size_t begin = text.find_first_of("0123456789\"[{", random.below(text.size()));
        if (begin == std::string::npos) {
            continue;
        }
        const std::size_t end = text.find_first_of(",]}:\n", begin);
        text.replace(begin, std::min(end, text.size()) - begin, values[random.below(values.size())]);
    }
}

unsigned touched = 0; // reads every byte, so that the sanitizer finds invalid ones

void touch(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) {
        touched += static_cast<unsigned>(byte);
    }
}

/// A scene of one artifact with a correct hash.
struct OneFile {
    test::Folder folder;
    assets::SceneFile scene;

    explicit OneFile(assets::ArtifactKind kind) {
        assets::Artifact artifact;
        artifact.name = artifact.file = "a";
        artifact.kind = kind;
        scene.artifacts.push_back(artifact);
    }

    /// True if the file is accepted.
    bool open(const test::Bytes &bytes) {
        folder.write("a", bytes);
        scene.artifacts[0].bytes = bytes.size();
        scene.artifacts[0].sha256 = test::sha256_of(bytes);
        try {
            assets::LoadedArtifact loaded = assets::open_artifact(scene, 0, folder.path());
            assets::check_artifact(scene.artifacts[0], loaded);
            assets::StageMemory memory;
            for (const assets::Piece &piece : loaded.plan.pieces) {
                const assets::StagedPiece staged = stage(loaded, piece, memory);
                if (!staged.error.empty()) {
                    return false;
                }
                touch({staged.bytes.get(), piece.bytes});
            }
        } catch (const Error &error) {
            CHECK(std::string(error.what()).find(folder.path().string() + "/a: ") == 0);
            return false;
        }
        return true;
    }
};

} // namespace

TEST_CASE("fuzz: mutated textures are rejected or read completely") {
    for (const test::Bytes &file : {test::ktx2_file(PixelFormat::bc1_rgb_srgb, 32, 16),
                                    test::zstd_ktx2_file(PixelFormat::rg8_snorm, 16, 8),
                                    test::zstd_ktx2_file(PixelFormat::rgba16_float, 4, 8),
                                    test::ktx2_file(PixelFormat::r32_float, 4, 4)}) {
        OneFile one(assets::ArtifactKind::texture);
        int taken = 0;
        for (unsigned seed = 0; seed < rounds; ++seed) {
            Random random(seed);
            test::Bytes wrong = file;
            mutate(wrong, random);
            taken += one.open(wrong) ? 1 : 0;
        }
        CHECK(taken < rounds);
    }
}

TEST_CASE("fuzz: mutated meshes are rejected or read completely and drawable") {
    OneFile one(assets::ArtifactKind::mesh);
    const std::string json = test::glb_json();
    int taken = 0;
    for (unsigned seed = 0; seed < rounds; ++seed) {
        Random random(seed);
        test::Bytes wrong;
        if (seed % 2 == 0) {
            std::string text = json;
            mutate_text(text, random);
            wrong = test::glb_file(text);
        } else {
            wrong = test::glb_file(json);
            mutate(wrong, random);
        }
        taken += one.open(wrong) ? 1 : 0;
    }
    CHECK(taken > 0); // for example names, materials, or normals that still have length 1
    CHECK(taken < rounds);
}

TEST_CASE("fuzz: a mutated scene.json is rejected or gives finite camera poses") {
    test::SceneText whole;
    whole.extra =
        R"("largest_viewport": [640, 480], "free_camera": {"low": [-1, 0, -2], "high": [1, 3, 2], "near_m": 0.5},)";
    const std::string text = whole.str();
    int taken = 0;
    for (unsigned seed = 0; seed < rounds; ++seed) {
        Random random(seed);
        std::string wrong = text;
        if (seed % 3 != 0) {
            mutate_text(wrong, random);
        } else {
            const auto *raw = reinterpret_cast<const std::byte *>(text.data());
            test::Bytes bytes(raw, raw + text.size());
            mutate(bytes, random);
            wrong.assign(reinterpret_cast<const char *>(bytes.data()), bytes.size());
        }
        try {
            const assets::SceneFile scene = assets::parse_scene(wrong, "scene.json");
            for (const double second : {0.0, 2.5, 1e9}) {
                const glm::mat4 view = view_matrix(flight_pose(scene.flight, second));
                for (int column = 0; column < 4; ++column) {
                    for (int row = 0; row < 4; ++row) {
                        CHECK(std::isfinite(view[column][row]));
                    }
                }
            }
            ++taken;
        } catch (const Error &error) {
            CHECK(std::string(error.what()).starts_with("scene.json: "));
        }
    }
    CHECK(taken > 0);
    CHECK(taken < rounds);
}
