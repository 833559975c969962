#include "occlusion/cast.hpp"

#include "math/vec.hpp"
#include "parallel.hpp"

namespace paradize::occlusion {
namespace {

using Cast = Share (*)(const Tree &, const Point &, const float *, const float *, const float *, std::size_t,
                       float);

Cast cast_of(int width) {
#ifdef PARADIZE_WIDE
    if (width == 3 || (width == 0 && has_avx512())) {
        return has_avx512() ? avx512::cast : nullptr;
    }
    if (width == 2 || (width == 0 && has_avx2())) {
        return has_avx2() ? avx2::cast : nullptr;
    }
#endif
    return width <= 1 ? baseline::cast : nullptr;
}

void put(float *to, mesh::Vec v) {
    to[0] = static_cast<float>(v.x);
    to[1] = static_cast<float>(v.y);
    to[2] = static_cast<float>(v.z);
}

constexpr std::size_t batch = 256; // points of a job

} // namespace

bool has_width(int width) {
    return cast_of(width) != nullptr;
}

void cast_all(const Tree &tree, std::span<const float> points, std::span<const float> normals,
              std::span<const float> faces, std::span<const std::uint32_t> texels, std::size_t columns,
              const Directions &directions, float reach, std::span<float> out, int threads, int width) {
    const Cast cast = cast_of(width);
    const std::size_t jobs = (out.size() + batch - 1) / batch;
    for_each_job(jobs, threads, [&](std::size_t job) {
        const std::size_t last = std::min(out.size(), (job + 1) * batch);
        for (std::size_t i = job * batch; i < last; ++i) {
            const mesh::Vec n = mesh::at3(normals, i);
            const mesh::Vec t = mesh::any_perpendicular(n);
            Point point;
            for (std::size_t k = 0; k < 3; ++k) {
                point.origin[k] = points[3 * i + k];
                point.face[k] = faces[3 * i + k];
            }
            put(point.frame[0], t);
            put(point.frame[1], cross(n, t));
            put(point.frame[2], n);
            const std::size_t from = set_of(texels[i] / columns, texels[i] % columns) * directions.rays;
            const Share share = cast(tree, point, directions.x.data() + from, directions.y.data() + from,
                                     directions.z.data() + from, directions.rays, reach);
            out[i] = share.all == 0 ? 1.0F : static_cast<float>(share.open) / static_cast<float>(share.all);
        }
    });
}

} // namespace paradize::occlusion
