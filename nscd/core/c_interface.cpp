// The door for programs in C and C++: nscd.h.
#include "nscd.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>
#include <tuple>

#include "impact_solver.hpp"
#include "contacts.hpp"
#include "drive.hpp"
#include "friction_solver.hpp"

using namespace nscd;

// Of a contact: the lower disk, the other, and the normal at an obstacle.
using Key = std::tuple<std::ptrdiff_t, std::ptrdiff_t, double, double>;

struct nscd_crowd {
    Vector position, velocity, radius, mass, spin, normal;
    Indices first, second;
    double friction = 0.0, normal_dashpot = 0.0, tangential_dashpot = 0.0;
    Vector percussion, right, right_spin;
    double error = INFINITE;
    std::set<Key> listed;
};

struct nscd_drive {
    Drive drive;
};

namespace {

thread_local std::string message;

Key key_of(std::ptrdiff_t first, std::ptrdiff_t second, double x, double y) {
    return second < 0 ? Key{first, second, x, y} : Key{std::min(first, second), std::max(first, second), 0.0, 0.0};
}

// What fails says why.
int refuse(std::string why) {
    message = std::move(why);
    return 0;
}

template <class Work>
int guarded(const Work& work) {
    try {
        return work();
    } catch (const std::exception& failure) {
        return refuse(failure.what());
    }
}

std::string bad(const char* field, std::size_t at) { return std::string(field) + ": entry " + std::to_string(at) + " is not a usable number"; }

// Refused unless every number is finite and, where asked, positive.
bool valid(const char* field, In values, std::size_t columns, bool positive = false) {
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]) || (positive && !(values[i] > 0.0))) return refuse(bad(field, i / columns));
    return true;
}

// As nscd.solve: friction by its own ladder, all else by the convex one.
double answered(nscd_crowd& crowd, double tolerance) {
    const std::size_t n = crowd.radius.size(), k = crowd.first.size();
    Vector spin = crowd.spin;
    spin.resize(n, 0.0);
    const bool frictional = crowd.friction > 0.0, turns = !frictional && crowd.tangential_dashpot > 0.0;
    ImpactProblem s = impact_problem_of({crowd.position, crowd.velocity, crowd.radius, crowd.mass, turns ? In(spin) : In()}, crowd.first, crowd.second, crowd.normal);
    if (crowd.normal_dashpot > 0.0 || crowd.tangential_dashpot > 0.0) s.normal_dashpot.assign(k, crowd.normal_dashpot), s.tangential_dashpot.assign(k, crowd.tangential_dashpot);
    crowd.right.resize(2 * n), crowd.right_spin = spin;
    const auto take = [&](const Vector& u, int d) {
        for (std::size_t i = 0; i < n; ++i) {
            for (int a = 0; a < 2; ++a) crowd.right[2 * i + a] = u[d * i + a];
            if (d == 3) crowd.right_spin[i] = u[3 * i + 2];
        }
    };
    if (!frictional) {
        const Solution found = solve_one_sided(s, {.tolerance = tolerance, .with_error_bound = false, .reaction = {}, .velocity = {}, .sizes = {}});
        Certificate certificate = certificate_of(s, found.reaction, found.velocity);
        crowd.percussion = std::move(certificate.impulse);
        take(found.velocity, s.d);
        return certificate.finite ? max_or_nan(certificate.residual, certificate.momentum_error) : INFINITE;
    }
    Vector inertia(n);
    for (std::size_t i = 0; i < n; ++i) inertia[i] = 0.5 * crowd.mass[i] * crowd.radius[i] * crowd.radius[i];
    FrictionProblem p = friction_problem_of(s, crowd.radius, spin, inertia, Vector(k, crowd.friction));
    const FrictionResult found = solve_friction(p, {tolerance});
    FrictionCertificate certificate = certificate_of(p, found.solution);
    crowd.percussion = std::move(certificate.impulse);
    take(found.solution.velocity, 3);
    return max_or_nan(certificate.natural_map, certificate.momentum_error);
}

}  // namespace

nscd_crowd* nscd_new(std::size_t n, const double* position, const double* velocity, const double* radius, const double* mass) {
    nscd_crowd* made = nullptr;
    guarded([&] {
        if (n == 0 || !position || !velocity || !radius || !mass) return refuse("disks: none, or an array is missing");
        if (n > std::size_t(std::numeric_limits<Index>::max() / 4)) return refuse("disks: too many");
        if (!valid("position", {position, 2 * n}, 2) || !valid("velocity", {velocity, 2 * n}, 2) || !valid("radius", {radius, n}, 1, true) ||
            !valid("mass", {mass, n}, 1, true))
            return 0;
        made = new nscd_crowd{.position = {position, position + 2 * n}, .velocity = {velocity, velocity + 2 * n}, .radius = {radius, radius + n},
                              .mass = {mass, mass + n}, .spin = {}, .normal = {}, .first = {}, .second = {}, .percussion = {}, .right = {}, .right_spin = {}, .listed = {}};
        return 1;
    });
    return made;
}

void nscd_free(nscd_crowd* crowd) { delete crowd; }

