// What all doors to Python share. What is no contiguous array of the right kind is refused.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>

#include "arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace nscd {

void bind_friction(nb::module_& m);
void bind_others(nb::module_& m);  // text, packing, fields, sums of impulses

template <class T, int D>
using Given = nb::ndarray<const T, nb::numpy, nb::ndim<D>, nb::c_contig, nb::device::cpu>;
template <class T, int D>
using Made = nb::ndarray<T, nb::numpy, nb::ndim<D>, nb::c_contig>;
using Vector = Given<double, 1>;
using Matrix = Given<double, 2>;
using Whole = Given<std::int64_t, 1>;
using Marks = Given<bool, 1>;

template <class Array>
auto span(const Array& given) { return std::span(given.data(), given.size()); }

// Hand an array over to Python; `columns` 0 makes it one-dimensional.
template <int D = 1, class T, class A>
auto give(std::vector<T, A>&& values, std::size_t columns = 0) {
    auto* kept = new std::vector<T, A>(std::move(values));
    nb::capsule owner(kept, [](void* at) noexcept { delete static_cast<std::vector<T, A>*>(at); });
    std::size_t shape[2] = {D == 1 ? kept->size() : kept->size() / columns, columns};
    return Made<T, D>(kept->data(), D, shape, owner);
}

inline void need(bool sound, const char* what) {
    if (!sound) throw nb::value_error(what);
}

// Marks of bytes as NumPy's booleans.
inline auto give_marks(Flags&& values) {
    auto* kept = new Flags(std::move(values));
    nb::capsule owner(kept, [](void* at) noexcept { delete static_cast<Flags*>(at); });
    return Made<bool, 1>(reinterpret_cast<bool*>(kept->data()), {kept->size()}, owner);
}

}  // namespace nscd
