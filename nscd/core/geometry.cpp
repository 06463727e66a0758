#include "geometry.hpp"

#include <algorithm>

namespace nscd {

double share_of(const Segments& walls, int wall, double x, double y) {
    const double ax = walls.along[2 * wall], ay = walls.along[2 * wall + 1];
    const double length = std::sqrt(ax * ax + ay * ay);
    const double s = ((x - walls.start[2 * wall]) * ax + (y - walls.start[2 * wall + 1]) * ay) / length;
    if (s <= ROUNDING_M) return 0.0;
    return s >= length - ROUNDING_M ? 1.0 : s / length;
}

bool is_of_another(const Segments& walls, int wall, double share, double x, double y) {
    if (0.0 < share && share < 1.0) return false;
    const int end = 2 * wall + (share == 0.0 ? 0 : 1);
    if (walls.inner[end]) return true;
    for (int other = 0; other < walls.w; ++other) {
        if (other == wall) continue;
        for (int far = 0; far < 2; ++far) {
            if (walls.vertex[2 * other + far] != walls.vertex[end]) continue;
            if (share_of(walls, other, x, y) != double(far) || other < wall) return true;
        }
    }
    return false;
}

void headed(In position, In start, In end, In outward, In place, double speed, Out velocity) {
    const double ax = end[0] - start[0], ay = end[1] - start[1], square = ax * ax + ay * ay;
    for (std::size_t i = 0; i < position.size(); i += 2) {
        const double x = position[i], y = position[i + 1];
        const double share = square > 0.0 ? std::clamp(((x - start[0]) * ax + (y - start[1]) * ay) / square, 0.0, 1.0) : 0.0;
        const double dx = start[0] + share * ax - x, dy = start[1] + share * ay - y, distance = std::hypot(dx, dy);
        const bool beyond = (x - place[0]) * outward[0] + (y - place[1]) * outward[1] >= 0.0;
        const bool out = beyond || distance == 0.0;
        velocity[i] = speed * (out ? outward[0] : dx / distance);
        velocity[i + 1] = speed * (out ? outward[1] : dy / distance);
    }
}

}  // namespace nscd
