#include "error_bound.hpp"

#include <algorithm>

namespace nscd {

namespace {

// Gaps and imbalances are computed to so many units in the last place of what they are made of; gaps after the correction
// count as closed up to so many times that.
constexpr double ROUNDING = 4.0, CLOSED_UNITS = 8.0;
// Rounds in which contacts that the correction would press together are closed as well; steps of a correction, and the
// share of what a step must take away for another one.
constexpr int ROUNDS = 8, STEPS = 40;
constexpr double GAIN = 0.1;
// Weight of the closed contacts in a factorisation of its own: few steps, and their rounding is corrected by the next.
constexpr double FIRM = 1e9;

struct Gaps {
    Vector gap;            // (k) m/s, b − C u
    Vector pressed_reaction;           // (k) N·s, λ of the closed contacts, else 0
    Mask closed;           // (k)
    double rounding = 0.0;  // m/s, what gaps are known to
    double square = 0.0;    // Σ r²/m with rounding
};

// pressing: closed are the contacts that press more than they open; else those that `closed` says.
Gaps gaps_of(const ImpactProblem& s, In reaction, In u, bool pressing, Mask closed) {
    Gaps gaps{Vector(s.k), Vector(s.k), std::move(closed)};
    const int d = s.d;
    const double speed = std::max(s.scale, max_abs(u));
    gaps.rounding = ROUNDING * EPSILON * speed;
    approach(s, u, gaps.gap);
    Vector missed(u.size()), size(s.n);
    for (int c = 0; c < s.k; ++c) {
        gaps.gap[c] = s.max_approach[c] - gaps.gap[c];
        if (pressing) gaps.closed[c] = s.inverse_mass[c] * reaction[c] > gaps.gap[c];
        gaps.pressed_reaction[c] = gaps.closed[c] ? reaction[c] : 0.0;
    }
    if (s.dissipative()) {
        inertia(s, u, missed);
        const Vector momentum = free_momentum(s);
        for (std::size_t i = 0; i < missed.size(); ++i) missed[i] -= momentum[i];
    } else {
        for (std::size_t i = 0; i < missed.size(); ++i) missed[i] = s.mass[i] * (u[i] - s.free[i]);
    }
    add_reactions(s, gaps.pressed_reaction, 1.0, missed);
    for (int i = 0; i < s.n; ++i) size[i] = s.mass[d * i] * speed;
    for (int c = 0; c < s.k; ++c) {
        const double carried = std::abs(gaps.pressed_reaction[c]) + (s.dissipative() ? 4.0 * (s.normal_dashpot[c] + s.tangential_dashpot[c]) * speed : 0.0);
        size[s.first[c]] += carried;
        if (s.second[c] >= 0) size[s.second[c]] += carried;
    }
    for (int i = 0; i < s.n; ++i) {
        const double rounding = ROUNDING * EPSILON * size[i], heavy = s.mass[d * i];
        for (int a = 0; a < d; ++a) {
            // the moment of a push is that times the radius, √(2 I/m), or the longest lever of a wide body
            const double turn = a < 2 ? 1.0 : s.compound() ? s.reach[i] : std::sqrt(2.0 * s.mass[d * i + 2] / heavy);
            const double amount = std::abs(missed[d * i + a]) + rounding * turn;
            gaps.square += amount * amount / s.mass[d * i + a];
        }
    }
    return gaps;
}

// After the correction, C t = moved: how many open contacts overlap (they are closed for the next round), λ'·|b − C u|
// beyond rounding, and whether the corrected velocities are feasible.
struct Judgement {
    int more = 0;
    double slack = 0.0;
    bool complete = true;
};
Judgement judge(Gaps& gaps, In moved, bool equal) {
    Judgement judgement;
    const double rounding = CLOSED_UNITS * gaps.rounding;
    for (std::size_t c = 0; c < gaps.gap.size(); ++c) {
        const double after = gaps.gap[c] + moved[c], beyond = after - rounding;
        if (after < -rounding || (equal && beyond > 0.0)) {
            judgement.complete = false;
            if (!gaps.closed[c]) gaps.closed[c] = 1, ++judgement.more;
        } else if (beyond > 0.0) {
            judgement.slack += gaps.pressed_reaction[c] * beyond;
        }
    }
    return judgement;
}

// The least t (n·d) with v = C t = target on the closed contacts, by the method of multipliers: at most so many steps,
// until all are within `gap_tolerance` (m/s). Its multiplier, (k) N·s.
Vector correct(Factor& factor, const Mask& closed, In theta, In target, int max_steps, double gap_tolerance, Vector& t, Vector& v) {
    const ImpactProblem& s = factor.problem();
    Vector multiplier(s.k, 0.0), change(s.k), residual(t.size(), 0.0);
    std::fill(t.begin(), t.end(), 0.0);
    std::fill(v.begin(), v.end(), 0.0);
    double before = INFINITE;
    for (int step = 0; step < max_steps; ++step) {
        for (int c = 0; c < s.k; ++c)
            if (closed[c]) multiplier[c] += theta[c] * (v[c] - target[c]);
        inertia(s, t, residual);
        for (double& r : residual) r = -r;
        add_reactions(s, multiplier, -1.0, residual);
        factor.solve(residual);
        for (std::size_t i = 0; i < t.size(); ++i) t[i] += residual[i];
        approach(s, residual, change);
        double remaining = 0.0;
        for (int c = 0; c < s.k; ++c) {
            v[c] += change[c];
            if (!closed[c]) continue;
            multiplier[c] += theta[c] * change[c];
            remaining = std::max(remaining, std::abs(v[c] - target[c]));
        }
        if (remaining <= gap_tolerance || (step && remaining > (1.0 - GAIN) * before)) break;
        before = remaining;
    }
    return multiplier;
}

// What closed gaps may still be off by, each: what was not corrected, and rounding.
double unknown(const Gaps& gaps, In moved) {
    double maximum = 0.0;
    for (std::size_t c = 0; c < gaps.gap.size(); ++c)
        if (gaps.closed[c]) maximum = std::max(maximum, std::abs(gaps.gap[c] + moved[c]));
    return maximum + gaps.rounding;
}

double length_of(const ImpactProblem& s, const Vector& t) {
    Vector residual(t.size());
    inertia(s, t, residual);
    double square = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) square += t[i] * residual[i];
    return std::sqrt(square);
}

bool any_nonzero_approach(const ImpactProblem& s) {
    return std::any_of(s.max_approach.begin(), s.max_approach.end(), [](double b) { return b != 0.0; });
}

}  // namespace

