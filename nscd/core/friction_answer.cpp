#include "friction_answer.hpp"

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
constexpr int PROXIMAL = 16;               // rounds of proximal steps, cost against islands that are left; 8 to 32
constexpr int PROXIMAL_PIVOTS = 150;       // of a path from where they stand, the same; 75 to 300
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

double worst(const Numbers& errors) { return errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()); }

Places every(int count) {
    Places all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
}

// The answer of a part, put into the whole.
void put(const Selection& part, const Rubbed& at, Rubbed& whole) {
    for (std::size_t c = 0; c < part.contact.size(); ++c) whole.lam[part.contact[c]] = at.lam[c], whole.tau[part.contact[c]] = at.tau[c];
    for (std::size_t i = 0; i < part.disk.size(); ++i) std::copy_n(at.u.begin() + 3 * i, 3, whole.u.begin() + 3 * part.disk[i]);
}
Rubbed taken(const Selection& part, const Rubbed& whole) {
    Rubbed at{Numbers(part.contact.size()), Numbers(part.contact.size()), Numbers(3 * part.disk.size())};
    for (std::size_t c = 0; c < part.contact.size(); ++c) at.lam[c] = whole.lam[part.contact[c]], at.tau[c] = whole.tau[part.contact[c]];
    for (std::size_t i = 0; i < part.disk.size(); ++i) std::copy_n(whole.u.begin() + 3 * part.disk[i], 3, at.u.begin() + 3 * i);
    return at;
}

// The best answer so far for an island, and the methods that better it.
class Search {
public:
    Search(Part& part, double tolerance)
        : p_(part.problem), factor_(part.factor), tolerance_(tolerance), sweeps_(p_), path_(p_, factor_),
          best_{Numbers(p_.k, 0.0), Numbers(p_.k, 0.0), p_.left} {}

    const Rubbed& best() const { return best_; }
    Method method() const { return solved() ? method_ : Method::NONE; }
    bool solved() const { return error_ <= tolerance_; }
    int pairs() const { return pairs_; }
    int pivots() const { return path_.pivots; }

    // Keep an answer if it is the best so far; whether one within the tolerance is known.
    bool offer(const Rubbed& at, Method method) {
        const double error = error_of(at);
        if (error < error_) error_ = error, method_ = method, best_ = at;
        return solved();
    }

    // From an answer that is near.
    void run(Rubbed at, int pivots) {
        if (!by_proximal(at)) by_point(at, int(pivots * std::min(1.0, MEDIUM / p_.k * (MEDIUM / p_.k))) / (p_.dissipates ? SEVERAL : 1));
    }

    // From random states and percussions, for an answer that is not among the known ones.
    void run_from(std::uint64_t seed, const std::vector<Numbers>& known) {
        Random random(seed);
        Rubbed at{Numbers(p_.k), Numbers(p_.k), p_.left};
        for (int c = 0; c < p_.k; ++c) {
            at.lam[c] = exponential_of(random.number()) * p_.scale / p_.inverse_mass[c];
            at.tau[c] = p_.friction[c] * at.lam[c] * (2.0 * random.number() - 1.0);
        }
        if (by_random_states(random, at, known)) return;
        sweeps_.accelerated(at.lam, at.tau, at.u, BLOCKS, BLOCK, 0.5 * tolerance_, pairs_);
        Numbers v(p_.k), s(p_.k);
        contact_velocities(p_, at.u, v, s);
        for (int c = 0; c < p_.k; ++c) {  // λ and τ of whole percussions
            at.lam[c] -= p_.along[c] * (v[c] + p_.left_v[c]);
            at.tau[c] -= p_.across[c] * (s[c] + p_.left_s[c]);
        }
        if (!offer(at, Method::SWEEPS)) by_point(at, RANDOM);
    }

    // Proximal steps, and paths from where they stand; `at` is left there.
    bool by_proximal(Rubbed& at) {
        proximal_newton(p_, sweeps_, factor_, at, PROXIMAL, 0.5 * tolerance_, pairs_);
        return offer(at, Method::PROXIMAL) || locally(at);
    }

