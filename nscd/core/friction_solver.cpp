#include "friction_solver.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "rounding.hpp"

namespace nscd {

namespace {

// Constants say what they trade. "A to B": changed alone in this range, each of 640 problems (library, frames of LAMMPS at μ 0.1,
// 0.3 and 0.8, lattices that rebound) but 0 to 2 is solved as with it, in 0.95 to 1.2 times the time.
constexpr double PROGRAMME = 1e-9;         // accuracy of the convex programme, cost against sets to begin from; 1e-11 to 1e-7
constexpr int PROGRAMME_ROUNDS = 8;        // of Newton's method on its sets, cost against a cheap end; 4 to 16
constexpr double NOTHING = 1e-20;          // an approach of no more than this share of the scale presses nothing: what underflows
constexpr int ROUNDS = 12;                 // choices of the contacts at which k_n acts, a bound of the time; most crowds need three
constexpr int NEWTON = 6, FINISH = 2;      // factorisations of Newton's method on sets, and where it ends a path: cost against a cheap end
constexpr int REPEATS = 4;                 // paths about the end of one, with firmer contacts: cost against digits; 2 to 8
constexpr double FIRMEST = 1e-8, SLOW = 0.5;  // firmer by a tenth, down to this, where the error falls to no less than SLOW of itself
constexpr int BLOCKS = 10, STEP_BLOCKS = 40, BLOCK = 8;  // of sweeps between Anderson's combinations, in a step, pairs in each: cost
                                           // against islands that are left
// Rounds of proximal steps, and pivots of a path from where they stand: early for most, later for the rest; cost against islands
// that are left. Rounds 4 to 8 and 8 to 32, pivots 60 to 150 and 75 to 300.
constexpr struct { int rounds, pivots; } PROXIMAL[] = {{4, 60}, {16, 150}};
constexpr double PROXIMAL_NOISE = 1e-2;    // of this path, loops against its length; 1e-3 to 1e-1
constexpr double BRINK = 1e-9;             // the same of paths about the end of one; 1e-10 to 1e-8
constexpr int LOCAL_PIVOTS = 300;          // of these, a bound of the time
// The cost of the proximal point method, in pivots: at most (a share of it in each choice of the k_n that act), in a step of a
// moving crowd, from random percussions; less of it beyond MEDIUM contacts, whose pivots take longer. They bound the time.
constexpr int POINT = 12'000, SEVERAL = 4, STEP_POINT = 1500, RANDOM = 1500;
constexpr double MEDIUM = 1100.0;
constexpr double NEAR_POINT = 1e-5;        // Newton's method is tried nearer than this after SOME steps: cost; 1e-6 to 1e-4
constexpr int SOME = 4;                    // 2 to 8
constexpr int STATES = 256;                // of an island that are tried in one search from random ones, a bound of the time
constexpr double APART = 1e-6;             // velocities farther apart than this share of their scale are two answers
constexpr std::size_t FEW = 4;             // contacts of an island in which every set of states is tried where nothing else served

double worst(const Vector& errors) { return errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()); }

Indices every(int count) {
    Indices all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
}

// The answer of a part, put into the whole.
void scatter(const Selection& subproblem, const FrictionSolution& restricted, FrictionSolution& full) {
    for (std::size_t c = 0; c < subproblem.contact.size(); ++c) full.lam[subproblem.contact[c]] = restricted.lam[c], full.tau[subproblem.contact[c]] = restricted.tau[c];
    for (std::size_t i = 0; i < subproblem.disk.size(); ++i) std::copy_n(restricted.u.begin() + 3 * i, 3, full.u.begin() + 3 * subproblem.disk[i]);
}
FrictionSolution gather(const Selection& subproblem, const FrictionSolution& full) {
    FrictionSolution restricted{Vector(subproblem.contact.size()), Vector(subproblem.contact.size()), Vector(3 * subproblem.disk.size())};
    for (std::size_t c = 0; c < subproblem.contact.size(); ++c) restricted.lam[c] = full.lam[subproblem.contact[c]], restricted.tau[c] = full.tau[subproblem.contact[c]];
    for (std::size_t i = 0; i < subproblem.disk.size(); ++i) std::copy_n(full.u.begin() + 3 * subproblem.disk[i], 3, restricted.u.begin() + 3 * i);
    return restricted;
}

// The best answer so far for an island, and the methods that better it.
class IslandSolver {
public:
    IslandSolver(Subproblem& subproblem, double tolerance)
        : p_(subproblem.problem), factor_(subproblem.factor), tolerance_(tolerance), sweeps_(p_), path_(p_, factor_),
          best_{Vector(p_.k, 0.0), Vector(p_.k, 0.0), p_.left} {}

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
    void run(FrictionSolution iterate, int pivots) {
        if (!by_proximal(iterate)) by_point(iterate, int(pivots * std::min(1.0, MEDIUM / p_.k * (MEDIUM / p_.k))) / (p_.dissipates ? SEVERAL : 1));
    }

