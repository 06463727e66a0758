#include "friction_solver.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "rounding.hpp"

namespace nscd {

namespace {

// Constants say what they trade. "A to B": changed alone in this range, each of 640 problems (library, frames of LAMMPS at μ 0.1,
// 0.3 and 0.8, lattices that rebound) but 0 to 2 is solved as with it, in 0.95 to 1.2 times the time.
constexpr double PROGRAMME_TOLERANCE = 1e-9;  // accuracy of the convex programme, cost against sets to begin from; 1e-11 to 1e-7
constexpr int PROGRAMME_ROUNDS = 8;        // of Newton's method on its sets, cost against a cheap end; 4 to 16
constexpr double UNDERFLOW_FRACTION = 1e-20;  // an approach of no more than this share of the scale presses nothing: what underflows
constexpr int DASHPOT_ROUNDS = 12;         // choices of the contacts at which k_n acts, a bound of the time; most crowds need three
constexpr int NEWTON_ROUNDS = 6, FINAL_NEWTON_ROUNDS = 2;  // factorisations of Newton's method on sets, and where it ends a path: cost against a cheap end
constexpr int PATH_REPEATS = 4;            // paths about the end of one, with firmer contacts: cost against digits; 2 to 8
constexpr double MIN_COMPLIANCE = 1e-8, SLOW_DECREASE = 0.5;  // firmer by a tenth, down to this, where the error falls to no less than so much of itself
constexpr int ANDERSON_BLOCKS = 10, STEP_ANDERSON_BLOCKS = 40, SWEEPS_PER_BLOCK = 8;  // of sweeps between Anderson's combinations, in a step, pairs in each: cost
                                           // against islands that are left
// Rounds of proximal steps, and pivots of a path from where they stand, early for most and later for the rest: cost against islands
// that are left. Steps of five crowds to 1e-8 take 1.1 times as long with the first and the last alone, 1.3 without the first.
constexpr struct { int rounds, pivots; } PROXIMAL_ROUNDS[] = {{4, 60}, {8, 100}, {16, 150}};
constexpr double PROXIMAL_NOISE = 1e-2;    // of this path, loops against its length; 1e-3 to 1e-1
constexpr double LOCAL_NOISE = 1e-9;       // the same of paths about the end of one; 1e-10 to 1e-8
constexpr int LOCAL_PIVOTS = 300;          // of these, a bound of the time
// The cost of the proximal point method, in pivots: at most (a share of it in each choice of the k_n that act), in a step of a
// moving crowd, from random percussions; less of it beyond FULL_BUDGET_CONTACTS, whose pivots take longer. They bound the time.
constexpr int POINT_PIVOTS = 12'000, DASHPOT_BUDGETS = 4, STEP_POINT_PIVOTS = 1500, RANDOM_START_PIVOTS = 1500;
constexpr double FULL_BUDGET_CONTACTS = 1100.0;
constexpr double NEWTON_ERROR = 1e-5;      // Newton's method is tried nearer than this after some steps: cost; 1e-6 to 1e-4
constexpr int NEWTON_INTERVAL = 4;         // 2 to 8
constexpr int RANDOM_STATES = 256;         // of an island that are tried in one search from random ones, a bound of the time
constexpr double DISTINCT = 1e-6;          // velocities farther apart than this share of their scale are two answers
constexpr std::size_t ENUMERATED_CONTACTS = 4;  // contacts of an island in which every set of states is tried where nothing else served

double max_error(const Vector& errors) { return errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()); }

Indices all_indices(int count) {
    Indices all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
}

// The answer of a part, put into the whole.
void scatter(const Selection& subproblem, const FrictionSolution& restricted, FrictionSolution& full) {
    for (std::size_t c = 0; c < subproblem.contact.size(); ++c) full.reaction[subproblem.contact[c]] = restricted.reaction[c], full.tangential[subproblem.contact[c]] = restricted.tangential[c];
    for (std::size_t i = 0; i < subproblem.disk.size(); ++i) std::copy_n(restricted.velocity.begin() + 3 * i, 3, full.velocity.begin() + 3 * subproblem.disk[i]);
}
FrictionSolution gather(const Selection& subproblem, const FrictionSolution& full) {
    FrictionSolution restricted{Vector(subproblem.contact.size()), Vector(subproblem.contact.size()), Vector(3 * subproblem.disk.size())};
    for (std::size_t c = 0; c < subproblem.contact.size(); ++c) restricted.reaction[c] = full.reaction[subproblem.contact[c]], restricted.tangential[c] = full.tangential[subproblem.contact[c]];
    for (std::size_t i = 0; i < subproblem.disk.size(); ++i) std::copy_n(full.velocity.begin() + 3 * subproblem.disk[i], 3, restricted.velocity.begin() + 3 * i);
    return restricted;
}

// The best answer so far for an island, and the methods that better it.
class IslandSolver {
public:
    IslandSolver(Subproblem& subproblem, double tolerance)
        : p_(subproblem.problem), factor_(subproblem.factor), tolerance_(tolerance), sweeps_(p_), path_(p_, factor_),
          best_{Vector(p_.k, 0.0), Vector(p_.k, 0.0), p_.left_velocity} {}

