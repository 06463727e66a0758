#include "impulse_sums.hpp"

namespace nscd {

void WindowSums::add(std::span<const Index> first, std::span<const Index> second, std::span<const Index> wall, In normal, In gap, In reaction, In friction) {
    for (std::size_t c = 0; c < reaction.size(); ++c) {
        if (!(reaction[c] > 0.0)) continue;
        const std::int64_t other = wall[c] >= 0 ? n_ + wall[c] : second[c];
        Sum& sum = sums_.at((std::int64_t(first[c]) << ID_BITS) | other);
        const double x = normal[2 * c], y = normal[2 * c + 1], across = friction.empty() ? 0.0 : friction[c];
        ++sum.steps;
        sum.x = x, sum.y = y, sum.gap = gap[c];
        sum.px += reaction[c] * x - across * y;
        sum.py += reaction[c] * y + across * x;
    }
}

void EngineSums::add_pairs(In ids, In forces, double times) {
    for (std::size_t row = 0; 2 * row < ids.size(); ++row) {
        const double x = forces[4 * row] + forces[4 * row + 2], y = forces[4 * row + 1] + forces[4 * row + 3];
        if (x == 0.0 && y == 0.0) continue;
        const auto one = std::int64_t(ids[2 * row]), other = std::int64_t(ids[2 * row + 1]);
        const double sign = one > other ? -times : times;
        Sum& sum = sums_.at(std::min(one, other) << ID_BITS | std::max(one, other));
        sum.x += sign * x, sum.y += sign * y;
    }
}

void EngineSums::add_wall(std::int64_t wall, std::span<const Index> ids, In rows, std::size_t columns, double times) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const double* row = rows.data() + i * columns;
        if (row[0] == 0.0) continue;
        Sum& sum = sums_.at(WALL | std::int64_t(ids[i]) << ID_BITS | wall);
        sum.x += times * row[1], sum.y += times * row[2];
    }
}

}  // namespace nscd