    // From random states and percussions, for an answer that is not among the known ones.
    void run_from(std::uint64_t seed, const std::vector<Vector>& previous) {
        Random random(seed);
        FrictionSolution iterate{Vector(p_.k), Vector(p_.k), p_.left};
        for (int c = 0; c < p_.k; ++c) {
            iterate.lam[c] = exponential_of(random.number()) * p_.scale / p_.inverse_mass[c];
            iterate.tau[c] = p_.friction[c] * iterate.lam[c] * (2.0 * random.number() - 1.0);
        }
        if (by_random_states(random, iterate, previous)) return;
        sweeps_.accelerated(iterate.lam, iterate.tau, iterate.u, BLOCKS, BLOCK, 0.5 * tolerance_, sweep_count_);
        Vector v(p_.k), s(p_.k);
        contact_velocities(p_, iterate.u, v, s);
        for (int c = 0; c < p_.k; ++c) {  // λ and τ of whole percussions
            iterate.lam[c] -= p_.along[c] * (v[c] + p_.left_v[c]);
            iterate.tau[c] -= p_.across[c] * (s[c] + p_.left_s[c]);
        }
        if (!update_best(iterate, Method::SWEEPS)) by_point(iterate, RANDOM);
    }

    // Proximal steps, and paths from where they stand; `iterate` is left there.
    bool by_proximal(FrictionSolution& iterate) {
        for (const auto [rounds, pivots] : PROXIMAL) {
            proximal_newton(p_, sweeps_, factor_, iterate, rounds, 0.5 * tolerance_, sweep_count_);
            if (update_best(iterate, Method::PROXIMAL) || locally(iterate, pivots)) return true;
        }
        return false;
    }

    // Steps of the proximal point method, at the cost of `budget` pivots.
    bool by_point(const FrictionSolution& from, int pivot_budget) {
        ProximalPoints points(p_, path_, from);
        for (int step = 0; pivot_budget > 0; pivot_budget -= points.cost) {
            if (!points.step()) continue;
            if (update_best(points.at(), Method::PROXIMAL_POINT)) return true;
            ++step;
            const bool settled = error_ < NEAR_POINT && step % SOME == 0;
            if ((settled || points.pivots == 0) && by_newton(path_.states(), points.at(), 1, Method::PROXIMAL_POINT)) return true;
        }
        return false;
    }

private:
    double error_of(const FrictionSolution& iterate) const { return worst(measure(p_, iterate)); }

    bool by_newton(const States& states, FrictionSolution iterate, int rounds, Method method) {
        newton(p_, factor_, states, iterate, tolerance_, rounds, FRICTION_PENALTY);
        return update_best(iterate, method);
    }

    bool locally(const FrictionSolution& start, int max_pivots) {
        path_.compliance = PATH_SOFT;
        FrictionSolution iterate = start;
        Path::clean(p_, iterate);
        for (double direction : {-1.0, 1.0}) {
            path_.begin(iterate, PROXIMAL_NOISE * p_.scale, max_pivots);
            const Path::End end = path_.follow(direction, max_pivots);
            if (end == Path::End::ARRIVED) return finish();
            if (end != Path::End::AWAY) break;
        }
        return false;
    }

    // From the end of a path, whose contacts are slightly soft, to the rigid answer: Newton's method on its sets, further paths
    // about its percussions, and firmer contacts.
    bool finish() {
        double before = INFINITE;
        for (int repeat = 0; repeat < REPEATS; ++repeat) {
            FrictionSolution iterate = path_.solution();
            const double error = error_of(iterate);
            if (update_best(iterate, Method::PATH) || by_newton(path_.states(), iterate, FINISH, Method::PATH)) return true;
            // percussions that drift at a constant rate get to the next change of a state sooner
            if (error > SLOW * before && path_.compliance > FIRMEST) path_.compliance *= 0.1;
            before = error;
            into_cones(p_, iterate);
            path_.begin(iterate, BRINK * p_.scale, repeat);
            if (path_.follow(-1.0, LOCAL_PIVOTS) != Path::End::ARRIVED) break;
        }
        return false;
    }

