#include "assets/payload.hpp"

#include "assets/upload_plan.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace paradize::assets {

namespace {

constexpr float max_uv = 1e7F;
constexpr float max_texel = 1e7F;
// 8-bit quantisation changes the length by at most 0.7 %.
constexpr float min_unit_length = 0.9F;
constexpr float max_unit_length = 1.1F;

using Numbers = std::array<float, 4>;

template <typename Code>
float decoded(const std::byte *at, bool normalized) {
    Code code{};
    std::memcpy(&code, at, sizeof code);
    const auto value = static_cast<float>(code);
    if constexpr (std::is_integral_v<Code>) {
        return normalized ? std::max(value / static_cast<float>(std::numeric_limits<Code>::max()), -1.0F)
                          : value;
    } else {
        return value;
    }
}

template <typename Code, std::size_t count>
Numbers read_numbers(const std::byte *at, bool normalized) {
    Numbers out{};
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = decoded<Code>(at + i * sizeof(Code), normalized);
    }
    return out;
}

bool within(float value, float low, float high) {
    return value >= low && value <= high; // false for NaN
}

bool unit(const Numbers &v) {
    const float squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    return within(squared, min_unit_length * min_unit_length, max_unit_length * max_unit_length);
}

template <std::size_t size>
std::string shown(const std::array<float, size> &values, std::size_t count) {
    std::string out = "(";
    for (std::size_t i = 0; i < count; ++i) {
        out += (i == 0 ? "" : ", ") + shortest(values[i]);
    }
    return out + ")";
}

struct Attribute {
    const char *name;
    std::size_t components;
};
constexpr std::array<Attribute, mesh_attributes> attributes{{{"POSITION", 3},
                                                             {"NORMAL", 3},
                                                             {"TANGENT", 4},
                                                             {"TEXCOORD_0", 2},
                                                             {"TEXCOORD_1", 2},
                                                             {"COLOR_0", 4},
                                                             {"_SWAY", 2}}};

template <std::uint32_t part>
bool keeps_rule(const GlbLevel &level, const Numbers &v) {
    const auto all_within = [&](float low, float high) {
        return std::all_of(v.begin(), v.begin() + attributes[part].components,
                           [&](float value) { return within(value, low, high); });
    };
    if constexpr (part == 0) {
        return within(v[0], level.low[0], level.high[0]) && within(v[1], level.low[1], level.high[1]) &&
               within(v[2], level.low[2], level.high[2]);
    } else if constexpr (part == 1) {
        return unit(v);
    } else if constexpr (part == 2) {
        return unit(v) && within(std::abs(v[3]), min_unit_length, max_unit_length);
    } else if constexpr (part == 5 || part == 6) {
        return all_within(0.0F, 1.0F);
    } else {
        return all_within(-max_uv, max_uv);
    }
}

std::string rule_of(const GlbLevel &level, std::uint32_t part) {
    switch (part) {
    case 0:
        return "must lie within its accessor's min " + shown(level.low, 3) + " and max " +
               shown(level.high, 3);
    case 1:
        return "must have length 1";
    case 2:
        return "must have length 1 and w 1 or -1";
    case 5:
    case 6:
        return "must lie in 0 to 1";
    default:
        return "must lie within " + shortest(max_uv) + " of 0";
    }
}

std::string place_of(const GlbLevel &level, const std::string &name) {
    return name + ": node " + level.name + ", ";
}

/// Throws Error at the first vertex whose attribute, of this type, breaks its rule. What is known while
/// compiling is not a branch in the loop.
template <std::uint32_t part, typename Code>
void check_codes(const GlbLevel &level, const std::string &name) {
    const std::byte *at = mesh_attribute(level, part).data();
    const GlbFormat &format = level.formats[part];
    for (std::size_t vertex = 0; vertex < level.vertices; ++vertex, at += format.stride) {
        const Numbers v = read_numbers<Code, attributes[part].components>(at, format.normalized);
        if (!keeps_rule<part>(level, v)) {
            throw Error(place_of(level, name) + attributes[part].name + ", vertex " + std::to_string(vertex) +
                        ": is " + shown(v, attributes[part].components) + ", " + rule_of(level, part) +
                        bake_again);
        }
    }
}

template <std::uint32_t part>
void check_attribute(const GlbLevel &level, const std::string &name) {
    if (mesh_attribute(level, part).empty()) {
        return;
    }
    switch (level.formats[part].component) {
    case 5120:
        return check_codes<part, std::int8_t>(level, name);
    case 5121:
        return check_codes<part, std::uint8_t>(level, name);
    case 5122:
        return check_codes<part, std::int16_t>(level, name);
    case 5123:
        return check_codes<part, std::uint16_t>(level, name);
    default:
        return check_codes<part, float>(level, name);
    }
}

