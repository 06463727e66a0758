// Where people want to go and how fast: to their doors, straight or by corners, pushing for ever or keeping their distance.
// The law is in words in analysis/scene/drive.py, of those who keep their distance in analysis/scene/distance.py.
#pragma once

#include <array>
#include <optional>

#include "geometry.hpp"

namespace nscd {

// s: a stop as late as this before an instant counts as there, since instants are rounded.
inline constexpr double INSTANT = 1e-9;

// What people who keep their distance have in common; a time gap of 0: nobody keeps one.
struct Distance {
    double time_gap = 0.0, heading_sd = 0.0, heading_hold = 1.0;  // s, rad, s
    double jostling = 0.0, length = 1.0, period = 1.0;            // m/s, m, s
    double seed = 0.0;
};

class Drive {
public:
    double speed = 0.0;                  // m/s, U
    Vector exits;                       // (d·8) m: target start, end, outward, place on the line behind which all walk outward
    Vector goes, stop;                  // (n) row of exits; s, from when on somebody wants to go nowhere
    Vector grid, next, corners, onward; // of a way: origin, cell, rows, columns; (d·cells), (k·2) m; (d·k) m, left from corners
    Segments walls;
    Vector fraction, ids;                  // (n) of push, p; numbers that noise goes by

    // Of numbers in a row: doors, people, walls, corners of a way (0: none), start and length of a period (m), speed; the law; ends of
    // walls; exits, goes, stop, ids, fraction; of a way: grid, next, corners, onward. None where they do not fit.
    static std::optional<Drive> of(In values);
    // Take the law; its waves are drawn.
    void keep(const Distance& law);
    // Velocities (n·2) m/s of people at x (n·2) m who go straight on for ever: U e.
    Vector wished(In x, double time) const;
    // Velocities (n·2) m/s that people of such radii (m) want at a time (s).
    Vector desired(In at, In radius, double time) const;

private:
    struct Leg { double start[2], end[2], outward[2], line_point[2]; bool corner; };
    struct View;
    struct Wave { double x, y, turning, cosine[2], sine[2]; };  // rad/m, rad/s; of the phases of both components
    int corner_of(const double* at, int door) const;
    Leg leg(const double* at, int door) const;
    double left(double x, double y, int door) const;
    void heading(const double* at, int door, double left, double radius, bool round, double (&way)[2]) const;

    Distance law_;
    std::vector<Wave> waves_;
};

}  // namespace nscd
