#include "factor.hpp"

#include <algorithm>

namespace nscd {

Factor::Factor(const System& problem, Team& team, const Sizes& sizes, ReusableOrder* reusable, std::span<const Index> disk) : team_(team), sizes_(sizes) {
    const bool by_rows = problem.n < sizes.multifrontal, shared = !by_rows && problem.n >= sizes.shared;
    const auto graph = [&] { return graph_of(problem.n, problem.first, problem.second); };
    ordering_ = by_rows ? minimum_degree(graph())
                : reusable ? reusable->order_of(problem.x, problem.y, problem.first, problem.second, disk, sizes.leaf, team, sizes.shared)
                        : dissect(problem.x, problem.y, graph(), sizes.leaf, team, sizes.shared);
    contact_ = by_parts(ordering_.index, problem.first, problem.second, shared ? MOST_THREADS : 1, parts_);
    system_ = chosen(problem, contact_, ordering_.order, ordering_.index);
    system_.scale = problem.scale;
}

void Factor::plan() {
    Indices first = system_.first, second = system_.second;
    for (Index& i : first) i = ordering_.order[i];
    for (Index& j : second)
        if (j >= 0) j = ordering_.order[j];
    const Graph graph = graph_of(system_.n, first, second);
    if (system_.n < sizes_.multifrontal) rows_ = rows_of(graph, ordering_, system_.first, system_.second, system_.d);
    else fronts_.emplace(ordering_, graph, system_.first, system_.second, system_.d, team_, sizes_.shared);
}

bool Factor::factorise(In theta, bool bare) {
    if (bare == made_bare_ && std::equal(theta.begin(), theta.end(), made_.begin(), made_.end())) return true;
    if (!rows_ && !fronts_) plan();
    made_.clear();
    if (bare && system_.dissipative() && bare_.n == 0) {
        bare_ = system_;
        bare_.along.assign(bare_.k, 0.0), bare_.across.assign(bare_.k, 0.0);
    }
    const System& s = bare && system_.dissipative() ? bare_ : system_;
    if (!(rows_ ? nscd::factorise(s, *rows_, theta) : fronts_->factorise(s, theta))) return false;
    made_.assign(theta.begin(), theta.end()), made_bare_ = bare;
    return true;
}

void Factor::solve(Out b) { rows_ ? nscd::solve(*rows_, b) : fronts_->solve(b); }

Vector Factor::contacts_ordered(In values) const {
    Vector ordered(values.size());
    for (std::size_t c = 0; c < ordered.size(); ++c) ordered[c] = values[contact_[c]];
    return ordered;
}

Vector Factor::contacts_given(In ordered) const {
    Vector values(ordered.size());
    for (std::size_t c = 0; c < values.size(); ++c) values[contact_[c]] = ordered[c];
    return values;
}

Vector Factor::disks_ordered(In values) const {
    Vector ordered(values.size());
    const int d = system_.d;
    for (int i = 0; i < system_.n; ++i)
        for (int a = 0; a < d; ++a) ordered[d * i + a] = values[std::size_t(d) * ordering_.order[i] + a];
    return ordered;
}

Vector Factor::disks_given(In ordered) const {
    Vector values(ordered.size());
    const int d = system_.d;
    for (int i = 0; i < system_.n; ++i)
        for (int a = 0; a < d; ++a) values[std::size_t(d) * ordering_.order[i] + a] = ordered[d * i + a];
    return values;
}

}  // namespace nscd
