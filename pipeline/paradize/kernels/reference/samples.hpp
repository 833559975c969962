// Points spread over triangles, the same on every machine. For metrics only.
// Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

#include "reference/tree.hpp"

namespace paradize::reference {

inline double area_of(const Corners &c) {
    const Point n = cross(minus(c[1], c[0]), minus(c[2], c[0]));
    return 0.5 * std::sqrt(dot(n, n));
}

// Weights of the second and third corner of the k-th point of a triangle.
inline std::pair<double, double> spot(std::size_t k) {
    constexpr double g1 = 0.7548776662466927, g2 = 0.5698402909980532;
    const double n = static_cast<double>(k) + 0.5;
    double u = n * g1 - std::floor(n * g1), v = n * g2 - std::floor(n * g2);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    return {u, v};
}

inline Point at(const Corners &c, std::pair<double, double> uv) {
    return along(along(c[0], uv.first, minus(c[1], c[0])), uv.second, minus(c[2], c[0]));
}

// The first n spots; where they are many, in an order in which neighbours lie near each other.
inline void spots(std::size_t n, std::vector<std::pair<double, double>> &out) {
    out.resize(n);
    for (std::size_t k = 0; k < n; ++k)
        out[k] = spot(k);
    if (n <= Packet::size)
        return;
    const auto code = [](std::pair<double, double> p) {
        auto x = static_cast<std::uint32_t>(p.first * 65535),
             y = static_cast<std::uint32_t>(p.second * 65535);
        std::uint64_t z = 0;
        for (unsigned bit = 0; bit < 16; ++bit)
            z |= std::uint64_t{(x >> bit) & 1} << (2 * bit) | std::uint64_t{(y >> bit) & 1} << (2 * bit + 1);
        return z;
    };
    std::ranges::sort(
        out, [&](const auto &a, const auto &b) { return std::pair(code(a), a) < std::pair(code(b), b); });
}

// How the samples of a surface are shared out: their places in one row, by triangle.
struct Shares {
    std::vector<std::size_t> first; // (m + 1,)
    std::vector<double> weight;     // (m,) area that one sample of a triangle stands for
    double area = 0;

    // least: samples of every triangle at least; samples: about how many in proportion to area.
    Shares(const Surface &surface, std::uint64_t samples, std::size_t least)
        : first(surface.triangles.size() / 3 + 1), weight(surface.triangles.size() / 3) {
        for (std::size_t i = 0; i < weight.size(); ++i)
            area += weight[i] = area_of(corners_of(surface, i));
        for (std::size_t i = 0; i < weight.size(); ++i) {
            const double share = area > 0 ? weight[i] / area * static_cast<double>(samples) : 0;
            const std::size_t n = std::max(least, static_cast<std::size_t>(std::ceil(share)));
            first[i + 1] = first[i] + n;
            weight[i] /= static_cast<double>(n);
        }
    }
    std::size_t count(std::size_t triangle) const { return first[triangle + 1] - first[triangle]; }
};

// Calls work(chunk) for every chunk in [0, chunks), on `threads` threads; throws what a chunk threw.
template <typename Work>
void for_chunks(std::size_t chunks, unsigned threads, Work work) {
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::mutex guard;
    const auto run = [&] {
        try {
            for (std::size_t chunk = next++; chunk < chunks; chunk = next++)
                work(chunk);
        } catch (...) {
            const std::scoped_lock lock(guard);
            failure = std::current_exception();
            next = chunks;
        }
    };
    {
        std::vector<std::jthread> others;
        for (unsigned t = 1; t < threads && t < chunks; ++t)
            others.emplace_back(run);
        run();
    }
    if (failure)
        std::rethrow_exception(failure);
}

// The value that `share` (0..1) of the whole weight does not exceed; values 0 or more, weight of value i:
// weights(i). Two passes instead of a sort of everything; sums run in the order of i.
template <typename Weights>
double quantile(const std::vector<double> &values, double share, Weights weights) {
    const auto bin = [](double v) { return std::bit_cast<std::uint64_t>(v) >> 48; };
    std::vector<double> held(1 << 16, 0.0);
    double whole = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
        held[bin(values[i])] += weights(i);
    for (const double h : held)
        whole += h;
    double below = 0;
    std::size_t chosen = 0;
    for (std::size_t b = 0; b < held.size(); ++b) {
        if (held[b] > 0)
            chosen = b;
        if (below + held[b] >= share * whole && held[b] > 0)
            break;
        below += held[b];
    }
    std::vector<std::pair<double, double>> inside;
    for (std::size_t i = 0; i < values.size(); ++i)
        if (bin(values[i]) == chosen)
            inside.emplace_back(values[i], weights(i));
    std::ranges::sort(inside);
    double found = 0;
    for (const auto &[value, weight] : inside) {
        found = value;
        below += weight;
        if (below >= share * whole)
            break;
    }
    return found;
}

} // namespace paradize::reference
