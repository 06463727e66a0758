#include "factor.hpp"

#include <algorithm>

namespace nscd {

Factor::Factor(const ImpactProblem& problem, Team& team, const Sizes& sizes, ReusableOrder* reusable, std::span<const Index> disk) : team_(team), sizes_(sizes) {
    const bool by_rows = problem.n < sizes.multifrontal, shared = !by_rows && problem.n >= sizes.shared;
    const auto graph = [&] { return graph_of(problem.n, problem.first, problem.second); };
    ordering_ = by_rows ? minimum_degree(graph())
                : reusable ? reusable->order_of(problem.x, problem.y, problem.first, problem.second, disk, sizes.leaf, team, sizes.shared)
                        : dissect(problem.x, problem.y, graph(), sizes.leaf, team, sizes.shared);
    contact_ = by_parts(ordering_.index, problem.first, problem.second, shared ? MOST_THREADS : 1, parts_);
    problem_ = restrict_to(problem, contact_, ordering_.order, ordering_.index);
    problem_.scale = problem.scale;
}

void Factor::plan() {
    Indices first = problem_.first, second = problem_.second;
    for (Index& i : first) i = ordering_.order[i];
    for (Index& j : second)
        if (j >= 0) j = ordering_.order[j];
    const Graph graph = graph_of(problem_.n, first, second);
    if (problem_.n < sizes_.multifrontal) rows_ = rows_of(graph, ordering_, problem_.first, problem_.second, problem_.d);
    else fronts_.emplace(ordering_, graph, problem_.first, problem_.second, problem_.d, team_, sizes_.shared);
}

bool Factor::factorise(In theta, bool mass_only) {
    if (mass_only == factored_mass_only_ && std::equal(theta.begin(), theta.end(), factored_theta_.begin(), factored_theta_.end())) return true;
    if (!rows_ && !fronts_) plan();
    factored_theta_.clear();
    if (mass_only && problem_.dissipative() && mass_only_.n == 0) {
        mass_only_ = problem_;
        mass_only_.normal_dashpot.assign(mass_only_.k, 0.0), mass_only_.tangential_dashpot.assign(mass_only_.k, 0.0);
    }
    const ImpactProblem& s = mass_only && problem_.dissipative() ? mass_only_ : problem_;
    if (!(rows_ ? nscd::factorise(s, *rows_, theta) : fronts_->factorise(s, theta))) return false;
    factored_theta_.assign(theta.begin(), theta.end()), factored_mass_only_ = mass_only;
    return true;
}

void Factor::solve(Out b) { rows_ ? nscd::solve(*rows_, b) : fronts_->solve(b); }

Vector Factor::contacts_in_elimination_order(In values) const {
    Vector ordered(values.size());
    for (std::size_t c = 0; c < ordered.size(); ++c) ordered[c] = values[contact_[c]];
    return ordered;
}

Vector Factor::contacts_in_input_order(In ordered) const {
    Vector values(ordered.size());
    for (std::size_t c = 0; c < values.size(); ++c) values[contact_[c]] = ordered[c];
    return values;
}

Vector Factor::disks_in_elimination_order(In values) const {
    Vector ordered(values.size());
    const int d = problem_.d;
    for (int i = 0; i < problem_.n; ++i)
        for (int a = 0; a < d; ++a) ordered[d * i + a] = values[std::size_t(d) * ordering_.order[i] + a];
    return ordered;
}

Vector Factor::disks_in_input_order(In ordered) const {
    Vector values(ordered.size());
    const int d = problem_.d;
    for (int i = 0; i < problem_.n; ++i)
        for (int a = 0; a < d; ++a) values[std::size_t(d) * ordering_.order[i] + a] = ordered[d * i + a];
    return values;
}

}  // namespace nscd
