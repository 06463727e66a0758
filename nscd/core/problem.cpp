#include "problem.hpp"

#include <algorithm>

#include "levels.hpp"

namespace nscd {

bool ImpactProblem::even() const {
    const auto [minimum, maximum] = std::minmax_element(inverse_mass.begin(), inverse_mass.end());
    return k == 0 || *maximum <= EVEN_MASS_RATIO * *minimum;
}

// The same for all, 1/max w, so that the stiff limit has the least Σλ²; 1/w where masses differ too much.
Vector ImpactProblem::stiffness() const {
    Vector kappa(k);
    if (k == 0) return kappa;
    const double lightest = *std::max_element(inverse_mass.begin(), inverse_mass.end());
    const bool same = even();
    for (int c = 0; c < k; ++c) kappa[c] = 1.0 / (same ? lightest : inverse_mass[c]);
    return kappa;
}

void ImpactProblem::measure_scale() {
    scale = std::max(least_scale, TINY);
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 2; ++a) scale = std::max(scale, std::abs(left_velocity[d * i + a]));
    if (!compound()) return;
    reach.assign(n, 0.0);
    for (int i = 0; i < n; ++i) reach[i] = std::sqrt(mass[3 * i + 2] / mass[3 * i]);
    for (int c = 0; c < k; ++c) {
        reach[first[c]] = std::max({reach[first[c]], std::abs(turn_first[c]), std::abs(lever_first[c])});
        if (second[c] >= 0) reach[second[c]] = std::max({reach[second[c]], std::abs(turn_second[c]), std::abs(lever_second[c])});
    }
    for (int i = 0; i < n; ++i) scale = std::max(scale, std::abs(left_velocity[3 * i + 2]) * reach[i]);
}

ImpactProblem impact_problem_of(const Disks& disks, Indices first, Indices second, In normal) {
    ImpactProblem s;
    const auto& [position, velocity, radius, mass, spin] = disks;
    s.n = int(mass.size()), s.k = int(first.size()), s.d = spin.empty() ? 2 : 3;
    s.first = std::move(first), s.second = std::move(second), s.max_approach.assign(s.k, 0.0);
    for (Vector* one : {&s.nx, &s.ny, &s.inverse_mass}) one->reserve(s.k);
    for (int c = 0; c < s.k; ++c) {
        const int i = s.first[c], j = s.second[c];
        s.nx.push_back(normal[2 * c]), s.ny.push_back(normal[2 * c + 1]);
        s.inverse_mass.push_back(1.0 / mass[i] + (j >= 0 ? 1.0 / mass[j] : 0.0));
        if (s.d == 3) s.lever_first.push_back(radius[i]), s.lever_second.push_back(j >= 0 ? radius[j] : 0.0);
    }
    for (int i = 0; i < s.n; ++i) {
        s.x.push_back(position[2 * i]), s.y.push_back(position[2 * i + 1]);
        for (int a = 0; a < 2; ++a) s.mass.push_back(mass[i]), s.left_velocity.push_back(velocity[2 * i + a]);
        if (s.d == 3) s.mass.push_back(0.5 * mass[i] * radius[i] * radius[i]), s.left_velocity.push_back(spin[i]);
    }
    s.free = s.left_velocity;
    s.measure_scale();
    return s;
}

ImpactProblem compound_problem_of(const ImpactProblem& disks, In radius, const Members& of, In left_velocity) {
    ImpactProblem s = disks;
    s.n = int(of.mass.size()), s.d = 3;
    s.x.resize(s.n), s.y.resize(s.n), s.mass.resize(3 * std::size_t(s.n));
    for (int b = 0; b < s.n; ++b) {
        s.x[b] = of.centre[2 * b], s.y[b] = of.centre[2 * b + 1];
        s.mass[3 * b] = s.mass[3 * b + 1] = of.mass[b], s.mass[3 * b + 2] = of.inertia[b];
    }
    s.left_velocity.assign(left_velocity.begin(), left_velocity.end());
    s.free = s.left_velocity;
    for (Vector* one : {&s.turn_first, &s.turn_second, &s.lever_first, &s.lever_second}) one->assign(s.k, 0.0);
    for (int c = 0; c < s.k; ++c) {
        s.inverse_mass[c] = 0.0;
        const auto set_body = [&](Index& at, double sign, double& turn, double& lever) {
            const Index disk = at, b = at = of.body[disk];
            const double x = disks.x[disk] - s.x[b], y = disks.y[disk] - s.y[b];
            turn = sign * (x * s.ny[c] - y * s.nx[c]);
            lever = radius[disk] + sign * (x * s.nx[c] + y * s.ny[c]);
            s.inverse_mass[c] += 1.0 / of.mass[b] + turn * turn / of.inertia[b];
        };
        set_body(s.first[c], 1.0, s.turn_first[c], s.lever_first[c]);
        if (s.second[c] >= 0) set_body(s.second[c], -1.0, s.turn_second[c], s.lever_second[c]);
    }
    s.measure_scale();
    return s;
}

