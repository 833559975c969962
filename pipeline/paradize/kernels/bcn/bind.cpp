// Python face of the block compressors. Sizes are checked here; arrays may have any strides between texels
// and between rows, the channels of a texel lie one after another.

#include <stdexcept>

#include "bcn/encode.hpp"
#include "bind.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

using Array = nb::ndarray<nb::ro, nb::ndim<3>, nb::device::cpu>;

bcn::Texels texels_of(const Array &array, bcn::Texels::Kind kind) {
    const std::size_t bytes = array.itemsize();
    const auto size = static_cast<std::ptrdiff_t>(bytes);
    if (array.shape(0) == 0 || array.shape(1) == 0 || (array.stride(2) != 1 && array.shape(2) != 1)) {
        throw std::invalid_argument("the image is empty, or a texel's channels do not lie one after another");
    }
    return {array.data(),          kind,           array.shape(0),
            array.shape(1),        array.shape(2), array.stride(0) * size,
            array.stride(1) * size};
}

bcn::Quality quality_of(int quality) {
    if (quality < 0 || quality > 2) {
        throw std::invalid_argument("the quality is 0, 1 or 2");
    }
    return static_cast<bcn::Quality>(quality);
}

// Bytes for Python that nothing was written to yet, filled without its lock.
template <typename Encode>
nb::bytes filled(std::size_t bytes, Encode &&encode) {
    nb::bytes out = nb::steal<nb::bytes>(PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(bytes)));
    if (!out.is_valid()) {
        throw nb::python_error();
    }
    auto *data = reinterpret_cast<std::uint8_t *>(PyBytes_AS_STRING(out.ptr()));
    nb::gil_scoped_release unlocked;
    encode(std::span<std::uint8_t>(data, bytes));
    return out;
}

nb::bytes encode_color(const Array &rgba, bool with_alpha, int quality, int threads) {
    if (rgba.dtype() != nb::dtype<std::uint8_t>() || (rgba.shape(2) != 3 && rgba.shape(2) != 4)) {
        throw std::invalid_argument("colours are (h, w, 3 or 4) uint8");
    }
    const bcn::Texels texels = texels_of(rgba, bcn::Texels::Kind::unorm8);
    const bcn::Quality tier = quality_of(quality);
    const std::size_t bytes = bcn::blocks(texels.rows, texels.columns) * (with_alpha ? 16 : 8);
    return filled(bytes, [&](std::span<std::uint8_t> out) {
        (with_alpha ? bcn::encode_bc3 : bcn::encode_bc1)(texels, tier, out, threads);
    });
}

nb::bytes encode_values(const Array &values, bool is_signed, int quality, int threads) {
    using Kind = bcn::Texels::Kind;
    const nb::dlpack::dtype type = values.dtype();
    const bool floats = type == nb::dtype<float>();
    const bool codes = type == nb::dtype<std::int8_t>();
    const bool bytes8 = type == nb::dtype<std::uint8_t>();
    if ((values.shape(2) != 1 && values.shape(2) != 2) || (codes && !is_signed) ||
        (!floats && !codes && (is_signed || (!bytes8 && type != nb::dtype<std::uint16_t>())))) {
        throw std::invalid_argument(
            "values are (h, w, 1 or 2) float32, int8 where signed, or uint8 or uint16 "
            "where not");
    }
    const Kind kind = floats ? Kind::float32 : codes ? Kind::snorm8 : bytes8 ? Kind::unorm8 : Kind::unorm16;
    const bcn::Texels texels = texels_of(values, kind);
    const bcn::Quality tier = quality_of(quality);
    const std::size_t bytes = bcn::blocks(texels.rows, texels.columns) * 8 * texels.channels;
    return filled(bytes, [&](std::span<std::uint8_t> out) {
        bcn::encode_values(texels, is_signed, tier, out, threads);
    });
}

} // namespace

NB_MODULE(_bcn, m) {
    m.doc() = "Block compression: BC1, BC3, BC4, BC5.";
    m.def("encode_color", &encode_color);
    m.def("encode_values", &encode_values);
}
