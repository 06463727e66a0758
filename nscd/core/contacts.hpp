// Who touches whom: one search for a snapshot, for the frames of a film and for the steps of a motion.
#pragma once

#include "geometry.hpp"

namespace nscd {

// A grid never has more cells than this times the number of disks: who has left the room may be far.
inline constexpr int CELLS_PER_DISK = 8;
// So many pairs take about 1 GB.
inline constexpr std::int64_t MAX_PAIRS = 50'000'000;
// The search goes this much farther than asked, since it rounds; the gap decides.
inline constexpr double MARGIN = 1.0 + 1e-12;
// Coordinates up to so many of the smallest radius: gaps are then known to 10⁻⁶ of it.
inline constexpr double FARTHEST = 1e9;

struct ContactPairs {
    std::vector<std::int64_t> first, second;  // (k) a disk, and another or, from `pairs` on, a wall
    Vector vector;                           // (k·2) m, from the centre to the other, or to the wall
    Vector distance, gap;                    // (k) m, its length; less what the radii fill
    std::int64_t pairs = 0;                   // how many are of two disks; −1 where MAX_PAIRS are within reach
    std::size_t size() const { return gap.size(); }
};

// All pairs i < j of disks with a gap |x_j − x_i| − r_i − r_j of at most `max_gap` m, by (i, j); then all disks
// whose nearest point of a wall is at most r + max_gap away, and that wall itself answers for, by (disk, wall).
// position (n·2) m, radius (n) m; body (n, or none): of two disks of one there is no contact. With a period also pairs across
// its ends.
ContactPairs find_contact_pairs(In position, In radius, const Segments& walls, double max_gap, std::span<const Index> body = {});

// The disks and walls of these alone, of places within a period.
ContactPairs find_wall_contacts(In position, In radius, const Segments& walls, double max_gap);

// Of each disk those behind it in number, rising, whose gap may be at most `max_gap` m, and with MARGIN a little more: of disk i
// other[start[i]] to other[start[i + 1]]. No start where MAX_PAIRS are within reach.
struct Nearby {
    Starts start;  // (n + 1)
    Indices other;
};
Nearby nearby(In position, In radius, double max_gap, std::span<const Index> body = {});

// Who may have a gap of at most `max_gap` m to whom, by squares of a grid: in square c and those around it are, rising,
// disk[start[c]] to disk[start[c + 1]].
struct Around {
    Starts start;
    Indices disk, square;  // (n) of each disk
};
Around around(In position, In radius, double max_gap);

// The same with unit normals.
struct Neighbours {
    Indices first, second, wall;  // (k) disk; disk, −1 for a wall; wall, −1 for a pair
    Vector normal, gap;         // (k·2) unit vector, first → second; (k) m
};
Neighbours with_normals(const ContactPairs& contacts);

// A number of each contact from the ids of who touches, or their numbers: rising, as the contacts do.
std::vector<std::int64_t> keys_of(const ContactPairs& contacts, std::span<const std::int64_t> ids = {});

// What contacts with rising keys have, for those that are wanted, 0 for new ones; how many were there.
struct Carried {
    Vector values;
    std::size_t matched = 0;
};
Carried carried_over(std::span<const std::int64_t> keys, In values, std::span<const std::int64_t> wanted);

// What gaps of such coordinates may be wrong by (m).
inline double rounding_of(double far) { return 4.0 * EPSILON * far; }

}  // namespace nscd
