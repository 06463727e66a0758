// Many snapshots in one call: contacts, percussions and certificate of each, with the help of the one before.
#pragma once

#include "contacts.hpp"
#include "problem.hpp"

namespace nscd {

// The n disks of f frames, one frame behind the other.
struct Film {
    std::span<const std::int64_t> start;  // (f+1) the first of each frame, and the end
    std::span<const std::int64_t> ids;    // (n) below 2³¹, rising in each frame
    In position, left_velocity;           // (n·2) m, m/s: u⁻
    In radius, mass;                      // (n) m, kg, positive
    const Segments& walls;
};
struct FramesOptions {
    double gap;        // m, up to which disks are in contact
    double deepest;    // share of the smaller radius; a frame with deeper overlaps is not answered
    double tolerance;
    bool canonical;        // whether λ is to be the one of least energy
};
// The k contacts of f frames, one frame behind the other, and what they carry. A frame that is not answered has none here:
// it is left to `find_contacts` and `solve`, which say why.
struct FilmSolution {
    std::vector<std::int64_t> start;             // (f+1)
    Mask answered;                              // (f)
    std::vector<std::int64_t> first, second;     // (k) among the disks of all frames; number of a wall where is_wall
    Mask is_wall;                               // (k)
    Vector normal, gap, reaction, impulse;      // (k·2), (k) m, (k) N·s, (k·2) N·s
    Vector residual, velocity_error;            // (f), (f) m/s
};
FilmSolution solve_film(const Film& film, const FramesOptions& options);

}  // namespace nscd
