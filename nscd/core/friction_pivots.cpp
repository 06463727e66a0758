#include "friction_pivots.hpp"

#include <algorithm>

#include "levels.hpp"

namespace nscd {

namespace {

// "A to B": see friction_solver.cpp.
constexpr int CHANGES = 24;              // contacts that may change before a new factorisation: its cost against that of columns
constexpr double FARTHEST = 20.0;        // farther than this from the start a path is given up: a bound of the time
// Of the proximal point method: compliance at first and its bounds, short safe steps against few.
constexpr double FIRST = 1e-3;           // 1e-4 to 1e-2
constexpr double POINT_FIRMEST = 1e-10, POINT_SOFTEST = 1.0;
constexpr double FIRMER = 0.3, SOFTER = 10.0;  // after a step of at most FEW pivots, and where there is none; 0.1 to 0.5, 3 to 30
constexpr int FEW = 15;                  // 8 to 30
constexpr int PIVOTS = 300, STEP = 15;   // allowed for a step, 150 to 600; what its factorisations cost, in pivots
constexpr double BRINK = 1e-9;           // noise on contacts on the brink of another state, loops against its length

enum { V, S, LAM, TAU };

// A word of one contact's state; states of all are their exclusive or.
std::uint64_t word_of(const States& of, int c) { return Random(8u * c + 4u * of.closed[c] + of.tangential_state[c]).word(); }

// to += Σ by_q · columns_q.
LEVELS void add_columns(double* __restrict to, const std::vector<Vector>& columns, const Vector& by, std::size_t size) {
    std::size_t q = 0;
    for (; q + 4 <= by.size(); q += 4) {
        const double *a = columns[q].data(), *b = columns[q + 1].data(), *c = columns[q + 2].data(), *d = columns[q + 3].data();
        const double ba = by[q], bb = by[q + 1], bc = by[q + 2], bd = by[q + 3];
        for (std::size_t i = 0; i < size; ++i) to[i] += ba * a[i] + bb * b[i] + bc * c[i] + bd * d[i];
    }
    for (; q < by.size(); ++q)
        for (std::size_t i = 0; i < size; ++i) to[i] += by[q] * columns[q][i];
}

LEVELS void add(double* __restrict to, const double* from, double by, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) to[i] += by * from[i];
}

// What a path knows of its contacts, for `steps_to_events`.
struct Course {
    const double *start, *push, *reference, *v, *dv, *lam, *dlam;                 // along the normal
    const double *start_s, *push_s, *reference_tau, *s, *ds, *tau, *dtau;         // across it
    const double *friction, *inverse_mass, *tangent_inverse;
    const std::uint8_t* tangential_state;
    double t, direction, compliance;
};

// How far t may go until the first and the second margin of each contact without dissipation is used up (see `margins`).
LEVELS void steps_to_events(const Course& of, double* __restrict first, double* __restrict second, int k) {
    const auto [start, push, reference, v, dv, lam, dlam, start_s, push_s, reference_tau, s, ds, tau, dtau, friction, inverse, tangent, tangential_state, t, direction, soft] = of;
    const auto until = [](double value, double fast) { return (fast > 0.0 ? value > 0.0 ? value : 0.0 : INFINITE) / (fast > 0.0 ? fast : 1.0); };
    for (int c = 0; c < k; ++c) {
        const bool is_free = tangential_state[c] == FREE, stuck = tangential_state[c] == STICK;
        const double mu = friction[c], side = tangential_state[c] == FORWARD ? 1.0 : -1.0;
        const double normal_reaction = reference[c] + lam[c], tangential_reaction = reference_tau[c] + tau[c];
        const double slip = side * (start_s[c] + s[c] + t * push_s[c] - soft * tangent[c] * tau[c]);
        const double faster = side * (ds[c] + push_s[c] - soft * tangent[c] * dtau[c]);
        const double gap = -start[c] - v[c] - t * push[c] - soft * inverse[c] * reference[c];
        first[c] = until(is_free ? gap : stuck ? mu * normal_reaction - tangential_reaction : normal_reaction, -direction * (is_free ? -dv[c] - push[c] : stuck ? mu * dlam[c] - dtau[c] : dlam[c]));
        second[c] = until(stuck ? mu * normal_reaction + tangential_reaction : slip, is_free || mu == 0.0 ? 0.0 : -direction * (stuck ? mu * dlam[c] + dtau[c] : faster));
    }
}

// What `Path::set_forces` makes λ and τ from.
struct Forces {
    const double *v, *s, *push, *push_s, *start, *start_s, *reference, *reference_tau, *firm, *firm_s, *reference_push, *friction, *stored;
    const std::uint8_t *closed, *tangential_state;
    double t, offset;
};
LEVELS void forces_of(const Forces& of, double* __restrict lam, double* __restrict tau, int k) {
    const auto [v, s, push, push_s, start, start_s, reference, reference_tau, firm, firm_s, reference_push, friction, stored, closed, tangential_state, t, offset] = of;
    for (int c = 0; c < k; ++c) {
        const double normal = (v[c] + t * push[c] + offset * start[c]) * firm[c], tangential = (s[c] + t * push_s[c] + offset * start_s[c]) * firm_s[c];
        const double by = tangential_state[c] == FORWARD ? friction[c] : tangential_state[c] == BACKWARD ? -friction[c] : 0.0;
        const double one = closed[c] ? normal : -offset * reference[c], slid = by * (offset * reference_push[c] + stored[c] * v[c] + one) - offset * reference_tau[c];
        lam[c] = one, tau[c] = tangential_state[c] == STICK ? tangential : slid;
    }
}

}  // namespace

