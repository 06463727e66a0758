#include "bound.hpp"

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
    Numbers gap;            // (k) m/s, b − C u
    Numbers kept;           // (k) N·s, λ of the closed contacts, else 0
    Flags closed;           // (k)
    double rounding = 0.0;  // m/s, what gaps are known to
    double square = 0.0;    // Σ r²/m with rounding
};

// pressing: closed are the contacts that press more than they open; else those that `closed` says.
Gaps gaps_of(const System& s, In reaction, In u, bool pressing, Flags closed) {
    Gaps of{Numbers(s.k), Numbers(s.k), std::move(closed)};
    const int d = s.d;
    const double speed = std::max(s.scale, largest(u));
    of.rounding = ROUNDING * EPSILON * speed;
    approach(s, u, of.gap);
    Numbers missed(u.size()), size(s.n);
    for (int c = 0; c < s.k; ++c) {
        of.gap[c] = s.offset[c] - of.gap[c];
        if (pressing) of.closed[c] = s.inverse_mass[c] * reaction[c] > of.gap[c];
        of.kept[c] = of.closed[c] ? reaction[c] : 0.0;
    }
    if (s.dissipative()) {
        inertia(s, u, missed);
        const Numbers given = momentum_given(s);
        for (std::size_t i = 0; i < missed.size(); ++i) missed[i] -= given[i];
    } else {
        for (std::size_t i = 0; i < missed.size(); ++i) missed[i] = s.mass[i] * (u[i] - s.free[i]);
    }
    add_reactions(s, of.kept, 1.0, missed);
    for (int i = 0; i < s.n; ++i) size[i] = s.mass[d * i] * speed;
    for (int c = 0; c < s.k; ++c) {
        const double carried = std::abs(of.kept[c]) + (s.dissipative() ? 4.0 * (s.along[c] + s.across[c]) * speed : 0.0);
        size[s.first[c]] += carried;
        if (s.second[c] >= 0) size[s.second[c]] += carried;
    }
    for (int i = 0; i < s.n; ++i) {
        const double known = ROUNDING * EPSILON * size[i], heavy = s.mass[d * i];
        for (int a = 0; a < d; ++a) {
            // the moment of a push is that times the radius, √(2 I/m), or the longest lever of a wide body
            const double turn = a < 2 ? 1.0 : s.wide() ? s.reach[i] : std::sqrt(2.0 * s.mass[d * i + 2] / heavy);
            const double amount = std::abs(missed[d * i + a]) + known * turn;
            of.square += amount * amount / s.mass[d * i + a];
        }
    }
    return of;
}

// After the correction, C t = moved: how many open contacts overlap (they are closed for the next round), λ'·|b − C u|
// beyond rounding, and whether the corrected velocities are feasible.
struct Judged {
    int more = 0;
    double slack = 0.0;
    bool whole = true;
};
Judged judge(Gaps& of, In moved, bool equal) {
    Judged said;
    const double rounding = CLOSED_UNITS * of.rounding;
    for (std::size_t c = 0; c < of.gap.size(); ++c) {
        const double after = of.gap[c] + moved[c], beyond = after - rounding;
        if (after < -rounding || (equal && beyond > 0.0)) {
            said.whole = false;
            if (!of.closed[c]) of.closed[c] = 1, ++said.more;
        } else if (beyond > 0.0) {
            said.slack += of.kept[c] * beyond;
        }
    }
    return said;
}

// The least t (n·d) with v = C t = target on the closed contacts, by the method of multipliers: at most so many steps,
// until all are within `enough` (m/s). Its multiplier, (k) N·s.
Numbers correct(Factor& factor, const Flags& closed, In theta, In target, int most, double enough, Numbers& t, Numbers& v) {
    const System& s = factor.system();
    Numbers multiplier(s.k, 0.0), change(s.k), rest(t.size(), 0.0);
    std::fill(t.begin(), t.end(), 0.0);
    std::fill(v.begin(), v.end(), 0.0);
    double before = INFINITE;
    for (int step = 0; step < most; ++step) {
        for (int c = 0; c < s.k; ++c)
            if (closed[c]) multiplier[c] += theta[c] * (v[c] - target[c]);
        inertia(s, t, rest);
        for (double& r : rest) r = -r;
        add_reactions(s, multiplier, -1.0, rest);
        factor.solve(rest);
        for (std::size_t i = 0; i < t.size(); ++i) t[i] += rest[i];
        approach(s, rest, change);
        double left = 0.0;
        for (int c = 0; c < s.k; ++c) {
            v[c] += change[c];
            if (!closed[c]) continue;
            multiplier[c] += theta[c] * change[c];
            left = std::max(left, std::abs(v[c] - target[c]));
        }
        if (left <= enough || (step && left > (1.0 - GAIN) * before)) break;
        before = left;
    }
    return multiplier;
}

