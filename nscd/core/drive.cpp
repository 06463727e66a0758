#include "drive.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "contacts.hpp"
#include "levels.hpp"
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
    static std::uint64_t bits(double integer) { return std::uint64_t(std::int64_t(integer)); }
    double uniform() { return double((state = mixed(state)) >> 11) * 0x1p-53; }
    double normal() {
        double one;
        normals(1, &state, &one);
        return one;
    }
    // One of each of many states, as the sum of twelve, of which every processor knows the same digits.
    LEVELS static void normals(std::size_t k, std::uint64_t* state, double* sum) {
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
    // twice the sine and twice 1 − cos
    double sine = 2.0 * (a * (1.0 - q * (1.0 / 6) * (1.0 - q * (1.0 / 20) * (1.0 - q * (1.0 / 42) * (1.0 - q * (1.0 / 72))))));
    double less = q * (1.0 - q * (1.0 / 12) * (1.0 - q * (1.0 / 30) * (1.0 - q * (1.0 / 56) * (1.0 - q * (1.0 / 90)))));
    for (int doublings = 5; doublings > 0; --doublings) {
        const double half = sine;
        sine = half * (2.0 - less), less = half * half;
    }
    return {0.5 * (2.0 - less), 0.5 * sine};
}

// What somebody with the way e turns by who is repelled along −u, never back or back as well.
struct Aside { double x, y; };
inline Aside aside(double ux, double uy, double ex, double ey, double size, bool never_back) {
    const double along = ux * ex + uy * ey, against = never_back && along > 0.0 ? along : 0.0;
    return {size * (ux - against * ex), size * (uy - against * ey)};
}

// Some people in the order of their numbers: where they are, or how far from somebody (m), what is left (m), and radii (m), negative
// of who is before somebody in number. Behind the last is room for those that a vector also takes, whose answers are no matter.
constexpr std::size_t LANES = 8, WORD = 64;
struct Some {
    AlignedVector x, y, left, radius;
    Indices number;
    std::vector<std::uint64_t> odd;  // a bit for each who has to be looked at one by one
    void make_room(std::size_t k) {
        if (number.size() >= k + WORD) return;
        for (AlignedVector* one : {&x, &y, &left, &radius}) one->resize(k + WORD);
        number.resize(k + WORD), odd.resize(k / WORD + 1);
    }
};
constexpr auto BIT = [] {
    std::array<std::uint64_t, WORD> bits{};
    for (std::size_t c = 0; c < WORD; ++c) bits[c] = std::uint64_t{1} << c;
    return bits;
}();
// Which of k from `first` on are within reach (m) of the place (x0, y0): a bit for each.
LEVELS std::uint64_t within(std::size_t k, const Some& some, std::size_t first, double x0, double y0, double reach) {
    const double *const x = &some.x[first], *const y = &some.y[first], *const radius = &some.radius[first];
    std::uint64_t bits = 0;
    k = (k + LANES - 1) / LANES * LANES;
    for (std::size_t c = 0; c < k; ++c) {
        const double dx = x[c] - x0, dy = y[c] - y0, distance = (radius[c] + reach) * MARGIN;
        const std::uint64_t bit = dx * dx + dy * dy <= distance * distance ? BIT[c] : 0;
        bits += bit;
    }
    return bits;
}
// What somebody sees: gaps (m), infinite where there is no direction, by what others turn him, and gaps of who is on his way, else infinite.
struct Seen { AlignedVector gap, turn_x, turn_y, free; };
using Apart = const double* __restrict__;  // arrays of which none overlaps another, without which nothing is done at once
using Filled = double* __restrict__;
struct Mine { double left, radius, e[2]; };
// Gaps, unless they are known, and turns. Of two radii that of the first in number is taken away first.
LEVELS void repel(std::size_t k, Apart x, Apart y, Apart left, Apart radius, bool has_velocity, const Mine& me, Filled gap, Filled size, Filled to_x, Filled to_y) {
    const Mine mine = me;
    k = (k + LANES - 1) / LANES * LANES;
    for (std::size_t c = 0; c < k; ++c) {
        const bool before = radius[c] < 0.0;
        const double s = length(x[c], y[c]), one = before ? -radius[c] : mine.radius, two = before ? mine.radius : radius[c];
        const double distance = s > 0.0 ? s - one - two : INFINITE;
        gap[c] = has_velocity ? gap[c] : distance, to_x[c] = x[c] / s, to_y[c] = y[c] / s;
    }
    for (std::size_t c = 0; c < k; ++c) size[c] = FROM_PEOPLE * decayed(std::min(gap[c] * (1.0 / PEOPLE_DECAY), FADED));
    for (std::size_t c = 0; c < k; ++c) {
        const Aside by = aside(to_x[c], to_y[c], mine.e[0], mine.e[1], size[c], !(left[c] < mine.left));
        to_x[c] = by.x, to_y[c] = by.y;
    }
    for (std::size_t c = 0; c < k; ++c) {
        const bool turns = gap[c] < FADED * PEOPLE_DECAY;
        to_x[c] = turns ? to_x[c] : 0.0, to_y[c] = turns ? to_y[c] : 0.0;
    }
}
// Who is on the way along n; the least gap (m) of those who have less left.
LEVELS double find_before(std::size_t k, Apart x, Apart y, Apart left, Apart radius, Apart gap, double max_gap, const Mine& me, const double* n, Filled on_way) {
    const double nx = n[0], ny = n[1];
    const Mine mine = me;
    double minimum[LANES];
    std::fill_n(minimum, LANES, INFINITE);
    for (std::size_t c0 = 0; c0 < k; c0 += LANES)
        for (std::size_t c = c0; c < c0 + LANES; ++c) {
            const bool on = (x[c] * nx + y[c] * ny >= 0.0) & (std::abs(x[c] * ny - y[c] * nx) <= ABREAST * (mine.radius + std::abs(radius[c])));
            on_way[c] = (on & (gap[c] <= max_gap)) ? gap[c] : INFINITE;
            const double free = left[c] < mine.left ? on_way[c] : INFINITE;
            minimum[c - c0] = free < minimum[c - c0] ? free : minimum[c - c0];
        }
    return *std::min_element(minimum, minimum + LANES);
}

