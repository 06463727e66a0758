// The door to Python: arrays in, arrays out. What is no contiguous array of the right kind is refused.
#include <nanobind/stl/array.h>

#include "answer.hpp"
#include "binding.hpp"
#include "contacts.hpp"
#include "dense.hpp"
#include "drive.hpp"
#include "frames.hpp"
#include "motion.hpp"
#include "soft.hpp"

namespace {

using namespace nscd;

// Beyond this, squares of a number and their products with another leave double precision.
constexpr double LARGEST = 1e100;

Numbers numbers(const auto& given) { return Numbers(given.data(), given.data() + given.size()); }
Places places(const auto& given) { return Places(given.data(), given.data() + given.size()); }

// Walls with ends (w, 4): x, y of both.
Segments walls_of(const Matrix& ends, double low, double period) {
    need(ends.shape(1) == 4, "walls: (w, 4) is needed");
    return connected(span(ends), low, period);
}

void need_bodies(const Matrix& position, const Vector& radius) {
    need(position.shape(1) == 2 && position.shape(0) == radius.size(), "position: (n, 2) is needed");
}

using Body = Given<Index, 1>;

// How many are of two disks (−1: more pairs are within reach than memory should hold), first, second, vector, distance, gap.
auto touching_of(const Matrix& position, const Vector& radius, const Segments& walls, double most, const std::optional<Body>& body) {
    need_bodies(position, radius);
    need(!body || body->size() == radius.size(), "bodies: shapes differ");
    Touching found = freely([&] { return touching(span(position), span(radius), walls, most, body ? span(*body) : std::span<const Index>()); });
    return std::make_tuple(found.pairs, give(std::move(found.first)), give(std::move(found.second)), give<2>(std::move(found.vector), 2),
                           give(std::move(found.distance)), give(std::move(found.gap)));
}

// first, second, wall, normal, gap of `Neighbours`.
auto give_neighbours(Neighbours&& near) {
    return std::make_tuple(give(std::move(near.first)), give(std::move(near.second)), give(std::move(near.wall)),
                           give<2>(std::move(near.normal), 2), give(std::move(near.gap)));
}

auto neighbours(const Matrix& position, const Vector& radius, const Segments& walls, double margin, const std::optional<Body>& body) {
    need_bodies(position, radius);
    need(!body || body->size() == radius.size(), "bodies: shapes differ");
    return give_neighbours(named(touching(span(position), span(radius), walls, margin, body ? span(*body) : std::span<const Index>())));
}

// body (n), centre (b, 2), mass and inertia (b) of `Members`.
using Wide = std::tuple<Body, Matrix, Vector, Vector>;
Members members_of(const Wide& given, std::size_t n) {
    const auto& [body, centre, mass, inertia] = given;
    const std::size_t b = mass.size();
    need(body.size() == n && centre.size() == 2 * b && inertia.size() == b, "bodies: shapes differ");
    for (std::size_t i = 0; i < n; ++i) need(body(i) >= 0 && body(i) < Index(b), "bodies: a body that does not exist");
    return {span(body), span(centre), span(mass), span(inertia)};
}

// law: the numbers of `Law`. A body force of no drive acts on all.
Motion motion_of(const Vector& radius, const Vector& mass, const Segments& walls, const std::array<double, 9>& law, double time,
                 std::optional<Wide> wide, std::optional<Matrix> moving) {
    const auto& [step, relaxation, x, y, restitution, friction, tolerance, reach, force] = law;
    Motion motion;
    motion.law = {step, relaxation, x, y, restitution, friction, tolerance, reach, force};
    motion.walls = walls, motion.radius = numbers(radius), motion.mass = numbers(mass), motion.now.time = time;
    need(mass.size() == radius.size(), "motion: shapes differ");
    if (wide) {
        const Members of = members_of(*wide, radius.size());
        need(moving && moving->size() == 3 * of.mass.size(), "bodies: shapes differ");
        motion.body = places(std::get<0>(*wide)), motion.body_mass = numbers(std::get<2>(*wide)), motion.body_inertia = numbers(std::get<3>(*wide));
        motion.now.centre = numbers(std::get<1>(*wide)), motion.now.moving = numbers(*moving);
    }
    return motion;
}

// The state as it was seen, which may have been changed since.
void take(Motion& motion, const Matrix& position, const Matrix& velocity, const Vector& spin) {
    const std::size_t n = motion.radius.size();
    need(position.size() == 2 * n && velocity.size() == 2 * n && spin.size() == n, "motion: shapes differ");
    motion.now.position = numbers(position), motion.now.velocity = numbers(velocity), motion.now.spin = numbers(spin);
}

auto state_of(const Motion& motion) {
    const auto& now = motion.now;
    return std::make_tuple(give<2>(Numbers(now.position), 2), give<2>(Numbers(now.velocity), 2), give(Numbers(now.spin)));
}

// Keys of the contacts of the step before, and their percussions along the normal and across (2, m) N·s.
using Known = std::tuple<Whole, Matrix>;
auto known_of(const Motion& motion) {
    Numbers values = motion.now.reaction;
    values.insert(values.end(), motion.now.tangential.begin(), motion.now.tangential.end());
    return std::make_tuple(give(std::vector(motion.now.keys)), give<2>(std::move(values), std::max<std::size_t>(motion.now.keys.size(), 1)));
}
void know(Motion& motion, const Known& known) {
    const auto& [keys, values] = known;
    need(values.size() == 2 * keys.size(), "known: shapes differ");
    const In both = span(values), one = both.first(keys.size()), other = both.last(keys.size());
    motion.now.keys.assign(keys.data(), keys.data() + keys.size());
    motion.now.reaction.assign(one.begin(), one.end()), motion.now.tangential.assign(other.begin(), other.end());
}

// Whether it is solved, when, residual; neighbours, reaction, friction; iterations, repeats, rung; the energies of StepEnergy; who
// reaches whom, push.
auto advance(Motion& motion, const nb::object& desired) {
    Motion::Desired wanted;
    if (!desired.is_none()) wanted = [&](In place) {
        const nb::gil_scoped_acquire held;
        const auto given = nb::cast<Matrix>(desired(give<2>(Numbers(place.begin(), place.end()), 2)));
        need(given.size() == place.size(), "desired: (n, 2) is needed");
        return numbers(given);
    };
    Report done;
    const bool solved = freely([&] { return motion.advance(wanted, done); });
    return std::make_tuple(solved, done.time, done.residual, give_neighbours(std::move(done.near)), give(std::move(done.reaction)),
                           give(std::move(done.friction)), done.iterations, done.repeats, done.rung,
                           std::make_tuple(done.gained, done.drive, done.weight, done.arms, give(std::move(done.impact)), give(std::move(done.rubbing))),
                           give_neighbours(std::move(done.reached)), give(std::move(done.push)));
}

// (k), (k) J of contacts and impulses, with the motion (n, 3) of disks: see `works`.
auto works_of(const Given<Index, 1>& first, const Given<Index, 1>& second, const Given<Index, 1>& wall, const Matrix& normal, const Vector& gap,
              const Vector& radius, const Matrix& moving, const Vector& along, const Vector& across) {
    const std::size_t k = along.size(), n = radius.size();
    need_disks(n, first, second);
    need(moving.size() == 3 * n && first.size() == k && normal.size() == 2 * k && gap.size() == k && across.size() == k, "works: shapes differ");
    const Neighbours near{places(first), places(second), places(wall), numbers(normal), numbers(gap)};
    Numbers impact(k), friction(k);
    works(near, span(radius), span(moving), span(along), span(across), impact, friction);
    return std::make_tuple(give(std::move(impact)), give(std::move(friction)));
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

Drive drive_of(const Vector& numbers) {
    std::optional<Drive> drive = Drive::of(span(numbers));
    need(bool(drive), "Drive: these are not its numbers");
    return *std::move(drive);
}

auto desired_of(const Drive& drive, const Matrix& x, const Vector& radius, double time) {
    need_bodies(x, radius);
    need(radius.size() == drive.goes.size(), "desired: one of each for each person is needed");
    return give<2>(freely([&] { return drive.desired(span(x), span(radius), time); }), 2);
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
    FilmAnswer found = freely([&] { return solve_film(asked, {gap, deepest, tolerance, least}); });
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
    need_disks(n, first, second);
    Places label;
    components(n, span(first), span(second), label);
    return give(std::move(label));
}

using Fields = nb::typed<nb::dict, nb::str, nb::any>;
// Fields of `nscd.Percussions` by name; whether every number is finite, energy before (J), rung, disks (with friction the seed
// of the search), rounds, threads; fields of `nscd.percussions.FrictionPart`, empty without.
using Said = std::tuple<Fields, bool, double, int, int, int, int, Fields>;

// What `solve_impact` says of an answer (u: n·d) whether or not there is friction; velocities of disks where bodies have some.
struct Seen {
    Members of;
    In position;
};
Fields said_of(Numbers&& reaction, Numbers&& impulse, const Numbers& u, int d, const Seen& disks, double energy, double change, double work) {
    const bool joint = !disks.of.body.empty();
    const std::size_t n = joint ? disks.of.body.size() : u.size() / d;
    Numbers turning(d == 3 ? n : 0), moving = joint ? of_members(disks.of, disks.position, u) : Numbers(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t from = d * (joint ? std::size_t(disks.of.body[i]) : i);
        for (int a = 0; a < 2 && !joint; ++a) moving[2 * i + a] = u[from + a];
        if (d == 3) turning[i] = u[from + 2];
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
Said solve_with_friction(const System& s, const Vector& radius, const Vector& spin, const Vector& friction, double tolerance, int starts, const Seen& disks) {
    Numbers inertia(s.wide() ? 0 : s.n);
    for (std::size_t i = 0; i < inertia.size(); ++i) inertia[i] = 0.5 * s.mass[2 * i] * radius(i) * radius(i);
    Rubbing p = rubbing_of(s, span(radius), span(spin), inertia, numbers(friction));
    FrictionAnswer found = freely([&] { return solve_friction(p, tolerance, starts, s.wide() ? In(s.reach) : span(radius)); });
    FrictionCertificate of = freely([&] { return certified(p, found.at); });
    Fields said = said_of(std::move(found.at.lam), std::move(of.impulse), found.at.u, 3, disks, of.energy, of.change, of.work), part;
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
    const bool turns = spin && !friction && !bodies;
    Places one(k), other(k);
    for (std::size_t c = 0; c < k; ++c) {
        const std::int64_t i = first(c), j = is_wall(c) ? -1 : second(c);
        if (i < 0 || i >= std::int64_t(n) || j >= std::int64_t(n)) return std::nullopt;
        one[c] = Index(i), other[c] = Index(j);
    }
    System s = system_of({span(position), span(left), span(radius), span(mass), turns ? span(*spin) : In()}, std::move(one), std::move(other), span(normal));
    s.maintained = maintained, s.least_scale = least_scale;
    if (offset) s.offset = numbers(*offset);
    if (along) s.along = numbers(*along), s.across = numbers(*across);
    if (!(largest(s.left) <= LARGEST)) return std::nullopt;
    if (free) s.free = numbers(*free);
    Seen disks{{}, span(position)};
    if (bodies) {
        const Members of = members_of(*bodies, n);
        need(spin.has_value(), "bodies: shapes differ");
        for (std::size_t c = 0; c < k; ++c)
            if (s.second[c] >= 0 && of.body[s.first[c]] == of.body[s.second[c]]) return std::nullopt;
        s = joined(s, span(radius), of, of_bodies(of, span(mass), span(left), span(*spin)));
        if (!(largest(s.left) <= LARGEST)) return std::nullopt;
        disks.of = of;
    } else {
        s.measure();
    }
    if (friction) return solve_with_friction(s, radius, *spin, *friction, tolerance, starts, disks);
    Asked asked{tolerance, least, bounded, Method(method), threads, {}, {}, {.shared = shared}};
    if (guess) asked.reaction = numbers(*guess);
    Answer found = freely([&] { return solve_one_sided(s, asked); });
    Certificate of = freely([&] { return certified(s, found.reaction, found.velocity); });
    double mass_of_all = 0.0;
    for (int i = 0; i < s.n; ++i) mass_of_all += s.mass[s.d * i];
    Fields said = said_of(std::move(found.reaction), std::move(of.impulse), found.velocity, s.d, disks, of.energy, of.change, of.work);
    said["residual"] = of.residual;
    said["velocity_error"] = found.distance / std::sqrt(mass_of_all > 0.0 ? mass_of_all : 1.0);
    said["momentum_error"] = of.momentum_error;
    said["iterations"] = found.iterations;
    said["canonical"] = found.least;
    return Said{std::move(said), of.finite && std::isfinite(found.distance), of.energy, int(found.rung), found.disks, found.rounds, found.threads, Fields()};
}

// Parts of the solver, for tests and measurements.

bool eliminate_of(nb::ndarray<double, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu> front, std::int64_t pivots, std::int64_t rest) {
    const std::int64_t panel = 8 * height_of(pivots) * (chunks(pivots) + chunks(rest));
    need(std::int64_t(front.size()) == panel + update_size(rest), "eliminate: the size of a front is needed");
    return eliminate(front.data(), front.data() + panel, pivots, rest);
}

// Â + CᵀΘC of contacts, by rows or, where `fronts`, by fronts; with spins where disks turn.
class Factored {
public:
    Factored(const Pairs& pairs, const Vector& along, const Vector& across, bool turn, bool fronts, int threads, int shared, int leaf)
        : team_(threads), factor_(system_with(pairs, along, across, turn), team_, {fronts ? 0 : std::numeric_limits<int>::max(), shared, leaf}) {}

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
    // order (n), and first, end, parent (m) of the nodes of `Ordering`
    auto ordering() const {
        Ordering of = factor_.ordering();
        return std::make_tuple(give(std::move(of.order)), give(std::move(of.node_first)), give(std::move(of.node_end)), give(std::move(of.node_parent)));
    }

private:
    static System system_with(const Pairs& pairs, const Vector& along, const Vector& across, bool turn) {
        const std::size_t n = std::get<4>(pairs).size();
        System s = system_of_pairs(pairs, Numbers(2 * n), Numbers(turn ? n : 0));
        need(int(along.size()) == s.k && int(across.size()) == s.k, "Factor: shapes differ");
        s.along = numbers(along), s.across = numbers(across);
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
        .def(nb::new_(&walls_of), "ends"_n, "low"_a = 0.0, "period"_a = 0.0)
        .def_prop_ro("along", [](const Segments& walls) { return give<2>(Numbers(walls.along), 2); }, nb::rv_policy::move)
        .def_prop_ro("vertex", [](const Segments& walls) { return give<2>(Places(walls.vertex), 2); }, nb::rv_policy::move)
        .def_prop_ro("inner", [](const Segments& walls) { return give_marks<2>(Flags(walls.inner), 2); }, nb::rv_policy::move)
        .def("__len__", [](const Segments& walls) { return walls.w; });
    m.def("touching", &touching_of, "position"_n, "radius"_n, "walls"_a, "most"_a, "body"_a = nb::none());
    m.def("neighbours", &neighbours, "position"_n, "radius"_n, "walls"_a, "margin"_a, "body"_a = nb::none());
    nb::class_<Motion>(m, "Motion")
        .def(nb::new_(&motion_of), "radius"_n, "mass"_n, "walls"_a, "law"_a, "time"_a, "bodies"_a = nb::none(), "moving"_a = nb::none())
        .def("take", &take, "position"_n, "velocity"_n, "spin"_n)
        .def("state", &state_of)
        .def("advance", &advance, "desired"_a.none())
        .def("separate", &Motion::separate)
        .def("forget", &Motion::forget)
        .def_prop_rw("known", &known_of, &know, nb::rv_policy::move)
        .def_prop_ro("time", [](const Motion& motion) { return motion.now.time; })
        .def_prop_ro("centre", [](const Motion& motion) { return give<2>(Numbers(motion.now.centre), 2); }, nb::rv_policy::move)
        .def_rw("stalled", &Motion::stalled);
    m.def("works", &works_of, "first"_n, "second"_n, "wall"_n, "normal"_n, "gap"_n, "radius"_n, "moving"_n, "along"_n, "across"_n);
    m.def("headed", &headed_of, "position"_n, "start"_n, "end"_n, "outward"_n, "place"_n, "speed"_a);
    nb::class_<Drive>(m, "Drive")
        .def(nb::new_(&drive_of), "numbers"_n)
        .def("desired", &desired_of, "position"_n, "radius"_n, "time"_a);
    m.def("clear_of", &clear_of_walls, "start"_n, "end"_n, "walls_start"_n, "walls_end"_n, "most"_a);
    m.def("film", &film, "start"_n, "ids"_n, "position"_n, "left"_n, "radius"_n, "mass"_n, "walls"_a, "gap"_a, "deepest"_a, "tolerance"_a, "least"_a);
    m.def("components", &components_of, "n"_a, "first"_n, "second"_n);
    m.def("soft_forces", &soft_forces, "force"_n, "x"_n, "v"_n, "radius"_n, "mass"_n, "first"_n, "second"_n, "wall"_n, "walls"_a, "law"_n, "apart"_a);
    m.def("soft_drive", &soft_drive, "acceleration"_n, "x"_n, "v"_n, "speed"_a, "tau"_a, "start"_n, "end"_n, "door"_n, "outward"_n);
    m.def("crosses", &crosses_of, "before"_n, "after"_n, "start"_n, "end"_n);
    m.def("eliminate", &eliminate_of, "front"_n, "pivots"_a, "rest"_a);
    nb::class_<Factored>(m, "Factor")
        .def(nb::init<const Pairs&, const Vector&, const Vector&, bool, bool, int, int, int>(), "pairs"_a, "along"_n, "across"_n, "turn"_a,
             "fronts"_a, "threads"_a = 1, "shared"_a = SHARED, "leaf"_a = Sizes().leaf)
        .def("factorise", &Factored::factorise, "theta"_n)
        .def("solve", &Factored::solve, "b"_n)
        .def("ordering", &Factored::ordering);
    m.attr("PANEL") = PANEL;
    m.attr("MOST_SWEEPS") = MOST_SWEEPS;
    m.attr("SHARED") = SHARED;
    m.attr("MOST_PAIRS") = MOST_PAIRS;
    m.attr("GRADIENT") = GRADIENT;
    m.def("solve_impact", &solve_impact, "first"_n, "second"_n, "is_wall"_n, "normal"_n, "position"_n, "radius"_n, "mass"_n, "left"_n, "spin"_a =
         nb::none(), "along"_a = nb::none(), "across"_a = nb::none(), "maintained"_a = false, "offset"_a = nb::none(), "free"_a = nb::none(),
         "least_scale"_a = TINY, "tolerance"_a = 1e-8, "least"_a = true, "bounded"_a = true, "method"_a = 0, "threads"_a = 1, "guess"_a = nb::none(),
         "shared"_a = SHARED, "friction"_a = nb::none(), "starts"_a = 1, "bodies"_a = nb::none());
}
