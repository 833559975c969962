#include "terrain/delaunay.hpp"

#include <utility>

#include "terrain/tiles.hpp"

namespace paradize::terrain {

Triangulation listed(HalfEdgeMesh &&net, std::uint32_t width) {
    Triangulation found;
    std::vector<std::uint32_t> place(net.vertices.size(), none);
    net.twins = {};
    std::size_t kept = 0;
    for (std::size_t e = 0; e < net.corners.size(); e += 3) {
        if (net.corners[e] == none) {
            continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t &index = place[net.corners[e + k]];
            if (index == none) {
                index = static_cast<std::uint32_t>(found.pixels.size());
                const Pixel spot = net.vertices[net.corners[e + k]];
                found.pixels.push_back(spot.y * width + spot.x);
            }
            net.corners[kept++] = index;
        }
    }
    net.corners.resize(kept);
    found.triangles = std::move(net.corners);
    return found;
}

Triangulation refine(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance, int threads) {
    const View view{heights.data(), width, heights.data() + heights.size()};
    Tiles tiles(view, {static_cast<std::uint16_t>(width - 1), static_cast<std::uint16_t>(height - 1)},
                tolerance);
    std::vector<std::uint32_t> seams;
    Mesher mesher(view, tolerance);
    HalfEdgeMesh whole = tiles.sew(threads, seams);
    mesher.adopt(std::move(whole), tiles.tracked());
    mesher.mend(seams);
    for (const std::uint32_t vertex : tiles.removal_order()) {
        mesher.remove(vertex);
    }
    return listed(mesher.release(), width);
}

} // namespace paradize::terrain
