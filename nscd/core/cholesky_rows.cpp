#include "cholesky_rows.hpp"

#include <algorithm>
#include <numeric>

#include "levels.hpp"

namespace nscd {

namespace {

// Blocks of L: a column's rows are its later neighbours and the rows of its children in the elimination tree. Turned over
// twice, rows and columns are sorted.
void structure_of(Rows& rows, const Graph& graph, const Ordering& ordering) {
    const int n = int(ordering.order.size());
    Indices child(n, -1), sibling(n, -1), mark(n, -1), found;
    rows.start.assign(n + 1, 0), rows.row_start.assign(n + 1, 0);
    for (int k = 0; k < n; ++k) {
        Index parent = n;
        const auto visit = [&](Index i) {
            if (i <= k || mark[i] == k) return;
            mark[i] = k, parent = std::min(parent, i);
            found.push_back(i), ++rows.row_start[i + 1];
        };
        const Index disk = ordering.order[k];
        for (auto e = graph.start[disk]; e < graph.start[disk + 1]; ++e) visit(ordering.index[graph.neighbour[e]]);
        for (Index c = child[k]; c >= 0; c = sibling[c])
            for (auto q = rows.start[c]; q < rows.start[c + 1]; ++q) visit(found[q]);
        rows.start[k + 1] = std::int64_t(found.size());
        if (parent < n) sibling[k] = child[parent], child[parent] = k;
    }
    std::partial_sum(rows.row_start.begin(), rows.row_start.end(), rows.row_start.begin());
    rows.row.resize(found.size()), rows.column.resize(found.size()), rows.slot.resize(found.size());
    Starts at(rows.row_start.begin(), rows.row_start.end() - 1);
    for (int k = 0; k < n; ++k)
        for (auto q = rows.start[k]; q < rows.start[k + 1]; ++q) rows.column[at[found[q]]++] = k;
    at.assign(rows.start.begin(), rows.start.end() - 1);
    for (int k = 0; k < n; ++k)
        for (auto q = rows.row_start[k]; q < rows.row_start[k + 1]; ++q) {
            rows.slot[q] = at[rows.column[q]]++;
            rows.row[rows.slot[q]] = k;
        }
}

// A 2 × 2 block at once, by columns (x₀₀ x₁₀ x₀₁ x₁₁).
typedef double Vec4 __attribute__((vector_size(32)));

// A += weight · row_iᵀ row_j in a d × d block.
template <int D>
[[gnu::always_inline]] inline void add_block(double* block, const double* one, const double* other, double weight) {
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) block[D * a + b] += weight * one[a] * other[b];
}

template <int D>
[[gnu::always_inline]] inline void assemble(const ImpactProblem& s, Rows& rows, const double* theta) {
    AlignedVector& pairs = D == 2 ? rows.block : rows.matrix;
    double *A = pairs.data(), *B = rows.matrix_diagonal.data();
    std::fill(pairs.begin(), pairs.end(), 0.0);
    std::fill(rows.matrix_diagonal.begin(), rows.matrix_diagonal.end(), 0.0);
    for (int i = 0; i < s.n; ++i)
        for (int a = 0; a < D; ++a) B[D * D * i + (D + 1) * a] = s.mass[D * i + a];
    const bool dissipative = s.dissipative();
    for (int c = 0; c < s.k; ++c) {
        const int i = s.first[c], j = s.second[c];
        const double x = s.nx[c], y = s.ny[c], weight = theta[c] + (dissipative ? s.normal_dashpot[c] : 0.0);
        const double xx = weight * x * x, xy = weight * x * y, yy = weight * y * y;
        double* beside = j >= 0 ? A + D * D * rows.pair_block[c] : nullptr;
        const auto add = [&](const double* one, const double* other, double by) {
            add_block<D>(B + D * D * i, one, one, by);
            if (j < 0) return;
            add_block<D>(B + D * D * j, other, other, by);
            add_block<D>(beside, i > j ? one : other, i > j ? other : one, by);
        };
        const auto add_block = [&](double* at, double sign) {
            if constexpr (D == 2) store(at, load<Vec4>(at) + sign * Vec4{xx, xy, xy, yy});
            else at[0] += sign * xx, at[1] += sign * xy, at[D] += sign * xy, at[D + 1] += sign * yy;
        };
        if (D == 3 && s.compound()) {
            const double one[3] = {x, y, s.turn_first[c]}, other[3] = {-x, -y, s.turn_second[c]};
            add(one, other, weight);
        } else {
            add_block(B + D * D * i, 1.0);
            if (j >= 0) add_block(B + D * D * j, 1.0), add_block(beside, -1.0);
        }
        if (D == 2 || !dissipative || s.tangential_dashpot[c] == 0.0) continue;
        const double one[3] = {-y, x, s.lever_first[c]}, other[3] = {y, -x, s.lever_second[c]};
        add(one, other, s.tangential_dashpot[c]);
    }
}

// l ← x L⁻ᵀ for a diagonal block L (by columns, diagonal inverted), x and l by rows.
[[gnu::always_inline]] inline void times_inverse_three(const double* x, const double* L, double* l) {
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            double value = x[3 * a + b];
            for (int c = 0; c < b; ++c) value -= l[3 * a + c] * L[b + 3 * c];
            l[3 * a + b] = value * L[b + 3 * b];
        }
}

