// Contacts whose state is known or guessed: open, stuck or sliding either way; Newton's method on these sets; and the convex
// relative of the problem, whose answer tells the sets where all contacts hold.
#pragma once

#include "friction_factor.hpp"

namespace nscd {

// Tangential states: nothing to hold on to, stuck, sliding forwards (τ = μ p_n) and backwards.
enum Hold : std::uint8_t { FREE, STICK, FORWARD, BACKWARD };

struct States {
    Flags closed, hold;  // (k)
    explicit States(int k) : closed(k, 0), hold(k, FREE) {}
    explicit States(Flags hold);          // closed where held
    std::uint64_t key() const;            // a hash
};

// Weight of the equalities, relative to 1/w; steps of the method of multipliers with one factor.
inline constexpr double FRICTION_PENALTY = 1e8;
inline constexpr int FRICTION_STEPS = 6;

// dτ/dp_n of a sliding contact, 0 otherwise.
inline double slope(std::uint8_t hold, double friction) { return hold == FORWARD ? friction : hold == BACKWARD ? -friction : 0.0; }

// The states that the natural map sees in an answer; v, s: C u, T u.
void find_states(const Rubbing& p, In v, In s, In lam, In tau, States& states);
States states_of(const Rubbing& p, const Rubbed& at);

// Solve with the states given: C u = b where closed, T u = 0 where stuck, τ = ±μ p_n where sliding: up to `steps` proximal
// steps from `at` with one factorisation. False where it fails.
bool settle(const Rubbing& p, FrictionFactor& factor, const States& states, double penalty, int steps, Rubbed& at);

// Newton's method on the sets from states and an answer: up to `rounds` factorisations, ended by a set seen before. The best
// answer met is left in `at`, island by island; the errors of the islands.
Numbers newton(const Rubbing& p, FrictionFactor& factor, States states, Rubbed& at, double tolerance, int rounds, double penalty);

// The convex programme min ½ (u−u⁻)·M(u−u⁻) + dissipation, subject to C u ± μ T u ≤ b: one inequality for each edge n ± μt
// of the cone, its multipliers λ₊ + λ₋ = λ, μ(λ₊ − λ₋) = τ. A contact that slides opens at μ|T u|. Its central path:
// Mehrotra, SIAM J. Optim. 2 (1992) 575.
// Followed to the accuracy from s = √w, λ = 1/√w, which makes unequal masses harmless; the best point met.
Rubbed convex_programme(const Rubbing& p, FrictionFactor& factor, double accuracy);

}  // namespace nscd
