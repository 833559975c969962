// The corners around each vertex, and the frames they share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/tangents/faces.hpp"

namespace paradize::mesh {

// A corner is three times its face and its place there. Those of vertex v, in ascending order, are
// corner[start[v]] .. corner[start[v + 1] - 1].
struct Fans {
    Fans(const Surface &surface, const Welded &welded, Buffer<Face> &faces);

    const Surface &surface;
    const Welded &welded;
    Buffer<Face> &faces;
    Buffer<std::uint32_t> start, corner;
};

struct CornerFrame {
    std::uint32_t corner;
    Frame frame;
};

// One frame a vertex where all its corners share it; w = 0 where they do not: then each of its corners is in
// `odd`.
struct FanFrames {
    std::vector<CornerFrame> odd;
    std::vector<std::uint32_t> undecided; // vertices with a face that follows its neighbours
};

// Frames of vertices [first, last); those left undecided depend on the order of faces all over the mesh.
void gather_frames(const Fans &fans, std::size_t first, std::size_t last, Frame *frames, FanFrames &found);

// Frames of the vertices left undecided, in the order that the reference takes.
void decide_frames(const Fans &fans, const std::vector<std::uint32_t> &vertices, Frame *frames,
                   std::vector<CornerFrame> &odd);

} // namespace paradize::mesh
