// The door to Python of contacts with friction.
#include "binding.hpp"
#include "friction_solver.hpp"

namespace nscd {

namespace {

// λ, τ (k) N·s and u (n, 3), their error, and what they cost: pairs of sweeps, or pivots.
struct FrictionIterate {
    Made<double, 1> reaction, tangential;
    Made<double, 2> velocity;
    double error;
    int cost;
};
FrictionIterate give_iterate(FrictionSolution&& at, double error, int cost) {
    return {give(std::move(at.reaction)), give(std::move(at.tangential)), give<2>(std::move(at.velocity), 3), error, cost};
}
struct TwoSolutions {
    Made<double, 2> x, y, alone;
};

double worst_of(const Vector& errors) { return errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()); }

// `nscd.friction.FrictionProblem`: parts of the solver, for tests and measurements.
class Problem {
public:
    Problem(const Pairs& pairs, const MatrixArg& left_velocity, const VectorArg& spin, const VectorArg& friction, const VectorArg& normal_dashpot, const VectorArg& tangential_dashpot) {
        ImpactProblem s = impact_problem_of_pairs(pairs, span(left_velocity), {});
        const auto vector = [](const auto& of) { return Vector(of.data(), of.data() + of.size()); };
        const std::size_t n = s.n, k = s.k;
        need(spin.size() == n && friction.size() == k && normal_dashpot.size() == k && tangential_dashpot.size() == k, "friction: shapes differ");
        s.normal_dashpot = vector(normal_dashpot), s.tangential_dashpot = vector(tangential_dashpot);
        Vector inertia(n);
        for (std::size_t i = 0; i < n; ++i) inertia[i] = 0.5 * s.mass[2 * i] * std::get<4>(pairs)(i) * std::get<4>(pairs)(i);
        p_ = friction_problem_of(s, span(std::get<4>(pairs)), span(spin), inertia, vector(friction));
    }

    // Plain sweeps from percussions.
    FrictionIterate sweep(const VectorArg& reaction, const VectorArg& tangential, int count, double tolerance) const {
        need(int(reaction.size()) == p_.k && int(tangential.size()) == p_.k, "sweep: (k,) is needed");
        FrictionSolution iterate{Vector(reaction.data(), reaction.data() + p_.k), Vector(tangential.data(), tangential.data() + p_.k), p_.left_velocity};
        int made = 0;
        const double error = Sweeps(p_).until_converged(iterate.reaction, iterate.tangential, iterate.velocity, count, tolerance, made);
        return give_iterate(std::move(iterate), error, made);
    }

    // One method alone.
    FrictionIterate by(FrictionMethod method, double tolerance, int pivot_budget) const {
        FrictionResult found = solve_friction_by(p_, method, tolerance, pivot_budget);
        const double error = worst_of(island_errors(p_, found.solution));
        return give_iterate(std::move(found.solution), error, found.pivots);
    }

    // x, y of A x = b and A y = c, (n, 3), for weights (4, k) of the contacts; x again, alone.
    TwoSolutions solve_matrix(const MatrixArg& weights, const MatrixArg& b, const MatrixArg& c) const {
        need(weights.shape(0) == 4 && int(weights.shape(1)) == p_.k && b.size() == p_.mass.size() && c.size() == b.size(), "matrix: shapes differ");
        Indices disks(p_.n), contacts(p_.k);
        for (int i = 0; i < p_.n; ++i) disks[i] = i;
        for (int e = 0; e < p_.k; ++e) contacts[e] = e;
        Subproblem subproblem(p_, disks, contacts);
        Weights weights_of(p_.k);
        Vector* parts[] = {&weights_of.nn, &weights_of.tt, &weights_of.tn, &weights_of.nt};
        for (int a = 0; a < 4; ++a)
            for (int e = 0; e < p_.k; ++e) (*parts[a])[e] = weights(a, subproblem.contact[e]);
        need(subproblem.factor.factorise(subproblem.problem, weights_of), "matrix: it is singular");
        const auto picked = [&](const MatrixArg& from) {
            Vector some(from.size());
            for (std::size_t i = 0; i < some.size(); ++i) some[i] = from(subproblem.disk[i / 3], i % 3);
            return some;
        };
        Vector one = picked(b), two = picked(c), alone = one;
        subproblem.factor.solve(one, two);
        subproblem.factor.solve(alone);
        const auto append = [&](const Vector& some) {
            Vector all(some.size());
            for (std::size_t i = 0; i < some.size(); ++i) all[3 * subproblem.disk[i / 3] + i % 3] = some[i];
            return give<2>(std::move(all), 3);
        };
        return {append(one), append(two), append(alone)};
    }

private:
    FrictionProblem p_;
};

using Changed = nb::ndarray<double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void planar(const ArrayArg<Index, 1>& start, const ArrayArg<Index, 1>& column, const VectorArg& value, const VectorArg& free, const VectorArg& friction,
            Changed reaction, int sweeps) {
    const std::size_t k = friction.size();
    need(start.size() == 2 * k + 1 && column.size() == value.size() && free.size() == 2 * k && reaction.size() == 2 * k, "planar: shapes differ");
    planar_sweeps(span(start), span(column), span(value), span(free), span(friction), {reaction.data(), reaction.size()}, sweeps);
}

}  // namespace

void bind_friction(nb::module_& m) {
    nb::enum_<FrictionMethod>(m, "FrictionMethod").value("PROXIMAL_NEWTON", FrictionMethod::PROXIMAL_NEWTON).value("PROXIMAL_POINT", FrictionMethod::PROXIMAL_POINT).value("RANDOM_START", FrictionMethod::RANDOM_START);
    using Iterate = FrictionIterate;
    Result<Iterate>(m, "FrictionIterate").field("reaction", &Iterate::reaction).field("tangential", &Iterate::tangential)
        .field("velocity", &Iterate::velocity).field("error", &Iterate::error).field("cost", &Iterate::cost);
    Result<TwoSolutions>(m, "TwoSolutions").field("x", &TwoSolutions::x).field("y", &TwoSolutions::y).field("alone", &TwoSolutions::alone);
    nb::class_<Problem>(m, "FrictionProblem")
        .def(nb::init<const Pairs&, const MatrixArg&, const VectorArg&, const VectorArg&, const VectorArg&, const VectorArg&>(), "pairs"_a, "left_velocity"_n, "spin"_n,
             "friction"_n, "normal_dashpot"_n, "tangential_dashpot"_n)
        .def("sweep", &Problem::sweep, "reaction"_n, "tangential"_n, "pairs"_a, "tolerance"_a)
        .def("by", &Problem::by, "method"_a, "tolerance"_a, "pivot_budget"_a)
        .def("solve_matrix", &Problem::solve_matrix, "weights"_n, "b"_n, "c"_n);
    m.def("planar_sweeps", &planar, "start"_n, "column"_n, "value"_n, "free"_n, "friction"_n, "reaction"_n, "sweeps"_a);
}

}  // namespace nscd
