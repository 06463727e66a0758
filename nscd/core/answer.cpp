#include "answer.hpp"

#include <algorithm>
#include <numeric>

namespace nscd {

namespace {

// Sweeps of a descent, at most, before its closed contacts are tried; the same in a small crowd, where a factorisation is
// cheap; from how many disks on a crowd is large (docs/results/solvers.md).
constexpr int SWEEPS = 1600, FEW_SWEEPS = 100, LARGE = 2000;
// A descent has found the closed contacts once no more than this number and this share of all change between two looks.
constexpr int STEADY = 2;
constexpr double STEADY_SHARE = 1e-3;
// Between these numbers of closed contacts per unknown a packing is marginal: it has soft modes, and active sets cycle.
constexpr double ISOSTATIC = 1.0, REDUNDANT = 1.2;
// A reaction above this share of the largest is one of a closed contact.
constexpr double PRESSED = 1e-9;
// From the answer of a crowd that was nearly the same, whose errors are few and large, the path begins this many times its
// error away.
constexpr double AFTER_ANOTHER = 1.0;
// To this share of the tolerance contacts are closed where no bound of the error is asked for.
constexpr double SHARE_OF_TOLERANCE = 1e-3;
// First-order solvers stop a little before the tolerance, so that rounding does not carry them beyond.
constexpr double BEFORE = 0.9;
// Rounds of the one-sided law: few are needed, 5 in a crowd of 1,000. Halvings of a step that would raise Φ.
constexpr int ROUNDS = 60, HALVINGS = 40;

// Projected Gauss–Seidel: what the field uses; kept as the baseline. Contact by contact λ ← max(0, λ + (Cu − b)/w), with
// u updated at once. On a chain of n disks against a wall it contracts by cos²(π/(2n)) a sweep.
Descended gauss_seidel(const System& s, double tolerance) {
    Descended at{Numbers(s.k, 0.0), s.free, MOST_SWEEPS};
    Numbers& u = at.velocity;
    const int d = s.d;
    const auto closing = [&](int c) {
        const int i = d * s.first[c], j = d * s.second[c];
        double v = s.nx[c] * u[i] + s.ny[c] * u[i + 1] - s.offset[c];
        if (j >= 0) v -= s.nx[c] * u[j] + s.ny[c] * u[j + 1];
        return v;
    };
    const auto off = [&](int c, double v) { return std::abs(std::min(s.inverse_mass[c] * at.reaction[c], -v)); };
    for (int sweep = 1; sweep <= MOST_SWEEPS; ++sweep) {
        double error = 0.0;
        for (int c = 0; c < s.k; ++c) {
            const int i = d * s.first[c], j = d * s.second[c];
            const double v = closing(c);
            error = larger(error, off(c, v));
            const double change = std::max(at.reaction[c] + v / s.inverse_mass[c], 0.0) - at.reaction[c];
            if (change == 0.0) continue;
            at.reaction[c] += change;
            u[i] -= s.nx[c] * change / s.mass[i], u[i + 1] -= s.ny[c] * change / s.mass[i];
            if (j >= 0) u[j] += s.nx[c] * change / s.mass[j], u[j + 1] += s.ny[c] * change / s.mass[j];
        }
        // the error was measured along the sweep; where it is small the whole is measured before stopping
        if (error > tolerance) continue;
        double worst = 0.0;
        for (int c = 0; c < s.k; ++c) worst = larger(worst, off(c, closing(c)));
        if (worst <= tolerance) {
            at.sweeps = sweep;
            break;
        }
    }
    return at;
}

// Â⁻¹ momentum with one refinement; all in elimination order.
Numbers velocity_of(Factor& factor, const Numbers& momentum) {
    const System& s = factor.system();
    factor.factorise(Numbers(s.k, 0.0));
    Numbers u = momentum, rest(u.size());
    factor.solve(u);
    inertia(s, u, rest);
    for (std::size_t i = 0; i < u.size(); ++i) rest[i] = momentum[i] - rest[i];
    factor.solve(rest);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += rest[i];
    return u;
}

// In the norm of Â, which the distance of an answer is in.
double distance_of(const System& s, In one, In other) {
    Numbers apart(one.size()), heavy(one.size());
    for (std::size_t i = 0; i < one.size(); ++i) apart[i] = one[i] - other[i];
    inertia(s, apart, heavy);
    double square = 0.0;
    for (std::size_t i = 0; i < one.size(); ++i) square += apart[i] * heavy[i];
    return std::sqrt(square);
}

// A problem that has to be factorised, on its way up the ladder; all in elimination order.
class Climb {
public:
    Climb(const System& given, const Asked& asked) : asked_(asked), team_(asked.threads), factor_(given, team_, asked.sizes), s_(factor_.system()) {}

