// How far the right velocities of an answer are from the exact ones: a bound by weak duality.
//
// With the dual function at λ' ≥ 0, which u' = û − Â⁻¹Cᵀλ' attains, and any feasible u (C u ≤ b), the duality gap of
// min ½|u − û|², |u|² = u·Âu, is ½|u − u'|² + λ'·(b − C u); both points are as near to the exact u⁺ as
// |u' − u⁺|² + |u − u⁺|² ≤ 2 gap. Take λ' = λ on the contacts that press and 0 elsewhere, and u = ũ − t, the answer ũ
// corrected by the least t that closes these contacts exactly and leaves no other one overlapping. Then
// λ'·(b − C u) = 0 and
//
//     |ũ − u⁺|² ≤ |t|² + |ũ − u'|²,   |ũ − u'| ≤ √(Σ r²/m),  r = Âũ − Âû + Cᵀλ' (N·s),
//
// first order in what the answer misses, and never less than the error. What cannot be closed exactly adds λ'·|b − C u|.
//
// Rounding: gaps b − C u up to 32 ε‖u‖∞ count as closed. So the bound is that of a problem whose offsets b differ by so
// much from those given, which is what normals in double precision leave open; what errors of that size do to u⁺ is in
// the bound: the length of the t that closes ± ρ, ρ: the largest gap that is left and 4 ε‖u‖∞. Its signs are those of the
// multipliers μ of the t that closes + ρ everywhere: of all patterns s the longest t has s = sign μ(s).
#pragma once

#include "closed_form.hpp"
#include "active_set.hpp"

namespace nscd {

// Each a bound of √(Σ m |ũ − u⁺|²), √kg m/s, spins included; infinite where there are offsets.
double bound_of_closed_form(const ImpactProblem& s, In reaction, In u);
double bound_of_tree(const ImpactProblem& s, const Branches& branches, In reaction, In u);
double bound_by_factor(Factor& factor, In reaction, In u, const CachedFactor& cached);  // in elimination order

// (M − DᵀKD) u⁻ = Â û, (n·d) N·s.
Vector free_momentum(const ImpactProblem& s);

}  // namespace nscd
