#include "contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace nscd {

namespace {

// Which disks are in which square of a grid; the last row and column also have all that is farther.
struct Cells {
    int nx = 1, ny = 1;
    Places at;      // (n·2) cell of each disk
    Places begins;  // (nx·ny + 1) the first place of each cell, where all its disks have one
    std::size_t of(int i, int j) const { return std::size_t(i) * ny + j; }
};

Cells cells_of(In position, double size) {
    const std::size_t n = position.size() / 2;
    double low[2] = {INFINITE, INFINITE}, high[2] = {-INFINITE, -INFINITE};
    for (std::size_t i = 0; i < 2 * n; ++i) {
        low[i & 1] = std::min(low[i & 1], position[i]);
        high[i & 1] = std::max(high[i & 1], position[i]);
    }
    const double room = double(CELLS_PER_DISK) * double(n) + 64.0;
    Cells cells;
    cells.nx = int(std::min((high[0] - low[0]) / size + 1.0, room));
    cells.ny = int(std::min((high[1] - low[1]) / size + 1.0, room / cells.nx + 1.0));
    cells.begins.assign(cells.of(cells.nx, 0) + 1, 0);
    cells.at.resize(2 * n);
    for (std::size_t a = 0; a < n; ++a) {
        const int i = std::min(int(std::min((position[2 * a] - low[0]) / size, room)), cells.nx - 1);
        const int j = std::min(int(std::min((position[2 * a + 1] - low[1]) / size, room)), cells.ny - 1);
        cells.at[2 * a] = i, cells.at[2 * a + 1] = j;
        ++cells.begins[cells.of(i, j) + 1];
    }
    for (std::size_t c = 1; c < cells.begins.size(); ++c) cells.begins[c] += cells.begins[c - 1];
    return cells;
}

void push(Touching& found, std::size_t a, std::size_t b, double dx, double dy, double distance, double gap) {
    found.first.push_back(std::int64_t(a)), found.second.push_back(std::int64_t(b));
    found.vector.push_back(dx), found.vector.push_back(dy);
    found.distance.push_back(distance), found.gap.push_back(gap);
}

// Pairs; false where more than MOST_PAIRS are within reach.
bool find_pairs(Touching& found, In position, In radius, double most, std::span<const Index> body) {
    const Nearby near = nearby(position, radius, most, body);
    for (std::size_t a = 0; a + 1 < near.start.size(); ++a)
        for (std::int64_t c = near.start[a]; c < near.start[a + 1]; ++c) {
            const std::size_t b = std::size_t(near.other[c]);
            const double dx = position[2 * b] - position[2 * a], dy = position[2 * b + 1] - position[2 * a + 1];
            const double distance = length(dx, dy), gap = distance - radius[a] - radius[b];
            if (gap <= most) push(found, a, b, dx, dy, distance, gap);
        }
    return near.start.size() > radius.size();
}

void find_walls(Touching& found, In position, In radius, const Segments& walls, double most) {
    for (std::size_t a = 0; a < radius.size(); ++a) {
        const double x = position[2 * a], y = position[2 * a + 1];
        // the box rounds too, by less than the tolerance, which is at least what rounding makes of a gap
        const double reach = radius[a] + 2.0 * std::max(most, 0.0);
        for (int w = 0; w < walls.w; ++w) {
            const double x0 = walls.start[2 * w], y0 = walls.start[2 * w + 1];
            const double ax = walls.along[2 * w], ay = walls.along[2 * w + 1];
            if (x - reach > std::max(x0, x0 + ax) || x + reach < std::min(x0, x0 + ax)) continue;
            if (y - reach > std::max(y0, y0 + ay) || y + reach < std::min(y0, y0 + ay)) continue;
            const double share = std::clamp(((x - x0) * ax + (y - y0) * ay) / (ax * ax + ay * ay), 0.0, 1.0);
            const double dx = x0 + share * ax - x, dy = y0 + share * ay - y;
            const double distance = length(dx, dy), gap = distance - radius[a];
            if (gap > most || is_of_another(walls, w, share_of(walls, w, x, y), x, y)) continue;
            push(found, a, std::size_t(w), dx, dy, distance, gap);
        }
    }
}

// A key has the id of the first disk so many times, and keys of walls are behind those of pairs.
constexpr std::int64_t NUMBERS = std::int64_t{1} << 31, WALL = std::int64_t{1} << 62;

}  // namespace