    Answer solve(Method& method) {
        method = find();
        double distance = asked_.bounded ? bound_by_factor(factor_, reaction_, velocity_, held_) : 0.0;
        if (s_.dissipative() && !s_.maintained) distance += balance();
        if (asked_.least && !least_ && accuracy(s_, reaction_, velocity_) <= asked_.tolerance)
            least_ = settle_energy(factor_, reaction_, velocity_, asked_.tolerance);
        const bool shared = s_.n >= asked_.sizes.shared && s_.n >= asked_.sizes.many;
        return {factor_.contacts_given(reaction_), factor_.disks_given(velocity_), method, s_.n, iterations_,
                shared ? team_.threads() : 1, least_, 0, distance};
    }

private:
    // The first rung whose answer serves; the last one's in any case.
    Method find() {
        if (s_.maintained) {
            take(close_all(factor_));
            least_ = true;
            return Method::MAINTAINED;
        }
        if (asked_.solver != Solver::AUTO) {
            find_by_name();
            return Method::ASKED_FOR;
        }
        const bool known = !asked_.reaction.empty(), even = s_.even();
        Near near;
        if (known && s_.wide()) near.reaction = factor_.contacts_ordered(asked_.reaction);
        else if (known && correct_guess(near)) return Method::GUESS;
        if (!s_.dissipative() && even && s_.wide()) {
            if (firm_and_close(near)) return Method::FIRMER;
        } else if (!s_.dissipative() && even && !known && descend_and_close(near)) return Method::DESCENT;
        if (s_.dissipative() || !even) near = {};
        Found found = solve_by_path(factor_, near, asked_.tolerance / stiffest(), asked_.least);
        iterations_ += found.iterations;
        take(std::move(found));
        return s_.dissipative() ? Method::DISSIPATIVE : even ? Method::MARGINAL : Method::UNEVEN;
    }

    void find_by_name() {
        if (asked_.solver == Solver::INTERIOR_POINT) {
            Found found = solve_by_path(factor_, {}, asked_.tolerance, asked_.least);
            iterations_ = found.iterations;
            take(std::move(found));
        } else if (asked_.solver == Solver::GAUSS_SEIDEL) {
            take(nscd::gauss_seidel(s_, BEFORE * asked_.tolerance * s_.scale));
        } else if (asked_.solver == Solver::PROJECTED_GRADIENT) {
            take(descend(s_, factor_.parts(), team_, {BEFORE * asked_.tolerance, MOST_SWEEPS, -1, INFINITE}));
        } else if (s_.wide()) {
            Closed found = firm_up(factor_, reaction_, CLOSED, 0.0);
            least_ = found.settled && s_.even();
            take(std::move(found));
        } else {  // the closed contacts by descent, however many there are
            const Descended end = descend(s_, factor_.parts(), team_, {asked_.tolerance, SWEEPS, steady(), INFINITE});
            Flags closed;
            press(s_, end.reaction, end.velocity, {}, closed);
            Closed found = close_set(factor_, std::move(closed), false);
            iterations_ = end.sweeps;
            least_ = found.settled && s_.even();
            take(std::move(found));
        }
    }