[[gnu::always_inline]] inline Vec4 load_twice(const double* from) {
    const Vec2 half = load<Vec2>(from);
    return __builtin_shufflevector(half, half, 0, 1, 0, 1);
}

struct Spread {  // l₀₀ l₀₀ l₁₀ l₁₀ and l₀₁ l₀₁ l₁₁ l₁₁
    Vec4 one, other;
};

// m lᵀ
[[gnu::always_inline]] inline Vec4 product(const double* m, const Spread& l) { return load_twice(m) * l.one + load_twice(m + 2) * l.other; }

LEVELS bool factorise_three(const ImpactProblem& s, Rows& rows, const double* theta) {
    constexpr int D = 3, S = D * D, X = 4;  // rows stand four apart in x
    assemble<D>(s, rows, theta);
    double* __restrict x = rows.work.data();
    double* __restrict L = rows.block.data();
    double* __restrict diagonal = rows.diagonal.data();
    const double *A = rows.matrix.data(), *B = rows.matrix_diagonal.data();
    const Index* row = rows.row.data();
    for (int k = 0; k < s.n; ++k) {
        for (auto p = rows.a_start[k]; p < rows.a_start[k + 1]; ++p) {
            double* to = x + D * X * rows.a_column[p];
            for (int a = 0; a < S; ++a) to[a / D * X + a % D] += A[S * p + a];
        }
        double own[S];
        for (int a = 0; a < S; ++a) own[a] = B[S * k + a];
        for (auto q = rows.row_start[k]; q < rows.row_start[k + 1]; ++q) {
            const Index i = rows.column[q];
            double below[S], l[S];
            for (int a = 0; a < S; ++a) below[a] = x[D * X * i + a / D * X + a % D];
            std::fill_n(x + D * X * i, D * X, 0.0);
            times_inverse_three(below, diagonal + S * i, l);
            const auto slot = rows.slot[q];
            for (auto p = rows.start[i]; p < slot; ++p) {  // x_r −= l · L_riᵀ
                double* __restrict to = x + D * X * row[p];
                const double* m = L + S * p;
                const Vec4 one = load<Vec4>(m), two = load<Vec4>(m + 3), three = load<Vec4>(m + 6);
                for (int a = 0; a < D; ++a) {
                    const double* by = l + D * a;
                    store(to + X * a, load<Vec4>(to + X * a) - (by[0] * one + by[1] * two + by[2] * three));
                }
            }
            double* to = L + S * slot;
            for (int a = 0; a < D; ++a)
                for (int c = 0; c < D; ++c) {
                    to[D * c + a] = l[D * a + c];
                    for (int b = 0; b <= a; ++b) own[D * a + b] -= l[D * a + c] * l[D * b + c];
                }
        }
        double* to = diagonal + S * k;
        for (int b = 0; b < D; ++b) {
            double pivot = own[D * b + b];
            for (int c = 0; c < b; ++c) pivot -= to[D * c + b] * to[D * c + b];
            if (!(pivot > 0.0)) {
                std::fill(rows.work.begin(), rows.work.end(), 0.0);
                return false;
            }
            const double root = 1.0 / std::sqrt(pivot);
            to[D * b + b] = root;
            for (int a = b + 1; a < D; ++a) {
                double value = own[D * a + b];
                for (int c = 0; c < b; ++c) value -= to[D * c + a] * to[D * c + b];
                to[D * b + a] = value * root;
            }
        }
    }
    return true;
}

