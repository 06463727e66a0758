// Straight walls: nearest points, and how walls that meet answer for one another.
#pragma once

#include "arrays.hpp"

namespace nscd {

// Ends of walls that are nearer to each other than this (m) are one point.
inline constexpr double SAME_POINT_M = 1e-9;
// A nearest point that is nearer to an end than this (m) is the end: over the joint of two walls in line,
// rounding would put it into both.
inline constexpr double ROUNDING_M = 1e-12;

struct Segments {
    int w = 0;
    Vector start, along;  // (w·2) m
    Indices vertex;         // (w·2) numbers of the two ends, the same where walls meet
    Mask inner;           // (w·2) whether an end lies within another wall
    double far = 0.0;      // m, the largest coordinate
    double low = 0.0, period = 0.0;  // m; x and x + period are one place, and places from `low` on stand for all; 0: none
};

// Connected walls start, end (w·4) m: they meet at their ends, or where an end is within another wall.
Segments connected(In ends, double low = 0.0, double period = 0.0);

// Where on a wall, 0 to 1, its nearest point to (x, y) is.
double share_of(const Segments& walls, int wall, double x, double y);

// Whether the nearest point of a wall, at `fraction` of it, is one that another wall answers for: one that it
// ends in, one that comes nearer beyond their common end, or the first of those that all end there. So a
// disk has one contact for each nearest point of connected walls: one along walls in line and at a corner
// that points at it, two in a corner that it sits in.
bool is_of_another(const Segments& walls, int wall, double fraction, double x, double y);

// Velocities (n·2) m/s of who walks at a speed to the nearest point of a segment; along `outward` on it, and beyond the
// line through `line_point` across `outward`. position (n·2) m, start, end, line_point (2) m, outward (2) unit vector
void headed(In position, In start, In end, In outward, In line_point, double speed, Out velocity);

// How far (n) m the nearest of the walls start → end (w·2) m is from the lines from → to (n·2) m, at most `max_distance`; 0 where
// they meet.
void clear_of(In from, In to, In start, In end, double max_distance, Out clear);

}  // namespace nscd
