#include "step.hpp"

#include <algorithm>
#include <numeric>

#include "frames.hpp"

namespace nscd {

namespace {

// Accelerated gradient serves from this tolerance on: the exact solvers are for tighter ones. It stops a little before.
constexpr double LOOSE = 1e-6, BEFORE = 0.9;
// A step is repeated so often, at most, with a larger margin.
constexpr int REPEATS = 20;
// Disks are taken to be faster than before by this share of the fastest one.
constexpr double LIKELY = 0.01;

// The contacts whose gap two disks close that go towards each other as fast as before, or as without contacts.
Places likely(const System& s, In before) {
    const double slack = LIKELY * s.scale;
    Numbers speed(s.n);
    for (int i = 0; i < s.n; ++i) {
        const int at = s.d * i;
        const auto most = [&](In u) { return std::hypot(u[at], u[at + 1]) + (s.wide() ? s.reach[i] * std::abs(u[at + 2]) : 0.0); };
        speed[i] = std::max(most(before), most(s.free));
    }
    Places some;
    for (int c = 0; c < s.k; ++c)
        if (s.offset[c] <= speed[s.first[c]] + (s.second[c] >= 0 ? speed[s.second[c]] : 0.0) + slack) some.push_back(c);
    return some;
}

// First without the contacts that disks as fast as before could not close; with all where that is not the answer of all.
// guess: (k) N·s or none
void solve_step(const System& s, In before, In guess, double tolerance, Stepped& found) {
    Places every(s.n), all(s.k);
    std::iota(every.begin(), every.end(), 0);
    std::iota(all.begin(), all.end(), 0);
    found.reaction.assign(s.k, 0.0);
    found.velocity = s.free;
    found.rung = int(Rung::NOTHING);
    for (bool whole : {false, true}) {
        const Places some = whole ? all : likely(s, before);
        if (some.empty()) continue;
        System part = chosen(s, some, every, every);
        Answer by;
        if (tolerance >= LOOSE) {
            Parts one{{0, part.n}, {0, part.k}};
            Team alone(1);
            Descended end = descend(part, one, alone, {BEFORE * tolerance, MOST_SWEEPS, -1, INFINITE});
            by.reaction = std::move(end.reaction), by.velocity = std::move(end.velocity), by.iterations = end.sweeps;
            found.rung = GRADIENT;
        } else {
            Asked asked;
            asked.tolerance = tolerance, asked.least = asked.bounded = false;
            if (largest(guess) > 0.0)
                for (int c : some) asked.reaction.push_back(guess[c]);
            by = climb(part, asked);
            found.rung = int(by.rung);
        }
        found.iterations += by.iterations;
        std::fill(found.reaction.begin(), found.reaction.end(), 0.0);
        for (std::size_t c = 0; c < some.size(); ++c) found.reaction[some[c]] = by.reaction[c];
        found.velocity = std::move(by.velocity);
        const Certificate of = certified(s, found.reaction, found.velocity);
        found.error = of.finite ? larger(of.residual, of.momentum_error) : INFINITE;
        if (found.error <= tolerance) return;
    }
}

}  // namespace

double fastest(In velocity) {
    double square = 0.0;
    for (std::size_t i = 0; i < velocity.size(); i += 2)
        square = larger(square, velocity[i] * velocity[i] + velocity[i + 1] * velocity[i + 1]);
    return std::sqrt(square);
}

static Neighbours named(const Touching& at) {
    const std::size_t k = at.size();
    Neighbours near{Places(k), Places(k), Places(k), Numbers(2 * k), at.gap};
    for (std::size_t c = 0; c < k; ++c) {
        const bool wall = std::int64_t(c) >= at.pairs;
        near.first[c] = Index(at.first[c]);
        near.second[c] = wall ? -1 : Index(at.second[c]);
        near.wall[c] = wall ? Index(at.second[c]) : -1;
        near.normal[2 * c] = at.vector[2 * c] / at.distance[c];
        near.normal[2 * c + 1] = at.vector[2 * c + 1] / at.distance[c];
    }
    return near;
}

Neighbours neighbours_of(In position, In radius, const Segments& walls, double margin) {
    return named(touching(position, radius, walls, margin));
}

// Contacts of two disks of one body are none.
static void drop_own(const Bodies& bodies, Touching& at) {
    if (bodies.wide.body.empty()) return;
    std::size_t to = 0;
    const std::int64_t pairs = at.pairs;
    for (std::size_t c = 0; c < at.size(); ++c) {
        if (std::int64_t(c) < pairs && bodies.wide.body[at.first[c]] == bodies.wide.body[at.second[c]]) {
            --at.pairs;
            continue;
        }
        at.first[to] = at.first[c], at.second[to] = at.second[c], at.distance[to] = at.distance[c], at.gap[to] = at.gap[c];
        at.vector[2 * to] = at.vector[2 * c], at.vector[2 * to + 1] = at.vector[2 * c + 1];
        ++to;
    }
    at.first.resize(to), at.second.resize(to), at.distance.resize(to), at.gap.resize(to), at.vector.resize(2 * to);
}

// Whether velocities would close within a step (s) a gap beyond the margin (m) within which contacts were looked for.
static bool missed(const Bodies& bodies, In velocity, double step, double margin) {
    const double needed = 2.0 * step * fastest(velocity);
    if (needed <= margin) return false;
    Touching at = touching(bodies.position, bodies.radius, bodies.walls, needed);
    drop_own(bodies, at);
    const Neighbours near = named(at);
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

// The same with Coulomb's law.
static void solve_rough(const System& s, const Touching& at, In radius, const Rough& rough, double tolerance, Stepped& found) {
    std::vector<std::int64_t> every(radius.size());
    std::iota(every.begin(), every.end(), 0);
    found.keys = keys_of(at, every);
    const Rubbing p = rubbing_of(s, radius, rough.spin, rough.inertia, Numbers(s.k, rough.friction));
    const Carried lam = carried_over(rough.keys, rough.reaction, found.keys), tau = carried_over(rough.keys, rough.tangential, found.keys);
    FrictionAnswer by = step_friction(p, lam.values, tau.values, tolerance);
    const Numbers errors = measure(p, by.at);
    found.error = *std::max_element(errors.begin(), errors.end());
    found.velocity.resize(2 * std::size_t(s.n));
    if (s.wide()) found.velocity = std::move(by.at.u);
    else for (int i = 0; i < s.n; ++i) {
        std::copy_n(by.at.u.begin() + 3 * i, 2, found.velocity.begin() + 2 * i);
        found.spin[i] = by.at.u[3 * i + 2];
    }
    found.reaction = std::move(by.at.lam), found.tangential = std::move(by.at.tau);
    found.iterations = by.pairs, found.rung = choice_of(by.route);
}

Stepped make_step(const Bodies& bodies, const Rough& rough, double step, double restitution, double gained, double tolerance) {
    double margin = 2.0 * step * std::max(fastest(bodies.free), fastest(bodies.velocity));
    for (int repeats = 0;; ++repeats) {
        Touching at = touching(bodies.position, bodies.radius, bodies.walls, margin);
        drop_own(bodies, at);
        Stepped found;
        found.neighbours = named(at);
        found.repeats = repeats;
        found.tangential.assign(at.size(), 0.0), found.spin.assign(rough.spin.begin(), rough.spin.end());
        if (at.size() == 0) {
            const In free = bodies.wide.body.empty() ? bodies.free : bodies.unheld;
            found.velocity.assign(free.begin(), free.end());
            found.rung = int(Rung::NO_CONTACTS);
            return found;
        }
        System s = system_at(at, bodies.mass, bodies.free);
        const std::size_t n = bodies.mass.size();
        s.x.resize(n), s.y.resize(n);
        for (std::size_t i = 0; i < n; ++i) s.x[i] = bodies.position[2 * i], s.y[i] = bodies.position[2 * i + 1];
        // bodies at rest are moved by the rounding of their gaps alone, which no answer has to follow
        if (!bodies.wide.body.empty()) s.least_scale = EPSILON * largest(bodies.position) / (step * tolerance);
        if (!bodies.wide.body.empty()) s = joined(s, bodies.radius, bodies.wide, bodies.unheld);
        const In was = s.wide() ? bodies.moving : bodies.velocity;
        Numbers before(s.k), closing(s.k);
        approach(s, was, before);
        approach(s, s.free, closing);
        for (int c = 0; c < s.k; ++c) {
            s.offset[c] = at.gap[c] / step;
            if (restitution > 0.0 && closing[c] >= s.offset[c] && before[c] > std::max(2.0 * gained, 0.0))
                s.offset[c] = std::min(s.offset[c], -restitution * before[c]);
        }
        if (rough.friction > 0.0) solve_rough(s, at, bodies.radius, rough, tolerance, found);
        else {
            Carried guess;
            if (s.wide()) {
                std::vector<std::int64_t> every(n);
                std::iota(every.begin(), every.end(), 0);
                found.keys = keys_of(at, every);
                guess = carried_over(rough.keys, rough.reaction, found.keys);
            }
            solve_step(s, was, guess.values, tolerance, found);
        }
        const Numbers after = s.wide() ? of_members(bodies.wide, bodies.position, found.velocity) : Numbers();
        const In velocity = s.wide() ? In(after) : In(found.velocity);
        if (repeats == REPEATS || !missed(bodies, velocity, step, margin)) return found;
        margin = 2.0 * step * fastest(velocity);
    }
}

}  // namespace nscd
