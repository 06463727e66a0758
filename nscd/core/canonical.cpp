#include "canonical.hpp"

#include <algorithm>

#include "active_set.hpp"

namespace nscd {

namespace {

// Weight of the contacts against the inertia that keeps the Newton matrix definite.
constexpr double STIFF = 1e8;
constexpr int STEPS = 60;

double dot(In a, In b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace

Vector least_energy(Factor& factor, In input, In u, double tolerance) {
    const ImpactProblem& s = factor.problem();
    const std::size_t k = s.k, size = u.size();
    Vector v(k), best(k, 0.0), momentum(size, 0.0), y(size, 0.0), residual(size), reaction(k), theta(k), moved(k);
    Mask may(k), pressed(k), before(k, 0);
    approach(s, u, v);
    for (std::size_t c = 0; c < k; ++c) {
        may[c] = s.max_approach[c] - v[c] <= tolerance * s.scale;
        if (may[c]) best[c] = input[c];
    }
    add_reactions(s, best, 1.0, momentum);
    const double full = std::max(max_abs(momentum), 1e-300);
    double heaviest = 0.0, best_error = INFINITE;
    for (int i = 0; i < s.n; ++i) heaviest = std::max(heaviest, s.mass[s.d * i]);
    const double stiff = STIFF * heaviest;
    // all that may press at first: what is right where reactions are unique
    for (std::size_t c = 0; c < k; ++c) theta[c] = may[c] ? stiff : 0.0;
    if (!factor.factorise(theta, true)) return best;
    for (std::size_t i = 0; i < size; ++i) y[i] = stiff * momentum[i];
    factor.solve(y);
    approach(s, y, v);
    for (int step = 1; step < STEPS; ++step) {
        for (std::size_t c = 0; c < k; ++c) {
            pressed[c] = may[c] && v[c] > 0.0;
            reaction[c] = pressed[c] ? v[c] : 0.0;
        }
        residual = momentum;
        add_reactions(s, reaction, -1.0, residual);
        const double error = max_abs(residual) / full;
        const bool same = pressed == before;
        if (error < best_error) best = reaction, best_error = error;
        if (error < 1e-13 || (error < 1e-10 && error > 0.5 * best_error && same)) return best;
        if (step == 1 || !same) {
            for (std::size_t c = 0; c < k; ++c) theta[c] = pressed[c] ? stiff : 0.0;
            if (!factor.factorise(theta, true)) return best;
        }
        before = pressed;
        for (double& r : residual) r *= stiff;
        factor.solve(residual);
        approach(s, residual, moved);
        const double length = line_minimum(may, v, moved, dot(residual, momentum), 0.0);
        for (std::size_t i = 0; i < size; ++i) y[i] += length * residual[i];
        approach(s, y, v);
    }
    return best;
}

bool settle_energy(Factor& factor, Vector& reaction, In u, double tolerance) {
    Vector better = least_energy(factor, reaction, u, tolerance);
    if (solution_error(factor.problem(), better, u) <= tolerance) {
        reaction = std::move(better);
        return true;
    }
    // the given ones serve where they are the same but for rounding
    double difference = 0.0;
    for (std::size_t c = 0; c < better.size(); ++c) difference = max_or_nan(difference, std::abs(better[c] - reaction[c]));
    return difference <= UNIQUE * *std::max_element(better.begin(), better.end());
}

}  // namespace nscd
