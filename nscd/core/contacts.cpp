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
    Indices at;      // (n·2) cell of each disk
    Indices begins;  // (nx·ny + 1) the first place of each cell, where all its disks have one
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

void push(ContactPairs& found, std::size_t a, std::size_t b, double dx, double dy, double distance, double gap) {
    found.first.push_back(std::int64_t(a)), found.second.push_back(std::int64_t(b));
    found.vector.push_back(dx), found.vector.push_back(dy);
    found.distance.push_back(distance), found.gap.push_back(gap);
}

// Pairs; false where more than MAX_PAIRS are within reach.
bool find_pairs(ContactPairs& found, In position, In radius, double max_gap, std::span<const Index> body) {
    const Nearby candidates = nearby(position, radius, max_gap, body);
    for (std::size_t a = 0; a + 1 < candidates.start.size(); ++a)
        for (std::int64_t c = candidates.start[a]; c < candidates.start[a + 1]; ++c) {
            const std::size_t b = std::size_t(candidates.other[c]);
            const double dx = position[2 * b] - position[2 * a], dy = position[2 * b + 1] - position[2 * a + 1];
            const double distance = length(dx, dy), gap = distance - radius[a] - radius[b];
            if (gap <= max_gap) push(found, a, b, dx, dy, distance, gap);
        }
    return candidates.start.size() > radius.size();
}

void find_walls(ContactPairs& found, In position, In radius, const Segments& walls, double max_gap) {
    for (std::size_t a = 0; a < radius.size(); ++a) {
        const double x = position[2 * a], y = position[2 * a + 1];
        // the box rounds too, by less than the tolerance, which is at least what rounding makes of a gap
        const double reach = radius[a] + 2.0 * std::max(max_gap, 0.0);
        for (int w = 0; w < walls.w; ++w) {
            const double x0 = walls.start[2 * w], y0 = walls.start[2 * w + 1];
            const double ax = walls.along[2 * w], ay = walls.along[2 * w + 1];
            if (x - reach > std::max(x0, x0 + ax) || x + reach < std::min(x0, x0 + ax)) continue;
            if (y - reach > std::max(y0, y0 + ay) || y + reach < std::min(y0, y0 + ay)) continue;
            const double fraction = std::clamp(((x - x0) * ax + (y - y0) * ay) / (ax * ax + ay * ay), 0.0, 1.0);
            const double dx = x0 + fraction * ax - x, dy = y0 + fraction * ay - y;
            const double distance = length(dx, dy), gap = distance - radius[a];
            if (gap > max_gap || is_of_another(walls, w, share_of(walls, w, x, y), x, y)) continue;
            push(found, a, std::size_t(w), dx, dy, distance, gap);
        }
    }
}

// A key has the id of the first disk so many times, and keys of walls are behind those of pairs.
constexpr std::int64_t NUMBERS = std::int64_t{1} << 31, WALL = std::int64_t{1} << 62;

}  // namespace

Nearby nearby(In position, In radius, double max_gap, std::span<const Index> body) {
    struct Entry { double x, y, reach; Index disk; };
    const std::size_t n = radius.size();
    Nearby candidates;
    if (n == 0) return candidates.start.assign(1, 0), candidates;
    const double more = std::max(max_gap, 0.0), reach = (2.0 * *std::max_element(radius.begin(), radius.end()) + max_gap) * MARGIN;
    const Cells cells = cells_of(position, reach);
    // each comes into its cell after all before it, which so are sorted for those that they find and for those that find them
    std::vector<Entry> entries(n);
    Indices filled = cells.begins, from(n + 1, 0);
    std::vector<Index, Aligned<Index>> early(8 * n);
    Starts count(n + 1, 0);
    for (std::size_t b = 0; b < n; ++b) {
        const Entry me{position[2 * b], position[2 * b + 1], (radius[b] + 0.5 * more) * MARGIN, Index(b)};
        const int i = cells.at[2 * b], j = cells.at[2 * b + 1], q0 = std::max(j - 1, 0), q1 = std::min(j + 2, cells.ny);
        const std::size_t first = std::size_t(from[b]);
        std::size_t size = first;
        if (early.size() < size + b) early.resize(2 * early.size() + n);
        for (int p = std::max(i - 1, 0), p1 = std::min(i + 2, cells.nx); p < p1; ++p)
            for (std::size_t cell = cells.of(p, q0), end = cells.of(p, q1); cell < end; ++cell)
                for (Index k = cells.begins[cell]; k < filled[cell]; ++k) {
                    const double dx = entries[k].x - me.x, dy = entries[k].y - me.y, square = dx * dx + dy * dy;
                    const double reach = entries[k].reach + me.reach;
                    early[size] = entries[k].disk;
                    size += square <= reach * reach;  // without a branch, which nobody could foresee
                }
        entries[filled[cells.of(i, j)]++] = me;
        if (!body.empty()) size = std::size_t(std::remove_if(&early[first], &early[0] + size, [&](Index a) { return body[a] == body[b]; }) - &early[0]);
        for (std::size_t k = first; k < size; ++k) ++count[early[k] + 1];
        if (size > MAX_PAIRS) return candidates;
        from[b + 1] = Index(size);
    }
    for (std::size_t a = 0; a < n; ++a) count[a + 1] += count[a];
    candidates.start = count;
    candidates.other.resize(std::size_t(from[n]));
    for (std::size_t b = 0; b < n; ++b)
        for (Index k = from[b]; k < from[b + 1]; ++k) candidates.other[count[early[k]]++] = Index(b);
    return candidates;
}