// What closed gaps may still be off by, each: what was not corrected, and rounding.
double unknown(const Gaps& of, In moved) {
    double most = 0.0;
    for (std::size_t c = 0; c < of.gap.size(); ++c)
        if (of.closed[c]) most = std::max(most, std::abs(of.gap[c] + moved[c]));
    return most + of.rounding;
}

double length_of(const System& s, const Numbers& t) {
    Numbers rest(t.size());
    inertia(s, t, rest);
    double square = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) square += t[i] * rest[i];
    return std::sqrt(square);
}

bool any_offset(const System& s) {
    return std::any_of(s.offset.begin(), s.offset.end(), [](double b) { return b != 0.0; });
}

}  // namespace

Numbers momentum_given(const System& s) {
    Numbers given(s.mass.size());
    inertia(s, s.left, given);
    for (std::size_t i = 0; i < given.size(); ++i) given[i] = 2.0 * s.mass[i] * s.left[i] - given[i];
    return given;
}

double bound_of_closed_form(const System& s, In reaction, In u) {
    if (any_offset(s)) return INFINITE;
    if (largest(reaction) == 0.0 && !s.dissipative()) return 0.0;
    const Gaps of = gaps_of(s, reaction, u, false, Flags(s.k, 1));
    double square = of.square;
    for (int c = 0; c < s.k; ++c)
        if (reaction[c] > 0.0) {
            const double away = std::abs(of.gap[c]) + of.rounding;
            square += away * away / s.inverse_mass[c];
        }
    return std::sqrt(square);
}

double bound_of_tree(const System& s, const Branches& branches, In reaction, In u) {
    if (any_offset(s)) return INFINITE;
    Gaps of = gaps_of(s, reaction, u, true, Flags(s.k, 1));
    Numbers target(s.k), v(s.k), t(u.size()), still(u.size(), 0.0), push(s.k);
    const auto energy = [&](In w) {
        double square = 0.0;
        for (std::size_t i = 0; i < w.size(); ++i) square += s.mass[i] * w[i] * w[i];
        return square;
    };
    for (int round = 0; round < ROUNDS; ++round) {
        if (unknown(of, v) > 2.0 * of.rounding) {
            for (int c = 0; c < s.k; ++c) target[c] = -of.gap[c];
            close_tree(s, branches, of.closed, still, target, push, t);
            approach(s, t, v);
        }
        const Judged said = judge(of, v, false);
        if (said.whole) {
            const double most = unknown(of, v);
            double length = std::sqrt(energy(t));
            for (bool again : {false, true}) {
                for (int c = 0; c < s.k; ++c) target[c] = std::copysign(most, again ? push[c] : 1.0);
                close_tree(s, branches, of.closed, still, target, push, t);
            }
            length += std::sqrt(energy(t));
            return std::sqrt(of.square + length * length + 2.0 * said.slack);
        }
        if (said.more == 0) break;
    }
    return std::sqrt(of.square + energy(u));
}

double bound_by_factor(Factor& factor, In reaction, In u, const Held& held) {
    const System& s = factor.system();
    if (any_offset(s)) return INFINITE;
    const std::size_t k = s.k;
    const bool known = held.closed.size() == k, equal = s.maintained;
    bool ready = held.theta.size() == k;
    Gaps of = gaps_of(s, reaction, u, !(known || equal), known ? held.closed : Flags(k, 1));
    Numbers theta = ready ? held.theta : Numbers(k), stiff = s.stiffness(), t(u.size()), v(k), target(k);
    for (std::size_t c = 0; c < k; ++c) target[c] = -of.gap[c];
    for (int round = 0; round < ROUNDS; ++round) {
        if (!ready) {
            for (std::size_t c = 0; c < k; ++c) theta[c] = of.closed[c] ? FIRM * stiff[c] : 0.0;
            if (!factor.factorise(theta)) break;
        }
        const bool own = !ready;
        ready = false;
        std::fill(t.begin(), t.end(), 0.0);
        std::fill(v.begin(), v.end(), 0.0);
        bool beyond = false;
        for (std::size_t c = 0; c < k; ++c) beyond = beyond || of.gap[c] < -of.rounding || (of.closed[c] && of.gap[c] > of.rounding);
        if (beyond) correct(factor, of.closed, theta, target, STEPS, 0.1 * of.rounding, t, v);
        const Judged said = judge(of, v, equal);
        if (said.whole) {
            double length = length_of(s, t);
            const double most = unknown(of, v);
            Numbers push(k, 1.0);
            for (int turn = 0; turn < 2; ++turn) {
                for (std::size_t c = 0; c < k; ++c) target[c] = std::copysign(most, push[c]);
                push = correct(factor, of.closed, theta, target, STEPS, GAIN * most, t, v);
            }
            length += length_of(s, t);
            return std::sqrt(of.square + length * length + 2.0 * said.slack);
        }
        if (said.more == 0 && own) break;
    }
    // no motion of the whole is feasible, as offsets are 0
    const double length = length_of(s, Numbers(u.begin(), u.end()));
    return std::sqrt(of.square + length * length);
}

}  // namespace nscd
