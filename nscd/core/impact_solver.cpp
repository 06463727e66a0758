#include "impact_solver.hpp"

#include <algorithm>
#include <numeric>

namespace nscd {

namespace {

// Sweeps of a descent, at most, before its closed contacts are tried; the same in a small crowd, where a factorisation is
// cheap; from how many disks on a crowd is large (docs/results/solvers.md).
constexpr int DESCENT_SWEEPS = 1600, SMALL_DESCENT_SWEEPS = 75, LARGE_CROWD = 2000;
// A descent has found the closed contacts once no more than this number and this share of all change between two looks.
constexpr int UNCHANGED_CONTACTS = 2;
constexpr double UNCHANGED_FRACTION = 1e-3;
// Between these numbers of closed contacts per unknown a packing is marginal: it has soft modes, and active sets cycle.
constexpr double ISOSTATIC = 1.0, REDUNDANT = 1.2;
// Contacts count whose gap, over the step, is no more than this share of the speed of the fastest.
constexpr double NEARLY_CLOSED = 0.02;
// A reaction above this share of the largest is one of a closed contact.
constexpr double PRESSED_FRACTION = 1e-9;
// From the answer of a crowd that was nearly the same, whose errors are few and large, the path begins this many times its
// error away.
constexpr double GUESS_DISTANCE = 1.0;
// To this share of the tolerance contacts are closed where no bound of the error is asked for.
constexpr double GAP_FRACTION = 1e-3;
// First-order solvers stop a little before the tolerance, so that rounding does not carry them beyond.
constexpr double STOPPING_FRACTION = 0.9;
// Rounds in which percussions between heavy and light disks are refined.
constexpr int REFINEMENTS = 12;
// Rounds of the one-sided law: few are needed, 5 in a crowd of 1,000. Halvings of a step that would raise Φ.
constexpr int ROUNDS = 60, HALVINGS = 40;

// Projected Gauss–Seidel: what the field uses; kept as the baseline. Contact by contact λ ← max(0, λ + (Cu − b)/w), with
// u updated at once. On a chain of n disks against a wall it contracts by cos²(π/(2n)) a sweep.
DescentResult gauss_seidel(const ImpactProblem& problem, double tolerance) {
    DescentResult iterate{Vector(problem.k, 0.0), problem.free, MAX_SWEEPS};
    Vector& u = iterate.velocity;
    const int d = problem.d;
    const auto violation = [&](int c) {
        const int i = d * problem.first[c], j = d * problem.second[c];
        double v = problem.nx[c] * u[i] + problem.ny[c] * u[i + 1] - problem.max_approach[c];
        if (j >= 0) v -= problem.nx[c] * u[j] + problem.ny[c] * u[j + 1];
        return v;
    };
    const auto residual = [&](int c, double v) { return std::abs(std::min(problem.inverse_mass[c] * iterate.reaction[c], -v)); };
    for (int sweep = 1; sweep <= MAX_SWEEPS; ++sweep) {
        double error = 0.0;
        for (int c = 0; c < problem.k; ++c) {
            const int i = d * problem.first[c], j = d * problem.second[c];
            const double v = violation(c);
            error = max_or_nan(error, residual(c, v));
            const double change = std::max(iterate.reaction[c] + v / problem.inverse_mass[c], 0.0) - iterate.reaction[c];
            if (change == 0.0) continue;
            iterate.reaction[c] += change;
            u[i] -= problem.nx[c] * change / problem.mass[i], u[i + 1] -= problem.ny[c] * change / problem.mass[i];
            if (j >= 0) u[j] += problem.nx[c] * change / problem.mass[j], u[j + 1] += problem.ny[c] * change / problem.mass[j];
        }
        // the error was measured along the sweep; where it is small the whole is measured before stopping
        if (error > tolerance) continue;
        double worst = 0.0;
        for (int c = 0; c < problem.k; ++c) worst = max_or_nan(worst, residual(c, violation(c)));
        if (worst <= tolerance) {
            iterate.sweeps = sweep;
            break;
        }
    }
    return iterate;
}

// Â⁻¹ momentum with one refinement; all in elimination order.
Vector velocity_of(Factor& factor, const Vector& momentum) {
    const ImpactProblem& problem = factor.problem();
    factor.factorise(Vector(problem.k, 0.0));
    Vector u = momentum, residual(u.size());
    factor.solve(u);
    inertia(problem, u, residual);
    for (std::size_t i = 0; i < u.size(); ++i) residual[i] = momentum[i] - residual[i];
    factor.solve(residual);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += residual[i];
    return u;
}

// In the norm of Â, which the distance of an answer is in.
double energy_norm_distance(const ImpactProblem& problem, In one, In other) {
    Vector difference(one.size()), heavy(one.size());
    for (std::size_t i = 0; i < one.size(); ++i) difference[i] = one[i] - other[i];
    inertia(problem, difference, heavy);
    double square = 0.0;
    for (std::size_t i = 0; i < one.size(); ++i) square += difference[i] * heavy[i];
    return std::sqrt(square);
}

// A problem that has to be factorised, on its way up the ladder; all in elimination order.
class ImpactSolver {
public:
    // remaining: of which disks it is what is left
    ImpactSolver(const ImpactProblem& problem, const Options& options, const RemainingContacts* remaining = nullptr)
        : input_problem_(problem), options_(options), remaining_(remaining), local_team_(options.team ? 1 : options.threads), team_(options.team ? *options.team : local_team_),
          factor_storage_(std::in_place, problem, team_, options.sizes, options.reusable, disks()), factor_(*factor_storage_), p_(factor_.problem()) {}

