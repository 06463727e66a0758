#include "factor.hpp"

#include <algorithm>

namespace nscd {

Factor::Factor(const System& given, Team& team, const Sizes& sizes) : team_(team) {
    const Graph graph = graph_of(given.n, given.first, given.second);
    const bool by_rows = given.n < sizes.many, shared = !by_rows && given.n >= sizes.shared;
    ordering_ = by_rows ? minimum_degree(graph) : dissect(given.x, given.y, graph, sizes.leaf, team, sizes.shared);
    contact_ = by_parts(ordering_.place, given.first, given.second, shared ? MOST_THREADS : 1, parts_);
    system_ = chosen(given, contact_, ordering_.order, ordering_.place);
    system_.scale = given.scale;
    if (by_rows) rows_ = rows_of(graph, ordering_, system_.first, system_.second, given.d);
    else fronts_.emplace(ordering_, graph, system_.first, system_.second, given.d, team, sizes.shared);
}

bool Factor::factorise(In theta, bool bare) {
    if (bare == made_bare_ && std::equal(theta.begin(), theta.end(), made_.begin(), made_.end())) return true;
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

Numbers Factor::contacts_ordered(In given) const {
    Numbers ordered(given.size());
    for (std::size_t c = 0; c < ordered.size(); ++c) ordered[c] = given[contact_[c]];
    return ordered;
}

Numbers Factor::contacts_given(In ordered) const {
    Numbers given(ordered.size());
    for (std::size_t c = 0; c < given.size(); ++c) given[contact_[c]] = ordered[c];
    return given;
}

Numbers Factor::disks_ordered(In given) const {
    Numbers ordered(given.size());
    const int d = system_.d;
    for (int i = 0; i < system_.n; ++i)
        for (int a = 0; a < d; ++a) ordered[d * i + a] = given[std::size_t(d) * ordering_.order[i] + a];
    return ordered;
}

Numbers Factor::disks_given(In ordered) const {
    Numbers given(ordered.size());
    const int d = system_.d;
    for (int i = 0; i < system_.n; ++i)
        for (int a = 0; a < d; ++a) given[std::size_t(d) * ordering_.order[i] + a] = ordered[d * i + a];
    return given;
}

}  // namespace nscd
