// The interior point: the central path of the percussions by Mehrotra's method, SIAM J. Optim. 2 (1992) 575. It lives
// with redundant, jammed, dissipative and unequal crowds.
#pragma once

#include "active_set.hpp"

namespace nscd {

// A point of the path: slack s and reaction λ > 0 (k), velocity u (n·d).
struct PathPoint {
    Vector slack, reaction, velocity;
};

struct PathResult {
    Vector reaction, velocity;
    double error = INFINITE;  // natural map max |min(wλ, b − Cu + cλ)| and imbalance of momentum, over ‖u⁻‖∞
    int iterations = 0;
    Vector theta;            // Θ of the last factor; empty where it failed
    PathPoint last;               // where it ended, to go on from
};

// Follow the path of min ½(u−û)·Â(u−û) + ½ Σ cλ², C u + s = b + cλ, s ≥ 0, to the tolerance or where rounding stops it.
// One factorisation of Â + CᵀΘC an iteration, Θ = 1/(s/λ + c), and two solutions.
// compliance: (k) s/kg, c; where not `soft`, a proximal term of the matrix only, which does not change the answer
PathResult follow(Factor& factor, double tolerance, In compliance, bool soft, PathPoint start);

// The start s = √w, λ = 1/√w (times one constant), which makes unequal masses harmless.
PathPoint cold_start(const ImpactProblem& s);

// The point of the path that is as far from the end as λ and u are: wλ − s is kept, √(wλ·s) = away · error.
PathPoint away_from(const ImpactProblem& s, In reaction, In u, double tolerance, double away);

struct WarmStart {                     // an answer that is nearly right, in elimination order; empty where there is none
    Vector reaction, velocity;
    double away = 10.0;           // the path begins so many times its error away from its end
};
struct InteriorPointResult {
    Vector reaction, velocity;
    int iterations = 0;
    bool canonical = false;           // whether these are known to be the reactions of least energy
    CachedFactor cached;
};

// Solve any problem: along the path of rigid contacts. Where the reactions of least energy are wanted and one stiffness
// serves, the path is left as soon as the contacts that it closes close exactly.
InteriorPointResult solve_by_path(Factor& factor, const WarmStart& warm_start, double tolerance, bool canonical);

}  // namespace nscd
