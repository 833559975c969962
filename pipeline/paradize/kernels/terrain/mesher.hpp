// A Delaunay triangulation of pixels that grows where a pixel lies off its plane, and gives back what it does
// not need. Half-edges in arrays, predicates in whole numbers, no floating-point decision but the error's.
// Insertion: Garland and Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields", 1995.
// Flips: Lawson, "Software for C1 Surface Interpolation", 1977. Removal by ears: Devillers, "On Deletion in
// Delaunay Triangulations", 1999.
#pragma once

#include <cstdint>
#include <vector>

#include "terrain/queue.hpp"
#include "terrain/scan.hpp"

namespace paradize::terrain {

// Positive when d lies inside the circle through a, b, c (which turn positively). Coordinates differ by at
// most 2^14, so each product is below 2^58.
inline std::int64_t in_circle(Pixel a, Pixel b, Pixel c, Pixel d) {
    const std::int64_t ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y, cx = c.x - d.x,
                       cy = c.y - d.y;
    return (ax * ax + ay * ay) * (bx * cy - by * cx) - (bx * bx + by * by) * (ax * cy - ay * cx) +
           (cx * cx + cy * cy) * (ax * by - ay * bx);
}

// Three half-edges a triangle: corners[3t + k] is the vertex that edge 3t + k leaves; twins[e] runs back, or
// is `none` on the rim. A dead triangle has `none` as its first corner.
struct HalfEdgeMesh {
    std::vector<Pixel> vertices;
    std::vector<std::uint32_t> corners, twins;
};

class Mesher {
  public:
    // tolerance: >= 0, the unit of the heights.
    Mesher(View view, double tolerance) : view_(view), tolerance_(tolerance) {}

    // A strictly convex polygon of positive turn, Delaunay; its corners are the first vertices, in order.
    void start(const std::vector<Pixel> &corners);
    // Takes a triangulation over; the first `tracked` vertices may later be removed.
    void adopt(HalfEdgeMesh &&net, std::uint32_t tracked);
    HalfEdgeMesh release();

    // A vertex on the side of the rim that leaves `before`, a corner or one that this returned; flipped in,
    // not scanned. Returns its index.
    std::uint32_t insert_on_rim(std::uint32_t before, Pixel spot);
    // From here on pixels on the rim are neither judged nor inserted.
    void fix_rim() { rim_is_fixed_ = true; }
    // Inserts pixels, the worst first, until all keep the tolerance or there are `most` vertices. From the
    // start of a net: all of it.
    void refine_all(std::size_t most = none);
    // Makes the edges Delaunay, beginning with `edges`, then refines what changed.
    void mend(const std::vector<std::uint32_t> &edges);
    // Removes a tracked vertex where the pixels keep the tolerance without it; says whether it did.
    bool remove(std::uint32_t vertex);

    const HalfEdgeMesh &net() const { return net_; }

  private:
    struct HoleCorner { // a corner of the hole that a vertex leaves, and the half-edge outside the side to
                        // the next
        std::uint32_t vertex, outside;
    };

    View view_;
    double tolerance_;
    bool rim_is_fixed_ = false;
    HalfEdgeMesh net_;
    std::vector<std::uint32_t> candidates_; // per triangle: its worst pixel, or none
    WorstFirst queue_;                      // of the triangles that have one
    std::vector<std::uint32_t> suspects_;   // half-edges that may have to flip
    std::vector<std::uint32_t> spokes_;     // per tracked vertex: a half-edge that leaves it
    std::vector<std::uint32_t> changed_;    // triangles that `mend` flipped
    std::vector<std::uint32_t> freed_, made_;
    std::vector<HoleCorner> hole_;

    static std::uint32_t next(std::uint32_t edge) { return edge % 3 == 2 ? edge - 2 : edge + 1; }
    static std::uint32_t previous(std::uint32_t edge) { return edge % 3 == 0 ? edge + 2 : edge - 1; }
    Pixel at(std::uint32_t vertex) const { return net_.vertices[vertex]; }

    std::uint32_t add_vertex(Pixel spot);
    std::uint32_t add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
    void set_triangle(std::uint32_t triangle, std::uint32_t a, std::uint32_t b, std::uint32_t c);
    void link(std::uint32_t edge, std::uint32_t twin);
    bool must_flip(std::uint32_t edge) const;
    void flip(std::uint32_t edge);
    void insert(std::uint32_t triangle, Pixel spot);
    void split_triangle(std::uint32_t triangle, std::uint32_t p);
    void split_edge(std::uint32_t edge, std::uint32_t p);
    void settle();
    void scan(std::uint32_t triangle);
    void scan_around(std::uint32_t triangle);
    void make_delaunay();
    void drain(std::size_t most);
    bool gather_hole(std::uint32_t vertex);
    bool fill_hole();
};

} // namespace paradize::terrain