std::uint64_t Random::word() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

Path::Path(const FrictionProblem& p, FrictionFactor& factor)
    : p_(p), factor_(factor), now_(p.k), base_(p.k), origin_(p.mass.size()), reference_push_(p.k), u_(p.mass.size()), rate_(p.mass.size()),
      base_rate_(p.mass.size()), slot_(p.k, -1), weights_(p.k), columns_(2 * CHANGES, Vector(p.mass.size())),
      gram_(4 * CHANGES * CHANGES), base_rate_at_(2 * CHANGES), residual_(p.mass.size()), normal_(p.k), tangential_(p.k) {
    for (auto* parts : {&start_, &reference_, &push_, &firm_})
        for (Vector& part : *parts) part.assign(p.k, 0.0);
    for (auto* parts : {&x_, &dx_})
        for (Vector& part : *parts) part.assign(p.k, 0.0);
}

void Path::clean(const FrictionProblem& p, FrictionSolution& iterate) {
    Vector v(p.k), s(p.k);
    contact_velocities(p, iterate.velocity, v, s);
    for (int c = 0; c < p.k; ++c) {
        double &lam = iterate.reaction[c], &tau = iterate.tangential[c];
        if (p.inverse_mass[c] * lam <= p.max_approach[c] - v[c] || lam <= 0.0) lam = 0.0;
        const double limit = p.friction[c] * std::max(normal_push(p, c, v[c], lam), 0.0);
        if (limit == 0.0) tau = 0.0;
        else if (std::abs(s[c]) >= p.tangent_inverse[c] * (limit - std::abs(tau))) tau = s[c] >= 0.0 ? limit : -limit;
    }
}

void Path::begin(const FrictionSolution& start, double noise, std::uint64_t seed) {
    Random random(seed);
    FrictionSolution from = start;
    Vector &v = start_[0], &s = start_[1];
    contact_velocities(p_, from.velocity, v, s);
    for (int c = 0; c < p_.k; ++c) {
        const double push = normal_push(p_, c, v[c], from.reaction[c]), limit = p_.friction[c] * push;
        now_.closed[c] = from.reaction[c] > 0.0;
        now_.tangential_state[c] = !(push > 0.0) ? FREE : std::abs(from.tangential[c]) < (1.0 - 1e-12) * limit ? STICK : from.tangential[c] > 0.0 || limit == 0.0 ? FORWARD : BACKWARD;
    }
    // the velocities that go with λ and τ; what friction there is follows p_n, which follows the velocities where it dissipates
    if (p_.dissipates) solve_fixed_state(p_, factor_, now_, 0.0, 3, from);
    else equilibrium_velocity(p_, from.reaction, from.tangential, from.velocity);
    origin_ = std::move(from.velocity);
    reference_ = {std::move(from.reaction), std::move(from.tangential)};
    std::fill(u_.begin(), u_.end(), 0.0);
    contact_velocities(p_, origin_, v, s);
    for (int c = 0; c < p_.k; ++c) {
        reference_push_[c] = normal_push(p_, c, v[c], reference_[0][c]);
        v[c] -= p_.max_approach[c];
        const double gap = -v[c], away = noise * random.number();
        const std::uint8_t tangential_state = now_.tangential_state[c];
        push_[0][c] = now_.closed[c] ? gap : std::min(0.0, gap - away);
        push_[1][c] = p_.friction[c] == 0.0 || tangential_state == FREE ? 0.0
                      : tangential_state == STICK ? -s[c] : tangential_state == FORWARD ? std::max(0.0, away - s[c]) : std::min(0.0, -away - s[c]);
    }
}

