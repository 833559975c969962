// Python face of the BC7 encoder. The output is an array that the caller made; sizes are checked here.

#include <stdexcept>

#include "bc7/encode.hpp"
#include "bind.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

using Pixels = nb::ndarray<const std::uint8_t, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<std::uint8_t, nb::c_contig, nb::device::cpu>;

void encode(const Pixels &rgba, int quality, float alpha_weight, const Blocks &blocks, int threads) {
    const bool fits = rgba.ndim() == 3 && rgba.shape(2) == 4 && rgba.size() > 0;
    if (!fits || blocks.size() != 16 * bc7::blocks(rgba.shape(0), rgba.shape(1))) {
        throw std::invalid_argument("the image's shape, or the output's size, is wrong");
    }
    if (quality < 0 || quality > static_cast<int>(bc7::Quality::exact)) {
        throw std::invalid_argument("there is no such quality");
    }
    if (!(alpha_weight >= 1.0F && alpha_weight <= 64.0F)) {
        throw std::invalid_argument("alpha's weight is 1 to 64");
    }
    nb::gil_scoped_release unlocked;
    bc7::encode(flat(rgba), rgba.shape(0), rgba.shape(1), static_cast<bc7::Quality>(quality), alpha_weight,
                flat(blocks), threads);
}

} // namespace

NB_MODULE(_bc7, m) {
    m.doc() = "Block compression: BC7.";
    m.def("encode", &encode);
}