Vector free_momentum(const ImpactProblem& s) {
    Vector momentum(s.mass.size());
    inertia(s, s.left_velocity, momentum);
    for (std::size_t i = 0; i < momentum.size(); ++i) momentum[i] = 2.0 * s.mass[i] * s.left_velocity[i] - momentum[i];
    return momentum;
}

double bound_of_closed_form(const ImpactProblem& s, In reaction, In u) {
    if (any_nonzero_approach(s)) return INFINITE;
    if (max_abs(reaction) == 0.0 && !s.dissipative()) return 0.0;
    const Gaps gaps = gaps_of(s, reaction, u, false, Mask(s.k, 1));
    double square = gaps.square;
    for (int c = 0; c < s.k; ++c)
        if (reaction[c] > 0.0) {
            const double away = std::abs(gaps.gap[c]) + gaps.rounding;
            square += away * away / s.inverse_mass[c];
        }
    return std::sqrt(square);
}

double bound_of_tree(const ImpactProblem& s, const Branches& branches, In reaction, In u) {
    if (any_nonzero_approach(s)) return INFINITE;
    Gaps gaps = gaps_of(s, reaction, u, true, Mask(s.k, 1));
    Vector target(s.k), v(s.k), t(u.size()), still(u.size(), 0.0), push(s.k);
    const auto energy = [&](In w) {
        double square = 0.0;
        for (std::size_t i = 0; i < w.size(); ++i) square += s.mass[i] * w[i] * w[i];
        return square;
    };
    for (int round = 0; round < ROUNDS; ++round) {
        if (unknown(gaps, v) > 2.0 * gaps.rounding) {
            for (int c = 0; c < s.k; ++c) target[c] = -gaps.gap[c];
            close_tree(s, branches, gaps.closed, still, target, push, t);
            approach(s, t, v);
        }
        const Judgement judgement = judge(gaps, v, false);
        if (judgement.complete) {
            const double maximum = unknown(gaps, v);
            double length = std::sqrt(energy(t));
            for (bool again : {false, true}) {
                for (int c = 0; c < s.k; ++c) target[c] = std::copysign(maximum, again ? push[c] : 1.0);
                close_tree(s, branches, gaps.closed, still, target, push, t);
            }
            length += std::sqrt(energy(t));
            return std::sqrt(gaps.square + length * length + 2.0 * judgement.slack);
        }
        if (judgement.more == 0) break;
    }
    return std::sqrt(gaps.square + energy(u));
}

double bound_by_factor(Factor& factor, In reaction, In u, const CachedFactor& cached) {
    const ImpactProblem& s = factor.problem();
    if (any_nonzero_approach(s)) return INFINITE;
    const std::size_t k = s.k;
    const bool has_factor = cached.closed.size() == k, equal = s.bilateral;
    bool ready = cached.theta.size() == k;
    Gaps gaps = gaps_of(s, reaction, u, !(has_factor || equal), has_factor ? cached.closed : Mask(k, 1));
    Vector theta = ready ? cached.theta : Vector(k), stiff = s.stiffness(), t(u.size()), v(k), target(k);
    for (std::size_t c = 0; c < k; ++c) target[c] = -gaps.gap[c];
    for (int round = 0; round < ROUNDS; ++round) {
        if (!ready) {
            for (std::size_t c = 0; c < k; ++c) theta[c] = gaps.closed[c] ? FIRM * stiff[c] : 0.0;
            if (!factor.factorise(theta)) break;
        }
        const bool fresh_factor = !ready;
        ready = false;
        std::fill(t.begin(), t.end(), 0.0);
        std::fill(v.begin(), v.end(), 0.0);
        bool beyond = false;
        for (std::size_t c = 0; c < k; ++c) beyond = beyond || gaps.gap[c] < -gaps.rounding || (gaps.closed[c] && gaps.gap[c] > gaps.rounding);
        if (beyond) correct(factor, gaps.closed, theta, target, STEPS, 0.1 * gaps.rounding, t, v);
        const Judgement judgement = judge(gaps, v, equal);
        if (judgement.complete) {
            double length = length_of(s, t);
            const double maximum = unknown(gaps, v);
            Vector push(k, 1.0);
            for (int turn = 0; turn < 2; ++turn) {
                for (std::size_t c = 0; c < k; ++c) target[c] = std::copysign(maximum, push[c]);
                push = correct(factor, gaps.closed, theta, target, STEPS, GAIN * maximum, t, v);
            }
            length += length_of(s, t);
            return std::sqrt(gaps.square + length * length + 2.0 * judgement.slack);
        }
        if (judgement.more == 0 && fresh_factor) break;
    }
    // no motion of the whole is feasible, as offsets are 0
    const double length = length_of(s, Vector(u.begin(), u.end()));
    return std::sqrt(gaps.square + length * length);
}

}  // namespace nscd
