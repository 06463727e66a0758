// One object for every processor: a hot function is compiled for each level of vector instructions, and
// the loader takes the one that the machine has.
#pragma once

#include <cstring>

// The sanitizer of threads is not ready when the loader chooses. Clang passes no vectors between levels. Only glibc's loader
// chooses.
#if defined(__x86_64__) && defined(__GLIBC__) && __GNUC__ >= 12 && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define LEVELS [[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]]
#else
#define LEVELS
#endif

namespace nscd {

// Two numbers at once.
typedef double Vec2 __attribute__((vector_size(16)));

template <class Vector>
[[gnu::always_inline]] inline Vector load(const double* from) {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
[[gnu::always_inline]] inline void store(double* to, auto v) { std::memcpy(to, &v, sizeof v); }

}  // namespace nscd
