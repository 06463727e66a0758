#include "cholesky_fronts.hpp"

#include <algorithm>
#include <numeric>

#include "dense.hpp"
#include "levels.hpp"

namespace nscd {

namespace {

using Size = std::int64_t;

// A crowd that is shared is cut into so many subtrees, unless the largest cannot be cut.
constexpr int SUBTREES = 8;

template <int LANES>
[[gnu::always_inline]] inline void add_lanes(const double* from, double* chunk, const Index* to, Size row, Size end) {
    for (; row < end; ++row)
        for (int lane = 0; lane < LANES; ++lane) chunk[8 * Size(to[row]) + lane] += from[8 * row + lane];
}

// Add rows … end of so many neighbouring columns to the rows `to` of a chunk.
LEVELS void add_rows(const double* __restrict from, double* __restrict chunk, const Index* to, Size row, Size end, Size lanes) {
    if (lanes == 8) return add_lanes<8>(from, chunk, to, row, end);
    if (lanes == 6) return add_lanes<6>(from, chunk, to, row, end);
    if (lanes == 4) return add_lanes<4>(from, chunk, to, row, end);
    for (; lanes >= 2; lanes -= 2, from += 2, chunk += 2) add_lanes<2>(from, chunk, to, row, end);
    if (lanes) add_lanes<1>(from, chunk, to, row, end);
}

}  // namespace

// Where the numbers of a front are: see dense.hpp.
struct Fronts::Front {
    double *panel, *update;
    Size pivots, rest, height, width;

