// The door to Python: arrays in, arrays out. What is no contiguous array of the right kind is refused.
#include "impact_solver.hpp"
#include "binding.hpp"
#include "contacts.hpp"
#include "dense.hpp"
#include "drive.hpp"
#include "solve_frames.hpp"
#include "motion.hpp"
#include "soft.hpp"

namespace {

using namespace nscd;

// Beyond this, squares of a number and their products with another leave double precision.
constexpr double LARGEST = 1e100;

Vector vector(const auto& array) { return Vector(array.data(), array.data() + array.size()); }
Indices indices(const auto& array) { return Indices(array.data(), array.data() + array.size()); }

// Walls with ends (w, 4): x, y of both.
Segments walls_of(const MatrixArg& ends, double low, double period) {
    need(ends.shape(1) == 4, "walls: (w, 4) is needed");
    return connected(span(ends), low, period);
}

void need_bodies(const MatrixArg& position, const VectorArg& radius) {
    need(position.shape(1) == 2 && position.shape(0) == radius.size(), "position: (n, 2) is needed");
}

using Body = ArrayArg<Index, 1>;

struct TouchingDisks {
    std::int64_t pairs;  // how many are of two disks; −1: more are within reach than memory should hold
    Made<std::int64_t, 1> first, second;
    Made<double, 2> vector;
    Made<double, 1> distance, gap;
};
TouchingDisks contact_pairs_of(const MatrixArg& position, const VectorArg& radius, const Segments& walls, double max_gap, const std::optional<Body>& body) {
    need_bodies(position, radius);
    need(!body || body->size() == radius.size(), "bodies: shapes differ");
    ContactPairs found = freely([&] { return find_contact_pairs(span(position), span(radius), walls, max_gap, body ? span(*body) : std::span<const Index>()); });
    return {found.pairs, give(std::move(found.first)), give(std::move(found.second)), give<2>(std::move(found.vector), 2),
            give(std::move(found.distance)), give(std::move(found.gap))};
}

// `Neighbours` of Python.
struct Candidates {
    Made<Index, 1> first, second, wall;
    Made<double, 2> normal;
    Made<double, 1> gap;
};
Candidates give_neighbours(Neighbours&& neighbours) {
    return {give(std::move(neighbours.first)), give(std::move(neighbours.second)), give(std::move(neighbours.wall)), give<2>(std::move(neighbours.normal), 2), give(std::move(neighbours.gap))};
}

auto neighbours(const MatrixArg& position, const VectorArg& radius, const Segments& walls, double margin, const std::optional<Body>& body) {
    need_bodies(position, radius);
    need(!body || body->size() == radius.size(), "bodies: shapes differ");
    return give_neighbours(with_normals(find_contact_pairs(span(position), span(radius), walls, margin, body ? span(*body) : std::span<const Index>())));
}

// body (n), centre (b, 2), mass and inertia (b) of `Members`.
using CompoundArg = std::tuple<Body, MatrixArg, VectorArg, VectorArg>;
Members members_of(const CompoundArg& input, std::size_t n) {
    const auto& [body, centre, mass, inertia] = input;
    const std::size_t b = mass.size();
    need(body.size() == n && centre.size() == 2 * b && inertia.size() == b, "bodies: shapes differ");
    for (std::size_t i = 0; i < n; ++i) need(body(i) >= 0 && body(i) < Index(b), "bodies: a body that does not exist");
    return {span(body), span(centre), span(mass), span(inertia)};
}

// A body force of no drive acts on all.
Motion motion_of(const VectorArg& radius, const VectorArg& mass, const Segments& walls, const Law& law, double time,
                 std::optional<CompoundArg> compound, std::optional<MatrixArg> body_velocity) {
    Motion motion;
    motion.law = law;
    motion.walls = walls, motion.radius = vector(radius), motion.mass = vector(mass), motion.now.time = time;
    need(mass.size() == radius.size(), "motion: shapes differ");
    if (compound) {
        const Members of = members_of(*compound, radius.size());
        need(body_velocity && body_velocity->size() == 3 * of.mass.size(), "bodies: shapes differ");
        motion.body = indices(std::get<0>(*compound)), motion.body_mass = vector(std::get<2>(*compound)), motion.body_inertia = vector(std::get<3>(*compound));
        motion.now.centre = vector(std::get<1>(*compound)), motion.now.body_velocity = vector(*body_velocity);
    }
    return motion;
}

// The state as it was seen, which may have been changed since.
void take(Motion& motion, const MatrixArg& position, const MatrixArg& velocity, const VectorArg& spin) {
    const std::size_t n = motion.radius.size();
    need(position.size() == 2 * n && velocity.size() == 2 * n && spin.size() == n, "motion: shapes differ");
    motion.now.position = vector(position), motion.now.velocity = vector(velocity), motion.now.spin = vector(spin);
}

// Keys of the contacts of the step before, and their percussions.
struct Percussed {
    std::vector<std::int64_t> keys;
    Vector reaction, tangential;
};

struct Step {
    bool solved;
    double time, residual;
    Candidates neighbours;
    Made<double, 1> reaction, friction;
    int iterations, repeats;
    Method method;
    double gained, drive, weight, arms;  // J, as in StepEnergy
    Made<double, 1> impact, friction_loss;
    Candidates reached;                  // who reaches whom, with the push
    Made<double, 1> push;
};
Step advance(Motion& motion, const nb::object& desired) {
    Motion::Desired wanted;
    if (!desired.is_none()) wanted = [&](In position) {
        const nb::gil_scoped_acquire lock;
        const auto input = nb::cast<MatrixArg>(desired(give<2>(Vector(position.begin(), position.end()), 2)));
        need(input.size() == position.size(), "desired: (n, 2) is needed");
        return vector(input);
    };
    Report done;
    const bool solved = freely([&] { return motion.advance(wanted, done); });
    return {solved, done.time, done.residual, give_neighbours(std::move(done.neighbours)), give(std::move(done.reaction)), give(std::move(done.friction)),
            done.iterations, done.repeats, done.method, done.gained, done.drive, done.weight, done.arms, give(std::move(done.impact)),
            give(std::move(done.friction_loss)), give_neighbours(std::move(done.reached)), give(std::move(done.push))};
}

// (k) J of contacts and impulses, with the motion (n, 3) of disks: see `works`.
struct Works {
    Made<double, 1> impact, friction;
};
Works works_of(const ArrayArg<Index, 1>& first, const ArrayArg<Index, 1>& second, const ArrayArg<Index, 1>& wall, const MatrixArg& normal, const VectorArg& gap,
              const VectorArg& radius, const MatrixArg& mean_velocity, const VectorArg& normal_impulse, const VectorArg& tangential_impulse) {
    const std::size_t k = normal_impulse.size(), n = radius.size();
    need_disks(n, first, second);
    need(mean_velocity.size() == 3 * n && first.size() == k && normal.size() == 2 * k && gap.size() == k && tangential_impulse.size() == k, "works: shapes differ");
    const Neighbours neighbours{indices(first), indices(second), indices(wall), vector(normal), vector(gap)};
    Vector impact(k), friction(k);
    works(neighbours, span(radius), span(mean_velocity), span(normal_impulse), span(tangential_impulse), impact, friction);
    return {give(std::move(impact)), give(std::move(friction))};
}

auto headed_of(const MatrixArg& position, const VectorArg& start, const VectorArg& end, const VectorArg& outward, const VectorArg& line_point, double speed) {
    need(position.shape(1) == 2 && start.size() == 2 && end.size() == 2 && outward.size() == 2 && line_point.size() == 2, "headed: shapes differ");
    Vector velocity(position.size());
    headed(span(position), span(start), span(end), span(outward), span(line_point), speed, velocity);
    return give<2>(std::move(velocity), 2);
}

auto clear_of_walls(const MatrixArg& from, const MatrixArg& to, const MatrixArg& start, const MatrixArg& end, double max_distance) {
    need(from.shape(1) == 2 && from.size() == to.size() && start.shape(1) == 2 && start.size() == end.size(), "clear_of: shapes differ");
    Vector clear(from.size() / 2);
    clear_of(span(from), span(to), span(start), span(end), max_distance, clear);
    return give(std::move(clear));
}

Drive drive_of(const VectorArg& values) {
    std::optional<Drive> drive = Drive::of(span(values));
    need(bool(drive), "Drive: these are not its numbers");
    return *std::move(drive);
}

auto desired_of(const Drive& drive, const MatrixArg& x, const VectorArg& radius, double time) {
    need_bodies(x, radius);
    need(radius.size() == drive.goes.size(), "desired: one of each for each person is needed");
    return give<2>(freely([&] { return drive.desired(span(x), span(radius), time); }), 2);
}

// `FilmSolution` of Python.
struct FilmContacts {
    Made<std::int64_t, 1> start;
    Made<bool, 1> answered;
    Made<std::int64_t, 1> first, second;
    Made<bool, 1> is_wall;
    Made<double, 2> normal;
    Made<double, 1> gap, reaction;
    Made<double, 2> impulse;
    Made<double, 1> residual, velocity_error;
};
FilmContacts film(const IntegerArg& start, const IntegerArg& ids, const MatrixArg& position, const MatrixArg& left_velocity, const VectorArg& radius, const VectorArg& mass,
          const Segments& walls, double gap, double deepest, double tolerance, bool canonical) {
    need_bodies(position, radius);
    const auto n = std::int64_t(radius.size());
    bool rising = start.size() > 0 && start(0) == 0 && start(start.size() - 1) == n;
    for (std::size_t f = 1; f < start.size(); ++f) rising = rising && start(f) >= start(f - 1);
    need(rising && ids.size() == radius.size() && left_velocity.size() == position.size() && mass.size() == radius.size(), "film: shapes differ");
    const Film input{span(start), span(ids), span(position), span(left_velocity), span(radius), span(mass), walls};
    FilmSolution found = freely([&] { return solve_film(input, {gap, deepest, tolerance, canonical}); });
    return {give(std::move(found.start)), give_marks(std::move(found.answered)), give(std::move(found.first)), give(std::move(found.second)),
            give_marks(std::move(found.is_wall)), give<2>(std::move(found.normal), 2), give(std::move(found.gap)), give(std::move(found.reaction)),
            give<2>(std::move(found.impulse), 2), give(std::move(found.residual)), give(std::move(found.velocity_error))};
}

using Changed = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void soft_forces(Changed force, const MatrixArg& x, const MatrixArg& v, const VectorArg& radius, const VectorArg& mass, const IntegerArg& first,
                 const IntegerArg& second, const IntegerArg& wall, const Segments& walls, const VectorArg& law, bool approach_only) {
    need_bodies(x, radius);
    const std::size_t k = first.size();
    need(force.size() == x.size() && v.size() == x.size() && mass.size() == radius.size() && second.size() == k && wall.size() == k && law.size() == 9, "soft: shapes differ");
    const Soft soft{{law(0), law(1), law(2), law(3)}, {law(4), law(5), law(6), law(7)}, law(8), approach_only};
    contact_forces({force.data(), force.size()}, span(x), span(v), span(radius), span(mass), span(first), span(second), span(wall), walls, soft);
}

void soft_drive(Changed acceleration, const MatrixArg& x, const MatrixArg& v, double speed, double tau, const MatrixArg& start, const MatrixArg& end,
                const MatrixArg& door, const MatrixArg& outward) {
    const std::size_t size = acceleration.size();
    need(x.size() == size && v.size() == size && start.size() == size && end.size() == size && door.size() == size && outward.size() == size, "soft: shapes differ");
    add_drive({acceleration.data(), size}, span(x), span(v), speed, tau, span(start), span(end), span(door), span(outward));
}

bool crosses_of(const MatrixArg& before, const MatrixArg& after, const MatrixArg& start, const MatrixArg& end) {
    need(before.size() == after.size() && start.size() == end.size(), "crosses: shapes differ");
    return crosses(span(before), span(after), span(start), span(end));
}

auto components_of(int n, const ArrayArg<Index, 1>& first, const ArrayArg<Index, 1>& second) {
    need_disks(n, first, second);
    Indices label;
    components(n, span(first), span(second), label);
    return give(std::move(label));
}

// As in nscd.percussions.FrictionPart.
struct FrictionOutcome {
    Made<double, 1> tangential;
    Made<std::int8_t, 1> state;
    double signorini, cone, natural_map, dissipation, spread;
    int seed;  // of the states where the search began; 0: the convex programme; −1: u⁻
};
// As in nscd.Percussions.
struct ImpactSolution {
    Made<double, 1> reaction;
    Made<double, 2> impulse, right_velocity;
    std::optional<Made<double, 1>> right_spin;  // where disks turn
    double energy, energy_change, energy_error;  // energy: before, J
    double residual = 0.0, velocity_error = INFINITE, momentum_error = 0.0;
    int iterations = 0;
    bool canonical = false, finite = true;      // finite: every number is
    Method method = Method::NONE;
    int disks = 0, rounds = 0, threads = 1;     // see `Solution`
    std::optional<FrictionOutcome> friction;
};

// A solution (u: n·d) whether or not there is friction; velocities of disks where bodies have some.
struct DiskView {
    Members of;
    In position;
};
ImpactSolution solution_of(Vector&& reaction, Vector&& impulse, const Vector& u, int d, const DiskView& disks, double energy, double change, double work) {
    const bool joint = !disks.of.body.empty();
    const std::size_t n = joint ? disks.of.body.size() : u.size() / d;
    Vector right_spin(d == 3 ? n : 0), right_velocity = joint ? disk_velocity_of(disks.of, disks.position, u) : Vector(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t from = d * (joint ? std::size_t(disks.of.body[i]) : i);
        for (int a = 0; a < 2 && !joint; ++a) right_velocity[2 * i + a] = u[from + a];
        if (d == 3) right_spin[i] = u[from + 2];
    }
    ImpactSolution found{give(std::move(reaction)), give<2>(std::move(impulse), 2), give<2>(std::move(right_velocity), 2), {}, energy, change,
                         std::abs(change + 0.5 * work) / (energy != 0.0 ? energy : 1.0), 0.0, INFINITE, 0.0, 0, false, true, Method::NONE, 0, 0, 1, {}};
    if (d == 3) found.right_spin = give(std::move(right_spin));
    return found;
}

// Percussions with Coulomb's law of a problem without spins, or of wide bodies.
ImpactSolution solve_with_friction(const ImpactProblem& s, const VectorArg& radius, const VectorArg& spin, const VectorArg& friction, double tolerance, int starts, const DiskView& disks) {
    Vector inertia(s.compound() ? 0 : s.n);
    for (std::size_t i = 0; i < inertia.size(); ++i) inertia[i] = 0.5 * s.mass[2 * i] * radius(i) * radius(i);
    FrictionProblem p = friction_problem_of(s, span(radius), span(spin), inertia, vector(friction));
    FrictionResult found = freely([&] { return solve_friction(p, {tolerance, starts, s.compound() ? In(s.reach) : span(radius)}); });
    FrictionCertificate certificate = freely([&] { return certificate_of(p, found.solution); });
    ImpactSolution solution = solution_of(std::move(found.solution.reaction), std::move(certificate.impulse), found.solution.velocity, 3, disks, certificate.energy, certificate.change, certificate.work);
    solution.residual = certificate.natural_map, solution.momentum_error = certificate.momentum_error;
    solution.iterations = found.sweep_count + found.pivots, solution.method = found.method;
    solution.finite = std::isfinite(certificate.momentum_error + certificate.natural_map);
    solution.friction = {give(std::move(found.solution.tangential)), give(std::move(certificate.state)), certificate.signorini, certificate.cone, certificate.natural_map, certificate.dissipation, found.spread, found.seed};
    return solution;
}

std::optional<ImpactSolution> solve_impact(const IntegerArg& first, const IntegerArg& second, const MaskArg& is_wall, const MatrixArg& normal, const MatrixArg& position,
                  const VectorArg& radius, const VectorArg& mass, const MatrixArg& left_velocity, std::optional<VectorArg> spin, std::optional<VectorArg> normal_dashpot,
                  std::optional<VectorArg> tangential_dashpot, bool maintained, std::optional<VectorArg> max_approach, std::optional<MatrixArg> free,
                  double least_scale, double tolerance, bool canonical, bool with_error_bound, Solver solver, int threads,
                  std::optional<VectorArg> guess, int shared, std::optional<VectorArg> friction, int starts, std::optional<CompoundArg> bodies) {
    const std::size_t n = mass.size(), k = first.size();
    need(second.size() == k && is_wall.size() == k && normal.size() == 2 * k && left_velocity.size() == 2 * n && position.size() == 2 * n && radius.size() == n && (!friction || (spin && friction->size() == k && starts > 0)), "solve: shapes differ");
    const bool turns = spin && !friction && !bodies;
    Indices one(k), other(k);
    for (std::size_t c = 0; c < k; ++c) {
        const std::int64_t i = first(c), j = is_wall(c) ? -1 : second(c);
        if (i < 0 || i >= std::int64_t(n) || j >= std::int64_t(n)) return std::nullopt;
        one[c] = Index(i), other[c] = Index(j);
    }
    ImpactProblem s = impact_problem_of({span(position), span(left_velocity), span(radius), span(mass), turns ? span(*spin) : In()}, std::move(one), std::move(other), span(normal));
    s.bilateral = maintained, s.least_scale = least_scale;
    if (max_approach) s.max_approach = vector(*max_approach);
    if (normal_dashpot) s.normal_dashpot = vector(*normal_dashpot), s.tangential_dashpot = vector(*tangential_dashpot);
    if (!(max_abs(s.left_velocity) <= LARGEST)) return std::nullopt;
    if (free) s.free = vector(*free);
    DiskView disks{{}, span(position)};
    if (bodies) {
        const Members certificate = members_of(*bodies, n);
        need(spin.has_value(), "bodies: shapes differ");
        for (std::size_t c = 0; c < k; ++c)
            if (s.second[c] >= 0 && certificate.body[s.first[c]] == certificate.body[s.second[c]]) return std::nullopt;
        s = compound_problem_of(s, span(radius), certificate, body_velocity_of(certificate, span(mass), span(left_velocity), span(*spin)));
        if (!(max_abs(s.left_velocity) <= LARGEST)) return std::nullopt;
        disks.of = certificate;
    } else {
        s.measure_scale();
    }
    if (friction) return solve_with_friction(s, radius, *spin, *friction, tolerance, starts, disks);
    Options options{tolerance, canonical, with_error_bound, solver, threads, {}, {}, {.shared = shared}};
    if (guess) options.reaction = vector(*guess);
    Solution found = freely([&] { return solve_one_sided(s, options); });
    Certificate certificate = freely([&] { return certificate_of(s, found.reaction, found.velocity); });
    double mass_of_all = 0.0;
    for (int i = 0; i < s.n; ++i) mass_of_all += s.mass[s.d * i];
    ImpactSolution solution = solution_of(std::move(found.reaction), std::move(certificate.impulse), found.velocity, s.d, disks, certificate.energy, certificate.change, certificate.work);
    solution.residual = certificate.residual, solution.momentum_error = certificate.momentum_error;
    solution.velocity_error = found.error_bound / std::sqrt(mass_of_all > 0.0 ? mass_of_all : 1.0);
    solution.iterations = found.iterations, solution.canonical = found.canonical, solution.finite = certificate.finite && std::isfinite(found.error_bound);
    solution.method = found.method, solution.disks = found.disks, solution.rounds = found.rounds, solution.threads = found.threads;
    return solution;
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
    Factored(const Pairs& pairs, const VectorArg& normal_dashpot, const VectorArg& tangential_dashpot, bool turn, bool fronts, int threads, int shared, int leaf)
        : team_(threads), factor_(problem_with(pairs, normal_dashpot, tangential_dashpot, turn), team_, {fronts ? 0 : std::numeric_limits<int>::max(), shared, leaf}) {}

    bool factorise(const VectorArg& theta) {
        need(int(theta.size()) == factor_.problem().k, "theta: one for each contact is needed");
        return factor_.factorise(factor_.contacts_in_elimination_order(span(theta)));
    }
    auto solve(const MatrixArg& b) {
        need(b.size() == factor_.problem().mass.size(), "b: (n, d) is needed");
        Vector x = factor_.disks_in_elimination_order(span(b));
        factor_.solve(x);
        return give<2>(factor_.disks_in_input_order(x), factor_.problem().d);
    }
    struct Order {
        Made<Index, 1> order, node_first, node_end, node_parent;  // of `Ordering`
    };
    Order ordering() const {
        Ordering of = factor_.ordering();
        return {give(std::move(of.order)), give(std::move(of.node_first)), give(std::move(of.node_end)), give(std::move(of.node_parent))};
    }

private:
    static ImpactProblem problem_with(const Pairs& pairs, const VectorArg& normal_dashpot, const VectorArg& tangential_dashpot, bool turn) {
        const std::size_t n = std::get<4>(pairs).size();
        ImpactProblem s = impact_problem_of_pairs(pairs, Vector(2 * n), Vector(turn ? n : 0));
        need(int(normal_dashpot.size()) == s.k && int(tangential_dashpot.size()) == s.k, "Factor: shapes differ");
        s.normal_dashpot = vector(normal_dashpot), s.tangential_dashpot = vector(tangential_dashpot);
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
#define NAMED(E, name) .value(#name, E::name)
    nb::enum_<Solver>(m, "Solver") NAMED(Solver, AUTO) NAMED(Solver, INTERIOR_POINT) NAMED(Solver, ACTIVE_SET) NAMED(Solver, PROJECTED_GRADIENT) NAMED(Solver, GAUSS_SEIDEL);
    nb::enum_<Method>(m, "Method") NAMED(Method, NO_CONTACTS) NAMED(Method, NOTHING_PRESSES) NAMED(Method, SINGLE_CONTACTS) NAMED(Method, TREE) NAMED(Method, GUESS)
        NAMED(Method, DESCENT) NAMED(Method, AUGMENTED_LAGRANGIAN) NAMED(Method, INTERIOR_POINT_MARGINAL) NAMED(Method, INTERIOR_POINT_UNEVEN_MASSES) NAMED(Method, INTERIOR_POINT_DISSIPATIVE) NAMED(Method, MAINTAINED)
        NAMED(Method, BY_NAME) NAMED(Method, PROJECTED_GRADIENT) NAMED(Method, LEFT_VELOCITY) NAMED(Method, NEWTON) NAMED(Method, PROXIMAL_NEWTON)
        NAMED(Method, PROXIMAL_POINT) NAMED(Method, GAUSS_SEIDEL) NAMED(Method, PIVOTS) NAMED(Method, NONE);
#define FIELD(R, name) .field(#name, &R::name)
    Result<TouchingDisks>(m, "Touching") FIELD(TouchingDisks, pairs) FIELD(TouchingDisks, first) FIELD(TouchingDisks, second)
        FIELD(TouchingDisks, vector) FIELD(TouchingDisks, distance) FIELD(TouchingDisks, gap);
    Result<Candidates>(m, "Neighbours") FIELD(Candidates, first) FIELD(Candidates, second) FIELD(Candidates, wall) FIELD(Candidates, normal) FIELD(Candidates, gap);
    Result<Step>(m, "Step") FIELD(Step, solved) FIELD(Step, time) FIELD(Step, residual) FIELD(Step, neighbours) FIELD(Step, reaction)
        FIELD(Step, friction) FIELD(Step, iterations) FIELD(Step, repeats) FIELD(Step, method) FIELD(Step, gained) FIELD(Step, drive)
        FIELD(Step, weight) FIELD(Step, arms) FIELD(Step, impact) FIELD(Step, friction_loss) FIELD(Step, reached) FIELD(Step, push);
    Result<Works>(m, "Works") FIELD(Works, impact) FIELD(Works, friction);
    Result<FilmContacts>(m, "FilmContacts") FIELD(FilmContacts, start) FIELD(FilmContacts, answered) FIELD(FilmContacts, first)
        FIELD(FilmContacts, second) FIELD(FilmContacts, is_wall) FIELD(FilmContacts, normal) FIELD(FilmContacts, gap) FIELD(FilmContacts, reaction)
        FIELD(FilmContacts, impulse) FIELD(FilmContacts, residual) FIELD(FilmContacts, velocity_error);
    Result<FrictionOutcome>(m, "FrictionSolution") FIELD(FrictionOutcome, tangential) FIELD(FrictionOutcome, state) FIELD(FrictionOutcome, signorini)
        FIELD(FrictionOutcome, cone) FIELD(FrictionOutcome, natural_map) FIELD(FrictionOutcome, dissipation) FIELD(FrictionOutcome, spread)
        FIELD(FrictionOutcome, seed);
    Result<ImpactSolution>(m, "ImpactSolution") FIELD(ImpactSolution, reaction) FIELD(ImpactSolution, impulse) FIELD(ImpactSolution, right_velocity)
        FIELD(ImpactSolution, right_spin) FIELD(ImpactSolution, energy) FIELD(ImpactSolution, energy_change) FIELD(ImpactSolution, energy_error)
        FIELD(ImpactSolution, residual) FIELD(ImpactSolution, velocity_error) FIELD(ImpactSolution, momentum_error) FIELD(ImpactSolution, iterations)
        FIELD(ImpactSolution, canonical) FIELD(ImpactSolution, finite) FIELD(ImpactSolution, method) FIELD(ImpactSolution, disks)
        FIELD(ImpactSolution, rounds) FIELD(ImpactSolution, threads) FIELD(ImpactSolution, friction);
    nb::class_<Law>(m, "Law").def(nb::init<double, double, double, double, double, double, double, double, double>(), "step"_a, "relaxation"_a,
                                  "x"_a, "y"_a, "restitution"_a, "friction"_a, "tolerance"_a, "reach"_a = 0.0, "force"_a = 0.0)
        .def_ro("tolerance", &Law::tolerance).def_ro("reach", &Law::reach);
    nb::class_<Percussed>(m, "Percussed")  // what a step begins from
        .def("__init__", [](Percussed* at, const IntegerArg& keys, const VectorArg& reaction, const VectorArg& tangential) {
            need(reaction.size() == keys.size() && tangential.size() == keys.size(), "known: shapes differ");
            new (at) Percussed{{keys.data(), keys.data() + keys.size()}, vector(reaction), vector(tangential)};
        }, "keys"_n, "reaction"_n, "tangential"_n)
        .def_prop_ro("keys", [](const Percussed& of) { return give(std::vector(of.keys)); }, nb::rv_policy::move)
        .def_prop_ro("reaction", [](const Percussed& of) { return give(Vector(of.reaction)); }, nb::rv_policy::move)
        .def_prop_ro("tangential", [](const Percussed& of) { return give(Vector(of.tangential)); }, nb::rv_policy::move);
    nb::class_<Segments>(m, "Walls")
        .def(nb::new_(&walls_of), "ends"_n, "low"_a = 0.0, "period"_a = 0.0)
        .def_prop_ro("along", [](const Segments& walls) { return give<2>(Vector(walls.along), 2); }, nb::rv_policy::move)
        .def_prop_ro("vertex", [](const Segments& walls) { return give<2>(Indices(walls.vertex), 2); }, nb::rv_policy::move)
        .def_prop_ro("inner", [](const Segments& walls) { return give_marks<2>(Mask(walls.inner), 2); }, nb::rv_policy::move)
        .def("__len__", [](const Segments& walls) { return walls.w; });
    m.def("find_contact_pairs", &contact_pairs_of, "position"_n, "radius"_n, "walls"_a, "max_gap"_a, "body"_a = nb::none());
    m.def("neighbours", &neighbours, "position"_n, "radius"_n, "walls"_a, "margin"_a, "body"_a = nb::none());
    nb::class_<Motion>(m, "Motion")
        .def(nb::new_(&motion_of), "radius"_n, "mass"_n, "walls"_a, "law"_a, "time"_a, "bodies"_a = nb::none(), "body_velocity"_a = nb::none())
        .def("take", &take, "position"_n, "velocity"_n, "spin"_n)
        .def_prop_ro("position", [](const Motion& motion) { return give<2>(Vector(motion.now.position), 2); }, nb::rv_policy::move)
        .def_prop_ro("velocity", [](const Motion& motion) { return give<2>(Vector(motion.now.velocity), 2); }, nb::rv_policy::move)
        .def_prop_ro("spin", [](const Motion& motion) { return give(Vector(motion.now.spin)); }, nb::rv_policy::move)
        .def("advance", &advance, "desired"_a.none())
        .def("separate", &Motion::separate)
        .def("forget", &Motion::forget)
        .def_prop_rw("history", [](const Motion& of) { return Percussed{of.now.keys, of.now.reaction, of.now.tangential}; },
                     [](Motion& of, const Percussed& history) { of.now.keys = history.keys, of.now.reaction = history.reaction, of.now.tangential = history.tangential; },
                     nb::rv_policy::move)
        .def_prop_ro("time", [](const Motion& motion) { return motion.now.time; })
        .def_prop_ro("centre", [](const Motion& motion) { return give<2>(Vector(motion.now.centre), 2); }, nb::rv_policy::move)
        .def_rw("threads", &Motion::threads)
        .def_rw("stalled", &Motion::stalled);
    m.def("works", &works_of, "first"_n, "second"_n, "wall"_n, "normal"_n, "gap"_n, "radius"_n, "mean_velocity"_n, "normal_impulse"_n, "tangential_impulse"_n);
    m.def("headed", &headed_of, "position"_n, "start"_n, "end"_n, "outward"_n, "line_point"_n, "speed"_a);
    nb::class_<Drive>(m, "Drive")
        .def(nb::new_(&drive_of), "values"_n)
        .def("desired", &desired_of, "position"_n, "radius"_n, "time"_a);
    m.def("clear_of", &clear_of_walls, "start"_n, "end"_n, "walls_start"_n, "walls_end"_n, "max_distance"_a);
    m.def("film", &film, "start"_n, "ids"_n, "position"_n, "left_velocity"_n, "radius"_n, "mass"_n, "walls"_a, "gap"_a, "deepest"_a, "tolerance"_a, "canonical"_a);
    m.def("components", &components_of, "n"_a, "first"_n, "second"_n);
    m.def("soft_forces", &soft_forces, "force"_n, "x"_n, "v"_n, "radius"_n, "mass"_n, "first"_n, "second"_n, "wall"_n, "walls"_a, "law"_n, "approach_only"_a);
    m.def("soft_drive", &soft_drive, "acceleration"_n, "x"_n, "v"_n, "speed"_a, "tau"_a, "start"_n, "end"_n, "door"_n, "outward"_n);
    m.def("crosses", &crosses_of, "before"_n, "after"_n, "start"_n, "end"_n);
    m.def("eliminate", &eliminate_of, "front"_n, "pivots"_a, "rest"_a);
    using Order = Factored::Order;
    Result<Order>(m, "Ordering") FIELD(Order, order) FIELD(Order, node_first) FIELD(Order, node_end) FIELD(Order, node_parent);
    nb::class_<Factored>(m, "Factor")
        .def(nb::init<const Pairs&, const VectorArg&, const VectorArg&, bool, bool, int, int, int>(), "pairs"_a, "normal_dashpot"_n, "tangential_dashpot"_n, "turn"_a,
             "fronts"_a, "threads"_a = 1, "shared"_a = SHARED, "leaf"_a = Sizes().leaf)
        .def("factorise", &Factored::factorise, "theta"_n)
        .def("solve", &Factored::solve, "b"_n)
        .def("ordering", &Factored::ordering);
    m.attr("PANEL") = PANEL;
    m.attr("MAX_SWEEPS") = MAX_SWEEPS;
    m.attr("SHARED") = SHARED;
    m.attr("MAX_PAIRS") = MAX_PAIRS;
    m.def("solve_impact", &solve_impact, "first"_n, "second"_n, "is_wall"_n, "normal"_n, "position"_n, "radius"_n, "mass"_n, "left_velocity"_n, "spin"_a =
         nb::none(), "normal_dashpot"_a = nb::none(), "tangential_dashpot"_a = nb::none(), "maintained"_a = false, "max_approach"_a = nb::none(), "free"_a = nb::none(),
         "least_scale"_a = TINY, "tolerance"_a = 1e-8, "canonical"_a = true, "with_error_bound"_a = true, "solver"_a = Solver::AUTO, "threads"_a = 1, "guess"_a = nb::none(),
         "shared"_a = SHARED, "friction"_a = nb::none(), "starts"_a = 1, "bodies"_a = nb::none());
}
