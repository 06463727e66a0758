#include "motion.hpp"

#include <algorithm>
#include <numeric>

#include "rounding.hpp"

namespace nscd {

namespace {

// Bodies that overlap at the start are pushed apart together with all within this many radii.
constexpr double REACH = 0.3;
constexpr int PUSHES = 20;
// A step with friction that has no answer is made in halves, and those again: to 1/2^HALVINGS of it.
constexpr int HALVINGS = 4;
// Overlaps below this share of the mean radius are rounding.
constexpr double TOUCHING = 1e-12;
constexpr double APART = 1e-12, APART_AT_WORST = 1e-8;  // the tolerance of a push, and what serves
// The share of a radius by which disks are too wide where percussions grow without bound: beyond so many times the momentum of all.
constexpr double WEDGED = 1e-8, UNBOUNDED = 1e3;

void append(auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); }

void append(Neighbours& to, const Neighbours& from) {
    append(to.first, from.first), append(to.second, from.second), append(to.wall, from.wall);
    append(to.normal, from.normal), append(to.gap, from.gap);
}

// Two steps as one: all their contacts, the worse of their residuals.
Report both(Report one, const Report& other) {
    append(one.neighbours, other.neighbours), append(one.reached, other.reached);
    append(one.reaction, other.reaction), append(one.friction, other.friction), append(one.push, other.push);
    append(one.impact, other.impact), append(one.friction_loss, other.friction_loss);
    one.gained += other.gained, one.drive += other.drive, one.weight += other.weight, one.arms += other.arms;
    one.residual = std::max(one.residual, other.residual);
    one.iterations += other.iterations, one.repeats += other.repeats, one.method = other.method;
    return one;
}

// Velocities (n·3) of disks alone from those (n·2) and their spins.
Vector turning(In velocity, In spin) {
    Vector u(3 * spin.size());
    for (std::size_t i = 0; i < spin.size(); ++i) u[3 * i] = velocity[2 * i], u[3 * i + 1] = velocity[2 * i + 1], u[3 * i + 2] = spin[i];
    return u;
}

}  // namespace

void works(const Neighbours& neighbours, In radius, In mean_velocity, In normal_impulse, In tangential_impulse, Out impact, Out friction) {
    for (std::size_t c = 0; c < normal_impulse.size(); ++c) {
        const Index i = neighbours.first[c], j = neighbours.second[c];
        const double deep = std::min(0.5 * neighbours.gap[c], 0.0), nx = neighbours.normal[2 * c], ny = neighbours.normal[2 * c + 1];
        double x = mean_velocity[3 * i], y = mean_velocity[3 * i + 1], turns = (radius[i] + deep) * mean_velocity[3 * i + 2];
        if (j >= 0) x -= mean_velocity[3 * j], y -= mean_velocity[3 * j + 1], turns += (radius[j] + deep) * mean_velocity[3 * j + 2];
        impact[c] = normal_impulse[c] * (nx * x + ny * y), friction[c] = tangential_impulse[c] * (nx * y - ny * x + turns);
    }
}

void Motion::stay_within() {
    if (walls.period > 0.0)
        for (std::size_t i = 0; i < now.position.size(); i += 2)
            now.position[i] -= std::floor((now.position[i] - walls.low) / walls.period) * walls.period;
}

bool Motion::advance(const Desired& desired, Report& report) {
    const int halvings = law.friction > 0.0 ? HALVINGS : 0;
    if (in_halves(law.step, halvings, desired, report)) return true;
    // who is wedged, as at a passage of the own width, gets through with a smaller radius
    const Vector full_radius = radius;
    for (double& one : radius) one *= 1 - WEDGED;
    slim_ = true;
    const bool solved = in_halves(law.step, halvings, desired, report);
    radius = full_radius, slim_ = false;
    return solved;
}

bool Motion::in_halves(double h, int halvings, const Desired& desired, Report& report) {
    if (step_once(h, desired, report = {})) return true;
    if (halvings == 0) return false;
    const State before = now;
    Report first;
    if (!in_halves(0.5 * h, halvings - 1, desired, first)) report = std::move(first);
    else if (in_halves(0.5 * h, halvings - 1, desired, report)) {
        report = both(std::move(first), report);
        return true;
    }
    now = before;
    return false;
}