    // Close the contacts whose reactions were more than nothing in the guess. A set of another crowd may settle without
    // contacts that are nearly closed, which would change the reactions of least energy: gaps have to be known as well as
    // they are looked at.
    bool correct_guess(Near& near) {
        near.reaction = factor_.contacts_ordered(asked_.reaction);
        near.away = AFTER_ANOTHER;
        const double least = PRESSED * *std::max_element(near.reaction.begin(), near.reaction.end());
        Flags closed(s_.k);
        for (int c = 0; c < s_.k; ++c) closed[c] = near.reaction[c] > least;
        if (asked_.velocity.empty()) {
            near.velocity = s_.free;  // û − M⁻¹Cᵀλ
            Numbers momentum(s_.mass.size(), 0.0);
            add_reactions(s_, near.reaction, 1.0, momentum);
            for (std::size_t i = 0; i < momentum.size(); ++i) near.velocity[i] -= momentum[i] / s_.mass[i];
        } else {
            near.velocity = factor_.disks_ordered(asked_.velocity);
        }
        if (std::none_of(closed.begin(), closed.end(), [](auto is) { return is; })) return false;
        Closed found = close_set(factor_, std::move(closed), false);
        iterations_ += found.rounds;
        const bool exact = found.settled && found.error <= std::min(asked_.tolerance, EXACT);
        if (!exact && (asked_.least || !(found.error <= asked_.tolerance))) return false;
        least_ = exact && s_.even();
        take(std::move(found));
        return true;
    }

    // Unsettled where the packing is marginal, so that the descent does not tell the closed contacts, or where the set would
    // not settle.
    bool descend_and_close(Near& near) {
        Descended end = descend(s_, factor_.parts(), team_, {asked_.tolerance, s_.n >= LARGE ? SWEEPS : FEW_SWEEPS, steady(), ISOSTATIC});
        iterations_ += end.sweeps;
        Flags closed;
        press(s_, end.reaction, end.velocity, {}, closed);
        near.reaction = std::move(end.reaction), near.velocity = std::move(end.velocity);
        const auto count = std::count(closed.begin(), closed.end(), 1);
        const double share = double(count) / (2.0 * s_.n);
        if (count == 0 || (ISOSTATIC < share && share < REDUNDANT)) return false;
        return settled(close_set(factor_, std::move(closed), false, enough()));
    }
    // The same of bodies of several disks.
    bool firm_and_close(Near& near) {
        const double loose = asked_.bounded || asked_.least ? 0.0 : 0.5 * asked_.tolerance;
        Closed found = firm_up(factor_, near.reaction, enough(), loose);
        near.velocity = found.velocity;
        return settled(std::move(found));
    }
    // contacts of a step need not be closed to rounding
    double enough() const { return asked_.bounded ? CLOSED : std::max(CLOSED, SHARE_OF_TOLERANCE * asked_.tolerance); }
    bool settled(Closed&& found) {
        iterations_ += found.rounds;
        if (!(found.settled && found.error <= asked_.tolerance)) return false;
        least_ = true;
        take(std::move(found));
        return true;
    }

    // Recompute the velocities from the reactions, Â u⁺ = Â û − Cᵀλ, where that is more accurate: k/m times a rounding
    // error of u is momentum out of balance. How far they moved.
    double balance() {
        held_ = {};
        Numbers momentum = momentum_given(s_);
        add_reactions(s_, reaction_, -1.0, momentum);
        Numbers u = velocity_of(factor_, momentum);
        if (!(accuracy(s_, reaction_, u) < accuracy(s_, reaction_, velocity_))) return 0.0;
        const double moved = distance_of(s_, u, velocity_);
        velocity_ = std::move(u);
        return moved;
    }

