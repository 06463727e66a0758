// Contacts whose state is known or guessed: open, stuck or sliding either way; Newton's method on these sets; and the convex
// relative of the problem, whose answer tells the sets where all contacts hold.
#pragma once

#include "friction_factor.hpp"

namespace nscd {

// Tangential states: nothing to hold on to, stuck, sliding forwards (τ = μ p_n) and backwards.
enum TangentialState : std::uint8_t { FREE, STICK, FORWARD, BACKWARD };

struct States {
    Mask closed, tangential_state;  // (k)
    explicit States(int k) : closed(k, 0), tangential_state(k, FREE) {}
    explicit States(Mask tangential_state);          // closed where held
    std::uint64_t key() const;            // a hash
};

// Weight of the equalities, relative to 1/w; steps of the method of multipliers with one factor.
inline constexpr double FRICTION_PENALTY = 1e8;
inline constexpr int FRICTION_STEPS = 6;

// dτ/dp_n of a sliding contact, 0 otherwise.
inline double slope(std::uint8_t tangential_state, double friction) { return tangential_state == FORWARD ? friction : tangential_state == BACKWARD ? -friction : 0.0; }

// The states that the natural map sees in an answer; v, s: C u, T u.
void find_states(const FrictionProblem& p, In v, In s, In lam, In tau, States& states);
States states_of(const FrictionProblem& p, const FrictionSolution& iterate);

// Solve with the states given: C u = b where closed, T u = 0 where stuck, τ = ±μ p_n where sliding: up to `steps` proximal
// steps from `iterate` with one factorisation. False where it fails.
bool solve_fixed_state(const FrictionProblem& p, FrictionFactor& factor, const States& states, double penalty, int steps, FrictionSolution& iterate);

// Newton's method on the sets from states and an answer: up to `rounds` factorisations, ended by a set seen before. The best
// answer met is left in `iterate`, island by island; the errors of the islands.
Vector newton(const FrictionProblem& p, FrictionFactor& factor, States states, FrictionSolution& iterate, double tolerance, int rounds, double penalty);

// The convex programme min ½ (u−u⁻)·M(u−u⁻) + dissipation, subject to C u ± μ T u ≤ b: one inequality for each edge n ± μt
// of the cone, its multipliers λ₊ + λ₋ = λ, μ(λ₊ − λ₋) = τ. A contact that slides opens at μ|T u|. Its central path:
// Mehrotra, SIAM J. Optim. 2 (1992) 575.
// Followed to the accuracy from s = √w, λ = 1/√w, which makes unequal masses harmless; the best point met.
FrictionSolution convex_programme(const FrictionProblem& p, FrictionFactor& factor, double accuracy);

}  // namespace nscd