// Arms push with their force at the start of the step; return the largest component (m/s) of what velocities gain.
double Motion::push_arms(double h, Vector& velocity, Report& report) const {
    const Neighbours& reached = report.reached = with_normals(find_contact_pairs(now.position, radius, walls, law.reach));
    report.push.resize(reached.gap.size());
    Vector first(velocity.size(), 0.0), second(velocity.size(), 0.0);
    for (std::size_t c = 0; c < reached.gap.size(); ++c) {
        report.push[c] = h * (law.force * std::clamp(1 - reached.gap[c] / law.reach, 0.0, 1.0));
        for (int a = 0; a < 2; ++a) {
            const double impulse = report.push[c] * reached.normal[2 * c + a];
            first[2 * reached.first[c] + a] -= impulse;
            if (reached.second[c] >= 0) second[2 * reached.second[c] + a] += impulse;
        }
    }
    double maximum = 0.0;
    for (std::size_t i = 0; i < velocity.size(); ++i) {
        velocity[i] += (first[i] + second[i]) / mass[i / 2];
        maximum = max_or_nan(maximum, std::abs(velocity[i] - now.velocity[i]));
    }
    return maximum;
}

bool Motion::step_once(double h, const Desired& desired, Report& report) {
    const std::size_t n = radius.size(), b = body_mass.size();
    const bool compound = !body.empty();
    const double step_over_tau = desired ? h / law.relaxation : 0.0, gain[2] = {h * law.x, h * law.y};
    Vector position = now.position, kicked = now.velocity, free(2 * n), masses = mass, inertia(n);
    for (std::size_t i = 0; i < n && compound; ++i) std::copy_n(&now.centre[2 * body[i]], 2, &position[2 * i]);
    const Vector wanted = desired ? desired(position) : Vector();
    const double pushed = law.reach > 0.0 ? push_arms(h, kicked, report) : 0.0;
    const double velocity_gain = driven_velocity(kicked, wanted, step_over_tau, gain, free) + pushed;
    for (std::size_t i = 0; i < n; ++i) masses[i] *= 1 + step_over_tau, inertia[i] = 0.5 * mass[i] * (radius[i] * radius[i]);
    // bodies of several disks are driven as their first disk is
    Vector body_masses = body_mass, free_body_velocity = now.body_velocity, desired_of_bodies(wanted.empty() ? 0 : 2 * b), centre(2 * b), free_centre(2 * b);
    for (std::size_t i = n; compound && i-- > 0 && !desired_of_bodies.empty();) std::copy_n(&wanted[2 * i], 2, &desired_of_bodies[2 * body[i]]);
    for (std::size_t i = 0; i < b; ++i) body_masses[i] *= 1 + step_over_tau, std::copy_n(&now.body_velocity[3 * i], 2, &centre[2 * i]);
    driven_velocity(centre, desired_of_bodies, step_over_tau, gain, free_centre);
    for (std::size_t i = 0; i < b; ++i) std::copy_n(&free_centre[2 * i], 2, &free_body_velocity[3 * i]);

    const StepInput bodies{now.position, now.velocity, free, radius, masses, walls, members(body_masses), now.body_velocity, free_body_velocity};
    const FrictionState friction_state{law.friction, now.spin, inertia, now.keys, now.reaction, now.tangential};
    Team team(int(n) >= SHARED ? threads : 1);
    StepResult found = make_step(bodies, friction_state, h, law.restitution, velocity_gain, law.tolerance, {ordering_, team});
    double pressing = 0.0, maximum = 0.0;
    for (std::size_t i = 0; i < n; ++i) pressing += masses[i] * length(free[2 * i], free[2 * i + 1]) + WEDGED * mass[i] * radius[i] / h;
    for (double one : found.reaction) maximum = std::max(maximum, one);
    report.time = now.time, report.residual = found.error;
    if ((!slim_ && maximum > UNBOUNDED * pressing) || !(found.error <= stalled * law.tolerance)) return false;

    report.neighbours = std::move(found.neighbours), report.reaction = std::move(found.reaction), report.friction = std::move(found.tangential);
    report.iterations = found.iterations, report.method = found.method, report.repeats = found.repeats;
    account(step_over_tau, gain, bool(desired), compound ? free_body_velocity : free, compound ? found.velocity : turning(found.velocity, found.spin), report);
    now.keys = std::move(found.keys), now.reaction = report.reaction, now.tangential = report.friction;
    now.reaction.resize(now.keys.size()), now.tangential.resize(now.keys.size());
    if (compound) {
        now.body_velocity = found.velocity;
        for (double& one : found.velocity) one *= h;
        turn(found.velocity);
    } else {
        const bool falls = !desired && (gain[0] != 0.0 || gain[1] != 0.0);
        const double velocity_tolerance = law.tolerance * std::max(max_speed(now.velocity), max_speed(found.velocity));
        const Vector mean = falls ? mean_velocities(now.velocity, found.velocity, report.neighbours, report.reaction, h, velocity_tolerance) : found.velocity;
        for (std::size_t i = 0; i < 2 * n; ++i) now.position[i] += h * mean[i];
        now.velocity = std::move(found.velocity), now.spin = std::move(found.spin);
        stay_within();
    }
    now.time += h;
    return true;
}

