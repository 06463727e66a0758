#include "geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace nscd {

Segments connected(In ends, double low, double period) {
    const int w = int(ends.size() / 4);
    Segments walls{w, {}, {}, Indices(2 * w), Mask(2 * w, 0), 0.0, low, period};
    for (int i = 0; i < 4 * w; ++i) {
        walls.far = std::max(walls.far, std::abs(ends[i]));
        if (i % 4 < 2) walls.start.push_back(ends[i]), walls.along.push_back(ends[i + 2] - ends[i]);
    }
    if (period > 0.0) walls.far = std::max({walls.far, std::abs(low), std::abs(low + period)});
    // ends in the order of x and of y: of each wall few are near
    Indices order[2] = {Indices(2 * w), Indices(2 * w)};
    for (int axis = 0; axis < 2; ++axis) {
        std::iota(order[axis].begin(), order[axis].end(), 0);
        std::sort(order[axis].begin(), order[axis].end(), [&](int a, int b) { return ends[2 * a + axis] < ends[2 * b + axis]; });
    }
    const double margin = 2 * SAME_POINT_M + 8 * std::numeric_limits<double>::epsilon() * walls.far;
    // the ends near the box of two points, along the axis with the fewer
    const auto is_near = [&](const double* first, const double* second) {
        std::span<const int> fewest(order[0]);
        for (int axis = 0; axis < 2; ++axis) {
            const auto [low, high] = std::minmax(first[axis], second[axis]);
            const auto begin = std::partition_point(order[axis].begin(), order[axis].end(),
                                                    [&](int e) { return ends[2 * e + axis] < low - margin; });
            const auto end = std::partition_point(begin, order[axis].end(),
                                                  [&](int e) { return ends[2 * e + axis] <= high + margin; });
            if (size_t(end - begin) < fewest.size()) fewest = {begin, end};
        }
        return fewest;
    };
    for (int i = 0; i < 2 * w; ++i) {
        const double* mine = &ends[2 * i];
        int nearest = i;
        double minimum = SAME_POINT_M;
        for (const int j : is_near(mine, mine)) {
            const double distance = j < i ? length(mine[0] - ends[2 * j], mine[1] - ends[2 * j + 1]) : 2 * SAME_POINT_M;
            if (distance < minimum || (distance == minimum && (nearest == i || j < nearest))) nearest = j, minimum = distance;
        }
        walls.vertex[i] = nearest < i ? walls.vertex[nearest] : i;
    }
    for (int i = 0; i < w; ++i)
        for (const int e : is_near(&ends[4 * i], &ends[4 * i + 2])) {
            const double fraction = share_of(walls, i, ends[2 * e], ends[2 * e + 1]);
            const double x = ends[4 * i] + fraction * walls.along[2 * i], y = ends[4 * i + 1] + fraction * walls.along[2 * i + 1];
            const bool own = walls.vertex[e] == walls.vertex[2 * i] || walls.vertex[e] == walls.vertex[2 * i + 1];
            if (!own && length(x - ends[2 * e], y - ends[2 * e + 1]) <= SAME_POINT_M) walls.inner[e] = 1;
        }
    return walls;
}

double share_of(const Segments& walls, int wall, double x, double y) {
    const double ax = walls.along[2 * wall], ay = walls.along[2 * wall + 1];
    const double length = std::sqrt(ax * ax + ay * ay);
    const double s = ((x - walls.start[2 * wall]) * ax + (y - walls.start[2 * wall + 1]) * ay) / length;
    if (s <= ROUNDING_M) return 0.0;
    return s >= length - ROUNDING_M ? 1.0 : s / length;
}

bool is_of_another(const Segments& walls, int wall, double fraction, double x, double y) {
    if (0.0 < fraction && fraction < 1.0) return false;
    const int end = 2 * wall + (fraction == 0.0 ? 0 : 1);
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

void headed(In position, In start, In end, In outward, In line_point, double speed, Out velocity) {
    const double ax = end[0] - start[0], ay = end[1] - start[1], square = ax * ax + ay * ay;
    for (std::size_t i = 0; i < position.size(); i += 2) {
        const double x = position[i], y = position[i + 1];
        const double fraction = square > 0.0 ? std::clamp(((x - start[0]) * ax + (y - start[1]) * ay) / square, 0.0, 1.0) : 0.0;
        const double dx = start[0] + fraction * ax - x, dy = start[1] + fraction * ay - y, distance = length(dx, dy);
        const bool beyond = (x - line_point[0]) * outward[0] + (y - line_point[1]) * outward[1] >= 0.0;
        const bool out = beyond || distance == 0.0;
        velocity[i] = speed * (out ? outward[0] : dx / distance);
        velocity[i + 1] = speed * (out ? outward[1] : dy / distance);
    }
}

namespace {

struct Line {
    double x, y, ax, ay, square;
    Line(const double* a, const double* b) : x(a[0]), y(a[1]), ax(b[0] - x), ay(b[1] - y), square(ax * ax + ay * ay) {}
    double side(double px, double py) const { return ax * (py - y) - ay * (px - x); }
    double square_to(double px, double py) const {
        const double fraction = square > 0.0 ? std::clamp(((px - x) * ax + (py - y) * ay) / square, 0.0, 1.0) : 0.0;
        const double dx = x + fraction * ax - px, dy = y + fraction * ay - py;
        return dx * dx + dy * dy;
    }
    bool splits(const Line& other) const { return side(other.x, other.y) * side(other.x + other.ax, other.y + other.ay) < 0.0; }
};

bool far_apart(double a, double b, double c, double d, double max_distance) {
    return std::max(a, b) + max_distance < std::min(c, d) || std::max(c, d) + max_distance < std::min(a, b);
}

}  // namespace

void clear_of(In from, In to, In start, In end, double max_distance, Out clear) {
    for (std::size_t i = 0; i < from.size(); i += 2) {
        const Line way(&from[i], &to[i]);
        double minimum = max_distance * max_distance;
        for (std::size_t w = 0; w < start.size() && minimum > 0.0; w += 2) {
            if (far_apart(from[i], to[i], start[w], end[w], max_distance) || far_apart(from[i + 1], to[i + 1], start[w + 1], end[w + 1], max_distance)) continue;
            const Line wall(&start[w], &end[w]);
            if (way.splits(wall) && wall.splits(way)) minimum = 0.0;
            minimum = std::min({minimum, way.square_to(start[w], start[w + 1]), way.square_to(end[w], end[w + 1]), wall.square_to(from[i], from[i + 1]),
                              wall.square_to(to[i], to[i + 1])});
        }
        clear[i / 2] = std::sqrt(minimum);
    }
}

}  // namespace nscd
