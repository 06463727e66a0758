#include "drive.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "contacts.hpp"
#include "rounding.hpp"
#include "soft.hpp"

namespace nscd {

namespace {

constexpr double FROM_PEOPLE = 5.0, PEOPLE_DECAY = 0.1, FROM_WALLS = 5.0, WALL_DECAY = 0.05;  // repulsion in directions; m
constexpr double SEEN = 3.0, BESIDE = 1.0;    // m: so far ahead, and so little beside the way, people come towards me
constexpr double ASIDE = 2.0, SHUFFLE = 0.2;  // of the way, to the right; m, the least space before who meets somebody
constexpr double FADED = 10.0;   // decay lengths, where a repulsion ends
constexpr double ABREAST = 0.8;  // of the radii: who is less far beside the way is before me
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
inline double decayed(double t) {
    static constexpr double PART[] = {1.0, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8, 1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12};
    const double q = t / 64.0;
    double sum = 1.0;
    for (int i = 11; i >= 0; --i) sum = 1.0 - q * PART[i] * sum;
    for (int i = 0; i < 6; ++i) sum *= sum;
    return sum;
}

// As turn_by, of any angle, without a branch: the compiler does several at once.
inline Turn turned(double angle) {
    constexpr double WHOLE = 6755399441055744.0;  // added and taken away, it rounds to whole numbers
    const double a = (angle - TURN * ((angle * (1.0 / TURN) + WHOLE) - WHOLE)) * (1.0 / 32), q = a * a;
    double sine = a * (1.0 - q * (1.0 / 6) * (1.0 - q * (1.0 / 20) * (1.0 - q * (1.0 / 42) * (1.0 - q * (1.0 / 72)))));
    double less = 0.5 * q * (1.0 - q * (1.0 / 12) * (1.0 - q * (1.0 / 30) * (1.0 - q * (1.0 / 56) * (1.0 - q * (1.0 / 90)))));
    for (int doublings = 5; doublings > 0; --doublings) {
        const double half = sine;
        sine = 2.0 * half * (1.0 - less), less = 2.0 * half * half;
    }
    return {1.0 - less, sine};
}

}  // namespace

std::optional<Drive> Drive::of(In numbers) {
    constexpr std::size_t HEAD = 7, LAW = sizeof(Distance) / sizeof(double);
    if (numbers.size() < HEAD + LAW) return {};
    const double doors = numbers[0], people = numbers[1], walls = numbers[2], k = numbers[3];
    if (!(doors >= 0.0 && people >= 0.0 && walls >= 0.0 && k >= 0.0)) return {};
    double whole = double(HEAD + LAW) + 4 * walls + 8 * doors + 4 * people, cells = 0.0;
    if (k > 0.0) {
        if (!(whole + 5 <= double(numbers.size()))) return {};
        cells = doors * numbers[std::size_t(whole) + 3] * numbers[std::size_t(whole) + 4];
        whole += 5 + cells + 2 * k + doors * k;
    }
    if (whole != double(numbers.size())) return {};
    std::size_t at = HEAD + LAW;
    const auto taken = [&](double count) {
        const In some = numbers.subspan(std::exchange(at, at + std::size_t(count)), std::size_t(count));
        return Numbers(some.begin(), some.end());
    };
    Drive drive;
    drive.walls = connected(taken(4 * walls), numbers[4], numbers[5]), drive.speed = numbers[6];
    drive.exits = taken(8 * doors), drive.goes = taken(people), drive.stop = taken(people), drive.ids = taken(people), drive.share = taken(people);
    if (k > 0.0) drive.grid = taken(5), drive.next = taken(cells), drive.corners = taken(2 * k), drive.onward = taken(doors * k);
    for (const double door : drive.goes)
        if (!(door >= 0.0 && door < doors)) return {};
    for (const double corner : drive.next)
        if (!(corner < k)) return {};
    Distance law;
    std::memcpy(static_cast<void*>(&law), &numbers[HEAD], sizeof law);
    drive.keep(law);
    return drive;
}

void Drive::keep(const Distance& law) {
    law_ = law, waves_.clear();
    if (!(law.jostling > 0.0)) return;
    Draws draw(law.seed, -1.0, 0.0);
    for (int k = 0; k < WAVES; ++k) {
        Wave wave{draw.normal() / law.length, draw.normal() / law.length, draw.normal() * TURN / law.period, {}, {}};
        // as often as they fit into a period
        if (walls.period > 0.0) wave.x = TURN / walls.period * std::floor(wave.x * walls.period / TURN + 0.5);
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
    const std::size_t n = before.size();
    Numbers along(n, 0.0), across(n, 0.0);
    for (const Wave& wave : waves_)
        for (std::size_t i = 0; i < n; ++i) {
            const Turn at = turned(wave.x * x[2 * i] + wave.y * x[2 * i + 1] - wave.turning * time);
            along[i] += at.cosine * wave.cosine[0] - at.sine * wave.sine[0], across[i] += at.cosine * wave.cosine[1] - at.sine * wave.sine[1];
        }
    const double size = law_.jostling * std::sqrt(2.0 / WAVES);
    for (std::size_t i = 0; i < n; ++i)
        if (before[i]) u[2 * i] += size * along[i], u[2 * i + 1] += size * across[i];
}

// How much (n) each keeps to the right, 0 to 1, for people who come: each is before the other, and no wall is between.
Numbers Drive::aside(In x, In radius, In e, In mine) const {
    Numbers much(radius.size(), 0.0);
    if (std::adjacent_find(goes.begin(), goes.end(), std::not_equal_to<>()) == goes.end()) return much;
    Segments none;
    none.low = walls.low, none.period = walls.period;
    const Places together(goes.begin(), goes.end());
    const Touching far = touching(x, radius, none, SEEN, together);
    const auto hidden = [&](double px, double py, double dx, double dy) {
        for (std::size_t w = 0; w < walls.start.size(); w += 2) {
            const double ax = walls.along[w], ay = walls.along[w + 1], sx = walls.start[w] - px, sy = walls.start[w + 1] - py;
            const double side = (dx * sy - dy * sx) * (dx * (sy + ay) - dy * (sx + ax));
            if (side < 0.0 && (ax * -sy + ay * sx) * (ax * (dy - sy) - ay * (dx - sx)) < 0.0) return true;
        }
        return false;
    };
    for (std::int64_t c = 0; c < far.pairs; ++c) {
        const std::size_t i = std::size_t(far.first[c]), j = std::size_t(far.second[c]);
        const double dx = far.vector[2 * c], dy = far.vector[2 * c + 1];
        if (e[2 * i] * e[2 * j] + e[2 * i + 1] * e[2 * j + 1] >= 0.0) continue;
        const auto on_way = [&](std::size_t k) {
            return std::abs(dx * e[2 * k + 1] - dy * e[2 * k]) < BESIDE && (k == i ? 1.0 : -1.0) * (dx * e[2 * k] + dy * e[2 * k + 1]) > 0.0;
        };
        const bool of_i = much[i] < 1.0 && on_way(i), of_j = much[j] < 1.0 && on_way(j);
        if (!of_i && !of_j) continue;
        if (!(left(x[2 * i] + dx, x[2 * i + 1] + dy, int(goes[i])) < mine[i] && left(x[2 * j] - dx, x[2 * j + 1] - dy, int(goes[j])) < mine[j])) continue;
        if (hidden(x[2 * i], x[2 * i + 1], dx, dy)) continue;
        const double near = 1.0 - far.gap[c] / SEEN;
        if (of_i) much[i] = std::min(1.0, much[i] + near);
        if (of_j) much[j] = std::min(1.0, much[j] + near);
    }
    return much;
}

Numbers Drive::desired(In at, In radius, double time) const {
    Numbers x(at.begin(), at.end());
    if (walls.period > 0.0)
        for (std::size_t i = 0; i < x.size(); i += 2) x[i] -= walls.period * std::floor((x[i] - walls.low) / walls.period);
    Numbers u = wished(x, time);
    if (!(law_.time_gap > 0.0)) return u;
    const std::size_t n = radius.size();
    const double most = std::max(FADED * PEOPLE_DECAY, speed * law_.time_gap);
    const Touching near = touching(x, radius, walls, most);
    Numbers e(2 * n), direction(2 * n), ahead(n, INFINITE), mine(n);
    Flags before(n, 0);
    const std::size_t pairs = near.pairs < 0 ? 0 : std::size_t(near.pairs);
    std::vector<std::size_t> of_walls(n + 1, 0);
    for (std::size_t c = pairs; c < near.size(); ++c) ++of_walls[near.first[c] + 1];
    for (std::size_t i = 0; i < n; ++i) of_walls[i + 1] += of_walls[i];
    const auto hidden = [&](std::size_t i, double dx, double dy) {
        const double px = x[2 * i], py = x[2 * i + 1];
        for (std::size_t c = pairs + of_walls[i]; c < pairs + of_walls[i + 1]; ++c) {
            const std::size_t w = 2 * (near.second[c]);
            const double ax = walls.along[w], ay = walls.along[w + 1], sy = walls.start[w + 1] - py;
            for (const double round : {0.0, walls.period, -walls.period}) {
                const double sx = walls.start[w] + round - px;
                const double side = (dx * sy - dy * sx) * (dx * (sy + ay) - dy * (sx + ax));
                const double other = (ax * -sy + ay * sx) * (ax * (dy - sy) - ay * (dx - sx));
                if (side < 0.0 && other < 0.0) return true;
                if (!(walls.period > 0.0)) break;
            }
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
        const double* of = &exits[8 * int(goes[i])];
        before[i] = time < stop[i] - INSTANT && (mine[i] > 0.0 || std::abs(of[6]) + std::abs(of[7]) > FAR);
    }
    const auto nearer = [&](std::size_t i, std::size_t j, double dx, double dy) {
        const bool same = goes[i] == goes[j] && !(walls.period > 0.0);
        return (same ? mine[j] : left(x[2 * i] + dx, x[2 * i + 1] + dy, int(goes[i]))) < mine[i];
    };
    const auto turn = [&](std::size_t i, double ux, double uy, double size, bool round) {
        const double against = round ? std::max(0.0, ux * e[2 * i] + uy * e[2 * i + 1]) : 0.0;
        direction[2 * i] -= size * (ux - against * e[2 * i]);
        direction[2 * i + 1] -= size * (uy - against * e[2 * i + 1]);
    };
    const auto endless = [&](std::size_t i) { return std::abs(exits[8 * int(goes[i]) + 6]) + std::abs(exits[8 * int(goes[i]) + 7]) > FAR; };
    const auto meet = [&](std::size_t i, std::size_t j, double dx, double dy) {
        return e[2 * i] * e[2 * j] + e[2 * i + 1] * e[2 * j + 1] < 0.0 && nearer(i, j, dx, dy) && nearer(j, i, -dx, -dy);
    };
    const auto visible = [&](std::size_t i, std::size_t j, double dx, double dy) { return !hidden(i, dx, dy) && !hidden(j, -dx, -dy); };
    // several at once, which branches would not let the compiler do
    Numbers repelled(near.size());
    for (std::size_t c = 0; c < pairs; ++c) repelled[c] = FROM_PEOPLE * decayed(std::min(near.gap[c] * (1.0 / PEOPLE_DECAY), FADED));
    for (std::size_t c = pairs; c < near.size(); ++c) repelled[c] = FROM_WALLS * decayed(std::min(near.gap[c] * (1.0 / WALL_DECAY), FADED));
    for (std::size_t c = 0; c < near.size(); ++c) {
        const std::size_t i = std::size_t(near.first[c]), j = std::size_t(near.second[c]);
        const double dx = near.vector[2 * c], dy = near.vector[2 * c + 1], s = near.distance[c];
        if (!(s > 0.0)) continue;
        const double ux = dx / s, uy = dy / s, gap = near.gap[c];
        if (c >= pairs) {
            // walls turn people, and never back
            if (gap < FADED * WALL_DECAY) turn(i, ux, uy, repelled[c], true);
        } else if (gap < FADED * PEOPLE_DECAY && !meet(i, j, dx, dy) && visible(i, j, dx, dy)) {
            turn(i, ux, uy, repelled[c], !nearer(i, j, dx, dy)), turn(j, -ux, -uy, repelled[c], !nearer(j, i, -dx, -dy));
        }
    }
    // who sees people come keeps to the right, and goes aside for that
    const Numbers to_right = aside(x, radius, e, mine);
    for (std::size_t i = 0; i < n; ++i) {
        if (to_right[i] > 0.0) direction[2 * i] += ASIDE * to_right[i] * e[2 * i + 1], direction[2 * i + 1] -= ASIDE * to_right[i] * e[2 * i];
        const double size = length(direction[2 * i], direction[2 * i + 1]);
        for (int a = 0; a < 2; ++a) direction[2 * i + a] = size > 0.0 ? direction[2 * i + a] / size : e[2 * i + a];
    }
    const auto before_me = [&](std::size_t i, double dx, double dy, double wide, double gap) {
        const double nx = direction[2 * i], ny = direction[2 * i + 1];
        return gap < ahead[i] && dx * nx + dy * ny >= 0.0 && std::abs(dx * ny - dy * nx) <= ABREAST * wide;
    };
    const auto look = [&](std::size_t i, std::size_t j, double dx, double dy, double gap) {
        // of two who meet, who has the longer way left waits, and the other shuffles on
        if (gap < SHUFFLE && meet(i, j, dx, dy) && (mine[i] <= mine[j] || endless(i) || endless(j))) gap = SHUFFLE;
        // nobody waits for who has stopped
        if (before_me(i, dx, dy, radius[i] + radius[j], gap) && time < stop[j] - INSTANT && nearer(i, j, dx, dy) && visible(i, j, dx, dy)) ahead[i] = gap;
    };
    for (std::size_t c = 0; c < pairs; ++c) {
        const std::size_t i = std::size_t(near.first[c]), j = std::size_t(near.second[c]);
        const double dx = near.vector[2 * c], dy = near.vector[2 * c + 1], gap = near.gap[c];
        if (near.distance[c] > 0.0) look(i, j, dx, dy, gap), look(j, i, -dx, -dy, gap);
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (time >= stop[i] - INSTANT) continue;
        const double along = to_right[i] > 0.0 ? 1.0 : std::max(0.0, direction[2 * i] * e[2 * i] + direction[2 * i + 1] * e[2 * i + 1]);
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
