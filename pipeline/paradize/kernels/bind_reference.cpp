// Python face of the reference kernels that metrics measure with. kernels/reference.py checks what goes in.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <span>
#include <vector>

#include "reference_distance.hpp"
#include "reference_frames.hpp"

namespace nb = nanobind;
using namespace paradize;

namespace {

template <typename T>
using Rows = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::tuple surface_distance(Rows<float> from, Rows<std::uint32_t> from_triangles, Rows<float> to,
                           Rows<std::uint32_t> to_triangles, std::uint64_t samples, unsigned threads) {
    const reference::Surface a{{from.data(), from.size()}, {from_triangles.data(), from_triangles.size()}};
    const reference::Surface b{{to.data(), to.size()}, {to_triangles.data(), to_triangles.size()}};
    reference::Distance found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::one_sided(a, b, samples, threads);
    }
    return nb::make_tuple(found.max, found.rms, found.p99);
}

nb::object angles_deg(Rows<float> a, Rows<float> b) {
    auto *out = new std::vector<double>(a.shape(0));
    nb::capsule owner(out, [](void *p) noexcept { delete static_cast<std::vector<double> *>(p); });
    {
        nb::gil_scoped_release unlocked;
        reference::angles_deg({a.data(), a.size()}, {b.data(), b.size()}, *out);
    }
    return nb::cast(nb::ndarray<nb::numpy, double>(out->data(), {out->size()}, owner));
}

} // namespace

NB_MODULE(_reference, m) {
    m.doc() = "Reference kernels for metrics.";
    m.def("surface_distance", &surface_distance);
    m.def("angles_deg", &angles_deg);
}
