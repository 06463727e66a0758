// Contacts known to be closed, and the active set: from a guess of the closed contacts to the exact ones.
#pragma once

#include "factor.hpp"

namespace nscd {

// Weight of the equalities: large for speed, small enough to keep ten digits.
inline constexpr double PENALTY = 1e7;
// Gaps and openings are known to this share of ‖u⁻‖∞; to the other they are closed, where nothing less is enough.
inline constexpr double EXACT_TOLERANCE = 1e-14, CLOSED_TOLERANCE = 1e-15;

// What the factor in storage is of: Â + CᵀΘC, and the contacts that it holds closed. Empty where that is not known.
struct CachedFactor {
    Vector theta;
    Mask closed;
};

// Close contacts by the method of multipliers, λ ← λ + θ(Cu − b); the steps taken. λ is kept for the open contacts as
// well (it presses nothing there). u is corrected by the momentum that is still out of balance, so that rounding does
// not grow with θ. The factor is that of Â + CᵀΘC; v = C u; gap_tolerance: to this share of ‖u⁻‖∞.
int close_contacts(Factor& factor, MaskView closed, In theta, Vector& reaction, Vector& u, Vector& v, int max_steps, double gap_tolerance);

struct ActiveSetResult {
    Vector reaction, velocity;  // in elimination order
    int rounds = 0;
    double error = INFINITE;     // max |min(wλ, b − Cu)| / ‖u⁻‖∞ with the pulls that had to be cut
    bool converged = false;      // whether no contact changed sides in the end
    CachedFactor cached;
};

// A round closes the set from rest: λ is then the least-norm reaction on it (the first step is the penalty model of
// stiffness θ, the others its stiff limit), and Σ θ(Cu − b) on the open ones says whether they would be pressed in that
// limit. Contacts that pull open, those that would be pressed close: the primal–dual active set method on the penalty
// model, one factorisation a round. Once it settles, the reactions are those of least energy if the stiffness is the
// same for all contacts. It ends unsettled after `max_rounds` rounds, or when more contacts change than before.
// thorough: go to the stiff limit in every round.
ActiveSetResult active_set_solve(Factor& factor, Mask closed, bool thorough, double gap_tolerance = CLOSED_TOLERANCE, int max_rounds = 12);

// closed ← the contacts that press in a penalty model of one stiffness, by Newton's method from the contacts that nearly do;
// the rounds are counted. False, soon, where more change than a few.
bool settle_penalties(Factor& factor, Mask& closed, int& rounds);

// The t > 0 where ½ Σ max(0, v + t moved)² + ½ curve t² − t · work is least: its slope grows, linear between the t = −v/moved.
// Newton's method within a bracket. may: the contacts of the sum; all where it is empty.
double line_minimum(MaskView may, In v, In moved, double work, double curve);

// Close the contacts that a method of multipliers finds, λ ← max(0, λ + θ(Cu − b)) with contacts that get firmer: each step is
// a penalty model, solved by Newton's method on its closed contacts from those of the step before. Redundant contacts do not
// slow it down as they do descents. It begins from `reaction` (k, or none), where its last λ comes;
// error_tolerance: the error, a share of ‖u⁻‖∞, with which that is the answer.
ActiveSetResult augmented_lagrangian(Factor& factor, Vector& reaction, double gap_tolerance, double error_tolerance);

// All contacts: C u⁺ = b with any sign of λ (paper eqs. (2) and (8)). λ is of least norm where contacts are redundant,
// weighted by the masses where these differ much.
ActiveSetResult solve_equalities(Factor& factor);

// closed (k) ← the contacts that press more than they open, and than they yield by their compliance (k, or none); the
// residual.
double active_set_of(const ImpactProblem& s, In reaction, In u, In compliance, Mask& closed);

}  // namespace nscd
