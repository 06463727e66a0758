// Block Cholesky factorisation row by row: the fastest for small crowds. A block is one disk's unknowns.
//
// Elimination tree and structure of the rows: Davis, Direct Methods for Sparse Linear Systems (SIAM 2006), ch. 4.
#pragma once

#include "elimination_order.hpp"

namespace nscd {

// A = L Lᵀ in d × d blocks.
struct Rows {
    int d = 2;
    Starts a_start;        // (n+1) lower blocks of A by rows
    Indices a_column;
    Starts pair_block;     // (k) the block that contact c adds to, −1 for a wall
    Starts start;          // (n+1) and L by columns
    Indices row;
    Starts row_start;      // (n+1) and L by rows; slot is where each block lies by columns
    Indices column;
    Starts slot;
    Indices target;        // d = 2: the blocks of L from which products of a column's blocks are taken, in their order
    AlignedVector matrix, matrix_diagonal;  // A, blocks by rows
    AlignedVector block, diagonal;          // L, blocks by columns; its diagonal blocks, inverted (d = 3: their diagonals only)
    AlignedVector work;                     // (n·d²), rows of three four apart; zero between calls
};

// Plan the rows of contacts between disks; first and second are places.
Rows rows_of(const Graph& graph, const Ordering& ordering, const Indices& first, const Indices& second, int d);

// Factorise Â + CᵀΘC for theta (k) kg; false where rounding left it indefinite.
bool factorise(const ImpactProblem& s, Rows& rows, In theta);

// b ← (L Lᵀ)⁻¹ b, (n·d).
void solve(const Rows& rows, Out b);

}  // namespace nscd
