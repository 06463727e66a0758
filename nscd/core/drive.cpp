#include "drive.hpp"

#include <algorithm>

#include "contacts.hpp"
#include "rounding.hpp"
#include "soft.hpp"

namespace nscd {

namespace {

constexpr double FROM_PEOPLE = 5.0, PEOPLE_DECAY = 0.1, FROM_WALLS = 5.0, WALL_DECAY = 0.05;  // repulsion in directions; m
constexpr double FADED = 10.0;   // decay lengths, where a repulsion ends
constexpr double ABREAST = 0.8;  // of the radii: who is less far beside the way is before me
constexpr double ASIDE = 0.3;    // of the repulsion of who comes towards me: so much to the right
constexpr double FAR = 1e28;     // m: a door that far is none, and people walk outward
constexpr int WAVES = 40;
constexpr double TURN = 6.283185307179586;

// A number of 64 random bits of others (SplitMix64).
std::uint64_t mixed(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}
struct Draws {
    std::uint64_t state;
    Draws(double seed, double of, double number) : state(mixed(mixed(mixed(bits(seed)) ^ bits(of)) ^ bits(number))) {}
    static std::uint64_t bits(double whole) { return std::uint64_t(std::int64_t(whole)); }
    double uniform() { return double((state = mixed(state)) >> 11) * 0x1p-53; }
    // as the sum of twelve, of which every processor knows the same digits
    double normal() {
        double sum = -6.0;
        for (int i = 0; i < 12; ++i) sum += uniform();
        return sum;
    }
};

// e^−t, |t| ≤ 64, as a series at t/64 and six squares.
double decayed(double t) {
    const double q = t / 64.0;
    double sum = 1.0;
    for (int i = 12; i > 0; --i) sum = 1.0 - q / i * sum;
    for (int i = 0; i < 6; ++i) sum *= sum;
    return sum;
}

}  // namespace

void Drive::keep(const Distance& law) {
    law_ = law, waves_.clear();
    if (!(law.jostling > 0.0)) return;
    Draws draw(law.seed, -1.0, 0.0);
    for (int k = 0; k < WAVES; ++k) {
        Wave wave{draw.normal() / law.length, draw.normal() / law.length, draw.normal() * TURN / law.period, {}, {}};
        for (int a = 0; a < 2; ++a) {
            const Turn phase = turn_by(TURN * draw.uniform());
            wave.cosine[a] = phase.cosine, wave.sine[a] = phase.sine;
        }
        waves_.push_back(wave);
    }
}

int Drive::corner_of(const double* at, int door) const {
    if (grid.empty()) return 0;
    const double column = std::floor((at[0] - grid[0]) / grid[2]), row = std::floor((at[1] - grid[1]) / grid[2]);
    if (!(column >= 0.0 && column < grid[4] && row >= 0.0 && row < grid[3])) return 0;
    return std::max(0, int(next[std::size_t((door * grid[3] + row) * grid[4] + column)]));
}

Drive::Leg Drive::leg(const double* at, int door) const {
    const double* of = &exits[8 * door];
    const int corner = corner_of(at, door);
    if (corner == 0) return {{of[0], of[1]}, {of[2], of[3]}, {of[4], of[5]}, {of[6], of[7]}, false};
    const double x = corners[2 * corner], y = corners[2 * corner + 1];
    return {{x, y}, {x, y}, {1.0, 0.0}, {1e30, 1e30}, true};
}

Numbers Drive::wished(In x, double time) const {
    Numbers u(x.size(), 0.0);
    const double none[2] = {0.0, 0.0};
    for (std::size_t i = 0; 2 * i < x.size(); ++i) {
        if (time >= stop[i] - INSTANT) continue;
        const Leg to = leg(&x[2 * i], int(goes[i]));
        const Out mine(&u[2 * i], 2);
        if (grid.empty()) headed(In(&x[2 * i], 2), to.start, to.end, to.outward, to.place, speed, mine);
        else add_drive(mine, In(&x[2 * i], 2), In(none, 2), speed, 1.0, to.start, to.end, to.place, to.outward);
    }
    return u;
}

// The way (m) that is left from a place: 0 at the door, below beyond it.
double Drive::left(double x, double y, int door) const {
    const double at[2] = {x, y};
    if (const int corner = corner_of(at, door)) return length(corners[2 * corner] - x, corners[2 * corner + 1] - y) + onward[door * (corners.size() / 2) + corner];
    const double* of = &exits[8 * door];
    if (std::abs(of[6]) + std::abs(of[7]) > FAR) return -(x * of[4] + y * of[5]);
    const double beyond = (x - of[6]) * of[4] + (y - of[7]) * of[5];
    if (beyond >= 0.0) return -beyond;
    const double ax = of[2] - of[0], ay = of[3] - of[1], square = ax * ax + ay * ay;
    const double part = square > 0.0 ? std::clamp(((x - of[0]) * ax + (y - of[1]) * ay) / square, 0.0, 1.0) : 0.0;
    return length(of[0] + part * ax - x, of[1] + part * ay - y);
}

// The straight way of somebody who keeps clear of the posts of a door: to it, or first to a place from which it is 45° aslant, and
// from beside it along its line.
void Drive::heading(const double* at, int door, double radius, bool round, double (&way)[2]) const {
    Leg to = leg(at, door);
    const double ex = to.end[0] - to.start[0], ey = to.end[1] - to.start[1], wide = length(ex, ey);
    if (to.corner || wide > FAR || !(left(at[0], at[1], door) > 0.0)) {
        headed(In(at, 2), to.start, to.end, to.outward, to.place, 1.0, Out(way, 2));
        return;
    }
    const double clear = wide > 0.0 ? std::min(0.5, radius / wide) : 0.0;
    const double along = wide > 0.0 ? ((at[0] - to.start[0]) * ex + (at[1] - to.start[1]) * ey) / (wide * wide) : 0.0;
    const double part = std::clamp(along, clear, 1.0 - clear);
    const double dx = to.start[0] + part * ex - at[0], dy = to.start[1] + part * ey - at[1];
    const double on = std::max(0.0, dx * to.outward[0] + dy * to.outward[1]);
    const double less = round ? std::min(on, length(dx - on * to.outward[0], dy - on * to.outward[1])) : 0.0;
    way[0] = dx - less * to.outward[0], way[1] = dy - less * to.outward[1];
}

void Drive::jostle(In x, const Flags& before, double time, Out u) const {
    Numbers added(x.size(), 0.0);
    for (const Wave& wave : waves_)
        for (std::size_t i = 0; 2 * i < x.size(); ++i) {
            if (!before[i]) continue;
            const double angle = wave.x * x[2 * i] + wave.y * x[2 * i + 1] - wave.turning * time;
            const Turn at = turn_by(angle - TURN * std::floor(angle / TURN + 0.5));
            for (int a = 0; a < 2; ++a) added[2 * i + a] += at.cosine * wave.cosine[a] - at.sine * wave.sine[a];
        }
    const double size = law_.jostling * std::sqrt(2.0 / WAVES);
    for (std::size_t c = 0; c < x.size(); ++c) u[c] += size * added[c];
}

Numbers Drive::desired(In x, In radius, double time) const {
    Numbers u = wished(x, time);
    if (!(law_.time_gap > 0.0)) return u;
    const std::size_t n = radius.size();
    const double most = std::max(FADED * PEOPLE_DECAY, speed * law_.time_gap);
    const Touching near = touching(x, radius, walls, most);
    Numbers e(2 * n), direction(2 * n), ahead(n, INFINITE), mine(n);
    Flags before(n, 0);
    // of both sides of each pair: whether a wall is between, or the other is nearer to the own goal
    const std::size_t pairs = near.pairs < 0 ? 0 : std::size_t(near.pairs);
    std::vector<std::size_t> of_walls(n + 1, 0);
    for (std::size_t c = pairs; c < near.size(); ++c) ++of_walls[near.first[c] + 1];
    for (std::size_t i = 0; i < n; ++i) of_walls[i + 1] += of_walls[i];
    const auto hidden = [&](std::size_t i, double dx, double dy) {
        const double px = x[2 * i], py = x[2 * i + 1];
        for (std::size_t c = pairs + of_walls[i]; c < pairs + of_walls[i + 1]; ++c) {
            const std::size_t w = 2 * (near.second[c]);
            const double ax = walls.along[w], ay = walls.along[w + 1], sx = walls.start[w] - px, sy = walls.start[w + 1] - py;
            const double side = (dx * sy - dy * sx) * (dx * (sy + ay) - dy * (sx + ax));
            const double other = (ax * -sy + ay * sx) * (ax * (dy - sy) - ay * (dx - sx));
            if (side < 0.0 && other < 0.0) return true;
        }
        return false;
    };
    for (std::size_t i = 0; i < n; ++i) {
        double way[2];
        heading(&x[2 * i], int(goes[i]), radius[i], true, way);
        if (hidden(i, way[0], way[1])) heading(&x[2 * i], int(goes[i]), radius[i], false, way);
        const double size = length(way[0], way[1]);
        for (int a = 0; a < 2; ++a) e[2 * i + a] = direction[2 * i + a] = size > 0.0 ? way[a] / size : 0.0;
        mine[i] = left(x[2 * i], x[2 * i + 1], int(goes[i]));
        before[i] = time < stop[i] - INSTANT && mine[i] > 0.0;
    }
    Flags seen(2 * pairs, 0);  // 0: hidden; 1: further from the own goal; 2: nearer
    const auto turn = [&](std::size_t i, double ux, double uy, double size, bool round) {
        const double against = round ? std::max(0.0, ux * e[2 * i] + uy * e[2 * i + 1]) : 0.0;
        direction[2 * i] -= size * (ux - against * e[2 * i]);
        direction[2 * i + 1] -= size * (uy - against * e[2 * i + 1]);
    };
    const auto aside = [&](std::size_t i, double ux, double uy, double size) {
        const double right = ASIDE * size * std::max(0.0, ux * e[2 * i] + uy * e[2 * i + 1]);
        direction[2 * i] += right * e[2 * i + 1], direction[2 * i + 1] -= right * e[2 * i];
    };
    for (std::size_t c = 0; c < near.size(); ++c) {
        const std::size_t i = std::size_t(near.first[c]), j = std::size_t(near.second[c]);
        const double dx = near.vector[2 * c], dy = near.vector[2 * c + 1], s = near.distance[c];
        if (!(s > 0.0)) continue;
        if (c >= pairs) {
            // walls turn people, and never back
            if (near.gap[c] < FADED * WALL_DECAY) turn(i, dx / s, dy / s, FROM_WALLS * decayed(near.gap[c] / WALL_DECAY), true);
            continue;
        }
        if (hidden(i, dx, dy) || hidden(j, -dx, -dy)) continue;
        const double size = near.gap[c] < FADED * PEOPLE_DECAY ? FROM_PEOPLE * decayed(near.gap[c] / PEOPLE_DECAY) : 0.0;
        const bool nearer = left(x[2 * i] + dx, x[2 * i + 1] + dy, int(goes[i])) < mine[i];
        const bool other = left(x[2 * j] - dx, x[2 * j + 1] - dy, int(goes[j])) < mine[j];
        seen[2 * c] = 1 + nearer, seen[2 * c + 1] = 1 + other;
        // who comes towards me turns me aside, to the right where he comes straight
        const bool towards = e[2 * i] * e[2 * j] + e[2 * i + 1] * e[2 * j + 1] < 0.0;
        turn(i, dx / s, dy / s, size, towards || !nearer), turn(j, -dx / s, -dy / s, size, towards || !other);
        if (towards) aside(i, dx / s, dy / s, size), aside(j, -dx / s, -dy / s, size);
    }
    for (std::size_t i = 0; i < n; ++i) {
        const double size = length(direction[2 * i], direction[2 * i + 1]);
        for (int a = 0; a < 2; ++a) direction[2 * i + a] = size > 0.0 ? direction[2 * i + a] / size : e[2 * i + a];
    }
    const auto stands_before = [&](std::size_t i, double dx, double dy, double wide, double gap) {
        const double nx = direction[2 * i], ny = direction[2 * i + 1];
        if (dx * nx + dy * ny >= 0.0 && std::abs(dx * ny - dy * nx) <= ABREAST * wide) ahead[i] = std::min(ahead[i], gap);
    };
    for (std::size_t c = 0; c < pairs; ++c) {
        const std::size_t i = std::size_t(near.first[c]), j = std::size_t(near.second[c]);
        const double dx = near.vector[2 * c], dy = near.vector[2 * c + 1];
        // nobody waits for who has stopped
        if (seen[2 * c] == 2 && time < stop[j] - INSTANT) stands_before(i, dx, dy, radius[i] + radius[j], near.gap[c]);
        if (seen[2 * c + 1] == 2 && time < stop[i] - INSTANT) stands_before(j, -dx, -dy, radius[i] + radius[j], near.gap[c]);
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (time >= stop[i] - INSTANT) continue;
        const double along = std::max(0.0, direction[2 * i] * e[2 * i] + direction[2 * i + 1] * e[2 * i + 1]);
        const double walked = along * std::min(speed, std::max(0.0, ahead[i]) / law_.time_gap);
        double own[2] = {walked * direction[2 * i], walked * direction[2 * i + 1]};
        // towards a wall nobody walks faster than its gap allows, along it as fast as else
        for (std::size_t c = pairs + of_walls[i]; c < pairs + of_walls[i + 1]; ++c) {
            const double s = near.distance[c], nx = near.vector[2 * c] / s, ny = near.vector[2 * c + 1] / s;
            const double into = own[0] * nx + own[1] * ny - std::max(0.0, near.gap[c]) / law_.time_gap;
            if (s > 0.0 && into > 0.0) own[0] -= into * nx, own[1] -= into * ny;
        }
        for (int a = 0; a < 2; ++a) own[a] = (1.0 - share[i]) * own[a] + share[i] * u[2 * i + a];
        if (law_.heading_sd > 0.0) {
            const double phase = Draws(law_.seed, ids[i], -1.0).uniform();
            const double held = std::floor((time + INSTANT) / law_.heading_hold + phase);
            const Turn by = turn_by(law_.heading_sd * Draws(law_.seed, ids[i], held).normal());
            u[2 * i] = by.cosine * own[0] - by.sine * own[1], u[2 * i + 1] = by.sine * own[0] + by.cosine * own[1];
        } else {
            u[2 * i] = own[0], u[2 * i + 1] = own[1];
        }
    }
    if (!waves_.empty()) jostle(x, before, time, u);
    return u;
}

}  // namespace nscd