// Where the kinetic energy of a step goes, from the velocities `free` without contacts to `after` (b·3), before the state changes.
void Motion::account(double step_over_tau, const double (&gain)[2], bool driven, In free, In after, Report& report) const {
    const bool compound = !body.empty();
    const std::size_t n = radius.size(), b = compound ? body_mass.size() : n, d = compound ? 3 : 2;
    const Vector before = compound ? now.body_velocity : turning(now.velocity, now.spin);
    Vector mean(3 * b);
    for (std::size_t i = 0; i < 3 * b; ++i) mean[i] = 0.5 * (before[i] + after[i]);
    for (std::size_t i = 0; i < b; ++i) {
        const double m = compound ? body_mass[i] : mass[i], moment = compound ? body_inertia[i] : 0.5 * mass[i] * (radius[i] * radius[i]);
        double gained = 0.0, weight = 0.0, drive = 0.0;
        for (std::size_t a = 0; a < 2; ++a) {
            const double u = mean[3 * i + a], was = before[3 * i + a], is = after[3 * i + a];
            gained += u * (is - was), weight += u * gain[a];
            drive += u * ((1 + step_over_tau) * free[d * i + a] - was - step_over_tau * is);  // (1 + a) u_free = u + a u_d + g, and what arms push
        }
        report.gained += m * gained + moment * (mean[3 * i + 2] * (after[3 * i + 2] - before[3 * i + 2]));
        report.weight += m * weight;
        if (driven) report.drive += m * drive;
    }
    Vector mean_velocity = std::move(mean);
    if (compound) {
        Vector spin(n);
        for (std::size_t i = 0; i < n; ++i) spin[i] = mean_velocity[3 * body[i] + 2];
        mean_velocity = turning(disk_velocity_of(members(body_mass), now.position, mean_velocity), spin);
    }
    Vector none(report.push.size(), 0.0), removed(none);
    works(report.reached, radius, mean_velocity, report.push, none, removed, none);
    for (double one : removed) report.arms -= one;
    if (driven) report.drive -= report.weight + report.arms;
    report.impact.resize(report.reaction.size()), report.friction_loss.resize(report.reaction.size());
    works(report.neighbours, radius, mean_velocity, report.reaction, report.friction, report.impact, report.friction_loss);
}

// Move bodies of several disks, and their disks, by the way (b·3) m, m, rad of each.
void Motion::turn(In mean) {
    const Vector from = now.centre;
    for (std::size_t i = 0; i < from.size(); ++i) now.centre[i] += mean[i / 2 * 3 + i % 2];
    for (std::size_t i = 0; i < body.size(); ++i) {
        const std::size_t at = body[i];
        const auto [c, s] = turn_by(mean[3 * at + 2]);
        const double x = now.position[2 * i] - from[2 * at], y = now.position[2 * i + 1] - from[2 * at + 1];
        now.position[2 * i] = now.centre[2 * at] + (c * x - s * y), now.position[2 * i + 1] = now.centre[2 * at + 1] + (s * x + c * y);
        now.spin[i] = now.body_velocity[3 * at + 2];
    }
    now.velocity = disk_velocity_of(members(body_mass), now.position, now.body_velocity);
}

double Motion::separate() {
    const Vector start = now.position;
    const std::size_t n = radius.size(), b = body_mass.size();
    const double mean = std::accumulate(radius.begin(), radius.end(), 0.0) / double(n);
    for (int push = 0; push < PUSHES; ++push) {
        const Neighbours neighbours = with_normals(find_contact_pairs(now.position, radius, walls, REACH * mean, body));
        const double minimum = neighbours.gap.size() ? *std::min_element(neighbours.gap.begin(), neighbours.gap.end()) : 0.0;
        if (minimum >= -TOUCHING * mean) {
            double maximum = 0.0;
            for (std::size_t i = 0; i < 2 * n; i += 2) {
                double x = now.position[i] - start[i];
                if (walls.period > 0.0) x -= walls.period * std::nearbyint(x / walls.period);
                maximum = std::max(maximum, length(x, now.position[i + 1] - start[i + 1]));
            }
            return maximum;
        }
        ImpactProblem s = impact_problem_of({now.position, Vector(2 * n, 0.0), radius, mass, {}}, neighbours.first, neighbours.second, neighbours.normal);
        s.least_scale = -minimum, s.max_approach = neighbours.gap;
        if (body.empty()) s.measure_scale();
        else s = compound_problem_of(s, radius, members(body_mass), Vector(3 * b, 0.0));
        Options options;
        options.tolerance = APART, options.canonical = options.with_error_bound = false;
        const Solution solution = solve_one_sided(s, options);
        if (!(solution_error(s, solution.reaction, solution.velocity) <= APART_AT_WORST)) return -1.0;
        if (!body.empty()) turn(solution.velocity);
        else for (std::size_t i = 0; i < 2 * n; ++i) now.position[i] += solution.velocity[i];
        stay_within();
    }
    return -1.0;
}

}  // namespace nscd
