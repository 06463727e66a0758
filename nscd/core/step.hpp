// A rigid crowd in motion: one Moreau–Jean step, an exact contact problem.
#pragma once

#include "impact_solver.hpp"
#include "contacts.hpp"
#include "friction_solver.hpp"

namespace nscd {

struct StepInput {
    In position, velocity;  // (n·2) m, m/s
    In free;                // (n·2) m/s, the velocities without contacts
    In radius, mass;        // (n) m; kg, with what the drive adds
    const Segments& walls;
    Members compound;           // bodies of several disks, with what the drive adds; none where each is alone
    In body_velocity, free_body_velocity;  // (b·3) their velocities, before and without contacts
};

// Coulomb's law in a step. The search for the percussions begins from those of the step before.
struct FrictionState {
    double friction = 0.0;                // μ; all else counts only where it is not 0
    In spin, inertia;                     // (n) rad/s, kg m²
    std::span<const std::int64_t> keys;   // (m) of contacts of the step before, see `StepResult`
    In reaction, tangential;              // (m) N·s
};

struct StepResult {
    Neighbours neighbours;
    Vector reaction, velocity;  // (k) N·s, (n·2) m/s; (b·3) of bodies
    Vector tangential, spin;    // (k) N·s along (−n_y, n_x), (n) rad/s
    std::vector<std::int64_t> keys;  // (k) with friction: a number of each contact, the same in every step
    double error = 0.0;          // the residual or the imbalance of momentum, recomputed
    int iterations = 0;
    Method method = Method::NO_CONTACTS;
    int repeats = 0;             // how often contacts were missed
};

// What a step works with: the order of elimination of steps before, and threads.
struct Resources {
    ReusableOrder& reusable;
    Team& team;
};

// Make a step of `step` s; with restitution e a contact that closes within it with v⁻ > 0 has
// C u⁺ ≤ −e v⁻ (Moreau's law), unless v⁻ is at most twice `velocity_gain` m/s, what the drive gives in a step: that contact rests.
// Where that law has no answer, or one that gains energy, contacts do not rebound: C u⁺ ≤ gap/step.
StepResult make_step(const StepInput& bodies, const FrictionState& friction_state, double step, double restitution, double velocity_gain, double tolerance, const Resources& resources);

// Velocities after a step without contacts, (u + g + a u_d)/(1 + a) with a = h/τ, and the largest component (m/s) of what
// they gained. Where nobody drives, desired is empty.
double driven_velocity(In velocity, In desired, double step_over_tau, const double (&gain)[2], Out free);

// The velocities (n·2) with which disks go through a step that nobody drives: the means of those before and after it, which
// follow a body force to second order; but those after it where a mean would close a contact beyond its gap, or change the
// gap of a pressed one, and for all that such disks press. velocity_tolerance: m/s, what counts as nothing
Vector mean_velocities(In before, In after, const Neighbours& neighbours, In reaction, double step, double velocity_tolerance);

double max_speed(In velocity);  // the largest speed (m/s) of (n·2)

}  // namespace nscd