    double* at(Size row, Size column) const {  // a row and a later column
        if (row >= pivots) {
            const Size chunk = (column - pivots) >> 3;
            return update + 32 * chunk * (chunk + 1) + 8 * (row - pivots) + ((column - pivots) & 7);
        }
        if (column >= pivots) column += 8 * width - pivots;
        return panel + ((column >> 3) * height + row) * 8 + (column & 7);
    }
};

Fronts::Fronts(const Ordering& ordering, const Graph& graph, const Indices& first, const Indices& second, int d,
               Team& team, int shared)
    : n_(int(ordering.order.size())), d_(d), team_(team), first_(ordering.node_first), end_(ordering.node_end) {
    const int m = int(end_.size());
    child_.assign(m, -1), sibling_.assign(m, -1);
    for (int s = 0; s < m; ++s)
        if (const Index p = ordering.node_parent[s]; p >= 0) sibling_[s] = child_[p], child_[p] = s;
    plan_borders(ordering, graph);
    plan_elements(first, second);
    plan_tasks(ordering, n_ < shared);
    plan_storage(ordering.node_parent);
}

void Fronts::plan_borders(const Ordering& ordering, const Graph& graph) {
    const int m = int(end_.size());
    Indices mark(n_, -1), local(n_);
    border_start_.assign(m + 1, 0);
    border_.reserve(8 * std::size_t(n_));
    for (int s = 0; s < m; ++s) {
        const auto take = [&](Index i) {
            if (i < end_[s] || mark[i] == s) return;
            mark[i] = s;
            border_.push_back(i);
        };
        for (int k = first_[s]; k < end_[s]; ++k) {
            const Index disk = ordering.order[k];
            for (auto e = graph.start[disk]; e < graph.start[disk + 1]; ++e) take(ordering.index[graph.neighbour[e]]);
        }
        for (Index c = child_[s]; c >= 0; c = sibling_[c])
            for (auto q = border_start_[c]; q < border_start_[c + 1]; ++q) take(border_[q]);
        std::sort(border_.begin() + border_start_[s], border_.end());
        border_start_[s + 1] = Size(border_.size());
    }
    inner_.resize(border_.size());
    for (int s = 0; s < m; ++s) {
        for (int k = first_[s]; k < end_[s]; ++k) local[k] = k - first_[s];
        for (auto q = border_start_[s]; q < border_start_[s + 1]; ++q)
            local[border_[q]] = Index(end_[s] - first_[s] + q - border_start_[s]);
        for (Index c = child_[s]; c >= 0; c = sibling_[c])
            for (auto q = border_start_[c]; q < border_start_[c + 1]; ++q) inner_[q] = local[border_[q]];
    }
}

void Fronts::plan_elements(const Indices& first, const Indices& second) {
    const int m = int(end_.size()), k = int(first.size());
    Indices node(n_), local(n_);
    for (int s = 0; s < m; ++s) std::fill(node.begin() + first_[s], node.begin() + end_[s], s);
    const auto home = [&](int c) { return node[second[c] >= 0 ? std::min(first[c], second[c]) : first[c]]; };
    element_start_.assign(m + 1, 0);
    for (int c = 0; c < k; ++c) ++element_start_[home(c) + 1];
    std::partial_sum(element_start_.begin(), element_start_.end(), element_start_.begin());
    Starts at(element_start_.begin(), element_start_.end() - 1);
    element_.resize(k), left_.resize(k), right_.resize(k);
    for (int c = 0; c < k; ++c) element_[at[home(c)]++] = c;
    for (int s = 0; s < m; ++s) {
        if (element_start_[s + 1] == element_start_[s]) continue;
        for (int q = first_[s]; q < end_[s]; ++q) local[q] = q - first_[s];
        for (auto q = border_start_[s]; q < border_start_[s + 1]; ++q)
            local[border_[q]] = Index(end_[s] - first_[s] + q - border_start_[s]);
        for (auto e = element_start_[s]; e < element_start_[s + 1]; ++e) {
            left_[e] = local[first[element_[e]]];
            right_[e] = second[element_[e]] >= 0 ? local[second[element_[e]]] : -1;
        }
    }
}

void Fronts::plan_tasks(const Ordering& ordering, bool single) {
    const int m = int(end_.size());
    const Indices& parent = ordering.node_parent;
    if (single) {
        tasks_ = {{m}, {-1}, {0}, {0, 0}, {}, border_};
    } else {
        Vector work(m, 0.0);
        for (int s = 0; s < m; ++s) {
            const double height = double(height_of(end_[s] - first_[s]));
            const double width = 8.0 * double(chunks(Size(height)) + chunks(border_start_[s + 1] - border_start_[s]));
            work[s] += height * width * width + 1.0;
            if (parent[s] >= 0) work[parent[s]] += work[s];
        }
        enum : char { WITHIN, SUBTREE, ALONE };
        std::vector<char> kind(m, WITHIN);
        int count = 0;
        for (int s = 0; s < m; ++s)
            if (parent[s] < 0) kind[s] = SUBTREE, ++count;
        while (count < SUBTREES) {
            int maximum = -1;
            for (int s = 0; s < m; ++s)
                if (kind[s] == SUBTREE && (maximum < 0 || work[s] > work[maximum])) maximum = s;
            if (maximum < 0 || child_[maximum] < 0) break;
            kind[maximum] = ALONE, --count;
            for (Index c = child_[maximum]; c >= 0; c = sibling_[c]) kind[c] = SUBTREE, ++count;
        }
        Indices root, task(m, -1);
        for (int s = 0; s < m; ++s)
            if (kind[s] != WITHIN) task[s] = Index(root.size()), root.push_back(s);
        for (char which : {SUBTREE, ALONE})
            for (std::size_t t = 0; t < root.size(); ++t)
                if (kind[root[t]] == which) tasks_.order.push_back(Index(t));
        tasks_.carry.push_back(0);
        for (Index r : root) {
            tasks_.end.push_back(r + 1);
            tasks_.parent.push_back(parent[r] >= 0 ? task[parent[r]] : -1);
            tasks_.carry.push_back(tasks_.carry.back() + border_start_[r + 1] - border_start_[r]);
        }
        // the place itself before the end of a task, else where in the border of its root it is
        const auto target_of = [&](int t, Index index) {
            const Index r = root[t];
            if (index < end_[r]) return index;
            const auto begin = border_.begin() + border_start_[r], end = border_.begin() + border_start_[r + 1];
            return Index(n_ + tasks_.carry[t] + (std::lower_bound(begin, end, index) - begin));
        };
        tasks_.target.resize(border_.size()), tasks_.onward.resize(tasks_.carry.back());
        for (int t = 0, s = 0; t < tasks_.count(); ++t) {
            for (; s < tasks_.end[t]; ++s)
                for (auto q = border_start_[s]; q < border_start_[s + 1]; ++q) tasks_.target[q] = target_of(t, border_[q]);
            for (int below = 0; below < t; ++below)
                if (tasks_.parent[below] == t)
                    for (auto q = tasks_.carry[below]; q < tasks_.carry[below + 1]; ++q)
                        tasks_.onward[q] = target_of(t, border_[border_start_[root[below]] + q - tasks_.carry[below]]);
        }
    }
    done_ = std::make_unique<std::atomic<int>[]>(tasks_.count());
    solution_.resize(std::size_t(d_) * (n_ + tasks_.carry.back()));
}

void Fronts::plan_storage(const Indices& parent) {
    const int m = int(end_.size());
    Starts odd(m, 0), size(m);
    stays_.assign(m, 0);
    for (int s = m - 1; s >= 0; --s)
        if (parent[s] >= 0) odd[s] = 1 - odd[parent[s]];
    if (tasks_.count() > 1)
        for (Index end : tasks_.end) stays_[end - 1] = 1;
    panel_start_.assign(m + 1, 0), update_start_.assign(m, 0);
    Size top[2] = {0, 0}, maximum[2] = {0, 0}, fixed = 0;
    for (int s = 0; s < m; ++s) {
        const Size pivots = d_ * Size(end_[s] - first_[s]), others = d_ * (border_start_[s + 1] - border_start_[s]);
        const Size columns = 8 * (chunks(pivots) + chunks(others)), here = odd[s];
        panel_start_[s + 1] = panel_start_[s] + height_of(pivots) * columns;
        widest_ = std::max(widest_, columns);
        size[s] = update_size(others);
        if (stays_[s]) {
            update_start_[s] = fixed;
            fixed += size[s];
        } else {
            update_start_[s] = top[here];
            top[here] += size[s];
            maximum[here] = std::max(maximum[here], top[here]);
        }
        for (Index c = child_[s]; c >= 0; c = sibling_[c])
            if (!stays_[c]) top[1 - here] -= size[c];
    }
    for (int s = 0; s < m; ++s) update_start_[s] += panel_start_[m] + (stays_[s] ? 0 : fixed + odd[s] * maximum[0]);
    stacks_ = maximum[0] + maximum[1];
    const int threads = tasks_.count() > 1 ? team_.threads() : 1;
    store_.resize(panel_start_[m] + fixed + threads * stacks_);
    work_.resize(threads), runs_.resize(threads);
    for (AlignedVector& work : work_) work.resize(widest_);
    for (Indices& run : runs_) run.resize(widest_);
}

// Do each task after those below it (upward) or after the one above.
void Fronts::for_tasks(bool upward, const std::function<void(int, int)>& visit) {
    const int count = tasks_.count();
    if (work_.size() == 1) {
        for (int t = 0; t < count; ++t) visit(upward ? t : count - 1 - t, 0);
        return;
    }
    const int job = ++job_;
    std::atomic<int> next{0};
    team_.run([&](int me) {
        for (int at = next++; at < count; at = next++) {
            const int t = tasks_.order[upward ? at : count - 1 - at];
            if (upward) {
                for (int below = 0; below < t; ++below)
                    if (tasks_.parent[below] == t) wait_for(done_[below], job);
            } else if (tasks_.parent[t] >= 0) {
                wait_for(done_[tasks_.parent[t]], job);
            }
            visit(t, me);
            done_[t].store(job, std::memory_order_release);
        }
    });
}

bool Fronts::factorise(const ImpactProblem& s, In theta) {
    std::atomic<bool> valid{true};
    for_tasks(true, [&](int t, int me) {
        if (valid && !factorise_task(s, theta.data(), t, me)) valid = false;
    });
    return valid;
}

bool Fronts::factorise_task(const ImpactProblem& s, const double* theta, int t, int me) {
    const int begin = t > 0 ? tasks_.end[t - 1] : 0, d = d_;
    const Size stacks = me * stacks_;
    for (int node = begin; node < tasks_.end[t]; ++node) {
        const Size pivots = d * Size(end_[node] - first_[node]);
        const Size rest = d * (border_start_[node + 1] - border_start_[node]);
        const Front front{store_.data() + panel_start_[node],
                          store_.data() + update_start_[node] + (stays_[node] ? 0 : stacks),
                          pivots, rest, height_of(pivots), chunks(pivots)};
        std::fill(front.panel, store_.data() + panel_start_[node + 1], 0.0);
        std::fill(front.update, front.update + update_size(rest), 0.0);
        for (Size q = 0; q < pivots; ++q) *front.at(q, q) = s.mass[d * Size(first_[node]) + q];
        for (auto e = element_start_[node]; e < element_start_[node + 1]; ++e) {
            const Index c = element_[e];
            const Size i = Size(left_[e]) * d, j = Size(right_[e]) * d;
            const double weight = theta[c] + (s.dissipative() ? s.normal_dashpot[c] : 0.0);
            const double x = s.nx[c], y = s.ny[c], xx = weight * x * x, xy = weight * x * y, yy = weight * y * y;
            const auto add = [&](const double (&one)[3], const double (&other)[3], double by) {
                for (int a = 0; a < 3; ++a)
                    for (int b = 0; b < 3; ++b) {
                        if (b >= a) *front.at(i + a, i + b) += by * one[a] * one[b];
                        if (j < 0) continue;
                        if (b >= a) *front.at(j + a, j + b) += by * other[a] * other[b];
                        *(i < j ? front.at(i + a, j + b) : front.at(j + b, i + a)) += by * one[a] * other[b];
                    }
            };
            const bool compound = s.compound();
            if (compound) add({x, y, s.turn_first[c]}, {-x, -y, s.turn_second[c]}, weight);
            else *front.at(i, i) += xx, *front.at(i, i + 1) += xy, *front.at(i + 1, i + 1) += yy;
            if (j >= 0 && !compound) {
                *front.at(j, j) += xx, *front.at(j, j + 1) += xy, *front.at(j + 1, j + 1) += yy;
                const Size row = std::min(i, j), column = std::max(i, j);
                *front.at(row, column) -= xx, *front.at(row, column + 1) -= xy;
                *front.at(row + 1, column) -= xy, *front.at(row + 1, column + 1) -= yy;
            }
            if (d == 2 || !s.dissipative() || s.tangential_dashpot[c] == 0.0) continue;
            add({-y, x, s.lever_first[c]}, {y, -x, s.lever_second[c]}, s.tangential_dashpot[c]);
        }
        for (Index c = child_[node]; c >= 0; c = sibling_[c]) {
            const double* update = store_.data() + update_start_[c] + (stays_[c] ? 0 : stacks);
            add_child(front, update, std::span(inner_).subspan(border_start_[c], border_start_[c + 1] - border_start_[c]), runs_[me]);
        }
        if (!eliminate(front.panel, front.update, pivots, rest)) return false;
    }
    return true;
}

// Add a child's Schur complement at the places `inner` of its disks, as many neighbouring columns at a time as are in
// one chunk here and there; `to` is overwritten.
void Fronts::add_child(const Front& front, const double* update, std::span<const Index> inner, Indices& to) {
    const Size count = d_ * Size(inner.size()), beyond = 8 * front.width - front.pivots;
    Size above = 0;  // places in the grid of the panel, so many of them pivots
    for (Size q = 0; q < count; ++q) {
        Size index = Size(inner[q / d_]) * d_ + q % d_;
        if (index < front.pivots) ++above;
        else index += beyond;
        to[q] = Index(index);
    }
    for (Size j = 0, end; j < count; j = end) {
        const Size lane = to[j] & 7, chunk = to[j] >> 3;
        for (end = j + 1; end < count && to[end] == to[end - 1] + 1 && (to[end] & 7) && (end & 7);) ++end;
        const double* from = update + 32 * (j >> 3) * ((j >> 3) + 1) + (j & 7);
        const Size split = std::min(above, end);
        add_rows(from, front.panel + 8 * chunk * front.height + lane, to.data(), 0, split, end - j);
        const Size own = chunk - front.width;
        if (split < end) add_rows(from, front.update + 32 * own * (own + 1) - 64 * front.width + lane, to.data(), split, end, end - j);
    }
}

void Fronts::solve(Out b) {
    if (tasks_.count() == 1) {
        forward_task(b.data(), 0, 0);
        back_task(b.data(), 0, 0);
        return;
    }
    std::copy(b.begin(), b.end(), solution_.begin());
    for_tasks(true, [&](int t, int me) { forward_task(solution_.data(), t, me); });
    for_tasks(false, [&](int t, int me) { back_task(solution_.data(), t, me); });
    std::copy(solution_.begin(), solution_.begin() + Size(b.size()), b.begin());
}

// Forward along the nodes of a task. What goes to disks of others is summed up behind the n disks, for them to take.
void Fronts::forward_task(double* flat, int t, int me) {
    const Size d = d_;
    double *x = work_[me].data(), *beyond = flat + d * n_;
    std::fill(beyond + d * tasks_.carry[t], beyond + d * tasks_.carry[t + 1], 0.0);
    for (int below = 0; below < t; ++below)
        if (tasks_.parent[below] == t)
            for (auto q = tasks_.carry[below]; q < tasks_.carry[below + 1]; ++q)
                for (Size a = 0; a < d; ++a) flat[d * tasks_.onward[q] + a] += beyond[d * q + a];
    for (int s = t > 0 ? tasks_.end[t - 1] : 0; s < tasks_.end[t]; ++s) {
        const Size pivots = d * Size(end_[s] - first_[s]), width = chunks(pivots);
        if (pivots == 0) continue;
        double* own = flat + d * Size(first_[s]);
        std::fill(x + 8 * width - 8, x + 8 * width, 0.0);
        std::copy(own, own + pivots, x);
        forward(store_.data() + panel_start_[s], x, height_of(pivots), pivots, chunks(d * (border_start_[s + 1] - border_start_[s])));
        std::copy(x, x + pivots, own);
        const double* left = x + 8 * width;
        for (auto q = border_start_[s]; q < border_start_[s + 1]; ++q)
            for (Size a = 0; a < d; ++a) flat[d * tasks_.target[q] + a] -= *left++;
    }
}

void Fronts::back_task(double* flat, int t, int me) {
    const Size d = d_;
    double* x = work_[me].data();
    for (int s = tasks_.end[t] - 1, begin = t > 0 ? tasks_.end[t - 1] : 0; s >= begin; --s) {
        const Size pivots = d * Size(end_[s] - first_[s]), width = chunks(pivots);
        if (pivots == 0) continue;
        const Size count = width + chunks(d * (border_start_[s + 1] - border_start_[s]));
        double* own = flat + d * Size(first_[s]);
        std::fill(x + 8 * count - 8, x + 8 * count, 0.0);
        std::fill(x + 8 * width - 8, x + 8 * width, 0.0);
        std::copy(own, own + pivots, x);
        double* to = x + 8 * width;
        for (auto q = border_start_[s]; q < border_start_[s + 1]; ++q)
            for (Size a = 0; a < d; ++a) *to++ = flat[d * Size(border_[q]) + a];
        back(store_.data() + panel_start_[s], x, height_of(pivots), count);
        std::copy(x, x + pivots, own);
    }
}

}  // namespace nscd
