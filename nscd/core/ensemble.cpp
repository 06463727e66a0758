#include "ensemble.hpp"

#include <algorithm>

#include "friction_pivots.hpp"
#include "levels.hpp"
#include "rounding.hpp"

namespace nscd {

namespace {

double exponential(Random& random) { return exponential_of(random.number()); }

// A flight that is reflected more often, for each unknown, has come into a corner, and ends there.
constexpr std::size_t MOST_BOUNCES = 100;

// One sweep in so many draws; the others reflect.
constexpr std::int64_t DRAWS = 8;

double normal(Random& random) {
    return std::sqrt(2.0 * exponential(random)) * turn_by(2.0 * 3.14159265358979323846 * random.number()).cosine;
}

// Of the standard normal law above a.
double truncated(Random& random, double a) {
    if (a <= 0.0) {
        for (;;)
            if (const double z = normal(random); z >= a) return z;
    }
    const double rate = 0.5 * (a + std::sqrt(a * a + 4.0));
    for (;;) {
        const double z = a + exponential(random) / rate;
        if (exponential(random) >= 0.5 * (z - rate) * (z - rate)) return z;
    }
}

// When each x + v t + ½ a t² vanishes next, from x ≥ 0 on. Most of the time goes here.
LEVELS void hits(const double* x, const double* v, const double* a, double* __restrict when, std::size_t u) {
    for (std::size_t c = 0; c < u; ++c) {
        const double square = v[c] * v[c] - 2.0 * a[c] * x[c], root = std::sqrt(square > 0.0 ? square : 0.0);
        const double above = v[c] < 0.0 ? 2.0 * x[c] : v[c] + root, below = v[c] < 0.0 ? root - v[c] : -a[c];
        const bool hits = square >= 0.0 && below > 0.0;
        when[c] = (hits ? above : 1.0) / (hits ? below : TINY);
    }
}

LEVELS void add(double* __restrict to, const double* from, double by, std::size_t u) {
    for (std::size_t c = 0; c < u; ++c) to[c] += by * from[c];
}

// For a time t.
LEVELS void fly(double* __restrict x, double* __restrict v, const double* a, double t, std::size_t u) {
    for (std::size_t c = 0; c < u; ++c) {
        const double end = x[c] + t * (v[c] + 0.5 * t * a[c]);
        x[c] = end > 0.0 ? end : 0.0;
        v[c] += t * a[c];
    }
}

}  // namespace

void gibbs_sweeps(const SparseRows& matrix, double slope, Out x, Out net, std::uint64_t seed, std::int64_t sweeps, std::int64_t thin, Vector& draws) {
    Random random(seed);
    for (std::int64_t sweep = 1; sweep <= sweeps; ++sweep) {
        for (std::size_t c = 0; c < x.size(); ++c) {
            double rise = -slope, square = 0.0;
            for (auto e = matrix.start[c]; e < matrix.start[c + 1]; ++e) {
                rise += matrix.value[e] * net[matrix.column[e]];
                square += matrix.value[e] * matrix.value[e];
            }
            // the logarithm of the density is rise t − ½ square t², the same at 2 mean as at 0
            const double deviation = 1.0 / std::sqrt(square), mean = rise / square;
            double t = 2.0 * mean;
            if (sweep % DRAWS == 1)
                t = square > 0.0 ? mean + deviation * truncated(random, (-x[c] - mean) / deviation) : exponential(random) / slope - x[c];
            else if (!(x[c] + t >= 0.0))
                continue;
            t = std::max(t, -x[c]);
            x[c] += t;
            for (auto e = matrix.start[c]; e < matrix.start[c + 1]; ++e) net[matrix.column[e]] -= t * matrix.value[e];
        }
        if (sweep % thin == 0) draws.insert(draws.end(), x.begin(), x.end());
    }
}

void flights(In projector, In gravity, double time, Out x, std::uint64_t seed, std::int64_t flights, std::int64_t thin, Vector& draws) {
    Random random(seed);
    const std::size_t u = x.size();
    Vector v(u), when(u);
    for (std::int64_t flight = 1; flight <= flights; ++flight) {
        std::fill(v.begin(), v.end(), 0.0);
        for (std::size_t c = 0; c < u; ++c) add(v.data(), projector.data() + c * u, normal(random), u);
        double left = time * (0.5 + random.number());
        for (std::size_t bounce = 0; bounce < MOST_BOUNCES * u; ++bounce) {
            hits(x.data(), v.data(), gravity.data(), when.data(), u);
            const std::size_t at = std::min_element(when.begin(), when.end()) - when.begin();
            const double next = std::min(when[at], left);
            fly(x.data(), v.data(), gravity.data(), next, u);
            if (when[at] >= left) break;
            left -= next;
            const double* row = projector.data() + at * u;
            add(v.data(), row, -2.0 * v[at] / row[at], u);
            x[at] = 0.0;
            v[at] = std::abs(v[at]);
        }
        if (flight % thin == 0) draws.insert(draws.end(), x.begin(), x.end());
    }
}

}  // namespace nscd