    Solution solve(Method& method) {
        method = solve_in_order();
        double error_bound = options_.with_error_bound ? bound_by_factor(factor_, reaction_, velocity_, cached_) : 0.0;
        if (p_.dissipative() && !p_.bilateral) error_bound += recompute_velocity();
        if (options_.canonical && !canonical_ && solution_error(p_, reaction_, velocity_) <= options_.tolerance)
            canonical_ = settle_energy(factor_, reaction_, velocity_, options_.tolerance);
        if (options_.solver == Solver::AUTO && options_.with_error_bound && !p_.even() && !p_.dissipative() && !p_.bilateral) {
            Vector reaction_before = reaction_;
            refine();
            if (solution_error(p_, reaction_, velocity_) > std::max(options_.tolerance, solution_error(p_, reaction_before, velocity_))) reaction_ = std::move(reaction_before);
        }
        const bool shared = p_.n >= options_.sizes.shared && p_.n >= options_.sizes.multifrontal;
        return {factor_.contacts_in_input_order(reaction_), factor_.disks_in_input_order(velocity_), method, p_.n, iterations_,
                shared ? team_.threads() : 1, canonical_, 0, added_, error_bound};
    }

private:
    // The first rung whose answer serves; the last one's in any case.
    Method solve_in_order() {
        if (p_.bilateral) {
            store(solve_equalities(factor_));
            canonical_ = true;
            return Method::MAINTAINED;
        }
        if (options_.solver != Solver::AUTO) {
            solve_by_name();
            return Method::BY_NAME;
        }
        const bool has_guess = !options_.reaction.empty(), even = p_.even();
        WarmStart warm_start;
        if (has_guess && p_.compound()) warm_start.reaction = factor_.contacts_in_elimination_order(options_.reaction);
        else if (has_guess && solve_from_guess(warm_start)) return Method::GUESS;
        if (!p_.dissipative() && even && p_.compound()) {
            if (solve_by_augmented_lagrangian(warm_start)) return Method::AUGMENTED_LAGRANGIAN;
        } else if (!p_.dissipative() && even && !has_guess && solve_by_descent(warm_start)) return Method::DESCENT;
        if (p_.dissipative() || !even) warm_start = {};
        InteriorPointResult found = solve_by_path(factor_, warm_start, options_.tolerance / max_stiffening(), options_.canonical);
        iterations_ += found.iterations;
        store(std::move(found));
        return p_.dissipative() ? Method::INTERIOR_POINT_DISSIPATIVE : even ? Method::INTERIOR_POINT_MARGINAL : Method::INTERIOR_POINT_UNEVEN_MASSES;
    }

