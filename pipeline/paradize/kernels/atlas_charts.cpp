#include "atlas_charts.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "atlas_flatten.hpp"
#include "atlas_merge.hpp"
#include "parallel.hpp"

namespace paradize::atlas {

Charts make_charts(const Surface &surface, double deviation, int threads) {
    const Tree tree = merge_triangles(surface, deviation);
    struct Piece {
        std::vector<std::uint32_t> own;
        std::vector<double> corners;
    };
    std::vector<std::vector<Piece>> found(tree.roots.size());
    std::atomic<std::size_t> next{0};
    const auto lanes = static_cast<std::size_t>(std::max(threads, 1));
    for_rows(std::min(lanes, tree.roots.size()), threads, [&](std::size_t, std::size_t) {
        for (std::size_t root = next++; root < tree.roots.size(); root = next++) {
            std::vector<std::uint32_t> open{tree.roots[root]};
            while (!open.empty()) {
                const std::uint32_t node = open.back();
                open.pop_back();
                Piece piece{tree.leaves(node), {}};
                piece.corners = flatten(surface, piece.own);
                if (piece.corners.empty() && node >= tree.triangles) {
                    open.push_back(tree.parts[node - tree.triangles][1]);
                    open.push_back(tree.parts[node - tree.triangles][0]);
                    continue;
                }
                if (piece.corners.empty()) {
                    piece.corners = own_shape(surface, node);
                }
                found[root].push_back(std::move(piece));
            }
        }
    });
    Charts out;
    out.chart.resize(tree.triangles);
    out.corners.resize(tree.triangles * 6);
    for (const auto &pieces : found) {
        for (const Piece &piece : pieces) {
            for (std::size_t i = 0; i < piece.own.size(); ++i) {
                out.chart[piece.own[i]] = out.count;
                std::copy_n(piece.corners.begin() + static_cast<std::ptrdiff_t>(6 * i), 6,
                            out.corners.begin() + static_cast<std::ptrdiff_t>(6 * std::size_t{piece.own[i]}));
            }
            ++out.count;
        }
    }
    return out;
}

} // namespace paradize::atlas
