// A crowd in a page: nscd's motion and its sums of a window, for WebAssembly.
#include "drive.hpp"
#include "motion.hpp"
#include "impulse_sums.hpp"

#define EXPORT(name) extern "C" [[gnu::used, clang::export_name(#name)]]

namespace {

using namespace nscd;

constexpr double RENEWED = 0.05, NOWHERE = 1e30, LARGEST_WHOLE = 9007199254740991.0;
constexpr double OPENING = 1e-6, PROVEN = 1e-7, STEEP = 1e5;  // m/s over the largest; m/s where 1 is asked for

// What the page fills, by number. SI units.
enum Part { POSITION, VELOCITY, SPIN, RADIUS, MASS, GOES, STOP, SHARE, IDS, EXITS, GRID, NEXT, CORNERS, ONWARD, WALLS, LAW, DISTANCE, CONTACTS, RESTING, PARTS };
// LAW: the numbers of `Law` (no τ: no drive), the speed of the drive, the period's low end and length (0: none). GOES to ONWARD as in
// `Drive`; DISTANCE: the numbers of `Distance`.
enum { TAU = 1, SPEED = 9, LOW, PERIOD };
constexpr int MOST = 1 << 24, OF_DISTANCE = 7;  // numbers of a part, and of that one
struct Whole {
    Motion crowd;
    Drive drive;
    Vector others[PARTS];
    WindowSums sums{0};
    Report last;         // the last step
    bool begun = false;  // whether the parts were found right since they were filled
    Vector wanted;      // m/s, desired velocities (n·2) of who keep their distance
    int steps = 0, looked = -1;  // since the window began; after how many of these they looked
} state, saved_state;
auto& [crowd, drive, others, sums, last, begun, wanted, steps, looked] = state;
ImpactProblem resting;  // contacts of the last step that stay closed, between disks of 1 kg
Vector pressing;

Vector& part(int number) {
    Vector* buffers[] = {&crowd.now.position, &crowd.now.velocity, &crowd.now.spin, &crowd.radius, &crowd.mass, &drive.goes, &drive.stop,
                       &drive.fraction, &drive.ids, &drive.exits, &drive.grid, &drive.next, &drive.corners, &drive.onward};
    return number <= ONWARD ? *buffers[number] : others[number];
}
double law(int one) { return others[LAW][one]; }

bool finite(In values) { return std::all_of(values.begin(), values.end(), [](double one) { return std::isfinite(one); }); }
bool within(In values, double low, double high) { return std::all_of(values.begin(), values.end(), [=](double one) { return one >= low && one <= high; }); }
bool whole_within(In values, double low, double high) {
    return within(values, low, high) && std::all_of(values.begin(), values.end(), [](double one) { return one == std::floor(one); });
}

// The first part that cannot be stepped with, from 1 on; 0: none.
int wrong() {
    const std::size_t n = crowd.radius.size(), doors = drive.exits.size() / 8, corners = drive.corners.size() / 2;
    for (int one = POSITION; one <= DISTANCE; ++one) {
        const std::size_t size = part(one).size(), rows_of = one == EXITS ? 8 : one == WALLS ? 4 : one == CORNERS ? 2 : 1;
        if (!finite(part(one)) || (one <= IDS && size != (one <= VELOCITY ? 2 * n : n)) || size % rows_of) return one + 1;
    }
    const Vector &law = others[LAW], &keeps = others[DISTANCE], &grid = drive.grid;
    if (!n || !within(crowd.radius, TINY, NOWHERE)) return RADIUS + 1;
    if (!within(crowd.mass, TINY, NOWHERE)) return MASS + 1;
    if (law.size() != PERIOD + 1 || !(law[0] > 0.0) || !within(In(law).subspan(4, 6), 0.0, NOWHERE)) return LAW + 1;
    if (law[4] > 1.0 || !(law[6] > 0.0) || law[TAU] < 0.0 || law[PERIOD] < 0.0) return LAW + 1;
    if (law[TAU] > 0.0 && !whole_within(drive.goes, 0.0, double(doors) - 1.0)) return GOES + 1;
    if (!within(drive.fraction, 0.0, 1.0)) return SHARE + 1;
    if (!whole_within(drive.ids, 0.0, LARGEST_WHOLE)) return IDS + 1;
    if (keeps.size() != OF_DISTANCE || !within(keeps, 0.0, NOWHERE) || !(keeps[2] > 0.0) || !(keeps[4] > 0.0) || !(keeps[5] > 0.0)) return DISTANCE + 1;
    if (!whole_within(In(keeps).subspan(6), 0.0, LARGEST_WHOLE)) return DISTANCE + 1;
    if (grid.empty()) return 0;
    if (grid.size() != 5 || !(grid[2] > 0.0) || !whole_within(In(grid).subspan(3), 1.0, MOST)) return GRID + 1;
    if (double(drive.next.size()) != double(doors) * grid[3] * grid[4]) return NEXT + 1;
    if (drive.onward.size() != doors * corners) return ONWARD + 1;
    return whole_within(drive.next, -1.0, std::max(0.0, double(corners) - 1.0)) ? 0 : NEXT + 1;
}

// As in analysis/engines/programs/rigid.py: who keep their distance look at the start of a window and every RENEWED s after it.
Vector desired(In x) {
    if (!(others[DISTANCE][0] > 0.0)) return drive.desired(x, crowd.radius, crowd.now.time);
    const double h = law(0);
    if (steps % std::max(1, int(RENEWED / h + 1e-9)) == 0 && looked != steps)
        looked = steps, wanted = drive.desired(x, crowd.radius, std::floor(crowd.now.time / h + 1e-6) * h);
    return wanted;
}

}  // namespace

