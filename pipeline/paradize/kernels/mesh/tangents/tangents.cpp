#include "mesh/tangents/tangents.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "mesh/tangents/faces.hpp"
#include "mesh/tangents/fans.hpp"
#include "mesh/tangents/vertex.hpp"
#include "parallel.hpp"

namespace paradize::mesh {
namespace {

constexpr std::size_t faces_at_once = 1024;
constexpr std::size_t fans_at_once = 4096;

// The frame of every welded vertex, and of every corner of those whose corners differ, ascending.
struct Frames {
    Welded welded;
    Buffer<Frame> of_vertex;
    std::vector<CornerFrame> odd;
};

Frames frames_of(const Surface &surface, int threads) {
    Frames out{weld(surface), Buffer<Frame>(0), {}};
    const std::size_t count = surface.triangles.size() / 3;
    Buffer<Face> faces(count);
    for_rows((count + faces_at_once - 1) / faces_at_once, threads, [&](std::size_t first, std::size_t last) {
        measure_faces(surface, out.welded, faces.data(), first * faces_at_once,
                      std::min(last * faces_at_once, count));
    });
    const Fans fans(surface, out.welded, faces);
    out.of_vertex = Buffer<Frame>(out.welded.count);
    const std::size_t runs = (out.welded.count + fans_at_once - 1) / fans_at_once;
    std::vector<FanFrames> found(runs);
    for_rows(runs, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t run = first; run < last; ++run)
            gather_frames(fans, run * fans_at_once, std::min((run + 1) * fans_at_once, out.welded.count),
                          out.of_vertex.data(), found[run]);
    });
    std::vector<std::uint32_t> undecided;
    for (const FanFrames &part : found) {
        out.odd.insert(out.odd.end(), part.odd.begin(), part.odd.end());
        undecided.insert(undecided.end(), part.undecided.begin(), part.undecided.end());
    }
    decide_frames(fans, undecided, out.of_vertex.data(), out.odd);
    std::ranges::sort(out.odd, {}, &CornerFrame::corner);
    return out;
}

bool equal(const Frame &a, const Frame &b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w;
}

// Vertices split by their corners' frames, numbered by first use.
class Splitter {
  public:
    explicit Splitter(const Surface &surface) : surface_(surface) {
        const std::size_t vertices = surface.positions.size() / 3;
        newest_.assign(vertices, none);
        out_.index.resize(surface.triangles.size());
        out_.source.reserve(vertices);
        out_.frames.reserve(vertices);
    }

    // The vertex that corner c's was last, or none.
    std::uint32_t newest(std::size_t c) const { return newest_[surface_.triangles[c]]; }
    void set(std::size_t c, std::uint32_t vertex) { out_.index[c] = vertex; }

    void set(std::size_t c, const Frame &frame) {
        const std::uint32_t vertex = surface_.triangles[c];
        std::uint32_t at = newest_[vertex];
        while (at != none && !equal(out_.frames[at], frame))
            at = older_[at];
        if (at == none) {
            at = static_cast<std::uint32_t>(out_.source.size());
            out_.source.push_back(vertex);
            out_.frames.push_back(frame);
            older_.push_back(newest_[vertex]);
            newest_[vertex] = at;
        }
        out_.index[c] = at;
    }

    SplitTangents take() { return std::move(out_); }

    static constexpr std::uint32_t none = 0xffffffffu;

  private:
    const Surface &surface_;
    std::vector<std::uint32_t> newest_, older_; // what a vertex was split into, as a list
    SplitTangents out_;
};

} // namespace

SplitTangents split_tangents(const Surface &surface, Method method, int threads) {
    Splitter split(surface);
    const std::size_t corners = surface.triangles.size();
    if (method == Method::vertex) {
        std::vector<Frame> frames(corners);
        vertex_tangents(surface, frames);
        for (std::size_t c = 0; c < corners; ++c)
            split.set(c, frames[c]);
        return split.take();
    }
    const Frames frames = frames_of(surface, threads);
    auto odd = frames.odd.begin();
    for (std::size_t c = 0; c < corners; ++c) {
        if (odd != frames.odd.end() && odd->corner == c)
            split.set(c, (odd++)->frame);
        else if (const std::uint32_t known = split.newest(c); known != Splitter::none)
            split.set(c, known);
        else
            split.set(c, frames.of_vertex[frames.welded.number[surface.triangles[c]]]);
    }
    return split.take();
}

} // namespace paradize::mesh