LEVELS void solve_three(const Rows& rows, double* __restrict b) {
    constexpr int D = 3, S = D * D;
    const int n = int(rows.start.size()) - 1;
    const double *L = rows.block.data(), *diagonal = rows.diagonal.data();
    const Index* row = rows.row.data();
    for (int k = 0; k < n; ++k) {
        const double* own = diagonal + S * k;
        double y[D];
        for (int a = 0; a < D; ++a) {
            y[a] = b[D * k + a];
            for (int c = 0; c < a; ++c) y[a] -= own[D * c + a] * y[c];
            y[a] *= own[D * a + a];
        }
        for (int a = 0; a < D; ++a) b[D * k + a] = y[a];
        for (auto p = rows.start[k]; p < rows.start[k + 1]; ++p) {
            double* to = b + D * row[p];
            for (int a = 0; a < D; ++a) {
                double sum = L[S * p + a] * y[0];
                for (int c = 1; c < D; ++c) sum += L[S * p + D * c + a] * y[c];
                to[a] -= sum;
            }
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        const double* own = diagonal + S * k;
        double sum[S] = {};
        for (auto p = rows.start[k]; p < rows.start[k + 1]; ++p) {
            const double* from = b + D * row[p];
            for (int c = 0; c < D; ++c)
                for (int a = 0; a < D; ++a) sum[D * c + a] += L[S * p + D * c + a] * from[a];
        }
        double y[D];
        for (int c = D - 1; c >= 0; --c) {
            y[c] = b[D * k + c];
            for (int a = 0; a < D; ++a) y[c] -= sum[D * c + a];
            for (int a = c + 1; a < D; ++a) y[c] -= own[D * c + a] * y[a];
            y[c] *= own[D * c + c];
        }
        for (int a = 0; a < D; ++a) b[D * k + a] = y[a];
    }
}

// 2 × 2 blocks, column by column: each is taken off the blocks right of it at once, which do not wait for each other.
LEVELS bool factorise_two(const ImpactProblem& s, Rows& rows, const double* theta) {
    assemble<2>(s, rows, theta);
    double* __restrict L = rows.block.data();
    double *diagonal = rows.diagonal.data(), *B = rows.matrix_diagonal.data();
    const Index *row = rows.row.data(), *target = rows.target.data();
    for (int k = 0; k < s.n; ++k) {
        const double a = B[4 * k], b = B[4 * k + 1], determinant = a * B[4 * k + 3] - b * b;
        if (!(a > 0.0 && determinant > 0.0)) return false;
        const double one = 1.0 / std::sqrt(a), other = std::sqrt(a / determinant), across = -b * one * one * other;
        store(diagonal + 4 * k, Vec4{one, across, 0.0, other});
        const auto end = rows.start[k + 1];
        for (auto p = rows.start[k]; p < end; ++p) {
            const Vec4 x = load<Vec4>(L + 4 * p);
            store(L + 4 * p, __builtin_shufflevector(x, x, 0, 1, 0, 1) * Vec4{one, one, across, across} + x * Vec4{0.0, 0.0, other, other});
        }
        for (auto p = rows.start[k]; p < end; ++p) {
            const Vec4 x = load<Vec4>(L + 4 * p);
            const Spread l{__builtin_shufflevector(x, x, 0, 0, 1, 1), __builtin_shufflevector(x, x, 2, 2, 3, 3)};
            double* own = B + 4 * row[p];
            store(own, load<Vec4>(own) - product(L + 4 * p, l));
            for (auto q = p + 1; q < end; ++q) {
                double* to = L + 4 * std::size_t(*target++);
                store(to, load<Vec4>(to) - product(L + 4 * q, l));
            }
        }
    }
    return true;
}
LEVELS void solve_two(const Rows& rows, double* __restrict b) {
    const int n = int(rows.start.size()) - 1;
    const double *L = rows.block.data(), *diagonal = rows.diagonal.data();
    const Index* row = rows.row.data();
    for (int k = 0; k < n; ++k) {
        const double *inverse = diagonal + 4 * k, x = b[2 * k];
        const double one = inverse[0] * x, other = inverse[1] * x + inverse[3] * b[2 * k + 1];
        b[2 * k] = one, b[2 * k + 1] = other;
        for (auto p = rows.start[k]; p < rows.start[k + 1]; ++p) {
            double* to = b + 2 * row[p];
            store(to, load<Vec2>(to) - load<Vec2>(L + 4 * p) * one - load<Vec2>(L + 4 * p + 2) * other);
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        const double* inverse = diagonal + 4 * k;
        Vec4 sum{}, more{};
        auto p = rows.start[k];
        for (; p + 1 < rows.start[k + 1]; p += 2) {
            sum += load<Vec4>(L + 4 * p) * load_twice(b + 2 * row[p]);
            more += load<Vec4>(L + 4 * p + 4) * load_twice(b + 2 * row[p + 1]);
        }
        if (p < rows.start[k + 1]) sum += load<Vec4>(L + 4 * p) * load_twice(b + 2 * row[p]);
        sum += more;
        const double one = b[2 * k] - sum[0] - sum[1], other = b[2 * k + 1] - sum[2] - sum[3];
        b[2 * k] = inverse[0] * one + inverse[1] * other, b[2 * k + 1] = inverse[3] * other;
    }
}

// Where the products of each column's blocks go, and the contacts between disks: to blocks of L.
void aim_columns(Rows& rows, const Indices& first, const Indices& second) {
    const int n = int(rows.start.size()) - 1;
    Starts begin(n + 1, 0);
    for (int k = 0; k < n; ++k) {
        const auto count = rows.start[k + 1] - rows.start[k];
        begin[k + 1] = begin[k] + count * (count - 1) / 2;
    }
    rows.target.resize(begin[n]);
    Indices place(n);
    for (int j = 0; j < n; ++j) {
        for (auto p = rows.start[j]; p < rows.start[j + 1]; ++p) place[rows.row[p]] = Index(p);
        for (auto p = rows.a_start[j]; p < rows.a_start[j + 1]; ++p) {
            const Index c = rows.a_column[p];
            rows.pair_block[c] = place[std::max(first[c], second[c])];
        }
        for (auto q = rows.row_start[j]; q < rows.row_start[j + 1]; ++q) {
            const Index k = rows.column[q];
            Index* to = rows.target.data() + begin[k];
            begin[k] += rows.start[k + 1] - rows.slot[q] - 1;
            for (auto p = rows.slot[q] + 1; p < rows.start[k + 1]; ++p) *to++ = place[rows.row[p]];
        }
    }
}

}  // namespace

Rows rows_of(const Graph& graph, const Ordering& ordering, const Indices& first, const Indices& second, int d) {
    Rows rows;
    rows.d = d;
    structure_of(rows, graph, ordering);
    const int n = int(ordering.order.size()), k = int(first.size());
    // contacts between disks by their later one, or by their earlier one where columns are eliminated
    const auto by = [&](int c) { return d == 2 ? std::min(first[c], second[c]) : std::max(first[c], second[c]); };
    rows.a_start.assign(n + 1, 0);
    for (int c = 0; c < k; ++c)
        if (second[c] >= 0) ++rows.a_start[by(c) + 1];
    std::partial_sum(rows.a_start.begin(), rows.a_start.end(), rows.a_start.begin());
    rows.a_column.resize(rows.a_start[n]);
    rows.pair_block.assign(k, -1);
    Starts at(rows.a_start.begin(), rows.a_start.end() - 1);
    for (int c = 0; c < k; ++c)
        if (second[c] >= 0) {
            const auto p = at[by(c)]++;
            rows.pair_block[c] = p;
            rows.a_column[p] = d == 2 ? c : std::min(first[c], second[c]);
        }
    if (d == 2) aim_columns(rows, first, second);
    const std::size_t size = std::size_t(d) * d;
    rows.matrix.resize(d == 2 ? 0 : size * rows.a_column.size()), rows.matrix_diagonal.resize(size * n);
    // the last column of a block of three is read as four numbers
    rows.block.resize(size * rows.row.size() + 1), rows.diagonal.resize(size * n);
    rows.work.resize(d == 2 ? 0 : 12 * std::size_t(n));
    std::fill(rows.work.begin(), rows.work.end(), 0.0);
    return rows;
}

bool factorise(const ImpactProblem& s, Rows& rows, In theta) {
    return rows.d == 2 ? factorise_two(s, rows, theta.data()) : factorise_three(s, rows, theta.data());
}

void solve(const Rows& rows, Out b) { rows.d == 2 ? solve_two(rows, b.data()) : solve_three(rows, b.data()); }

}  // namespace nscd
