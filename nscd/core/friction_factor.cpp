#include "friction_factor.hpp"

#include <algorithm>
#include <numeric>

#include "levels.hpp"

namespace nscd {

namespace {

// From so many disks on dissection gives the smaller factors (hexagonal 5,000: half the time).
constexpr int MANY = 1500, LEAF = 8;

// A block of three columns, each padded to four numbers.
constexpr int B = 12;
typedef double Vec4 __attribute__((vector_size(32)));
[[gnu::always_inline]] inline Vec4 load(const double* at) {
    Vec4 value;
    __builtin_memcpy(&value, __builtin_assume_aligned(at, 32), sizeof value);
    return value;
}
[[gnu::always_inline]] inline void store(double* at, Vec4 value) {
    __builtin_memcpy(__builtin_assume_aligned(at, 32), &value, sizeof value);
}

// LU of a block with row pivots: `order` the rows in their order; the diagonal of U inverted. Columns in `a`.
[[gnu::always_inline]] inline bool split(const Vec4 (&own)[3], double* to, std::uint8_t* order) {
    double a[3][3];  // rows
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) a[r][c] = own[c][r];
    int at[3] = {0, 1, 2};
    for (int q = 0; q < 3; ++q) {
        int best = q;
        for (int r = q + 1; r < 3; ++r)
            if (std::abs(a[r][q]) > std::abs(a[best][q])) best = r;
        if (best != q) {
            std::swap(at[q], at[best]);
            for (int c = 0; c < 3; ++c) std::swap(a[q][c], a[best][c]);
        }
        if (!(std::abs(a[q][q]) > 0.0 && std::abs(a[q][q]) < INFINITE)) return false;
        a[q][q] = 1.0 / a[q][q];
        for (int r = q + 1; r < 3; ++r) {
            a[r][q] *= a[q][q];
            for (int c = q + 1; c < 3; ++c) a[r][c] -= a[r][q] * a[q][c];
        }
    }
    for (int r = 0; r < 3; ++r) {
        order[r] = std::uint8_t(at[r]);
        for (int c = 0; c < 3; ++c) to[3 * r + c] = a[r][c];
    }
    return true;
}

// l ← x D⁻¹.
[[gnu::always_inline]] inline void divide(const Vec4 (&x)[3], const double* d, const std::uint8_t* order, Vec4 (&l)[3]) {
    const Vec4 z0 = x[0] * d[0];
    const Vec4 z1 = (x[1] - z0 * d[1]) * d[4];
    const Vec4 z2 = (x[2] - z0 * d[2] - z1 * d[5]) * d[8];
    const Vec4 m1 = z1 - z2 * d[7];
    l[order[2]] = z2;
    l[order[1]] = m1;
    l[order[0]] = z0 - m1 * d[3] - z2 * d[6];
}

[[gnu::always_inline]] inline bool factorise_all(const Rows& rows, int n, const double* lower, const double* upper, const double* middle,
                                                 double* __restrict L, double* __restrict U, double* __restrict pivot,
                                                 std::uint8_t* order, double* __restrict x, double* __restrict y) {
    const Index* row = rows.row.data();
    for (int k = 0; k < n; ++k) {
        for (auto p = rows.a_start[k]; p < rows.a_start[k + 1]; ++p) {
            const std::size_t to = std::size_t(B) * rows.a_column[p], from = std::size_t(B) * p;
            for (int a = 0; a < B; ++a) x[to + a] += lower[from + a], y[to + a] += upper[from + a];
        }
        Vec4 own[3] = {load(middle + B * k), load(middle + B * k + 4), load(middle + B * k + 8)};
        for (auto q = rows.row_start[k]; q < rows.row_start[k + 1]; ++q) {
            const Index i = rows.column[q];
            double *xi = x + std::size_t(B) * i, *yi = y + std::size_t(B) * i;
            const Vec4 above[3] = {load(xi), load(xi + 4), load(xi + 8)};
            const Vec4 u[3] = {load(yi), load(yi + 4), load(yi + 8)};
            for (int a = 0; a < B; ++a) xi[a] = yi[a] = 0.0;
            Vec4 l[3];
            divide(above, pivot + 9 * i, order + 3 * i, l);
            const auto slot = rows.slot[q];
            for (auto p = rows.start[i]; p < slot; ++p) {
                const std::size_t at = std::size_t(B) * row[p], from = std::size_t(B) * p;
                const double* up = U + from;
                const Vec4 l0 = load(L + from), l1 = load(L + from + 4), l2 = load(L + from + 8);
                for (int b = 0; b < 3; ++b) {
                    double* to = x + at + 4 * b;
                    store(to, load(to) - l[0] * up[4 * b] - l[1] * up[4 * b + 1] - l[2] * up[4 * b + 2]);
                    to = y + at + 4 * b;
                    store(to, load(to) - l0 * u[b][0] - l1 * u[b][1] - l2 * u[b][2]);
                }
            }
            double *to = L + std::size_t(B) * slot, *too = U + std::size_t(B) * slot;
            for (int b = 0; b < 3; ++b) {
                own[b] -= l[0] * u[b][0] + l[1] * u[b][1] + l[2] * u[b][2];
                store(to + 4 * b, l[b]), store(too + 4 * b, u[b]);
            }
        }
        if (!split(own, pivot + 9 * k, order + 3 * k)) return false;
    }
    return true;
}

// b (n·4 for each of `COUNT`) ← A⁻¹ b.
template <int COUNT>
[[gnu::always_inline]] inline void solve_all(const Rows& rows, int n, const double* L, const double* U, const double* pivot,
                                             const std::uint8_t* order, double* __restrict b) {
    const Index* row = rows.row.data();
    constexpr int S = 4 * COUNT;
    for (int k = 0; k < n; ++k) {
        double y[COUNT][3];
        bool idle = true;
        for (int m = 0; m < COUNT; ++m)
            for (int a = 0; a < 3; ++a) {
                y[m][a] = b[S * k + 4 * m + a];
                idle = idle && y[m][a] == 0.0;
            }
        if (idle) continue;
        for (auto p = rows.start[k]; p < rows.start[k + 1]; ++p) {
            const Vec4 l0 = load(L + B * p), l1 = load(L + B * p + 4), l2 = load(L + B * p + 8);
            for (int m = 0; m < COUNT; ++m) {
                double* to = b + std::size_t(S) * row[p] + 4 * m;
                store(to, load(to) - l0 * y[m][0] - l1 * y[m][1] - l2 * y[m][2]);
            }
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        Vec4 sum[COUNT];
        for (int m = 0; m < COUNT; ++m) sum[m] = load(b + S * k + 4 * m);
        for (auto p = rows.start[k]; p < rows.start[k + 1]; ++p) {
            const Vec4 u0 = load(U + B * p), u1 = load(U + B * p + 4), u2 = load(U + B * p + 8);
            for (int m = 0; m < COUNT; ++m) {
                const double* from = b + std::size_t(S) * row[p] + 4 * m;
                sum[m] -= u0 * from[0] + u1 * from[1] + u2 * from[2];
            }
        }
        const double* d = pivot + 9 * k;
        const std::uint8_t* at = order + 3 * k;
        for (int m = 0; m < COUNT; ++m) {
            const double y0 = sum[m][at[0]], y1 = sum[m][at[1]] - d[3] * y0, y2 = sum[m][at[2]] - d[6] * y0 - d[7] * y1;
            double* to = b + S * k + 4 * m;
            to[2] = y2 * d[8];
            to[1] = (y1 - d[5] * to[2]) * d[4];
            to[0] = (y0 - d[1] * to[1] - d[2] * to[2]) * d[0];
            to[3] = 0.0;
        }
    }
}

LEVELS bool factorise_rows(const Rows& rows, int n, const double* lower, const double* upper, const double* middle, double* L, double* U,
                           double* pivot, std::uint8_t* order, double* x, double* y) {
    return factorise_all(rows, n, lower, upper, middle, L, U, pivot, order, x, y);
}
LEVELS void solve_one(const Rows& rows, int n, const double* L, const double* U, const double* pivot, const std::uint8_t* order, double* b) {
    solve_all<1>(rows, n, L, U, pivot, order, b);
}
LEVELS void solve_both(const Rows& rows, int n, const double* L, const double* U, const double* pivot, const std::uint8_t* order, double* b) {
    solve_all<2>(rows, n, L, U, pivot, order, b);
}

// The block of a contact at row r and column c, as outer products of its rows there: n (α n + δ t) + t (γ n + β t).
struct Row {
    double nx, ny, tx, ty, turn, nturn = 0.0;
};
void add_block(double* to, const Row& r, const Row& c, double alpha, double beta, double gamma, double delta) {
    const double normal[3] = {alpha * c.nx + delta * c.tx, alpha * c.ny + delta * c.ty, delta * c.turn + alpha * c.nturn};
    const double tangential[3] = {gamma * c.nx + beta * c.tx, gamma * c.ny + beta * c.ty, beta * c.turn + gamma * c.nturn};
    for (int b = 0; b < 3; ++b) {
        to[4 * b] += r.nx * normal[b] + r.tx * tangential[b];
        to[4 * b + 1] += r.ny * normal[b] + r.ty * tangential[b];
        to[4 * b + 2] += r.turn * tangential[b] + r.nturn * normal[b];
    }
}

Ordering ordering_of(const FrictionProblem& full, const Graph& graph) {
    if (full.n < MANY) return minimum_degree(graph);
    Team alone(1);
    return dissect(full.x, full.y, graph, LEAF, alone, SHARED);
}

}  // namespace

FrictionFactor::FrictionFactor(const Graph& graph, const Ordering& ordering, const Indices& first, const Indices& second)
    : rows_(rows_of(graph, ordering, first, second, 3)) {
    const std::size_t n = ordering.order.size(), blocks_of_pairs = rows_.a_column.size(), blocks = rows_.row.size();
    lower_.resize(B * blocks_of_pairs), upper_.resize(B * blocks_of_pairs), middle_.resize(B * n);
    l_.resize(B * blocks), u_.resize(B * blocks), pivot_.resize(9 * n), order_.resize(3 * n);
    x_.resize(B * n), y_.resize(B * n), b_.resize(8 * n);
}

void FrictionFactor::assemble(const FrictionProblem& p, const Weights& weights) {
    std::fill(lower_.begin(), lower_.end(), 0.0);
    std::fill(upper_.begin(), upper_.end(), 0.0);
    std::fill(middle_.begin(), middle_.end(), 0.0);
    for (int i = 0; i < p.n; ++i)
        for (int a = 0; a < 3; ++a) middle_[B * i + 5 * a] = p.mass[3 * i + a];
    for (int c = 0; c < p.k; ++c) {
        const double alpha = weights.nn[c], beta = weights.tt[c], gamma = weights.tn[c], delta = weights.nt[c];
        if (alpha == 0.0 && beta == 0.0) continue;
        const int i = p.first[c], j = p.second[c];
        const double x = p.nx[c], y = p.ny[c];
        Row one{x, y, -y, x, p.lever_first[c]}, two{-x, -y, y, -x, p.lever_second[c]};
        if (p.compound()) one.nturn = p.turn_first[c], two.nturn = p.turn_second[c];
        add_block(middle_.data() + B * i, one, one, alpha, beta, gamma, delta);
        if (j < 0) continue;
        add_block(middle_.data() + B * j, two, two, alpha, beta, gamma, delta);
        const std::size_t at = std::size_t(B) * rows_.pair_block[c];
        const bool later = i > j;  // which of them is the row of the block below the diagonal
        add_block(lower_.data() + at, later ? one : two, later ? two : one, alpha, beta, gamma, delta);
        add_block(upper_.data() + at, later ? two : one, later ? one : two, alpha, beta, gamma, delta);
    }
}

bool FrictionFactor::factorise(const FrictionProblem& p, const Weights& weights) {
    assemble(p, weights);
    std::fill(x_.begin(), x_.end(), 0.0);
    std::fill(y_.begin(), y_.end(), 0.0);
    return factorise_rows(rows_, p.n, lower_.data(), upper_.data(), middle_.data(), l_.data(), u_.data(), pivot_.data(), order_.data(),
                          x_.data(), y_.data());
}

void FrictionFactor::solve(Out b) {
    const int n = int(b.size() / 3);
    for (int i = 0; i < n; ++i) {
        for (int a = 0; a < 3; ++a) b_[4 * i + a] = b[3 * i + a];
        b_[4 * i + 3] = 0.0;
    }
    solve_one(rows_, n, l_.data(), u_.data(), pivot_.data(), order_.data(), b_.data());
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 3; ++a) b[3 * i + a] = b_[4 * i + a];
}

