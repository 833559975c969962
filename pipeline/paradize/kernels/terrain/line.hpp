// A straight run of pixels between two ends, and the polyline through the fewest of them, greedily, that
// keeps a tolerance: it depends on the heights of the run, its two ends and the tolerance alone, and not on
// the end that it is told first, so that whoever meshes either side finds the same vertices. Greedy splits:
// Douglas, Peucker, "Algorithms for the Reduction of the Number of Points", 1973, of heights.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrain/scan.hpp"

namespace paradize::terrain {

class Line {
  public:
    // Along a row, a column or a diagonal; from and to may be the same pixel.
    Line(View view, Pixel from, Pixel to) : turned_(packed(to) < packed(from)) {
        const Pixel low = turned_ ? to : from, high = turned_ ? from : to;
        const int dx = high.x - low.x, dy = high.y - low.y;
        const int length = std::max(std::abs(dx), std::abs(dy));
        for (int k = 0; k <= length; ++k) {
            spots_.push_back({static_cast<std::uint16_t>(low.x + (dx > 0   ? k
                                                                  : dx < 0 ? -k
                                                                           : 0)),
                              static_cast<std::uint16_t>(low.y + (dy > 0 ? k : 0))});
            heights_.push_back(static_cast<double>(view.height(spots_.back())));
        }
    }

    // Calls add(before, after, spot) -> tag for every inner vertex: between the tags of two vertices that
    // follow one another so far, `before` the nearer to `from`; first and last are those of the ends.
    template <typename Add>
    void split(double tolerance, std::uint32_t first, std::uint32_t last, Add &&add) const {
        struct Part {
            int low, high;
            std::uint32_t low_tag, high_tag;
        };
        const int length = static_cast<int>(spots_.size()) - 1;
        std::vector<Part> open{{0, length, turned_ ? last : first, turned_ ? first : last}};
        while (!open.empty()) {
            const Part part = open.back();
            open.pop_back();
            const int worst = worst_between(part.low, part.high, tolerance);
            if (worst < 0) {
                continue;
            }
            const std::uint32_t tag = add(turned_ ? part.high_tag : part.low_tag,
                                          turned_ ? part.low_tag : part.high_tag, spot(worst));
            open.push_back({worst, part.high, tag, part.high_tag});
            open.push_back({part.low, worst, part.low_tag, tag});
        }
    }

  private:
    bool turned_;
    std::vector<Pixel> spots_; // from the end that is first in reading order
    std::vector<double> heights_;

    Pixel spot(int k) const { return spots_[static_cast<std::size_t>(k)]; }
    double height(int k) const { return heights_[static_cast<std::size_t>(k)]; }

    int worst_between(int low, int high, double tolerance) const {
        const double base = height(low), step = (height(high) - base) / (high - low);
        double worst = tolerance;
        int at = -1;
        for (int k = low + 1; k < high; ++k) {
            const double off = std::fabs(height(k) - (base + step * (k - low)));
            if (off > worst) {
                worst = off;
                at = k;
            }
        }
        return at;
    }
};

} // namespace paradize::terrain
