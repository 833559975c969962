// Python face of the block compressors. Outputs are arrays that the caller made; sizes are checked here.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <stdexcept>

#include "bcn_encode.hpp"

namespace nb = nanobind;
using namespace paradize;

namespace {

template <typename T>
using In = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<std::uint8_t, nb::c_contig, nb::device::cpu>;

std::span<std::uint8_t> checked(bool fits, const Blocks &blocks, std::size_t rows, std::size_t columns,
                                std::size_t block_bytes) {
    if (!fits || rows == 0 || columns == 0 || blocks.size() != bcn::blocks(rows, columns) * block_bytes) {
        throw std::invalid_argument("the image's shape, or the output's size, is wrong");
    }
    return {blocks.data(), blocks.size()};
}

void encode_color(const In<std::uint8_t> &rgba, bool with_alpha, int passes, const Blocks &blocks,
                  int threads) {
    const bool fits = rgba.ndim() == 3 && rgba.shape(2) == 4;
    const std::size_t rows = fits ? rgba.shape(0) : 0;
    const std::size_t columns = fits ? rgba.shape(1) : 0;
    const auto to = checked(fits, blocks, rows, columns, with_alpha ? 16 : 8);
    nb::gil_scoped_release unlocked;
    const std::span<const std::uint8_t> from{rgba.data(), rgba.size()};
    (with_alpha ? bcn::encode_bc3 : bcn::encode_bc1)(from, rows, columns, passes, to, threads);
}

void encode_values(const In<float> &values, bool is_signed, int passes, const Blocks &blocks, int threads) {
    const bool fits = values.ndim() == 3 && (values.shape(2) == 1 || values.shape(2) == 2);
    const std::size_t rows = fits ? values.shape(0) : 0;
    const std::size_t columns = fits ? values.shape(1) : 0;
    const std::size_t channels = fits ? values.shape(2) : 0;
    const auto to = checked(fits, blocks, rows, columns, 8 * channels);
    nb::gil_scoped_release unlocked;
    const std::span<const float> from{values.data(), values.size()};
    (channels == 1 ? bcn::encode_bc4 : bcn::encode_bc5)(from, rows, columns, is_signed, passes, to, threads);
}

} // namespace

NB_MODULE(_bcn, m) {
    m.doc() = "Block compression: BC1, BC3, BC4, BC5.";
    m.def("encode_color", &encode_color);
    m.def("encode_values", &encode_values);
}