// Make room for the numbers of a part; null where it is no part, or too large.
EXPORT(room) double* room(int number, int size) {
    if (number < 0 || number >= PARTS || size < 0 || size > MOST) return nullptr;
    begun = begun && number > DISTANCE;
    part(number).assign(size, 0.0);
    return part(number).data();
}
EXPORT(at) double* at(int number) { return number < 0 || number >= PARTS ? nullptr : part(number).data(); }
EXPORT(size) int size(int number) { return number < 0 || number >= PARTS ? 0 : int(part(number).size()); }
// Keep all as it is, and go back to it.
EXPORT(keep) void keep() { saved_state = state; }
EXPORT(back) void back() { state = saved_state, others[RESTING].clear(), resting = {}; }

// Take walls and law as the parts say; the first part that is wrong, from 1 on, or 0.
EXPORT(reconnect) int reconnect() {
    const int bad = wrong();
    begun = bad == 0, steps = 0, looked = -1;
    if (!begun) return bad;
    const Vector& keeps = others[DISTANCE];
    crowd.walls = connected(others[WALLS], law(LOW), law(PERIOD));
    drive.walls = crowd.walls, drive.speed = law(SPEED);
    drive.keep({keeps[0], keeps[1], keeps[2], keeps[3], keeps[4], keeps[5], keeps[6]});
    return 0;
}
// Begin at a time (s) from what the parts say; as `reconnect`.
EXPORT(begin) int begin(double time) {
    const int bad = std::isfinite(time) ? reconnect() : PARTS + 1;
    if (bad) return bad;
    crowd.now.time = time, last = {}, sums = WindowSums(std::int64_t(crowd.radius.size()));
    crowd.forget(), crowd.stay_within();
    return 0;
}
// Push overlapping disks apart; how far at most (m), −1 where they do not fit.
EXPORT(separate) double separate() { return begun ? crowd.separate() : -1.0; }
// Put the deepest contact of all with gaps of at most `high` m into RESTING: first, second or wall, is_wall, gap.
EXPORT(deepest) void deepest(double max_gap) {
    others[RESTING].clear();
    if (!begun) return;
    const ContactPairs at = find_contact_pairs(crowd.now.position, crowd.radius, crowd.walls, max_gap);
    const auto c = std::min_element(at.gap.begin(), at.gap.end()) - at.gap.begin();
    if (at.size()) others[RESTING] = {double(at.first[c]), double(at.second[c]), double(c >= at.pairs), at.gap[c]};
}

