// Random states x ≥ 0 of a law with density exp(−slope Σ x − ½ |net|²), net = load − Mᵀ x, or in exact balance.
#pragma once

#include "arrays.hpp"

namespace nscd {

// Rows of M (u, r), sparse.
struct SparseRows {
    std::span<const std::int64_t> start;
    std::span<const Index> column;
    In value;
};

// Gibbs sampling, each unknown a truncated normal: Geman & Geman, IEEE Trans. Pattern Anal. 6 (1984) 721; its tails by Robert,
// Stat. Comput. 5 (1995) 121. Most sweeps draw nothing: an unknown goes to its mirror image in the mean of its normal law, unless
// that is below 0, and so does not walk at random: Adler, Phys. Rev. D 23 (1981) 2901. Goes on from x (u) and net (r); every
// `thin`-th x is added to `draws`.
void gibbs_sweeps(const SparseRows& matrix, double slope, Out x, Out net, std::uint64_t seed, std::int64_t sweeps, std::int64_t thin, Vector& draws);

// Hamiltonian sampling without any error: a point flies freely in the states of exact balance, which `projector` (u, u) projects
// on, under gravity (u), and is reflected where an unknown vanishes: Pakman & Paninski, J. Comput. Graph. Stat. 23 (2014) 518.
// Each flight has another velocity and takes about `time`.
void flights(In projector, In gravity, double time, Out x, std::uint64_t seed, std::int64_t flights, std::int64_t thin, Vector& draws);

}  // namespace nscd