Vector body_velocity_of(const Members& of, In mass, In velocity, In spin) {
    const std::size_t n = of.body.size(), b = of.mass.size();
    Vector u(3 * b), first(2 * b);
    for (std::size_t i = n; i-- > 0;) {  // the first disk's, which is exact where a body is one disk
        const std::size_t at = of.body[i];
        for (int a = 0; a < 2; ++a) first[2 * at + a] = u[3 * at + a] = velocity[2 * i + a];
        u[3 * at + 2] = spin[i];
    }
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t at = of.body[i], a = 0; a < 2; ++a)
            u[3 * at + a] += mass[i] / of.mass[at] * (velocity[2 * i + a] - first[2 * at + a]);
    return u;
}

Vector disk_velocity_of(const Members& of, In position, In u) {
    Vector moving(position.size());
    for (std::size_t i = 0; i < of.body.size(); ++i) {
        const std::size_t b = of.body[i];
        moving[2 * i] = u[3 * b] - u[3 * b + 2] * (position[2 * i + 1] - of.centre[2 * b + 1]);
        moving[2 * i + 1] = u[3 * b + 1] + u[3 * b + 2] * (position[2 * i] - of.centre[2 * b]);
    }
    return moving;
}

ImpactProblem restrict_to(const ImpactProblem& full, std::span<const Index> contact, std::span<const Index> disk,
              const Indices& index) {
    ImpactProblem s;
    s.n = int(disk.size()), s.k = int(contact.size()), s.d = full.d;
    s.least_scale = full.least_scale, s.bilateral = full.bilateral;
    const auto picked = [&](const Vector& values) {
        Vector some(values.empty() ? 0 : contact.size());
        for (std::size_t c = 0; c < some.size(); ++c) some[c] = values[contact[c]];
        return some;
    };
    const auto moved = [&](const Vector& values, int d) {
        Vector some(values.empty() ? 0 : disk.size() * d);
        auto* to = some.data();
        if (!some.empty())
            for (const Index i : disk) to = std::copy_n(values.data() + std::size_t(i) * d, d, to);
        return some;
    };
    s.first.resize(s.k), s.second.resize(s.k);
    for (int c = 0; c < s.k; ++c) {
        s.first[c] = index[full.first[contact[c]]];
        s.second[c] = full.second[contact[c]] < 0 ? -1 : index[full.second[contact[c]]];
    }
    s.nx = picked(full.nx), s.ny = picked(full.ny);
    s.lever_first = picked(full.lever_first), s.lever_second = picked(full.lever_second);
    s.turn_first = picked(full.turn_first), s.turn_second = picked(full.turn_second);
    s.normal_dashpot = picked(full.normal_dashpot), s.tangential_dashpot = picked(full.tangential_dashpot);
    s.max_approach = picked(full.max_approach), s.inverse_mass = picked(full.inverse_mass);
    s.mass = moved(full.mass, s.d), s.left_velocity = moved(full.left_velocity, s.d), s.free = moved(full.free, s.d);
    s.x = moved(full.x, 1), s.y = moved(full.y, 1);
    s.measure_scale();
    return s;
}

LEVELS void approach(const ImpactProblem& s, In u, Out v) {
    const Index *first = s.first.data(), *second = s.second.data();
    const double *nx = s.nx.data(), *ny = s.ny.data(), *at = u.data();
    const int d = s.d;
    for (int c = 0; c < s.k; ++c) {
        const int i = d * first[c], j = d * second[c];
        double x = at[i], y = at[i + 1];
        if (j >= 0) x -= at[j], y -= at[j + 1];
        v[c] = nx[c] * x + ny[c] * y;
    }
    if (!s.compound()) return;
    const double *one = s.turn_first.data(), *other = s.turn_second.data();
    for (int c = 0; c < s.k; ++c) {
        v[c] += one[c] * at[3 * first[c] + 2];
        if (second[c] >= 0) v[c] += other[c] * at[3 * second[c] + 2];
    }
}

void sliding(const ImpactProblem& s, In u, Out v) {
    const int d = s.d;
    for (int c = 0; c < s.k; ++c) {
        const int i = d * s.first[c], j = d * s.second[c];
        double x = u[i], y = u[i + 1], turn = d == 3 ? s.lever_first[c] * u[i + 2] : 0.0;
        if (j >= 0) {
            x -= u[j], y -= u[j + 1];
            if (d == 3) turn += s.lever_second[c] * u[j + 2];
        }
        v[c] = s.nx[c] * y - s.ny[c] * x + turn;
    }
}

