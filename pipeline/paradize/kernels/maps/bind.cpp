// Python face of the map kernels. Shapes are checked in kernels/maps; here sizes are checked once more
// against each other, so that no call can leave its arrays. Outputs are arrays that the caller made.
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "bind.hpp"
#include "maps/codes.hpp"
#include "maps/color.hpp"
#include "maps/gutter.hpp"
#include "maps/mips.hpp"
#include "maps/panorama.hpp"
#include "math/functions.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

template <typename T>
void linear_light(const In<T> &pixels, std::size_t channels, bool encoded, const Out<float> &result,
                  int threads) {
    need(channels >= 1 && channels <= 4 && pixels.size() % channels == 0,
         "channels do not divide the pixels");
    const auto to = out(result, pixels.size());
    nb::gil_scoped_release unlocked;
    maps::linear_light<T>(flat(pixels), channels, encoded, to, threads);
}

void halved_light(const In<std::uint8_t> &pixels, const Out<float> &result, int threads) {
    need(pixels.ndim() == 3 && pixels.shape(2) >= 1 && pixels.shape(2) <= 4,
         "the image is not (rows, columns, 1 to 4 channels)");
    const std::size_t rows = pixels.shape(0);
    const std::size_t columns = pixels.shape(1);
    need(rows % 2 == 0 && columns % 2 == 0, "the size is odd");
    const auto to = out(result, pixels.size() / 4);
    nb::gil_scoped_release unlocked;
    maps::halved_light(flat(pixels), rows, columns, pixels.shape(2), to, threads);
}

template <typename T>
void rgba_codes(const In<T> &pixels, std::size_t channels, bool encoded, const Out<std::uint8_t> &result,
                int threads) {
    need(channels >= 1 && channels <= 4 && pixels.size() % channels == 0,
         "channels do not divide the pixels");
    const auto to = out(result, pixels.size() / channels * 4);
    nb::gil_scoped_release unlocked;
    maps::rgba_codes<T>(flat(pixels), channels, encoded, to, threads);
}

void luminance(const In<float> &pixels, std::size_t channels, const Out<float> &result, int threads) {
    need(channels >= 1 && channels <= 4 && pixels.size() % channels == 0,
         "channels do not divide the pixels");
    const auto to = out(result, pixels.size() / channels);
    nb::gil_scoped_release unlocked;
    maps::luminance(flat(pixels), channels, to, threads);
}

void apply_levels(const In<float> &values, double black, double white, double gamma, double contrast,
                  double brightness, bool invert, const Out<float> &result, int threads) {
    need(black != white && gamma > 0.0, "black equals white, or gamma is not positive");
    const auto to = out(result, values.size());
    nb::gil_scoped_release unlocked;
    maps::apply_levels(flat(values), {black, white, gamma, contrast, brightness, invert}, to, threads);
}

void cut_face(const In<float> &light, const std::array<double, 9> &axes, std::size_t spots,
              const Out<float> &result, int threads) {
    need(light.ndim() == 3 && light.shape(0) >= 1 && light.shape(1) == 2 * light.shape(0) &&
             light.shape(2) == 3,
         "the panorama is not (rows, 2 * rows, 3)");
    need(result.ndim() == 3 && result.shape(0) >= 1 && spots >= 1, "no texels, or no places in them");
    need(std::ranges::all_of(axes, [](double v) { return std::isfinite(v); }), "an axis is not finite");
    const std::size_t size = result.shape(0);
    const maps::CubeFace face{
        {axes[0], axes[1], axes[2]}, {axes[3], axes[4], axes[5]}, {axes[6], axes[7], axes[8]}, size};
    const auto to = out(result, size * size * 3);
    nb::gil_scoped_release unlocked;
    maps::cut_face({flat(light), light.shape(0), light.shape(1)}, face, spots, to, threads);
}

void halve(const In<float> &image, std::size_t rows, std::size_t first, bool with_alpha,
           const Out<float> &result, int threads) {
    need(image.ndim() == 3 && result.ndim() == 3, "the images are not (rows, columns, channels)");
    const maps::HalfRows half{rows, first, result.shape(0)};
    const std::size_t columns = image.shape(1);
    const std::size_t channels = image.shape(2);
    need(rows >= 1 && columns >= 1 && first <= maps::half_size(rows) &&
             half.count <= maps::half_size(rows) - first && image.shape(0) == maps::rows_below(half),
         "these are not the rows that the next level's are made of");
    need(!with_alpha || channels == 2 || channels == 4, "no alpha channel");
    const auto to = out(result, half.count * maps::half_size(columns) * channels);
    nb::gil_scoped_release unlocked;
    (with_alpha ? maps::halve_with_alpha : maps::halve)(flat(image), half, columns, channels, to, threads);
}

void normalise(const In<float> &vectors, const Out<float> &result, int threads) {
    need(vectors.size() % 3 == 0, "vectors have three parts");
    const auto to = out(result, vectors.size());
    nb::gil_scoped_release unlocked;
    maps::normalise(flat(vectors), to, threads);
}

double coverage_factor(const In<float> &alpha, double fraction, double cutoff) {
    nb::gil_scoped_release unlocked;
    return maps::coverage_factor(flat(alpha), fraction, cutoff);
}

void smoothness_to_variance(const In<float> &smoothness, const Out<float> &result, int threads) {
    const auto to = out(result, smoothness.size());
    nb::gil_scoped_release unlocked;
    maps::smoothness_to_variance(flat(smoothness), to, threads);
}

void widened_smoothness(const In<float> &variance, const In<float> &averages, const Out<float> &result,
                        int threads) {
    need(averages.size() == variance.size() * 3, "averages and variances differ in size");
    const auto to = out(result, variance.size());
    nb::gil_scoped_release unlocked;
    maps::widened_smoothness(flat(variance), flat(averages), to, threads);
}