Nearby nearby(In position, In radius, double most, std::span<const Index> body) {
    struct Held { double x, y, reach; Index disk; };
    const std::size_t n = radius.size();
    Nearby near;
    if (n == 0) return near.start.assign(1, 0), near;
    const double more = std::max(most, 0.0), reach = (2.0 * *std::max_element(radius.begin(), radius.end()) + most) * MARGIN;
    const Cells cells = cells_of(position, reach);
    // each comes into its cell after all before it, which so are sorted for those that they find and for those that find them
    std::vector<Held> held(n);
    Places filled = cells.begins, from(n + 1, 0);
    std::vector<Index, Aligned<Index>> early(8 * n);
    Starts count(n + 1, 0);
    for (std::size_t b = 0; b < n; ++b) {
        const Held me{position[2 * b], position[2 * b + 1], (radius[b] + 0.5 * more) * MARGIN, Index(b)};
        const int i = cells.at[2 * b], j = cells.at[2 * b + 1], q0 = std::max(j - 1, 0), q1 = std::min(j + 2, cells.ny);
        const std::size_t first = std::size_t(from[b]);
        std::size_t size = first;
        if (early.size() < size + b) early.resize(2 * early.size() + n);
        for (int p = std::max(i - 1, 0), p1 = std::min(i + 2, cells.nx); p < p1; ++p)
            for (std::size_t cell = cells.of(p, q0), end = cells.of(p, q1); cell < end; ++cell)
                for (Index k = cells.begins[cell]; k < filled[cell]; ++k) {
                    const double dx = held[k].x - me.x, dy = held[k].y - me.y, square = dx * dx + dy * dy;
                    const double apart = held[k].reach + me.reach;
                    early[size] = held[k].disk;
                    size += square <= apart * apart;  // without a branch, which nobody could foresee
                }
        held[filled[cells.of(i, j)]++] = me;
        if (!body.empty()) size = std::size_t(std::remove_if(&early[first], &early[0] + size, [&](Index a) { return body[a] == body[b]; }) - &early[0]);
        for (std::size_t k = first; k < size; ++k) ++count[early[k] + 1];
        if (size > MOST_PAIRS) return near;
        from[b + 1] = Index(size);
    }
    for (std::size_t a = 0; a < n; ++a) count[a + 1] += count[a];
    near.start = count;
    near.other.resize(std::size_t(from[n]));
    for (std::size_t b = 0; b < n; ++b)
        for (Index k = from[b]; k < from[b + 1]; ++k) near.other[count[early[k]]++] = Index(b);
    return near;
}

Around around(In position, In radius, double most) {
    const std::size_t n = radius.size();
    Around all{{0}, {}, Places(n)};
    if (n == 0) return all;
    const Cells cells = cells_of(position, (2.0 * *std::max_element(radius.begin(), radius.end()) + most) * MARGIN);
    const auto each = [&](std::size_t b, const auto& to) {
        const int i = cells.at[2 * b], j = cells.at[2 * b + 1], q0 = std::max(j - 1, 0), q1 = std::min(j + 2, cells.ny);
        for (int p = std::max(i - 1, 0), p1 = std::min(i + 2, cells.nx); p < p1; ++p)
            for (std::size_t cell = cells.of(p, q0), end = cells.of(p, q1); cell < end; ++cell) to(cell);
    };
    all.start.assign(cells.begins.size(), 0);
    for (std::size_t b = 0; b < n; ++b) each(b, [&](std::size_t cell) { ++all.start[cell + 1]; });
    for (std::size_t c = 1; c < all.start.size(); ++c) all.start[c] += all.start[c - 1];
    Starts filled = all.start;
    all.disk.resize(std::size_t(all.start.back()));
    for (std::size_t b = 0; b < n; ++b) {
        all.square[b] = Index(cells.of(cells.at[2 * b], cells.at[2 * b + 1]));
        each(b, [&](std::size_t cell) { all.disk[std::size_t(filled[cell]++)] = Index(b); });
    }
    return all;
}

Neighbours named(const Touching& at) {
    const std::size_t k = at.size();
    Neighbours near{Places(k), Places(k), Places(k), Numbers(2 * k), at.gap};
    for (std::size_t c = 0; c < k; ++c) {
        const bool wall = std::int64_t(c) >= at.pairs;
        near.first[c] = Index(at.first[c]);
        near.second[c] = wall ? -1 : Index(at.second[c]);
        near.wall[c] = wall ? Index(at.second[c]) : -1;
        near.normal[2 * c] = at.vector[2 * c] / at.distance[c];
        near.normal[2 * c + 1] = at.vector[2 * c + 1] / at.distance[c];
    }
    return near;
}