Path::Margins Path::margins(int c, double t) const {
    Margins m;
    const double mu = p_.friction[c], kn = p_.normal_dashpot[c];
    const bool closed = now_.closed[c];
    const std::uint8_t tangential_state = now_.tangential_state[c];
    if (!closed) {
        const double w = compliance * p_.inverse_mass[c];
        m[0] = {-start_[0][c] - x_[V][c] - t * push_[0][c] - w * reference_[0][c], -dx_[V][c] - push_[0][c]};
        if (kn == 0.0) return m;
    } else if (tangential_state != STICK || kn != 0.0) {
        m[0] = {reference_[0][c] + x_[LAM][c], dx_[LAM][c]};
    }
    const double push = reference_push_[c] + kn * x_[V][c] + x_[LAM][c], by = kn * dx_[V][c] + dx_[LAM][c];
    if (tangential_state == FREE) {
        m[1] = {-push, -by};
    } else if (tangential_state == STICK) {
        const double tau = reference_[1][c] + x_[TAU][c];
        m[1] = {mu * push - tau, mu * by - dx_[TAU][c]}, m[2] = {mu * push + tau, mu * by + dx_[TAU][c]};
    } else if (mu != 0.0) {
        const double direction = tangential_state == FORWARD ? 1.0 : -1.0, wt = compliance * p_.tangent_inverse[c];
        m[1] = {direction * (start_[1][c] + x_[S][c] + t * push_[1][c] - wt * x_[TAU][c]), direction * (dx_[S][c] + push_[1][c] - wt * dx_[TAU][c])};
        if (kn != 0.0) m[2] = {push, by};
    }
    return m;
}

Path::Event Path::next_event(double t, double direction) {
    Event next;
    if (!p_.dissipates) {
        const Course of{start_[0].data(), push_[0].data(), reference_[0].data(), x_[V].data(), dx_[V].data(), x_[LAM].data(), dx_[LAM].data(),
                        start_[1].data(), push_[1].data(), reference_[1].data(), x_[S].data(), dx_[S].data(), x_[TAU].data(), dx_[TAU].data(),
                        p_.friction.data(), p_.inverse_mass.data(), p_.tangent_inverse.data(), now_.tangential_state.data(), t, direction, compliance};
        steps_to_events(of, normal_.data(), tangential_.data(), p_.k);
        for (int c = 0; c < p_.k; ++c) {
            const bool stuck = now_.tangential_state[c] == STICK;
            if (normal_[c] < next.step) next = {normal_[c], c, stuck ? 1 : 0};
            if (tangential_[c] < next.step) next = {tangential_[c], c, stuck ? 2 : 1};
        }
        return next;
    }
    for (int c = 0; c < p_.k; ++c) {
        const Margins m = margins(c, t);
        for (int which = 0; which < 3; ++which) {
            const double fast = -direction * m[which].rate, value = std::max(m[which].value, 0.0);  // how fast it is used up
            if (fast > 0.0 && value < next.step * fast) next = {value / fast, c, which};
        }
    }
    return next;
}

// Change the state of a contact one of whose margins is used up; the margin of the new state that has to grow.
int Path::change(const Event& event, double t) {
    const int c = event.contact;
    const bool dissipates = p_.normal_dashpot[c] != 0.0;
    if (dissipates && event.which == 0) {
        now_.closed[c] = !now_.closed[c];
        return 0;
    }
    const int grows = change_tangential_state(c, event.which, t);
    if (!dissipates) now_.closed[c] = now_.tangential_state[c] != FREE;
    return grows;
}

