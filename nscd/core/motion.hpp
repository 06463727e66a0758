// A rigid crowd in motion: one Moreau–Jean step after another. The scheme is written out in nscd.stepping.Motion.
#pragma once

#include <functional>

#include "step.hpp"

namespace nscd {

struct Law {
    double step = 0.0, relaxation = INFINITE;  // s; τ of the drive
    double x = 0.0, y = 0.0;                   // m/s², of a body force
    double restitution = 0.0, friction = 0.0, tolerance = 1e-8;
    double reach = 0.0, force = 0.0;           // m, N, of arms; reach 0: none
};

// What an answer may miss: so many times the tolerance.
inline constexpr double STALLED = 10.0;

// The works (k), (k) J that impulses take from the motion, along the normal and across: p·D(w), at contacts in the middle of
// their gaps. mean_velocity (n·3) m/s, m/s, rad/s: w, the mean of the velocities before and after
void works(const Neighbours& neighbours, In radius, In mean_velocity, In normal_impulse, In tangential_impulse, Out impact, Out friction);

// What a step did; of both halves of one that was made in halves. Where it is not solved: when (s), and the residual.
struct Report {
    Neighbours neighbours, reached;          // candidates for contact; who reaches whom with arms
    Vector reaction, friction, push;  // N·s at both
    Vector impact, friction_loss;           // J, lost in each contact along the normal and across
    double gained = 0.0, drive = 0.0, weight = 0.0, arms = 0.0;  // J, see StepEnergy in nscd.stepping
    double time = 0.0, residual = 0.0;
    int iterations = 0, repeats = 0;
    Method method = Method::NO_CONTACTS;
};

class Motion {
public:
    // Desired velocities (n·2) m/s at positions (n·2) m; empty: nobody drives.
    using Desired = std::function<Vector(In)>;
    struct State {
        Vector position, velocity, spin;  // (n·2) m, m/s, (n) rad/s
        double time = 0.0;
        Vector centre, body_velocity;     // (b·2) m, (b·3) m/s, m/s, rad/s of bodies of several disks
        std::vector<std::int64_t> keys;    // (m) contacts of the step before, and their percussions (N·s)
        Vector reaction, tangential;
    };
    Law law;
    Segments walls;
    Vector radius, mass;                // (n) m, kg
    Indices body;                         // (n) the body of each disk; empty where each is one
    Vector body_mass, body_inertia;     // (b) kg, kg m²
    State now;
    double stalled = STALLED;
    int threads = 1;

    // Make a step, with friction in halves where no solver solves it, and those again; whether it is solved. Else the state stays.
    bool advance(const Desired& desired, Report& report);
    // Push overlapping disks apart, as little as possible; how far at most (m), −1 where they do not fit.
    double separate();
    void stay_within();                  // the period
    void forget() { now.keys.clear(), now.reaction.clear(), now.tangential.clear(), ordering_.forget(); }

private:
    bool in_halves(double h, int halvings, const Desired& desired, Report& report);
    bool step_once(double h, const Desired& desired, Report& report);
    double push_arms(double h, Vector& velocity, Report& report) const;
    void account(double step_over_tau, const double (&gain)[2], bool driven, In free, In after, Report& report) const;
    void turn(In mean);
    Members members(In masses) const { return {body, now.centre, masses, body_inertia}; }
    bool slim_ = false;
    ReusableOrder ordering_;
};

}  // namespace nscd
