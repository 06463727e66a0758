// From points and contacts to fields: sums of an isotropic kernel, and of its integrals along branches.
#pragma once

#include "arrays.hpp"

namespace nscd {

struct Kernel {
    double width;  // m, w, its standard deviation along an axis
    double reach;  // m, beyond which it counts as zero
    bool compact;  // φ = 4/(πR²)·(1 − r²/R²)³ for r < R = √10 w; else φ = exp(−r²/2w²)/(2πw²)
};

// Adds Σ_i values_i φ(x − x_i) to field (m·d), and its gradient (m·d·2), at points x (m·2); where (n·2), values (n·d).
void coarse_grain(In points, In where, In values, const Kernel& kernel, Out field, Out gradient);

struct Loads {
    In start, branch, impulse;      // (k·2) m, ℓ m, p N·s
    std::span<const bool> is_wall;  // (k)
};
// Adds −Σ_c p ⊗ ℓ ∫₀¹ φ(x − x_c − sℓ) ds to stress (m·4), its divergence (m·2), and −Σ_wall p φ(x − x_c − ℓ) to
// traction (m·2).
void coarse_grain_stress(In points, const Loads& loads, const Kernel& kernel, Out stress, Out divergence, Out traction);

}  // namespace nscd