int Path::change_tangential_state(int c, int which, double t) {
    std::uint8_t& tangential_state = now_.tangential_state[c];
    const bool dissipates = p_.normal_dashpot[c] != 0.0;
    if (tangential_state == FREE) {
        const double slid = start_[1][c] + x_[S][c] + t * push_[1][c] + compliance * p_.tangent_inverse[c] * reference_[1][c];
        tangential_state = slid >= 0.0 || p_.friction[c] == 0.0 ? FORWARD : BACKWARD;
        return dissipates ? 2 : 0;
    }
    if (tangential_state == STICK) {
        tangential_state = which == 1 ? FORWARD : BACKWARD;
        return 1;
    }
    if (which != 1) {  // nothing presses any more
        tangential_state = FREE;
        return dissipates ? 1 : 0;
    }
    const bool forward = tangential_state == FORWARD;
    tangential_state = STICK;
    return forward ? 1 : 2;
}

// Changes of λ and τ from those of C u and T u: at t (offset 1), or their derivatives by t (t = 1, offset 0).
//
// Where stuck, C u + ta − b = εw(λ − λ°) and T u + td = εw_t(τ − τ°); where sliding, what is beyond the latter is the slip
// σ, and τ = ±μλ.
void Path::set_forces(std::array<Vector, 4>& x, double t, double offset) const {
    const Forces of{x[V].data(), x[S].data(), push_[0].data(), push_[1].data(), start_[0].data(), start_[1].data(), reference_[0].data(), reference_[1].data(),
                    firm_[0].data(), firm_[1].data(), reference_push_.data(), p_.friction.data(), p_.normal_dashpot.data(), now_.closed.data(), now_.tangential_state.data(), t, offset};
    forces_of(of, x[LAM].data(), x[TAU].data(), p_.k);
}

namespace {

// α, β, γ of a contact, and what of γ is not of dissipation.
struct Weight {
    double nn, tt, tn, firm;
};
Weight weight_of(const FrictionProblem& p, double compliance, int c, const States& states) {
    const std::uint8_t tangential_state = states.tangential_state[c];
    const double firm = states.closed[c] ? 1.0 / (compliance * p.inverse_mass[c]) : 0.0, alpha = p.normal_dashpot[c] + firm;
    const double beta = p.tangential_dashpot[c] + (tangential_state == STICK ? 1.0 / (compliance * p.tangent_inverse[c]) : 0.0);
    const double by = slope(tangential_state, p.friction[c]);
    return {alpha, beta, by * alpha, by * firm};
}

// n and t components of the velocities u (n·3) at a contact.
struct At {
    double v, s;
};
At at_contact(const FrictionProblem& p, int c, const Vector& u) {
    const int i = 3 * p.first[c], j = 3 * p.second[c];
    double x = u[i], y = u[i + 1], turn = p.lever_first[c] * u[i + 2];
    if (j >= 0) x -= u[j], y -= u[j + 1], turn += p.lever_second[c] * u[j + 2];
    At at{p.nx[c] * x + p.ny[c] * y, p.nx[c] * y - p.ny[c] * x + turn};
    if (p.compound()) at.v += p.turn_first[c] * u[i + 2] + (j >= 0 ? p.turn_second[c] * u[j + 2] : 0.0);
    return at;
}

}  // namespace

