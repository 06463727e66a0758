// The ladder with friction: from what is free to what is hard; one way for a snapshot and for a step.
//
// 1. Islands that nothing presses keep u⁻.     2. The convex programme of the cones' edges, and Newton's method on the sets.
// 3. Each island that is left: proximal steps of Newton's method, and a path of pivots from where they stand.
// 4. The proximal point method, each step a path of pivots.
#pragma once

#include "answer.hpp"
#include "friction_paths.hpp"

namespace nscd {

struct FrictionAnswer {
    Rubbed at;
    Method method = Method::LEFT_VELOCITY;
    int seed = -1;       // of the random states where the search began; 0: the convex programme; −1: u⁻
    int pairs = 0;       // of sweeps
    int pivots = 0;
    double spread = NAN; // m/s, how far apart the u⁺ of all searches are, spins times radius included; NaN for one alone
};

// Solve a problem whose k_n act where they push, p_n = k_n max(C(u + u⁻), 0) + λ, in as many searches as `starts` says, all
// but the first for other answers; `p` is left with the k_n that act. The residual decides; the best answer met is given.
FrictionAnswer solve_friction(Rubbing& p, double tolerance, int starts, In radius);

// The percussions of a step, without dissipation, from a guess of λ and τ (none: empty): accelerated sweeps of all islands
// together, then 3 and 4 for each that is left, at last the ladder.
FrictionAnswer step_friction(const Rubbing& p, In lam, In tau, double tolerance);

// One method alone, from no percussions: for tests.
enum class FrictionMethod { PROXIMAL, POINT, RANDOM };
FrictionAnswer solve_friction_by(const Rubbing& p, FrictionMethod method, double tolerance, int effort);

}  // namespace nscd
