// Python face of the normal kernels. Shapes are checked in kernels/normals; here sizes are checked once
// more against each other, so that no call can leave its arrays. Outputs are arrays that the caller made.

#include <cmath>

#include "bind.hpp"
#include "normals/field.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

normals::Settings settings_of(const In<double> &derivative, const In<double> &smooth, double scale_x,
                              double scale_y, bool wrap_x, bool wrap_y, bool green_down) {
    need(derivative.size() >= 1 && derivative.size() <= normals::largest_reach, "no such derivative filter");
    need(smooth.size() >= 1 && smooth.size() <= normals::largest_reach + 1, "no such smoothing");
    need(std::isfinite(scale_x) && std::isfinite(scale_y), "a scale is not finite");
    return {derivative.data(),
            static_cast<int>(derivative.size()),
            smooth.data(),
            static_cast<int>(smooth.size()) - 1,
            scale_x,
            scale_y,
            wrap_x,
            wrap_y,
            green_down};
}

normals::Width width_of(int code) {
    need(code >= 0 && code <= 3, "no such instruction set");
    return static_cast<normals::Width>(code);
}

bool has_width(int width) {
    return normals::kernels_of(width_of(width)) != nullptr;
}

// Each returns whether all that was read is finite.
bool normals_from_heights(const In<float> &heights, const In<std::int32_t> &islands,
                          const In<double> &derivative, const In<double> &smooth, double scale_x,
                          double scale_y, bool wrap_x, bool wrap_y, bool green_down, std::size_t first,
                          std::size_t last, const Out<float> &result, int threads, int width) {
    need(heights.ndim() == 2 && heights.size() > 0, "heights are not two-dimensional");
    need(islands.size() == 0 || islands.size() == heights.size(), "islands and heights differ in size");
    need(first <= last && last <= heights.shape(0), "no such rows");
    const auto settings = settings_of(derivative, smooth, scale_x, scale_y, wrap_x, wrap_y, green_down);
    const auto to = out(result, (last - first) * heights.shape(1) * 3);
    nb::gil_scoped_release unlocked;
    try {
        normals::normals_from_heights(flat(heights), heights.shape(0), heights.shape(1), flat(islands),
                                      settings, first, last, to, threads, width_of(width));
    } catch (const normals::NotFinite &) {
        return false;
    }
    return true;
}

bool normals_from_slopes(const In<float> &dx, const In<float> &dy, double scale_x, double scale_y,
                         bool green_down, const Out<float> &result, int threads, int width) {
    need(dx.ndim() == 2 && dx.size() > 0 && dx.size() == dy.size(), "slopes are not of one size");
    need(std::isfinite(scale_x) && std::isfinite(scale_y), "a scale is not finite");
    const auto to = out(result, dx.size() * 3);
    nb::gil_scoped_release unlocked;
    try {
        normals::normals_from_slopes(flat(dx), flat(dy), dx.shape(0), dx.shape(1), scale_x, scale_y,
                                     green_down, to, threads, width_of(width));
    } catch (const normals::NotFinite &) {
        return false;
    }
    return true;
}

} // namespace

NB_MODULE(_normals, m) {
    m.doc() = "Normal kernels: heights and slopes to normals.";
    m.def("has_width", &has_width);
    m.def("normals_from_heights", &normals_from_heights);
    m.def("normals_from_slopes", &normals_from_slopes);
}