    // Steps of the proximal point method, at the cost of `effort` pivots.
    bool by_point(const Rubbed& from, int effort) {
        ProximalPoints points(p_, path_, from);
        for (int step = 0; effort > 0; effort -= points.cost) {
            if (!points.step()) continue;
            if (offer(points.at(), Method::PROXIMAL_POINT)) return true;
            ++step;
            const bool settled = error_ < NEAR_POINT && step % SOME == 0;
            if ((settled || points.pivots == 0) && by_newton(path_.states(), points.at(), 1, Method::PROXIMAL_POINT)) return true;
        }
        return false;
    }

private:
    double error_of(const Rubbed& at) const { return worst(measure(p_, at)); }

    bool by_newton(const States& states, Rubbed at, int rounds, Method method) {
        newton(p_, factor_, states, at, tolerance_, rounds, FRICTION_PENALTY);
        return offer(at, method);
    }

    bool locally(const Rubbed& near) {
        path_.compliance = PATH_SOFT;
        Rubbed at = near;
        Path::clean(p_, at);
        for (double way : {-1.0, 1.0}) {
            path_.begin(at, PROXIMAL_NOISE * p_.scale, PROXIMAL);
            const Path::End end = path_.follow(way, PROXIMAL_PIVOTS);
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
            Rubbed at = path_.answer();
            const double error = error_of(at);
            if (offer(at, Method::PATH) || by_newton(path_.states(), at, FINISH, Method::PATH)) return true;
            // percussions that drift at a constant rate get to the next change of a state sooner
            if (error > SLOW * before && path_.compliance > FIRMEST) path_.compliance *= 0.1;
            before = error;
            into_cones(p_, at);
            path_.begin(at, BRINK * p_.scale, repeat);
            if (path_.follow(-1.0, LOCAL_PIVOTS) != Path::End::ARRIVED) break;
        }
        return false;
    }

    // One step of Newton's method from each state of a small island, in random order, or all of its steps from some, until an
    // answer is not one of the known.
    bool by_random_states(Random& random, const Rubbed& start, const std::vector<Numbers>& known) {
        const bool small = p_.k <= 4 && (1 << 2 * p_.k) <= STATES;
        const int count = small ? 1 << 2 * p_.k : STATES / p_.k / NEWTON;
        Places code = every(small ? count : 0);
        for (int a = int(code.size()) - 1; a > 0; --a) std::swap(code[a], code[std::size_t(random.number() * (a + 1))]);
        Rubbed again;
        for (int a = 0; a < count; ++a) {
            Flags hold(p_.k);
            for (int c = 0; c < p_.k; ++c) hold[c] = small ? code[a] >> 2 * c & 3 : random.word() >> 62;
            error_ = INFINITE;
            if (!by_newton(States(std::move(hold)), start, small ? 1 : NEWTON, Method::SETS)) continue;
            if (std::all_of(known.begin(), known.end(), [&](const Numbers& other) { return apart(best_.u, other); })) return true;
            again = best_;
        }
        error_ = INFINITE;
        return !again.lam.empty() && offer(again, Method::SETS);
    }
    // Whether velocities are two answers: by the energy of their difference.
    bool apart(const Numbers& u, const Numbers& other) const {
        double square = 0.0, mass = 0.0;
        for (std::size_t i = 0; i < u.size(); ++i) square += p_.mass[i] * (u[i] - other[i]) * (u[i] - other[i]);
        for (int i = 0; i < p_.n; ++i) mass += p_.mass[3 * i];
        return square > APART * APART * p_.scale * p_.scale * mass;
    }

    const Rubbing& p_;
    FrictionFactor& factor_;
    double tolerance_;
    Sweeps sweeps_;
    Path path_;
    Rubbed best_;
    double error_ = INFINITE;
    Method method_ = Method::NONE;
    int pairs_ = 0;
};

