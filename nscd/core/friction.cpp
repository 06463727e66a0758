#include "friction.hpp"

#include <algorithm>
#include <utility>

#include "closed.hpp"

namespace nscd {

namespace {

// A contact slides if it does so faster than this share of the scale of velocities.
constexpr double SLIDING = 1e-9;
// Velocities are measured in no less, m/s: squares of what is far below are no numbers.
constexpr double SLOWEST = 1e-100;

double infinite_if_none(double value) { return value < INFINITE ? value : INFINITE; }

// The largest imbalance of a disk over what it has and receives, m · scale + Σ|p|: `tell` is given disks and these.
template <class Tell>
void imbalance_of_disks(const Rubbing& p, In pn, In pt, In rest, Tell&& tell) {
    Numbers size(p.n), lever(p.n, 0.0);
    for (int i = 0; i < p.n; ++i) size[i] = p.mass[3 * i] * p.scale;
    for (int c = 0; c < p.k; ++c) {
        const int i = p.first[c], j = p.second[c];
        const double push = std::abs(pn[c]) + std::abs(pt[c]);
        size[i] += push, lever[i] = std::max(lever[i], p.lever_first[c]);
        if (j >= 0) size[j] += push, lever[j] = std::max(lever[j], p.lever_second[c]);
    }
    if (p.wide()) lever = p.reach;
    for (int i = 0; i < p.n; ++i) {
        double off = larger(std::abs(rest[3 * i]), std::abs(rest[3 * i + 1]));
        if (lever[i] > 0.0) off = larger(off, std::abs(rest[3 * i + 2]) / lever[i]);
        tell(i, off / size[i]);
    }
}

}  // namespace

void Rubbing::prepare() {
    d = 3;
    free = left;
    if (along.empty()) along.assign(k, 0.0), across.assign(k, 0.0);
    inverse_mass.resize(k), tangent_inverse.resize(k), left_v.resize(k), left_s.resize(k);
    dissipates = false;
    for (int c = 0; c < k; ++c) {
        const int i = 3 * first[c], j = 3 * second[c];
        inverse_mass[c] = 1.0 / mass[i] + (j >= 0 ? 1.0 / mass[j] : 0.0);
        tangent_inverse[c] = inverse_mass[c] + lever_first[c] * lever_first[c] / mass[i + 2];
        if (j >= 0) tangent_inverse[c] += lever_second[c] * lever_second[c] / mass[j + 2];
        if (wide()) inverse_mass[c] += turn_first[c] * turn_first[c] / mass[i + 2] + (j >= 0 ? turn_second[c] * turn_second[c] / mass[j + 2] : 0.0);
        dissipates = dissipates || along[c] != 0.0 || across[c] != 0.0;
    }
    contact_velocities(*this, left, left_v, left_s);
    islands = components(n, first, second, island);
}

Rubbing rubbing_of(const System& flat, In radius, In spin, In inertia, Numbers friction) {
    Rubbing p;
    static_cast<System&>(p) = flat;
    p.friction = std::move(friction);
    p.scale = std::max(p.scale, SLOWEST);
    if (p.wide()) {
        p.prepare();
        return p;
    }
    p.mass.clear(), p.left.clear();
    for (int i = 0; i < p.n; ++i) {
        p.mass.insert(p.mass.end(), {flat.mass[2 * i], flat.mass[2 * i + 1], inertia[i]});
        p.left.insert(p.left.end(), {flat.left[2 * i], flat.left[2 * i + 1], spin[i]});
        p.scale = std::max(p.scale, std::abs(spin[i]) * radius[i]);
    }
    p.lever_first.resize(p.k), p.lever_second.resize(p.k);
    for (int c = 0; c < p.k; ++c) {
        p.lever_first[c] = radius[p.first[c]];
        p.lever_second[c] = p.second[c] >= 0 ? radius[p.second[c]] : 0.0;
    }
    p.prepare();
    return p;
}

Rubbing chosen(const Rubbing& whole, std::span<const Index> contact, std::span<const Index> disk) {
    Places place(whole.n, -1);
    for (std::size_t i = 0; i < disk.size(); ++i) place[disk[i]] = Index(i);
    Rubbing p;
    static_cast<System&>(p) = chosen(static_cast<const System&>(whole), contact, disk, place);
    p.scale = whole.scale;
    p.friction.resize(p.k);
    for (int c = 0; c < p.k; ++c) p.friction[c] = whole.friction[contact[c]];
    p.prepare();
    return p;
}

void contact_velocities(const Rubbing& p, In u, Out v, Out s) {
    const double* at = u.data();
    const bool wide = p.wide();
    for (int c = 0; c < p.k; ++c) {
        const int i = 3 * p.first[c], j = 3 * p.second[c];
        double x = at[i], y = at[i + 1], turn = p.lever_first[c] * at[i + 2];
        if (j >= 0) x -= at[j], y -= at[j + 1], turn += p.lever_second[c] * at[j + 2];
        v[c] = p.nx[c] * x + p.ny[c] * y;
        s[c] = p.nx[c] * y - p.ny[c] * x + turn;
        if (wide) v[c] += p.turn_first[c] * at[i + 2] + (j >= 0 ? p.turn_second[c] * at[j + 2] : 0.0);
    }
}

void add_impulses(const Rubbing& p, In along, In across, double factor, Out b) {
    const bool wide = p.wide();
    for (int c = 0; c < p.k; ++c) {
        const int i = 3 * p.first[c], j = 3 * p.second[c];
        const double one = factor * along[c], two = factor * across[c];
        const double x = p.nx[c] * one - p.ny[c] * two, y = p.ny[c] * one + p.nx[c] * two;
        b[i] += x, b[i + 1] += y, b[i + 2] += p.lever_first[c] * two;
        if (j >= 0) b[j] -= x, b[j + 1] -= y, b[j + 2] += p.lever_second[c] * two;
        if (!wide) continue;
        b[i + 2] += p.turn_first[c] * one;
        if (j >= 0) b[j + 2] += p.turn_second[c] * one;
    }
}

void balance(const Rubbing& p, In pn, In pt, Out u) {
    std::fill(u.begin(), u.end(), 0.0);
    add_impulses(p, pn, pt, -1.0, u);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = p.left[i] + u[i] / p.mass[i];
}

void imbalance(const Rubbing& p, In u, In v, In s, In lam, In tau, Out out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = p.mass[i] * (u[i] - p.left[i]);
    if (!p.dissipates) return add_impulses(p, lam, tau, 1.0, out);
    Numbers pn(p.k), pt(p.k);
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], lam[c]);
        pt[c] = p.across[c] * (s[c] + p.left_s[c]) + tau[c];
    }
    add_impulses(p, pn, pt, 1.0, out);
}

