#include "canonical.hpp"

#include <algorithm>

#include "closing.hpp"

namespace nscd {

namespace {

// Weight of the contacts against the inertia that keeps the Newton matrix definite.
constexpr double STIFF = 1e8;
constexpr int STEPS = 60;
// Where no more contacts pull than so many and this share of all, if all that may press do, few steps tell which press.
constexpr int FEW_PULLS = 4;
constexpr double SHARE_OF_PULLS = 0.005;
// To this share of the largest reaction it is told before which contacts press, in so many steps at most.
constexpr double NEARLY_LEAST = 1e-5;
constexpr int PATH_STEPS = 30;
// It begins with no reaction below this share of their mean.
constexpr double INSIDE = 0.3;

// How far λ and s > 0 may go along their changes until one of them is 0, at most 1.
double to_boundary(const Mask& may, In one, In by, In other, In its) {
    double maximum = 1.0;
    for (std::size_t c = 0; c < one.size(); ++c)
        if (may[c]) maximum = std::max({maximum, -by[c] / one[c], -its[c] / other[c]});
    return 1.0 / maximum;
}

// y near the end of the central path of min ½ Σ λ², Cᵀλ = momentum, λ ≥ 0: λ − C y = s ≥ 0, λ s → 0, by Mehrotra's method
// from λ₀ > 0 and y = 0 with s = λ₀. What presses is then nearly known, however many contacts are
// redundant.
Vector nearly_least(Factor& factor, const Mask& may, Vector reaction, In momentum, double stiff) {
    const System& s = factor.system();
    const std::size_t k = s.k;
    Vector y(momentum.size(), 0.0), residual(momentum.size()), theta(k), push(k), v(k), target(k), change(k), by(k);
    double count = 0.0, mean = 0.0;
    for (std::size_t c = 0; c < k; ++c)
        if (may[c]) mean += reaction[c], count += 1.0;
    for (std::size_t c = 0; c < k; ++c)
        if (may[c]) reaction[c] = std::max(reaction[c], INSIDE * mean / count);
    Vector slack = reaction;
    for (int step = 0; step < PATH_STEPS; ++step) {
        approach(s, y, v);
        mean = 0.0;
        double maximum = 0.0;
        for (std::size_t c = 0; c < k; ++c) {
            if (!may[c]) continue;
            mean += reaction[c] * slack[c] / count;
            maximum = std::max(maximum, reaction[c]);
        }
        if (!(mean > NEARLY_LEAST * maximum * NEARLY_LEAST * maximum)) break;
        for (std::size_t c = 0; c < k; ++c) theta[c] = may[c] ? stiff * reaction[c] / (reaction[c] + slack[c]) : 0.0;
        if (!factor.factorise(theta, true)) break;
        std::fill(target.begin(), target.end(), 0.0);
        double length = 0.0;
        for (bool corrector : {false, true}) {
            // Δs = (target − λs − sΔλ)/λ, Δλ = θ (CΔy + C y + s − λ + (target − λs)/λ)
            for (std::size_t c = 0; c < k; ++c)
                push[c] = may[c] ? theta[c] / stiff * (v[c] - reaction[c] + target[c] / reaction[c]) : 0.0;
            std::copy(momentum.begin(), momentum.end(), residual.begin());
            for (std::size_t c = 0; c < k; ++c) change[c] = may[c] ? reaction[c] + push[c] : 0.0;
            add_reactions(s, change, -1.0, residual);
            for (double& r : residual) r *= stiff;
            factor.solve(residual);
            approach(s, residual, change);
            for (std::size_t c = 0; c < k; ++c) {
                if (!may[c]) continue;
                change[c] = push[c] + theta[c] / stiff * change[c];
                by[c] = (target[c] - slack[c] * change[c]) / reaction[c] - slack[c];
            }
            length = to_boundary(may, reaction, change, slack, by);
            if (corrector) break;
            double after = 0.0;
            for (std::size_t c = 0; c < k; ++c)
                if (may[c]) after += (reaction[c] + length * change[c]) * (slack[c] + length * by[c]) / count;
            const double fraction = after / mean, centre = std::max(fraction * fraction * fraction, length < 0.1 ? 0.3 : 0.0) * mean;
            for (std::size_t c = 0; c < k; ++c) target[c] = may[c] ? centre - change[c] * by[c] : 0.0;
        }
        length *= 0.995;
        for (std::size_t i = 0; i < y.size(); ++i) y[i] += length * residual[i];
        for (std::size_t c = 0; c < k; ++c)
            if (may[c]) reaction[c] += length * change[c], slack[c] += length * by[c];
    }
    return y;
}

double dot(In a, In b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace

Vector least_energy(Factor& factor, In input, In u, double tolerance) {
    const System& s = factor.system();
    const std::size_t k = s.k, size = u.size();
    Vector v(k), best(k, 0.0), momentum(size, 0.0), y(size, 0.0), residual(size), reaction(k), theta(k), moved(k);
    Mask may(k), pressed(k), before(k, 0);
    approach(s, u, v);
    for (std::size_t c = 0; c < k; ++c) {
        may[c] = s.offset[c] - v[c] <= tolerance * s.scale;
        if (may[c]) best[c] = input[c];
    }
    add_reactions(s, best, 1.0, momentum);
    const double full = std::max(largest(momentum), 1e-300);
    double heaviest = 0.0, best_error = INFINITE;
    for (int i = 0; i < s.n; ++i) heaviest = std::max(heaviest, s.mass[s.d * i]);
    const double stiff = STIFF * heaviest;
    // all that may press at first: what is right where reactions are unique
    for (std::size_t c = 0; c < k; ++c) theta[c] = may[c] ? stiff : 0.0;
    if (!factor.factorise(theta, true)) return best;
    for (std::size_t i = 0; i < size; ++i) y[i] = stiff * momentum[i];
    factor.solve(y);
    approach(s, y, v);
    int pulls = 0;
    for (std::size_t c = 0; c < k; ++c) pulls += may[c] && !(v[c] > 0.0);
    if (pulls > FEW_PULLS + int(SHARE_OF_PULLS * double(k))) {
        y = nearly_least(factor, may, best, momentum, stiff);
        approach(s, y, v);
    }
    for (int step = 1; step < STEPS; ++step) {
        for (std::size_t c = 0; c < k; ++c) {
            pressed[c] = may[c] && v[c] > 0.0;
            reaction[c] = pressed[c] ? v[c] : 0.0;
        }
        residual = momentum;
        add_reactions(s, reaction, -1.0, residual);
        const double error = largest(residual) / full;
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
    if (accuracy(factor.system(), better, u) <= tolerance) {
        reaction = std::move(better);
        return true;
    }
    // the given ones serve where they are the same but for rounding
    double difference = 0.0;
    for (std::size_t c = 0; c < better.size(); ++c) difference = larger(difference, std::abs(better[c] - reaction[c]));
    return difference <= UNIQUE * *std::max_element(better.begin(), better.end());
}

}  // namespace nscd