    // One step of Newton's method from each state of a small island, in random order, or all of its steps from some, until an
    // answer is not one of the known.
    bool by_random_states(Random& random, const FrictionSolution& start, const std::vector<Vector>& previous) {
        const bool small = p_.k <= 4 && (1 << 2 * p_.k) <= STATES;
        const int count = small ? 1 << 2 * p_.k : STATES / p_.k / NEWTON;
        Indices code = every(small ? count : 0);
        for (int a = int(code.size()) - 1; a > 0; --a) std::swap(code[a], code[std::size_t(random.number() * (a + 1))]);
        FrictionSolution again;
        for (int a = 0; a < count; ++a) {
            Mask tangential_state(p_.k);
            for (int c = 0; c < p_.k; ++c) tangential_state[c] = small ? code[a] >> 2 * c & 3 : random.word() >> 62;
            error_ = INFINITE;
            if (!by_newton(States(std::move(tangential_state)), start, small ? 1 : NEWTON, Method::SETS)) continue;
            if (std::all_of(previous.begin(), previous.end(), [&](const Vector& other) { return distinct(best_.u, other); })) return true;
            again = best_;
        }
        error_ = INFINITE;
        return !again.lam.empty() && update_best(again, Method::SETS);
    }
    // Whether velocities are two answers: by the energy of their difference.
    bool distinct(const Vector& u, const Vector& other) const {
        double square = 0.0, mass = 0.0;
        for (std::size_t i = 0; i < u.size(); ++i) square += p_.mass[i] * (u[i] - other[i]) * (u[i] - other[i]);
        for (int i = 0; i < p_.n; ++i) mass += p_.mass[3 * i];
        return square > APART * APART * p_.scale * p_.scale * mass;
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
Selection pressed(const FrictionProblem& p, bool everything) {
    Mask is(p.islands, 0);
    for (int c = 0; c < p.k; ++c)
        if (everything || p.left_v[c] > p.offset[c] + NOTHING * p.scale || p.along[c] > 0.0 || p.across[c] > 0.0) is[p.island[p.first[c]]] = 1;
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
    iterate = warm_start = convex_programme(p, subproblem.factor, PROGRAMME);
    return newton(p, subproblem.factor, states_of(p, iterate), iterate, tolerance, PROGRAMME_ROUNDS, FRICTION_PENALTY);
}

// Where a search begins: at the answer of the convex programme; by sweeps from percussions at hand (k, or none); or, with a
// seed ≥ 1, at random, for an answer other than the known ones.
struct Start {
    int seed = 0, pivots = POINT;
    bool by_sweeps = false;
    In lam{}, tau{};
    std::span<const Vector> previous{};
};

// With a seed every island is searched, also where nothing presses: u⁻ need not be the only answer there.
FrictionResult solve_islands(const FrictionProblem& p, double tolerance, const Start& start) {
    FrictionResult solution{{Vector(p.k, 0.0), Vector(p.k, 0.0), p.left}};
    Selection some = pressed(p, start.seed > 0);
    if (some.contact.empty()) return solution;
    std::optional<Subproblem> subproblem;  // sweeps need no factor
    if (!start.by_sweeps) some = subproblem.emplace(p, some.disk, some.contact);
    const FrictionProblem q = subproblem ? subproblem->problem : chosen(p, some.contact, some.disk);
    FrictionSolution iterate{Vector(q.k, 0.0), Vector(q.k, 0.0), q.left}, warm_start = iterate;
    Vector errors(q.islands, INFINITE);
    solution.method = start.by_sweeps ? Method::SWEEPS : Method::SETS, solution.seed = start.seed;
    if (start.by_sweeps) {
        for (int c = 0; c < q.k && !start.lam.empty(); ++c) iterate.lam[c] = start.lam[some.contact[c]], iterate.tau[c] = start.tau[some.contact[c]];
        Sweeps(q).accelerated(iterate.lam, iterate.tau, iterate.u, STEP_BLOCKS, BLOCK, 0.5 * tolerance, solution.sweep_count);
        errors = measure(q, warm_start = iterate);
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
            search.run_from(start.seed, there);
        } else {
            search.update_best(gather(one, iterate), solution.method);
            search.run(gather(one, warm_start), start.pivots);
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
    clamp_dashpots(clamped, p.along, solution.solution.u);
    for_islands(p, measure(clamped, solution.solution), tolerance, [&](const Indices& disk, const Indices& contact) {
        if (contact.size() > FEW) return;
        Subproblem one(p, disk, contact);
        FrictionProblem& q = one.problem;
        const Vector along = q.along;
        // a contact is free, or it is held in one of three ways: where closed, where k_n acts, or where both are
        int count = 1;
        for (double k : along) count *= k == 0.0 ? 4 : 10;
        for (int code = 0; code < count; ++code) {
            States states(q.k);
            for (int c = 0, left = code; c < q.k; left /= along[c] == 0.0 ? 4 : 10, ++c) {
                const int choice = left % (along[c] == 0.0 ? 4 : 10);
                states.tangential_state[c] = choice == 0 ? FREE : 1 + (choice - 1) % 3;
                states.closed[c] = choice > 0 && choice < 7;
                q.along[c] = choice > 3 ? along[c] : 0.0;
            }
            FrictionSolution trial{Vector(q.k, 0.0), Vector(q.k, 0.0), q.left};
            newton(q, one.factor, states, trial, tolerance, 1, FRICTION_PENALTY);
            clamp_dashpots(q, along, trial.u);
            if (worst(measure(q, trial)) > tolerance) continue;
            scatter(one, trial, solution.solution);
            if (solution.method == Method::NONE) solution.method = Method::SETS;
            return;
        }
    });
}

// The answer with the k_n that push: found in rounds, the best met. `p` has these k_n only where this is the last round.
FrictionResult one_sided(const FrictionProblem& p, double tolerance, const Start& start) {
    FrictionProblem linear = p;
    FrictionResult best;
    for (int round = 0; round < ROUNDS; ++round) {
        FrictionResult found = solve_islands(linear, tolerance, start);
        const bool changed = clamp_dashpots(linear, p.along, found.solution.u);
        found.error = worst(measure(linear, found.solution));
        if (round == 0 || found.error < best.error) best = std::move(found);
        if (best.error <= tolerance || !changed) break;
    }
    if (best.error > tolerance) {
        try_every_state(p, tolerance, best);
        clamp_dashpots(linear, p.along, best.solution.u);
        best.error = worst(measure(linear, best.solution));
    }
    return best;
}

// Whole percussions taken `factor` times, of each island: λ and τ, and the velocities that they give.
FrictionSolution scaled(const FrictionSolution& iterate, const FrictionProblem& p, const Vector& factor) {
    FrictionSolution less = iterate;
    Vector v(p.k), s(p.k), pn(p.k), pt(p.k);
    contact_velocities(p, iterate.u, v, s);
    for (int c = 0; c < p.k; ++c) {
        const double scale = factor[p.island[p.first[c]]];
        pn[c] = scale == 0.0 ? 0.0 : scale * normal_push(p, c, v[c], iterate.lam[c]);
        pt[c] = scale == 0.0 ? 0.0 : scale * (p.across[c] * (s[c] + p.left_s[c]) + iterate.tau[c]);
    }
    equilibrium_velocity(p, pn, pt, less.u);
    contact_velocities(p, less.u, v, s);
    for (int c = 0; c < p.k; ++c) {
        less.lam[c] = pn[c] - p.along[c] * (v[c] + p.left_v[c]);
        less.tau[c] = pt[c] - p.across[c] * (s[c] + p.left_s[c]);
    }
    return less;
}

// An answer of islands that are not solved gains no energy: their percussions are taken θ times, by which the energy changes
// by ½θ² p·DM⁻¹Dᵀp − θ p·Du⁻; none of them, where that is nearer to an answer.
void clamp_energy(const FrictionProblem& p, double tolerance, FrictionSolution& solution) {
    const Vector errors = measure(p, solution);
    Vector gained(p.islands, 0.0), square(p.islands, 0.0), factor(p.islands, 1.0);
    const FrictionSolution current = scaled(solution, p, factor);
    for (std::size_t i = 0; i < current.u.size(); ++i) {
        const double change = current.u[i] - p.left[i];
        square[p.island[i / 3]] += p.mass[i] * change * change;
        gained[p.island[i / 3]] += p.mass[i] * change * (current.u[i] + p.left[i]);
    }
    bool any = false;
    for (int m = 0; m < p.islands; ++m) {
        if (errors[m] <= tolerance || gained[m] <= 0.0) continue;
        factor[m] = square[m] < INFINITE ? std::max(1.0 - gained[m] / square[m], 0.0) : 0.0;
        any = true;
    }
    if (!any) return;
    const FrictionSolution none = scaled(solution, p, Vector(p.islands, 0.0));
    FrictionSolution less = scaled(solution, p, factor);
    const Vector one = measure(p, less), two = measure(p, none);
    for (int c = 0; c < p.k; ++c) {
        const Index m = p.island[p.first[c]];
        if (factor[m] == 1.0) continue;
        const FrictionSolution& from = one[m] <= two[m] ? less : none;
        solution.lam[c] = from.lam[c], solution.tau[c] = from.tau[c];
    }
    for (int i = 0; i < p.n; ++i) {
        const Index m = p.island[i];
        if (factor[m] != 1.0) std::copy_n((one[m] <= two[m] ? less : none).u.begin() + 3 * i, 3, solution.u.begin() + 3 * i);
    }
}

}  // namespace

FrictionResult solve_friction(FrictionProblem& p, const FrictionAsked& options) {
    const Vector along = p.along;
    const double tolerance = options.tolerance, aim = 0.9 * tolerance;
    FrictionResult best = one_sided(p, aim, {.pivots = options.in_step ? 0 : POINT, .by_sweeps = options.in_step, .lam = options.lam, .tau = options.tau});
    if (options.in_step && best.error > tolerance) {
        FrictionResult other = one_sided(p, aim, {.pivots = STEP_POINT});
        other.sweep_count += best.sweep_count, other.pivots += best.pivots;
        if (other.error < best.error) best = std::move(other);
    }
    std::vector<Vector> velocities{best.solution.u};
    for (int seed = 1; seed < options.starts; ++seed) {
        const FrictionResult other = one_sided(p, aim, {.seed = seed, .previous = velocities});
        FrictionProblem clamped = p;
        clamp_dashpots(clamped, along, other.solution.u);
        const Vector errors = measure(clamped, other.solution);
        Vector u = best.solution.u;
        bool any = false;
        Mask touched(p.islands, 0);
        for (int c = 0; c < p.k; ++c) touched[p.island[p.first[c]]] = 1;
        for (int i = 0; i < p.n; ++i) {
            if (!(errors[p.island[i]] <= tolerance)) continue;
            any = any || touched[p.island[i]];
            std::copy_n(other.solution.u.begin() + 3 * i, 3, u.begin() + 3 * i);
        }
        if (any) velocities.push_back(std::move(u));
    }
    if (velocities.size() > 1) {
        best.spread = 0.0;
        for (std::size_t i = 0; i < p.left.size(); ++i) {
            double minimum = INFINITE, maximum = -INFINITE;
            for (const Vector& u : velocities) minimum = std::min(minimum, u[i]), maximum = std::max(maximum, u[i]);
            best.spread = std::max(best.spread, (maximum - minimum) * (i % 3 == 2 ? options.radius[i / 3] : 1.0));
        }
    }
    clamp_dashpots(p, along, best.solution.u);
    if (!(best.error <= tolerance)) {
        best.method = Method::NONE;
        if (!options.in_step) clamp_energy(p, tolerance, best.solution);
    }
    return best;
}

FrictionResult solve_friction_by(const FrictionProblem& p, FrictionMethod method, double tolerance, int pivot_budget) {
    Subproblem subproblem(p, every(p.n), every(p.k));
    IslandSolver search(subproblem, tolerance);
    FrictionSolution iterate{Vector(p.k, 0.0), Vector(p.k, 0.0), subproblem.problem.left};
    if (method == FrictionMethod::PROXIMAL) search.by_proximal(iterate);
    else if (method == FrictionMethod::POINT) search.by_point(iterate, pivot_budget);
    else search.run_from(3, {});
    FrictionResult solution{{Vector(p.k, 0.0), Vector(p.k, 0.0), p.left}, search.method(), 0, search.sweep_count(), search.pivots()};
    scatter(subproblem, search.best(), solution.solution);
    return solution;
}

}  // namespace nscd
