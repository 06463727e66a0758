// One impact with Coulomb friction in the plane, and what an answer to it is worth.
//
// M(u − u⁻) + Cᵀp_n + Tᵀp_t = 0 with p_n = k_n C(u + u⁻) + λ, p_t = k_t T(u + u⁻) + τ, where
// 0 ≤ λ ⟂ b − C u ≥ 0 (Signorini), |τ| ≤ μ max(p_n, 0) and τ T u = μ max(p_n, 0) |T u| (Coulomb: maximum dissipation).
#pragma once

#include "problem.hpp"

namespace nscd {

struct FrictionProblem : ImpactProblem {  // three unknowns a disk; dashpots always have k numbers; û = u⁻
    Vector friction;          // (k) μ
    Vector tangent_inverse;   // (k) 1/kg, w_t, what a unit percussion across does there; `inverse_mass` is w
    Vector left_approach, left_sliding;  // (k) m/s, C u⁻ and T u⁻
    Indices island;             // (n) number of the group of touching disks
    int islands = 0;
    bool dissipates = false;   // whether any k_n or k_t is not 0

    void prepare();            // what follows from the rest, but the scale, which counts spins times radius
};

// Percussions λ, τ (k) N·s and velocities (n·3).
struct FrictionSolution {
    Vector reaction, tangential, velocity;
};

// The problem of disks that roll: of one without spins, with the radius, spin and inertia (n) of each, and μ (k). That of
// wide bodies has these.
FrictionProblem friction_problem_of(const ImpactProblem& flat, In radius, In spin, In inertia, Vector friction);

FrictionProblem restrict_to(const FrictionProblem& full, std::span<const Index> contact, std::span<const Index> disk);

void contact_velocities(const FrictionProblem& p, In u, Out v, Out s);  // v = C u, s = T u
void add_impulses(const FrictionProblem& p, In normal, In tangential, double factor, Out b);  // b += factor (Cᵀ normal + Tᵀ tangential)
void equilibrium_velocity(const FrictionProblem& p, In pn, In pt, Out u);            // u = u⁻ − M⁻¹(Cᵀp_n + Tᵀp_t)
// out = M(u − u⁻) + Cᵀp_n + Tᵀp_t for v, s = C u, T u.
void imbalance(const FrictionProblem& p, In u, In v, In s, In lam, In tau, Out out);

inline double normal_push(const FrictionProblem& p, int c, double v, double lam) { return p.normal_dashpot[c] * (v + p.left_approach[c]) + lam; }

// min(wλ, b − v) and w_t (τ − Π(τ + s/w_t)) of contact c, m/s; Π: onto |τ| ≤ μ max(p_n, 0).
struct NaturalMapResidual {
    double normal, tangential;
};
inline NaturalMapResidual natural_map(const FrictionProblem& p, int c, double pn, double lam, double tau, double v, double s) {
    const double limit = p.friction[c] * std::max(pn, 0.0), wt = p.tangent_inverse[c];
    const double wanted = std::min(std::max(tau + s / wt, -limit), limit);
    return {std::min(p.inverse_mass[c] * lam, p.max_approach[c] - v), wt * (tau - wanted)};
}

// The larger of natural map over the scale and momentum error of each island: the largest |M(u − u⁻) + Dᵀp| of a disk over
// m · scale + Σ|p|, spins by inertia over lever. No number counts as infinite.
Vector island_errors(const FrictionProblem& p, const FrictionSolution& solution);

enum class Contact : std::int8_t { OPEN, STICK, FORWARD, BACKWARD };  // as nscd.percussions.ContactState

struct FrictionCertificate {     // all recomputed from λ, τ and u
    Vector impulse;             // (k·2) N·s, whole percussions
    std::vector<std::int8_t> state;  // (k)
    double signorini = 0.0, cone = 0.0, natural_map = 0.0;  // over the scale of velocities
    double dissipation = 0.0;    // Σ |μ p_n |T u| − τ T u| over the energy before
    double momentum_error = 0.0;
    double energy = 0.0, change = 0.0, work = 0.0;  // J, before, gained, and p·D(u⁺ + u⁻)
};
FrictionCertificate certificate_of(const FrictionProblem& p, const FrictionSolution& solution);

// The problem in which k_n acts where it pushes at right velocities u, not where it would pull.
bool clamp_dashpots(FrictionProblem& p, const Vector& normal_dashpot, In u);

}  // namespace nscd