    // An error of C u is one of k C u in what a contact pushes: max 1 + wk.
    double stiffest() const {
        double most = 1.0;
        for (std::size_t c = 0; c < s_.along.size(); ++c) most = std::max(most, 1.0 + s_.inverse_mass[c] * s_.along[c]);
        return most;
    }
    int steady() const { return STEADY + int(STEADY_SHARE * s_.k); }
    void take(Closed&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), held_ = std::move(found.held);
        if (asked_.solver == Solver::ACTIVE_SET || s_.maintained) iterations_ += found.rounds;
    }
    void take(Found&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), held_ = std::move(found.held);
        least_ = found.least;
    }
    void take(Descended&& found) {
        reaction_ = std::move(found.reaction), velocity_ = std::move(found.velocity), iterations_ = found.sweeps;
    }

    const Asked& asked_;
    Team team_;
    Factor factor_;
    const System& s_;
    Numbers reaction_, velocity_;
    Held held_;
    int iterations_ = 0;
    bool least_ = false;
};

}  // namespace

Answer climb(const System& s, const Asked& asked) {
    Answer answer;
    if (s.k == 0) {
        answer.velocity = s.free;
        return answer;
    }
    if (asked.solver != Solver::AUTO || s.maintained) return Climb(s, asked).solve(answer.method);
    const Rest rest = close_single(s, answer.reaction, answer.velocity);
    answer.method = rest.single ? Method::ALONE : Method::NOTHING_PRESSES;
    const bool all = int(rest.contact.size()) == s.k && int(rest.disk.size()) == s.n;
    if (asked.bounded && !all) answer.distance = bound_of_closed_form(s, answer.reaction, answer.velocity);
    if (rest.contact.empty()) return answer;
    const System part = chosen(s, rest.contact, rest.disk, rest.place);
    Answer found;
    bool solved = false;
    if (rest.forest && !s.dissipative() && !s.wide()) {
        const Branches branches = branches_of(part);
        found.iterations = solve_tree(part, branches, found.reaction, found.velocity);
        found.method = Method::TREE, found.disks = part.n;
        solved = accuracy(part, found.reaction, found.velocity) <= asked.tolerance;
        if (solved && asked.bounded) found.distance = bound_of_tree(part, branches, found.reaction, found.velocity);
    }
    if (!solved) {
        Asked own = asked;
        if (!asked.reaction.empty()) {
            own.reaction.resize(part.k);
            for (int c = 0; c < part.k; ++c) own.reaction[c] = asked.reaction[rest.contact[c]];
        }
        if (!asked.velocity.empty()) {
            own.velocity.resize(part.mass.size());
            for (std::size_t i = 0; i < own.velocity.size(); ++i)
                own.velocity[i] = asked.velocity[std::size_t(rest.disk[i / s.d]) * s.d + i % s.d];
        }
        found = Climb(part, own).solve(found.method);
    }
    for (int c = 0; c < part.k; ++c) answer.reaction[rest.contact[c]] = found.reaction[c];
    for (int i = 0; i < part.n; ++i)
        for (int a = 0; a < s.d; ++a) answer.velocity[std::size_t(s.d) * rest.disk[i] + a] = found.velocity[s.d * i + a];
    found.distance = length(found.distance, answer.distance);
    found.reaction = std::move(answer.reaction), found.velocity = std::move(answer.velocity);
    return found;
}

namespace {

// û of a problem from Â û = (M − DᵀKD) u⁻; it is u⁻ without dissipation.
void free_velocity(System& s, const Asked& asked) {
    Team alone(1);
    Factor factor(s, alone, asked.sizes);
    s.free = factor.disks_given(velocity_of(factor, factor.disks_ordered(momentum_given(s))));
}

double potential(const System& law, const Numbers& along, In u) {
    Numbers total(u.size()), v(law.k);
    double energy = 0.0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        total[i] = u[i] + law.left[i];
        energy += law.mass[i] * (u[i] - law.left[i]) * (u[i] - law.left[i]);
    }
    approach(law, total, v);
    for (int c = 0; c < law.k; ++c) energy += along[c] * std::max(v[c], 0.0) * std::max(v[c], 0.0);
    sliding(law, total, v);
    for (int c = 0; c < law.k; ++c) energy += law.across[c] * v[c] * v[c];
    return energy;
}

