// A rigid crowd in motion: one Moreau–Jean step, an exact contact problem, and the sums of what steps carry.
#pragma once

#include <unordered_map>

#include "answer.hpp"
#include "contacts.hpp"

namespace nscd {

struct Bodies {
    In position, velocity;  // (n·2) m, m/s
    In free;                // (n·2) m/s, the velocities without contacts
    In radius, mass;        // (n) m; kg, with what the drive adds
    Segments walls;
};

// Candidates for contact.
struct Neighbours {
    Places first, second, wall;  // (k) disk; disk, −1 for a wall; wall, −1 for a pair
    Numbers normal, gap;         // (k·2) unit vector, first → second; (k) m
};
// Every pair and every wall whose gap is at most `margin` m.
Neighbours neighbours_of(In position, In radius, const Segments& walls, double margin);

struct Stepped {
    Neighbours neighbours;
    Numbers reaction, velocity;  // (k) N·s, (n·2) m/s
    double error = 0.0;          // the residual or the imbalance of momentum, recomputed
    int iterations = 0;
    int rung = 0;                // of `Rung`; GRADIENT where accelerated gradient served
    int repeats = 0;             // how often contacts were missed
};
inline constexpr int GRADIENT = -1;

// Make a step of `step` s without friction; with restitution e a contact that closes within it with v⁻ > 0 has
// C u⁺ ≤ −e v⁻ (Moreau's law), unless v⁻ is at most twice `gained` m/s, what the drive gives in a step: that contact rests.
Stepped make_step(const Bodies& bodies, double step, double restitution, double gained, double tolerance);

// Whether velocities would close within a step (s) a gap beyond the margin (m) within which contacts were looked for.
bool missed(const Bodies& bodies, In velocity, double step, double margin);

// Velocities after a step without contacts, (u + g + a u_d)/(1 + a), and the largest component (m/s) of what they gained.
// Where nobody drives, desired is empty.
double freed(In velocity, In desired, double share, const double (&gain)[2], Out free);

double fastest(In velocity);  // the largest speed (m/s) of (n·2)

// Impulses summed contact by contact over a window of time.
class WindowSums {
public:
    explicit WindowSums(std::int64_t n) : n_(n) {}
    struct Sum {
        std::int64_t steps = 0;  // in how many steps it was pressed
        double x, y, gap;        // normal and gap of the last of them
        double px = 0.0, py = 0.0;
    };
    // friction (k) N·s along (−n_y, n_x), or none.
    void add(std::span<const Index> first, std::span<const Index> second, std::span<const Index> wall, In normal, In gap, In reaction, In friction);
    std::vector<std::pair<std::int64_t, Sum>> close();  // by key: first · 2³¹ + second, or n + wall

private:
    std::int64_t n_;
    std::unordered_map<std::int64_t, Sum> sums_;
};

}  // namespace nscd