    const FrictionSolution& best() const { return best_; }
    Method method() const { return solved() ? method_ : Method::NONE; }
    bool solved() const { return error_ <= tolerance_; }
    int sweep_count() const { return sweep_count_; }
    int pivots() const { return path_.pivots; }

    // Keep an answer if it is the best so far; whether one within the tolerance is known.
    bool update_best(const FrictionSolution& iterate, Method method) {
        const double error = error_of(iterate);
        if (error < error_) error_ = error, method_ = method, best_ = iterate;
        return solved();
    }

    // From an answer that is near.
    void solve_from(FrictionSolution iterate, int pivot_budget) {
        if (!by_proximal_newton(iterate)) by_proximal_point(iterate, int(pivot_budget * std::min(1.0, FULL_BUDGET_CONTACTS / p_.k * (FULL_BUDGET_CONTACTS / p_.k))) / (p_.dissipates ? DASHPOT_BUDGETS : 1));
    }

    // From random states and percussions, for an answer that is not among the known ones.
    void solve_from_random(std::uint64_t seed, const std::vector<Vector>& previous) {
        Random random(seed);
        FrictionSolution iterate{Vector(p_.k), Vector(p_.k), p_.left_velocity};
        for (int c = 0; c < p_.k; ++c) {
            iterate.reaction[c] = exponential_of(random.number()) * p_.scale / p_.inverse_mass[c];
            iterate.tangential[c] = p_.friction[c] * iterate.reaction[c] * (2.0 * random.number() - 1.0);
        }
        if (by_random_states(random, iterate, previous)) return;
        sweeps_.accelerated(iterate.reaction, iterate.tangential, iterate.velocity, ANDERSON_BLOCKS, SWEEPS_PER_BLOCK, 0.5 * tolerance_, sweep_count_);
        Vector v(p_.k), s(p_.k);
        contact_velocities(p_, iterate.velocity, v, s);
        for (int c = 0; c < p_.k; ++c) {  // λ and τ of whole percussions
            iterate.reaction[c] -= p_.normal_dashpot[c] * (v[c] + p_.left_approach[c]);
            iterate.tangential[c] -= p_.tangential_dashpot[c] * (s[c] + p_.left_sliding[c]);
        }
        if (!update_best(iterate, Method::GAUSS_SEIDEL)) by_proximal_point(iterate, RANDOM_START_PIVOTS);
    }

