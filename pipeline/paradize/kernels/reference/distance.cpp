#include "reference/distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/samples.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t least_distance_samples = 10;
// Triangles handled together; fixed, so that results do not depend on threads.
constexpr std::size_t distance_chunk = 256;

// Points gathered until a packet is full, then measured.
class Row {
  public:
    Row(const Tree &to, double *out, std::uint32_t *near) : to_(to), out_(out), near_(near) {}

    // The squared distance of p goes to out[place], or into `largest` alone where `place` is `unplaced`; the
    // triangle nearest to it to near[owner], where it has one.
    void add(const Point &p, std::size_t place, std::size_t owner = unplaced) {
        packet_.x[count_] = p[0];
        packet_.y[count_] = p[1];
        packet_.z[count_] = p[2];
        places_[count_] = place;
        owners_[count_] = owner;
        if (++count_ == Packet::size)
            flush();
    }
    void flush() {
        if (count_ == 0)
            return;
        for (std::size_t i = count_; i < Packet::size; ++i) {
            packet_.x[i] = packet_.x[0];
            packet_.y[i] = packet_.y[0];
            packet_.z[i] = packet_.z[0];
        }
        packet_.best.fill(std::numeric_limits<double>::max());
        packet_.slot.fill(-1);
        to_.nearest(packet_, hint_, nullptr);
        hint_ = packet_.slot[0];
        for (std::size_t i = 0; i < count_; ++i) {
            largest = std::max(largest, packet_.best[i]);
            if (places_[i] != unplaced)
                out_[places_[i]] = packet_.best[i];
            if (owners_[i] != unplaced)
                near_[owners_[i]] = static_cast<std::uint32_t>(packet_.slot[i]);
        }
        count_ = 0;
    }

    static constexpr std::size_t unplaced = ~std::size_t{0};
    double largest = 0;

  private:
    const Tree &to_;
    double *out_;
    std::uint32_t *near_;
    Packet packet_;
    std::array<std::size_t, Packet::size> places_, owners_;
    std::size_t count_ = 0;
    double hint_ = -1;
};

} // namespace

Distance one_sided(const Tree &from, const Tree &to, std::uint64_t samples, unsigned threads) {
    const Surface &surface = from.surface();
    const std::size_t count = surface.triangles.size() / 3;
    const Shares shares(surface, samples, least_distance_samples);
    // The triangle that looks at a vertex.
    std::vector<std::uint32_t> looked_at(surface.positions.size() / 3, Packet::none);
    for (std::size_t i = surface.triangles.size(); i-- > 0;)
        looked_at[surface.triangles[i]] = static_cast<std::uint32_t>(i / 3);
    std::vector<double> squares(shares.first.back());
    const std::size_t chunks = (count + distance_chunk - 1) / distance_chunk;
    std::vector<double> largest(chunks, 0);
    Distance out;
    out.near.resize(count);
    for_chunks(chunks, threads, [&](std::size_t chunk) {
        Row row(to, squares.data(), out.near.data());
        std::vector<std::pair<double, double>> uvs;
        for (std::size_t at_slot = chunk * distance_chunk;
             at_slot < std::min(count, (chunk + 1) * distance_chunk); ++at_slot) {
            const std::size_t i = from.order()[at_slot];
            const Corners c = corners_of(surface, i);
            spots(shares.count(i), uvs);
            for (std::size_t k = 0; k < uvs.size(); ++k)
                row.add(at(c, uvs[k]), shares.first[i] + k, k == 0 ? i : Row::unplaced);
            if (uvs.size() > Packet::size)
                row.flush();
            for (std::size_t k = 0; k < 3; ++k) {
                row.add(along(c[k], 0.5, minus(c[(k + 1) % 3], c[k])), Row::unplaced);
                if (looked_at[surface.triangles[i * 3 + k]] == i)
                    row.add(c[k], Row::unplaced);
            }
            row.flush();
        }
        largest[chunk] = row.largest;
    });

    for (const double d : largest)
        out.max = std::max(out.max, d);
    out.max = std::sqrt(out.max);
    double sum = 0, area = 0;
    std::vector<std::uint32_t> owner(squares.size());
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = shares.first[i]; k < shares.first[i + 1]; ++k) {
            sum += squares[k] * shares.weight[i];
            area += shares.weight[i];
            owner[k] = static_cast<std::uint32_t>(i);
        }
    out.rms = area > 0 ? std::sqrt(sum / area) : out.max;
    out.p99 = std::sqrt(quantile(squares, 0.99, [&](std::size_t k) { return shares.weight[owner[k]]; }));
    return out;
}

Distance one_sided(const Surface &from, const Surface &to, std::uint64_t samples, unsigned threads) {
    return one_sided(Tree(from), Tree(to), samples, threads);
}

} // namespace paradize::reference
