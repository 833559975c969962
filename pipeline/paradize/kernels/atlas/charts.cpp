#include "atlas/charts.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "atlas/flatten.hpp"
#include "atlas/merge.hpp"
#include "parallel.hpp"

namespace paradize::atlas {

namespace {

struct Piece {
    std::vector<std::uint32_t> own;
    std::vector<double> corners;
};

// Cuts what cannot be laid out along the tree of its joins.
class Cutter {
  public:
    Cutter(const Surface &surface, const Tree &tree) : surface_(surface), tree_(tree) {
        size_.assign(tree.triangles, 1);
        for (const auto &[a, b] : tree.parts) {
            size_.push_back(size_[a] + size_[b]);
        }
    }

    std::vector<Piece> cut(std::uint32_t root) const {
        std::vector<Piece> found;
        Piece whole = laid_out(root);
        if (!whole.corners.empty()) {
            found.push_back(std::move(whole));
            return found;
        }
        std::vector<std::uint32_t> open{root}; // all of them cannot be laid out
        while (!open.empty()) {
            const std::uint32_t node = open.back();
            open.pop_back();
            if (node < tree_.triangles) {
                found.push_back({{node}, own_shape(surface_, node)});
                continue;
            }
            // Most joins of a rough surface add a triangle to thousands. Instead of one after the other, all
            // are taken off down to half of the triangles, and as many put back as can be by bisection.
            std::vector<std::uint32_t> chain{node}, beside;
            while (chain.size() == 1 || 2 * size_[chain.back()] > size_[node]) {
                auto [a, b] = tree_.parts[chain.back() - tree_.triangles];
                if (size_[a] < size_[b]) {
                    std::swap(a, b);
                }
                chain.push_back(a);
                beside.push_back(b);
            }
            std::size_t fails = 0, fits = chain.size() - 1;
            Piece best = laid_out(chain[fits]);
            if (best.corners.empty()) {
                open.push_back(chain[fits]);
            } else {
                while (fits - fails > 1) {
                    const std::size_t middle = (fits + fails) / 2;
                    Piece piece = laid_out(chain[middle]);
                    if (piece.corners.empty()) {
                        fails = middle;
                    } else {
                        fits = middle;
                        best = std::move(piece);
                    }
                }
                found.push_back(std::move(best));
            }
            for (std::size_t k = 0; k < fits; ++k) {
                Piece piece = laid_out(beside[k]);
                if (piece.corners.empty()) {
                    open.push_back(beside[k]);
                } else {
                    found.push_back(std::move(piece));
                }
            }
        }
        return found;
    }

  private:
    Piece laid_out(std::uint32_t node) const {
        Piece piece{tree_.leaves(node), {}};
        piece.corners = flatten(surface_, piece.own);
        return piece;
    }

    const Surface &surface_;
    const Tree &tree_;
    std::vector<std::uint32_t> size_; // triangles of each node
};

} // namespace

Charts make_charts(const Surface &surface, double deviation, std::int32_t most, int threads) {
    const Tree tree = merge_triangles(surface, deviation);
    Charts out;
    if (tree.roots.size() > static_cast<std::size_t>(std::max(most, 0))) {
        out.count = static_cast<std::int32_t>(tree.roots.size());
        return out;
    }
    const Cutter cutter(surface, tree);
    std::vector<std::vector<Piece>> found(tree.roots.size());
    std::atomic<std::size_t> next{0};
    const auto lanes = static_cast<std::size_t>(std::max(threads, 1));
    for_rows(std::min(lanes, tree.roots.size()), threads, [&](std::size_t, std::size_t) {
        for (std::size_t root = next++; root < tree.roots.size(); root = next++) {
            found[root] = cutter.cut(tree.roots[root]);
        }
    });
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