void add_reactions(const ImpactProblem& s, In reaction, double factor, Out b) {
    const int d = s.d;
    for (int c = 0; c < s.k; ++c) {
        const int i = d * s.first[c], j = d * s.second[c];
        const Vec2 push = Vec2{s.nx[c], s.ny[c]} * (factor * reaction[c]);
        store(&b[i], load<Vec2>(&b[i]) + push);
        if (j >= 0) store(&b[j], load<Vec2>(&b[j]) - push);
    }
    if (!s.compound()) return;
    for (int c = 0; c < s.k; ++c) {
        b[3 * s.first[c] + 2] += s.turn_first[c] * factor * reaction[c];
        if (s.second[c] >= 0) b[3 * s.second[c] + 2] += s.turn_second[c] * factor * reaction[c];
    }
}

// b += Tᵀτ.
static void add_tangential(const ImpactProblem& s, In tangential, Out b) {
    const int d = s.d;
    for (int c = 0; c < s.k; ++c) {
        const int i = d * s.first[c], j = d * s.second[c];
        const double x = -s.ny[c] * tangential[c], y = s.nx[c] * tangential[c];
        b[i] += x, b[i + 1] += y;
        if (d == 3) b[i + 2] += s.lever_first[c] * tangential[c];
        if (j < 0) continue;
        b[j] -= x, b[j + 1] -= y;
        if (d == 3) b[j + 2] += s.lever_second[c] * tangential[c];
    }
}

void inertia(const ImpactProblem& s, In u, Out b) {
    for (std::size_t i = 0; i < s.mass.size(); ++i) b[i] = s.mass[i] * u[i];
    if (!s.dissipative()) return;
    Vector v(s.k);
    approach(s, u, v);
    for (int c = 0; c < s.k; ++c) v[c] *= s.normal_dashpot[c];
    add_reactions(s, v, 1.0, b);
    sliding(s, u, v);
    for (int c = 0; c < s.k; ++c) v[c] *= s.tangential_dashpot[c];
    add_tangential(s, v, b);
}

double max_abs(In values) {
    double maximum = 0.0;
    for (double value : values) maximum = max_or_nan(maximum, std::abs(value));
    return maximum;
}

Certificate certificate_of(const ImpactProblem& s, In reaction, In u) {
    Certificate certificate;
    const int d = s.d;
    Vector v(s.k), total(s.mass.size()), momentum(s.mass.size()), received(s.n);
    Vector push(reaction.begin(), reaction.end()), tangential(s.dissipative() ? s.k : 0);
    approach(s, u, v);
    double imbalance = 0.0;
    for (int c = 0; c < s.k; ++c) {
        const double slack = s.max_approach[c] - v[c];
        imbalance = max_or_nan(imbalance, std::abs(s.bilateral ? slack : std::min(s.inverse_mass[c] * reaction[c], slack)));
        certificate.finite = certificate.finite && std::isfinite(reaction[c]);
    }
    certificate.residual = imbalance / s.scale;
    for (std::size_t i = 0; i < total.size(); ++i) total[i] = u[i] + s.left_velocity[i];
    approach(s, total, v);
    if (s.dissipative()) {
        sliding(s, total, tangential);
        for (int c = 0; c < s.k; ++c) {
            push[c] += s.normal_dashpot[c] * v[c];
            certificate.work += s.tangential_dashpot[c] * tangential[c] * tangential[c];
            tangential[c] *= s.tangential_dashpot[c];
        }
        add_tangential(s, tangential, momentum);
    }
    add_reactions(s, push, 1.0, momentum);
    certificate.impulse.resize(2 * std::size_t(s.k));
    for (int c = 0; c < s.k; ++c) {
        const double other = s.dissipative() ? tangential[c] : 0.0, size = std::abs(push[c]) + std::abs(other);
        certificate.impulse[2 * c] = push[c] * s.nx[c] - other * s.ny[c];
        certificate.impulse[2 * c + 1] = push[c] * s.ny[c] + other * s.nx[c];
        certificate.work += push[c] * v[c];
        received[s.first[c]] += size;
        if (s.second[c] >= 0) received[s.second[c]] += size;
    }
    for (int i = 0; i < s.n; ++i)
        for (int a = 0; a < d; ++a) {
            const double m = s.mass[d * i + a], before = s.left_velocity[d * i + a], after = u[d * i + a];
            certificate.finite = certificate.finite && std::isfinite(after);
            const double missed = std::abs(m * (after - before) + momentum[d * i + a]);
            const double arm = a < 2 ? 1.0 : s.compound() ? s.reach[i] : INFINITE;
            certificate.momentum_error = max_or_nan(certificate.momentum_error, missed / (arm * (s.mass[d * i] * s.scale + received[i])));
            certificate.energy += 0.5 * m * before * before;
            certificate.change += 0.5 * m * (after - before) * (after + before);
        }
    certificate.finite = certificate.finite && std::isfinite(certificate.residual + certificate.momentum_error + certificate.energy + certificate.change + certificate.work);
    return certificate;
}

double solution_error(const ImpactProblem& s, In reaction, In u) {
    const Certificate certificate = certificate_of(s, reaction, u);
    return max_or_nan(certificate.residual, certificate.momentum_error);
}

}  // namespace nscd
