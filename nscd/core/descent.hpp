// Accelerated projected gradient on the dual, matrix-free: for well-conditioned crowds of disks without dissipation.
//
// min ½ λᵀWλ − λᵀ(Cû − b), λ ≥ 0, in the variables λ√w (the Delassus operator then has unit diagonal), by Nesterov's
// method with the gradient restart of O'Donoghue & Candès, Found. Comput. Math. 15 (2015) 715.
#pragma once

#include "elimination_order.hpp"

namespace nscd {

struct DescentLimits {
    double tolerance = 0.0;  // of the residual, a share of ‖u⁻‖∞
    int max_sweeps = 0;            // sweeps
    int unchanged_tolerance = -1;         // end once no more than so many contacts close or open between looks; negative: never
    double redundant = INFINITE;  // end early where more contacts press than this times the number of unknowns: they
                                  // then cannot all be told from the reactions, which are not unique
};
struct DescentResult {
    Vector reaction, velocity;  // λ ≥ 0 (k) N·s, (n·2) m/s
    int sweeps = 0;
};
DescentResult descend(const ImpactProblem& s, const Parts& parts, Team& team, const DescentLimits& limits);

}  // namespace nscd