int nscd_friction(nscd_crowd* crowd, double coefficient, const double* spin) {
    return guarded([&] {
        if (!(coefficient >= 0.0) || !std::isfinite(coefficient)) return refuse("friction: 0 or more is needed");
        const In spins(spin, spin ? crowd->radius.size() : 0);
        if (!valid("spin", spins, 1)) return 0;
        crowd->friction = coefficient, crowd->spin.assign(spins.begin(), spins.end());
        return 1;
    });
}

int nscd_dissipation(nscd_crowd* crowd, double normal, double tangential) {
    if (!(normal >= 0.0 && tangential >= 0.0 && std::isfinite(normal + tangential))) return refuse("dissipation: 0 or more is needed");
    crowd->normal_dashpot = normal, crowd->tangential_dashpot = tangential;
    return 1;
}

int nscd_contact(nscd_crowd* crowd, std::ptrdiff_t first, std::ptrdiff_t second, double x, double y) {
    return guarded([&] {
        const auto n = std::ptrdiff_t(crowd->radius.size());
        if (first < 0 || first >= n || second < -1 || second >= n || first == second) return refuse("contact: disk " + std::to_string(first) + " with " + std::to_string(second) + " of " + std::to_string(n));
        if (second >= 0) {
            x = crowd->position[2 * second] - crowd->position[2 * first], y = crowd->position[2 * second + 1] - crowd->position[2 * first + 1];
            const double distance = length(x, y);
            if (distance == 0.0) return refuse("contact: disks " + std::to_string(first) + " and " + std::to_string(second) + " have one centre");
            x /= distance, y /= distance;
        } else if (!(std::abs(length(x, y) - 1.0) <= 1e-9)) {
            return refuse("contact: the normal of disk " + std::to_string(first) + " at an obstacle is no unit vector");
        }
        if (!crowd->listed.insert(key_of(first, second, x, y)).second)
            return refuse("contact: disk " + std::to_string(first) + " with " + std::to_string(second) + " is given twice");
        crowd->first.push_back(Index(first)), crowd->second.push_back(Index(second));
        crowd->normal.insert(crowd->normal.end(), {x, y});
        return 1;
    });
}

int nscd_touch(nscd_crowd* crowd, double gap) {
    return guarded([&] {
        if (!std::isfinite(gap)) return refuse("gap: a finite number is needed");
        const ContactPairs found = find_contact_pairs(crowd->position, crowd->radius, Segments{}, gap);
        if (found.pairs < 0) return refuse("gap: too many pairs are within it");
        for (std::size_t c = 0; c < found.size(); ++c)
            if (crowd->listed.count(key_of(found.first[c], found.second[c], 0.0, 0.0)))
                return refuse("gap: disk " + std::to_string(found.first[c]) + " with " + std::to_string(found.second[c]) + " is given already");
        for (std::size_t c = 0; c < found.size(); ++c)
            if (!nscd_contact(crowd, found.first[c], found.second[c], 0.0, 0.0)) return 0;
        return 1;
    });
}

int nscd_solve(nscd_crowd* crowd, double tolerance) {
    return guarded([&] {
        if (!(tolerance >= 1e-14 && tolerance < 1.0)) return refuse("tolerance: between 1e-14 and 1 is needed");
        crowd->error = answered(*crowd, tolerance);
        char text[64];
        std::snprintf(text, sizeof text, "not solved: error %.1e, tolerance %.1e", crowd->error, tolerance);
        return crowd->error <= tolerance ? 1 : refuse(text);
    });
}

std::size_t nscd_count(const nscd_crowd* crowd) { return crowd->first.size(); }
void nscd_pair(const nscd_crowd* crowd, std::size_t contact, std::ptrdiff_t* first, std::ptrdiff_t* second) {
    *first = crowd->first[contact], *second = crowd->second[contact];
}
const double* nscd_percussions(const nscd_crowd* crowd) { return crowd->percussion.data(); }
const double* nscd_velocities(const nscd_crowd* crowd) { return crowd->right.data(); }
const double* nscd_spins(const nscd_crowd* crowd) { return crowd->right_spin.data(); }
double nscd_error(const nscd_crowd* crowd) { return crowd->error; }

nscd_drive* nscd_drive_new(const double* values, std::size_t count) {
    nscd_drive* made = nullptr;
    guarded([&] {
        std::optional<Drive> drive = Drive::of({values, count});
        if (!drive) return refuse("drive: these are not its numbers");
        made = new nscd_drive{*std::move(drive)};
        return 1;
    });
    return made;
}

void nscd_drive_free(nscd_drive* drive) { delete drive; }

int nscd_drive_desired(const nscd_drive* drive, std::size_t n, const double* position, const double* radius, double time, double* velocity) {
    return guarded([&] {
        if (n != drive->drive.goes.size()) return refuse("drive: of " + std::to_string(drive->drive.goes.size()) + " people, not " + std::to_string(n));
        const Vector wanted = drive->drive.desired({position, 2 * n}, {radius, n}, time);
        std::copy(wanted.begin(), wanted.end(), velocity);
        return 1;
    });
}

const char* nscd_message(void) { return message.c_str(); }