    // Proximal steps, and paths from where they stand; `iterate` is left there.
    bool by_proximal_newton(FrictionSolution& iterate) {
        double weight = PROXIMAL_WEIGHT;
        for (const auto [rounds, pivots] : PROXIMAL_ROUNDS) {
            proximal_newton(p_, sweeps_, factor_, iterate, rounds, 0.5 * tolerance_, weight, sweep_count_);
            if (update_best(iterate, Method::PROXIMAL_NEWTON) || by_local_paths(iterate, pivots)) return true;
        }
        return false;
    }

    // Steps of the proximal point method, at the cost of `pivot_budget` pivots.
    bool by_proximal_point(const FrictionSolution& from, int pivot_budget) {
        ProximalPoints points(p_, path_, from);
        for (int step = 0; pivot_budget > 0; pivot_budget -= points.cost) {
            if (!points.step()) continue;
            if (update_best(points.at(), Method::PROXIMAL_POINT)) return true;
            ++step;
            const bool near = error_ < NEWTON_ERROR && step % NEWTON_INTERVAL == 0;
            if ((near || points.pivots == 0) && by_newton(path_.states(), points.at(), 1, Method::PROXIMAL_POINT)) return true;
        }
        return false;
    }

private:
    double error_of(const FrictionSolution& iterate) const { return max_error(island_errors(p_, iterate)); }

    bool by_newton(const States& states, FrictionSolution iterate, int rounds, Method method) {
        newton(p_, factor_, states, iterate, tolerance_, rounds, FRICTION_PENALTY);
        return update_best(iterate, method);
    }

    bool by_local_paths(const FrictionSolution& start, int max_pivots) {
        path_.compliance = PATH_SOFT;
        FrictionSolution iterate = start;
        Path::clean(p_, iterate);
        for (double direction : {-1.0, 1.0}) {
            path_.begin(iterate, PROXIMAL_NOISE * p_.scale, max_pivots);
            const Path::End end = path_.follow(direction, max_pivots);
            if (end == Path::End::ARRIVED) return refine_path();
            if (end != Path::End::AWAY) break;
        }
        return false;
    }

    // From the end of a path, whose contacts are slightly soft, to the rigid answer: Newton's method on its sets, further paths
    // about its percussions, and firmer contacts.
    bool refine_path() {
        double before = INFINITE;
        for (int repeat = 0; repeat < PATH_REPEATS; ++repeat) {
            FrictionSolution iterate = path_.solution();
            const double error = error_of(iterate);
            if (update_best(iterate, Method::PIVOTS) || by_newton(path_.states(), iterate, FINAL_NEWTON_ROUNDS, Method::PIVOTS)) return true;
            // percussions that drift at a constant rate get to the next change of a state sooner
            if (error > SLOW_DECREASE * before && path_.compliance > MIN_COMPLIANCE) path_.compliance *= 0.1;
            before = error;
            into_cones(p_, iterate);
            path_.begin(iterate, LOCAL_NOISE * p_.scale, repeat);
            if (path_.follow(-1.0, LOCAL_PIVOTS) != Path::End::ARRIVED) break;
        }
        return false;
    }

    // One step of Newton's method from each state of a small island, in random order, or all of its steps from some, until an
    // answer is not one of the known.
    bool by_random_states(Random& random, const FrictionSolution& start, const std::vector<Vector>& previous) {
        const bool small = p_.k <= 4 && (1 << 2 * p_.k) <= RANDOM_STATES;
        const int count = small ? 1 << 2 * p_.k : RANDOM_STATES / p_.k / NEWTON_ROUNDS;
        Indices code = all_indices(small ? count : 0);
        for (int a = int(code.size()) - 1; a > 0; --a) std::swap(code[a], code[std::size_t(random.number() * (a + 1))]);
        FrictionSolution again;
        for (int a = 0; a < count; ++a) {
            Mask tangential_state(p_.k);
            for (int c = 0; c < p_.k; ++c) tangential_state[c] = small ? code[a] >> 2 * c & 3 : random.word() >> 62;
            error_ = INFINITE;
            if (!by_newton(States(std::move(tangential_state)), start, small ? 1 : NEWTON_ROUNDS, Method::NEWTON)) continue;
            if (std::all_of(previous.begin(), previous.end(), [&](const Vector& other) { return distinct(best_.velocity, other); })) return true;
            again = best_;
        }
        error_ = INFINITE;
        return !again.reaction.empty() && update_best(again, Method::NEWTON);
    }
    // Whether velocities are two answers: by the energy of their difference.
    bool distinct(const Vector& u, const Vector& other) const {
        double square = 0.0, mass = 0.0;
        for (std::size_t i = 0; i < u.size(); ++i) square += p_.mass[i] * (u[i] - other[i]) * (u[i] - other[i]);
        for (int i = 0; i < p_.n; ++i) mass += p_.mass[3 * i];
        return square > DISTINCT * DISTINCT * p_.scale * p_.scale * mass;
    }