    void solve_by_name() {
        if (options_.solver == Solver::INTERIOR_POINT) {
            InteriorPointResult found = solve_by_path(factor_, {}, options_.tolerance, options_.canonical);
            iterations_ = found.iterations;
            store(std::move(found));
        } else if (options_.solver == Solver::GAUSS_SEIDEL) {
            store(nscd::gauss_seidel(p_, STOPPING_FRACTION * options_.tolerance * p_.scale));
        } else if (options_.solver == Solver::PROJECTED_GRADIENT) {
            store(descend(p_, factor_.parts(), team_, {STOPPING_FRACTION * options_.tolerance, MAX_SWEEPS, -1, INFINITE}));
        } else if (p_.compound()) {
            ActiveSetResult found = augmented_lagrangian(factor_, reaction_, CLOSED_TOLERANCE, 0.0);
            canonical_ = found.converged && p_.even();
            store(std::move(found));
        } else {  // the closed contacts by descent, however many there are
            const DescentResult end = descend(p_, factor_.parts(), team_, {options_.tolerance, DESCENT_SWEEPS, unchanged_tolerance(), INFINITE});
            Mask closed;
            active_set_of(p_, end.reaction, end.velocity, {}, closed);
            ActiveSetResult found = active_set_solve(factor_, std::move(closed), false);
            iterations_ = end.sweeps;
            canonical_ = found.converged && p_.even();
            store(std::move(found));
        }
    }

    // Close the contacts whose reactions were more than nothing in the guess. A set of another crowd may settle without
    // contacts that are nearly closed, which would change the reactions of least energy: gaps have to be known as well as
    // they are looked at.
    bool solve_from_guess(WarmStart& warm_start) {
        warm_start.reaction = factor_.contacts_in_elimination_order(options_.reaction);
        warm_start.away = GUESS_DISTANCE;
        const double minimum = PRESSED_FRACTION * *std::max_element(warm_start.reaction.begin(), warm_start.reaction.end());
        Mask closed(p_.k);
        for (int c = 0; c < p_.k; ++c) closed[c] = warm_start.reaction[c] > minimum;
        if (options_.velocity.empty()) {
            warm_start.velocity = p_.free;  // û − M⁻¹Cᵀλ
            Vector momentum(p_.mass.size(), 0.0);
            add_reactions(p_, warm_start.reaction, 1.0, momentum);
            for (std::size_t i = 0; i < momentum.size(); ++i) warm_start.velocity[i] -= momentum[i] / p_.mass[i];
        } else {
            warm_start.velocity = factor_.disks_in_elimination_order(options_.velocity);
        }
        if (std::none_of(closed.begin(), closed.end(), [](auto is) { return is; })) return false;
        ActiveSetResult found = active_set_solve(factor_, std::move(closed), false, gap_tolerance());
        iterations_ += found.rounds;
        const bool exact = found.converged && found.error <= std::min(options_.tolerance, EXACT_TOLERANCE);
        if (!exact && (options_.canonical || !(found.error <= options_.tolerance))) return false;
        canonical_ = exact && p_.even();
        store(std::move(found));
        return true;
    }