// Disks and contacts of the islands that something presses, some C u⁻ > b or dissipation, or of all that have contacts.
Selection pressed(const Rubbing& p, bool everything) {
    Flags is(p.islands, 0);
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
template <class Act>
void for_islands(const Rubbing& p, const Numbers& errors, double tolerance, Act&& act) {
    for (int island = 0; island < p.islands; ++island) {
        if (errors[island] <= tolerance) continue;
        Places disk, contact;
        for (int i = 0; i < p.n; ++i)
            if (p.island[i] == island) disk.push_back(i);
        for (int c = 0; c < p.k; ++c)
            if (p.island[p.first[c]] == island) contact.push_back(c);
        act(disk, contact);
    }
}

// Answers of all islands by the convex programme and Newton's method, in `at`; their errors. `near`: the programme's.
Numbers together(Part& part, double tolerance, Rubbed& at, Rubbed& near) {
    const Rubbing& p = part.problem;
    at = near = convex_programme(p, part.factor, PROGRAMME);
    return newton(p, part.factor, states_of(p, at), at, tolerance, PROGRAMME_ROUNDS, FRICTION_PENALTY);
}

// Where a search begins: at the answer of the convex programme; by sweeps from percussions at hand (k, or none); or, with a
// seed ≥ 1, at random, for an answer other than the known ones.
struct Start {
    int seed = 0, pivots = POINT;
    bool by_sweeps = false;
    In lam{}, tau{};
    std::span<const Numbers> known{};
};

// With a seed every island is searched, also where nothing presses: u⁻ need not be the only answer there.
FrictionAnswer climb(const Rubbing& p, double tolerance, const Start& start) {
    FrictionAnswer answer{{Numbers(p.k, 0.0), Numbers(p.k, 0.0), p.left}};
    Selection some = pressed(p, start.seed > 0);
    if (some.contact.empty()) return answer;
    std::optional<Part> part;  // sweeps need no factor
    if (!start.by_sweeps) some = part.emplace(p, some.disk, some.contact);
    const Rubbing q = part ? part->problem : chosen(p, some.contact, some.disk);
    Rubbed at{Numbers(q.k, 0.0), Numbers(q.k, 0.0), q.left}, near = at;
    Numbers errors(q.islands, INFINITE);
    answer.method = start.by_sweeps ? Method::SWEEPS : Method::SETS, answer.seed = start.seed;
    if (start.by_sweeps) {
        for (int c = 0; c < q.k && !start.lam.empty(); ++c) at.lam[c] = start.lam[some.contact[c]], at.tau[c] = start.tau[some.contact[c]];
        Sweeps(q).accelerated(at.lam, at.tau, at.u, STEP_BLOCKS, BLOCK, 0.5 * tolerance, answer.pairs);
        errors = measure(q, near = at);
    } else if (start.seed == 0) {
        errors = together(*part, tolerance, at, near);
    }
    for_islands(q, errors, tolerance, [&](const Places& disk, const Places& contact) {
        Part one(q, disk, contact);
        Search search(one, tolerance);
        if (start.seed > 0) {
            std::vector<Numbers> there;
            for (const Numbers& velocity : start.known) {
                Numbers u(3 * disk.size());
                for (std::size_t i = 0; i < one.disk.size(); ++i) std::copy_n(velocity.begin() + 3 * some.disk[one.disk[i]], 3, u.begin() + 3 * i);
                there.push_back(std::move(u));
            }
            search.run_from(start.seed, there);
        } else {
            search.offer(taken(one, at), answer.method);
            search.run(taken(one, near), start.pivots);
        }
        put(one, search.best(), at);
        answer.pairs += search.pairs(), answer.pivots += search.pivots();
        answer.method = std::max(answer.method, search.method());
    });
    put(some, at, answer.at);
    return answer;
}

// An answer of islands of few contacts that are not solved, k_n acting where it pushes: every set of states is tried.
void try_every_state(const Rubbing& p, double tolerance, FrictionAnswer& answer) {
    Rubbing acting = p;
    act(acting, p.along, answer.at.u);
    for_islands(p, measure(acting, answer.at), tolerance, [&](const Places& disk, const Places& contact) {
        if (contact.size() > FEW) return;
        Part one(p, disk, contact);
        Rubbing& q = one.problem;
        const Numbers along = q.along;
        // a contact is free, or it is held in one of three ways: where closed, where k_n acts, or where both are
        int count = 1;
        for (double k : along) count *= k == 0.0 ? 4 : 10;
        for (int code = 0; code < count; ++code) {
            States states(q.k);
            for (int c = 0, left = code; c < q.k; left /= along[c] == 0.0 ? 4 : 10, ++c) {
                const int way = left % (along[c] == 0.0 ? 4 : 10);
                states.hold[c] = way == 0 ? FREE : 1 + (way - 1) % 3;
                states.closed[c] = way > 0 && way < 7;
                q.along[c] = way > 3 ? along[c] : 0.0;
            }
            Rubbed now{Numbers(q.k, 0.0), Numbers(q.k, 0.0), q.left};
            newton(q, one.factor, states, now, tolerance, 1, FRICTION_PENALTY);
            act(q, along, now.u);
            if (worst(measure(q, now)) > tolerance) continue;
            put(one, now, answer.at);
            if (answer.method == Method::NONE) answer.method = Method::SETS;
            return;
        }
    });
}

// The answer with the k_n that push: found in rounds, the best met. `p` has these k_n only where this is the last round.
FrictionAnswer one_sided(const Rubbing& p, double tolerance, const Start& start) {
    Rubbing linear = p;
    FrictionAnswer best;
    for (int round = 0; round < ROUNDS; ++round) {
        FrictionAnswer found = climb(linear, tolerance, start);
        const bool changed = act(linear, p.along, found.at.u);
        found.error = worst(measure(linear, found.at));
        if (round == 0 || found.error < best.error) best = std::move(found);
        if (best.error <= tolerance || !changed) break;
    }
    if (best.error > tolerance) {
        try_every_state(p, tolerance, best);
        act(linear, p.along, best.at.u);
        best.error = worst(measure(linear, best.at));
    }
    return best;
}

// Whole percussions taken `share` times, of each island: λ and τ, and the velocities that they give.
Rubbed scaled(const Rubbed& at, const Rubbing& p, const Numbers& share) {
    Rubbed less = at;
    Numbers v(p.k), s(p.k), pn(p.k), pt(p.k);
    contact_velocities(p, at.u, v, s);
    for (int c = 0; c < p.k; ++c) {
        const double by = share[p.island[p.first[c]]];
        pn[c] = by == 0.0 ? 0.0 : by * normal_push(p, c, v[c], at.lam[c]);
        pt[c] = by == 0.0 ? 0.0 : by * (p.across[c] * (s[c] + p.left_s[c]) + at.tau[c]);
    }
    balance(p, pn, pt, less.u);
    contact_velocities(p, less.u, v, s);
    for (int c = 0; c < p.k; ++c) {
        less.lam[c] = pn[c] - p.along[c] * (v[c] + p.left_v[c]);
        less.tau[c] = pt[c] - p.across[c] * (s[c] + p.left_s[c]);
    }
    return less;
}

// An answer of islands that are not solved gains no energy: their percussions are taken θ times, by which the energy changes
// by ½θ² p·DM⁻¹Dᵀp − θ p·Du⁻; none of them, where that is nearer to an answer.
void gain_nothing(const Rubbing& p, double tolerance, Rubbed& at) {
    const Numbers errors = measure(p, at);
    Numbers gained(p.islands, 0.0), square(p.islands, 0.0), share(p.islands, 1.0);
    const Rubbed given = scaled(at, p, share);
    for (std::size_t i = 0; i < given.u.size(); ++i) {
        const double change = given.u[i] - p.left[i];
        square[p.island[i / 3]] += p.mass[i] * change * change;
        gained[p.island[i / 3]] += p.mass[i] * change * (given.u[i] + p.left[i]);
    }
    bool any = false;
    for (int m = 0; m < p.islands; ++m) {
        if (errors[m] <= tolerance || gained[m] <= 0.0) continue;
        share[m] = square[m] < INFINITE ? std::max(1.0 - gained[m] / square[m], 0.0) : 0.0;
        any = true;
    }
    if (!any) return;
    const Rubbed none = scaled(at, p, Numbers(p.islands, 0.0));
    Rubbed less = scaled(at, p, share);
    const Numbers one = measure(p, less), two = measure(p, none);
    for (int c = 0; c < p.k; ++c) {
        const Index m = p.island[p.first[c]];
        if (share[m] == 1.0) continue;
        const Rubbed& from = one[m] <= two[m] ? less : none;
        at.lam[c] = from.lam[c], at.tau[c] = from.tau[c];
    }
    for (int i = 0; i < p.n; ++i) {
        const Index m = p.island[i];
        if (share[m] != 1.0) std::copy_n((one[m] <= two[m] ? less : none).u.begin() + 3 * i, 3, at.u.begin() + 3 * i);
    }
}

}  // namespace

