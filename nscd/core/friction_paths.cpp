#include "friction_paths.hpp"

#include <algorithm>

#include "levels.hpp"

namespace nscd {

namespace {

// Contacts that may change before the matrix is factorised again.
constexpr int CHANGES = 24;
// Farther than this from the start a path is given up.
constexpr double FARTHEST = 20.0;
// Of the proximal point method: compliance at first and its bounds; it falls by FIRMER after a step of at most FEW pivots and
// grows by SOFTER where there is none.
constexpr double FIRST = 1e-3, POINT_FIRMEST = 1e-10, POINT_SOFTEST = 1.0, FIRMER = 0.3, SOFTER = 10.0;
constexpr int FEW = 15;
// Where a path does not arrive but comes at least so near, the step ends there, and contacts get softer by LITTLE_SOFTER.
constexpr double NEAR_ENOUGH = 0.5, LITTLE_SOFTER = 5.0, NEARER = 0.9;
// Pivots allowed for a step; what its factorisations cost, in pivots.
constexpr int PIVOTS = 300, STEP = 15;
// Noise on contacts that are on the brink of another state, of the scale of velocities.
constexpr double BRINK = 1e-9;

enum { V, S, LAM, TAU };

// A word of one contact's state; states of all are their exclusive or.
std::uint64_t word_of(int contact, int hold) { return Random(4u * contact + hold).word(); }

// to += Σ by_q · columns_q.
LEVELS void add_columns(double* __restrict to, const std::vector<Numbers>& columns, const Numbers& by, std::size_t size) {
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

}  // namespace

std::uint64_t Random::word() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

Path::Path(const Rubbing& p, FrictionFactor& factor)
    : p_(p), factor_(factor), hold_(p.k, FREE), base_(p.k, FREE), origin_(p.mass.size()), u_(p.mass.size()), rate_(p.mass.size()),
      base_rate_(p.mass.size()), slot_(p.k, -1), weights_(p.k), columns_(2 * CHANGES, Numbers(p.mass.size())),
      gram_(4 * CHANGES * CHANGES), known_(2 * CHANGES), rest_(p.mass.size()) {
    for (auto* parts : {&start_, &held_, &push_, &firm_, &nearest_})
        for (Numbers& part : *parts) part.assign(p.k, 0.0);
    for (auto* parts : {&x_, &dx_})
        for (Numbers& part : *parts) part.assign(p.k, 0.0);
}

void Path::clean(const Rubbing& p, Rubbed& at) {
    Numbers v(p.k), s(p.k);
    contact_velocities(p, at.u, v, s);
    for (int c = 0; c < p.k; ++c) {
        double &lam = at.lam[c], &tau = at.tau[c];
        const double most = p.friction[c] * lam;
        if (p.inverse_mass[c] * lam <= p.offset[c] - v[c] || lam <= 0.0) lam = tau = 0.0;
        else if (std::abs(s[c]) >= p.tangent_inverse[c] * (most - std::abs(tau))) tau = s[c] >= 0.0 ? most : -most;
    }
}

void Path::begin(In lam, In tau, double noise, std::uint64_t seed) {
    Random random(seed);
    std::fill(u_.begin(), u_.end(), 0.0);
    balance(p_, lam, tau, origin_);
    contact_velocities(p_, origin_, start_[0], start_[1]);
    for (int c = 0; c < p_.k; ++c) {
        start_[0][c] -= p_.offset[c];
        const double mu = p_.friction[c], gap = -start_[0][c], s = start_[1][c], away = noise * random.number();
        double d = 0.0;
        hold_[c] = FREE;
        if (lam[c] > 0.0) {
            if (std::abs(tau[c]) < (1.0 - 1e-12) * mu * lam[c]) hold_[c] = STICK, d = -s;
            else if (tau[c] > 0.0 || mu == 0.0) hold_[c] = FORWARD, d = std::max(0.0, away - s);
            else hold_[c] = BACKWARD, d = std::min(0.0, -away - s);
            if (mu == 0.0) d = 0.0;
        }
        push_[0][c] = hold_[c] != FREE ? gap : std::min(0.0, gap - away);
        push_[1][c] = d;
        held_[0][c] = lam[c], held_[1][c] = tau[c];
    }
}

Path::Margins Path::margins(int c, double t) const {
    const double mu = p_.friction[c];
    const std::uint8_t hold = hold_[c];
    if (hold == FREE) {
        const double w = compliance * p_.inverse_mass[c];
        return {-start_[0][c] - x_[V][c] - t * push_[0][c] - w * held_[0][c], -dx_[V][c] - push_[0][c], INFINITE, 0.0};
    }
    const double lam = held_[0][c] + x_[LAM][c];
    if (hold == STICK) {
        const double tau = held_[1][c] + x_[TAU][c], one = mu * lam, two = mu * dx_[LAM][c];
        return {one - tau, two - dx_[TAU][c], one + tau, two + dx_[TAU][c]};
    }
    if (mu == 0.0) return {lam, dx_[LAM][c], INFINITE, 0.0};
    const double way = hold == FORWARD ? 1.0 : -1.0, wt = compliance * p_.tangent_inverse[c];
    return {lam, dx_[LAM][c], way * (start_[1][c] + x_[S][c] + t * push_[1][c] - wt * x_[TAU][c]),
            way * (dx_[S][c] + push_[1][c] - wt * dx_[TAU][c])};
}

Path::Event Path::next_event(double t, double way) const {
    Event next;
    for (int c = 0; c < p_.k; ++c) {
        const Margins m = margins(c, t);
        const double one = -way * m.by_one, two = -way * m.by_two;  // how fast they are used up
        if (one > 0.0 && std::max(m.one, 0.0) < next.step * one) next = {std::max(m.one, 0.0) / one, c, 0};
        if (two > 0.0 && std::max(m.two, 0.0) < next.step * two) next = {std::max(m.two, 0.0) / two, c, 1};
    }
    return next;
}

// Change the state of a contact one of whose margins is used up; the margin of the new state that has to grow.
int Path::change(const Event& event, double t) {
    const int c = event.contact;
    std::uint8_t& hold = hold_[c];
    if (hold == FREE) {
        const double slid = start_[1][c] + x_[S][c] + t * push_[1][c] + compliance * p_.tangent_inverse[c] * held_[1][c];
        hold = slid >= 0.0 || p_.friction[c] == 0.0 ? FORWARD : BACKWARD;
        return 0;
    }
    if (hold == STICK) {
        hold = event.which == 0 ? FORWARD : BACKWARD;
        return 1;
    }
    if (event.which == 0) {
        hold = FREE;
        return 0;
    }
    const bool forward = hold == FORWARD;
    hold = STICK;
    return forward ? 0 : 1;
}

// Changes of λ and τ from those of C u and T u: at t (offset 1), or their derivatives by t (t = 1, offset 0).
//
// Where stuck, C u + ta − b = εw(λ − λ°) and T u + td = εw_t(τ − τ°); where sliding, what is beyond the latter is the slip
// σ, and τ = ±μλ.
void Path::set_forces(std::array<Numbers, 4>& x, double t, double offset) const {
    for (int c = 0; c < p_.k; ++c) {
        const std::uint8_t hold = hold_[c];
        const double along = offset * held_[0][c], across = offset * held_[1][c];
        if (hold == FREE) {
            x[LAM][c] = -along, x[TAU][c] = -across;
            continue;
        }
        x[LAM][c] = (x[V][c] + t * push_[0][c] + offset * start_[0][c]) * firm_[0][c];
        if (hold == STICK) x[TAU][c] = (x[S][c] + t * push_[1][c] + offset * start_[1][c]) * firm_[1][c];
        else x[TAU][c] = slope(hold, p_.friction[c]) * (along + x[LAM][c]) - across;
    }
}

namespace {

struct Weight {
    double along, across, turned;
};
Weight weight_of(const Rubbing& p, double compliance, int c, std::uint8_t hold) {
    if (hold == FREE) return {0.0, 0.0, 0.0};
    const double alpha = 1.0 / (compliance * p.inverse_mass[c]);
    if (hold == STICK) return {alpha, 1.0 / (compliance * p.tangent_inverse[c]), 0.0};
    return {alpha, 0.0, alpha * slope(hold, p.friction[c])};
}

// n and t components of the velocities u (n·3) at a contact.
struct At {
    double v, s;
};
At at_contact(const Rubbing& p, int c, const Numbers& u) {
    const int i = 3 * p.first[c], j = 3 * p.second[c];
    double x = u[i], y = u[i + 1], turn = p.lever_first[c] * u[i + 2];
    if (j >= 0) x -= u[j], y -= u[j + 1], turn += p.lever_second[c] * u[j + 2];
    return {p.nx[c] * x + p.ny[c] * y, p.nx[c] * y - p.ny[c] * x + turn};
}

}  // namespace

// Factorise the matrix of the states now; velocities and forces at t from it, without drift.
bool Path::restart(double t) {
    for (int c = 0; c < p_.k; ++c) {
        firm_[0][c] = 1.0 / (compliance * p_.inverse_mass[c]), firm_[1][c] = 1.0 / (compliance * p_.tangent_inverse[c]);
        const Weight one = weight_of(p_, compliance, c, hold_[c]);
        weights_.along[c] = one.along, weights_.across[c] = one.across, weights_.turned[c] = one.turned;
    }
    for (Index c : changed_) slot_[c] = -1;
    changed_.clear();
    base_ = hold_;
    if (!factor_.factorise(p_, weights_)) return false;
    std::fill(base_rate_.begin(), base_rate_.end(), 0.0);
    std::fill(dx_[V].begin(), dx_[V].end(), 0.0);
    std::fill(dx_[S].begin(), dx_[S].end(), 0.0);
    set_forces(dx_, 1.0, 0.0);
    add_impulses(p_, dx_[LAM], dx_[TAU], -1.0, base_rate_);
    for (int repeat = 0; repeat < 3; ++repeat) {
        contact_velocities(p_, u_, x_[V], x_[S]);
        set_forces(x_, t, 1.0);
        for (std::size_t i = 0; i < u_.size(); ++i) rest_[i] = -p_.mass[i] * u_[i];
        add_impulses(p_, x_[LAM], x_[TAU], -1.0, rest_);
        if (repeat == 0) factor_.solve(rest_, base_rate_);
        else factor_.solve(rest_);
        for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += rest_[i];
    }
    contact_velocities(p_, u_, x_[V], x_[S]);
    set_forces(x_, t, 1.0);
    return true;
}

// Add contact c to those whose state has changed since the factorisation.
void Path::take(int c) {
    const int q = int(changed_.size()), size = 2 * CHANGES;
    changed_.push_back(c), slot_[c] = q;
    const int i = 3 * p_.first[c], j = 3 * p_.second[c];
    for (int b = 0; b < 2; ++b) {
        Numbers& column = columns_[2 * q + b];
        std::fill(column.begin(), column.end(), 0.0);
        const double x = b == 0 ? p_.nx[c] : -p_.ny[c], y = b == 0 ? p_.ny[c] : p_.nx[c];
        column[i] = x, column[i + 1] = y;
        if (b == 1) column[i + 2] = p_.lever_first[c];
        if (j < 0) continue;
        column[j] = -x, column[j + 1] = -y;
        if (b == 1) column[j + 2] = p_.lever_second[c];
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
    known_[2 * q] = at.v, known_[2 * q + 1] = at.s;
}

// Derivatives by t with the states now: the factorised matrix and the rank-two changes of the contacts that have changed
// (Woodbury).
void Path::find_rate() {
    const int size = 2 * int(changed_.size());
    rate_ = base_rate_;
    if (size > 0) {
        matrix_.assign(std::size_t(size) * size, 0.0), share_.resize(size);
        for (int q = 0; q < size / 2; ++q) {
            const int c = changed_[q];
            const Weight now = weight_of(p_, compliance, c, hold_[c]), then = weight_of(p_, compliance, c, base_[c]);
            const double a = push_[0][c] + known_[2 * q], d = push_[1][c] + known_[2 * q + 1];
            const double alpha = now.along - then.along, beta = now.across - then.across, gamma = now.turned - then.turned;
            share_[2 * q] = -alpha * a;
            share_[2 * q + 1] = -gamma * a - beta * d;
            for (int o = 0; o < size; ++o) {
                const double along = gram_[2 * q * 2 * CHANGES + o], across = gram_[(2 * q + 1) * 2 * CHANGES + o];
                matrix_[2 * q * size + o] = alpha * along;
                matrix_[(2 * q + 1) * size + o] = gamma * along + beta * across;
            }
        }
        for (int q = 0; q < size; ++q) matrix_[q * size + q] += 1.0;
        solve_dense(matrix_, share_);
        add_columns(rate_.data(), columns_, share_, rate_.size());
    }
    contact_velocities(p_, rate_, dx_[V], dx_[S]);
    set_forces(dx_, 1.0, 0.0);
}

void Path::move(double step) {
    add(u_.data(), rate_.data(), step, u_.size());
    for (int part = 0; part < 4; ++part) add(x_[part].data(), dx_[part].data(), step, p_.k);
}

Path::End Path::follow(double way, int most) {
    double t = 1.0;
    std::uint64_t key = 0;
    int last = -1, grows = 0;
    seen_.clear();
    nearest = 1.0;
    if (!restart(t)) return End::BROKEN;
    for (int pivot = 0; pivot < most; ++pivot, ++pivots) {
        find_rate();
        if (last >= 0) {
            const Margins m = margins(last, t);
            const double rate = grows == 0 ? m.by_one : m.by_two;
            way = rate > 0.0 ? 1.0 : -1.0;
            if (!(std::abs(rate) < INFINITE)) return End::BROKEN;
        }
        const Event event = next_event(t, way);
        if (way < 0.0 && event.step >= t) {
            move(-t);
            return restart(0.0) ? End::ARRIVED : End::BROKEN;
        }
        if (event.contact < 0 || t + way * event.step > FARTHEST) return End::AWAY;
        move(way * event.step);
        t += way * event.step;
        if (t < NEARER * nearest) nearest = t, nearest_[0] = x_[LAM], nearest_[1] = x_[TAU];
        const int before = hold_[event.contact];
        grows = change(event, t);
        last = event.contact;
        key ^= word_of(last, before) ^ word_of(last, hold_[last]);
        if (std::find(seen_.begin(), seen_.end(), key) != seen_.end()) return End::LOOP;
        seen_.push_back(key);
        if (slot_[last] < 0 && changed_.size() >= CHANGES) {
            if (!restart(t)) return End::BROKEN;
        } else if (slot_[last] < 0) {
            take(last);
        }
    }
    return End::LONG;
}

Rubbed Path::answer() const {
    Rubbed at{x_[LAM], x_[TAU], u_};
    for (int c = 0; c < p_.k; ++c) at.lam[c] += held_[0][c], at.tau[c] += held_[1][c];
    for (std::size_t i = 0; i < u_.size(); ++i) at.u[i] += origin_[i];
    return at;
}

Rubbed Path::nearest_answer() const {
    Rubbed at{nearest_[0], nearest_[1], u_};
    for (int c = 0; c < p_.k; ++c) at.lam[c] += held_[0][c], at.tau[c] += held_[1][c];
    return at;
}

ProximalPoints::ProximalPoints(const Rubbing& p, Path& path, Rubbed at) : p_(p), path_(path), at_(std::move(at)), compliance_(FIRST), most_(PIVOTS) {
    Path::clean(p, at_);
}

bool ProximalPoints::step() {
    path_.compliance = compliance_;
    path_.begin(at_.lam, at_.tau, BRINK * p_.scale, tries_);
    const int before = path_.pivots;
    const Path::End end = path_.follow(-1.0, most_);
    pivots = path_.pivots - before, cost = STEP + pivots;
    if (end == Path::End::ARRIVED) {
        at_ = path_.answer();
        if (pivots <= FEW) compliance_ = std::max(FIRMER * compliance_, POINT_FIRMEST);
    } else {
        ++tries_;
        const bool near = path_.nearest < NEAR_ENOUGH;
        if (!near && compliance_ >= POINT_SOFTEST) most_ *= 2;
        compliance_ = std::min((near ? LITTLE_SOFTER : SOFTER) * compliance_, POINT_SOFTEST);
        if (!near) return false;
        at_ = path_.nearest_answer();
    }
    for (int c = 0; c < p_.k; ++c) {
        at_.lam[c] = std::max(at_.lam[c], 0.0);
        const double m = p_.friction[c] * at_.lam[c];
        at_.tau[c] = std::min(std::max(at_.tau[c], -m), m);
    }
    balance(p_, at_.lam, at_.tau, at_.u);
    return true;
}

}  // namespace nscd
