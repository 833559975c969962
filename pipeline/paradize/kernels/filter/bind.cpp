// Python face of the derivative filters' kernels. Shapes are checked in kernels/filter; sizes here once
// more.
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "bind.hpp"
#include "filter/choose.hpp"
#include "filter/destep.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

std::tuple<std::vector<double>, double> predict_errors(const In<float> &heights,
                                                       const In<std::int32_t> &islands, int source_bits,
                                                       bool wrap_x, bool wrap_y, const In<double> &derivative,
                                                       const In<double> &smooth, const In<float> &codes) {
    need(heights.ndim() == 2, "heights are not two-dimensional");
    need(islands.size() == 0 || islands.size() == heights.size(), "islands and heights differ in size");
    need(derivative.size() % filter::reach == 0 &&
             smooth.size() == derivative.size() / filter::reach * (filter::reach + 1),
         "the filters' weights have the wrong sizes");
    const filter::Map map{flat(heights), heights.shape(0), heights.shape(1), flat(islands),
                          source_bits,   wrap_x,           wrap_y,           flat(codes)};
    filter::Prediction found;
    {
        nb::gil_scoped_release unlocked;
        found = filter::predict_errors(map, flat(derivative), flat(smooth));
    }
    return {found.errors, found.step};
}

void destep(const In<float> &heights, double step, bool wrap_x, bool wrap_y, const Out<float> &result,
            int threads) {
    need(heights.ndim() == 2, "heights are not two-dimensional");
    need(result.size() == heights.size(), "an output array has the wrong size");
    need(step > 0.0, "a step is not positive");
    nb::gil_scoped_release unlocked;
    filter::destep(flat(heights), heights.shape(0), heights.shape(1), step, wrap_x, wrap_y, flat(result),
                   threads);
}

} // namespace

NB_MODULE(_filter, module) {
    module.def("predict_errors", &predict_errors);
    module.def("destep", &destep);
}