/// Decodes a half float (IEEE 754 binary16) that is an infinity or NaN.
float non_finite_half(std::uint16_t code) {
    const float size = (code & 0x3FFU) == 0 ? std::numeric_limits<float>::infinity()
                                            : std::numeric_limits<float>::quiet_NaN();
    return (code & 0x8000U) != 0 ? -size : size;
}

/// Returns the index of the first bad value, or their count. A first loop without branches checks whether
/// there is one at all.
template <typename Code, typename Bad>
std::size_t first_invalid(std::span<const std::byte> bytes, Bad bad) {
    const std::size_t count = bytes.size() / sizeof(Code);
    const auto code_at = [&](std::size_t i) {
        Code code{};
        std::memcpy(&code, bytes.data() + i * sizeof(Code), sizeof code);
        return code;
    };
    unsigned any = 0;
    for (std::size_t i = 0; i < count; ++i) {
        any |= bad(code_at(i)) ? 1U : 0U;
    }
    std::size_t at = any != 0 ? 0 : count;
    while (at < count && !bad(code_at(at))) {
        ++at;
    }
    return at;
}

std::string texel_message(const Ktx2Level &level, std::size_t code, std::size_t channels, float value) {
    const std::size_t texel = code / channels;
    const std::size_t in_face = texel % (std::size_t{level.width_px} * level.height_px);
    return (level.faces == 1
                ? ""
                : "face " + std::to_string(texel / (std::size_t{level.width_px} * level.height_px)) + ", ") +
           "texel (" + std::to_string(in_face % level.width_px) + ", " +
           std::to_string(in_face / level.width_px) + "), channel " + std::to_string(code % channels) +
           ": is " + shortest(value) + ", must be finite and within " + shortest(max_texel) + " of 0" +
           bake_again;
}

} // namespace

void check_level(const GlbLevel &level, const std::string &name) {
    [&]<std::uint32_t... part>(std::integer_sequence<std::uint32_t, part...>) {
        (check_attribute<part>(level, name), ...);
    }
    (std::make_integer_sequence<std::uint32_t, mesh_attributes>());
    for (std::size_t i = 0; i < level.primitives.size(); ++i) {
        const std::span<const std::byte> indices = level.primitives[i].indices;
        const auto bad = [&](std::uint32_t index) { return index >= level.vertices; };
        const bool narrow = level.index_bytes == 2;
        const std::size_t at =
            narrow ? first_invalid<std::uint16_t>(indices, bad) : first_invalid<std::uint32_t>(indices, bad);
        if (at < indices.size() / level.index_bytes) {
            std::uint32_t index = 0; // little-endian: two bytes fill the low half
            std::memcpy(&index, indices.data() + at * level.index_bytes, level.index_bytes);
            throw Error(place_of(level, name) + "primitive " + std::to_string(i) + ", index " +
                        std::to_string(at) + ": is " + std::to_string(index) + ", must be below the " +
                        std::to_string(level.vertices) + " vertices" + bake_again);
        }
    }
}

void check_mesh(const Glb &glb, const std::string &name) {
    for (const GlbLevel &level : glb.levels) {
        check_level(level, name);
    }
}

std::string texel_error(const Ktx2Level &level) {
    if (level.format == PixelFormat::rgba16_float) { // the largest half is 65504
        const auto bad = [](std::uint16_t code) { return (code & 0x7C00U) == 0x7C00U; };
        if (const std::size_t at = first_invalid<std::uint16_t>(level.bytes, bad);
            at < level.bytes.size() / 2) {
            std::uint16_t code = 0;
            std::memcpy(&code, level.bytes.data() + at * 2, sizeof code);
            return texel_message(level, at, 4, non_finite_half(code));
        }
    } else if (level.format == PixelFormat::r32_float) {
        const auto bad = [](float value) { return !(std::abs(value) <= max_texel); };
        if (const std::size_t at = first_invalid<float>(level.bytes, bad); at < level.bytes.size() / 4) {
            float value = 0.0F;
            std::memcpy(&value, level.bytes.data() + at * 4, sizeof value);
            return texel_message(level, at, 1, value);
        }
    }
    return "";
}

void check_texels(const Ktx2 &ktx, const std::string &name) {
    for (std::size_t i = 0; i < ktx.levels.size(); ++i) {
        if (ktx.levels[i].compressed.empty()) {
            if (const std::string error = texel_error(ktx.levels[i]); !error.empty()) {
                throw Error(name + ": level " + std::to_string(i) + ", " + error);
            }
        }
    }
}

} // namespace paradize::assets
