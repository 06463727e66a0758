// Non-smooth Gauss–Seidel with the exact law of each contact, plain and accelerated; and proximal steps of Newton's method
// on the sets, each smoothed by sweeps.
#pragma once

#include "friction_newton.hpp"

namespace nscd {

// What a sweep reads of a contact, side by side in memory.
class Sweeps {
public:
    // Four contacts of which no two share a disk. A lane without one, and a wall, have places of their own behind the disks.
    struct alignas(32) Batch {
        Index i[4], j[4], contact[4];  // contact −1 for none
        double nx[4], ny[4], li[4], lj[4], w[4], wt[4], by_w[4], by_wt[4], friction[4], max_approach[4], mi[4], si[4], mj[4], sj[4];
    };

    explicit Sweeps(const FrictionProblem& p);

    // So many pairs of sweeps, forward and back: the law of each contact in turn, all others given. pn, pt (k) N·s are whole
    // percussions, u their velocities. Exact: n and t of one contact of disks do not couple; those of wide bodies do, and are
    // taken one after the other.
    void run(Out pn, Out pt, Out u, int count) const;
    // Up to `max_count` pairs from percussions; a natural map within the tolerance, which is returned, ends it.
    double until_converged(Out pn, Out pt, Out u, int max_count, double tolerance, int& done) const;
    // Up to `blocks` blocks of `per_block` pairs, the starts of blocks combined by Anderson's method from the last ones; the best
    // answer met and its natural map. Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
    double accelerated(Vector& pn, Vector& pt, Vector& u, int blocks, int per_block, double tolerance, int& done) const;

private:
    struct Touch {
        Index i, j;
        double nx, ny, li, lj, w, wt, by_w, by_wt, friction, max_approach, normal_dashpot, tangential_dashpot, left_approach, left_sliding;
        double mi, si, mj, sj;  // 1/kg, 1/(kg m²), inverse masses and inertias
        double ni = 0.0, nj = 0.0, both = 0.0;  // m, levers of n; 1/kg, what a unit percussion along n does across
    };
    template <bool Dissipates, bool Compound>
    void sweep(const Touch& c, double& pn, double& pt, double* u) const;
    void batches();
    double natural_map_residual(In pn, In pt, In u) const;
    const FrictionProblem& p_;
    std::vector<Touch> touch_;  // of contacts one after the other: where something dissipates, and of wide bodies
    std::vector<Batch> batch_;  // of disks, otherwise
};

// Weight at which proximal steps begin: they go far or are safe.
inline constexpr double PROXIMAL_WEIGHT = 1e3;

// Proximal steps of Newton's method on the sets.
//
// A Newton step on the sets open, stuck and sliding moves whole chains of contacts at once, but the sets that it leads to may
// be wrong in many places; sweeps put these right one by one, but need thousands for a chain. Together they do what neither
// does: the step is made with soft contacts (proximal, weight/w), put back into the cones and swept, and is taken where the
// natural map does not grow by more than a half; else a shorter one is tried. Soft contacts get firmer by 2 where the whole
// step is taken and softer by 2 where not. As truncated non-smooth Newton multigrid does for convex problems: Gräser &
// Kornhuber, J. Comput. Math. 27 (2009) 1.
//
// Up to `rounds` rounds from `at`, with the weight that the last ones ended with; the largest entry of the natural map. count: of pairs of sweeps, counted on.
double proximal_newton(const FrictionProblem& p, const Sweeps& sweeps, FrictionFactor& factor, FrictionSolution& at, int rounds, double tolerance, double& weight, int& count);

// x ← A⁻¹ x for a dense matrix by rows, which is overwritten; false where it is singular.
bool solve_dense(Vector& a, Vector& x);

// Gauss–Seidel sweeps over the contacts of u = W r + q in the plane, W by rows (2k), each contact solved exactly.
void planar_sweeps(std::span<const Index> start, std::span<const Index> column, In value, In free, In friction, Out r, int sweeps);

}  // namespace nscd