    // Unsettled where the packing is marginal, so that the descent does not tell the closed contacts, or where the set would
    // not settle.
    bool solve_by_descent(WarmStart& warm_start) {
        DescentResult end = descend(p_, factor_.parts(), team_, {options_.tolerance, p_.n >= LARGE_CROWD ? DESCENT_SWEEPS : SMALL_DESCENT_SWEEPS, unchanged_tolerance(), ISOSTATIC});
        iterations_ += end.sweeps;
        Mask closed;
        if (options_.full) add_nearly_closed(end);
        active_set_of(p_, end.reaction, end.velocity, {}, closed);
        warm_start.reaction = std::move(end.reaction), warm_start.velocity = std::move(end.velocity);
        const auto count = std::count(closed.begin(), closed.end(), 1);
        const double fraction = double(count) / (2.0 * p_.n);
        if (count == 0) return false;
        if (ISOSTATIC < fraction && fraction < REDUNDANT && !settle_penalties(factor_, closed, iterations_)) return false;
        return accept(active_set_solve(factor_, std::move(closed), false, gap_tolerance()));
    }
    // Add the unlikely contacts that a descent overlaps or nearly closes, which may change the order.
    void add_nearly_closed(DescentResult& end) {
        const ImpactProblem& full = *options_.full;
        const Vector u = factor_.disks_in_input_order(end.velocity);
        ImpactProblem all;
        for (Index c : options_.unlikely) {
            const Index i = remaining_->index[full.first[c]], j = full.second[c] < 0 ? -1 : remaining_->index[full.second[c]];
            if (i < 0 || (j < 0 && full.second[c] >= 0)) continue;
            const double x = u[2 * i] - (j < 0 ? 0.0 : u[2 * j]), y = u[2 * i + 1] - (j < 0 ? 0.0 : u[2 * j + 1]);
            if (!(full.nx[c] * x + full.ny[c] * y - full.max_approach[c] > -NEARLY_CLOSED * p_.scale)) continue;
            if (added_.empty()) all = input_problem_;
            added_.push_back(c), ++all.k, all.first.push_back(i), all.second.push_back(j), all.nx.push_back(full.nx[c]);
            all.ny.push_back(full.ny[c]), all.max_approach.push_back(full.max_approach[c]), all.inverse_mass.push_back(full.inverse_mass[c]);
        }
        if (added_.empty()) return;
        Vector reaction = factor_.contacts_in_input_order(end.reaction);
        reaction.resize(all.k);
        factor_storage_.emplace(all, team_, options_.sizes, options_.reusable, disks());  // in the same place
        end.reaction = factor_.contacts_in_elimination_order(reaction), end.velocity = factor_.disks_in_elimination_order(u);
    }
    std::span<const Index> disks() const { return remaining_ ? std::span<const Index>(remaining_->disk) : std::span<const Index>(); }
    // The same of bodies of several disks.
    bool solve_by_augmented_lagrangian(WarmStart& warm_start) {
        const double error_tolerance = options_.with_error_bound || options_.canonical ? 0.0 : 0.5 * options_.tolerance;
        ActiveSetResult found = augmented_lagrangian(factor_, warm_start.reaction, gap_tolerance(), error_tolerance);
        warm_start.velocity = found.velocity;
        return accept(std::move(found));
    }
    // contacts of a step need not be closed to rounding
    double gap_tolerance() const { return options_.with_error_bound ? CLOSED_TOLERANCE : std::max(CLOSED_TOLERANCE, GAP_FRACTION * options_.tolerance); }
    bool accept(ActiveSetResult&& found) {
        iterations_ += found.rounds;
        if (!(found.converged && found.error <= options_.tolerance)) return false;
        canonical_ = true;
        store(std::move(found));
        return true;
    }

