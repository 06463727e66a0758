// The ladder with friction: from what is free to what is hard; one driver for a snapshot and for a step.
//
// 1. Islands that nothing presses keep u⁻.     2. A start: the convex programme of the cones' edges and Newton's method on its
// sets, or in a step accelerated sweeps from the percussions before.     3. Each island that is left: proximal steps of Newton's
// method, and a path of pivots from where they stand.     4. The proximal point method, each step a path of pivots.
#pragma once

#include "impact_solver.hpp"
#include "friction_pivots.hpp"

namespace nscd {

struct FrictionResult {
    FrictionSolution solution;
    Method method = Method::LEFT_VELOCITY;
    int seed = -1;       // of the random states where the search began; 0: the convex programme; −1: u⁻
    int sweep_count = 0;       // of sweeps
    int pivots = 0;
    double error = 0.0;  // as `island_errors` has it, of the worst island
    double spread = NAN; // m/s, how far apart the u⁺ of all searches are, spins times radius included; NaN for one alone
};

struct FrictionOptions {
    double tolerance;
    int starts = 1;         // how many searches, all but the first for other answers
    In radius{};            // (n) m, which makes spins speeds in the spread of their answers
    bool in_step = false;   // begin by sweeps from λ and τ (k, or none), which is cheap and may give another answer
    In reaction{}, tangential{};
};

// Solve a problem whose k_n act where they push, p_n = k_n max(C(u + u⁻), 0) + λ; `p` is left with the k_n that act. The
// residual decides; the best answer met is given.
FrictionResult solve_friction(FrictionProblem& p, const FrictionOptions& options);

// One method alone, from no percussions: for tests.
enum class FrictionMethod { PROXIMAL_NEWTON, PROXIMAL_POINT, RANDOM_START };
FrictionResult solve_friction_by(const FrictionProblem& p, FrictionMethod method, double tolerance, int pivot_budget);

}  // namespace nscd
