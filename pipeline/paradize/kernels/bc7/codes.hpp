// Ends of a line as the codes that a mode has for them. Rounding looks at what it costs the texels: for fixed
// places the squared error is a quadratic form of the ends, so every choice of the low bits is tried without
// another look at the texels, and the second end makes good what the first had to leave.
#pragma once

#include "bc7/lanes.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// How the low bits of the codes are chosen.
enum class Low { none, shared, own, ones };

// Bits: of a code, with the low bit. Steps: the largest index.
template <int Channels_, int Bits_, Low Low_, int Steps_, int Subsets_>
struct Shape {
    static constexpr int Channels = Channels_;
    static constexpr int Bits = Bits_;
    static constexpr Low low = Low_;
    static constexpr int Steps = Steps_;
    static constexpr int Subsets = Subsets_;
};

template <int Channels>
struct Endpoints {
    Lanes a[Channels];
    Lanes b[Channels];
};

// The squared error of moving the ends by (x, y) from where least squares put them is
// aa x^2 + 2 ab x y + bb y^2 in every channel.
struct Cost {
    Lanes aa;
    Lanes ab;
    Lanes bb;
};

// The value of codes, 0..255.
template <int Bits>
PARADIZE_INLINE Lanes value_of(const Lanes &code) {
    static_assert(Bits >= 5 && Bits <= 8);
    if constexpr (Bits == 8) {
        return code;
    }
    constexpr float up = 1 << (8 - Bits);
    constexpr float down = 1.0F / static_cast<float>(1 << (2 * Bits - 8));
    return code * up + below(code * down);
}

// The nearest code of a value, 0..255 or a little beyond; low: its low bit, or -1 where it is free.
template <int Bits>
PARADIZE_INLINE Lanes code_of(const Lanes &value, int low) {
    constexpr float top = (1 << Bits) - 1;
    if (low < 0) {
        return nearest(clamped(value * (top / 255.0F), top));
    }
    constexpr float half_top = (1 << (Bits - 1)) - 1;
    const float bit = static_cast<float>(low);
    return nearest(clamped((value * (top / 255.0F) - bit) * 0.5F, half_top)) * 2.0F + bit;
}

// Rounds one end, and then the other to what suits the first best; returns the cost. weight: of each channel,
// or null where all are 1.
template <int Channels, int Bits>
PARADIZE_INLINE Lanes round_ends(const Endpoints<Channels> &wanted, const Lanes *weight, const Cost &cost,
                                 const Lanes &lean, int low_a, int low_b, Endpoints<Channels> &code) {
    Lanes sum = Lanes{};
    for (int c = 0; c < Channels; ++c) {
        code.a[c] = code_of<Bits>(wanted.a[c], low_a);
        const Lanes x = value_of<Bits>(code.a[c]) - wanted.a[c];
        code.b[c] = code_of<Bits>(wanted.b[c] - lean * x, low_b);
        const Lanes y = value_of<Bits>(code.b[c]) - wanted.b[c];
        const Lanes price = cost.aa * x * x + 2.0F * cost.ab * x * y + cost.bb * y * y;
        sum += weight != nullptr ? price * weight[c] : price;
    }
    return sum;
}

template <typename S>
PARADIZE_INLINE void round_to_codes(const Endpoints<S::Channels> &wanted, const Lanes *weight,
                                    const Cost &cost, Endpoints<S::Channels> &code) {
    constexpr int C = S::Channels;
    const Lanes lean = cost.bb > 1e-3F ? cost.ab / cost.bb : Lanes{};
    if constexpr (S::low == Low::none) {
        round_ends<C, S::Bits>(wanted, weight, cost, lean, -1, -1, code);
    } else if constexpr (S::low == Low::ones) {
        round_ends<C, S::Bits>(wanted, weight, cost, lean, 1, 1, code);
    } else {
        Lanes best = round_ends<C, S::Bits>(wanted, weight, cost, lean, 0, 0, code);
        for (int choice = 1; choice < 4; ++choice) {
            if (S::low == Low::shared && choice != 3) {
                continue;
            }
            Endpoints<C> other;
            const Lanes price =
                round_ends<C, S::Bits>(wanted, weight, cost, lean, choice & 1, choice >> 1, other);
            const IntLanes better = price < best;
            best = better ? price : best;
            for (int c = 0; c < C; ++c) {
                code.a[c] = better ? other.a[c] : code.a[c];
                code.b[c] = better ? other.b[c] : code.b[c];
            }
        }
    }
}

} // namespace paradize::bc7::PARADIZE_WIDTH