// Add cos and sin of k·q − ωt, turned by the phases of both components, of so many places (m).
template <class Wave>
LEVELS void wave_at(std::size_t k, const double* x, const double* y, const Wave& wave, double time, double* along, double* across) {
    for (std::size_t i = 0; i < k; ++i) {
        const Turn at = turned(wave.x * x[i] + wave.y * y[i] - wave.turning * time);
        along[i] += at.cosine * wave.cosine[0] - at.sine * wave.sine[0], across[i] += at.cosine * wave.cosine[1] - at.sine * wave.sine[1];
    }
}

}  // namespace

std::optional<Drive> Drive::of(In values) {
    constexpr std::size_t HEAD = 7, LAW = sizeof(Distance) / sizeof(double);
    if (values.size() < HEAD + LAW) return {};
    const double doors = values[0], people = values[1], walls = values[2], k = values[3];
    if (!(doors >= 0.0 && people >= 0.0 && walls >= 0.0 && k >= 0.0)) return {};
    double expected = double(HEAD + LAW) + 4 * walls + 8 * doors + 4 * people, cells = 0.0;
    if (k > 0.0) {
        if (!(expected + 5 <= double(values.size()))) return {};
        cells = doors * values[std::size_t(expected) + 3] * values[std::size_t(expected) + 4];
        expected += 5 + cells + 2 * k + doors * k;
    }
    if (expected != double(values.size())) return {};
    std::size_t at = HEAD + LAW;
    const auto read = [&](double count) {
        const In some = values.subspan(std::exchange(at, at + std::size_t(count)), std::size_t(count));
        return Vector(some.begin(), some.end());
    };
    Drive drive;
    drive.walls = connected(read(4 * walls), values[4], values[5]), drive.speed = values[6];
    drive.exits = read(8 * doors), drive.goes = read(people), drive.stop = read(people), drive.ids = read(people), drive.fraction = read(people);
    if (k > 0.0) drive.grid = read(5), drive.next = read(cells), drive.corners = read(2 * k), drive.onward = read(doors * k);
    for (const double door : drive.goes)
        if (!(door >= 0.0 && door < doors)) return {};
    for (const double corner : drive.next)
        if (!(corner < k)) return {};
    Distance law;
    std::memcpy(static_cast<void*>(&law), &values[HEAD], sizeof law);
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

Vector Drive::wished(In x, double time) const {
    const std::size_t n = x.size() / 2;
    Vector u(x.size(), 0.0);
    const double none[2] = {0.0, 0.0};
    for (std::size_t i = 0, end; i < n; i = end) {
        const auto same = [&](std::size_t j) { return grid.empty() && goes[j] == goes[i]; };
        for (end = i + 1; end < n && same(end);) ++end;
        const Leg to = leg(&x[2 * i], int(goes[i]));
        const In position = x.subspan(2 * i, 2 * (end - i));
        const Out mine(&u[2 * i], position.size());
        if (grid.empty()) headed(position, to.start, to.end, to.outward, to.line_point, speed, mine);
        else add_drive(mine, position, In(none, 2), speed, 1.0, to.start, to.end, to.line_point, to.outward);
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
    const double ex = to.end[0] - to.start[0], ey = to.end[1] - to.start[1], width = length(ex, ey);
    if (to.corner || width > FAR || !(left > 0.0)) {
        headed(In(at, 2), to.start, to.end, to.outward, to.line_point, 1.0, Out(way, 2));
        return;
    }
    const double clear = width > 0.0 ? std::min(0.5, radius / width) : 0.0;
    const double along = width > 0.0 ? ((at[0] - to.start[0]) * ex + (at[1] - to.start[1]) * ey) / (width * width) : 0.0;
    const double part = std::clamp(along, clear, 1.0 - clear);
    const double dx = to.start[0] + part * ex - at[0], dy = to.start[1] + part * ey - at[1];
    const double on = std::max(0.0, dx * to.outward[0] + dy * to.outward[1]);
    const double less = round ? std::min(on, length(dx - on * to.outward[0], dy - on * to.outward[1])) : 0.0;
    way[0] = dx - less * to.outward[0], way[1] = dy - less * to.outward[1];
}

// What somebody who keeps a distance sees of the others, and what comes of it.
struct Drive::View {
    // what pairs ask of somebody: m, unit vectors of the straight way and of the walk, what is left (m)
    struct Person { double x, y, e[2], walk[2], mine, radius; };
    const Drive& of;
    const In x, radius;
    const double time, turning = FADED * PEOPLE_DECAY, max_gap = std::max(turning, of.speed * of.law_.time_gap);
    const std::size_t n = radius.size();
    const bool round = of.walls.period > 0.0, alike = !round && of.exits.size() == 8;
    Around neighbours;
    ContactPairs pairs;            // with a period, in place of it
    Some others;               // whom one sees
    Seen visited;
    bool all_alike = false;    // whether all those go to one's door, and nobody has stopped or is near a wall
    ContactPairs at;           // walls
    Starts of_walls = Starts(n + 1, 0);
    std::vector<Person, Aligned<Person>> people = std::vector<Person, Aligned<Person>>(n);
    Vector ahead = Vector(n, INFINITE);
    Vector to_right = Vector(n, 0.0);
    Mask before = Mask(n, 0), walled = Mask(n, 0), usual = Mask(n, 0);

    View(const Drive& drive, In positions, In radii, double now) : of(drive), x(positions), radius(radii), time(now) {
        if (round) pairs = find_contact_pairs(x, radius, of.walls, max_gap);
        else neighbours = around(x, radius, max_gap);
        at = find_wall_contacts(x, radius, of.walls, max_gap);
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
    void find_ways() {
        for (std::size_t i = 0; i < n; ++i) {
            const double *exit = &of.exits[8 * int(of.goes[i])], left = of.left(x[2 * i], x[2 * i + 1], int(of.goes[i]));
            double way[2];
            of.heading(&x[2 * i], int(of.goes[i]), left, radius[i], true, way);
            if (hidden(i, way[0], way[1])) of.heading(&x[2 * i], int(of.goes[i]), left, radius[i], false, way);
            const double size = length(way[0], way[1]);
            for (double& one : way) one = size > 0.0 ? one / size : 0.0;
            people[i] = {x[2 * i], x[2 * i + 1], {way[0], way[1]}, {way[0], way[1]}, left, radius[i]};
            usual[i] = !walled[i] && time < of.stop[i] - INSTANT;
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
        const Indices goal_of(of.goes.begin(), of.goes.end());  // who have one goal do not meet
        const ContactPairs far = find_contact_pairs(x, radius, none, SEEN, goal_of);
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
    void make_room(std::size_t k) {
        others.make_room(k);
        for (AlignedVector* one : {&visited.gap, &visited.turn_x, &visited.turn_y, &visited.free}) one->resize(others.x.size());
    }
    Mine see(std::size_t i, std::size_t k) {
        const Person& me = people[i];
        const Mine mine{me.mine, me.radius, {me.e[0], me.e[1]}};
        std::fill_n(&others.left[k], LANES, INFINITE);  // who is not there is before nobody
        const Some& o = others;
        repel(k, &o.x[0], &o.y[0], &o.left[0], &o.radius[0], round, mine, &visited.gap[0], &visited.free[0], &visited.turn_x[0], &visited.turn_y[0]);
        return mine;
    }
    void look_around(std::size_t i, std::size_t k) {
        Person& me = people[i];
        const Mine mine = see(i, k);
        if (all_alike) {
            double x = me.walk[0], y = me.walk[1];
            for (std::size_t c = 0; c < k; ++c) x -= visited.turn_x[c], y -= visited.turn_y[c];
            me.walk[0] = x, me.walk[1] = y;
        } else {
            turn_one_by_one(i, k);
        }
        for (std::int64_t c = of_walls[i]; c < of_walls[i + 1]; ++c) {
            const double s = at.distance[c], wall = FROM_WALLS * decayed(std::min(at.gap[c] * (1.0 / WALL_DECAY), FADED));
            // walls turn people, and never back
            if (s > 0.0 && at.gap[c] < FADED * WALL_DECAY) turn(me, at.vector[2 * c] / s, at.vector[2 * c + 1] / s, wall, true);
        }
        // who sees people come keeps to the right, and goes aside for that
        if (to_right[i] > 0.0) me.walk[0] += ASIDE * to_right[i] * me.e[1], me.walk[1] -= ASIDE * to_right[i] * me.e[0];
        const double all = length(me.walk[0], me.walk[1]);
        for (int a = 0; a < 2; ++a) me.walk[a] = all > 0.0 ? me.walk[a] / all : me.e[a];
        look_ahead(i, k, mine);
    }
    void look_ahead(std::size_t i, std::size_t k, const Mine& mine) {
        const Person& me = people[i];
        const Some& o = others;
        const double minimum = find_before(k, &o.x[0], &o.y[0], &o.left[0], &o.radius[0], &visited.gap[0], max_gap, mine, me.walk, &visited.free[0]);
        if (all_alike) ahead[i] = minimum;
        for (std::size_t c = 0; c < k && !all_alike; ++c)
            if (visited.free[c] < ahead[i]) anticipate(i, std::size_t(others.number[c]), others.x[c], others.y[c], visited.free[c]);
    }
    void turn_one_by_one(std::size_t i, std::size_t k) {
        Person& me = people[i];
        for (std::size_t c = 0; c < k; ++c) {
            const auto j = std::size_t(others.number[c]);
            const double dx = others.x[c], dy = others.y[c];
            if (!(visited.gap[c] < FADED * PEOPLE_DECAY) || !visible(i, j, dx, dy)) continue;
            if (same(i, j)) {
                me.walk[0] -= visited.turn_x[c], me.walk[1] -= visited.turn_y[c];
            } else if (!meet(i, j, dx, dy)) {
                const double s = length(dx, dy), size = FROM_PEOPLE * decayed(std::min(visited.gap[c] * (1.0 / PEOPLE_DECAY), FADED));
                turn(me, dx / s, dy / s, size, !nearer(i, j, dx, dy));
            }
        }
    }
    // how far i sees free way, whom j may be before
    void anticipate(std::size_t i, std::size_t j, double dx, double dy, double gap) {
        const Person &me = people[i], &other = people[j];
        // of two who meet, who has the longer way left waits, and the other shuffles on
        if (gap < SHUFFLE && meet(i, j, dx, dy) && (me.mine <= other.mine || endless(i) || endless(j))) gap = SHUFFLE;
        // nobody waits for who has stopped
        if (gap < ahead[i] && time < of.stop[j] - INSTANT && nearer(i, j, dx, dy) && visible(i, j, dx, dy)) ahead[i] = gap;
    }
    void look_round() {
        std::vector<std::vector<std::size_t>> mine(n);  // pairs of each, which so come by the number of the other
        for (std::size_t c = 0; std::int64_t(c) < pairs.pairs; ++c)
            for (const std::int64_t i : {pairs.first[c], pairs.second[c]}) mine[std::size_t(i)].push_back(c);
        for (std::size_t i = 0; i < n; ++i) {
            std::size_t k = 0;
            make_room(mine[i].size());
            for (const std::size_t c : mine[i]) {
                const bool first = pairs.first[c] == std::int64_t(i);
                const double sign = first ? 1.0 : -1.0;
                const Index j = Index(first ? pairs.second[c] : pairs.first[c]);
                visited.gap[k] = pairs.distance[c] > 0.0 ? pairs.gap[c] : INFINITE;
                others.x[k] = sign * pairs.vector[2 * c], others.y[k] = sign * pairs.vector[2 * c + 1];
                others.left[k] = people[j].mine, others.radius[k] = people[j].radius, others.number[k++] = j;
            }
            look_around(i, k);
        }
    }
    void look_by_squares() {
        Some some;
        Indices here;  // whose square it is
        for (std::size_t square = 0; square + 1 < neighbours.start.size(); ++square) {
            const Index* const number = neighbours.disk.data() + neighbours.start[square];
            const auto k = std::size_t(neighbours.start[square + 1] - neighbours.start[square]);
            if (here.size() < k) here.resize(k), some.make_room(k), make_room(k);
            std::size_t size = 0;
            for (std::size_t c = 0; c < k; ++c) here[size] = Index(c), size += neighbours.square[number[c]] == Index(square);
            std::fill(some.odd.begin(), some.odd.end(), 0);
            for (std::size_t c = 0; c < k && size > 0; ++c) {
                const auto j = std::size_t(number[c]);
                const Person& other = people[j];
                some.number[c] = number[c], some.x[c] = other.x, some.y[c] = other.y, some.left[c] = other.mine, some.radius[c] = other.radius;
                if (!usual[j] || !same(std::size_t(number[here[0]]), j)) some.odd[c / WORD] |= BIT[c % WORD];
            }
            for (std::size_t h = 0; h < size; ++h) {
                const auto one = std::size_t(here[h]), i = std::size_t(number[one]);
                look_around(i, pick(some, k, one, turning));
                // who is farther turns nobody
                if (max_gap > turning && ahead[i] > turning) {
                    const std::size_t more = pick(some, k, one, max_gap);
                    look_ahead(i, more, see(i, more));
                }
            }
        }
    }
    // Take those to whom one of some people may have a gap of at most so many m; how many.
    std::size_t pick(const Some& some, std::size_t k, std::size_t one, double far) {
        const double *const x = &some.x[0], *const y = &some.y[0], *const left = &some.left[0], *const radius = &some.radius[0];
        double *const dx = &others.x[0], *const dy = &others.y[0], *const lefts = &others.left[0], *const radii = &others.radius[0];
        const Index* const number = &some.number[0];
        Index* const who = &others.number[0];
        const double x0 = x[one], y0 = y[one], reach = radius[one] + far, here = double(one);
        std::size_t count = 0;
        all_alike = !(some.odd[one / WORD] & BIT[one % WORD]);
        for (std::size_t begin = 0; begin < k; begin += WORD) {
            std::uint64_t bits = within(std::min(k - begin, WORD), some, begin, x0, y0, reach);
            if (k - begin < WORD) bits &= BIT[k - begin] - 1;
            if (begin == one / WORD * WORD) bits &= ~BIT[one % WORD];
            all_alike &= !(bits & some.odd[begin / WORD]);
            for (; bits; bits &= bits - 1, ++count) {
                const std::size_t c = begin + std::size_t(std::countr_zero(bits));
                dx[count] = x[c] - x0, dy[count] = y[c] - y0, lefts[count] = left[c], who[count] = number[c];
                radii[count] = std::copysign(radius[c], double(c) - here);
            }
        }
        return count;
    }
    void look_ahead() {
        // who sees people come keeps to the right, and goes aside for that
        find_coming();
        if (round) look_round();
        else look_by_squares();
    }

    // by what people turn aside from where they want to walk
    std::vector<Turn> turns() const {
        const Distance& law = of.law_;
        std::vector<std::uint64_t> state(n);
        Vector normal(n);
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
    void walk(Vector& u) const {
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
            for (int a = 0; a < 2; ++a) own[a] = (1.0 - of.fraction[i]) * own[a] + of.fraction[i] * u[2 * i + a];
            u[2 * i] = own[0], u[2 * i + 1] = own[1];
            if (!by.empty()) u[2 * i] = by[i].cosine * own[0] - by[i].sine * own[1], u[2 * i + 1] = by[i].sine * own[0] + by[i].cosine * own[1];
        }
    }
    void jostle(Vector& u) const {
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

Vector Drive::desired(In at, In radius, double time) const {
    Vector x(at.begin(), at.end());
    if (walls.period > 0.0)
        for (std::size_t i = 0; i < x.size(); i += 2) x[i] -= walls.period * std::floor((x[i] - walls.low) / walls.period);
    Vector u = wished(x, time);
    if (!(law_.time_gap > 0.0)) return u;
    View all(*this, x, radius, time);
    all.look_ahead(), all.walk(u);
    if (!waves_.empty()) all.jostle(u);
    return u;
}

}  // namespace nscd
