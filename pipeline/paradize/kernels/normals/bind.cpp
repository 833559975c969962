// Python face of the normal kernels. Shapes are checked in kernels/normals; here sizes are checked once
// more against each other, so that no call can leave its arrays. Outputs are arrays that the caller made.

#include <cmath>

#include "bind.hpp"
#include "normals/field.hpp"
#include "normals/material.hpp"

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

normals::Encoding encoding_of(int code) {
    need(code >= 0 && code <= 2, "no such encoding");
    return static_cast<normals::Encoding>(code);
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
                          std::size_t last, int encoding, const Out<std::uint8_t> &result, int threads,
                          int width) {
    need(heights.ndim() == 2 && heights.size() > 0, "heights are not two-dimensional");
    need(islands.size() == 0 || islands.size() == heights.size(), "islands and heights differ in size");
    need(first <= last && last <= heights.shape(0), "no such rows");
    const auto settings = settings_of(derivative, smooth, scale_x, scale_y, wrap_x, wrap_y, green_down);
    const auto code = encoding_of(encoding);
    const auto to = out(result, (last - first) * heights.shape(1) * normals::texel_bytes(code));
    nb::gil_scoped_release unlocked;
    try {
        normals::normals_from_heights(flat(heights), heights.shape(0), heights.shape(1), flat(islands),
                                      settings, first, last, code, to, threads, width_of(width));
    } catch (const normals::NotFinite &) {
        return false;
    }
    return true;
}

bool normals_from_slopes(const In<float> &dx, const In<float> &dy, double scale_x, double scale_y,
                         bool green_down, int encoding, const Out<std::uint8_t> &result, int threads,
                         int width) {
    need(dx.ndim() == 2 && dx.size() > 0 && dx.size() == dy.size(), "slopes are not of one size");
    need(std::isfinite(scale_x) && std::isfinite(scale_y), "a scale is not finite");
    const auto code = encoding_of(encoding);
    const auto to = out(result, dx.size() * normals::texel_bytes(code));
    nb::gil_scoped_release unlocked;
    try {
        normals::normals_from_slopes(flat(dx), flat(dy), dx.shape(0), dx.shape(1), scale_x, scale_y,
                                     green_down, code, to, threads, width_of(width));
    } catch (const normals::NotFinite &) {
        return false;
    }
    return true;
}

maps::Levels levels_of(const In<double> &v) {
    need(v.size() == 6, "levels have six numbers");
    const double *at = v.data();
    need(at[0] != at[1] && at[2] > 0.0, "black equals white, or gamma is not positive");
    return {at[0], at[1], at[2], at[3], at[4], at[5] != 0.0};
}

bool material_maps(const nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu> &color,
                   const In<double> &derivative, const In<double> &smooth, double scale_x, double scale_y,
                   bool wrap_x, bool wrap_y, bool green_down, const In<double> &height_levels,
                   const In<double> &gloss_levels, const In<float> &gloss, bool encoded,
                   const Out<std::uint16_t> &height, const Out<std::uint8_t> &normal,
                   const Out<std::uint8_t> &shine, const Out<std::int8_t> &dudv, int threads, int width) {
    need(color.ndim() == 3 && color.size() > 0, "the colour is not (rows, columns, channels)");
    const auto shape = [&](std::size_t axis) { return color.shape(axis); };
    need(shape(2) == 3 || shape(2) == 4, "the colour has neither 3 nor 4 channels");
    const bool bytes = color.dtype() == nb::dtype<std::uint8_t>();
    const bool words = color.dtype() == nb::dtype<std::uint16_t>();
    need(bytes || words || color.dtype() == nb::dtype<float>(), "the colour is of another type");
    const std::size_t texels = shape(0) * shape(1);
    need(height.size() == texels && normal.size() == 3 * texels && shine.size() == 2 * texels &&
             dudv.size() == 2 * texels,
         "an output array has the wrong size");
    need(gloss.size() == 4, "gloss has four numbers");
    const normals::ColorView view{bytes ? static_cast<const std::uint8_t *>(color.data()) : nullptr,
                                  words ? static_cast<const std::uint16_t *>(color.data()) : nullptr,
                                  bytes || words ? nullptr : static_cast<const float *>(color.data()),
                                  shape(0),
                                  shape(1),
                                  shape(2)};
    const float *g = gloss.data();
    const normals::MaterialSettings settings{
        settings_of(derivative, smooth, scale_x, scale_y, wrap_x, wrap_y, green_down),
        levels_of(height_levels),
        levels_of(gloss_levels),
        g[0],
        g[1],
        g[2],
        g[3],
        encoded};
    const normals::MaterialOut to{{height.data(), texels},
                                  {normal.data(), 3 * texels},
                                  {shine.data(), 2 * texels},
                                  {dudv.data(), 2 * texels}};
    nb::gil_scoped_release unlocked;
    try {
        normals::material_maps(view, settings, to, threads, width_of(width));
    } catch (const normals::NotFinite &) {
        return false;
    }
    return true;
}

} // namespace

NB_MODULE(_normals, m) {
    m.doc() = "Normal kernels: heights, slopes and colours to normals and their kin.";
    m.def("has_width", &has_width);
    m.def("normals_from_heights", &normals_from_heights);
    m.def("normals_from_slopes", &normals_from_slopes);
    m.def("material_maps", &material_maps);
}
