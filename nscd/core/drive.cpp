#include "drive.hpp"

#include <algorithm>
#include <cstring>
#include <tuple>
#include <utility>

#include "contacts.hpp"
#include "rounding.hpp"
#include "soft.hpp"

namespace nscd {

namespace {

constexpr double FROM_PEOPLE = 5.0, PEOPLE_DECAY = 0.1, FROM_WALLS = 5.0, WALL_DECAY = 0.05;  // repulsion in directions; m
constexpr double MEETING_DECAY = 0.3, SHUFFLE = 0.2;  // m; m, the least space before who meets somebody
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

// Many at once, four or eight of them in a vector where the machine has such, with the same bits.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__)
#define NSCD_WIDE [[gnu::target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")]]
#else
#define NSCD_WIDE
#endif

// Make vectors (k) m unit ones; the gaps (m) between disks of such radii (m), infinite where there is no direction.
NSCD_WIDE void spaced(std::size_t k, double* dx, double* dy, const double* one, const double* other, double* gap) {
    for (std::size_t c = 0; c < k; ++c) {
        const double s = length(dx[c], dy[c]);
        gap[c] = s > 0.0 ? s - one[c] - other[c] : INFINITE, dx[c] /= s, dy[c] /= s;
    }
}
NSCD_WIDE void repelled(std::size_t k, const double* gap, double* size) {
    for (std::size_t c = 0; c < k; ++c) size[c] = FROM_PEOPLE * decayed(std::min(gap[c] * (1.0 / PEOPLE_DECAY), FADED));
}

// Add cos and sin of k·q − ωt, turned by the phases of both components, of so many places (m).
template <class Wave>
NSCD_WIDE void wave_at(std::size_t k, const double* x, const double* y, const Wave& wave, double time, double* along, double* across) {
    for (std::size_t i = 0; i < k; ++i) {
        const Turn at = turned(wave.x * x[i] + wave.y * y[i] - wave.turning * time);
        along[i] += at.cosine * wave.cosine[0] - at.sine * wave.sine[0], across[i] += at.cosine * wave.cosine[1] - at.sine * wave.sine[1];
    }
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

// What somebody who keeps a distance sees of the others, and what comes of it.
struct Drive::Look {
    const Drive& of;
    const double time, most;
    const Numbers& x;
    const In radius;
    const std::size_t n = radius.size();
    Nearby near;
    Numbers vector, gaps;  // (k·2), (k) m, of those that are near; with a period alone
    Touching at;     // walls
    Starts of_walls = Starts(n + 1, 0);
    Numbers e = Numbers(2 * n), direction = Numbers(2 * n), ahead = Numbers(n, INFINITE), mine = Numbers(n);
    Flags before = Flags(n, 0), meets = Flags(n, 0);

    Look(const Drive& drive, const Numbers& places, In radii, double now)
        : of(drive), time(now), most(std::max(FADED * PEOPLE_DECAY, drive.speed * drive.law_.time_gap)), x(places), radius(radii) {
        if (of.walls.period > 0.0) {
            at = touching(x, radius, of.walls, most);
            near.start.assign(n + 1, 0);
            const auto pairs = std::size_t(std::max<std::int64_t>(at.pairs, 0));
            for (std::size_t c = 0; c < pairs; ++c) ++near.start[at.first[c] + 1], near.other.push_back(Index(at.second[c]));
            for (std::size_t i = 0; i < n; ++i) near.start[i + 1] += near.start[i];
            for (std::size_t c = 0; c < pairs; ++c) gaps.push_back(at.distance[c] > 0.0 ? at.gap[c] : INFINITE);
            vector = std::move(at.vector);
        } else {
            near = nearby(x, radius, most);
            near.start.resize(n + 1, 0);
        }
        at = touching_walls(x, radius, of.walls, most);
        for (const std::int64_t i : at.first) ++of_walls[i + 1];
        for (std::size_t i = 0; i < n; ++i) of_walls[i + 1] += of_walls[i];
    }

    bool hidden(std::size_t i, double dx, double dy) const {
        const Segments& walls = of.walls;
        const double px = x[2 * i], py = x[2 * i + 1];
        for (std::int64_t c = of_walls[i]; c < of_walls[i + 1]; ++c) {
            const std::size_t w = 2 * (at.second[c]);
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
    }
    bool visible(std::size_t i, std::size_t j, double dx, double dy) const { return !hidden(i, dx, dy) && !hidden(j, -dx, -dy); }
    // whether both have the same way left at the same place
    bool same(std::size_t i, std::size_t j) const { return of.goes[i] == of.goes[j] && !(of.walls.period > 0.0); }
    bool nearer(std::size_t i, std::size_t j, double dx, double dy) const {
        return (same(i, j) ? mine[j] : of.left(x[2 * i] + dx, x[2 * i + 1] + dy, int(of.goes[i]))) < mine[i];
    }
    bool meet(std::size_t i, std::size_t j, double dx, double dy) const {
        return !same(i, j) && e[2 * i] * e[2 * j] + e[2 * i + 1] * e[2 * j + 1] < 0.0 && nearer(i, j, dx, dy) && nearer(j, i, -dx, -dy);
    }

    void find_ways() {
        for (std::size_t i = 0; i < n; ++i) {
            double way[2];
            of.heading(&x[2 * i], int(of.goes[i]), radius[i], true, way);
            if (hidden(i, way[0], way[1])) of.heading(&x[2 * i], int(of.goes[i]), radius[i], false, way);
            const double size = length(way[0], way[1]);
            for (int a = 0; a < 2; ++a) e[2 * i + a] = direction[2 * i + a] = size > 0.0 ? way[a] / size : 0.0;
            mine[i] = of.left(x[2 * i], x[2 * i + 1], int(of.goes[i]));
            const double* exit = &of.exits[8 * int(of.goes[i])];
            before[i] = time < of.stop[i] - INSTANT && (mine[i] > 0.0 || std::abs(exit[6]) + std::abs(exit[7]) > FAR);
        }
    }
    void turn(std::size_t i, double ux, double uy, double size, bool round) {
        const double along = ux * e[2 * i] + uy * e[2 * i + 1], against = round && along > 0.0 ? along : 0.0;
        direction[2 * i] -= size * (ux - against * e[2 * i]);
        direction[2 * i + 1] -= size * (uy - against * e[2 * i + 1]);
    }
    // who meets somebody gives way, to the right where the other is not to the right, and goes aside for that
    void pass(std::size_t i, double dx, double dy, double wide, double size) {
        const double left = e[2 * i] * dy - e[2 * i + 1] * dx, free = std::max(0.0, 1.0 - std::abs(left) / wide);
        const double side = left >= 0.0 ? size * free : -size * free;
        direction[2 * i] += side * e[2 * i + 1], direction[2 * i + 1] -= side * e[2 * i];
        meets[i] = meets[i] || free > 0.0;
    }
    std::pair<double, double> to(std::size_t i, std::size_t c) const {
        if (!vector.empty()) return {vector[2 * c], vector[2 * c + 1]};
        const std::size_t j = std::size_t(near.other[c]);
        return {x[2 * j] - x[2 * i], x[2 * j + 1] - x[2 * i + 1]};
    }

    void give_way() {
        Numbers ux, uy, gap, one, other, size;
        for (std::size_t begin = 0, end; begin < n; begin = end) {
            end = std::min(n, begin + 64);
            const auto c0 = std::size_t(near.start[begin]), k = std::size_t(near.start[end]) - c0;
            for (Numbers* all : {&ux, &uy, &gap, &one, &other, &size}) all->resize(k);
            for (std::size_t i = begin, c = 0; i < end; ++i)
                for (; c0 + c < std::size_t(near.start[i + 1]); ++c) {
                    std::tie(ux[c], uy[c]) = to(i, c0 + c);
                    one[c] = radius[i], other[c] = radius[near.other[c0 + c]];
                }
            spaced(k, ux.data(), uy.data(), one.data(), other.data(), gap.data());
            if (!gaps.empty()) std::copy_n(&gaps[c0], k, gap.begin());
            repelled(k, gap.data(), size.data());
            for (std::size_t i = begin, c = 0; i < end; ++i)
                for (; c0 + c < std::size_t(near.start[i + 1]); ++c) {
                    if (!(gap[c] <= most)) continue;
                    const auto j = std::size_t(near.other[c0 + c]);
                    if (same(i, j)) {
                        if (!(gap[c] < FADED * PEOPLE_DECAY)) continue;
                        if ((of_walls[i] < of_walls[i + 1] || of_walls[j] < of_walls[j + 1])) {
                            const auto [dx, dy] = to(i, c0 + c);
                            if (!visible(i, j, dx, dy)) continue;
                        }
                        turn(i, ux[c], uy[c], size[c], !(mine[j] < mine[i])), turn(j, -ux[c], -uy[c], size[c], !(mine[i] < mine[j]));
                        continue;
                    }
                    const auto [dx, dy] = to(i, c0 + c);
                    if (meet(i, j, dx, dy)) {
                        const double wide = radius[i] + radius[j], aside = FROM_PEOPLE * decayed(std::min(gap[c] / MEETING_DECAY, FADED));
                        if (visible(i, j, dx, dy)) pass(i, dx, dy, wide, aside), pass(j, -dx, -dy, wide, aside);
                    } else if (gap[c] < FADED * PEOPLE_DECAY && visible(i, j, dx, dy)) {
                        turn(i, ux[c], uy[c], size[c], !nearer(i, j, dx, dy)), turn(j, -ux[c], -uy[c], size[c], !nearer(j, i, -dx, -dy));
                    }
                }
        }
        for (std::size_t c = 0; c < at.size(); ++c) {
            const double s = at.distance[c], size = FROM_WALLS * decayed(std::min(at.gap[c] * (1.0 / WALL_DECAY), FADED));
            // walls turn people, and never back
            if (s > 0.0 && at.gap[c] < FADED * WALL_DECAY) turn(std::size_t(at.first[c]), at.vector[2 * c] / s, at.vector[2 * c + 1] / s, size, true);
        }
        for (std::size_t i = 0; i < n; ++i) {
            const double size = length(direction[2 * i], direction[2 * i + 1]);
            for (int a = 0; a < 2; ++a) direction[2 * i + a] = size > 0.0 ? direction[2 * i + a] / size : e[2 * i + a];
        }
    }

    // how far i sees free way, whom j may be before; c: their pair
    void look(std::size_t i, std::size_t j, double dx, double dy, std::size_t c) {
        const double nx = direction[2 * i], ny = direction[2 * i + 1];
        if (!(dx * nx + dy * ny >= 0.0 && std::abs(dx * ny - dy * nx) <= ABREAST * (radius[i] + radius[j]))) return;
        const double s = length(dx, dy);
        double gap = gaps.empty() ? s - radius[std::min(i, j)] - radius[std::max(i, j)] : gaps[c];
        if (!(s > 0.0 && gap <= most)) return;
        if (gap < SHUFFLE && meet(i, j, dx, dy)) gap = SHUFFLE;
        // nobody waits for who has stopped
        if (gap < ahead[i] && time < of.stop[j] - INSTANT && nearer(i, j, dx, dy) && visible(i, j, dx, dy)) ahead[i] = gap;
    }
    void look_ahead() {
        for (std::size_t i = 0; i < n; ++i)
            for (auto c = std::size_t(near.start[i]); c < std::size_t(near.start[i + 1]); ++c) {
                const auto j = std::size_t(near.other[c]);
                const auto [dx, dy] = to(i, c);
                if (same(i, j)) {
                    const bool on = mine[j] < mine[i];
                    look(on ? i : j, on ? j : i, on ? dx : -dx, on ? dy : -dy, c);
                } else {
                    look(i, j, dx, dy, c), look(j, i, -dx, -dy, c);
                }
            }
    }

    void walk(Numbers& u) const {
        const Distance& law = of.law_;
        for (std::size_t i = 0; i < n; ++i) {
            if (time >= of.stop[i] - INSTANT) continue;
            const double along = meets[i] ? 1.0 : std::max(0.0, direction[2 * i] * e[2 * i] + direction[2 * i + 1] * e[2 * i + 1]);
            const double walked = along * std::min(of.speed, std::max(0.0, ahead[i]) / law.time_gap);
            double own[2] = {walked * direction[2 * i], walked * direction[2 * i + 1]};
            // towards a wall nobody walks faster than its gap allows, along it as fast as else
            for (std::int64_t c = of_walls[i]; c < of_walls[i + 1]; ++c) {
                const double s = at.distance[c], nx = at.vector[2 * c] / s, ny = at.vector[2 * c + 1] / s;
                const double into = own[0] * nx + own[1] * ny - std::max(0.0, at.gap[c]) / law.time_gap;
                if (s > 0.0 && into > 0.0) own[0] -= into * nx, own[1] -= into * ny;
            }
            for (int a = 0; a < 2; ++a) own[a] = (1.0 - of.share[i]) * own[a] + of.share[i] * u[2 * i + a];
            if (law.heading_sd > 0.0) {
                const double phase = Draws(law.seed, of.ids[i], -1.0).uniform();
                const double held = std::floor((time + INSTANT) / law.heading_hold + phase);
                const Turn by = turn_by(law.heading_sd * Draws(law.seed, of.ids[i], held).normal());
                u[2 * i] = by.cosine * own[0] - by.sine * own[1], u[2 * i + 1] = by.sine * own[0] + by.cosine * own[1];
            } else {
                u[2 * i] = own[0], u[2 * i + 1] = own[1];
            }
        }
    }

    void jostle(Numbers& u) const {
        const double size = of.law_.jostling * std::sqrt(2.0 / WAVES);
        constexpr std::size_t BLOCK = 256;
        double px[BLOCK], py[BLOCK], along[BLOCK], across[BLOCK];
        for (std::size_t begin = 0, k; begin < n; begin += k) {
            k = std::min(BLOCK, n - begin);
            for (std::size_t i = 0; i < k; ++i) px[i] = x[2 * (begin + i)], py[i] = x[2 * (begin + i) + 1], along[i] = across[i] = 0.0;
            for (const Wave& wave : of.waves_) wave_at(k, px, py, wave, time, along, across);
            for (std::size_t i = 0; i < k; ++i)
                if (before[begin + i]) u[2 * (begin + i)] += size * along[i], u[2 * (begin + i) + 1] += size * across[i];
        }
    }
};

Numbers Drive::desired(In at, In radius, double time) const {
    Numbers x(at.begin(), at.end());
    if (walls.period > 0.0)
        for (std::size_t i = 0; i < x.size(); i += 2) x[i] -= walls.period * std::floor((x[i] - walls.low) / walls.period);
    Numbers u = wished(x, time);
    if (!(law_.time_gap > 0.0)) return u;
    Look look(*this, x, radius, time);
    look.find_ways(), look.give_way(), look.look_ahead(), look.walk(u);
    if (!waves_.empty()) look.jostle(u);
    return u;
}

}  // namespace nscd
