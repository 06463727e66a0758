// Dense elimination of the first rows of a symmetric matrix: the arithmetic of a front.
//
// A front is kept in chunks of eight columns, row after row within a chunk, so that what is read together lies
// together. The pivots' columns begin a chunk and the others begin one; what is beyond the last column of either
// is zero. Only the upper half counts; what is below the diagonal within a chunk that crosses it is overwritten
// with anything.
//
// panel:  the rows that are eliminated, `height` of them in each chunk, first the chunks of the pivots, then those
//         of the others; row q of chunk c begins at (c · height + q) · 8
// update: the others; chunk c has the 8 (c + 1) rows that reach it, and begins at 32 c (c + 1)
#pragma once

#include <cstdint>

namespace nscd {

// So many rows are eliminated before those after them are updated: what they leave to eight columns fits into the
// innermost cache.
inline constexpr int PANEL = 96;

constexpr std::int64_t chunks(std::int64_t columns) { return (columns + 7) >> 3; }
// Rows of a panel: blocks of four, or of eight where they are updated by eight.
constexpr std::int64_t height_of(std::int64_t pivots) {
    return pivots <= PANEL ? (pivots + 3) & ~std::int64_t{3} : (pivots + 7) & ~std::int64_t{7};
}
constexpr std::int64_t update_size(std::int64_t rest) { return 32 * chunks(rest) * (chunks(rest) + 1); }

// Lᵀ is left in the panel with its diagonal inverted, the Schur complement in the update. False where a pivot is not
// positive.
bool eliminate(double* panel, double* update, std::int64_t pivots, std::int64_t rest);

// x ← L⁻¹ x at the pivots; at the other chunks, what they leave to the others, to be subtracted from them.
void forward(const double* panel, double* x, std::int64_t height, std::int64_t pivots, std::int64_t others);

// x ← L⁻ᵀ x at the pivots, given the others; `count` chunks.
void back(const double* panel, double* x, std::int64_t height, std::int64_t count);

}  // namespace nscd
