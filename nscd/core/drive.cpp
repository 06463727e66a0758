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
constexpr double CLOSE = 0.25;   // m: who is before me is mostly as near
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
    double normal() {
        double one;
        normals(1, &state, &one);
        return one;
    }
    // One of each of many states, as the sum of twelve, of which every processor knows the same digits.
    static void normals(std::size_t k, std::uint64_t* state, double* sum) {
        std::fill_n(sum, k, -6.0);
        for (int i = 0; i < 12; ++i)
            for (std::size_t c = 0; c < k; ++c) sum[c] += double((state[c] = mixed(state[c])) >> 11) * 0x1p-53;
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
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__) && __GNUC__ >= 12
#define NSCD_WIDE [[gnu::target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")]]
#else
#define NSCD_WIDE
#endif

// What somebody with the way e turns by who is repelled along −u, never back or back as well.
struct Aside { double x, y; };
inline Aside aside(double ux, double uy, double ex, double ey, double size, bool never_back) {
    const double along = ux * ex + uy * ey, against = never_back && along > 0.0 ? along : 0.0;
    return {size * (ux - against * ex), size * (uy - against * ey)};
}

// Some pairs of people, one and another. In place of vectors (m) between them and of both their ways come unit vectors, and by what
// they turn; gaps (m) are known with a period alone, and infinite where there is no direction.
struct Pairs {
    static constexpr std::size_t MOST = 128;  // so many are in the cache together
    using Part = double[MOST];
    Part x, y, gap, size, radius, radius_other, way_x, way_y, left, way_x_other, way_y_other, left_other;
    std::size_t one[MOST];
};
NSCD_WIDE void repel(std::size_t k, bool known, Pairs& p) {
    for (std::size_t c = 0; c < k; ++c) {
        const double s = length(p.x[c], p.y[c]), gap = s > 0.0 ? s - p.radius[c] - p.radius_other[c] : INFINITE;
        p.gap[c] = known ? p.gap[c] : gap, p.x[c] /= s, p.y[c] /= s;
    }
    for (std::size_t c = 0; c < k; ++c) p.size[c] = FROM_PEOPLE * decayed(std::min(p.gap[c] * (1.0 / PEOPLE_DECAY), FADED));
    for (std::size_t c = 0; c < k; ++c) {
        const Aside a = aside(p.x[c], p.y[c], p.way_x[c], p.way_y[c], p.size[c], !(p.left_other[c] < p.left[c]));
        p.way_x[c] = a.x, p.way_y[c] = a.y;
    }
    for (std::size_t c = 0; c < k; ++c) {
        const Aside b = aside(-p.x[c], -p.y[c], p.way_x_other[c], p.way_y_other[c], p.size[c], !(p.left[c] < p.left_other[c]));
        p.way_x_other[c] = b.x, p.way_y_other[c] = b.y;
    }
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
    const std::size_t n = x.size() / 2;
    Numbers u(x.size(), 0.0);
    const double none[2] = {0.0, 0.0};
    for (std::size_t i = 0, end; i < n; i = end) {
        const auto same = [&](std::size_t j) { return grid.empty() && goes[j] == goes[i]; };
        for (end = i + 1; end < n && same(end);) ++end;
        const Leg to = leg(&x[2 * i], int(goes[i]));
        const In place = x.subspan(2 * i, 2 * (end - i));
        const Out mine(&u[2 * i], place.size());
        if (grid.empty()) headed(place, to.start, to.end, to.outward, to.place, speed, mine);
        else add_drive(mine, place, In(none, 2), speed, 1.0, to.start, to.end, to.place, to.outward);
    }
    for (std::size_t i = 0; i < n; ++i)
        if (time >= stop[i] - INSTANT) u[2 * i] = u[2 * i + 1] = 0.0;
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
void Drive::heading(const double* at, int door, double left, double radius, bool round, double (&way)[2]) const {
    Leg to = leg(at, door);
    const double ex = to.end[0] - to.start[0], ey = to.end[1] - to.start[1], wide = length(ex, ey);
    if (to.corner || wide > FAR || !(left > 0.0)) {
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
    // what pairs ask of somebody: m, unit vectors of the straight way and of the walk, what is left (m)
    struct Person { double x, y, e[2], walk[2], mine, radius; };
    struct Pair { Index one, other; std::int64_t number; };
    const Drive& of;
    const In x, radius;
    const double time, most = std::max(FADED * PEOPLE_DECAY, of.speed * of.law_.time_gap);
    const std::size_t n = radius.size();
    const bool round = of.walls.period > 0.0, alike = !round && of.exits.size() == 8;
    Nearby near;
    Numbers vector;            // (k·2) m, of those that are near; with a period alone
    Room gaps;                 // (k) m
    std::vector<Pair> close;   // of those that are
    Touching at;           // walls
    Starts of_walls = Starts(n + 1, 0);
    std::vector<Person, Aligned<Person>> people = std::vector<Person, Aligned<Person>>(n);
    Numbers ahead = Numbers(n, INFINITE);
    Numbers to_right = Numbers(n, 0.0);
    Flags before = Flags(n, 0), walled = Flags(n, 0);

    Look(const Drive& drive, In places, In radii, double now) : of(drive), x(places), radius(radii), time(now) {
        if (round) {
            at = touching(x, radius, of.walls, most);
            near.start.assign(n + 1, 0);
            for (std::int64_t c = 0; c < at.pairs; ++c) {
                ++near.start[at.first[c] + 1], near.other.push_back(Index(at.second[c]));
                gaps.push_back(at.distance[c] > 0.0 ? at.gap[c] : INFINITE);
            }
            for (std::size_t i = 0; i < n; ++i) near.start[i + 1] += near.start[i];
            vector = std::move(at.vector);
        } else {
            near = nearby(x, radius, most);
            near.start.resize(n + 1, 0), gaps.resize(near.other.size());
        }
        at = touching_walls(x, radius, of.walls, most);
        for (const std::int64_t i : at.first) ++of_walls[i + 1], walled[i] = 1;
        for (std::size_t i = 0; i < n; ++i) of_walls[i + 1] += of_walls[i];
        find_ways();
    }

    bool hidden(std::size_t i, double dx, double dy) const {
        const Segments& walls = of.walls;
        const double px = x[2 * i], py = x[2 * i + 1];
        for (std::int64_t c = of_walls[i]; c < of_walls[i + 1]; ++c) {
            const std::size_t w = 2 * (at.second[c]);
            const double ax = walls.along[w], ay = walls.along[w + 1], sy = walls.start[w + 1] - py;
            for (const double past : {0.0, walls.period, -walls.period}) {
                const double sx = walls.start[w] + past - px;
                const double side = (dx * sy - dy * sx) * (dx * (sy + ay) - dy * (sx + ax));
                const double other = (ax * -sy + ay * sx) * (ax * (dy - sy) - ay * (dx - sx));
                if (side < 0.0 && other < 0.0) return true;
                if (!round) break;
            }
        }
        return false;
    }
    bool visible(std::size_t i, std::size_t j, double dx, double dy) const {
        return !(walled[i] | walled[j]) || (!hidden(i, dx, dy) && !hidden(j, -dx, -dy));
    }
    // whether both have the same way left at the same place
    bool same(std::size_t i, std::size_t j) const { return alike || (of.goes[i] == of.goes[j] && !round); }
    bool nearer(std::size_t i, std::size_t j, double dx, double dy) const {
        return (same(i, j) ? people[j].mine : of.left(x[2 * i] + dx, x[2 * i + 1] + dy, int(of.goes[i]))) < people[i].mine;
    }
    bool endless(std::size_t i) const { return std::abs(of.exits[8 * int(of.goes[i]) + 6]) + std::abs(of.exits[8 * int(of.goes[i]) + 7]) > FAR; }
    bool meet(std::size_t i, std::size_t j, double dx, double dy) const {
        const Person &a = people[i], &b = people[j];
        return !same(i, j) && a.e[0] * b.e[0] + a.e[1] * b.e[1] < 0.0 && nearer(i, j, dx, dy) && nearer(j, i, -dx, -dy);
    }
    std::pair<double, double> to(const Person& a, const Person& b, std::size_t c) const {
        if (round) return {vector[2 * c], vector[2 * c + 1]};
        return {b.x - a.x, b.y - a.y};
    }

    void find_ways() {
        for (std::size_t i = 0; i < n; ++i) {
            const double *exit = &of.exits[8 * int(of.goes[i])], left = of.left(x[2 * i], x[2 * i + 1], int(of.goes[i]));
            double way[2];
            of.heading(&x[2 * i], int(of.goes[i]), left, radius[i], true, way);
            if (hidden(i, way[0], way[1])) of.heading(&x[2 * i], int(of.goes[i]), left, radius[i], false, way);
            const double size = length(way[0], way[1]);
            for (double& one : way) one = size > 0.0 ? one / size : 0.0;
            people[i] = {x[2 * i], x[2 * i + 1], {way[0], way[1]}, {way[0], way[1]}, left, radius[i]};
            before[i] = time < of.stop[i] - INSTANT && (left > 0.0 || std::abs(exit[6]) + std::abs(exit[7]) > FAR);
        }
    }

    static void turn(Person& one, double ux, double uy, double size, bool never_back) {
        const Aside by = aside(ux, uy, one.e[0], one.e[1], size, never_back);
        one.walk[0] -= by.x, one.walk[1] -= by.y;
    }
    // How much each keeps to the right, 0 to 1, for people who come: each is before the other, and no wall is between.
    void find_coming() {
        if (std::adjacent_find(of.goes.begin(), of.goes.end(), std::not_equal_to<>()) == of.goes.end()) return;
        Segments none;
        none.low = of.walls.low, none.period = of.walls.period;
        const Places together(of.goes.begin(), of.goes.end());  // who have one goal do not meet
        const Touching far = touching(x, radius, none, SEEN, together);
        for (std::int64_t c = 0; c < far.pairs; ++c) {
            const std::size_t i = std::size_t(far.first[c]), j = std::size_t(far.second[c]);
            const Person &a = people[i], &b = people[j];
            const double dx = far.vector[2 * c], dy = far.vector[2 * c + 1];
            if (a.e[0] * b.e[0] + a.e[1] * b.e[1] >= 0.0) continue;
            const auto on_way = [&](const Person& me, double sign) {
                return std::abs(dx * me.e[1] - dy * me.e[0]) < BESIDE && sign * (dx * me.e[0] + dy * me.e[1]) > 0.0;
            };
            const bool of_i = to_right[i] < 1.0 && on_way(a, 1.0), of_j = to_right[j] < 1.0 && on_way(b, -1.0);
            if (!of_i && !of_j) continue;
            if (!(of.left(x[2 * i] + dx, x[2 * i + 1] + dy, int(of.goes[i])) < a.mine && of.left(x[2 * j] - dx, x[2 * j + 1] - dy, int(of.goes[j])) < b.mine)) continue;
            if (behind_any(a.x, a.y, dx, dy)) continue;
            const double close_by = 1.0 - far.gap[c] / SEEN;
            if (of_i) to_right[i] = std::min(1.0, to_right[i] + close_by);
            if (of_j) to_right[j] = std::min(1.0, to_right[j] + close_by);
        }
    }
    bool behind_any(double px, double py, double dx, double dy) const {
        const Segments& walls = of.walls;
        for (std::size_t w = 0; w < walls.start.size(); w += 2) {
            const double ax = walls.along[w], ay = walls.along[w + 1], sx = walls.start[w] - px, sy = walls.start[w + 1] - py;
            const double side = (dx * sy - dy * sx) * (dx * (sy + ay) - dy * (sx + ax));
            if (side < 0.0 && (ax * -sy + ay * sx) * (ax * (dy - sy) - ay * (dx - sx)) < 0.0) return true;
        }
        return false;
    }
    // of people who have not the same way; u: from i to j, c: their pair
    void turn_both(std::size_t i, std::size_t j, std::size_t c, double ux, double uy, double gap, double size) {
        Person &a = people[i], &b = people[j];
        const auto [dx, dy] = to(a, b, c);
        if (gap < FADED * PEOPLE_DECAY && !meet(i, j, dx, dy) && visible(i, j, dx, dy)) {
            turn(a, ux, uy, size, !nearer(i, j, dx, dy)), turn(b, -ux, -uy, size, !nearer(j, i, -dx, -dy));
        }
    }
    void give_way() {
        Pairs p;
        std::size_t i = 0;
        for (std::size_t c0 = 0, k = 0; c0 < near.other.size(); c0 += k) {
            k = std::min(Pairs::MOST, near.other.size() - c0);
            for (std::size_t c = 0; c < k; ++c) {
                while (c0 + c >= std::size_t(near.start[i + 1])) ++i;
                const Person &a = people[i], &b = people[near.other[c0 + c]];
                const auto [dx, dy] = to(a, b, c0 + c);
                p.one[c] = i, p.x[c] = dx, p.y[c] = dy, p.radius[c] = a.radius, p.radius_other[c] = b.radius;
                p.way_x[c] = a.e[0], p.way_y[c] = a.e[1], p.left[c] = a.mine;
                p.way_x_other[c] = b.e[0], p.way_y_other[c] = b.e[1], p.left_other[c] = b.mine;
            }
            if (round) std::copy_n(&gaps[c0], k, p.gap);
            repel(k, round, p);
            for (std::size_t c = 0; c < k; ++c) {
                const std::size_t one = p.one[c], other = std::size_t(near.other[c0 + c]);
                const double gap = gaps[c0 + c] = p.gap[c];
                if (gap <= CLOSE) close.push_back({Index(one), Index(other), std::int64_t(c0 + c)});
                if (!(gap <= most)) continue;
                if (!same(one, other)) {
                    turn_both(one, other, c0 + c, p.x[c], p.y[c], gap, p.size[c]);
                } else if (gap < FADED * PEOPLE_DECAY) {
                    Person &a = people[one], &b = people[other];
                    if (!visible(one, other, b.x - a.x, b.y - a.y)) continue;
                    a.walk[0] -= p.way_x[c], a.walk[1] -= p.way_y[c];
                    b.walk[0] -= p.way_x_other[c], b.walk[1] -= p.way_y_other[c];
                }
            }
        }
        for (std::size_t c = 0; c < at.size(); ++c) {
            const double s = at.distance[c], wall = FROM_WALLS * decayed(std::min(at.gap[c] * (1.0 / WALL_DECAY), FADED));
            // walls turn people, and never back
            if (s > 0.0 && at.gap[c] < FADED * WALL_DECAY) turn(people[at.first[c]], at.vector[2 * c] / s, at.vector[2 * c + 1] / s, wall, true);
        }
        // who sees people come keeps to the right, and goes aside for that
        find_coming();
        for (std::size_t i = 0; i < n; ++i) {
            Person& one = people[i];
            if (to_right[i] > 0.0) one.walk[0] += ASIDE * to_right[i] * one.e[1], one.walk[1] -= ASIDE * to_right[i] * one.e[0];
            const double all = length(one.walk[0], one.walk[1]);
            for (int a = 0; a < 2; ++a) one.walk[a] = all > 0.0 ? one.walk[a] / all : one.e[a];
        }
    }

    // how far i sees free way, whom j may be before
    void look(std::size_t i, std::size_t j, double dx, double dy, double gap) {
        const Person &me = people[i], &other = people[j];
        const double nx = me.walk[0], ny = me.walk[1];
        if (!((dx * nx + dy * ny >= 0.0) & (std::abs(dx * ny - dy * nx) <= ABREAST * (me.radius + other.radius)))) return;
        // of two who meet, who has the longer way left waits, and the other shuffles on
        if (gap < SHUFFLE && meet(i, j, dx, dy) && (me.mine <= other.mine || endless(i) || endless(j))) gap = SHUFFLE;
        // nobody waits for who has stopped
        if (gap < ahead[i] && time < of.stop[j] - INSTANT && nearer(i, j, dx, dy) && visible(i, j, dx, dy)) ahead[i] = gap;
    }
    void look(const Pair& pair) {
        const auto i = std::size_t(pair.one), j = std::size_t(pair.other), c = std::size_t(pair.number);
        const auto [dx, dy] = to(people[i], people[j], c);
        const bool on = people[j].mine < people[i].mine;
        const double sign = on ? 1.0 : -1.0;
        if (same(i, j)) look(on ? i : j, on ? j : i, sign * dx, sign * dy, gaps[c]);
        else look(i, j, dx, dy, gaps[c]), look(j, i, -dx, -dy, gaps[c]);
    }
    // first at who is close, behind whom few others have to be looked at
    void look_ahead() {
        for (const Pair& pair : close) look(pair);
        Flags open(n);
        for (std::size_t i = 0; i < n; ++i) open[i] = ahead[i] > CLOSE;
        for (std::size_t i = 0; i < n; ++i)
            for (auto c = std::size_t(near.start[i]); c < std::size_t(near.start[i + 1]); ++c)
                if (const auto j = std::size_t(near.other[c]); open[i] | open[j])
                    if (gaps[c] > CLOSE && gaps[c] <= most && (gaps[c] < ahead[i] || gaps[c] < ahead[j])) look({Index(i), Index(j), std::int64_t(c)});
    }

    // by what people turn aside from where they want to walk
    std::vector<Turn> turns() const {
        const Distance& law = of.law_;
        std::vector<std::uint64_t> state(n);
        Numbers normal(n);
        for (std::size_t i = 0; i < n; ++i) {
            const double phase = Draws(law.seed, of.ids[i], -1.0).uniform();
            state[i] = Draws(law.seed, of.ids[i], std::floor((time + INSTANT) / law.heading_hold + phase)).state;
        }
        constexpr std::size_t SOME = 64;
        for (std::size_t i = 0; i < n; i += SOME) Draws::normals(std::min(SOME, n - i), &state[i], &normal[i]);
        std::vector<Turn> all(n);
        for (std::size_t i = 0; i < n; ++i) all[i] = turn_by(law.heading_sd * normal[i]);
        return all;
    }
    void walk(Numbers& u) const {
        const Distance& law = of.law_;
        const std::vector<Turn> by = law.heading_sd > 0.0 ? turns() : std::vector<Turn>();
        for (std::size_t i = 0; i < n; ++i) {
            if (time >= of.stop[i] - INSTANT) continue;
            const Person& me = people[i];
            const double along = to_right[i] > 0.0 ? 1.0 : std::max(0.0, me.walk[0] * me.e[0] + me.walk[1] * me.e[1]);
            const double walked = along * std::min(of.speed, std::max(0.0, ahead[i]) / law.time_gap);
            double own[2] = {walked * me.walk[0], walked * me.walk[1]};
            // towards a wall nobody walks faster than its gap allows, along it as fast as else
            for (std::int64_t c = of_walls[i]; c < of_walls[i + 1]; ++c) {
                const double s = at.distance[c], nx = at.vector[2 * c] / s, ny = at.vector[2 * c + 1] / s;
                const double into = own[0] * nx + own[1] * ny - std::max(0.0, at.gap[c]) / law.time_gap;
                if (s > 0.0 && into > 0.0) own[0] -= into * nx, own[1] -= into * ny;
            }
            for (int a = 0; a < 2; ++a) own[a] = (1.0 - of.share[i]) * own[a] + of.share[i] * u[2 * i + a];
            u[2 * i] = own[0], u[2 * i + 1] = own[1];
            if (!by.empty()) u[2 * i] = by[i].cosine * own[0] - by[i].sine * own[1], u[2 * i + 1] = by[i].sine * own[0] + by[i].cosine * own[1];
        }
    }
    void jostle(Numbers& u) const {
        const double size = of.law_.jostling * std::sqrt(2.0 / WAVES);
        constexpr std::size_t SOME = 256;
        double px[SOME], py[SOME], along[SOME], across[SOME];
        for (std::size_t begin = 0, k; begin < n; begin += k) {
            k = std::min(SOME, n - begin);
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
    Look all(*this, x, radius, time);
    all.give_way(), all.look_ahead(), all.walk(u);
    if (!waves_.empty()) all.jostle(u);
    return u;
}

}  // namespace nscd
