// Block LU factorisation row by row of the matrix of contacts that stick and slide: three unknowns a disk.
//
// A sliding contact presses along n ± μt but resists only along n, so that the matrix is not symmetric; its structure is,
// and is that of `Rows`. Pivots are taken within the block of a disk. Davis, Direct Methods for Sparse Linear Systems (SIAM
// 2006), ch. 6.
#pragma once

#include "friction.hpp"
#include "cholesky_rows.hpp"

namespace nscd {

// α n nᵀ + β t tᵀ + γ t nᵀ + δ n tᵀ of each contact, (k) kg; n and t: rows of C and T.
struct Weights {
    Vector nn, tt, tn, nt;
    explicit Weights(int k) : nn(k, 0.0), tt(k, 0.0), tn(k, 0.0), nt(k, 0.0) {}
};

class FrictionFactor {
public:
    FrictionFactor() = default;
    FrictionFactor(const Graph& graph, const Ordering& ordering, const Indices& first, const Indices& second);

    bool factorise(const FrictionProblem& p, const Weights& weights);  // M + Σ …; false where rounding left it singular
    void solve(Out b);                                         // b ← A⁻¹ b, (n·3)
    void solve(Out one, Out two);                              // both: what is read of the factor is read once

private:
    void assemble(const FrictionProblem& p, const Weights& weights);
    Rows rows_;                                // the structure
    AlignedVector lower_, upper_, middle_;              // A: blocks below, above and on the diagonal, by columns
    AlignedVector l_, u_, pivot_, x_, y_, b_;           // L and U by columns of L; LU of the diagonal blocks; a row and a column at work
    std::vector<std::uint8_t> order_;          // (n·3) rows of the diagonal blocks in the order of their pivots
};

// Some disks and contacts of a problem, by their numbers there.
struct Selection {
    Indices disk, contact;
};

// The same in elimination order, as a problem, and storage for its factors.
struct Subproblem : Selection {
    FrictionProblem problem;
    FrictionFactor factor;
    Subproblem(const FrictionProblem& full, std::span<const Index> disks, std::span<const Index> contacts);
};

}  // namespace nscd