void check_indices(const In<std::uint32_t> &triangles, std::size_t points) {
    need(triangles.size() % 3 == 0, "triangles have three corners");
    for (const std::uint32_t index : flat(triangles)) {
        need(index < points, "a triangle's index is out of range");
    }
}

void uv_islands(const In<float> &uvs, const In<std::uint32_t> &triangles, const Out<std::int32_t> &result) {
    check_indices(triangles, uvs.size() / 2);
    const auto to = out(result, triangles.size() / 3);
    nb::gil_scoped_release unlocked;
    const auto ids = maps::uv_islands(flat(uvs), flat(triangles));
    std::copy(ids.begin(), ids.end(), to.begin());
}

void rasterise(const In<float> &uvs, const In<std::uint32_t> &triangles, const In<std::int32_t> &ids,
               double work_limit, bool touched, const Out<std::int32_t> &result) {
    check_indices(triangles, uvs.size() / 2);
    need(ids.size() == triangles.size() / 3, "ids and triangles differ in number");
    need(result.ndim() == 2 && result.size() > 0, "the map is not two-dimensional");
    const auto to = out(result, result.size());
    nb::gil_scoped_release unlocked;
    maps::rasterise(flat(uvs), flat(triangles), flat(ids), result.shape(0), result.shape(1), work_limit, to,
                    touched);
}

void nearest_covered(const In<std::uint8_t> &covered, bool wrap_x, bool wrap_y,
                     const Out<std::int32_t> &result, int threads) {
    need(covered.ndim() == 2, "the mask is not two-dimensional");
    need(covered.size() < (std::size_t{1} << 31), "the mask is too large");
    const auto to = out(result, covered.size());
    nb::gil_scoped_release unlocked;
    maps::nearest_covered(flat(covered), covered.shape(0), covered.shape(1), wrap_x, wrap_y, to, threads);
}

void snorm8(const In<float> &values, const Out<std::int8_t> &result, int threads) {
    const auto to = out(result, values.size());
    nb::gil_scoped_release unlocked;
    maps::snorm8(flat(values), to, threads);
}

void dudv_codes(const In<float> &vectors, double mean_x, double mean_y, const Out<std::int8_t> &codes,
                const Out<std::int8_t> &rest, int threads) {
    need(vectors.size() % 3 == 0, "vectors have three parts");
    const auto to = out(codes, vectors.size() / 3 * 2);
    const auto left = out(rest, codes.size());
    const std::array<double, 2> mean = {mean_x, mean_y};
    nb::gil_scoped_release unlocked;
    maps::dudv_codes(flat(vectors), mean, to, left, threads);
}

void balance(const Out<std::int8_t> &codes, const Out<std::int8_t> &rest) {
    need(codes.size() % 2 == 0, "codes have two channels");
    const auto to = out(codes, codes.size());
    const auto left = out(rest, codes.size());
    nb::gil_scoped_release unlocked;
    maps::balance(to, left);
}

// One elementary function over an array; `second` is the other argument of pow and atan2.
void elementary(const std::string &name, const In<double> &first, const In<double> &second,
                const Out<double> &result) {
    const auto a = flat(first);
    const auto b = flat(second);
    const auto to = out(result, a.size());
    const bool two = name == "pow" || name == "atan2";
    need(!two || b.size() == a.size(), "the two arguments differ in size");
    const auto each = [&](auto &&function) {
        for (std::size_t i = 0; i < a.size(); ++i) {
            to[i] = function(a[i], two ? b[i] : 0.0);
        }
    };
    if (name == "exp") {
        each([](double x, double) { return mathx::exp(x); });
    } else if (name == "log") {
        each([](double x, double) { return mathx::log(x); });
    } else if (name == "pow") {
        each([](double x, double y) { return mathx::pow(x, y); });
    } else if (name == "sin") {
        each([](double x, double) { return mathx::sin(x); });
    } else if (name == "cos") {
        each([](double x, double) { return mathx::cos(x); });
    } else if (name == "acos") {
        each([](double x, double) { return mathx::acos(x); });
    } else if (name == "atan2") {
        each([](double y, double x) { return mathx::atan2(y, x); });
    } else if (name == "srgb_to_linear") {
        each([](double x, double) { return mathx::srgb_to_linear(x); });
    } else if (name == "linear_to_srgb") {
        each([](double x, double) { return mathx::linear_to_srgb(x); });
    } else {
        throw std::invalid_argument("no such function: " + name);
    }
}

} // namespace

NB_MODULE(_maps, m) {
    m.doc() = "Map kernels: colour, mips, gutters, codes.";
    m.def("linear_light", &linear_light<std::uint8_t>);
    m.def("linear_light", &linear_light<std::uint16_t>);
    m.def("linear_light", &linear_light<float>);
    m.def("halved_light", &halved_light);
    m.def("rgba_codes", &rgba_codes<std::uint8_t>);
    m.def("rgba_codes", &rgba_codes<std::uint16_t>);
    m.def("rgba_codes", &rgba_codes<float>);
    m.def("luminance", &luminance);
    m.def("apply_levels", &apply_levels);
    m.def("cut_face", &cut_face);
    m.def("halve", &halve);
    m.def("normalise", &normalise);
    m.def("coverage_factor", &coverage_factor);
    m.def("smoothness_to_variance", &smoothness_to_variance);
    m.def("widened_smoothness", &widened_smoothness);
    m.def("uv_islands", &uv_islands);
    m.def("rasterise", &rasterise);
    m.def("nearest_covered", &nearest_covered);
    m.def("snorm8", &snorm8);
    m.def("dudv_codes", &dudv_codes);
    m.def("balance", &balance);
    m.def("elementary", &elementary);
}