    const FrictionProblem& p_;
    FrictionFactor& factor_;
    double tolerance_;
    Sweeps sweeps_;
    Path path_;
    FrictionSolution best_;
    double error_ = INFINITE;
    Method method_ = Method::NONE;
    int sweep_count_ = 0;
};

// Disks and contacts of the islands that something presses, some C u⁻ > b or dissipation, or of all that have contacts.
Selection pressed_islands(const FrictionProblem& p, bool everything) {
    Mask is(p.islands, 0);
    for (int c = 0; c < p.k; ++c)
        if (everything || p.left_approach[c] > p.max_approach[c] + UNDERFLOW_FRACTION * p.scale || p.normal_dashpot[c] > 0.0 || p.tangential_dashpot[c] > 0.0) is[p.island[p.first[c]]] = 1;
    Selection some;
    for (int i = 0; i < p.n; ++i)
        if (is[p.island[i]]) some.disk.push_back(i);
    for (int c = 0; c < p.k; ++c)
        if (is[p.island[p.first[c]]]) some.contact.push_back(c);
    return some;
}

// The islands of a part whose errors are too large, each with its disks and contacts, in their numbers there.
template <class Visit>
void for_islands(const FrictionProblem& p, const Vector& errors, double tolerance, Visit&& visit) {
    for (int island = 0; island < p.islands; ++island) {
        if (errors[island] <= tolerance) continue;
        Indices disk, contact;
        for (int i = 0; i < p.n; ++i)
            if (p.island[i] == island) disk.push_back(i);
        for (int c = 0; c < p.k; ++c)
            if (p.island[p.first[c]] == island) contact.push_back(c);
        visit(disk, contact);
    }
}

// Answers of all islands by the convex programme and Newton's method, in `iterate`; their errors. `warm_start`: the programme's.
Vector solve_batch(Subproblem& subproblem, double tolerance, FrictionSolution& iterate, FrictionSolution& warm_start) {
    const FrictionProblem& p = subproblem.problem;
    iterate = warm_start = convex_programme(p, subproblem.factor, PROGRAMME_TOLERANCE);
    return newton(p, subproblem.factor, states_of(p, iterate), iterate, tolerance, PROGRAMME_ROUNDS, FRICTION_PENALTY);
}

// Where a search begins: at the answer of the convex programme; by sweeps from percussions at hand (k, or none); or, with a
// seed ≥ 1, at random, for an answer other than the known ones.
struct Start {
    int seed = 0, pivot_budget = POINT_PIVOTS;
    bool by_sweeps = false;
    In reaction{}, tangential{};
    std::span<const Vector> previous{};
};

// With a seed every island is searched, also where nothing presses: u⁻ need not be the only answer there.
FrictionResult solve_islands(const FrictionProblem& p, double tolerance, const Start& start) {
    FrictionResult solution{{Vector(p.k, 0.0), Vector(p.k, 0.0), p.left_velocity}};
    Selection some = pressed_islands(p, start.seed > 0);
    if (some.contact.empty()) return solution;
    std::optional<Subproblem> subproblem;  // sweeps need no factor
    if (!start.by_sweeps) some = subproblem.emplace(p, some.disk, some.contact);
    const FrictionProblem q = subproblem ? subproblem->problem : restrict_to(p, some.contact, some.disk);
    FrictionSolution iterate{Vector(q.k, 0.0), Vector(q.k, 0.0), q.left_velocity}, warm_start = iterate;
    Vector errors(q.islands, INFINITE);
    solution.method = start.by_sweeps ? Method::GAUSS_SEIDEL : Method::NEWTON, solution.seed = start.seed;
    if (start.by_sweeps) {
        for (int c = 0; c < q.k && !start.reaction.empty(); ++c) iterate.reaction[c] = start.reaction[some.contact[c]], iterate.tangential[c] = start.tangential[some.contact[c]];
        Sweeps(q).accelerated(iterate.reaction, iterate.tangential, iterate.velocity, STEP_ANDERSON_BLOCKS, SWEEPS_PER_BLOCK, 0.5 * tolerance, solution.sweep_count);
        errors = island_errors(q, warm_start = iterate);
    } else if (start.seed == 0) {
        errors = solve_batch(*subproblem, tolerance, iterate, warm_start);
    }
    for_islands(q, errors, tolerance, [&](const Indices& disk, const Indices& contact) {
        Subproblem one(q, disk, contact);
        IslandSolver search(one, tolerance);
        if (start.seed > 0) {
            std::vector<Vector> there;
            for (const Vector& velocity : start.previous) {
                Vector u(3 * disk.size());
                for (std::size_t i = 0; i < one.disk.size(); ++i) std::copy_n(velocity.begin() + 3 * some.disk[one.disk[i]], 3, u.begin() + 3 * i);
                there.push_back(std::move(u));
            }
            search.solve_from_random(start.seed, there);
        } else {
            search.update_best(gather(one, iterate), solution.method);
            search.solve_from(gather(one, warm_start), start.pivot_budget);
        }
        scatter(one, search.best(), iterate);
        solution.sweep_count += search.sweep_count(), solution.pivots += search.pivots();
        solution.method = std::max(solution.method, search.method());
    });
    scatter(some, iterate, solution.solution);
    return solution;
}

// An answer of islands of few contacts that are not solved, k_n acting where it pushes: every set of states is tried.
void try_every_state(const FrictionProblem& p, double tolerance, FrictionResult& solution) {
    FrictionProblem clamped = p;
    clamp_dashpots(clamped, p.normal_dashpot, solution.solution.velocity);
    for_islands(p, island_errors(clamped, solution.solution), tolerance, [&](const Indices& disk, const Indices& contact) {
        if (contact.size() > ENUMERATED_CONTACTS) return;
        Subproblem one(p, disk, contact);
        FrictionProblem& q = one.problem;
        const Vector normal_dashpot = q.normal_dashpot;
        // a contact is free, or it is held in one of three ways: where closed, where k_n acts, or where both are
        int count = 1;
        for (double k : normal_dashpot) count *= k == 0.0 ? 4 : 10;
        for (int code = 0; code < count; ++code) {
            States states(q.k);
            for (int c = 0, remaining = code; c < q.k; remaining /= normal_dashpot[c] == 0.0 ? 4 : 10, ++c) {
                const int choice = remaining % (normal_dashpot[c] == 0.0 ? 4 : 10);
                states.tangential_state[c] = choice == 0 ? FREE : 1 + (choice - 1) % 3;
                states.closed[c] = choice > 0 && choice < 7;
                q.normal_dashpot[c] = choice > 3 ? normal_dashpot[c] : 0.0;
            }
            FrictionSolution trial{Vector(q.k, 0.0), Vector(q.k, 0.0), q.left_velocity};
            newton(q, one.factor, states, trial, tolerance, 1, FRICTION_PENALTY);
            clamp_dashpots(q, normal_dashpot, trial.velocity);
            if (max_error(island_errors(q, trial)) > tolerance) continue;
            scatter(one, trial, solution.solution);
            if (solution.method == Method::NONE) solution.method = Method::NEWTON;
            return;
        }
    });
}

// The answer with the k_n that push: found in rounds, the best met. `p` has these k_n only where this is the last round.
FrictionResult solve_dashpots(const FrictionProblem& p, double tolerance, const Start& start) {
    FrictionProblem clamped = p;
    FrictionResult best;
    for (int round = 0; round < DASHPOT_ROUNDS; ++round) {
        FrictionResult found = solve_islands(clamped, tolerance, start);
        const bool changed = clamp_dashpots(clamped, p.normal_dashpot, found.solution.velocity);
        found.error = max_error(island_errors(clamped, found.solution));
        if (round == 0 || found.error < best.error) best = std::move(found);
        if (best.error <= tolerance || !changed) break;
    }
    if (best.error > tolerance) {
        try_every_state(p, tolerance, best);
        clamp_dashpots(clamped, p.normal_dashpot, best.solution.velocity);
        best.error = max_error(island_errors(clamped, best.solution));
    }
    return best;
}

// Whole percussions taken `factor` times, of each island: λ and τ, and the velocities that they give.
FrictionSolution scale_percussions(const FrictionSolution& iterate, const FrictionProblem& p, const Vector& factor) {
    FrictionSolution scaled = iterate;
    Vector v(p.k), s(p.k), pn(p.k), pt(p.k);
    contact_velocities(p, iterate.velocity, v, s);
    for (int c = 0; c < p.k; ++c) {
        const double scale = factor[p.island[p.first[c]]];
        pn[c] = scale == 0.0 ? 0.0 : scale * normal_push(p, c, v[c], iterate.reaction[c]);
        pt[c] = scale == 0.0 ? 0.0 : scale * (p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]) + iterate.tangential[c]);
    }
    equilibrium_velocity(p, pn, pt, scaled.velocity);
    contact_velocities(p, scaled.velocity, v, s);
    for (int c = 0; c < p.k; ++c) {
        scaled.reaction[c] = pn[c] - p.normal_dashpot[c] * (v[c] + p.left_approach[c]);
        scaled.tangential[c] = pt[c] - p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]);
    }
    return scaled;
}

