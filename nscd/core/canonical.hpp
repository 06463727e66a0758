// The canonical reactions: of all that give the same velocities, those of least elastic energy.
#pragma once

#include "factor.hpp"

namespace nscd {

// Reactions that differ by less than this share of the largest are the same.
inline constexpr double UNIQUE = 1e-8;

// Reactions λ (k) N·s of least Σλ² with the same momentum Cᵀλ as given ones, λ ≥ 0, and λ = 0 where the contact opens by
// more than tolerance · ‖u⁻‖∞; all in elimination order.
//
// The dual is smooth: λ = max(0, C y) with y from min ½ Σ max(0, C y)² − y·Cᵀλ₀, by a semismooth Newton method with exact line
// search. It is the limit of a penalty packing of equal stiffness, loaded from rest, as the stiffness grows. Its check, by
// another method, is nscd/indeterminacy/nearest.py.
Vector least_energy(Factor& factor, In reaction, In u, double tolerance);

// The same put into an answer, unless its accuracy would suffer; whether the reactions are then those of least energy.
bool settle_energy(Factor& factor, Vector& reaction, In u, double tolerance);

}  // namespace nscd
