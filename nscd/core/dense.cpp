#include "dense.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace nscd {

namespace {

using Size = std::int64_t;

// Vectors of the native width of each level: wider ones are slower than none.
template <int LANES>
struct Vector {
    typedef double Type __attribute__((vector_size(8 * LANES)));
};

// Everything here is compiled into the function of each level.
template <int LANES>
struct Kernel {
    using V = typename Vector<LANES>::Type;
    static constexpr int WIDE = 8 / LANES;             // vectors in a chunk
    static constexpr int TALL = LANES == 8 ? 8 : 4;    // rows that are updated together
    static constexpr int AT_ONCE = LANES == 8 ? 2 : 1; // chunks that four rows are eliminated from together

    [[gnu::always_inline]] static V load(const double* at) {
        V v;
        std::memcpy(&v, at, sizeof v);
        return v;
    }
    [[gnu::always_inline]] static void store(double* at, V v) { std::memcpy(at, &v, sizeof v); }

    // Subtract Σ leftᵀ · right over rows first … end from TALL rows of a chunk.
    [[gnu::always_inline]] static void subtract(double* to, const double* left, const double* right, Size first, Size end) {
        V y[TALL][WIDE];
#pragma GCC unroll 8
        for (int r = 0; r < TALL; ++r)
#pragma GCC unroll 8
            for (int v = 0; v < WIDE; ++v) y[r][v] = load(to + 8 * r + LANES * v);
        for (Size k = first; k < end; ++k) {
            V x[WIDE];
#pragma GCC unroll 8
            for (int v = 0; v < WIDE; ++v) x[v] = load(right + 8 * k + LANES * v);
#pragma GCC unroll 8
            for (int r = 0; r < TALL; ++r)
#pragma GCC unroll 8
                for (int v = 0; v < WIDE; ++v) y[r][v] -= left[8 * k + r] * x[v];
        }
#pragma GCC unroll 8
        for (int r = 0; r < TALL; ++r)
#pragma GCC unroll 8
            for (int v = 0; v < WIDE; ++v) store(to + 8 * r + LANES * v, y[r][v]);
    }

    [[gnu::always_inline]] static void subtract_eight(double* to, const double* left, const double* right, Size first, Size end) {
        for (int r = 0; r < 8; r += TALL) subtract(to + 8 * r, left + r, right, first, end);
    }

    // Inverted diagonal of the Cholesky factor of four rows and columns, then what is above it by rows.
    struct Four {
        double i0, i1, i2, i3, e01, e02, e03, e12, e13, e23;
    };

    [[gnu::always_inline]] static bool factor_of_four(const double* F, Four& f) {
        // square roots last, so that nothing waits for them
        const double p0 = F[0], a01 = F[1], a02 = F[2], a03 = F[3];
        if (!(p0 > 0.0)) return false;
        const double r0 = 1.0 / p0, m1 = a01 * r0, m2 = a02 * r0, m3 = a03 * r0;
        const double p1 = F[9] - m1 * a01, a12 = F[10] - m1 * a02, a13 = F[11] - m1 * a03;
        if (!(p1 > 0.0)) return false;
        const double r1 = 1.0 / p1, q2 = a12 * r1, q3 = a13 * r1;
        const double p2 = F[18] - m2 * a02 - q2 * a12, a23 = F[19] - m2 * a03 - q2 * a13;
        if (!(p2 > 0.0)) return false;
        const double r2 = 1.0 / p2, p3 = F[27] - m3 * a03 - q3 * a13 - a23 * r2 * a23;
        if (!(p3 > 0.0)) return false;
        f.i0 = std::sqrt(r0), f.i1 = std::sqrt(r1), f.i2 = std::sqrt(r2), f.i3 = std::sqrt(1.0 / p3);
        f.e01 = a01 * f.i0, f.e02 = a02 * f.i0, f.e03 = a03 * f.i0;
        f.e12 = a12 * f.i1, f.e13 = a13 * f.i1, f.e23 = a23 * f.i2;
        return true;
    }

