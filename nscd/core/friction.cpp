#include "friction.hpp"

#include <algorithm>
#include <utility>

#include "closed_form.hpp"

namespace nscd {

namespace {

// A contact slides if it does so faster than this share of the scale of velocities.
constexpr double SLIDING = 1e-9;
// Velocities are measured in no less, m/s: squares of what is far below are no numbers.
constexpr double SLOWEST = 1e-100;

double infinite_if_none(double value) { return value < INFINITE ? value : INFINITE; }

// The largest imbalance of a disk over what it has and receives, m · scale + Σ|p|: `tell` is given disks and these.
template <class Tell>
void imbalance_of_disks(const FrictionProblem& p, In pn, In pt, In residual, Tell&& tell) {
    Vector size(p.n), lever(p.n, 0.0);
    for (int i = 0; i < p.n; ++i) size[i] = p.mass[3 * i] * p.scale;
    for (int c = 0; c < p.k; ++c) {
        const int i = p.first[c], j = p.second[c];
        const double push = std::abs(pn[c]) + std::abs(pt[c]);
        size[i] += push, lever[i] = std::max(lever[i], p.lever_first[c]);
        if (j >= 0) size[j] += push, lever[j] = std::max(lever[j], p.lever_second[c]);
    }
    if (p.compound()) lever = p.reach;
    for (int i = 0; i < p.n; ++i) {
        double imbalance = max_or_nan(std::abs(residual[3 * i]), std::abs(residual[3 * i + 1]));
        if (lever[i] > 0.0) imbalance = max_or_nan(imbalance, std::abs(residual[3 * i + 2]) / lever[i]);
        tell(i, imbalance / size[i]);
    }
}

}  // namespace

void FrictionProblem::prepare() {
    d = 3;
    free = left_velocity;
    if (normal_dashpot.empty()) normal_dashpot.assign(k, 0.0), tangential_dashpot.assign(k, 0.0);
    inverse_mass.resize(k), tangent_inverse.resize(k), left_approach.resize(k), left_sliding.resize(k);
    dissipates = false;
    for (int c = 0; c < k; ++c) {
        const int i = 3 * first[c], j = 3 * second[c];
        inverse_mass[c] = 1.0 / mass[i] + (j >= 0 ? 1.0 / mass[j] : 0.0);
        tangent_inverse[c] = inverse_mass[c] + lever_first[c] * lever_first[c] / mass[i + 2];
        if (j >= 0) tangent_inverse[c] += lever_second[c] * lever_second[c] / mass[j + 2];
        if (compound()) inverse_mass[c] += turn_first[c] * turn_first[c] / mass[i + 2] + (j >= 0 ? turn_second[c] * turn_second[c] / mass[j + 2] : 0.0);
        dissipates = dissipates || normal_dashpot[c] != 0.0 || tangential_dashpot[c] != 0.0;
    }
    contact_velocities(*this, left_velocity, left_approach, left_sliding);
    islands = components(n, first, second, island);
}

FrictionProblem friction_problem_of(const ImpactProblem& flat, In radius, In spin, In inertia, Vector friction) {
    FrictionProblem p;
    static_cast<ImpactProblem&>(p) = flat;
    p.friction = std::move(friction);
    p.scale = std::max(p.scale, SLOWEST);
    if (p.compound()) {
        p.prepare();
        return p;
    }
    p.mass.clear(), p.left_velocity.clear();
    for (int i = 0; i < p.n; ++i) {
        p.mass.insert(p.mass.end(), {flat.mass[2 * i], flat.mass[2 * i + 1], inertia[i]});
        p.left_velocity.insert(p.left_velocity.end(), {flat.left_velocity[2 * i], flat.left_velocity[2 * i + 1], spin[i]});
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

FrictionProblem restrict_to(const FrictionProblem& full, std::span<const Index> contact, std::span<const Index> disk) {
    Indices index(full.n, -1);
    for (std::size_t i = 0; i < disk.size(); ++i) index[disk[i]] = Index(i);
    FrictionProblem p;
    static_cast<ImpactProblem&>(p) = restrict_to(static_cast<const ImpactProblem&>(full), contact, disk, index);
    p.scale = full.scale;
    p.friction.resize(p.k);
    for (int c = 0; c < p.k; ++c) p.friction[c] = full.friction[contact[c]];
    p.prepare();
    return p;
}

void contact_velocities(const FrictionProblem& p, In u, Out v, Out s) {
    const double* at = u.data();
    const bool compound = p.compound();
    for (int c = 0; c < p.k; ++c) {
        const int i = 3 * p.first[c], j = 3 * p.second[c];
        double x = at[i], y = at[i + 1], turn = p.lever_first[c] * at[i + 2];
        if (j >= 0) x -= at[j], y -= at[j + 1], turn += p.lever_second[c] * at[j + 2];
        v[c] = p.nx[c] * x + p.ny[c] * y;
        s[c] = p.nx[c] * y - p.ny[c] * x + turn;
        if (compound) v[c] += p.turn_first[c] * at[i + 2] + (j >= 0 ? p.turn_second[c] * at[j + 2] : 0.0);
    }
}

void add_impulses(const FrictionProblem& p, In normal, In tangential, double factor, Out b) {
    const bool compound = p.compound();
    for (int c = 0; c < p.k; ++c) {
        const int i = 3 * p.first[c], j = 3 * p.second[c];
        const double one = factor * normal[c], two = factor * tangential[c];
        const double x = p.nx[c] * one - p.ny[c] * two, y = p.ny[c] * one + p.nx[c] * two;
        b[i] += x, b[i + 1] += y, b[i + 2] += p.lever_first[c] * two;
        if (j >= 0) b[j] -= x, b[j + 1] -= y, b[j + 2] += p.lever_second[c] * two;
        if (!compound) continue;
        b[i + 2] += p.turn_first[c] * one;
        if (j >= 0) b[j + 2] += p.turn_second[c] * one;
    }
}

void equilibrium_velocity(const FrictionProblem& p, In pn, In pt, Out u) {
    std::fill(u.begin(), u.end(), 0.0);
    add_impulses(p, pn, pt, -1.0, u);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = p.left_velocity[i] + u[i] / p.mass[i];
}

void imbalance(const FrictionProblem& p, In u, In v, In s, In lam, In tau, Out out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = p.mass[i] * (u[i] - p.left_velocity[i]);
    if (!p.dissipates) return add_impulses(p, lam, tau, 1.0, out);
    Vector pn(p.k), pt(p.k);
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], lam[c]);
        pt[c] = p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]) + tau[c];
    }
    add_impulses(p, pn, pt, 1.0, out);
}

