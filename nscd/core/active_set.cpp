#include "active_set.hpp"

#include <algorithm>

namespace nscd {

namespace {

// Multiplier steps at most; the first shows which contacts pull, the others are for a set that is nearly right.
constexpr int STEPS = 50, ALL_STEPS = 10, MAX_GRADIENTS = 500;
// So many contacts, and this share of all, may change without getting fewer from round to round.
constexpr int CYCLE_CONTACTS = 4;
constexpr double CYCLE_FRACTION = 1e-5;
// Reactions below the rounding of PENALTY · C u have no sign.
constexpr double ROUNDING = 4.0 * PENALTY * EPSILON;
// Where a set is closed, open contacts that close by this share of ‖u⁻‖∞ are wrong, whatever its stiff limit says of them.
constexpr double OVERLAP = 1e-9;
// Contacts of bodies get firmer in these steps; rounds until the closed ones are known in each.
constexpr double PENALTIES[] = {7e4, 1e8};
constexpr int PENALTY_ROUNDS = 12;
// Contacts are this soft where Newton's method finds those that press, in so many rounds; it is left to the path when more
// than this share changes in one.
constexpr double SOFTER = 1e5, SHARE_OF_CHANGES = 0.03;
constexpr int SOFT_ROUNDS = 14;
// A line search ends once the slope is this share of what it was, or after so many rounds.
constexpr double LINE = 1e-3;
constexpr int LINE_ROUNDS = 40;
// Conjugate gradients end where so many steps in turn have not made the gaps smaller.
constexpr int PATIENCE = 20;

// Mark the closed contacts that pull, and the open ones without a gap that would be pressed, by more than rounding, or that
// close by more than `overlap`.
int find_wrong(const ImpactProblem& s, MaskView closed, In reaction, In v, double overlap, Mask& wrong) {
    int count = 0;
    for (int c = 0; c < s.k; ++c) {
        const double minimum = ROUNDING * s.scale / s.inverse_mass[c];
        const double gap = s.max_approach[c] - v[c];
        wrong[c] = closed[c] ? reaction[c] <= -minimum : (reaction[c] > minimum && gap <= EXACT_TOLERANCE * s.scale) || gap < -overlap * s.scale;
        count += wrong[c];
    }
    return count;
}

// Wrong contacts change sides; of those that share a disk only the first one where `one_per_disk`.
void change(const ImpactProblem& s, Mask& closed, const Mask& wrong, bool one_per_disk) {
    Mask used(s.n, 0);
    for (int c = 0; c < s.k; ++c) {
        if (!wrong[c]) continue;
        const Index i = s.first[c], j = s.second[c];
        if (one_per_disk && (used[i] || (j >= 0 && used[j]))) continue;
        used[i] = 1;
        if (j >= 0) used[j] = 1;
        closed[c] = !closed[c];
    }
}

}  // namespace

int close_contacts(Factor& factor, MaskView closed, In theta, Vector& reaction, Vector& u, Vector& v, int max_steps, double gap_tolerance) {
    const ImpactProblem& s = factor.problem();
    Vector push(s.k), residual(u.size()), moved(u.size());
    double before = INFINITE;
    int steps = 0;
    while (steps < max_steps) {
        ++steps;
        for (int c = 0; c < s.k; ++c) {
            reaction[c] += theta[c] * (v[c] - s.max_approach[c]);
            push[c] = closed[c] ? reaction[c] : 0.0;
        }
        for (std::size_t i = 0; i < u.size(); ++i) moved[i] = s.free[i] - u[i];
        inertia(s, moved, residual);
        add_reactions(s, push, -1.0, residual);
        factor.solve(residual);
        for (std::size_t i = 0; i < u.size(); ++i) u[i] += residual[i];
        approach(s, residual, push);
        approach(s, u, v);
        double open = 0.0;
        for (int c = 0; c < s.k; ++c) {
            reaction[c] += theta[c] * push[c];
            if (closed[c]) open = std::max(open, std::abs(v[c] - s.max_approach[c]));
        }
        if (open <= gap_tolerance * s.scale || (steps > 2 && open > 0.8 * before)) break;
        before = open;
    }
    return steps;
}

// What multipliers leave open where W is nearly singular, in a few steps for each of its small eigenvalues: T y = Cu − b,
// T = C(Â + CᵀΘC)⁻¹Cᵀ, by conjugate gradients with Θ for T⁻¹; u moves by δ = −(Â + CᵀΘC)⁻¹Cᵀy, and λ by y + ΘCδ.
static int close_by_gradients(Factor& factor, MaskView closed, In theta, Vector& best_reaction, Vector& best_u, Vector& v) {
    const ImpactProblem& s = factor.problem();
    const std::size_t k = s.k, size = best_u.size();
    Vector gap(k), step(k, 0.0), moved(size), change(k), reaction = best_reaction, u = best_u;
    double before = 0.0, minimum = INFINITE;
    const auto gaps = [&] {
        for (std::size_t c = 0; c < k; ++c) gap[c] = closed[c] ? v[c] - s.max_approach[c] : 0.0;
        return max_abs(gap);
    };
    gaps();
    int steps = 0;
    for (int waited = 0; steps < MAX_GRADIENTS && waited < PATIENCE; ++steps, ++waited) {
        double now = 0.0, curve = 0.0;
        for (std::size_t c = 0; c < k; ++c) now += gap[c] * theta[c] * gap[c];
        for (std::size_t c = 0; c < k; ++c) step[c] = theta[c] * gap[c] + (before > 0.0 ? now / before * step[c] : 0.0);
        before = now;
        std::fill(moved.begin(), moved.end(), 0.0);
        add_reactions(s, step, -1.0, moved);
        factor.solve(moved);
        approach(s, moved, change);
        for (std::size_t c = 0; c < k; ++c) curve -= step[c] * change[c];
        if (!(curve > 0.0)) break;
        const double length = now / curve;
        for (std::size_t i = 0; i < size; ++i) u[i] += length * moved[i];
        for (std::size_t c = 0; c < k; ++c) reaction[c] += length * (step[c] + theta[c] * change[c]);
        approach(s, u, v);
        const double open = gaps();
        if (open < minimum) best_reaction = reaction, best_u = u;
        if (open < 0.5 * minimum) waited = 0;
        minimum = std::min(minimum, open);
        if (minimum <= CLOSED_TOLERANCE * s.scale) break;
    }
    approach(s, best_u, v);
    return steps;
}

// Multipliers, and gradients where these leave gaps of bodies or of contacts that may pull; the steps of both. A disk whose
// gaps stay open is wedged: its percussions have no bound.
static int close_accurately(Factor& factor, MaskView closed, In theta, Vector& reaction, Vector& u, Vector& v, int max_steps, double gap_tolerance) {
    const ImpactProblem& s = factor.problem();
    int steps = close_contacts(factor, closed, theta, reaction, u, v, max_steps, gap_tolerance);
    double open = 0.0;
    for (int c = 0; c < s.k; ++c)
        if (closed[c]) open = std::max(open, std::abs(v[c] - s.max_approach[c]));
    if ((s.compound() || s.bilateral) && open > std::max(gap_tolerance, 100.0 * EXACT_TOLERANCE) * s.scale) steps += close_by_gradients(factor, closed, theta, reaction, u, v);
    return steps;
}

ActiveSetResult active_set_solve(Factor& factor, Mask closed, bool thorough, double gap_tolerance, int max_rounds) {
    const ImpactProblem& s = factor.problem();
    ActiveSetResult best{Vector(s.k, 0.0), s.free, 0, INFINITE, false, {}};
    Vector theta = s.stiffness(), weight(s.k), reaction(s.k), v(s.k), u;
    for (double& t : theta) t *= PENALTY;
    Mask wrong(s.k);
    const int cycle_limit = CYCLE_CONTACTS + int(CYCLE_FRACTION * s.k);
    int before = s.k;
    bool one_per_disk = false;
    while (best.rounds < max_rounds) {
        ++best.rounds;
        for (int c = 0; c < s.k; ++c) weight[c] = closed[c] ? theta[c] : 0.0;
        if (!factor.factorise(weight)) break;
        u = s.free;
        std::fill(reaction.begin(), reaction.end(), 0.0);
        approach(s, u, v);
        close_contacts(factor, closed, theta, reaction, u, v, 1, gap_tolerance);
        int changed = find_wrong(s, closed, reaction, v, INFINITE, wrong);
        if (thorough || changed <= cycle_limit || best.rounds == max_rounds) {
            close_accurately(factor, closed, theta, reaction, u, v, STEPS, gap_tolerance);
            changed = find_wrong(s, closed, reaction, v, OVERLAP, wrong);
            double error = 0.0;
            Vector pressed(s.k);
            for (int c = 0; c < s.k; ++c) {
                pressed[c] = closed[c] ? std::max(reaction[c], 0.0) : 0.0;
                error = max_or_nan(error, std::abs(std::min(s.inverse_mass[c] * pressed[c], s.max_approach[c] - v[c])));
                if (closed[c]) error = max_or_nan(error, -s.inverse_mass[c] * reaction[c]);
            }
            if (changed == 0) return {std::move(pressed), std::move(u), best.rounds, error / s.scale, true, {weight, closed}};
            if (error / s.scale < best.error) {
                best.error = error / s.scale;
                best.reaction = std::move(pressed), best.velocity = u;
            }
        }
        if (changed >= before && changed > cycle_limit) break;
        // a handful that does not shrink is a cycle between neighbours: one of them at a time breaks it
        one_per_disk = one_per_disk || changed >= before;
        before = changed;
        change(s, closed, wrong, one_per_disk);
    }
    return best;
}

double line_minimum(MaskView may, In v, In moved, double work, double curve) {
    double low = 0.0, high = INFINITE, t = 1.0;
    for (int round = 0; round < LINE_ROUNDS; ++round) {
        double slope = t * curve - work, rise = curve;
        for (std::size_t c = 0; c < v.size(); ++c) {
            const double overlap = v[c] + t * moved[c], push = (may.empty() || may[c]) && overlap > 0.0 ? moved[c] : 0.0;
            slope += overlap * push, rise += push * push;
        }
        if (std::abs(slope) <= LINE * work) break;
        (slope > 0.0 ? high : low) = t;
        const double next = t - slope / rise;
        t = next > low && next < high ? next : std::isfinite(high) ? 0.5 * (low + high) : 2.0 * t;
    }
    return t;
}

bool settle_penalties(Factor& factor, Mask& closed, int& rounds) {
    const ImpactProblem& s = factor.problem();
    const double theta = SOFTER * s.stiffness()[0];
    Vector weight(s.k), v(s.k), moved(s.k), overlap(s.k), u = s.free, residual(u.size()), step(u.size());
    approach(s, u, v);
    for (int round = 0; round < SOFT_ROUNDS; ++round) {
        for (int c = 0; c < s.k; ++c) weight[c] = closed[c] ? theta : 0.0;
        if (!factor.factorise(weight)) return false;
        ++rounds;
        for (int c = 0; c < s.k; ++c) {
            overlap[c] = v[c] - s.max_approach[c];
            weight[c] = closed[c] ? theta * overlap[c] : 0.0;
        }
        for (std::size_t i = 0; i < u.size(); ++i) residual[i] = s.mass[i] * (s.free[i] - u[i]);
        add_reactions(s, weight, -1.0, residual);
        step = residual;
        factor.solve(step);
        approach(s, step, moved);
        double length = 1.0;
        if (round > 0) {
            double work = 0.0, curve = 0.0;
            for (std::size_t i = 0; i < u.size(); ++i) work += s.mass[i] * step[i] * (s.free[i] - u[i]), curve += s.mass[i] * step[i] * step[i];
            length = line_minimum({}, overlap, moved, work / theta, curve / theta);
        }
        int changed = 0;
        for (std::size_t i = 0; i < u.size(); ++i) u[i] += length * step[i];
        for (int c = 0; c < s.k; ++c) {
            v[c] += length * moved[c];
            const bool pressed = v[c] > s.max_approach[c];
            changed += pressed != bool(closed[c]), closed[c] = pressed;
        }
        if (changed == 0) return true;
        if (changed > SHARE_OF_CHANGES * s.k) return false;
    }
    return false;
}

ActiveSetResult augmented_lagrangian(Factor& factor, Vector& reaction, double gap_tolerance, double error_tolerance) {
    const ImpactProblem& s = factor.problem();
    const Vector stiff = s.stiffness();
    Mask closed(s.k, 1);
    for (int c = 0; c < int(reaction.size()); ++c) closed[c] = reaction[c] > 0.0;
    reaction.resize(s.k);
    Vector multiplier = reaction, theta(s.k), weight(s.k), v(s.k), u;
    int rounds = 0;
    for (double penalty : PENALTIES) {
        int changed = 1;
        for (int round = 0; changed && round < PENALTY_ROUNDS; ++round, ++rounds) {
            for (int c = 0; c < s.k; ++c) theta[c] = penalty * stiff[c], weight[c] = closed[c] ? theta[c] : 0.0;
            if (!factor.factorise(weight)) break;
            u = s.free, reaction = multiplier;
            approach(s, u, v);
            close_contacts(factor, closed, theta, reaction, u, v, 1, gap_tolerance);
            changed = 0;
            for (int c = 0; c < s.k; ++c) {
                changed += closed[c] != (reaction[c] > 0.0);
                closed[c] = reaction[c] > 0.0;
            }
        }
        for (int c = 0; c < s.k; ++c) multiplier[c] = std::max(reaction[c], 0.0);
        const double error = error_tolerance > 0.0 ? solution_error(s, multiplier, u) : INFINITE;
        if (error <= error_tolerance) return {std::move(multiplier), std::move(u), rounds, error, true, {}};
    }
    reaction = std::move(multiplier);
    ActiveSetResult found = active_set_solve(factor, std::move(closed), false, gap_tolerance);
    found.rounds += rounds;
    return found;
}

ActiveSetResult solve_equalities(Factor& factor) {
    const ImpactProblem& s = factor.problem();
    ActiveSetResult found{Vector(s.k, 0.0), s.free, 0, INFINITE, true, {}};
    Vector v(s.k), theta = s.stiffness();
    for (double& t : theta) t *= PENALTY;
    if (!factor.factorise(theta)) return found;
    found.cached = {theta, Mask(s.k, 1)};
    approach(s, found.velocity, v);
    found.rounds = close_accurately(factor, found.cached.closed, theta, found.reaction, found.velocity, v, ALL_STEPS, CLOSED_TOLERANCE);
    return found;
}

double active_set_of(const ImpactProblem& s, In reaction, In u, In compliance, Mask& closed) {
    Vector v(s.k);
    approach(s, u, v);
    closed.resize(s.k);
    double error = 0.0;
    for (int c = 0; c < s.k; ++c) {
        const double opening = s.max_approach[c] - v[c], push = s.inverse_mass[c] * reaction[c];
        closed[c] = push > opening + (compliance.empty() ? 0.0 : compliance[c] * reaction[c]);
        error = max_or_nan(error, std::abs(std::min(push, opening)));
    }
    return error / s.scale;
}

}  // namespace nscd
