#include "canonical.hpp"

#include <algorithm>

namespace nscd {

namespace {

// Weight of the contacts against the inertia that keeps the Newton matrix definite.
constexpr double STIFF = 1e8;
constexpr int STEPS = 60;
// Differences of the dual value below this share of it are rounding.
constexpr double ROUNDING = 1e-14;

double dot(In a, In b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace

Numbers least_energy(Factor& factor, In given, In u, double tolerance) {
    const System& s = factor.system();
    const std::size_t k = s.k, size = u.size();
    Numbers v(k), best(k, 0.0), momentum(size, 0.0), y(size, 0.0), rest(size), trial(size), reaction(k), theta(k), moved(k);
    Flags may(k), pressed(k), before(k, 0);
    approach(s, u, v);
    for (std::size_t c = 0; c < k; ++c) {
        may[c] = s.offset[c] - v[c] <= tolerance * s.scale;
        if (may[c]) best[c] = given[c];
    }
    add_reactions(s, best, 1.0, momentum);
    const double full = std::max(largest(momentum), 1e-300);
    double heaviest = 0.0, value = 0.0, best_error = INFINITE;
    for (int i = 0; i < s.n; ++i) heaviest = std::max(heaviest, s.mass[s.d * i]);
    const double stiff = STIFF * heaviest;
    std::fill(v.begin(), v.end(), 0.0);
    for (int step = 0; step < STEPS; ++step) {
        for (std::size_t c = 0; c < k; ++c) {
            pressed[c] = may[c] && (step == 0 || v[c] > 0.0);
            reaction[c] = pressed[c] ? v[c] : 0.0;
        }
        rest = momentum;
        add_reactions(s, reaction, -1.0, rest);
        const double error = largest(rest) / full;
        const bool same = pressed == before;
        if (step) {
            if (error < best_error) best = reaction, best_error = error;
            if (error < 1e-13 || (error < 1e-10 && error > 0.5 * best_error && same)) return best;
        }
        if (step == 0 || !same) {
            for (std::size_t c = 0; c < k; ++c) theta[c] = pressed[c] ? stiff : 0.0;
            if (!factor.factorise(theta, true)) return best;
        }
        before = pressed;
        for (double& r : rest) r *= stiff;
        factor.solve(rest);
        approach(s, rest, moved);
        double slope = dot(rest, momentum);
        for (std::size_t c = 0; c < k; ++c)
            if (may[c] && v[c] > 0.0) slope -= v[c] * moved[c];
        for (double length = 1.0;; length *= 0.5) {
            for (std::size_t i = 0; i < size; ++i) trial[i] = y[i] + length * rest[i];
            approach(s, trial, moved);
            double now = -dot(trial, momentum);
            for (std::size_t c = 0; c < k; ++c)
                if (may[c] && moved[c] > 0.0) now += 0.5 * moved[c] * moved[c];
            if (now <= value - 1e-4 * length * slope + ROUNDING * std::abs(value) || length < 1e-6) {
                value = now;
                break;
            }
        }
        std::swap(y, trial);
        std::swap(v, moved);
    }
    return best;
}

bool settle_energy(Factor& factor, Numbers& reaction, In u, double tolerance) {
    Numbers better = least_energy(factor, reaction, u, tolerance);
    if (accuracy(factor.system(), better, u) <= tolerance) {
        reaction = std::move(better);
        return true;
    }
    // the given ones serve where they are the same but for rounding
    double apart = 0.0;
    for (std::size_t c = 0; c < better.size(); ++c) apart = larger(apart, std::abs(better[c] - reaction[c]));
    return apart <= UNIQUE * *std::max_element(better.begin(), better.end());
}

}  // namespace nscd
