// The fast tier of a block's colour: texels are cut in two at the mean of the channel that varies most, the
// line from one half's mean to the other's places them, and least squares makes the ends of that.
#pragma once

#include "bcn/color.hpp"
#include "bcn/halves.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr int one = 64; // by which sums count texels
constexpr int narrow_width =
    16; // of all three channels; the nearest ends of one color serve narrower blocks better

PARADIZE_INLINE IntLanes low_half(const IntLanes &v) {
    return v & 0xFFFF;
}

PARADIZE_INLINE IntLanes high_half(const IntLanes &v) {
    return v >> 16;
}

PARADIZE_INLINE IntLanes halves(const IntLanes &low, const IntLanes &high) {
    return low_half(low) | high << 16;
}

// Of one texel, or sums over some: red (low half) and blue; green and `one`.
struct Pairs {
    IntLanes rb;
    IntLanes g1;
};

PARADIZE_INLINE Lanes channel(const Pairs &pairs, int k) {
    return to_float(k == 0 ? low_half(pairs.rb) : k == 1 ? low_half(pairs.g1) : high_half(pairs.rb));
}

PARADIZE_INLINE IntLanes dot(const Pairs &a, const Pairs &b) {
    return dot(a.rb, b.rb) + dot(a.g1, b.g1);
}

// The state of `lanes` blocks.
struct FastColors {
    Pairs v[texels];
    Pairs all;      // sum of v
    Pairs weight;   // of the line that places texels
    IntLanes width; // ranges of the three channels, added
};

// The direction from the mean of the texels below the mean, in the channel of the largest range, to the mean
// of those above it.
PARADIZE_INLINE void find_axis(const IntLanes (&words)[texels], FastColors &colors) {
    Pairs all = {};
    IntLanes low = words[0], high = words[0];
    for (std::size_t i = 0; i < texels; ++i) {
        low = least_bytes(low, words[i]);
        high = most_bytes(high, words[i]);
        colors.v[i] = {words[i] & 0x00FF00FF, (words[i] >> 8 & 255) | one << 16};
        all.rb += colors.v[i].rb;
        all.g1 += colors.v[i].g1;
    }
    colors.all = all;
    const IntLanes range = (IntLanes)((Bytes)high - (Bytes)low);
    const IntLanes r = range & 255, g = range >> 8 & 255, b = range >> 16 & 255;
    colors.width = r + g + b;
    const auto green = (g >= r) & (g >= b);
    const auto red = r >= b;
    const IntLanes shift = green ? IntLanes{} + 8 : red ? IntLanes{} : IntLanes{} + 16;
    const IntLanes sum = green ? low_half(all.g1) : red ? low_half(all.rb) : high_half(all.rb);
    const IntLanes mean = sum >> 4;
    Pairs up = {};
    for (std::size_t i = 0; i < texels; ++i) {
        const auto above = (words[i] >> shift & 255) > mean;
        up.rb = above ? up.rb + colors.v[i].rb : up.rb;
        up.g1 = above ? up.g1 + colors.v[i].g1 : up.g1;
    }
    const Lanes share = to_float(high_half(up.g1)) * (1.0F / (16.0F * one));
    Lanes axis[3], length = splat(1e-3F);
    for (int k = 0; k < 3; ++k) {
        axis[k] = channel(up, k) - channel(all, k) * share;
        length += absolute(axis[k]);
    }
    const Lanes unit = 126.0F / length; // weights that keep places within 16 bits
    colors.weight = {halves(to_int(axis[0] * unit), to_int(axis[2] * unit)),
                     low_half(to_int(axis[1] * unit))};
}

