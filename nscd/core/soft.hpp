// Soft bodies: the contact forces of the charts, and the steps of the social force model.
#pragma once

#include "geometry.hpp"

namespace nscd {

// F = k δ + K √R δ^1.5 + q δ² and a dashpot c + √5 ζ √(m_eff K √(Rδ)), of pairs and of walls.
struct Springs {
    double linear, hertz, square, dashpot;  // k N/m, K Pa, q N/m², c kg/s
};
struct Soft {
    Springs pair, wall;
    double ratio;  // ζ
    bool approach_only;    // whether the dashpot acts on approach alone
};

// Contact forces (n·2) N at positions x (n·2) m and velocities v (n·2) m/s; wall (k) is −1 for a pair. A contact pushes with
// max(0, F + c δ′), or F + max(0, c δ′), while δ > 0.
void contact_forces(Out force, In x, In v, In radius, In mass, std::span<const std::int64_t> first,
                    std::span<const std::int64_t> second, std::span<const std::int64_t> wall, const Segments& walls, const Soft& soft);

// Add the drive (u_d − v)/τ (m/s²): of each disk towards the nearest point of start … end, outward on it and beyond the line
// through `door` across `outward`, all (n·2).
void add_drive(Out acceleration, In x, In v, double speed, double tau, In start, In end, In door, In outward);

// Whether any way before → after (n·2) m crosses any wall start → end (w·2) m.
bool crosses(In before, In after, In start, In end);

// The social force model of Helbing, Farkas and Vicsek, Nature 407 (2000) 487: people and walls at a gap g along n give
// A exp(−g/B) n, and where they overlap k(−g) n and κ(−g) Δu_t t besides.
struct Social {
    double strength, decay, body_stiffness, sliding_friction;  // A N, B m, k N/m, κ kg/(m s)
    double tau;    // s, in which somebody alone comes to the desired velocity
    double reach;  // m, the largest gap of a pair that counts
    double gone;   // m, who is beyond it in x pushes nobody
};
// Move people (n·2) by semi-implicit Euler steps (s) with desired velocities (n·2) m/s among walls start → end (w·2) m.
void social_steps(Out position, Out velocity, In desired, In radius, In mass, In start, In end, const Social& law, double step, int steps);

}  // namespace nscd
