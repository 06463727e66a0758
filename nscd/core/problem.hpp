// One impact as a convex problem: min ½ (u − û)·Â (u − û) subject to C u ≤ b (C u = b where bilateral).
//
// Â = M + DᵀKD and Â û = (M − DᵀKD) u⁻: eq. (1) of the paper with u = u⁺. λ is the multiplier,
// Â (u − û) + Cᵀλ = 0, 0 ≤ λ ⟂ b − C u ≥ 0. A row of C is (n at the first disk, −n at the second), one
// of the tangential part T of D the same with t = (−n_y, n_x) and the lever of the spin. The normal of a body of several
// disks has a lever as well: its rows are (n, r × n at the first body, −n, −r × n at the second).
#pragma once

#include "arrays.hpp"

namespace nscd {

// Up to this ratio of w masses are even: contacts may then all have the same stiffness.
inline constexpr double EVEN_MASS_RATIO = 100.0;

struct ImpactProblem {
    int n = 0;                           // disks
    int k = 0;                           // contacts
    int d = 2;                           // unknowns of a disk: its velocity, and its spin where k_t acts or bodies are wide
    Indices first, second;                // (k) disks, second −1 for a wall
    Vector nx, ny;                      // (k) unit normal, first → second
    Vector lever_first, lever_second;   // (k) m, of t about the centre; empty for d = 2
    Vector turn_first, turn_second;     // (k) m, of n, the second with the sign of its row; empty where all are disks
    Vector reach;                       // (n) m, the longest lever at a body; empty where all are disks
    Vector normal_dashpot, tangential_dashpot;  // (k) kg, k_n and k_t; empty where nothing dissipates
    Vector mass;                        // (n·d) kg, kg m²
    Vector left_velocity, free;         // (n·d) m/s and rad/s, u⁻ and û
    Vector max_approach;                // (k) m/s, b
    Vector inverse_mass;                // (k) 1/kg, w = 1/m_i + 1/m_j
    Vector x, y;                        // (n) m, centres; empty where nobody asks
    double scale = TINY;                 // m/s, ‖u⁻‖∞, in which residuals are measured
    double least_scale = TINY;           // m/s, where u⁻ is 0 and the offset is not
    bool bilateral = false;              // every contact stays closed and may pull: `maintained` of a law

    bool dissipative() const { return !normal_dashpot.empty(); }
    bool compound() const { return !turn_first.empty(); }  // whether normals have levers
    bool even() const;                   // whether masses are, see EVEN_MASS_RATIO
    Vector stiffness() const;           // (k) kg, of contacts as a penalty model, up to one factor
    void measure_scale();                // scale ← max |u⁻|, and the reach of wide bodies, whose spins times it count
};

// Rigid bodies of one or several disks.
struct Members {
    std::span<const Index> body;  // (n) of each disk; empty where each disk is a body
    In centre, mass, inertia;     // (b·2) m, (b) kg, (b) kg m² about the centre
};
// Disks before an impact.
struct Disks {
    In position, velocity, radius, mass;  // (n·2) m, m/s; (n) m, kg
    In spin;                              // (n) rad/s; empty where nothing acts across
};
// The problem of disks with contacts first, second (−1: a wall) and unit normals (k·2), inelastic: û = u⁻, b = 0.
ImpactProblem impact_problem_of(const Disks& disks, Indices first, Indices second, In normal);
// The problem of the bodies of disks from that of the disks: u⁻ = û = left_velocity (b·3).
ImpactProblem compound_problem_of(const ImpactProblem& disks, In radius, const Members& of, In left_velocity);
// The motion (b·3) of bodies whose disks of masses (n) have velocities (n·2) and spins (n), with the same momentum.
Vector body_velocity_of(const Members& of, In mass, In velocity, In spin);
// The velocities (n·2) of disks at `position` (n·2) m whose bodies have velocities u (b·3).
Vector disk_velocity_of(const Members& of, In position, In u);

// The problem of some contacts, in this order, and of some disks, in this order; index (n) tells where a
// disk comes to be.
ImpactProblem restrict_to(const ImpactProblem& full, std::span<const Index> contact, std::span<const Index> disk, const Indices& index);

void approach(const ImpactProblem& s, In u, Out v);                     // v = C u (k)
void sliding(const ImpactProblem& s, In u, Out v);                      // v = T u (k)
void add_reactions(const ImpactProblem& s, In reaction, double factor, Out b); // b += factor · Cᵀλ
void inertia(const ImpactProblem& s, In u, Out b);                      // b = Â u
double max_abs(In values);                                              // magnitude, or what is no number

// What an answer says of itself, recomputed from it.
struct Certificate {
    Vector impulse;             // (k·2) N·s, p = k D(u⁺ + u⁻) + λ n, first → second
    double residual = 0.0;       // max |min(wλ, b − Cu)| / ‖u⁻‖∞, |b − Cu| where bilateral
    double momentum_error = 0.0; // max |M(u⁺ − u⁻) + Dᵀp| / (m ‖u⁻‖∞ + Σ|p|) over disks, spins of wide ones by inertia over reach
    double energy = 0.0;         // J, ½ u⁻·Mu⁻
    double change = 0.0;         // J, ½ u⁺·Mu⁺ − ½ u⁻·Mu⁻
    double work = 0.0;           // J, p·D(u⁺ + u⁻)
    bool finite = true;          // whether every number is
};
Certificate certificate_of(const ImpactProblem& s, In reaction, In u);

// The larger of residual and momentum error.
double solution_error(const ImpactProblem& s, In reaction, In u);

}  // namespace nscd
