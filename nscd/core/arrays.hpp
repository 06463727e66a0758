// The arrays of the core. SI units everywhere.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <vector>

namespace nscd {

using Index = std::int32_t;         // the number of a disk, a contact, a place
using Vector = std::vector<double>;
using Indices = std::vector<Index>;  // −1: nobody
using Starts = std::vector<std::int64_t>;
using Mask = std::vector<std::uint8_t>;
using In = std::span<const double>;
using Out = std::span<double>;
using MaskView = std::span<const std::uint8_t>;

inline constexpr double EPSILON = std::numeric_limits<double>::epsilon();
inline constexpr double TINY = std::numeric_limits<double>::min();
inline constexpr double INFINITE = std::numeric_limits<double>::infinity();

// Leaves numbers as they are and begins at a line of the cache.
template <class T>
struct Aligned {
    using value_type = T;
    static constexpr std::align_val_t LINE{64};
    Aligned() = default;
    template <class U>
    Aligned(const Aligned<U>&) {}
    T* allocate(std::size_t size) { return static_cast<T*>(::operator new(size * sizeof(T), LINE)); }
    void deallocate(T* at, std::size_t) { ::operator delete(at, LINE); }
    template <class U>
    void construct(U*) {}
    template <class U, class... Args>
    void construct(U* at, Args&&... args) { ::new (static_cast<void*>(at)) U(static_cast<Args&&>(args)...); }
    template <class U>
    bool operator==(const Aligned<U>&) const { return true; }
};
using AlignedVector = std::vector<double, Aligned<double>>;

// |(x, y)|, the same bits in every C library
inline double length(double x, double y) { return std::sqrt(x * x + y * y); }

// The larger of two, or the one that is no number.
inline double max_or_nan(double a, double b) { return a >= b || a != a ? a : b; }

}  // namespace nscd
