#include "step.hpp"

#include <algorithm>
#include <numeric>

namespace nscd {

namespace {

// Accelerated gradient serves from this tolerance on: the exact solvers are for tighter ones. It stops a little before.
constexpr double GRADIENT_TOLERANCE = 1e-6, STOPPING_FRACTION = 0.9;
// A step is repeated so often, at most, with a larger margin.
constexpr int REPEATS = 20;
// Disks are taken to be faster than before by this share of the fastest one.
constexpr double SPEED_MARGIN = 0.01;
// So often a step is solved before all its contacts are taken; a guess above this share of the largest says that one is closed.
constexpr int MOST_PASSES = 10;
constexpr double NOT_NOTHING = 1e-6;
// So many times the tolerance of velocities is a share of an energy that is rounding.
constexpr double ENERGY_ROUNDING = 10.0;

// The contacts whose gap two disks close that go towards each other as fast as before, or as without contacts.
Indices reachable_contacts(const ImpactProblem& s, In left_velocity) {
    const double margin = SPEED_MARGIN * s.scale;
    Vector speed(s.n);
    for (int i = 0; i < s.n; ++i) {
        const int at = s.d * i;
        const auto fastest_point = [&](In u) { return length(u[at], u[at + 1]) + (s.compound() ? s.reach[i] * std::abs(u[at + 2]) : 0.0); };
        speed[i] = std::max(fastest_point(left_velocity), fastest_point(s.free));
    }
    Indices some;
    for (int c = 0; c < s.k; ++c)
        if (s.max_approach[c] <= speed[s.first[c]] + (s.second[c] >= 0 ? speed[s.second[c]] : 0.0) + margin) some.push_back(c);
    return some;
}

// Solve without the contacts that disks as fast as before could not close; with all where that is not the solution of all, as
// `solve` says of the contacts that it is given.
template <class Solve>
void solve_reachable(const ImpactProblem& s, In left_velocity, Solve&& solve) {
    Indices some = reachable_contacts(s, left_velocity);
    if (solve(some) || int(some.size()) == s.k) return;
    some.resize(s.k);
    std::iota(some.begin(), some.end(), 0);
    solve(some);
}

// Solve with the contacts that are included, and take those besides that this looked at. guess: (k) N·s or none
void solve_some(const ImpactProblem& s, Mask& included, In guess, double tolerance, const Resources& resources, StepResult& found) {
    Indices every(s.n), some, others;
    std::iota(every.begin(), every.end(), 0);
    for (int c = 0; c < s.k; ++c) (included[c] ? some : others).push_back(c);
    const ImpactProblem subproblem = restrict_to(s, some, every, every);
    Solution solution;
    if (tolerance >= GRADIENT_TOLERANCE && !s.compound() && subproblem.k > 0) {
        Parts one{{0, subproblem.n}, {0, subproblem.k}};
        DescentResult end = descend(subproblem, one, resources.team, {STOPPING_FRACTION * tolerance, MAX_SWEEPS, -1, INFINITE});
        solution.reaction = std::move(end.reaction), solution.velocity = std::move(end.velocity), solution.iterations = end.sweeps;
        solution.method = Method::PROJECTED_GRADIENT;
    } else {
        Options options;
        options.tolerance = tolerance, options.canonical = options.with_error_bound = false;
        options.full = &s, options.unlikely = std::move(others), options.reusable = &resources.reusable, options.team = &resources.team;
        if (max_abs(guess) > 0.0)
            for (int c : some) options.reaction.push_back(guess[c]);
        solution = solve_contacts(subproblem, options);
    }
    found.method = solution.method == Method::NO_CONTACTS ? Method::NOTHING_PRESSES : solution.method, found.iterations += solution.iterations;
    found.reaction.assign(s.k, 0.0);
    for (Index c : solution.added) some.push_back(c), included[c] = 1;
    for (std::size_t c = 0; c < some.size(); ++c) found.reaction[some[c]] = solution.reaction[c];
    found.velocity = std::move(solution.velocity);
    const Certificate certificate = certificate_of(s, found.reaction, found.velocity);
    found.error = certificate.finite ? max_or_nan(certificate.residual, certificate.momentum_error) : INFINITE;
}

// Solve with the likely contacts, and again from that answer with those besides that would overlap, as long as there are any: few
// are; with all where that does not end. guess: (k) N·s or none
void solve_step(const ImpactProblem& s, In left_velocity, In guess, double tolerance, const Resources& resources, StepResult& found) {
    Mask included(s.k, 0);
    Vector v(s.k), from(guess.begin(), guess.end());
    for (int c : reachable_contacts(s, left_velocity)) included[c] = 1;
    for (int passes = 1;; ++passes) {
        solve_some(s, included, from, tolerance, resources, found);
        if (found.error <= tolerance || std::count(included.begin(), included.end(), 1) == s.k) return;
        approach(s, found.velocity, v);
        from = found.reaction;
        const double least = NOT_NOTHING * max_abs(from);
        bool more = false;
        for (int c = 0; c < s.k; ++c)
            if (!included[c] && v[c] - s.max_approach[c] > tolerance * s.scale) from[c] = std::max((v[c] - s.max_approach[c]) / s.inverse_mass[c], least), included[c] = more = true;
        if (more && passes < MOST_PASSES && found.error < INFINITE) continue;
        std::fill(included.begin(), included.end(), 1);
        from.assign(guess.begin(), guess.end());
    }
}

}  // namespace

double max_speed(In velocity) {
    double square = 0.0;
    for (std::size_t i = 0; i < velocity.size(); i += 2)
        square = max_or_nan(square, velocity[i] * velocity[i] + velocity[i + 1] * velocity[i + 1]);
    return std::sqrt(square);
}

// Whether velocities would close within a step (s) a gap beyond the margin (m) within which contacts were looked for.
static bool missed(const StepInput& bodies, In velocity, double step, double margin) {
    const double needed = 2.0 * step * max_speed(velocity);
    if (needed <= margin) return false;
    const Neighbours neighbours = with_normals(find_contact_pairs(bodies.position, bodies.radius, bodies.walls, needed, bodies.compound.body));
    for (std::size_t c = 0; c < neighbours.gap.size(); ++c) {
        const Index i = neighbours.first[c], j = neighbours.second[c];
        double x = velocity[2 * i], y = velocity[2 * i + 1];
        if (j >= 0) x -= velocity[2 * j], y -= velocity[2 * j + 1];
        const double closed_distance = step * (neighbours.normal[2 * c] * x + neighbours.normal[2 * c + 1] * y);
        if (neighbours.gap[c] > margin && closed_distance > neighbours.gap[c]) return true;
    }
    return false;
}

double driven_velocity(In velocity, In desired, double step_over_tau, const double (&gain)[2], Out free) {
    double maximum = 0.0;
    for (std::size_t i = 0; i < velocity.size(); ++i) {
        free[i] = velocity[i] + gain[i & 1];
        if (!desired.empty()) free[i] = (free[i] + step_over_tau * desired[i]) / (1.0 + step_over_tau);
        maximum = max_or_nan(maximum, std::abs(free[i] - velocity[i]));
    }
    return maximum;
}

Vector mean_velocities(In before, In after, const Neighbours& neighbours, In reaction, double step, double velocity_tolerance) {
    Vector drift(after.size());
    for (std::size_t i = 0; i < drift.size(); ++i) drift[i] = 0.5 * (before[i] + after[i]);
    Mask uses_after(drift.size() / 2, 0);
    for (bool again = true; again;) {
        again = false;
        for (std::size_t c = 0; c < reaction.size(); ++c) {
            const Index i = neighbours.first[c], j = neighbours.second[c];
            if (uses_after[i] && (j < 0 || uses_after[j])) continue;
            const double x = neighbours.normal[2 * c], y = neighbours.normal[2 * c + 1];
            const auto approach_velocity = [&](In u) { return x * u[2 * i] + y * u[2 * i + 1] - (j < 0 ? 0.0 : x * u[2 * j] + y * u[2 * j + 1]); };
            const bool only_one_uses_after = j >= 0 && uses_after[i] != uses_after[j];
            if (reaction[c] > 0.0 ? !only_one_uses_after && std::abs(approach_velocity(drift) - approach_velocity(after)) <= velocity_tolerance : approach_velocity(drift) <= neighbours.gap[c] / step + velocity_tolerance) continue;
            again = true;
            for (Index one : {i, j})
                if (one >= 0) uses_after[one] = 1, drift[2 * one] = after[2 * one], drift[2 * one + 1] = after[2 * one + 1];
        }
    }
    return drift;
}

// Which bodies have more energy than without contacts, together with all that they press or that presses them; mass, u and
// free: (n·d). Restitution asks for that where a body that rebounds is held from the other side.
static Mask energy_gaining(const ImpactProblem& s, In reaction, In mass, In u, In free, double tolerance) {
    Indices first, second, group;
    for (int c = 0; c < s.k; ++c)
        if (reaction[c] > 0.0) first.push_back(s.first[c]), second.push_back(s.second[c]);
    const int groups = components(s.n, first, second, group), d = int(u.size()) / s.n;
    Vector energy_before(groups, 0.0), energy_gain(groups, 0.0);
    for (std::size_t i = 0; i < u.size(); ++i) {
        energy_before[group[i / d]] += mass[i] * free[i] * free[i];
        energy_gain[group[i / d]] += mass[i] * (u[i] - free[i]) * (u[i] + free[i]);
    }
    Mask more(s.n);
    for (int i = 0; i < s.n; ++i) more[i] = energy_gain[group[i]] > ENERGY_ROUNDING * tolerance * energy_before[group[i]];
    return more;
}

// A step with Coulomb's law; as `solve_step` without it.
static Mask solve_with_friction(const ImpactProblem& s, In left_velocity, In radius, const FrictionState& friction_state, double tolerance, StepResult& found) {
    const FrictionProblem p = friction_problem_of(s, radius, friction_state.spin, friction_state.inertia, Vector(s.k, friction_state.friction));
    Indices every(s.n);
    std::iota(every.begin(), every.end(), 0);
    FrictionResult result{{carried_over(friction_state.keys, friction_state.reaction, found.keys).values, carried_over(friction_state.keys, friction_state.tangential, found.keys).values, p.left_velocity}};
    Vector errors;
    solve_reachable(s, left_velocity, [&](const Indices& some) {
        Vector reaction, tangential;
        for (int c : some) reaction.push_back(result.solution.reaction[c]), tangential.push_back(result.solution.tangential[c]);
        FrictionProblem partial = restrict_to(p, some, every);
        FrictionResult found_here = solve_friction(partial, {.tolerance = tolerance, .in_step = true, .reaction = reaction, .tangential = tangential});
        result.solution = {Vector(s.k, 0.0), Vector(s.k, 0.0), std::move(found_here.solution.velocity)}, result.method = found_here.method, result.sweep_count += found_here.sweep_count;
        for (std::size_t c = 0; c < some.size(); ++c) result.solution.reaction[some[c]] = found_here.solution.reaction[c], result.solution.tangential[some[c]] = found_here.solution.tangential[c];
        errors = island_errors(p, result.solution);
        return *std::max_element(errors.begin(), errors.end()) <= tolerance;
    });
    found.error = *std::max_element(errors.begin(), errors.end());
    found.velocity.resize(2 * std::size_t(s.n));
    if (s.compound()) found.velocity = result.solution.velocity;
    else for (int i = 0; i < s.n; ++i) {
        std::copy_n(result.solution.velocity.begin() + 3 * i, 2, found.velocity.begin() + 2 * i);
        found.spin[i] = result.solution.velocity[3 * i + 2];
    }
    found.reaction = std::move(result.solution.reaction), found.tangential = std::move(result.solution.tangential);
    found.iterations = result.sweep_count, found.method = result.method;
    Mask cannot_rebound = energy_gaining(s, found.reaction, p.mass, result.solution.velocity, p.left_velocity, tolerance);
    for (int i = 0; i < s.n; ++i) cannot_rebound[i] = cannot_rebound[i] || errors[p.island[i]] > tolerance;
    return cannot_rebound;
}

StepResult make_step(const StepInput& bodies, const FrictionState& friction_state, double step, double restitution, double velocity_gain, double tolerance, const Resources& resources) {
    double margin = 2.0 * step * std::max(max_speed(bodies.free), max_speed(bodies.velocity));
    for (int repeats = 0;; ++repeats) {
        const ContactPairs contacts = find_contact_pairs(bodies.position, bodies.radius, bodies.walls, margin, bodies.compound.body);
        StepResult found;
        const Neighbours& neighbours = found.neighbours = with_normals(contacts);
        found.repeats = repeats;
        found.tangential.assign(contacts.size(), 0.0), found.spin.assign(friction_state.spin.begin(), friction_state.spin.end());
        if (contacts.size() == 0) {
            const In free = bodies.compound.body.empty() ? bodies.free : bodies.free_body_velocity;
            found.velocity.assign(free.begin(), free.end());
            return found;
        }
        ImpactProblem s = impact_problem_of({bodies.position, bodies.free, bodies.radius, bodies.mass, {}}, neighbours.first, neighbours.second, neighbours.normal);
        // bodies at rest are moved by the rounding of their gaps alone, which no answer has to follow
        if (!bodies.compound.body.empty()) s.least_scale = EPSILON * max_abs(bodies.position) / (step * tolerance);
        if (!bodies.compound.body.empty()) s = compound_problem_of(s, bodies.radius, bodies.compound, bodies.free_body_velocity);
        const In left_velocity = s.compound() ? bodies.body_velocity : bodies.velocity;
        Vector approach_before(s.k), free_approach(s.k);
        approach(s, left_velocity, approach_before);
        approach(s, s.free, free_approach);
        Indices rebounding;
        for (int c = 0; c < s.k; ++c) {
            s.max_approach[c] = contacts.gap[c] / step;
            if (restitution > 0.0 && free_approach[c] >= s.max_approach[c] && approach_before[c] > std::max(2.0 * velocity_gain, 0.0))
                s.max_approach[c] = std::min(s.max_approach[c], -restitution * approach_before[c]), rebounding.push_back(c);
        }
        if (friction_state.friction > 0.0 || s.compound()) found.keys = keys_of(contacts);
        for (bool again = true; again;) {
            Mask cannot_rebound;
            if (friction_state.friction > 0.0) cannot_rebound = solve_with_friction(s, left_velocity, bodies.radius, friction_state, tolerance, found);
            else {
                solve_step(s, left_velocity, s.compound() ? carried_over(friction_state.keys, friction_state.reaction, found.keys).values : Vector(), tolerance, resources, found);
                cannot_rebound = energy_gaining(s, found.reaction, s.mass, found.velocity, s.free, tolerance);
            }
            again = false;
            for (int c : rebounding) {
                if (!cannot_rebound[s.first[c]] || s.max_approach[c] == contacts.gap[c] / step) continue;
                s.max_approach[c] = contacts.gap[c] / step;
                again = true;
            }
        }
        const Vector after = s.compound() ? disk_velocity_of(bodies.compound, bodies.position, found.velocity) : Vector();
        const In velocity = s.compound() ? In(after) : In(found.velocity);
        if (repeats == REPEATS || !missed(bodies, velocity, step, margin)) return found;
        margin = 2.0 * step * max_speed(velocity);
    }
}

}  // namespace nscd