Numbers measure(const Rubbing& p, const Rubbed& at) {
    Numbers v(p.k), s(p.k), rest(p.mass.size()), pn(p.k), pt(p.k), error(p.islands, 0.0);
    contact_velocities(p, at.u, v, s);
    imbalance(p, at.u, v, s, at.lam, at.tau, rest);
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], at.lam[c]);
        pt[c] = p.across[c] * (s[c] + p.left_s[c]) + at.tau[c];
        const Off off = natural_map(p, c, pn[c], at.lam[c], at.tau[c], v[c], s[c]);
        double& worst = error[p.island[p.first[c]]];
        worst = std::max(worst, infinite_if_none(larger(std::abs(off.normal), std::abs(off.tangential)) / p.scale));
    }
    imbalance_of_disks(p, pn, pt, rest, [&](int i, double off) {
        double& worst = error[p.island[i]];
        worst = std::max(worst, infinite_if_none(off));
    });
    return error;
}

FrictionCertificate certified(const Rubbing& p, const Rubbed& at) {
    FrictionCertificate of;
    Numbers v(p.k), s(p.k), pn(p.k), pt(p.k), rest(p.mass.size());
    contact_velocities(p, at.u, v, s);
    of.impulse.resize(2 * std::size_t(p.k)), of.state.assign(p.k, std::int8_t(Contact::OPEN));
    double missing = 0.0;
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], at.lam[c]);
        pt[c] = p.across[c] * (s[c] + p.left_s[c]) + at.tau[c];
        const double most = p.friction[c] * std::max(pn[c], 0.0), w = p.inverse_mass[c], wt = p.tangent_inverse[c];
        const Off off = natural_map(p, c, pn[c], at.lam[c], at.tau[c], v[c], s[c]);
        of.signorini = larger(of.signorini, std::abs(off.normal));
        of.natural_map = larger(of.natural_map, larger(std::abs(off.normal), std::abs(off.tangential)));
        of.cone = larger(of.cone, wt * std::max(std::abs(at.tau[c]) - most, 0.0));
        missing += std::abs(most * std::abs(s[c]) - at.tau[c] * s[c]);
        of.work += pn[c] * (v[c] + p.left_v[c]) + pt[c] * (s[c] + p.left_s[c]);
        of.impulse[2 * c] = pn[c] * p.nx[c] - pt[c] * p.ny[c];
        of.impulse[2 * c + 1] = pn[c] * p.ny[c] + pt[c] * p.nx[c];
        if (!(w * at.lam[c] > p.offset[c] - v[c] || p.along[c] * (v[c] + p.left_v[c]) > 0.0)) continue;
        const bool slides = std::abs(s[c]) > SLIDING * p.scale || most == 0.0;
        of.state[c] = std::int8_t(!slides ? Contact::STICK : s[c] >= 0.0 ? Contact::FORWARD : Contact::BACKWARD);
    }
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const double before = p.left[i], after = at.u[i];
        rest[i] = p.mass[i] * (after - before);
        of.energy += 0.5 * p.mass[i] * before * before;
        of.change += 0.5 * p.mass[i] * (after - before) * (after + before);
    }
    add_impulses(p, pn, pt, 1.0, rest);
    imbalance_of_disks(p, pn, pt, rest, [&](int, double off) { of.momentum_error = larger(of.momentum_error, off); });
    of.signorini /= p.scale, of.natural_map /= p.scale, of.cone /= p.scale;
    of.dissipation = missing / (of.energy != 0.0 ? of.energy : 1.0);
    return of;
}

bool act(Rubbing& p, const Numbers& along, In u) {
    const Numbers before = std::exchange(p.along, acting(p, along, u));
    return p.along != before;
}

}  // namespace nscd