// An answer of islands that are not solved gains no energy: their percussions are taken θ times, by which the energy changes
// by ½θ² p·DM⁻¹Dᵀp − θ p·Du⁻; none of them, where that is nearer to an answer.
void clamp_energy(const FrictionProblem& p, double tolerance, FrictionSolution& solution) {
    const Vector errors = island_errors(p, solution);
    Vector energy_gain(p.islands, 0.0), square(p.islands, 0.0), factor(p.islands, 1.0);
    const FrictionSolution current = scale_percussions(solution, p, factor);
    for (std::size_t i = 0; i < current.velocity.size(); ++i) {
        const double change = current.velocity[i] - p.left_velocity[i];
        square[p.island[i / 3]] += p.mass[i] * change * change;
        energy_gain[p.island[i / 3]] += p.mass[i] * change * (current.velocity[i] + p.left_velocity[i]);
    }
    bool any = false;
    for (int m = 0; m < p.islands; ++m) {
        if (errors[m] <= tolerance || energy_gain[m] <= 0.0) continue;
        factor[m] = square[m] < INFINITE ? std::max(1.0 - energy_gain[m] / square[m], 0.0) : 0.0;
        any = true;
    }
    if (!any) return;
    const FrictionSolution zero = scale_percussions(solution, p, Vector(p.islands, 0.0));
    FrictionSolution scaled = scale_percussions(solution, p, factor);
    const Vector scaled_errors = island_errors(p, scaled), zero_errors = island_errors(p, zero);
    for (int c = 0; c < p.k; ++c) {
        const Index m = p.island[p.first[c]];
        if (factor[m] == 1.0) continue;
        const FrictionSolution& from = scaled_errors[m] <= zero_errors[m] ? scaled : zero;
        solution.reaction[c] = from.reaction[c], solution.tangential[c] = from.tangential[c];
    }
    for (int i = 0; i < p.n; ++i) {
        const Index m = p.island[i];
        if (factor[m] != 1.0) std::copy_n((scaled_errors[m] <= zero_errors[m] ? scaled : zero).velocity.begin() + 3 * i, 3, solution.velocity.begin() + 3 * i);
    }
}

}  // namespace

