#include "atlas/merge.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

namespace paradize::atlas {

namespace {

// The weight of a border beside flatness: of the ratio of its square to that of a disc of the same area.
constexpr double roundness_weight = 0.01;

struct Cluster {
    std::array<double, 3> normal{}; // sum of normals times area
    double area = 0, border = 0;
    std::vector<std::pair<std::uint32_t, double>> neighbours; // by rising node: length shared
    bool alive = true;
};

struct Edge {
    std::uint32_t low, high, triangle;
    bool turned;
    auto key() const { return std::tie(low, high, triangle, turned); }
};

double distance(const double *a, const double *b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

struct Candidate {
    double cost;
    std::uint32_t a, b;
    double shared;
    bool operator<(const Candidate &other) const { // the cheapest comes out of the queue first
        return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
};

class Merger {
  public:
    Merger(const Surface &surface, double deviation) : deviation_(deviation) {
        const std::size_t count = surface.triangles.size() / 3;
        tree_.triangles = count;
        clusters_.resize(count);
        clusters_.reserve(2 * count);
        std::vector<Edge> edges;
        edges.reserve(3 * count);
        for (std::uint32_t t = 0; t < count; ++t) {
            const std::uint32_t *corner = surface.triangles.data() + 3 * std::size_t{t};
            const double *p[3];
            for (int k = 0; k < 3; ++k) {
                p[k] = surface.positions.data() + 3 * std::size_t{corner[k]};
            }
            Cluster &cluster = clusters_[t];
            double a[3], b[3];
            for (int k = 0; k < 3; ++k) {
                a[k] = p[1][k] - p[0][k];
                b[k] = p[2][k] - p[0][k];
            }
            for (int k = 0; k < 3; ++k) {
                const int i = (k + 1) % 3, j = (k + 2) % 3;
                cluster.normal[static_cast<std::size_t>(k)] = (a[i] * b[j] - a[j] * b[i]) / 2;
                cluster.border += distance(p[k], p[i]);
                edges.push_back({std::min(corner[k], corner[i]), std::max(corner[k], corner[i]), t,
                                 corner[k] > corner[i]});
            }
            cluster.area = length(cluster.normal);
        }
        std::ranges::sort(edges, [](const Edge &x, const Edge &y) { return x.key() < y.key(); });
        for (std::size_t i = 0; i < edges.size();) {
            std::size_t end = i;
            while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) {
                ++end;
            }
            if (end - i == 2 && edges[i].turned != edges[i + 1].turned &&
                edges[i].triangle != edges[i + 1].triangle) {
                const double shared = distance(surface.positions.data() + 3 * std::size_t{edges[i].low},
                                               surface.positions.data() + 3 * std::size_t{edges[i].high});
                join(edges[i].triangle, edges[i + 1].triangle, shared);
                join(edges[i + 1].triangle, edges[i].triangle, shared);
            }
            i = end;
        }
        for (std::uint32_t t = 0; t < count; ++t) {
            for (const auto &[other, shared] : clusters_[t].neighbours) {
                if (t < other) {
                    offer(t, other, shared);
                }
            }
        }
    }

    Tree run() {
        while (!queue_.empty()) {
            const Candidate best = queue_.top();
            queue_.pop();
            if (clusters_[best.a].alive && clusters_[best.b].alive) {
                merge(best);
            }
        }
        for (std::uint32_t node = 0; node < clusters_.size(); ++node) {
            if (clusters_[node].alive) {
                tree_.roots.push_back(node);
            }
        }
        return std::move(tree_);
    }

  private:
    static double length(const std::array<double, 3> &v) {
        return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }

    // Two triangles may share two edges.
    void join(std::uint32_t a, std::uint32_t b, double shared) {
        auto &list = clusters_[a].neighbours;
        const auto at = std::ranges::lower_bound(list, b, {}, &std::pair<std::uint32_t, double>::first);
        if (at != list.end() && at->first == b) {
            at->second += shared;
        } else {
            list.insert(at, {b, shared});
        }
    }

    void offer(std::uint32_t a, std::uint32_t b, double shared) {
        const Cluster &x = clusters_[a], &y = clusters_[b];
        const double area = x.area + y.area;
        double bent = 0;
        if (area > 0) {
            bent = 1 -
                   length({x.normal[0] + y.normal[0], x.normal[1] + y.normal[1], x.normal[2] + y.normal[2]}) /
                       area;
        }
        if (bent > deviation_) {
            return;
        }
        const double border = std::max(0.0, x.border + y.border - 2 * shared);
        const double round = area > 0 ? border * border / (4 * 3.141592653589793 * area) : 0;
        // A border's ratio has no bound; beyond a strip of 1 : 50 one is as bad as the other.
        queue_.push({bent + roundness_weight * std::min(round, 20.0), a, b, shared});
    }

    void merge(const Candidate &pair) {
        const auto node = static_cast<std::uint32_t>(clusters_.size());
        tree_.parts.push_back({pair.a, pair.b});
        Cluster made;
        {
            Cluster &a = clusters_[pair.a], &b = clusters_[pair.b];
            a.alive = b.alive = false;
            for (std::size_t k = 0; k < 3; ++k) {
                made.normal[k] = a.normal[k] + b.normal[k];
            }
            made.area = a.area + b.area;
            made.border = std::max(0.0, a.border + b.border - 2 * pair.shared);
            auto i = a.neighbours.begin(), j = b.neighbours.begin();
            while (i != a.neighbours.end() || j != b.neighbours.end()) {
                std::pair<std::uint32_t, double> next;
                if (j == b.neighbours.end() || (i != a.neighbours.end() && i->first < j->first)) {
                    next = *i++;
                } else if (i == a.neighbours.end() || j->first < i->first) {
                    next = *j++;
                } else {
                    next = {i->first, i->second + j->second};
                    ++i;
                    ++j;
                }
                if (next.first != pair.a && next.first != pair.b) {
                    made.neighbours.push_back(next);
                }
            }
            a.neighbours = b.neighbours = {};
        }
        for (const auto &[other, shared] : made.neighbours) {
            auto &list = clusters_[other].neighbours;
            std::erase_if(list,
                          [&](const auto &entry) { return entry.first == pair.a || entry.first == pair.b; });
            list.emplace_back(node, shared); // the largest node so far: the list stays sorted
        }
        clusters_.push_back(std::move(made));
        for (const auto &[other, shared] : clusters_[node].neighbours) {
            offer(other, node, shared);
        }
    }

    double deviation_;
    Tree tree_;
    std::vector<Cluster> clusters_;
    std::priority_queue<Candidate> queue_;
};

} // namespace

std::vector<std::uint32_t> Tree::leaves(std::uint32_t node) const {
    std::vector<std::uint32_t> found, open{node};
    while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        if (at < triangles) {
            found.push_back(at);
        } else {
            open.push_back(parts[at - triangles][1]);
            open.push_back(parts[at - triangles][0]);
        }
    }
    return found;
}

Tree merge_triangles(const Surface &surface, double deviation) {
    return Merger(surface, deviation).run();
}

} // namespace paradize::atlas
