#include "step.hpp"

#include <algorithm>
#include <numeric>

namespace nscd {

namespace {

// Accelerated gradient serves from this tolerance on: the exact solvers are for tighter ones. It stops a little before.
constexpr double LOOSE = 1e-6, BEFORE = 0.9;
// A step is repeated so often, at most, with a larger margin.
constexpr int REPEATS = 20;
// Disks are taken to be faster than before by this share of the fastest one.
constexpr double LIKELY = 0.01;
// So many times the tolerance of velocities is a share of an energy that is rounding.
constexpr double ROUNDED = 10.0;

// The contacts whose gap two disks close that go towards each other as fast as before, or as without contacts.
Places likely(const System& s, In before) {
    const double slack = LIKELY * s.scale;
    Numbers speed(s.n);
    for (int i = 0; i < s.n; ++i) {
        const int at = s.d * i;
        const auto most = [&](In u) { return length(u[at], u[at + 1]) + (s.wide() ? s.reach[i] * std::abs(u[at + 2]) : 0.0); };
        speed[i] = std::max(most(before), most(s.free));
    }
    Places some;
    for (int c = 0; c < s.k; ++c)
        if (s.offset[c] <= speed[s.first[c]] + (s.second[c] >= 0 ? speed[s.second[c]] : 0.0) + slack) some.push_back(c);
    return some;
}

// Solve without the contacts that disks as fast as before could not close; with all where that is not the solution of all, as
// `solve` says of the contacts that it is given.
template <class Solve>
void solve_likely(const System& s, In before, Solve&& solve) {
    Places some = likely(s, before);
    if (solve(some) || int(some.size()) == s.k) return;
    some.resize(s.k);
    std::iota(some.begin(), some.end(), 0);
    solve(some);
}

// guess: (k) N·s or none
void solve_step(const System& s, In before, In guess, double tolerance, Stepped& found) {
    Places every(s.n);
    std::iota(every.begin(), every.end(), 0);
    solve_likely(s, before, [&](const Places& some) {
        const System part = chosen(s, some, every, every);
        Answer by;
        if (tolerance >= LOOSE && !s.wide() && part.k > 0) {
            Parts one{{0, part.n}, {0, part.k}};
            Team alone(1);
            Descended end = descend(part, one, alone, {BEFORE * tolerance, MOST_SWEEPS, -1, INFINITE});
            by.reaction = std::move(end.reaction), by.velocity = std::move(end.velocity), by.iterations = end.sweeps;
            by.method = Method::GRADIENT;
        } else {
            Asked asked;
            asked.tolerance = tolerance, asked.least = asked.bounded = false;
            if (largest(guess) > 0.0)
                for (int c : some) asked.reaction.push_back(guess[c]);
            by = climb(part, asked);
        }
        found.method = by.method == Method::NO_CONTACTS ? Method::NOTHING_PRESSES : by.method, found.iterations += by.iterations;
        found.reaction.assign(s.k, 0.0);
        for (std::size_t c = 0; c < some.size(); ++c) found.reaction[some[c]] = by.reaction[c];
        found.velocity = std::move(by.velocity);
        const Certificate of = certified(s, found.reaction, found.velocity);
        found.error = of.finite ? larger(of.residual, of.momentum_error) : INFINITE;
        return found.error <= tolerance;
    });
}

}  // namespace

double fastest(In velocity) {
    double square = 0.0;
    for (std::size_t i = 0; i < velocity.size(); i += 2)
        square = larger(square, velocity[i] * velocity[i] + velocity[i + 1] * velocity[i + 1]);
    return std::sqrt(square);
}

// Whether velocities would close within a step (s) a gap beyond the margin (m) within which contacts were looked for.
static bool missed(const Bodies& bodies, In velocity, double step, double margin) {
    const double needed = 2.0 * step * fastest(velocity);
    if (needed <= margin) return false;
    const Neighbours near = named(touching(bodies.position, bodies.radius, bodies.walls, needed, bodies.wide.body));
    for (std::size_t c = 0; c < near.gap.size(); ++c) {
        const Index i = near.first[c], j = near.second[c];
        double x = velocity[2 * i], y = velocity[2 * i + 1];
        if (j >= 0) x -= velocity[2 * j], y -= velocity[2 * j + 1];
        const double closing = step * (near.normal[2 * c] * x + near.normal[2 * c + 1] * y);
        if (near.gap[c] > margin && closing > near.gap[c]) return true;
    }
    return false;
}

double freed(In velocity, In desired, double share, const double (&gain)[2], Out free) {
    double most = 0.0;
    for (std::size_t i = 0; i < velocity.size(); ++i) {
        free[i] = velocity[i] + gain[i & 1];
        if (!desired.empty()) free[i] = (free[i] + share * desired[i]) / (1.0 + share);
        most = larger(most, std::abs(free[i] - velocity[i]));
    }
    return most;
}

Numbers drifts(In before, In after, const Neighbours& near, In reaction, double step, double slack) {
    Numbers drift(after.size());
    for (std::size_t i = 0; i < drift.size(); ++i) drift[i] = 0.5 * (before[i] + after[i]);
    Flags late(drift.size() / 2, 0);
    for (bool again = true; again;) {
        again = false;
        for (std::size_t c = 0; c < reaction.size(); ++c) {
            const Index i = near.first[c], j = near.second[c];
            if (late[i] && (j < 0 || late[j])) continue;
            const double x = near.normal[2 * c], y = near.normal[2 * c + 1];
            const auto closing = [&](In u) { return x * u[2 * i] + y * u[2 * i + 1] - (j < 0 ? 0.0 : x * u[2 * j] + y * u[2 * j + 1]); };
            const bool of_one = j >= 0 && late[i] != late[j];
            if (reaction[c] > 0.0 ? !of_one && std::abs(closing(drift) - closing(after)) <= slack : closing(drift) <= near.gap[c] / step + slack) continue;
            again = true;
            for (Index one : {i, j})
                if (one >= 0) late[one] = 1, drift[2 * one] = after[2 * one], drift[2 * one + 1] = after[2 * one + 1];
        }
    }
    return drift;
}

// Which bodies have more energy than without contacts, together with all that they press or that presses them; mass, u and
// free: (n·d). Restitution asks for that where a body that rebounds is held from the other side.
static Flags gaining(const System& s, In reaction, In mass, In u, In free, double tolerance) {
    Places first, second, group;
    for (int c = 0; c < s.k; ++c)
        if (reaction[c] > 0.0) first.push_back(s.first[c]), second.push_back(s.second[c]);
    const int groups = components(s.n, first, second, group), d = int(u.size()) / s.n;
    Numbers before(groups, 0.0), gained(groups, 0.0);
    for (std::size_t i = 0; i < u.size(); ++i) {
        before[group[i / d]] += mass[i] * free[i] * free[i];
        gained[group[i / d]] += mass[i] * (u[i] - free[i]) * (u[i] + free[i]);
    }
    Flags more(s.n);
    for (int i = 0; i < s.n; ++i) more[i] = gained[group[i]] > ROUNDED * tolerance * before[group[i]];
    return more;
}

// The same with Coulomb's law.
static Flags solve_rough(const System& s, In before, In radius, const Rough& rough, double tolerance, Stepped& found) {
    const Rubbing p = rubbing_of(s, radius, rough.spin, rough.inertia, Numbers(s.k, rough.friction));
    Places every(s.n);
    std::iota(every.begin(), every.end(), 0);
    FrictionAnswer by{{carried_over(rough.keys, rough.reaction, found.keys).values, carried_over(rough.keys, rough.tangential, found.keys).values, p.left}};
    Numbers errors;
    solve_likely(s, before, [&](const Places& some) {
        Numbers lam, tau;
        for (int c : some) lam.push_back(by.at.lam[c]), tau.push_back(by.at.tau[c]);
        Rubbing part = chosen(p, some, every);
        FrictionAnswer found_here = solve_friction(part, {.tolerance = tolerance, .in_step = true, .lam = lam, .tau = tau});
        by.at = {Numbers(s.k, 0.0), Numbers(s.k, 0.0), std::move(found_here.at.u)}, by.method = found_here.method, by.pairs += found_here.pairs;
        for (std::size_t c = 0; c < some.size(); ++c) by.at.lam[some[c]] = found_here.at.lam[c], by.at.tau[some[c]] = found_here.at.tau[c];
        errors = measure(p, by.at);
        return *std::max_element(errors.begin(), errors.end()) <= tolerance;
    });
    found.error = *std::max_element(errors.begin(), errors.end());
    found.velocity.resize(2 * std::size_t(s.n));
    if (s.wide()) found.velocity = by.at.u;
    else for (int i = 0; i < s.n; ++i) {
        std::copy_n(by.at.u.begin() + 3 * i, 2, found.velocity.begin() + 2 * i);
        found.spin[i] = by.at.u[3 * i + 2];
    }
    found.reaction = std::move(by.at.lam), found.tangential = std::move(by.at.tau);
    found.iterations = by.pairs, found.method = by.method;
    Flags refused = gaining(s, found.reaction, p.mass, by.at.u, p.left, tolerance);
    for (int i = 0; i < s.n; ++i) refused[i] = refused[i] || errors[p.island[i]] > tolerance;
    return refused;
}

Stepped make_step(const Bodies& bodies, const Rough& rough, double step, double restitution, double gained, double tolerance) {
    double margin = 2.0 * step * std::max(fastest(bodies.free), fastest(bodies.velocity));
    for (int repeats = 0;; ++repeats) {
        const Touching at = touching(bodies.position, bodies.radius, bodies.walls, margin, bodies.wide.body);
        Stepped found;
        const Neighbours& near = found.neighbours = named(at);
        found.repeats = repeats;
        found.tangential.assign(at.size(), 0.0), found.spin.assign(rough.spin.begin(), rough.spin.end());
        if (at.size() == 0) {
            const In free = bodies.wide.body.empty() ? bodies.free : bodies.unheld;
            found.velocity.assign(free.begin(), free.end());
            return found;
        }
        System s = system_of({bodies.position, bodies.free, bodies.radius, bodies.mass, {}}, near.first, near.second, near.normal);
        // bodies at rest are moved by the rounding of their gaps alone, which no answer has to follow
        if (!bodies.wide.body.empty()) s.least_scale = EPSILON * largest(bodies.position) / (step * tolerance);
        if (!bodies.wide.body.empty()) s = joined(s, bodies.radius, bodies.wide, bodies.unheld);
        const In was = s.wide() ? bodies.moving : bodies.velocity;
        Numbers before(s.k), closing(s.k);
        approach(s, was, before);
        approach(s, s.free, closing);
        Places rebounds;
        for (int c = 0; c < s.k; ++c) {
            s.offset[c] = at.gap[c] / step;
            if (restitution > 0.0 && closing[c] >= s.offset[c] && before[c] > std::max(2.0 * gained, 0.0))
                s.offset[c] = std::min(s.offset[c], -restitution * before[c]), rebounds.push_back(c);
        }
        if (rough.friction > 0.0 || s.wide()) found.keys = keys_of(at);
        for (bool again = true; again;) {
            Flags refused;
            if (rough.friction > 0.0) refused = solve_rough(s, was, bodies.radius, rough, tolerance, found);
            else {
                solve_step(s, was, s.wide() ? carried_over(rough.keys, rough.reaction, found.keys).values : Numbers(), tolerance, found);
                refused = gaining(s, found.reaction, s.mass, found.velocity, s.free, tolerance);
            }
            again = false;
            for (int c : rebounds) {
                if (!refused[s.first[c]] || s.offset[c] == at.gap[c] / step) continue;
                s.offset[c] = at.gap[c] / step;
                again = true;
            }
        }
        const Numbers after = s.wide() ? of_members(bodies.wide, bodies.position, found.velocity) : Numbers();
        const In velocity = s.wide() ? In(after) : In(found.velocity);
        if (repeats == REPEATS || !missed(bodies, velocity, step, margin)) return found;
        margin = 2.0 * step * fastest(velocity);
    }
}

}  // namespace nscd