// Factorise the matrix of the states now; velocities and forces at t from it, without drift.
bool Path::restart(double t) {
    for (int c = 0; c < p_.k; ++c) {
        firm_[0][c] = 1.0 / (compliance * p_.inverse_mass[c]), firm_[1][c] = 1.0 / (compliance * p_.tangent_inverse[c]);
        const Weight one = weight_of(p_, compliance, c, now_);
        weights_.nn[c] = one.nn, weights_.tt[c] = one.tt, weights_.tn[c] = one.tn;
    }
    for (Index c : changed_) slot_[c] = -1;
    changed_.clear();
    base_ = now_;
    if (!factor_.factorise(p_, weights_)) return false;
    std::fill(base_rate_.begin(), base_rate_.end(), 0.0);
    std::fill(dx_[V].begin(), dx_[V].end(), 0.0);
    std::fill(dx_[S].begin(), dx_[S].end(), 0.0);
    set_forces(dx_, 1.0, 0.0);
    add_impulses(p_, dx_[LAM], dx_[TAU], -1.0, base_rate_);
    for (int repeat = 0; repeat < 3; ++repeat) {
        contact_velocities(p_, u_, x_[V], x_[S]);
        set_forces(x_, t, 1.0);
        for (std::size_t i = 0; i < u_.size(); ++i) residual_[i] = -p_.mass[i] * u_[i];
        for (int c = 0; c < p_.k; ++c) {
            normal_[c] = x_[LAM][c] + p_.normal_dashpot[c] * x_[V][c];
            tangential_[c] = x_[TAU][c] + p_.tangential_dashpot[c] * x_[S][c];
        }
        add_impulses(p_, normal_, tangential_, -1.0, residual_);
        if (repeat == 0) factor_.solve(residual_, base_rate_);
        else factor_.solve(residual_);
        for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += residual_[i];
    }
    contact_velocities(p_, u_, x_[V], x_[S]);
    set_forces(x_, t, 1.0);
    return true;
}

// Add contact c to those whose state has changed since the factorisation.
void Path::add_column(int c) {
    const int q = int(changed_.size()), size = 2 * CHANGES;
    changed_.push_back(c), slot_[c] = q;
    const int i = 3 * p_.first[c], j = 3 * p_.second[c];
    for (int b = 0; b < 2; ++b) {
        Vector& column = columns_[2 * q + b];
        std::fill(column.begin(), column.end(), 0.0);
        const double x = b == 0 ? p_.nx[c] : -p_.ny[c], y = b == 0 ? p_.ny[c] : p_.nx[c];
        column[i] = x, column[i + 1] = y;
        if (b == 1) column[i + 2] = p_.lever_first[c];
        else if (p_.compound()) column[i + 2] = p_.turn_first[c];
        if (j < 0) continue;
        column[j] = -x, column[j + 1] = -y;
        if (b == 1) column[j + 2] = p_.lever_second[c];
        else if (p_.compound()) column[j + 2] = p_.turn_second[c];
    }
    factor_.solve(columns_[2 * q], columns_[2 * q + 1]);
    for (int o = 0; o <= q; ++o)
        for (int b = 0; b < 2; ++b) {
            At at = at_contact(p_, changed_[o], columns_[2 * q + b]);
            gram_[2 * o * size + 2 * q + b] = at.v, gram_[(2 * o + 1) * size + 2 * q + b] = at.s;
            at = at_contact(p_, c, columns_[2 * o + b]);
            gram_[2 * q * size + 2 * o + b] = at.v, gram_[(2 * q + 1) * size + 2 * o + b] = at.s;
        }
    const At at = at_contact(p_, c, base_rate_);
    base_rate_at_[2 * q] = at.v, base_rate_at_[2 * q + 1] = at.s;
}

// Derivatives by t with the states now: the factorised matrix and the rank-two changes of the contacts that have changed
// (Woodbury).
void Path::find_rate() {
    const int size = 2 * int(changed_.size());
    rate_ = base_rate_;
    if (size > 0) {
        matrix_.assign(std::size_t(size) * size, 0.0), solution_.resize(size);
        for (int q = 0; q < size / 2; ++q) {
            const int c = changed_[q];
            const Weight now = weight_of(p_, compliance, c, now_), then = weight_of(p_, compliance, c, base_);
            const double a = push_[0][c] + base_rate_at_[2 * q], d = push_[1][c] + base_rate_at_[2 * q + 1];
            const double alpha = now.nn - then.nn, beta = now.tt - then.tt, gamma = now.tn - then.tn;
            solution_[2 * q] = -alpha * a;
            solution_[2 * q + 1] = -(now.firm - then.firm) * push_[0][c] - gamma * base_rate_at_[2 * q] - beta * d;
            for (int o = 0; o < size; ++o) {
                const double normal = gram_[2 * q * 2 * CHANGES + o], tangential = gram_[(2 * q + 1) * 2 * CHANGES + o];
                matrix_[2 * q * size + o] = alpha * normal;
                matrix_[(2 * q + 1) * size + o] = gamma * normal + beta * tangential;
            }
        }
        for (int q = 0; q < size; ++q) matrix_[q * size + q] += 1.0;
        solve_dense(matrix_, solution_);
        add_columns(rate_.data(), columns_, solution_, rate_.size());
    }
    contact_velocities(p_, rate_, dx_[V], dx_[S]);
    set_forces(dx_, 1.0, 0.0);
}