    // Four rows of some neighbouring chunks: subtract Σ leftᵀ · right over rows first … row, if SUBTRACT, and multiply
    // by the inverse of the transposed factor, if SCALE.
    template <int CHUNKS, bool SUBTRACT, bool SCALE>
    [[gnu::always_inline]] static void four_rows(double* chunk, Size stride, const double* left, Size first, Size row, const Four& f) {
        V x[4][CHUNKS * WIDE];
        const auto at = [&](Size r, int v) { return chunk + (v / WIDE) * stride + 8 * r + LANES * (v % WIDE); };
#pragma GCC unroll 4
        for (int r = 0; r < 4; ++r)
#pragma GCC unroll 8
            for (int v = 0; v < CHUNKS * WIDE; ++v) x[r][v] = load(at(row + r, v));
        if (SUBTRACT)
            for (Size k = first; k < row; ++k) {
                V other[CHUNKS * WIDE];
#pragma GCC unroll 8
                for (int v = 0; v < CHUNKS * WIDE; ++v) other[v] = load(at(k, v));
#pragma GCC unroll 4
                for (int r = 0; r < 4; ++r)
#pragma GCC unroll 8
                    for (int v = 0; v < CHUNKS * WIDE; ++v) x[r][v] -= left[8 * k + r] * other[v];
            }
        if (SCALE)
#pragma GCC unroll 8
            for (int v = 0; v < CHUNKS * WIDE; ++v) {
                x[0][v] *= f.i0;
                x[1][v] = (x[1][v] - f.e01 * x[0][v]) * f.i1;
                x[2][v] = (x[2][v] - f.e02 * x[0][v] - f.e12 * x[1][v]) * f.i2;
                x[3][v] = (x[3][v] - f.e03 * x[0][v] - f.e13 * x[1][v] - f.e23 * x[2][v]) * f.i3;
            }
#pragma GCC unroll 4
        for (int r = 0; r < 4; ++r)
#pragma GCC unroll 8
            for (int v = 0; v < CHUNKS * WIDE; ++v) store(at(row + r, v), x[r][v]);
    }

    // Update four rows of a panel by those from `first` on, and eliminate them.
    [[gnu::always_inline]] static bool eliminate_four(double* panel, Size height, Size first, Size row, Size count) {
        const Size stride = 8 * height, own = row >> 3;
        double* chunk = panel + own * stride;
        const double* left = chunk + (row & 7);
        Four f{};
        four_rows<1, true, false>(chunk, stride, left, first, row, f);
        double* diagonal = chunk + 8 * row + (row & 7);
        if (!factor_of_four(diagonal, f)) return false;
        four_rows<1, false, true>(chunk, stride, left, first, row, f);
        diagonal[0] = f.i0, diagonal[9] = f.i1, diagonal[18] = f.i2, diagonal[27] = f.i3;
        Size c = own + 1;
        for (; (count - c) % AT_ONCE; ++c) four_rows<1, true, true>(panel + c * stride, stride, left, first, row, f);
        for (; c < count; c += AT_ONCE) four_rows<AT_ONCE, true, true>(panel + c * stride, stride, left, first, row, f);
        return true;
    }

    [[gnu::always_inline]] static bool eliminate(double* panel, double* update, Size pivots, Size rest) {
        const Size height = height_of(pivots), width = chunks(pivots), more = chunks(rest), stride = 8 * height;
        for (Size q = pivots; q < height; ++q) panel[(q >> 3) * stride + 8 * q + (q & 7)] = 1.0;
        for (Size first = 0; first < height; first += PANEL) {
            const Size last = std::min<Size>(first + PANEL, height), end = std::min(last, pivots);
            for (Size row = first; row < last; row += 4)
                if (!eliminate_four(panel, height, first, row, width + more)) return false;
            if (last < height)
                for (Size j = last >> 3; j < width + more; ++j)
                    for (Size i = last >> 3; i < std::min(j + 1, width); ++i)
                        subtract_eight(panel + j * stride + 64 * i, panel + i * stride, panel + j * stride, first, end);
            const double* others = panel + width * stride;
            for (Size j = 0; j < more; ++j)
                for (Size i = 0; i <= j; ++i)
                    subtract_eight(update + 32 * j * (j + 1) + 64 * i, others + i * stride, others + j * stride, first, end);
        }
        return true;
    }

    // z −= Σ x · row over the first rows of a chunk, a multiple of four.
    [[gnu::always_inline]] static void subtract_rows(V (&z)[WIDE], const double* chunk, const double* x, Size rows) {
        V other[WIDE] = {};
        for (Size q = 0; q < rows; q += 2)
#pragma GCC unroll 8
            for (int v = 0; v < WIDE; ++v) {
                z[v] -= x[q] * load(chunk + 8 * q + LANES * v);
                other[v] -= x[q + 1] * load(chunk + 8 * q + 8 + LANES * v);
            }
#pragma GCC unroll 8
        for (int v = 0; v < WIDE; ++v) z[v] += other[v];
    }