    // Where masses differ much, what rounding leaves of the percussions of heavy disks moves light ones: refined are those of
    // the contacts that press, λ ← λ + Θ(C u − b), and those kept whose velocities û − M⁻¹Cᵀλ are best.
    void refine() {
        Vector reaction = reaction_, u(p_.mass.size()), v(p_.k), theta = p_.stiffness();
        for (int c = 0; c < p_.k; ++c) theta[c] *= PENALTY;
        double best = INFINITE;
        for (int round = 0; round < REFINEMENTS; ++round) {
            u.assign(u.size(), 0.0);
            add_reactions(p_, reaction, -1.0, u);
            for (std::size_t i = 0; i < u.size(); ++i) u[i] = p_.free[i] + u[i] / p_.mass[i];
            approach(p_, u, v);
            double error = 0.0;
            for (int c = 0; c < p_.k; ++c) {
                const double pressed = p_.inverse_mass[c] * reaction[c], open = p_.max_approach[c] - v[c];
                error = max_or_nan(error, std::abs(std::min(pressed, open)));
                if (round == 0 && !(pressed > open)) theta[c] = 0.0;
                v[c] = -theta[c] * open;
            }
            if (round == 0 && !factor_.factorise(theta)) return;
            if (error < best) best = error, reaction_ = reaction;
            for (int c = 0; c < p_.k; ++c) reaction[c] += v[c];
            u.assign(u.size(), 0.0);
            add_reactions(p_, v, -1.0, u);
            factor_.solve(u);
            approach(p_, u, v);
            for (int c = 0; c < p_.k; ++c) reaction[c] = std::max(reaction[c] + theta[c] * v[c], 0.0);
        }
    }

    // Recompute the velocities from the reactions, Â u⁺ = Â û − Cᵀλ, where that is more accurate: k/m times a rounding
    // error of u is momentum out of balance. How far they moved.
    double recompute_velocity() {
        cached_ = {};
        Vector momentum = free_momentum(p_);
        add_reactions(p_, reaction_, -1.0, momentum);
        Vector u = velocity_of(factor_, momentum);
        if (!(solution_error(p_, reaction_, u) < solution_error(p_, reaction_, velocity_))) return 0.0;
        const double moved = energy_norm_distance(p_, u, velocity_);
        velocity_ = std::move(u);
        return moved;
    }

    // An error of C u is one of k C u in what a contact pushes: max 1 + wk.
    double max_stiffening() const {
        double maximum = 1.0;
        for (std::size_t c = 0; c < p_.normal_dashpot.size(); ++c) maximum = std::max(maximum, 1.0 + p_.inverse_mass[c] * p_.normal_dashpot[c]);
        return maximum;
    }
    int unchanged_tolerance() const { return UNCHANGED_CONTACTS + int(UNCHANGED_FRACTION * p_.k); }
    void store(ActiveSetResult&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), cached_ = std::move(found.cached);
        if (options_.solver == Solver::ACTIVE_SET || p_.bilateral) iterations_ += found.rounds;
    }
    void store(InteriorPointResult&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), cached_ = std::move(found.cached);
        canonical_ = found.canonical;
    }
    void store(DescentResult&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), iterations_ = found.sweeps;
    }

    const ImpactProblem& input_problem_;
    const Options& options_;
    const RemainingContacts* remaining_;
    Team local_team_;
    Team& team_;
    std::optional<Factor> factor_storage_;
    Factor& factor_;
    const ImpactProblem& p_;
    Vector reaction_, velocity_;
    CachedFactor cached_;
    Indices added_;
    int iterations_ = 0;
    bool canonical_ = false;
};

}  // namespace