FrictionResult solve_friction(FrictionProblem& p, const FrictionOptions& options) {
    const Vector normal_dashpot = p.normal_dashpot;
    const double tolerance = options.tolerance, target_tolerance = 0.9 * tolerance;
    FrictionResult best = solve_dashpots(p, target_tolerance, {.pivot_budget = options.in_step ? 0 : POINT_PIVOTS, .by_sweeps = options.in_step, .reaction = options.reaction, .tangential = options.tangential});
    if (options.in_step && best.error > tolerance) {
        FrictionResult other = solve_dashpots(p, target_tolerance, {.pivot_budget = STEP_POINT_PIVOTS});
        other.sweep_count += best.sweep_count, other.pivots += best.pivots;
        if (other.error < best.error) best = std::move(other);
    }
    std::vector<Vector> velocities{best.solution.velocity};
    for (int seed = 1; seed < options.starts; ++seed) {
        const FrictionResult other = solve_dashpots(p, target_tolerance, {.seed = seed, .previous = velocities});
        FrictionProblem clamped = p;
        clamp_dashpots(clamped, normal_dashpot, other.solution.velocity);
        const Vector errors = island_errors(clamped, other.solution);
        Vector u = best.solution.velocity;
        bool any = false;
        Mask touched(p.islands, 0);
        for (int c = 0; c < p.k; ++c) touched[p.island[p.first[c]]] = 1;
        for (int i = 0; i < p.n; ++i) {
            if (!(errors[p.island[i]] <= tolerance)) continue;
            any = any || touched[p.island[i]];
            std::copy_n(other.solution.velocity.begin() + 3 * i, 3, u.begin() + 3 * i);
        }
        if (any) velocities.push_back(std::move(u));
    }
    if (velocities.size() > 1) {
        best.spread = 0.0;
        for (std::size_t i = 0; i < p.left_velocity.size(); ++i) {
            double minimum = INFINITE, maximum = -INFINITE;
            for (const Vector& u : velocities) minimum = std::min(minimum, u[i]), maximum = std::max(maximum, u[i]);
            best.spread = std::max(best.spread, (maximum - minimum) * (i % 3 == 2 ? options.radius[i / 3] : 1.0));
        }
    }
    clamp_dashpots(p, normal_dashpot, best.solution.velocity);
    if (!(best.error <= tolerance)) {
        best.method = Method::NONE;
        if (!options.in_step) clamp_energy(p, tolerance, best.solution);
    }
    return best;
}

FrictionResult solve_friction_by(const FrictionProblem& p, FrictionMethod method, double tolerance, int pivot_budget) {
    Subproblem subproblem(p, all_indices(p.n), all_indices(p.k));
    IslandSolver search(subproblem, tolerance);
    FrictionSolution iterate{Vector(p.k, 0.0), Vector(p.k, 0.0), subproblem.problem.left_velocity};
    if (method == FrictionMethod::PROXIMAL_NEWTON) search.by_proximal_newton(iterate);
    else if (method == FrictionMethod::PROXIMAL_POINT) search.by_proximal_point(iterate, pivot_budget);
    else search.solve_from_random(3, {});
    FrictionResult solution{{Vector(p.k, 0.0), Vector(p.k, 0.0), p.left_velocity}, search.method(), 0, search.sweep_count(), search.pivots()};
    scatter(subproblem, search.best(), solution.solution);
    return solution;
}

}  // namespace nscd
