// The door to Python of contacts with friction.
#include "binding.hpp"
#include "friction_answer.hpp"

namespace nscd {

namespace {

// λ, τ (k) N·s and u (n, 3).
auto give_rubbed(Rubbed&& at) {
    return std::make_tuple(give(std::move(at.lam)), give(std::move(at.tau)), give<2>(std::move(at.u), 3));
}

double worst_of(const Numbers& errors) { return errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()); }

// `nscd.friction.FrictionProblem` with the places of its disks: parts of the solver, for tests and measurements.
class Problem {
public:
    Problem(const Given<Index, 1>& first, const Given<Index, 1>& second, const Matrix& normal, const Matrix& lever, const Vector& friction,
            const Vector& along, const Vector& across, const Vector& offset, const Matrix& mass, const Matrix& left, const Matrix& position,
            double scale) {
        const std::size_t k = first.size(), n = mass.shape(0);
        need(second.size() == k && normal.size() == 2 * k && lever.size() == 2 * k && friction.size() == k && along.size() == k && across.size() == k && offset.size() == k, "friction: (k,) of each contact is needed");
        need(mass.size() == 3 * n && left.size() == 3 * n && position.size() == 2 * n, "friction: (n, 3) and (n, 2) of disks are needed");
        const auto column = [](const Matrix& of, std::size_t rows, int at) {
            Numbers some(rows);
            for (std::size_t i = 0; i < rows; ++i) some[i] = of(i, at);
            return some;
        };
        const auto numbers = [](const auto& of) { return Numbers(of.data(), of.data() + of.size()); };
        p_.n = int(n), p_.k = int(k), p_.d = 3;
        p_.first.assign(first.data(), first.data() + k), p_.second.assign(second.data(), second.data() + k);
        for (std::size_t c = 0; c < k; ++c) need(first(c) >= 0 && first(c) < int(n) && second(c) < int(n), "contacts: a disk that does not exist");
        p_.nx = column(normal, k, 0), p_.ny = column(normal, k, 1);
        p_.lever_first = column(lever, k, 0), p_.lever_second = column(lever, k, 1);
        p_.friction = numbers(friction), p_.along = numbers(along), p_.across = numbers(across), p_.offset = numbers(offset);
        p_.mass = numbers(mass), p_.left = numbers(left);
        p_.x = column(position, n, 0), p_.y = column(position, n, 1);
        p_.scale = scale;
        p_.prepare();
    }

    // λ, τ, u of plain sweeps from percussions; natural map, pairs.
    auto sweep(const Vector& along, const Vector& across, int pairs, double tolerance) const {
        need(int(along.size()) == p_.k && int(across.size()) == p_.k, "sweep: (k,) is needed");
        Rubbed at{Numbers(along.data(), along.data() + p_.k), Numbers(across.data(), across.data() + p_.k), p_.left};
        int made = 0;
        const double error = Sweeps(p_).plain(at.lam, at.tau, at.u, pairs, tolerance, made);
        return std::make_tuple(give_rubbed(std::move(at)), error, made);
    }

    // λ, τ, u; error, pivots: one method alone.
    auto by(int method, double tolerance, int effort) const {
        FrictionAnswer found = solve_friction_by(p_, FrictionMethod(method), tolerance, effort);
        const double error = worst_of(measure(p_, found.at));
        return std::make_tuple(give_rubbed(std::move(found.at)), error, found.pivots);
    }

    // x, y of A x = b and A y = c, (n, 3), for weights (4, k) of the contacts; x again, alone.
    auto solve_matrix(const Matrix& weights, const Matrix& b, const Matrix& c) const {
        need(weights.shape(0) == 4 && int(weights.shape(1)) == p_.k && b.size() == p_.mass.size() && c.size() == b.size(), "matrix: shapes differ");
        Places disks(p_.n), contacts(p_.k);
        for (int i = 0; i < p_.n; ++i) disks[i] = i;
        for (int e = 0; e < p_.k; ++e) contacts[e] = e;
        Part part(p_, disks, contacts);
        Weights given(p_.k);
        Numbers* parts[] = {&given.along, &given.across, &given.turned, &given.mixed};
        for (int a = 0; a < 4; ++a)
            for (int e = 0; e < p_.k; ++e) (*parts[a])[e] = weights(a, part.contact[e]);
        need(part.factor.factorise(part.problem, given), "matrix: it is singular");
        const auto picked = [&](const Matrix& from) {
            Numbers some(from.size());
            for (std::size_t i = 0; i < some.size(); ++i) some[i] = from(part.disk[i / 3], i % 3);
            return some;
        };
        Numbers one = picked(b), two = picked(c), alone = one;
        part.factor.solve(one, two);
        part.factor.solve(alone);
        const auto put = [&](const Numbers& some) {
            Numbers all(some.size());
            for (std::size_t i = 0; i < some.size(); ++i) all[3 * part.disk[i / 3] + i % 3] = some[i];
            return give<2>(std::move(all), 3);
        };
        return std::make_tuple(put(one), put(two), put(alone));
    }

private:
    Rubbing p_;
};

using Changed = nb::ndarray<double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void planar(const Given<Index, 1>& start, const Given<Index, 1>& column, const Vector& value, const Vector& free, const Vector& friction,
            Changed reaction, int sweeps) {
    const std::size_t k = friction.size();
    need(start.size() == 2 * k + 1 && column.size() == value.size() && free.size() == 2 * k && reaction.size() == 2 * k, "planar: shapes differ");
    planar_sweeps(span(start), span(column), span(value), span(free), span(friction), {reaction.data(), reaction.size()}, sweeps);
}

}  // namespace

void bind_friction(nb::module_& m) {
    nb::class_<Problem>(m, "FrictionProblem")
        .def(nb::init<const Given<Index, 1>&, const Given<Index, 1>&, const Matrix&, const Matrix&, const Vector&, const Vector&, const Vector&,
                      const Vector&, const Matrix&, const Matrix&, const Matrix&, double>(),
             "first"_a.noconvert(), "second"_a.noconvert(), "normal"_a.noconvert(), "lever"_a.noconvert(), "friction"_a.noconvert(),
             "along"_a.noconvert(), "across"_a.noconvert(), "offset"_a.noconvert(), "mass"_a.noconvert(), "left"_a.noconvert(),
             "position"_a.noconvert(), "scale"_a)
        .def("sweep", &Problem::sweep, "along"_a.noconvert(), "across"_a.noconvert(), "pairs"_a, "tolerance"_a)
        .def("by", &Problem::by, "method"_a, "tolerance"_a, "effort"_a)
        .def("solve_matrix", &Problem::solve_matrix, "weights"_a.noconvert(), "b"_a.noconvert(), "c"_a.noconvert());
    m.def("planar_sweeps", &planar, "start"_a.noconvert(), "column"_a.noconvert(), "value"_a.noconvert(), "free"_a.noconvert(),
          "friction"_a.noconvert(), "reaction"_a.noconvert(), "sweeps"_a);
}

}  // namespace nscd
