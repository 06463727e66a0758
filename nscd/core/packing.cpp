#include "packing.hpp"

#include <algorithm>
#include <array>

namespace nscd {

namespace {

// A square grid of cells, each with the last disk that was put in it and from each disk the one before.
struct Grid {
    int columns, rows;
    Indices head, before;
    Grid(int columns_, int rows_, std::size_t n) : columns(columns_), rows(rows_), head(std::size_t(columns_) * rows_, -1), before(n, -1) {}
    void insert(int column, int row, int disk) {
        Index& last = head[std::size_t(column) * rows + row];
        before[disk] = last, last = disk;
    }
    // Until one is refused.
    template <class Visit>
    bool around(int column, int row, int reach, Visit visit) const {
        for (int p = std::max(column - reach, 0); p <= std::min(column + reach, columns - 1); ++p)
            for (int q = std::max(row - reach, 0); q <= std::min(row + reach, rows - 1); ++q)
                for (Index c = head[std::size_t(p) * rows + q]; c >= 0; c = before[c])
                    if (!visit(c)) return false;
        return true;
    }
};

struct Site { double key; Index a, b, side; };  // touches disks a and b (−1: the wall), on one side

// A binary heap, the smallest key first.
struct Sites {
    std::vector<Site> heap;
    void push(const Site& site) {
        heap.push_back(site);
        std::size_t c = heap.size() - 1;
        for (; c > 0 && heap[(c - 1) / 2].key > site.key; c = (c - 1) / 2) heap[c] = heap[(c - 1) / 2];
        heap[c] = site;
    }
    Site pop() {
        const Site first = heap.front(), last = heap.back();
        heap.pop_back();
        std::size_t c = 0;
        for (std::size_t child; (child = 2 * c + 1) < heap.size(); c = child) {
            if (child + 1 < heap.size() && heap[child + 1].key < heap[child].key) ++child;
            if (heap[child].key >= last.key) break;
            heap[c] = heap[child];
        }
        if (!heap.empty()) heap[c] = last;
        return first;
    }
};

struct Spot { double x, y; bool there; };

// Centre of a disk of radius r that touches a and b.
Spot touching_both(In position, In radius, int a, int b, int side, double r) {
    const double ax = position[2 * a], ay = position[2 * a + 1], ra = radius[a] + r;
    if (b < 0) {
        const double h = ra * ra - (ax + r) * (ax + r);
        return {-r, ay + side * std::sqrt(std::max(h, 0.0)), h >= 0.0};
    }
    const double dx = position[2 * b] - ax, dy = position[2 * b + 1] - ay;
    const double d = std::sqrt(dx * dx + dy * dy), rb = radius[b] + r;
    const double along = (d * d + ra * ra - rb * rb) / (2 * d);
    const double h = ra * ra - along * along, across = side * std::sqrt(std::max(h, 0.0));
    return {ax + (along * dx - across * dy) / d, ay + (along * dy + across * dx) / d, h >= 0.0};
}

// Pairs with a gap below the skin.
void pairs_within(In position, In radius, double skin, double cell, std::vector<std::array<Index, 2>>& pairs) {
    const int n = int(radius.size());
    double low[2] = {INFINITE, INFINITE}, high[2] = {-INFINITE, -INFINITE};
    for (int i = 0; i < 2 * n; ++i) low[i & 1] = std::min(low[i & 1], position[i]), high[i & 1] = std::max(high[i & 1], position[i]);
    const double x0 = low[0] - cell, y0 = low[1] - cell;
    Grid grid(int((high[0] - x0) / cell) + 3, int((high[1] - y0) / cell) + 3, n);
    pairs.clear();
    for (int a = 0; a < n; ++a) {
        const double x = position[2 * a], y = position[2 * a + 1];
        const int column = int((x - x0) / cell), row = int((y - y0) / cell);
        grid.around(column, row, 1, [&](Index b) {
            const double reach = radius[a] + radius[b] + skin, dx = x - position[2 * b], dy = y - position[2 * b + 1];
            if (dx * dx + dy * dy < reach * reach) pairs.push_back({b, a});
            return true;
        });
        grid.insert(column, row, a);
    }
}

// The mean force of the listed pairs that overlap; sets the force (n·2) on each disk.
double add_forces(In position, In radius, In push, const Press& options, const std::vector<std::array<Index, 2>>& pairs, Out force) {
    for (std::size_t a = 0; a < radius.size(); ++a) {
        const double x = position[2 * a], y = position[2 * a + 1];
        const double ty = std::min(std::max(y, -options.half_door), options.half_door) - y, d = std::sqrt(x * x + ty * ty);
        force[2 * a] = -push[a] * x / d, force[2 * a + 1] = push[a] * ty / d;
        if (x > -radius[a]) force[2 * a] -= options.stiffness * (x + radius[a]);
    }
    double pressed = 0.0;
    int count = 0;
    for (const auto& [a, b] : pairs) {
        const double dx = position[2 * b] - position[2 * a], dy = position[2 * b + 1] - position[2 * a + 1];
        const double square = dx * dx + dy * dy, both = radius[a] + radius[b];
        if (square >= both * both) continue;
        const double d = std::sqrt(square), f = options.stiffness * (both - d);
        pressed += f;
        ++count;
        force[2 * a] -= f * dx / d, force[2 * a + 1] -= f * dy / d;
        force[2 * b] += f * dx / d, force[2 * b + 1] += f * dy / d;
    }
    return count ? pressed / count : 0.0;
}

}  // namespace

int grow(Out position, In radius, int placed, const Growth& of) {
    const int n = int(radius.size()), m = int(2 * of.reach / of.cell) + 4;
    Grid grid(m, m, n);
    Sites sites;
    for (int count = 0; count < n; ++count) {
        const double r = radius[count];
        Spot spot{position[2 * count], position[2 * count + 1], count < placed};
        const auto cell_of = [&](double z) { return std::clamp(int((z + of.reach) / of.cell), 0, m - 1); };
        while (!sites.heap.empty() && !spot.there) {
            const Site site = sites.pop();
            spot = touching_both(position, radius, site.a, site.b, site.side, r);
            spot.there = spot.there && spot.x <= -r + 1e-12 && grid.around(cell_of(spot.x), cell_of(spot.y), 1, [&](Index c) {
                const double gap = length(position[2 * c] - spot.x, position[2 * c + 1] - spot.y) - radius[c] - r;
                return c == site.a || c == site.b || gap >= 0.0;
            });
        }
        if (!spot.there) return count;
        position[2 * count] = spot.x, position[2 * count + 1] = spot.y;
        if (spot.x > -of.beside)
            for (int side : {-1, 1}) {
                const Spot at = touching_both(position, radius, count, -1, side, of.typical);
                if (at.there && (of.shut || std::abs(at.y) > of.half_door))
                    sites.push({std::max(std::abs(at.y) - of.half_door, 0.0), count, -1, side});
            }
        const int column = cell_of(spot.x), row = cell_of(spot.y);
        grid.around(column, row, 2, [&](Index c) {
            const double d = length(position[2 * c] - spot.x, position[2 * c + 1] - spot.y);
            if (d >= radius[c] + r + of.reach_between) return true;
            for (int side : {-1, 1}) {
                const Spot at = touching_both(position, radius, count, c, side, of.typical);
                if (at.there && at.x < -of.wall_distance && length(at.x, at.y) > of.hollow)
                    sites.push({length(at.x, std::max(std::abs(at.y) - of.half_door, 0.0)), count, c, side});
            }
            return true;
        });
        grid.insert(column, row, count);
    }
    return n;
}

bool press(Out position, In radius, In push, const Press& options) {
    const std::size_t size = position.size();
    Vector velocity(size, 0.0), force(size), listed;
    std::vector<std::array<Index, 2>> pairs;
    double dt = options.step, alpha = 0.1;
    int steps = 0;
    for (int step = 0; step < options.max_steps; ++step) {
        double moved = listed.empty() ? INFINITE : 0.0;
        for (std::size_t i = 0; i < listed.size(); i += 2) {
            const double dx = position[i] - listed[i], dy = position[i + 1] - listed[i + 1];
            moved = std::max(moved, dx * dx + dy * dy);
        }
        if (moved > 0.25 * options.skin * options.skin) {
            listed.assign(position.begin(), position.end());
            pairs_within(position, radius, options.skin, options.cell, pairs);
        }
        const double mean = add_forces(position, radius, push, options, pairs, force);
        double power = 0.0, speed = 0.0, pull = 0.0, worst = 0.0;
        for (std::size_t i = 0; i < size; ++i) {
            power += force[i] * velocity[i];
            speed += velocity[i] * velocity[i];
            pull += force[i] * force[i];
            worst = std::max(worst, std::abs(force[i]));
        }
        if (worst < options.force_tolerance * mean) return true;
        if (power > 0) {
            ++steps;
            const double mix = alpha * std::sqrt(speed / pull);
            for (std::size_t i = 0; i < size; ++i) velocity[i] = (1 - alpha) * velocity[i] + mix * force[i];
            if (steps > 5) dt = std::min(dt * 1.1, options.longest), alpha *= 0.99;
        } else {
            std::fill(velocity.begin(), velocity.end(), 0.0);
            dt *= 0.5, alpha = 0.1, steps = 0;
        }
        for (std::size_t i = 0; i < size; ++i) velocity[i] += dt * force[i], position[i] += dt * velocity[i];
    }
    return false;
}

}  // namespace nscd