Solution solve_contacts(const ImpactProblem& problem, const Options& options) {
    Solution solution;
    if (problem.k == 0) {
        solution.velocity = problem.free;
        return solution;
    }
    if (options.solver != Solver::AUTO || problem.bilateral) return ImpactSolver(problem, options).solve(solution.method);
    const RemainingContacts remaining = solve_single_contacts(problem, solution.reaction, solution.velocity);
    solution.method = remaining.single ? Method::SINGLE_CONTACTS : Method::NOTHING_PRESSES;
    const bool all = int(remaining.contact.size()) == problem.k && int(remaining.disk.size()) == problem.n;
    if (options.with_error_bound && !all) solution.error_bound = bound_of_closed_form(problem, solution.reaction, solution.velocity);
    if (remaining.contact.empty()) return solution;
    ImpactProblem subproblem = restrict_to(problem, remaining.contact, remaining.disk, remaining.index);
    Solution found;
    bool solved = false;
    if (remaining.forest && !problem.dissipative() && !problem.compound()) {
        const Branches branches = branches_of(subproblem);
        found.iterations = solve_tree(subproblem, branches, found.reaction, found.velocity);
        found.method = Method::TREE, found.disks = subproblem.n;
        solved = solution_error(subproblem, found.reaction, found.velocity) <= options.tolerance;
        if (solved && options.with_error_bound) found.error_bound = bound_of_tree(subproblem, branches, found.reaction, found.velocity);
    }
    if (!solved) {
        Options restricted = options;
        if (!options.reaction.empty()) {
            restricted.reaction.resize(subproblem.k);
            for (int c = 0; c < subproblem.k; ++c) restricted.reaction[c] = options.reaction[remaining.contact[c]];
        }
        if (!options.velocity.empty()) {
            restricted.velocity.resize(subproblem.mass.size());
            for (std::size_t i = 0; i < restricted.velocity.size(); ++i)
                restricted.velocity[i] = options.velocity[std::size_t(remaining.disk[i / problem.d]) * problem.d + i % problem.d];
        }
        ImpactSolver solver(subproblem, restricted, &remaining);
        if (!options.full) subproblem = {};  // the solver has its own, in order of elimination
        found = solver.solve(found.method);
    }
    const std::size_t k = remaining.contact.size(), n = remaining.disk.size();
    solution.reaction.insert(solution.reaction.end(), found.reaction.begin() + k, found.reaction.end());
    for (std::size_t c = 0; c < k; ++c) solution.reaction[remaining.contact[c]] = found.reaction[c];
    for (std::size_t i = 0; i < n; ++i)
        for (int a = 0; a < problem.d; ++a) solution.velocity[std::size_t(problem.d) * remaining.disk[i] + a] = found.velocity[problem.d * i + a];
    found.error_bound = length(found.error_bound, solution.error_bound);
    found.reaction = std::move(solution.reaction), found.velocity = std::move(solution.velocity);
    return found;
}

namespace {

// û of a problem from Â û = (M − DᵀKD) u⁻; it is u⁻ without dissipation.
void set_free_velocity(ImpactProblem& problem, const Options& options) {
    Team alone(1);
    Factor factor(problem, alone, options.sizes);
    problem.free = factor.disks_in_input_order(velocity_of(factor, factor.disks_in_elimination_order(free_momentum(problem))));
}

double potential(const ImpactProblem& problem, const Vector& normal_dashpot, In u) {
    Vector total(u.size()), v(problem.k);
    double energy = 0.0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        total[i] = u[i] + problem.left_velocity[i];
        energy += problem.mass[i] * (u[i] - problem.left_velocity[i]) * (u[i] - problem.left_velocity[i]);
    }
    approach(problem, total, v);
    for (int c = 0; c < problem.k; ++c) energy += normal_dashpot[c] * std::max(v[c], 0.0) * std::max(v[c], 0.0);
    sliding(problem, total, v);
    for (int c = 0; c < problem.k; ++c) energy += problem.tangential_dashpot[c] * v[c] * v[c];
    return energy;
}