// C(u⁺ + u⁻) (k) m/s, and how exactly it is known.
struct Closing {
    Numbers velocity, known;
};
Closing closing_of(const System& law, const Answer& found) {
    Numbers total(found.velocity.size());
    for (std::size_t i = 0; i < total.size(); ++i) total[i] = found.velocity[i] + law.left[i];
    Closing of{Numbers(law.k), Numbers(law.k)};
    approach(law, total, of.velocity);
    const double speed = std::max(law.scale, largest(found.velocity));
    // n·(Â⁻¹ n) is at most w/(1 + wk), and the distance is known in the norm of Â
    for (int c = 0; c < law.k; ++c)
        of.known[c] = std::sqrt(law.inverse_mass[c] / (1.0 + law.inverse_mass[c] * law.along[c])) * found.distance + APPROACH_ROUNDING * speed;
    return of;
}

// How far (√kg m/s) the exact u⁺ of the law is from that of the problem with fixed k_n: nothing unless some C(u⁺ + u⁻) is so
// near to 0 that its sign is not known. |u₁ − u₂|_M ≤ |Cᵀr|_M⁻¹ by strong monotonicity, r: what the fixed k_n say wrongly
// of p_n at most.
double astray(const System& law, const Numbers& along, const Answer& found) {
    const Closing of = closing_of(law, found);
    Numbers carried(law.n, 0.0);
    for (int c = 0; c < law.k; ++c) {
        const double wrong = std::max((law.along[c] > 0.0 ? -of.velocity[c] : of.velocity[c]) + of.known[c], 0.0);
        carried[law.first[c]] += along[c] * wrong;
        if (law.second[c] >= 0) carried[law.second[c]] += along[c] * wrong;
    }
    double square = 0.0;
    for (int i = 0; i < law.n; ++i) {
        square += carried[i] * carried[i] / law.mass[law.d * i];
        if (law.wide()) square += carried[i] * carried[i] * law.reach[i] * law.reach[i] / law.mass[3 * i + 2];
    }
    return std::sqrt(square);
}

}  // namespace

Answer solve_one_sided(System& law, const Asked& asked) {
    if (!law.dissipative()) return climb(law, asked);
    const Numbers along = law.along;
    free_velocity(law, asked);
    Answer found = climb(law, asked);
    if (law.maintained || largest(along) == 0.0) return found;
    Numbers u = found.velocity;
    bool own = true;  // whether u is what was found
    for (int round = 0; round < ROUNDS; ++round) {
        const Numbers now = acting(law, along, u);
        const Closing of = closing_of(law, found);
        bool changed = false;
        // those nearer to 0 than the velocities are known would change sides for ever
        for (int c = 0; c < law.k; ++c)
            changed = changed || (now[c] != law.along[c] && (!own || std::abs(of.velocity[c]) > of.known[c]));
        if (!changed) break;
        const int rounds = found.rounds + 1;
        law.along = now;
        free_velocity(law, asked);
        found = climb(law, asked);
        found.rounds = rounds;
        // the first velocities with a lower Φ on the way back to those before
        const double before = potential(law, along, u);
        Numbers end = found.velocity;
        own = true;
        for (int halving = 0; halving < HALVINGS && !(potential(law, along, end) < before); ++halving) {
            own = false;
            const double share = std::ldexp(1.0, -halving - 1);
            for (std::size_t i = 0; i < u.size(); ++i) end[i] = u[i] + share * (found.velocity[i] - u[i]);
        }
        if (!own && !(potential(law, along, end) < before)) end = found.velocity, own = true;
        u = std::move(end);
    }
    found.distance += astray(law, along, found);
    return found;
}

}  // namespace nscd
