#include "soft.hpp"

#include <algorithm>

namespace nscd {

namespace {

// Adds to a force what one receives from another at −(x, y), relative to whom it moves with (u, v); returns whether it is near.
bool add_social(double x, double y, double u, double v, double radii, const Social& law, double (&force)[2]) {
    const double square = x * x + y * y, far = radii + law.reach;
    if (square > far * far || square == 0.0) return false;
    const double distance = std::sqrt(square), gap = distance - radii, nx = x / distance, ny = y / distance;
    double normal = law.strength * std::exp(-gap / law.decay), sliding = 0.0;
    if (gap < 0.0) normal -= law.body_stiffness * gap, sliding = law.sliding_friction * gap * (-u * ny + v * nx);
    force[0] = normal * nx - sliding * ny, force[1] = normal * ny + sliding * nx;
    return true;
}

}  // namespace

void contact_forces(Out force, In x, In v, In radius, In mass, std::span<const std::int64_t> first,
                    std::span<const std::int64_t> second, std::span<const std::int64_t> wall, const Segments& walls, const Soft& soft) {
    std::fill(force.begin(), force.end(), 0.0);
    for (std::size_t c = 0; c < first.size(); ++c) {
        const std::int64_t i = first[c], j = second[c], w = wall[c];
        double dx, dy, radii = radius[i], size = radius[i], m = mass[i];
        if (w < 0) {
            dx = x[2 * j] - x[2 * i], dy = x[2 * j + 1] - x[2 * i + 1];
            radii = radius[i] + radius[j];
            size = radius[i] * radius[j] / radii;
            m = mass[i] * mass[j] / (mass[i] + mass[j]);
        } else {
            const double fraction = share_of(walls, int(w), x[2 * i], x[2 * i + 1]);
            if (is_of_another(walls, int(w), fraction, x[2 * i], x[2 * i + 1])) continue;
            dx = walls.start[2 * w] + fraction * walls.along[2 * w] - x[2 * i];
            dy = walls.start[2 * w + 1] + fraction * walls.along[2 * w + 1] - x[2 * i + 1];
        }
        const double distance = std::sqrt(dx * dx + dy * dy), overlap = radii - distance;
        if (overlap <= 0.0) continue;
        const double nx = dx / distance, ny = dy / distance;
        double vx = v[2 * i], vy = v[2 * i + 1];
        if (w < 0) vx -= v[2 * j], vy -= v[2 * j + 1];
        const double approach = vx * nx + vy * ny;
        const Springs& springs = w < 0 ? soft.pair : soft.wall;
        const double hertz = springs.hertz * std::sqrt(size * overlap);
        const double damping = (springs.dashpot + std::sqrt(5.0) * soft.ratio * std::sqrt(m * hertz)) * approach;
        const double elastic = springs.linear * overlap + hertz * overlap + springs.square * overlap * overlap;
        const double push = elastic + (soft.approach_only ? std::max(0.0, damping) : damping);
        if (push <= 0.0) continue;
        force[2 * i] -= push * nx, force[2 * i + 1] -= push * ny;
        if (w < 0) force[2 * j] += push * nx, force[2 * j + 1] += push * ny;
    }
}

void add_drive(Out acceleration, In x, In v, double speed, double tau, In start, In end, In door, In outward) {
    for (std::size_t i = 0; i < x.size(); i += 2) {
        const double ax = end[i] - start[i], ay = end[i + 1] - start[i + 1], square = ax * ax + ay * ay;
        const double px = x[i] - start[i], py = x[i + 1] - start[i + 1];
        const double fraction = square > 0.0 ? std::clamp((px * ax + py * ay) / square, 0.0, 1.0) : 0.0;
        double dx = start[i] + fraction * ax - x[i], dy = start[i + 1] + fraction * ay - x[i + 1];
        double distance = std::sqrt(dx * dx + dy * dy);
        const double beyond = (x[i] - door[i]) * outward[i] + (x[i + 1] - door[i + 1]) * outward[i + 1];
        if (beyond >= 0.0 || distance == 0.0) dx = outward[i], dy = outward[i + 1], distance = 1.0;
        acceleration[i] += (speed * dx / distance - v[i]) / tau;
        acceleration[i + 1] += (speed * dy / distance - v[i + 1]) / tau;
    }
}

bool crosses(In before, In after, In start, In end) {
    for (std::size_t w = 0; w < start.size(); w += 2) {
        const double x = end[w] - start[w], y = end[w + 1] - start[w + 1];
        for (std::size_t i = 0; i < before.size(); i += 2) {
            const double vx = after[i] - before[i], vy = after[i + 1] - before[i + 1];
            const double sx = before[i] - start[w], sy = before[i + 1] - start[w + 1];
            const double ex = before[i] - end[w], ey = before[i + 1] - end[w + 1];
            // its ends are on both sides of the wall, and so are the wall's of the way
            const double side = x * sy - y * sx, other = x * (sy + vy) - y * (sx + vx);
            if (side * other < 0.0 && (vy * sx - vx * sy) * (vy * ex - vx * ey) <= 0.0) return true;
        }
    }
    return false;
}

void social_steps(Out position, Out velocity, In desired, In radius, In mass, In start, In end, const Social& law, double step, int steps) {
    const std::size_t n = radius.size();
    Vector force(2 * n);
    double push[2];
    for (; steps > 0; --steps) {
        for (std::size_t c = 0; c < 2 * n; ++c) force[c] = mass[c / 2] * (desired[c] - velocity[c]) / law.tau;
        for (std::size_t i = 0; i < n; ++i) {
            const double x = position[2 * i], y = position[2 * i + 1], u = velocity[2 * i], v = velocity[2 * i + 1];
            if (x > law.gone) continue;
            for (std::size_t j = 0; j < i; ++j) {
                if (position[2 * j] > law.gone) continue;
                if (!add_social(x - position[2 * j], y - position[2 * j + 1], u - velocity[2 * j], v - velocity[2 * j + 1], radius[i] + radius[j], law, push)) continue;
                force[2 * i] += push[0], force[2 * i + 1] += push[1];
                force[2 * j] -= push[0], force[2 * j + 1] -= push[1];
            }
            for (std::size_t w = 0; w < start.size(); w += 2) {
                const double ax = end[w] - start[w], ay = end[w + 1] - start[w + 1], px = x - start[w], py = y - start[w + 1];
                const double fraction = std::clamp((px * ax + py * ay) / (ax * ax + ay * ay), 0.0, 1.0);
                if (!add_social(px - fraction * ax, py - fraction * ay, u, v, radius[i], law, push)) continue;
                force[2 * i] += push[0], force[2 * i + 1] += push[1];
            }
        }
        for (std::size_t c = 0; c < 2 * n; ++c) {
            velocity[c] += step * force[c] / mass[c / 2];
            position[c] += step * velocity[c];
        }
    }
}

}  // namespace nscd