FrictionAnswer solve_friction(Rubbing& p, const FrictionAsked& asked) {
    const Numbers along = p.along;
    const double tolerance = asked.tolerance, aim = 0.9 * tolerance;
    FrictionAnswer best = one_sided(p, aim, {.pivots = asked.in_step ? 0 : POINT, .by_sweeps = asked.in_step, .lam = asked.lam, .tau = asked.tau});
    if (asked.in_step && best.error > tolerance) {
        FrictionAnswer other = one_sided(p, aim, {.pivots = STEP_POINT});
        other.pairs += best.pairs, other.pivots += best.pivots;
        if (other.error < best.error) best = std::move(other);
    }
    std::vector<Numbers> velocities{best.at.u};
    for (int seed = 1; seed < asked.starts; ++seed) {
        const FrictionAnswer other = one_sided(p, aim, {.seed = seed, .known = velocities});
        Rubbing acting = p;
        act(acting, along, other.at.u);
        const Numbers errors = measure(acting, other.at);
        Numbers u = best.at.u;
        bool any = false;
        Flags touched(p.islands, 0);
        for (int c = 0; c < p.k; ++c) touched[p.island[p.first[c]]] = 1;
        for (int i = 0; i < p.n; ++i) {
            if (!(errors[p.island[i]] <= tolerance)) continue;
            any = any || touched[p.island[i]];
            std::copy_n(other.at.u.begin() + 3 * i, 3, u.begin() + 3 * i);
        }
        if (any) velocities.push_back(std::move(u));
    }
    if (velocities.size() > 1) {
        best.spread = 0.0;
        for (std::size_t i = 0; i < p.left.size(); ++i) {
            double least = INFINITE, most = -INFINITE;
            for (const Numbers& u : velocities) least = std::min(least, u[i]), most = std::max(most, u[i]);
            best.spread = std::max(best.spread, (most - least) * (i % 3 == 2 ? asked.radius[i / 3] : 1.0));
        }
    }
    act(p, along, best.at.u);
    if (!(best.error <= tolerance)) {
        best.method = Method::NONE;
        if (!asked.in_step) gain_nothing(p, tolerance, best.at);
    }
    return best;
}

FrictionAnswer solve_friction_by(const Rubbing& p, FrictionMethod method, double tolerance, int effort) {
    Part part(p, every(p.n), every(p.k));
    Search search(part, tolerance);
    Rubbed at{Numbers(p.k, 0.0), Numbers(p.k, 0.0), part.problem.left};
    if (method == FrictionMethod::PROXIMAL) search.by_proximal(at);
    else if (method == FrictionMethod::POINT) search.by_point(at, effort);
    else search.run_from(3, {});
    FrictionAnswer answer{{Numbers(p.k, 0.0), Numbers(p.k, 0.0), p.left}, search.method(), 0, search.pairs(), search.pivots()};
    put(part, search.best(), answer.at);
    return answer;
}

}  // namespace nscd