Around around(In position, In radius, double max_gap) {
    const std::size_t n = radius.size();
    Around all{{0}, {}, Indices(n)};
    if (n == 0) return all;
    const Cells cells = cells_of(position, (2.0 * *std::max_element(radius.begin(), radius.end()) + max_gap) * MARGIN);
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

Neighbours with_normals(const ContactPairs& contacts) {
    const std::size_t k = contacts.size();
    Neighbours neighbours{Indices(k), Indices(k), Indices(k), Vector(2 * k), contacts.gap};
    for (std::size_t c = 0; c < k; ++c) {
        const bool wall = std::int64_t(c) >= contacts.pairs;
        neighbours.first[c] = Index(contacts.first[c]);
        neighbours.second[c] = wall ? -1 : Index(contacts.second[c]);
        neighbours.wall[c] = wall ? Index(contacts.second[c]) : -1;
        neighbours.normal[2 * c] = contacts.vector[2 * c] / contacts.distance[c];
        neighbours.normal[2 * c + 1] = contacts.vector[2 * c + 1] / contacts.distance[c];
    }
    return neighbours;
}

std::vector<std::int64_t> keys_of(const ContactPairs& contacts, std::span<const std::int64_t> ids) {
    std::vector<std::int64_t> keys(contacts.size());
    const auto id = [&](std::int64_t i) { return ids.empty() ? i : ids[i]; };
    for (std::size_t c = 0; c < keys.size(); ++c)
        keys[c] = NUMBERS * id(contacts.first[c]) + (std::int64_t(c) < contacts.pairs ? id(contacts.second[c]) : WALL + contacts.second[c]);
    return keys;
}

Carried carried_over(std::span<const std::int64_t> keys, In values, std::span<const std::int64_t> wanted) {
    Carried carried{Vector(wanted.size(), 0.0)};
    std::size_t at = 0;
    for (std::size_t c = 0; c < wanted.size(); ++c) {
        while (at < keys.size() && keys[at] < wanted[c]) ++at;
        if (at < keys.size() && keys[at] == wanted[c]) carried.values[c] = values[at], ++carried.matched;
    }
    return carried;
}

static ContactPairs find_periodic_contact_pairs(In position, In radius, Segments walls, double max_gap, std::span<const Index> body);

ContactPairs find_contact_pairs(In position, In radius, const Segments& walls, double max_gap, std::span<const Index> body) {
    if (walls.period > 0.0 && radius.size()) return find_periodic_contact_pairs(position, radius, walls, max_gap, body);
    ContactPairs found;
    const std::size_t room = 3 * radius.size() + 64;
    found.first.reserve(room), found.second.reserve(room), found.vector.reserve(2 * room);
    found.distance.reserve(room), found.gap.reserve(room);
    if (radius.size() > 1 && !find_pairs(found, position, radius, max_gap, body)) {
        found.pairs = -1;
        return found;
    }
    found.pairs = std::int64_t(found.size());
    if (walls.w) find_walls(found, position, radius, walls, max_gap);
    return found;
}

ContactPairs find_wall_contacts(In position, In radius, const Segments& walls, double max_gap) {
    ContactPairs found;
    find_walls(found, position, radius, walls, max_gap);
    return found;
}

// With a period: of disks at their places in it, and of pairs also with images of the first disks behind its end.
static ContactPairs find_periodic_contact_pairs(In position, In radius, Segments walls, double max_gap, std::span<const Index> body) {
    const std::size_t n = radius.size();
    const double low = walls.low, period = std::exchange(walls.period, 0.0);
    Vector wrapped(position.begin(), position.end()), size(radius.begin(), radius.end());
    for (std::size_t i = 0; i < n; ++i) wrapped[2 * i] -= period * std::floor((wrapped[2 * i] - low) / period);
    ContactPairs at_walls;
    if (walls.w) find_walls(at_walls, wrapped, radius, walls, max_gap);
    const double reach = (2.0 * *std::max_element(radius.begin(), radius.end()) + max_gap) * MARGIN;
    Indices image, whose(body.begin(), body.end());
    for (std::size_t i = 0; i < n; ++i)
        if (wrapped[2 * i] <= low + reach) {
            image.push_back(Index(i)), size.push_back(radius[i]);
            if (!body.empty()) whose.push_back(body[i]);
            wrapped.push_back(wrapped[2 * i] + period), wrapped.push_back(wrapped[2 * i + 1]);
        }
    walls.w = 0;
    ContactPairs found = find_contact_pairs(wrapped, size, walls, max_gap, whose);
    if (found.pairs < 0) return found;
    std::vector<std::tuple<std::int64_t, std::int64_t, std::size_t>> rows;
    for (std::size_t c = 0; c < found.size(); ++c) {
        const std::int64_t a = found.first[c], b = found.second[c] < std::int64_t(n) ? found.second[c] : image[found.second[c] - n];
        if (a < std::int64_t(n) && a != b) rows.emplace_back(std::min(a, b), std::max(a, b), c);
    }
    std::sort(rows.begin(), rows.end());
    ContactPairs all;
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
