// The door to Python: arrays in, arrays out. What is no contiguous array of the right kind is refused.
#include "answer.hpp"
#include "binding.hpp"
#include "contacts.hpp"
#include "dense.hpp"
#include "frames.hpp"
#include "soft.hpp"
#include "step.hpp"

namespace {

using namespace nscd;

// Beyond this, squares of a number and their products with another leave double precision.
constexpr double LARGEST = 1e100;

Numbers numbers(const auto& given) { return Numbers(given.data(), given.data() + given.size()); }
Places places(const auto& given) { return Places(given.data(), given.data() + given.size()); }

// Connected walls, as `nscd.segments.connect` finds them.
Segments walls_of(const Matrix& start, const Matrix& along, const Given<Index, 2>& vertex, const Given<bool, 2>& inner,
                  double low, double period) {
    need(start.shape(1) == 2 && along.size() == start.size() && vertex.size() == start.size() && inner.size() == start.size(), "walls: shapes differ");
    Segments walls{int(start.shape(0)), numbers(start), numbers(along), places(vertex), Flags(inner.data(), inner.data() + inner.size()), 0.0, low, period};
    for (std::size_t i = 0; i < walls.start.size(); ++i)
        walls.far = std::max({walls.far, std::abs(walls.start[i]), std::abs(walls.start[i] + walls.along[i])});
    if (period > 0.0) walls.far = std::max({walls.far, std::abs(low), std::abs(low + period)});
    return walls;
}

void need_bodies(const Matrix& position, const Vector& radius) {
    need(position.shape(1) == 2 && position.shape(0) == radius.size(), "position: (n, 2) is needed");
}

// How many are of two disks (−1: more pairs are within reach than memory should hold), first, second, vector, distance, gap.
auto touching_of(const Matrix& position, const Vector& radius, const Segments& walls, double most) {
    need_bodies(position, radius);
    Touching found;
    {
        nb::gil_scoped_release others;
        found = touching(span(position), span(radius), walls, most);
    }
    return std::make_tuple(found.pairs, give(std::move(found.first)), give(std::move(found.second)), give<2>(std::move(found.vector), 2),
                           give(std::move(found.distance)), give(std::move(found.gap)));
}

// first, second, wall, normal, gap of `Neighbours`.
auto give_neighbours(Neighbours&& near) {
    return std::make_tuple(give(std::move(near.first)), give(std::move(near.second)), give(std::move(near.wall)),
                           give<2>(std::move(near.normal), 2), give(std::move(near.gap)));
}

auto neighbours(const Matrix& position, const Vector& radius, const Segments& walls, double margin) {
    need_bodies(position, radius);
    return give_neighbours(neighbours_of(span(position), span(radius), walls, margin));
}

Bodies bodies_of(const Matrix& position, const Matrix& velocity, const Matrix& free, const Vector& radius, const Vector& mass, const Segments& walls) {
    need_bodies(position, radius);
    need(velocity.size() == position.size() && free.size() == position.size() && mass.size() == radius.size(), "bodies: shapes differ");
    return {span(position), span(velocity), span(free), span(radius), span(mass), walls, {}, {}, {}};
}

// body (n), centre (b, 2), mass and inertia (b) of `Members`, and velocities of the bodies (b, 3).
using Wide = std::tuple<Given<Index, 1>, Matrix, Vector, Vector, Matrix>;
Members members_of(const Wide& given, std::size_t n) {
    const auto& [body, centre, mass, inertia, moving] = given;
    const std::size_t b = mass.size();
    need(body.size() == n && centre.size() == 2 * b && inertia.size() == b && moving.size() == 3 * b, "bodies: shapes differ");
    for (std::size_t i = 0; i < n; ++i) need(body(i) >= 0 && body(i) < Index(b), "bodies: a body that does not exist");
    return {span(body), span(centre), span(mass), span(inertia)};
}

// Neighbours, reaction, friction, velocity, spin, keys, error, iterations, rung, repeats of `Stepped`; known (2, m): reaction
// and friction of the keys of the step before.
auto step(const Matrix& position, const Matrix& velocity, const Matrix& free, const Vector& radius, const Vector& mass, const Segments& walls,
          double seconds, double restitution, double gained, double tolerance, double friction, const Vector& spin, const Vector& inertia,
          const Whole& keys, const Matrix& known, std::optional<Wide> wide, std::optional<Matrix> unheld) {
    Bodies bodies = bodies_of(position, velocity, free, radius, mass, walls);
    if (wide) {
        need(unheld && unheld->size() == std::get<4>(*wide).size(), "bodies: shapes differ");
        bodies.wide = members_of(*wide, radius.size()), bodies.moving = span(std::get<4>(*wide)), bodies.unheld = span(*unheld);
    }
    need(spin.size() == radius.size() && inertia.size() == radius.size() && known.size() == 2 * keys.size(), "step: shapes differ");
    const In both = span(known);
    const Rough rough{friction, span(spin), span(inertia), span(keys), both.first(keys.size()), both.last(keys.size())};
    Stepped found;
    {
        nb::gil_scoped_release others;
        found = make_step(bodies, rough, seconds, restitution, gained, tolerance);
    }
    return std::make_tuple(give_neighbours(std::move(found.neighbours)), give(std::move(found.reaction)), give(std::move(found.tangential)),
                           give<2>(std::move(found.velocity), wide ? 3 : 2), give(std::move(found.spin)), give(std::move(found.keys)), found.error,
                           found.iterations, found.rung, found.repeats);
}

auto drifts_of(const Matrix& before, const Matrix& after, const Given<Index, 1>& first, const Given<Index, 1>& second, const Matrix& normal,
               const Vector& gap, const Vector& reaction, double seconds, double slack) {
    const std::size_t k = reaction.size(), n = before.shape(0);
    need(before.shape(1) == 2 && after.size() == 2 * n && first.size() == k && second.size() == k && normal.size() == 2 * k && gap.size() == k, "drifts: shapes differ");
    const Neighbours near{places(first), places(second), {}, numbers(normal), numbers(gap)};
    for (std::size_t c = 0; c < k; ++c) need(near.first[c] >= 0 && near.first[c] < Index(n) && near.second[c] < Index(n), "contacts: a disk that does not exist");
    return give<2>(drifts(span(before), span(after), near, span(reaction), seconds, slack), 2);
}

auto freed_of(const Matrix& velocity, const Matrix& desired, double share, double x, double y) {
    need(velocity.shape(1) == 2 && (desired.size() == 0 || desired.size() == velocity.size()), "desired: (n, 2) is needed");
    Numbers free(velocity.size());
    const double most = freed(span(velocity), span(desired), share, {x, y}, free);
    return std::make_tuple(give<2>(std::move(free), 2), most);
}

auto headed_of(const Matrix& position, const Vector& start, const Vector& end, const Vector& outward, const Vector& place, double speed) {
    need(position.shape(1) == 2 && start.size() == 2 && end.size() == 2 && outward.size() == 2 && place.size() == 2, "headed: shapes differ");
    Numbers velocity(position.size());
    headed(span(position), span(start), span(end), span(outward), span(place), speed, velocity);
    return give<2>(std::move(velocity), 2);
}

auto clear_of_walls(const Matrix& from, const Matrix& to, const Matrix& start, const Matrix& end, double most) {
    need(from.shape(1) == 2 && from.size() == to.size() && start.shape(1) == 2 && start.size() == end.size(), "clear_of: shapes differ");
    Numbers clear(from.size() / 2);
    clear_of(span(from), span(to), span(start), span(end), most, clear);
    return give(std::move(clear));
}

// start, answered, first, second, is_wall, normal, gap, reaction, impulse, residual, velocity_error of `FilmAnswer`.
auto film(const Whole& start, const Whole& ids, const Matrix& position, const Matrix& left, const Vector& radius, const Vector& mass,
          const Segments& walls, double gap, double deepest, double tolerance, bool least) {
    need_bodies(position, radius);
    const auto n = std::int64_t(radius.size());
    bool rising = start.size() > 0 && start(0) == 0 && start(start.size() - 1) == n;
    for (std::size_t f = 1; f < start.size(); ++f) rising = rising && start(f) >= start(f - 1);
    need(rising && ids.size() == radius.size() && left.size() == position.size() && mass.size() == radius.size(), "film: shapes differ");
    const Film asked{span(start), span(ids), span(position), span(left), span(radius), span(mass), walls};
    FilmAnswer found;
    {
        nb::gil_scoped_release others;
        found = solve_film(asked, {gap, deepest, tolerance, least});
    }
    return std::make_tuple(give(std::move(found.start)), give_marks(std::move(found.answered)), give(std::move(found.first)),
                           give(std::move(found.second)), give_marks(std::move(found.is_wall)), give<2>(std::move(found.normal), 2),
                           give(std::move(found.gap)), give(std::move(found.reaction)), give<2>(std::move(found.impulse), 2),
                           give(std::move(found.residual)), give(std::move(found.velocity_error)));
}

using Changed = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void soft_forces(Changed force, const Matrix& x, const Matrix& v, const Vector& radius, const Vector& mass, const Whole& first,
                 const Whole& second, const Whole& wall, const Segments& walls, const Vector& law, bool apart) {
    need_bodies(x, radius);
    const std::size_t k = first.size();
    need(force.size() == x.size() && v.size() == x.size() && mass.size() == radius.size() && second.size() == k && wall.size() == k && law.size() == 9, "soft: shapes differ");
    const Soft soft{{law(0), law(1), law(2), law(3)}, {law(4), law(5), law(6), law(7)}, law(8), apart};
    contact_forces({force.data(), force.size()}, span(x), span(v), span(radius), span(mass), span(first), span(second), span(wall), walls, soft);
}

void soft_drive(Changed acceleration, const Matrix& x, const Matrix& v, double speed, double tau, const Matrix& start, const Matrix& end,
                const Matrix& door, const Matrix& outward) {
    const std::size_t size = acceleration.size();
    need(x.size() == size && v.size() == size && start.size() == size && end.size() == size && door.size() == size && outward.size() == size, "soft: shapes differ");
    add_drive({acceleration.data(), size}, span(x), span(v), speed, tau, span(start), span(end), span(door), span(outward));
}

bool crosses_of(const Matrix& before, const Matrix& after, const Matrix& start, const Matrix& end) {
    need(before.size() == after.size() && start.size() == end.size(), "crosses: shapes differ");
    return crosses(span(before), span(after), span(start), span(end));
}

auto components_of(int n, const Given<Index, 1>& first, const Given<Index, 1>& second) {
    need(first.size() == second.size(), "components: shapes differ");
    for (std::size_t c = 0; c < first.size(); ++c) need(first(c) >= 0 && first(c) < n && second(c) < n, "contacts: a disk that does not exist");
    Places label;
    components(n, span(first), span(second), label);
    return give(std::move(label));
}

using Fields = nb::typed<nb::dict, nb::str, nb::any>;
// Fields of `nscd.Percussions` by name; whether every number is finite, energy before (J), rung, disks (with friction the seed
// of the search), rounds, threads; fields of `nscd.percussions.FrictionPart`, empty without.
using Said = std::tuple<Fields, bool, double, int, int, int, int, Fields>;

// What `solve_impact` says of an answer (u: n·d) whether or not there is friction.
Fields said_of(Numbers&& reaction, Numbers&& impulse, const Numbers& u, int d, double energy, double change, double work) {
    const std::size_t n = u.size() / d;
    Numbers turning(d == 3 ? n : 0), moving(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        for (int a = 0; a < 2; ++a) moving[2 * i + a] = u[d * i + a];
        if (d == 3) turning[i] = u[3 * i + 2];
    }
    Fields said;
    said["reaction"] = give(std::move(reaction));
    said["impulse"] = give<2>(std::move(impulse), 2);
    said["right_velocity"] = give<2>(std::move(moving), 2);
    if (d == 3) said["right_spin"] = give(std::move(turning));
    said["energy_change"] = change;
    said["energy_error"] = std::abs(change + 0.5 * work) / (energy != 0.0 ? energy : 1.0);
    return said;
}

// Percussions with Coulomb's law of a problem without spins, or of wide bodies.
Said solve_with_friction(const System& s, const Vector& radius, const Vector& spin, const Vector& friction, double tolerance, int starts) {
    Numbers inertia(s.wide() ? 0 : s.n);
    for (std::size_t i = 0; i < inertia.size(); ++i) inertia[i] = 0.5 * s.mass[2 * i] * radius(i) * radius(i);
    Rubbing p = rubbing_of(s, span(radius), span(spin), inertia, numbers(friction));
    FrictionAnswer found;
    FrictionCertificate of;
    {
        nb::gil_scoped_release others;
        found = solve_friction(p, tolerance, starts, s.wide() ? In(s.reach) : span(radius));
        of = certified(p, found.at);
    }
    Fields said = said_of(std::move(found.at.lam), std::move(of.impulse), found.at.u, 3, of.energy, of.change, of.work), part;
    said["residual"] = of.natural_map, said["momentum_error"] = of.momentum_error;
    said["iterations"] = found.pairs + found.pivots, said["canonical"] = false;
    said["velocity_error"] = INFINITE;
    part["tangential"] = give(std::move(found.at.tau)), part["state"] = give(std::move(of.state));
    part["signorini"] = of.signorini, part["cone"] = of.cone, part["natural_map"] = of.natural_map;
    part["dissipation"] = of.dissipation, part["spread"] = found.spread;
    const bool finite = std::isfinite(of.momentum_error + of.natural_map);
    return {std::move(said), finite, of.energy, choice_of(found.route), found.seed, 0, 1, std::move(part)};
}

std::optional<Said> solve_impact(const Whole& first, const Whole& second, const Marks& is_wall, const Matrix& normal, const Matrix& position,
                  const Vector& radius, const Vector& mass, const Matrix& left, std::optional<Vector> spin, std::optional<Vector> along,
                  std::optional<Vector> across, bool maintained, std::optional<Vector> offset, std::optional<Matrix> free,
                  double least_scale, double tolerance, bool least, bool bounded, int method, int threads,
                  std::optional<Vector> guess, int shared, std::optional<Vector> friction, int starts, std::optional<Wide> bodies) {
    const std::size_t n = mass.size(), k = first.size();
    need(second.size() == k && is_wall.size() == k && normal.size() == 2 * k && left.size() == 2 * n && position.size() == 2 * n && radius.size() == n && (!friction || (spin && friction->size() == k && starts > 0)), "solve: shapes differ");
    System s;
    const bool turns = spin && !friction && !bodies;
    s.n = int(n), s.k = int(k), s.d = turns ? 3 : 2, s.maintained = maintained, s.least_scale = least_scale;
    s.first.resize(k), s.second.resize(k), s.nx.resize(k), s.ny.resize(k), s.inverse_mass.resize(k);
    if (turns) s.lever_first.resize(k), s.lever_second.resize(k);
    for (std::size_t c = 0; c < k; ++c) {
        const std::int64_t i = first(c), j = is_wall(c) ? -1 : second(c);
        if (i < 0 || i >= std::int64_t(n) || j >= std::int64_t(n)) return std::nullopt;
        s.first[c] = Index(i), s.second[c] = Index(j);
        s.nx[c] = normal(c, 0), s.ny[c] = normal(c, 1);
        s.inverse_mass[c] = 1.0 / mass(i) + (j >= 0 ? 1.0 / mass(j) : 0.0);
        if (turns) s.lever_first[c] = radius(i), s.lever_second[c] = j >= 0 ? radius(j) : 0.0;
    }
    s.offset = offset ? numbers(*offset) : Numbers(k, 0.0);
    if (along) s.along = numbers(*along), s.across = numbers(*across);
    s.x.resize(n), s.y.resize(n), s.mass.resize(n * s.d), s.left.resize(n * s.d);
    for (std::size_t i = 0; i < n; ++i) {
        s.x[i] = position(i, 0), s.y[i] = position(i, 1);
        for (int a = 0; a < 2; ++a) s.mass[s.d * i + a] = mass(i), s.left[s.d * i + a] = left(i, a);
        if (turns) s.mass[3 * i + 2] = 0.5 * mass(i) * radius(i) * radius(i), s.left[3 * i + 2] = (*spin)(i);
    }
    if (!(largest(s.left) <= LARGEST)) return std::nullopt;
    s.free = free ? numbers(*free) : s.left;
    s.measure();
    if (bodies) {
        const Matrix& moving = std::get<4>(*bodies);
        s = joined(s, span(radius), members_of(*bodies, n), span(moving));
        if (!(largest(s.left) <= LARGEST)) return std::nullopt;
    }
    if (friction) return solve_with_friction(s, radius, *spin, *friction, tolerance, starts);
    Asked asked{tolerance, least, bounded, Method(method), threads, {}, {}, {.shared = shared}};
    if (guess) asked.reaction = numbers(*guess);
    Answer found;
    Certificate of;
    double mass_of_all = 0.0;
    {
        nb::gil_scoped_release others;
        found = solve_one_sided(s, asked);
        of = certified(s, found.reaction, found.velocity);
    }
    for (int i = 0; i < s.n; ++i) mass_of_all += s.mass[s.d * i];
    Fields said = said_of(std::move(found.reaction), std::move(of.impulse), found.velocity, s.d, of.energy, of.change, of.work);
    said["residual"] = of.residual;
    said["velocity_error"] = found.distance / std::sqrt(mass_of_all > 0.0 ? mass_of_all : 1.0);
    said["momentum_error"] = of.momentum_error;
    said["iterations"] = found.iterations;
    said["canonical"] = found.least;
    return Said{std::move(said), of.finite && std::isfinite(found.distance), of.energy, int(found.rung), found.disks, found.rounds, found.threads, Fields()};
}

// Parts of the solver, for tests and measurements.

// order (n), and first, end, parent (m) of the nodes of `Ordering`.
auto dissect_of(const Matrix& position, const Given<Index, 1>& first, const Given<Index, 1>& second, int leaf) {
    const std::size_t n = position.shape(0);
    Numbers x(n), y(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = position(i, 0), y[i] = position(i, 1);
    const Places one(first.data(), first.data() + first.size()), other(second.data(), second.data() + second.size());
    need(one.size() == other.size(), "dissect: shapes differ");
    for (std::size_t c = 0; c < one.size(); ++c) need(one[c] >= 0 && one[c] < int(n) && other[c] < int(n), "contacts: a disk that does not exist");
    Team alone(1);
    Ordering of = dissect(x, y, graph_of(int(n), one, other), leaf, alone, SHARED);
    return std::make_tuple(give(std::move(of.order)), give(std::move(of.node_first)), give(std::move(of.node_end)), give(std::move(of.node_parent)));
}

bool eliminate_of(nb::ndarray<double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu> front, std::int64_t pivots, std::int64_t rest) {
    const std::int64_t panel = 8 * height_of(pivots) * (chunks(pivots) + chunks(rest));
    need(std::int64_t(front.size()) == panel + update_size(rest), "eliminate: the size of a front is needed");
    return eliminate(front.data(), front.data() + panel, pivots, rest);
}

// Â + CᵀΘC of contacts, by rows or, where `fronts`, by fronts.
class Factored {
public:
    Factored(const Given<Index, 1>& first, const Given<Index, 1>& second, const Matrix& normal, const Matrix& levers, const Matrix& position,
             const Matrix& mass, const Vector& along, const Vector& across, bool fronts, int threads, int shared)
        : team_(threads), factor_(system_of(first, second, normal, levers, position, mass, along, across), team_, sizes_of(fronts, shared)) {}

    bool factorise(const Vector& theta) {
        need(int(theta.size()) == factor_.system().k, "theta: one for each contact is needed");
        return factor_.factorise(factor_.contacts_ordered(span(theta)));
    }
    auto solve(const Matrix& b) {
        need(b.size() == factor_.system().mass.size(), "b: (n, d) is needed");
        Numbers x = factor_.disks_ordered(span(b));
        factor_.solve(x);
        return give<2>(factor_.disks_given(x), factor_.system().d);
    }
    auto order() const { return give(Places(factor_.ordering().order)); }

private:
    static Sizes sizes_of(bool fronts, int shared) {
        Sizes sizes;
        sizes.many = fronts ? 0 : std::numeric_limits<int>::max(), sizes.shared = shared;
        return sizes;
    }
    static System system_of(const Given<Index, 1>& first, const Given<Index, 1>& second, const Matrix& normal, const Matrix& levers,
                            const Matrix& position, const Matrix& mass, const Vector& along, const Vector& across) {
        System s;
        s.n = int(mass.shape(0)), s.d = int(mass.shape(1)), s.k = int(first.size());
        const std::size_t k = s.k, n = s.n;
        need(second.size() == k && normal.size() == 2 * k && levers.size() == 2 * k && along.size() == k && across.size() == k &&
             position.size() == 2 * n && (s.d == 2 || s.d == 3), "Factor: shapes differ");
        s.first.assign(first.data(), first.data() + k), s.second.assign(second.data(), second.data() + k);
        for (std::size_t c = 0; c < k; ++c) {
            need(s.first[c] >= 0 && s.first[c] < s.n && s.second[c] < s.n, "contacts: a disk that does not exist");
            s.nx.push_back(normal(c, 0)), s.ny.push_back(normal(c, 1));
            s.lever_first.push_back(levers(c, 0)), s.lever_second.push_back(levers(c, 1));
        }
        for (std::size_t i = 0; i < n; ++i) s.x.push_back(position(i, 0)), s.y.push_back(position(i, 1));
        s.along = numbers(along), s.across = numbers(across), s.mass = s.left = s.free = numbers(mass);
        s.offset.assign(k, 0.0), s.inverse_mass.assign(k, 1.0);
        return s;
    }

    Team team_;
    Factor factor_;
};

}  // namespace

NB_MODULE(_core, m) {
    m.doc() = "The native core: see nscd/core/.";
    nscd::bind_friction(m);
    nscd::bind_others(m);
    nb::set_leak_warnings(false);  // what a cache of Python holds to the end is no leak
    nb::class_<Segments>(m, "Walls")
        .def(nb::new_(&walls_of), "start"_a.noconvert(), "along"_a.noconvert(), "vertex"_a.noconvert(), "inner"_a.noconvert(), "low"_a = 0.0,
             "period"_a = 0.0)
        .def("__len__", [](const Segments& walls) { return walls.w; });
    m.def("touching", &touching_of, "position"_a.noconvert(), "radius"_a.noconvert(), "walls"_a, "most"_a);
    m.def("neighbours", &neighbours, "position"_a.noconvert(), "radius"_a.noconvert(), "walls"_a, "margin"_a);
    m.def("step", &step, "position"_a.noconvert(), "velocity"_a.noconvert(), "free"_a.noconvert(), "radius"_a.noconvert(),
          "mass"_a.noconvert(), "walls"_a, "seconds"_a, "restitution"_a, "gained"_a, "tolerance"_a, "friction"_a,
          "spin"_a.noconvert(), "inertia"_a.noconvert(), "keys"_a.noconvert(), "known"_a.noconvert(), "bodies"_a = nb::none(),
          "unheld"_a = nb::none());
    m.def("freed", &freed_of, "velocity"_a.noconvert(), "desired"_a.noconvert(), "share"_a, "x"_a, "y"_a);
    m.def("drifts", &drifts_of, "before"_a.noconvert(), "after"_a.noconvert(), "first"_a.noconvert(), "second"_a.noconvert(),
          "normal"_a.noconvert(), "gap"_a.noconvert(), "reaction"_a.noconvert(), "seconds"_a, "slack"_a);
    m.def("headed", &headed_of, "position"_a.noconvert(), "start"_a.noconvert(), "end"_a.noconvert(), "outward"_a.noconvert(),
          "place"_a.noconvert(), "speed"_a);
    m.def("clear_of", &clear_of_walls, "start"_a.noconvert(), "end"_a.noconvert(), "walls_start"_a.noconvert(), "walls_end"_a.noconvert(), "most"_a);
    m.def("film", &film, "start"_a.noconvert(), "ids"_a.noconvert(), "position"_a.noconvert(), "left"_a.noconvert(), "radius"_a.noconvert(),
          "mass"_a.noconvert(), "walls"_a, "gap"_a, "deepest"_a, "tolerance"_a, "least"_a);
    m.def("components", &components_of, "n"_a, "first"_a.noconvert(), "second"_a.noconvert());
    m.def("soft_forces", &soft_forces, "force"_a.noconvert(), "x"_a.noconvert(), "v"_a.noconvert(), "radius"_a.noconvert(),
          "mass"_a.noconvert(), "first"_a.noconvert(), "second"_a.noconvert(), "wall"_a.noconvert(), "walls"_a, "law"_a.noconvert(), "apart"_a);
    m.def("soft_drive", &soft_drive, "acceleration"_a.noconvert(), "x"_a.noconvert(), "v"_a.noconvert(), "speed"_a, "tau"_a,
          "start"_a.noconvert(), "end"_a.noconvert(), "door"_a.noconvert(), "outward"_a.noconvert());
    m.def("crosses", &crosses_of, "before"_a.noconvert(), "after"_a.noconvert(), "start"_a.noconvert(), "end"_a.noconvert());
    m.def("dissect", &dissect_of, "position"_a.noconvert(), "first"_a.noconvert(), "second"_a.noconvert(), "leaf"_a);
    m.def("eliminate", &eliminate_of, "front"_a.noconvert(), "pivots"_a, "rest"_a);
    nb::class_<Factored>(m, "Factor")
        .def(nb::init<const Given<Index, 1>&, const Given<Index, 1>&, const Matrix&, const Matrix&, const Matrix&, const Matrix&, const Vector&,
                      const Vector&, bool, int, int>(),
             "first"_a.noconvert(), "second"_a.noconvert(), "normal"_a.noconvert(), "levers"_a.noconvert(), "position"_a.noconvert(),
             "mass"_a.noconvert(), "along"_a.noconvert(), "across"_a.noconvert(), "fronts"_a, "threads"_a = 1, "shared"_a = SHARED)
        .def("factorise", &Factored::factorise, "theta"_a.noconvert())
        .def("solve", &Factored::solve, "b"_a.noconvert())
        .def_prop_ro("order", &Factored::order, nb::rv_policy::move);
    m.attr("PANEL") = PANEL;
    m.attr("MOST_SWEEPS") = MOST_SWEEPS;
    m.attr("SHARED") = SHARED;
    m.attr("MOST_PAIRS") = MOST_PAIRS;
    m.attr("GRADIENT") = GRADIENT;
    m.def("solve_impact", &solve_impact, "first"_a.noconvert(), "second"_a.noconvert(), "is_wall"_a.noconvert(), "normal"_a.noconvert(),
          "position"_a.noconvert(), "radius"_a.noconvert(), "mass"_a.noconvert(), "left"_a.noconvert(), "spin"_a = nb::none(),
          "along"_a = nb::none(), "across"_a = nb::none(), "maintained"_a = false, "offset"_a = nb::none(), "free"_a = nb::none(),
          "least_scale"_a = TINY, "tolerance"_a = 1e-8, "least"_a = true, "bounded"_a = true, "method"_a = 0, "threads"_a = 1,
          "guess"_a = nb::none(), "shared"_a = SHARED, "friction"_a = nb::none(), "starts"_a = 1, "bodies"_a = nb::none());
}
