#include "obj/origin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace paradize::obj {
namespace {

constexpr double near_diagonals = 8;
constexpr double near_edges = 0x1p14; // float32 has 24 bits: ten are left of an edge that lies so many away
constexpr double worth = 16;
constexpr double largest_extent = 1e38; // offsets inside it are floats
constexpr std::size_t most_samples = 1024;

using Places = std::span<const double>;

Origin at(Places positions, std::uint32_t place) {
    return {positions[place * std::size_t{3}], positions[place * std::size_t{3} + 1],
            positions[place * std::size_t{3} + 2]};
}

double largest(const Origin &a, const Origin &b) {
    return std::max({std::fabs(a[0] - b[0]), std::fabs(a[1] - b[1]), std::fabs(a[2] - b[2])});
}

// The middle one; 0 of none.
double median(std::vector<double> values) {
    if (values.empty())
        return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

struct Box {
    Origin low, high;

    explicit Box(const Origin &first) : low(first), high(first) {}
    void add(const Origin &p) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
    }
    double diagonal() const {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
            sum += (high[k] - low[k]) * (high[k] - low[k]);
        return std::sqrt(sum);
    }
    double reach() const { return std::max(largest(low, {}), largest(high, {})); }
};

// Evenly spread corners, each with the one that follows it.
class Sample {
  public:
    Sample(Places positions, std::span<const Corner> corners) {
        const std::size_t count = std::min(corners.size(), most_samples);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t here = i * corners.size() / count;
            edges_.push_back({at(positions, corners[here].position),
                              at(positions, corners[std::min(here + 1, corners.size() - 1)].position)});
        }
    }

    Box box() const {
        Box out(edges_.front()[0]);
        for (const auto &edge : edges_)
            out.add(edge[0]);
        return out;
    }
    Origin middle() const {
        Origin out{};
        for (std::size_t k = 0; k < 3; ++k)
            out[k] = median_of([&](const Edge &edge) { return edge[0][k]; });
        return out;
    }
    // The median of the largest distances along an axis.
    double spread(const Origin &from) const {
        return median_of([&](const Edge &edge) { return largest(edge[0], from); });
    }
    // How many of their lengths edges lie away from a place: the median.
    double edges_away(const Origin &from) const {
        std::vector<double> values;
        for (const auto &edge : edges_)
            if (const double length = largest(edge[0], edge[1]); length > 0)
                values.push_back(largest(edge[0], from) / length);
        return median(std::move(values));
    }

  private:
    using Edge = std::array<Origin, 2>;
    template <typename Value>
    double median_of(Value value) const {
        std::vector<double> values;
        for (const Edge &edge : edges_)
            values.push_back(value(edge));
        return median(std::move(values));
    }
    std::vector<Edge> edges_;
};

double reach_of(Places values) {
    double most = 0;
    for (const double value : values)
        most = std::max(most, std::fabs(value));
    return most;
}

} // namespace

Origin origin_of(Places positions, std::span<const Corner> corners) {
    if (corners.empty())
        return {};
    const Sample sample(positions, corners);
    const double away = sample.edges_away({});
    // Most files end here: no used position can lie far.
    if (away <= near_edges && reach_of(positions) <= near_diagonals * sample.box().diagonal())
        return {};
    Box used(at(positions, corners[0].position));
    for (const Corner &corner : corners)
        used.add(at(positions, corner.position));
    const double diagonal = used.diagonal();
    Origin out = sample.middle();
    const double spread = sample.spread(out), unit = spread > 0 ? spread : diagonal;
    if (!(unit > 0 && diagonal <= largest_extent))
        return {};
    for (double &value : out)
        value =
            std::nearbyint(std::ldexp(value, -std::ilogb(unit))) * std::ldexp(1.0, std::ilogb(unit)) + 0.0;
    const bool apart = away > near_edges && sample.edges_away(out) * worth < away;
    return apart || used.reach() > near_diagonals * diagonal ? out : Origin{};
}

} // namespace paradize::obj
