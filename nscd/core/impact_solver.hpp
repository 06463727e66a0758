// The ladder: one way to an answer, for every size.
//
// 1. Islands that nothing presses and single contacts: closed form.     2. Trees: linear time.
// 3. A guess, or what a descent finds, where masses are even: close it; of bodies, what contacts find that get firmer.
// 4. What is left: the interior point.
#pragma once

#include "error_bound.hpp"
#include "canonical.hpp"
#include "descent.hpp"
#include "interior_point.hpp"

namespace nscd {

// Sweeps of a first-order solver that is asked for, at most.
inline constexpr int MAX_SWEEPS = 200'000;

enum class Solver { AUTO, INTERIOR_POINT, ACTIVE_SET, PROJECTED_GRADIENT, GAUSS_SEIDEL };
// What gave an answer; with friction (from LEFT_VELOCITY on) in the order of cost: the last that an island needed.
enum class Method {
    NO_CONTACTS, NOTHING_PRESSES, SINGLE_CONTACTS, TREE, GUESS, DESCENT, AUGMENTED_LAGRANGIAN, INTERIOR_POINT_MARGINAL,
    INTERIOR_POINT_UNEVEN_MASSES, INTERIOR_POINT_DISSIPATIVE, MAINTAINED, BY_NAME, PROJECTED_GRADIENT, LEFT_VELOCITY, NEWTON,
    GAUSS_SEIDEL, PROXIMAL_NEWTON, PROXIMAL_POINT, PIVOTS, NONE
};

struct Options {
    double tolerance = 1e-8;  // dimensionless, of residual and momentum error
    bool canonical = true;        // whether λ is to be the one of least energy where it is not unique
    bool with_error_bound = true;  // whether the error of the velocities is to be bounded
    Solver solver = Solver::AUTO;
    int threads = 1;
    Vector reaction, velocity;  // (k), (n·d): of a problem that was nearly the same; empty where there is none
    Sizes sizes;
    const ImpactProblem* full = nullptr;  // the disks with all contacts, of which unlikely ones count where a descent nearly closes them
    Indices unlikely = {};
    Team* team = nullptr;              // who works on it; its own where there is none
    ReusableOrder* reusable = nullptr;         // the order of elimination of these disks before, from which this one is
};

struct Solution {
    Vector reaction, velocity;  // (k) N·s, (n·d) m/s, in the order of the problem
    Method method = Method::NO_CONTACTS;
    int disks = 0;               // how many were not answered in closed form
    int iterations = 0;          // sweeps, rounds, factorisations
    int threads = 1;             // how many worked on it
    bool canonical = true;           // whether λ is known to be the one of least energy
    int rounds = 0;              // in which the contacts were chosen at which k_n acts
    Indices added;               // of the unlikely contacts, those that were looked at, and their reactions follow the others
    double error_bound = 0.0;    // √kg m/s, a bound of √(Σ m |u − u⁺|²); infinite where none is known
};

// Solve a problem whose k_n act where they stand.
Solution solve_contacts(const ImpactProblem& problem, const Options& options);

// Solve a problem whose k_n act where they push: p_n = k_n max(C(u + u⁻), 0) + λ. `problem` is left with the k_n that do.
//
// u⁺ minimises the convex Φ(u) = ½|u − u⁻|²_M + ½ Σ k_n max(C(u + u⁻), 0)² + ½ Σ k_t (T(u + u⁻))² over C u ≤ 0: Newton's
// method. With the contacts fixed at which k_n acts it is a problem for `solve_contacts`; each round takes those at which it
// pushes at the velocities before. Φ falls from round to round, so that no choice comes twice.
Solution solve_one_sided(ImpactProblem& problem, const Options& options);

}  // namespace nscd