    [[gnu::always_inline]] static void forward(const double* P, double* x, Size height, Size pivots, Size others) {
        const Size width = chunks(pivots);
        for (Size c = 0; c < width; ++c) {
            const double* chunk = P + 8 * c * height;
            if (c > 0) {
                V z[WIDE];
#pragma GCC unroll 8
                for (int v = 0; v < WIDE; ++v) z[v] = load(x + 8 * c + LANES * v);
                subtract_rows(z, chunk, x, 8 * c);
#pragma GCC unroll 8
                for (int v = 0; v < WIDE; ++v) store(x + 8 * c + LANES * v, z[v]);
            }
            for (Size q = 8 * c; q < std::min(8 * c + 8, height); ++q) {
                const double *row = chunk + 8 * q, y = x[q] * row[q & 7];
                for (Size lane = (q & 7) + 1; lane < 8; ++lane) x[8 * c + lane] -= y * row[lane];
                x[q] = y;
            }
        }
        for (Size c = width; c < width + others; ++c) {
            V z[WIDE] = {};
            subtract_rows(z, P + 8 * c * height, x, height);
#pragma GCC unroll 8
            for (int v = 0; v < WIDE; ++v) store(x + 8 * c + LANES * v, -z[v]);
        }
    }

    [[gnu::always_inline]] static double total(const V (&z)[WIDE]) {
        double sum = 0.0;
        for (int v = 0; v < WIDE; ++v)
            for (int lane = 0; lane < LANES; ++lane) sum += z[v][lane];
        return sum;
    }

    // Four rows at a time, from the last: what the later chunks leave to them, then their own triangle.
    [[gnu::always_inline]] static void back(const double* P, double* x, Size height, Size count) {
        const Size stride = 8 * height;
        for (Size q = height - 4; q >= 0; q -= 4) {
            const Size own = q >> 3;
            V z[4][WIDE] = {};
            for (Size c = own + 1; c < count; ++c)
#pragma GCC unroll 8
                for (int v = 0; v < WIDE; ++v) {
                    const V other = load(x + 8 * c + LANES * v);
#pragma GCC unroll 4
                    for (int r = 0; r < 4; ++r) z[r][v] += other * load(P + c * stride + 8 * (q + r) + LANES * v);
                }
            for (int r = 3; r >= 0; --r) {
                const double* row = P + own * stride + 8 * (q + r);
                double y = x[q + r] - total(z[r]);
                for (Size lane = ((q + r) & 7) + 1; lane < 8; ++lane) y -= row[lane] * x[8 * own + lane];
                x[q + r] = y * row[(q + r) & 7];
            }
        }
    }
};

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("arch=x86-64-v4")]] bool eliminate_v4(double* p, double* u, Size n, Size m) { return Kernel<8>::eliminate(p, u, n, m); }
[[gnu::target("arch=x86-64-v4")]] void forward_v4(const double* p, double* x, Size h, Size n, Size m) { Kernel<8>::forward(p, x, h, n, m); }
[[gnu::target("arch=x86-64-v4")]] void back_v4(const double* p, double* x, Size h, Size n) { Kernel<8>::back(p, x, h, n); }
[[gnu::target("arch=x86-64-v3")]] bool eliminate_v3(double* p, double* u, Size n, Size m) { return Kernel<4>::eliminate(p, u, n, m); }
[[gnu::target("arch=x86-64-v3")]] void forward_v3(const double* p, double* x, Size h, Size n, Size m) { Kernel<4>::forward(p, x, h, n, m); }
[[gnu::target("arch=x86-64-v3")]] void back_v3(const double* p, double* x, Size h, Size n) { Kernel<4>::back(p, x, h, n); }
#endif
bool eliminate_any(double* p, double* u, Size n, Size m) { return Kernel<2>::eliminate(p, u, n, m); }
void forward_any(const double* p, double* x, Size h, Size n, Size m) { Kernel<2>::forward(p, x, h, n, m); }
void back_any(const double* p, double* x, Size h, Size n) { Kernel<2>::back(p, x, h, n); }

struct Level {
    bool (*eliminate)(double*, double*, Size, Size) = eliminate_any;
    void (*forward)(const double*, double*, Size, Size, Size) = forward_any;
    void (*back)(const double*, double*, Size, Size) = back_any;
};

// What the machine has.
const Level LEVEL = [] {
#if defined(__x86_64__) && defined(__GNUC__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd"))
        return Level{eliminate_v4, forward_v4, back_v4};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        return Level{eliminate_v3, forward_v3, back_v3};
#endif
    return Level{};
}();

}  // namespace

bool eliminate(double* panel, double* update, Size pivots, Size rest) { return LEVEL.eliminate(panel, update, pivots, rest); }
void forward(const double* panel, double* x, Size height, Size pivots, Size others) { LEVEL.forward(panel, x, height, pivots, others); }
void back(const double* panel, double* x, Size height, Size count) { LEVEL.back(panel, x, height, count); }

}  // namespace nscd