// Ends by least squares for places along the axis, of ends an eighth nearer to each other than the outermost
// texels. Returns their word, and leaves the weights that place texels between them.
PARADIZE_INLINE IntLanes find_ends(FastColors &colors) {
    Halves place[texels / 2];
    Halves low, high;
    for (std::size_t i = 0; i < texels / 2; ++i) {
        place[i] = packed(dot(colors.v[i], colors.weight), dot(colors.v[i + 8], colors.weight));
        low = i == 0 ? place[i] : least(low, place[i]);
        high = i == 0 ? place[i] : most(high, place[i]);
    }
    const IntLanes bottom = (IntLanes)least((Halves)first_twice(low), (Halves)last_twice(low)) >> 16;
    const IntLanes top = (IntLanes)most((Halves)first_twice(high), (Halves)last_twice(high)) >> 16;
    const Lanes reach = to_float(top - bottom);
    const Lanes most_scale = splat(65535.0F);
    const IntLanes scale =
        to_int(least(3.0F / 0.875F * 65536.0F / most(reach, splat(1.0F)), most_scale)) << 16 >> 16;
    const IntLanes start_at = bottom - to_int(reach * (1.0F / 12.0F));
    const Halves scales = packed(scale, scale), from = packed(start_at, start_at);
    Pairs by_place = {};
    Halves squares = {};
    for (std::size_t i = 0; i < texels / 2; ++i) {
        const Halves q = upper_product((Halves)((Unsigned)place[i] - (Unsigned)from), scales);
        squares += q * q;
        const IntLanes a = first_twice(q), b = last_twice(q);
        by_place.rb += product(colors.v[i].rb, a) + product(colors.v[i + 8].rb, b);
        by_place.g1 += product(colors.v[i].g1, a) + product(colors.v[i + 8].g1, b);
    }
    const Lanes q_sum = to_float(high_half(by_place.g1)) * (1.0F / one);
    const Lanes qq = to_float(high_half(first_twice(squares)) + high_half(last_twice(squares)));
    const Lanes determinant = qq * 16.0F - q_sum * q_sum;
    const auto spread = (determinant > 0.5F) & (colors.width > narrow_width);
    const Lanes inverse = 1.0F / most(determinant, splat(1.0F));
    Endpoints codes;
    for (int k = 0; k < 3; ++k) {
        const Lanes sum = channel(colors.all, k);
        const Lanes step = (channel(by_place, k) * 16.0F - q_sum * sum) * inverse;
        const Lanes start = (sum - step * q_sum) * (1.0F / 16.0F);
        Lanes a, b;
        solid_codes(sum * (1.0F / 16.0F), k, a, b);
        codes.a[k] =
            spread ? nearest(clamped((start + step * 3.0F) * (1.0F / code_unit[k]), code_top[k])) : a;
        codes.b[k] = spread ? nearest(clamped(start * (1.0F / code_unit[k]), code_top[k])) : b;
    }
    // The larger word first: four colours. Places are counted from its end.
    const IntLanes a = to_int(codes.a[0] * 2048.0F + codes.a[1] * 32.0F + codes.a[2]);
    const IntLanes b = to_int(codes.b[0] * 2048.0F + codes.b[1] * 32.0F + codes.b[2]);
    const auto swap = a < b;
    Lanes delta[3], square = {};
    for (int k = 0; k < 3; ++k) {
        const Lanes gap = (codes.b[k] - codes.a[k]) * code_unit[k];
        delta[k] = swap ? -gap : gap;
        square += gap * gap;
    }
    constexpr float step = 8192.0F; // a place
    const Lanes per = 3.0F * step / most(square, splat(1.0F));
    Lanes middle = splat(step * 2.0F); // a half for the rounding
    IntLanes ruler[3];
    for (int k = 0; k < 3; ++k) {
        ruler[k] = to_int(delta[k] * per);
        middle -= to_float(ruler[k]) * ((codes.a[k] + codes.b[k]) * (0.5F * code_unit[k]));
    }
    colors.weight = {halves(ruler[0], ruler[2]), halves(ruler[1], to_int(middle * (1.0F / one)))};
    return swap ? (b | a << 16) : (a | b << 16);
}

// The word of the places; ends: that of the ends.
PARADIZE_INLINE IntLanes find_places(const FastColors &colors, const IntLanes &ends) {
    Halves bits = {};
    for (std::size_t i = 0; i < texels / 2; ++i) {
        const Halves at = packed(dot(colors.v[i], colors.weight), dot(colors.v[i + 8], colors.weight));
        bits |= most(at, Halves{}) >> 13 << (2 * static_cast<int>(i));
    }
    const IntLanes places = halves(first_twice(bits), last_twice(bits));
    const IntLanes ones = IntLanes{} + 0x55555555;
    const IntLanes upper = (places >> 1) & ones;
    const IntLanes lower = places & ones;
    return (ends ^ ends << 16) >> 16 == 0 ? IntLanes{} : ((upper ^ lower) << 1) | upper;
}

} // namespace paradize::bcn::PARADIZE_WIDTH