Vector island_errors(const FrictionProblem& p, const FrictionSolution& solution) {
    Vector v(p.k), s(p.k), residual(p.mass.size()), pn(p.k), pt(p.k), error(p.islands, 0.0);
    contact_velocities(p, solution.velocity, v, s);
    imbalance(p, solution.velocity, v, s, solution.reaction, solution.tangential, residual);
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], solution.reaction[c]);
        pt[c] = p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]) + solution.tangential[c];
        const NaturalMapResidual residual = natural_map(p, c, pn[c], solution.reaction[c], solution.tangential[c], v[c], s[c]);
        double& worst = error[p.island[p.first[c]]];
        worst = std::max(worst, infinite_if_none(max_or_nan(std::abs(residual.normal), std::abs(residual.tangential)) / p.scale));
    }
    imbalance_of_disks(p, pn, pt, residual, [&](int i, double residual) {
        double& worst = error[p.island[i]];
        worst = std::max(worst, infinite_if_none(residual));
    });
    return error;
}

FrictionCertificate certificate_of(const FrictionProblem& p, const FrictionSolution& solution) {
    FrictionCertificate certificate;
    Vector v(p.k), s(p.k), pn(p.k), pt(p.k), residual(p.mass.size());
    contact_velocities(p, solution.velocity, v, s);
    certificate.impulse.resize(2 * std::size_t(p.k)), certificate.state.assign(p.k, std::int8_t(Contact::OPEN));
    double missing = 0.0;
    for (int c = 0; c < p.k; ++c) {
        pn[c] = normal_push(p, c, v[c], solution.reaction[c]);
        pt[c] = p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]) + solution.tangential[c];
        const double limit = p.friction[c] * std::max(pn[c], 0.0), w = p.inverse_mass[c], wt = p.tangent_inverse[c];
        const NaturalMapResidual residual = natural_map(p, c, pn[c], solution.reaction[c], solution.tangential[c], v[c], s[c]);
        certificate.signorini = max_or_nan(certificate.signorini, std::abs(residual.normal));
        certificate.natural_map = max_or_nan(certificate.natural_map, max_or_nan(std::abs(residual.normal), std::abs(residual.tangential)));
        certificate.cone = max_or_nan(certificate.cone, wt * std::max(std::abs(solution.tangential[c]) - limit, 0.0));
        missing += std::abs(limit * std::abs(s[c]) - solution.tangential[c] * s[c]);
        certificate.work += pn[c] * (v[c] + p.left_approach[c]) + pt[c] * (s[c] + p.left_sliding[c]);
        certificate.impulse[2 * c] = pn[c] * p.nx[c] - pt[c] * p.ny[c];
        certificate.impulse[2 * c + 1] = pn[c] * p.ny[c] + pt[c] * p.nx[c];
        if (!(w * solution.reaction[c] > p.max_approach[c] - v[c] || p.normal_dashpot[c] * (v[c] + p.left_approach[c]) > 0.0)) continue;
        const bool slides = std::abs(s[c]) > SLIDING * p.scale || limit == 0.0;
        certificate.state[c] = std::int8_t(!slides ? Contact::STICK : s[c] >= 0.0 ? Contact::FORWARD : Contact::BACKWARD);
    }
    for (std::size_t i = 0; i < residual.size(); ++i) {
        const double before = p.left_velocity[i], after = solution.velocity[i];
        residual[i] = p.mass[i] * (after - before);
        certificate.energy += 0.5 * p.mass[i] * before * before;
        certificate.change += 0.5 * p.mass[i] * (after - before) * (after + before);
    }
    add_impulses(p, pn, pt, 1.0, residual);
    imbalance_of_disks(p, pn, pt, residual, [&](int, double residual) { certificate.momentum_error = max_or_nan(certificate.momentum_error, residual); });
    certificate.signorini /= p.scale, certificate.natural_map /= p.scale, certificate.cone /= p.scale;
    certificate.dissipation = missing / (certificate.energy != 0.0 ? certificate.energy : 1.0);
    return certificate;
}

bool clamp_dashpots(FrictionProblem& p, const Vector& normal_dashpot, In u) {
    const Vector before = std::exchange(p.normal_dashpot, clamped_dashpots(p, normal_dashpot, u));
    return p.normal_dashpot != before;
}

}  // namespace nscd
