#include "interior_point.hpp"

#include <algorithm>
#include <array>

#include "levels.hpp"
#include "rounding.hpp"

namespace nscd {

namespace {

constexpr int MAX_ITERATIONS = 200;
constexpr double SMALLEST = 1e-300;
// Velocities (m/s) below this are taken as none: their squares are no numbers any more.
constexpr double ZERO_VELOCITY = 1e-140;
// It has stalled after so many iterations that take away less than a tenth of the error: near the end of the path, and
// far from it.
constexpr double NEAR_END = 1e-6;
constexpr int STALLED = 4, STALLED_FAR = 60;

// Compliance of the contacts, relative to the Delassus diagonal: a proximal term of the iteration only; 1e-10 would stall
// jammed ones.
constexpr double COMPLIANCE = 1e-14;
// Compliance, in the same unit, of contacts whose percussions are nearly those of least energy, and the residual to which
// they are followed.
constexpr double SOFT = 1e-9;
// From the last point with a larger error another path may go on.
constexpr double MIDWAY = 1e-3;
// To this residual the path is followed before its closed contacts are tried, in so many rounds.
constexpr double TRY_TOLERANCE = 1e-7;
constexpr int TRIES = 4;

// Storage of an iteration.
struct Work {
    Vector wanted;     // (k) m/s, C u − b − cλ
    Vector theta;      // (k) kg
    Vector push, v;    // (k)
    Vector inverse_slack, inverse_reaction;  // (k) 1/s, 1/λ
    Vector target;     // (k) m/s, what the corrector takes from the slack, (ΔsΔλ − σμ)/λ
    Vector dual;       // (n·d) N·s, Â(u − û) + Cᵀλ
    Vector size;       // (n) N·s
};

// The error at a point, the mean of sλ, and whether they are numbers; what the point misses goes into `work`.
struct PathResidual {
    double error, mean;
    bool valid;
};
// wanted ← C u − b − cλ from C u; max |min(wλ, −wanted)| and Σ sλ, in one order on every machine.
LEVELS std::pair<double, double> unserved(const double* offset, const double* inverse_mass, const double* slack, const double* reaction, const double* softness, double* wanted, int k) {
    std::array<double, 8> worst{}, total{};
    const auto one = [&](int c, int lane) {
        const double push = reaction[c], open = offset[c] - wanted[c] + (softness ? softness[c] * push : 0.0), pressed = inverse_mass[c] * push;
        const double size = std::abs(pressed < open ? pressed : open);
        wanted[c] = -open;
        worst[lane] = size > worst[lane] ? size : worst[lane];
        total[lane] += slack[c] * push;
    };
    int c = 0;
    for (; c + 8 <= k; c += 8)
        for (int lane = 0; lane < 8; ++lane) one(c + lane, lane);
    for (int lane = 0; c < k; ++c, ++lane) one(c, lane);
    std::pair<double, double> all{0.0, 0.0};
    for (int lane = 0; lane < 8; ++lane) all.first = std::max(all.first, worst[lane]), all.second += total[lane];
    return all;
}

PathResidual residual_of(const ImpactProblem& s, const PathPoint& point, In softness, Work& work) {
    const int d = s.d;
    const Vector& u = point.velocity;
    if (s.dissipative()) {
        Vector moved(u.size());
        for (std::size_t i = 0; i < u.size(); ++i) moved[i] = u[i] - s.free[i];
        inertia(s, moved, work.dual);
    } else {
        for (std::size_t i = 0; i < u.size(); ++i) work.dual[i] = s.mass[i] * (u[i] - s.free[i]);
    }
    for (int i = 0; i < s.n; ++i) work.size[i] = s.mass[d * i] * s.scale;
    add_reactions(s, point.reaction, 1.0, work.dual);
    for (int c = 0; c < s.k; ++c) {
        work.size[s.first[c]] += point.reaction[c];
        if (s.second[c] >= 0) work.size[s.second[c]] += point.reaction[c];
    }
    approach(s, u, work.wanted);
    const auto [worst, total] = unserved(s.max_approach.data(), s.inverse_mass.data(), point.slack.data(), point.reaction.data(), softness.data(), work.wanted.data(), s.k);
    double error = worst / s.scale;
    double sum = total;  // a maximum hides what is no number, a sum does not
    for (int i = 0; i < s.n; ++i)
        for (int a = 0; a < d; ++a) {
            const double imbalance = std::abs(work.dual[d * i + a]);
            if (a < 2) error = std::max(error, imbalance / work.size[i]);
            else if (s.compound()) error = std::max(error, imbalance / (work.size[i] * s.reach[i]));
            sum += imbalance;
        }
    return {error, total / s.k, std::isfinite(sum)};
}

LEVELS void weigh(const double* slack, const double* reaction, const double* compliance, double* theta, double* inverse_slack, double* inverse_reaction, int k) {
    for (int c = 0; c < k; ++c) {
        theta[c] = reaction[c] / (slack[c] + compliance[c] * reaction[c]);
        inverse_slack[c] = 1.0 / slack[c], inverse_reaction[c] = 1.0 / reaction[c];
    }
}

LEVELS void push_by(const double* theta, const double* wanted, const double* target, double* push, int k) {
    for (int c = 0; c < k; ++c) push[c] = theta[c] * (wanted[c] - target[c]);
}
LEVELS void changes(const double* theta, const double* v, const double* push, const double* slack, const double* target, const double* inverse, double* reaction, double* by, int k) {
    for (int c = 0; c < k; ++c) {
        reaction[c] = theta[c] * v[c] + push[c];
        by[c] = -slack[c] - target[c] - slack[c] * reaction[c] * inverse[c];
    }
}

// The step that takes away what is missed, to first order; sλ goes to 0, or to what the corrector wants.
void newton(Factor& factor, const PathPoint& point, PathPoint& step, Work& work) {
    const ImpactProblem& s = factor.problem();
    push_by(work.theta.data(), work.wanted.data(), work.target.data(), work.push.data(), s.k);
    for (std::size_t i = 0; i < work.dual.size(); ++i) step.velocity[i] = -work.dual[i];
    add_reactions(s, work.push, -1.0, step.velocity);
    factor.solve(step.velocity);
    approach(s, step.velocity, work.v);
    changes(work.theta.data(), work.v.data(), work.push.data(), point.slack.data(), work.target.data(), work.inverse_reaction.data(), step.reaction.data(), step.slack.data(), s.k);
}

// How far a step goes until s or λ is 0, at most 1.
LEVELS double to_boundary(const double* inverse_slack, const double* by, const double* inverse_reaction, const double* push, int k) {
    double maximum = 1.0;
    for (int c = 0; c < k; ++c) {
        const double one = -by[c] * inverse_slack[c], other = -push[c] * inverse_reaction[c];
        const double both = one > other ? one : other;
        maximum = both > maximum ? both : maximum;
    }
    return 1.0 / maximum;
}

double to_boundary(const PathPoint& step, const Work& work) {
    return to_boundary(work.inverse_slack.data(), step.slack.data(), work.inverse_reaction.data(), step.reaction.data(), int(step.slack.size()));
}

// Σ (s + tΔs)(λ + tΔλ), in one order on every machine.
LEVELS double sum_after(const double* slack, const double* by, const double* reaction, const double* change, double length, int k) {
    std::array<double, 8> sums{};
    const auto one = [&](int c, int lane) { sums[lane] += (slack[c] + length * by[c]) * (reaction[c] + length * change[c]); };
    int c = 0;
    for (; c + 8 <= k; c += 8)
        for (int lane = 0; lane < 8; ++lane) one(c + lane, lane);
    for (int lane = 0; c < k; ++c, ++lane) one(c, lane);
    double sum = 0.0;
    for (double part : sums) sum += part;
    return sum;
}
LEVELS void centre(const double* by, const double* change, const double* inverse, double wanted, double* target, int k) {
    for (int c = 0; c < k; ++c) target[c] = (by[c] * change[c] - wanted) * inverse[c];
}

// Mehrotra's corrector: (ΔsΔλ − σμ)/λ (k), σ from how far the predictor gets.
void aim(const PathPoint& point, const PathPoint& step, double length, double mean, Work& work) {
    const int k = int(work.target.size());
    const double after = sum_after(point.slack.data(), step.slack.data(), point.reaction.data(), step.reaction.data(), length, k);
    const double fraction = after / (double(k) * mean);
    double centring = fraction * fraction * fraction;
    if (length < 0.1) centring = std::max(centring, 0.3);
    centre(step.slack.data(), step.reaction.data(), work.inverse_reaction.data(), centring * mean, work.target.data(), k);
}

}  // namespace

PathResult follow(Factor& factor, double tolerance, In compliance, bool soft, PathPoint point) {
    const ImpactProblem& s = factor.problem();
    PathResult best{point.reaction, point.velocity, INFINITE, 0, {}, point};
    if (s.scale < ZERO_VELOCITY) return {Vector(s.k, 0.0), s.free, INFINITE, 0, {}, std::move(point)};
    const std::size_t k = s.k, size = s.mass.size();
    Work work{Vector(k), Vector(k), Vector(k), Vector(k), Vector(k), Vector(k), Vector(k), Vector(size), Vector(s.n)};
    PathPoint step{Vector(k), Vector(k), Vector(size)};
    int stalled = 0, iteration = 0;
    bool made = false;
    while (true) {
        const PathResidual missing = residual_of(s, point, soft ? compliance : In(), work);
        if (!missing.valid) break;
        stalled = missing.error < 0.9 * best.error ? 0 : stalled + 1;
        if (missing.error < best.error) {
            best.error = missing.error, best.iterations = iteration;
            best.reaction = point.reaction, best.velocity = point.velocity;
        }
        if (soft && missing.error > MIDWAY) best.last = point;
        const int max_stalled = best.error < NEAR_END ? STALLED : STALLED_FAR;
        if (best.error <= tolerance || stalled > max_stalled || iteration == MAX_ITERATIONS) break;
        ++iteration;
        weigh(point.slack.data(), point.reaction.data(), compliance.data(), work.theta.data(), work.inverse_slack.data(), work.inverse_reaction.data(), s.k);
        made = factor.factorise(work.theta);
        if (!made) break;
        std::fill(work.target.begin(), work.target.end(), 0.0);
        newton(factor, point, step, work);
        aim(point, step, to_boundary(step, work), missing.mean, work);
        newton(factor, point, step, work);
        const double length = to_boundary(step, work) * std::min(std::max(0.995, 1.0 - 10.0 * missing.error), 0.99999);
        for (std::size_t i = 0; i < size; ++i) point.velocity[i] += length * step.velocity[i];
        for (std::size_t c = 0; c < k; ++c) {
            point.slack[c] = std::max(point.slack[c] + length * step.slack[c], SMALLEST);
            point.reaction[c] = std::max(point.reaction[c] + length * step.reaction[c], SMALLEST);
        }
    }
    if (made) best.theta = std::move(work.theta);
    if (!soft) best.last = std::move(point);
    return best;
}

PathPoint cold_start(const ImpactProblem& s) {
    PathPoint point{Vector(s.k), Vector(s.k), s.free};
    const double minimum = std::sqrt(*std::min_element(s.inverse_mass.begin(), s.inverse_mass.end()));
    for (int c = 0; c < s.k; ++c) {
        const double root = std::sqrt(s.inverse_mass[c]);
        point.slack[c] = root * (s.scale / minimum), point.reaction[c] = s.scale / (root * minimum);
    }
    return point;
}

PathPoint away_from(const ImpactProblem& s, In reaction, In u, double tolerance, double away) {
    PathPoint point{Vector(s.k), Vector(s.k), Vector(u.begin(), u.end())};
    approach(s, u, point.slack);
    double error = tolerance * s.scale;
    for (int c = 0; c < s.k; ++c) {
        point.slack[c] = s.max_approach[c] - point.slack[c];
        error = std::max(error, std::abs(std::min(s.inverse_mass[c] * reaction[c], point.slack[c])));
    }
    const double square = away * error * (away * error);
    for (int c = 0; c < s.k; ++c) {
        const double difference = s.inverse_mass[c] * reaction[c] - point.slack[c];
        const double push = 0.5 * (difference + std::sqrt(difference * difference + 4.0 * square));
        point.slack[c] = std::max(push - difference, square / push);
        point.reaction[c] = square / point.slack[c] / s.inverse_mass[c];
    }
    return point;
}

InteriorPointResult solve_by_path(Factor& factor, const WarmStart& warm_start, double tolerance, bool canonical) {
    const ImpactProblem& s = factor.problem();
    const bool exactly = canonical && s.even();
    int spent = 0;
    Mask closed;
    const double max_stalled = 0.5 * tolerance, first = exactly ? std::max(TRY_TOLERANCE, max_stalled) : max_stalled;
    PathResult path;
    path.last = warm_start.reaction.empty() ? cold_start(s) : away_from(s, warm_start.reaction, warm_start.velocity, first, warm_start.away);
    InteriorPointResult found;
    // the factor is another one after that
    const auto close = [&](int tries) {
        path.theta.clear();
        ActiveSetResult exact = active_set_solve(factor, closed, true, CLOSED_TOLERANCE, tries);
        spent += exact.rounds;
        const bool settled = exact.converged && exact.error <= tolerance;
        found = {std::move(exact.reaction), std::move(exact.velocity), spent, settled && s.even(), std::move(exact.cached)};
        return settled;
    };
    double residual = INFINITE;
    const auto go_on = [&](double error, double compliance, bool soft) {
        Vector each = s.stiffness();
        for (double& c : each) c = compliance / c;
        path = follow(factor, error, each, soft, std::move(path.last));
        spent += path.iterations;
        residual = active_set_of(s, path.reaction, path.velocity, soft ? In(each) : In(), closed);
        return std::isfinite(path.error);
    };
    if (exactly) {
        if (!warm_start.reaction.empty()) active_set_of(s, warm_start.reaction, warm_start.velocity, {}, closed);
        const bool redundant = std::count(closed.begin(), closed.end(), 1) > 2 * s.n;
        if (redundant) {
            if (go_on(SOFT, SOFT, true) && close(TRIES)) return found;
            path.error = INFINITE;
        } else if (go_on(first, COMPLIANCE, false) && std::count(closed.begin(), closed.end(), 1) <= 2 * s.n && close(TRIES))
            return found;  // no more than unknowns: they tell the reactions
    }
    if (path.error > max_stalled) go_on(max_stalled, COMPLIANCE, false);
    if (residual > tolerance) {  // velocities without squares have no path
        close(12);
        if (solution_error(s, found.reaction, found.velocity) < solution_error(s, path.reaction, path.velocity)) return found;
    }
    return {std::move(path.reaction), std::move(path.velocity), spent, false, {std::move(path.theta), {}}};
}

}  // namespace nscd
