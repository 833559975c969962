// Shared by the Python bindings: numpy arrays in and out, and checks.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace paradize::bind {

namespace nb = nanobind;

template <typename T>
using In = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
template <typename T>
using Out = nb::ndarray<T, nb::c_contig, nb::device::cpu>;
template <typename T>
using Column = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Rows = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

inline void need(bool condition, const char *what) {
    if (!condition) {
        throw std::invalid_argument(what);
    }
}

// All of an array's elements.
template <typename Array>
auto flat(const Array &array) {
    return std::span(array.data(), array.size());
}

// The same of an array to be written, which the caller made `expected` elements long.
template <typename T>
std::span<T> out(const Out<T> &array, std::size_t expected) {
    need(array.size() == expected, "an output array has the wrong size");
    return {array.data(), expected};
}

// A numpy array that owns the elements of a vector (or alike): in rows of `columns`, or flat where that is 0.
template <typename Values>
nb::object give(Values &&values, std::size_t columns = 0) {
    static_assert(std::is_rvalue_reference_v<Values &&>);
    auto *kept = new Values(std::move(values));
    const nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<Values *>(p); });
    const std::size_t shape[2] = {columns == 0 ? kept->size() : kept->size() / columns, columns};
    using Element = std::remove_reference_t<decltype(*kept->data())>;
    return nb::cast(nb::ndarray<nb::numpy, Element>(kept->data(), columns == 0 ? 1 : 2, shape, owner));
}

} // namespace paradize::bind