// Make a step: 1, 0 where it is not solved, −1 where somebody is no longer at a finite place, −2 where nothing has begun. But for the
// first the state stays.
EXPORT(step) int step() {
    if (!begun) return -2;
    Report& done = last;
    crowd.law = {law(0), law(1), law(2), law(3), law(4), law(5), law(6), law(7), law(8)};
    const auto moves = [] { return finite(crowd.now.position) && finite(crowd.now.velocity) && finite(crowd.now.spin); };
    if (!moves()) return -1;
    const Motion::State before = crowd.now;
    if (!crowd.advance(law(TAU) > 0.0 ? desired : Motion::Desired(), done)) return 0;
    if (!moves() || !finite(done.reaction) || !finite(done.friction)) return crowd.now = before, -1;
    ++steps;
    sums.add(done.neighbours.first, done.neighbours.second, done.neighbours.wall, done.neighbours.normal, done.neighbours.gap, done.reaction, done.friction);
    sums.add(done.reached.first, done.reached.second, done.reached.wall, done.reached.normal, done.reached.gap, done.push, {});
    return 1;
}

// Rows of RESTING as of CONTACTS: those that the last step leaves closed; none where it had friction.
EXPORT(closed) void closed() {
    const In u = crowd.now.velocity;
    const auto& [first, second, wall, normal, gap] = last.neighbours;
    Indices one, other;
    Vector along;
    others[RESTING].clear(), pressing.clear();
    if (!begun || max_abs(last.friction) > 0.0) return;
    for (std::size_t c = 0; c < gap.size(); ++c) {
        const Index i = first[c], j = second[c];
        const double x = normal[2 * c], y = normal[2 * c + 1], p = last.reaction[c];
        const double closing = x * (u[2 * i] - (j < 0 ? 0.0 : u[2 * j])) + y * (u[2 * i + 1] - (j < 0 ? 0.0 : u[2 * j + 1]));
        if (p <= 0.0 && closing < gap[c] / law(0) - OPENING * max_speed(u)) continue;
        one.push_back(i), other.push_back(j), along.insert(along.end(), {x, y}), pressing.push_back(p);
        others[RESTING].insert(others[RESTING].end(), {double(i), double(j < 0 ? wall[c] : j), double(j < 0), x, y, gap[c], p * x, p * y});
    }
    resting = impact_problem_of({crowd.now.position, u, crowd.radius, Vector(crowd.radius.size(), 1.0), {}}, std::move(one), std::move(other), along);
}
// The largest (sign 1) or least (−1) reaction (N·s) of a row of RESTING over all λ' ≥ 0 with Cᵀλ' = Cᵀλ: for any u with C u ≤ −sign
// in that row and C u ≤ 0 in the others sign λ'_c ≤ −u·Cᵀλ. The u that a far larger û = Cᵀλ comes to makes that least: a linear
// program as an impact. Infinite where a self-stress leaves no such u.
EXPORT(extreme) double extreme(int row, double sign) {
    ImpactProblem& s = resting;
    if (row < 0 || row >= s.k) return sign > 0.0 ? INFINITE : 0.0;
    const double max_gap = max_abs(pressing), unit = max_gap > 0.0 ? max_gap / STEEP : 1.0;
    std::fill(s.left_velocity.begin(), s.left_velocity.end(), 0.0), std::fill(s.max_approach.begin(), s.max_approach.end(), 0.0);
    add_reactions(s, pressing, 1.0 / unit, s.left_velocity), s.max_approach[row] = -sign;
    s.free = s.left_velocity, s.measure_scale();
    const Vector u = solve_contacts(s, {.tolerance = 1e-10, .canonical = false, .with_error_bound = false}).velocity;
    Vector v(s.k);
    approach(s, u, v);
    double bound = 0.0, beyond = 0.0;
    for (int c = 0; c < s.k; ++c) beyond = max_or_nan(beyond, v[c] - s.max_approach[c]);
    for (std::size_t i = 0; i < u.size(); ++i) bound -= unit * u[i] * s.left_velocity[i];
    return beyond <= PROVEN ? sign * bound : sign > 0.0 ? INFINITE : 0.0;
}

// Close the window. Of contacts pressed in it CONTACTS has first, second or wall, is_wall, normal (2), gap, impulse (2). Nothing is
// known of them afterwards, as in a run that goes on from a frame.
EXPORT(window) void window() {
    const auto n = std::int64_t(crowd.radius.size());
    Vector& rows = others[CONTACTS];
    rows.clear();
    if (!begun) return;
    for (const auto& [key, sum] : sums.close()) {
        const std::int64_t first = key >> ID_BITS, second = key & ID_MASK;
        const bool wall = second >= n;
        rows.insert(rows.end(), {double(first), double(wall ? second - n : second), double(wall), sum.x, sum.y, sum.gap, sum.px, sum.py});
    }
    crowd.forget(), steps = 0, looked = -1;
}