std::vector<std::int64_t> keys_of(const Touching& at, std::span<const std::int64_t> ids) {
    std::vector<std::int64_t> keys(at.size());
    const auto id = [&](std::int64_t i) { return ids.empty() ? i : ids[i]; };
    for (std::size_t c = 0; c < keys.size(); ++c)
        keys[c] = NUMBERS * id(at.first[c]) + (std::int64_t(c) < at.pairs ? id(at.second[c]) : WALL + at.second[c]);
    return keys;
}

Carried carried_over(std::span<const std::int64_t> keys, In values, std::span<const std::int64_t> wanted) {
    Carried of{Numbers(wanted.size(), 0.0)};
    std::size_t at = 0;
    for (std::size_t c = 0; c < wanted.size(); ++c) {
        while (at < keys.size() && keys[at] < wanted[c]) ++at;
        if (at < keys.size() && keys[at] == wanted[c]) of.values[c] = values[at], ++of.known;
    }
    return of;
}

static Touching touching_round(In position, In radius, Segments walls, double most, std::span<const Index> body);

Touching touching(In position, In radius, const Segments& walls, double most, std::span<const Index> body) {
    if (walls.period > 0.0 && radius.size()) return touching_round(position, radius, walls, most, body);
    Touching found;
    const std::size_t room = 3 * radius.size() + 64;
    found.first.reserve(room), found.second.reserve(room), found.vector.reserve(2 * room);
    found.distance.reserve(room), found.gap.reserve(room);
    if (radius.size() > 1 && !find_pairs(found, position, radius, most, body)) {
        found.pairs = -1;
        return found;
    }
    found.pairs = std::int64_t(found.size());
    if (walls.w) find_walls(found, position, radius, walls, most);
    return found;
}

Touching touching_walls(In position, In radius, const Segments& walls, double most) {
    Touching found;
    find_walls(found, position, radius, walls, most);
    return found;
}

// With a period: of disks at their places in it, and of pairs also with images of the first disks behind its end.
static Touching touching_round(In position, In radius, Segments walls, double most, std::span<const Index> body) {
    const std::size_t n = radius.size();
    const double low = walls.low, period = std::exchange(walls.period, 0.0);
    Numbers place(position.begin(), position.end()), size(radius.begin(), radius.end());
    for (std::size_t i = 0; i < n; ++i) place[2 * i] -= period * std::floor((place[2 * i] - low) / period);
    Touching at_walls;
    if (walls.w) find_walls(at_walls, place, radius, walls, most);
    const double reach = (2.0 * *std::max_element(radius.begin(), radius.end()) + most) * MARGIN;
    Places image, whose(body.begin(), body.end());
    for (std::size_t i = 0; i < n; ++i)
        if (place[2 * i] <= low + reach) {
            image.push_back(Index(i)), size.push_back(radius[i]);
            if (!body.empty()) whose.push_back(body[i]);
            place.push_back(place[2 * i] + period), place.push_back(place[2 * i + 1]);
        }
    walls.w = 0;
    Touching found = touching(place, size, walls, most, whose);
    if (found.pairs < 0) return found;
    std::vector<std::tuple<std::int64_t, std::int64_t, std::size_t>> rows;
    for (std::size_t c = 0; c < found.size(); ++c) {
        const std::int64_t a = found.first[c], b = found.second[c] < std::int64_t(n) ? found.second[c] : image[found.second[c] - n];
        if (a < std::int64_t(n) && a != b) rows.emplace_back(std::min(a, b), std::max(a, b), c);
    }
    std::sort(rows.begin(), rows.end());
    Touching all;
    for (const auto& [a, b, c] : rows) {
        const double sign = found.first[c] == a ? 1.0 : -1.0;
        push(all, a, b, sign * found.vector[2 * c], sign * found.vector[2 * c + 1], found.distance[c], found.gap[c]);
    }
    all.pairs = std::int64_t(all.size());
    for (std::size_t c = 0; c < at_walls.size(); ++c)
        push(all, at_walls.first[c], at_walls.second[c], at_walls.vector[2 * c], at_walls.vector[2 * c + 1], at_walls.distance[c], at_walls.gap[c]);
    return all;
}

}  // namespace nscd