void FrictionFactor::solve(Out one, Out two) {
    const int n = int(one.size() / 3);
    for (int i = 0; i < n; ++i) {
        for (int a = 0; a < 3; ++a) b_[8 * i + a] = one[3 * i + a], b_[8 * i + 4 + a] = two[3 * i + a];
        b_[8 * i + 3] = b_[8 * i + 7] = 0.0;
    }
    solve_both(rows_, n, l_.data(), u_.data(), pivot_.data(), order_.data(), b_.data());
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 3; ++a) one[3 * i + a] = b_[8 * i + a], two[3 * i + a] = b_[8 * i + 4 + a];
}

Subproblem::Subproblem(const FrictionProblem& full, std::span<const Index> disks, std::span<const Index> contacts) {
    const FrictionProblem some = restrict_to(full, contacts, disks);
    const Graph graph = graph_of(some.n, some.first, some.second);
    const Ordering ordering = ordering_of(some, graph);
    Parts one;
    const Indices row = by_parts(ordering.index, some.first, some.second, 1, one);
    problem = restrict_to(some, row, ordering.order);
    factor = FrictionFactor(graph, ordering, problem.first, problem.second);
    disk.resize(disks.size()), contact.resize(contacts.size());
    for (std::size_t i = 0; i < disk.size(); ++i) disk[i] = disks[ordering.order[i]];
    for (std::size_t c = 0; c < contact.size(); ++c) contact[c] = contacts[row[c]];
}

}  // namespace nscd