void Path::move(double step) {
    add(u_.data(), rate_.data(), step, u_.size());
    for (int part = 0; part < 4; ++part) add(x_[part].data(), dx_[part].data(), step, p_.k);
}

Path::End Path::follow(double direction, int max_pivots) {
    double t = 1.0;
    std::uint64_t key = 0;
    int last = -1, grows = 0;
    visited_.clear();
    if (!restart(t)) return End::BROKEN;
    for (int pivot = 0; pivot < max_pivots; ++pivot, ++pivots) {
        find_rate();
        if (last >= 0) {
            const Margins m = margins(last, t);
            const double rate = m[grows].rate;
            direction = rate > 0.0 ? 1.0 : -1.0;
            if (!(std::abs(rate) < INFINITE)) return End::BROKEN;
        }
        const Event event = next_event(t, direction);
        if (direction < 0.0 && event.step >= t) {
            move(-t);
            return restart(0.0) ? End::ARRIVED : End::BROKEN;
        }
        if (event.contact < 0 || t + direction * event.step > FARTHEST) return End::AWAY;
        move(direction * event.step);
        t += direction * event.step;
        last = event.contact;
        key ^= word_of(now_, last);
        grows = change(event, t);
        key ^= word_of(now_, last);
        if (std::find(visited_.begin(), visited_.end(), key) != visited_.end()) return End::LOOP;
        visited_.push_back(key);
        if (slot_[last] < 0 && changed_.size() >= CHANGES) {
            if (!restart(t)) return End::BROKEN;
        } else if (slot_[last] < 0) {
            add_column(last);
        }
    }
    return End::LONG;
}

FrictionSolution Path::solution() const {
    FrictionSolution at{x_[LAM], x_[TAU], u_};
    for (int c = 0; c < p_.k; ++c) at.reaction[c] += reference_[0][c], at.tangential[c] += reference_[1][c];
    for (std::size_t i = 0; i < at.velocity.size(); ++i) at.velocity[i] += origin_[i];
    return at;
}

void into_cones(const FrictionProblem& p, FrictionSolution& iterate) {
    Vector v(p.k), s(p.k);
    if (p.dissipates) contact_velocities(p, iterate.velocity, v, s);
    for (int c = 0; c < p.k; ++c) {
        iterate.reaction[c] = std::max(iterate.reaction[c], 0.0);
        const double limit = p.friction[c] * std::max(normal_push(p, c, v[c], iterate.reaction[c]), 0.0);
        iterate.tangential[c] = std::min(std::max(iterate.tangential[c], -limit), limit);
    }
    if (!p.dissipates) equilibrium_velocity(p, iterate.reaction, iterate.tangential, iterate.velocity);
}

ProximalPoints::ProximalPoints(const FrictionProblem& p, Path& path, FrictionSolution at) : p_(p), path_(path), at_(std::move(at)), compliance_(FIRST), max_pivots_(PIVOTS) {
    Path::clean(p, at_);
}

bool ProximalPoints::step() {
    path_.compliance = compliance_;
    path_.begin(at_, BRINK * p_.scale, tries_);
    const int before = path_.pivots;
    const Path::End end = path_.follow(-1.0, max_pivots_);
    pivots = path_.pivots - before, cost = STEP + pivots;
    if (end != Path::End::ARRIVED) {
        ++tries_;
        if (compliance_ >= POINT_SOFTEST) max_pivots_ *= 2;
        compliance_ = std::min(SOFTER * compliance_, POINT_SOFTEST);
        return false;
    }
    at_ = path_.solution();
    if (pivots <= FEW) compliance_ = std::max(FIRMER * compliance_, POINT_FIRMEST);
    into_cones(p_, at_);
    return true;
}

}  // namespace nscd