// C(u⁺ + u⁻) (k) m/s, and how exactly it is known.
struct TotalApproach {
    Vector velocity, uncertainty;
};
TotalApproach total_approach_of(const ImpactProblem& problem, const Solution& found) {
    Vector total(found.velocity.size());
    for (std::size_t i = 0; i < total.size(); ++i) total[i] = found.velocity[i] + problem.left_velocity[i];
    TotalApproach total_approach{Vector(problem.k), Vector(problem.k)};
    approach(problem, total, total_approach.velocity);
    const double speed = std::max(problem.scale, max_abs(found.velocity));
    // n·(Â⁻¹ n) is at most w/(1 + wk), and the distance is known in the norm of Â
    for (int c = 0; c < problem.k; ++c)
        total_approach.uncertainty[c] = std::sqrt(problem.inverse_mass[c] / (1.0 + problem.inverse_mass[c] * problem.normal_dashpot[c])) * found.error_bound + APPROACH_ROUNDING * speed;
    return total_approach;
}

// How far (√kg m/s) the exact u⁺ of the law is from that of the problem with fixed k_n: nothing unless some C(u⁺ + u⁻) is so
// near to 0 that its sign is not known. |u₁ − u₂|_M ≤ |Cᵀr|_M⁻¹ by strong monotonicity, r: what the fixed k_n say wrongly
// of p_n at most.
double dashpot_error(const ImpactProblem& problem, const Vector& normal_dashpot, const Solution& found) {
    const TotalApproach total_approach = total_approach_of(problem, found);
    Vector carried(problem.n, 0.0);
    for (int c = 0; c < problem.k; ++c) {
        const double wrong = std::max((problem.normal_dashpot[c] > 0.0 ? -total_approach.velocity[c] : total_approach.velocity[c]) + total_approach.uncertainty[c], 0.0);
        carried[problem.first[c]] += normal_dashpot[c] * wrong;
        if (problem.second[c] >= 0) carried[problem.second[c]] += normal_dashpot[c] * wrong;
    }
    double square = 0.0;
    for (int i = 0; i < problem.n; ++i) {
        square += carried[i] * carried[i] / problem.mass[problem.d * i];
        if (problem.compound()) square += carried[i] * carried[i] * problem.reach[i] * problem.reach[i] / problem.mass[3 * i + 2];
    }
    return std::sqrt(square);
}

}  // namespace

Solution solve_one_sided(ImpactProblem& problem, const Options& options) {
    if (!problem.dissipative()) return solve_contacts(problem, options);
    const Vector normal_dashpot = problem.normal_dashpot;
    set_free_velocity(problem, options);
    Solution found = solve_contacts(problem, options);
    if (problem.bilateral || max_abs(normal_dashpot) == 0.0) return found;
    Vector u = found.velocity;
    bool full_step = true;  // whether u is what was found
    for (int round = 0; round < ROUNDS; ++round) {
        const Vector clamped = clamped_dashpots(problem, normal_dashpot, u);
        const TotalApproach total_approach = total_approach_of(problem, found);
        bool changed = false;
        // those nearer to 0 than the velocities are known would change sides for ever
        for (int c = 0; c < problem.k; ++c)
            changed = changed || (clamped[c] != problem.normal_dashpot[c] && (!full_step || std::abs(total_approach.velocity[c]) > total_approach.uncertainty[c]));
        if (!changed) break;
        const int rounds = found.rounds + 1;
        problem.normal_dashpot = clamped;
        set_free_velocity(problem, options);
        found = solve_contacts(problem, options);
        found.rounds = rounds;
        // the first velocities with a lower Φ on the way back to those before
        const double potential_before = potential(problem, normal_dashpot, u);
        Vector end = found.velocity;
        full_step = true;
        for (int halving = 0; halving < HALVINGS && !(potential(problem, normal_dashpot, end) < potential_before); ++halving) {
            full_step = false;
            const double fraction = std::ldexp(1.0, -halving - 1);
            for (std::size_t i = 0; i < u.size(); ++i) end[i] = u[i] + fraction * (found.velocity[i] - u[i]);
        }
        if (!full_step && !(potential(problem, normal_dashpot, end) < potential_before)) end = found.velocity, full_step = true;
        u = std::move(end);
    }
    found.error_bound += dashpot_error(problem, normal_dashpot, found);
    return found;
}

}  // namespace nscd
