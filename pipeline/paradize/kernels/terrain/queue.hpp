// Triangles with an error, the largest first, eight steps to each doubling; of one step the last that came.
// Every triangle is held at most once, and all that is done to it takes the same time however many there are.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrain/scan.hpp"

namespace paradize::terrain {

class WorstFirst {
  public:
    WorstFirst() { heads_.fill(none); }

    // Room for triangles below `count`.
    void reach(std::size_t count) { links_.resize(count); }

    void reserve(std::size_t count) { links_.reserve(count); }

    // error: >= 0. The triangle must not be held.
    void add(std::uint32_t triangle, double error) {
        const auto step = std::bit_cast<std::uint32_t>(static_cast<float>(error)) >> shift;
        Link &link = links_[triangle];
        link = {none, heads_[step], step};
        if (link.after != none) {
            links_[link.after].before = triangle;
        }
        heads_[step] = triangle;
        filled_[step / 64] |= std::uint64_t{1} << step % 64;
        top_ = std::max(top_, step / 64);
    }

    // Does nothing where the triangle is not held.
    void drop(std::uint32_t triangle) {
        Link &link = links_[triangle];
        if (link.step == none) {
            return;
        }
        if (link.after != none) {
            links_[link.after].before = link.before;
        }
        if (link.before != none) {
            links_[link.before].after = link.after;
        } else {
            heads_[link.step] = link.after;
            if (link.after == none) {
                filled_[link.step / 64] &= ~(std::uint64_t{1} << link.step % 64);
            }
        }
        link.step = none;
    }

    // The worst, which stays; `none` where there is none.
    std::uint32_t worst() {
        while (filled_[top_] == 0) {
            if (top_ == 0) {
                return none;
            }
            --top_;
        }
        const auto bit = static_cast<std::uint32_t>(std::bit_width(filled_[top_]) - 1);
        return heads_[64 * top_ + bit];
    }

  private:
    static constexpr int shift = 20; // keeps the exponent and three bits of a float that is not negative
    struct Link {
        std::uint32_t before = none, after = none, step = none; // step: none where the triangle is not held
    };
    std::vector<Link> links_;
    std::array<std::uint32_t, 2048> heads_;
    std::array<std::uint64_t, 32> filled_{};
    std::uint32_t top_ = 0; // the words of `filled_` above are 0
};

} // namespace paradize::terrain
