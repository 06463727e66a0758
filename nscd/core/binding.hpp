// What all doors to Python share. What is no contiguous array of the right kind is refused.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>

#include "problem.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace nscd {

void bind_friction(nb::module_& m);
void bind_others(nb::module_& m);  // text, packing, fields, sums of impulses

// An argument that is taken as it is.
inline auto operator""_n(const char* name, std::size_t) { return nb::arg(name).noconvert(); }

template <class T, int D>
using ArrayArg = nb::ndarray<const T, nb::numpy, nb::ndim<D>, nb::c_contig, nb::device::cpu>;
template <class T, int D>
using Made = nb::ndarray<T, nb::numpy, nb::ndim<D>, nb::c_contig>;
using VectorArg = ArrayArg<double, 1>;
using MatrixArg = ArrayArg<double, 2>;
using IntegerArg = ArrayArg<std::int64_t, 1>;
using MaskArg = ArrayArg<bool, 1>;

template <class Array>
auto span(const Array& array) { return std::span(array.data(), array.size()); }

// Hand an array over to Python, where asked as another type of the same bytes; `columns` 0 makes it one-dimensional.
template <int D = 1, class Shown = void, class T, class A>
auto give(std::vector<T, A>&& values, std::size_t columns = 0) {
    using Element = std::conditional_t<std::is_void_v<Shown>, T, Shown>;
    auto* owned = new std::vector<T, A>(std::move(values));
    nb::capsule owner(owned, [](void* at) noexcept { delete static_cast<std::vector<T, A>*>(at); });
    std::size_t shape[2] = {D == 1 ? owned->size() : owned->size() / columns, columns};
    return Made<Element, D>(reinterpret_cast<Element*>(owned->data()), D, shape, owner);
}
inline void need(bool valid, const char* what) {
    if (!valid) throw nb::value_error(what);
}
inline void need_disks(std::size_t n, const ArrayArg<Index, 1>& first, const ArrayArg<Index, 1>& second) {
    need(first.size() == second.size(), "contacts: shapes differ");
    for (std::size_t c = 0; c < first.size(); ++c)
        need(first(c) >= 0 && first(c) < Index(n) && second(c) < Index(n), "contacts: a disk that does not exist");
}

// first, second (−1: a wall), normal, position, radius, mass, for parts of the solvers in tests and measurements.
using Pairs = std::tuple<ArrayArg<Index, 1>, ArrayArg<Index, 1>, MatrixArg, MatrixArg, VectorArg, VectorArg>;
inline ImpactProblem impact_problem_of_pairs(const Pairs& pairs, In left_velocity, In spin) {
    const auto& [first, second, normal, position, radius, mass] = pairs;
    const std::size_t n = mass.size();
    need_disks(n, first, second);
    need(normal.size() == 2 * first.size() && position.size() == 2 * n && radius.size() == n && left_velocity.size() == 2 * n, "pairs: shapes differ");
    return impact_problem_of({span(position), left_velocity, span(radius), span(mass), spin}, {first.data(), first.data() + first.size()},
                     {second.data(), second.data() + second.size()}, span(normal));
}

// A result with named fields, each handed over without a copy.
template <class R>
struct Result : nb::class_<R> {
    using nb::class_<R>::class_;
    template <class F>
    Result& field(const char* name, F R::*member) {
        this->def_ro(name, member, nb::rv_policy::reference);
        return *this;
    }
};

// Marks of bytes as NumPy's booleans.
template <int D = 1>
auto give_marks(Mask&& values, std::size_t columns = 0) { return give<D, bool>(std::move(values), columns); }

// What long work gives, while other threads of Python run.
template <class Work>
auto freely(const Work& work) {
    nb::gil_scoped_release others;
    return work();
}

}  // namespace nscd
