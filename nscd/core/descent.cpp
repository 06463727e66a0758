#include "descent.hpp"

#include <algorithm>
#include <array>

#include "levels.hpp"

namespace nscd {

namespace {

// Sweeps from a look at the closed contacts to the next; in a crowd of FEW contacts, where a factorisation costs less
// than that many sweeps.
constexpr int CHECK = 25, OFTEN = 5, FEW = 200;
// After so many sweeps it is clear that more contacts than unknowns will stay closed: where they are REDUNDANT times
// as many, and where they are just more.
constexpr int EARLY = 100, LATE = 200;
constexpr double REDUNDANT = 1.2;
// More make steps shorter and sweeps more: momentum is stable up to 4/3 of the right step, and after ten iterations the
// step is at most 1.1 of it (measured on crowds of 594 and 5,000).
constexpr int POWER_ITERATIONS = 10;

// The problem in the variables λ√w. A wall is a disk that never moves: disk n + p for the contacts of part p.
struct Scaled {
    std::vector<std::uint32_t> first, second;
    Vector normal;                            // (k·2) over √w
    Vector inverse;                           // (n+p) 1/kg
    Vector pull, root;                        // (k) (Cû − b)/√w, √w
    Vector now, ahead;                        // (k) √w λ, and where momentum carries it
    Vector u;                                 // (n+p·2) momentum, then velocity that contacts give
    Vector v;                                 // (k) m/s √kg, approach at that velocity
    Mask closed;                              // (k) at the last look
};

struct Measured {
    double error = 0.0, changed = 0.0, pressed = 0.0;
};

// u += Cᵀλ (momentum) of contacts begin … end.
[[gnu::always_inline]] inline void gather(Scaled& s, const double* reaction, std::int64_t begin, std::int64_t end) {
    double* u = s.u.data();
    for (auto c = begin; c < end; ++c) {
        double *i = u + 2 * s.first[c], *j = u + 2 * s.second[c];
        const Vec2 push = load<Vec2>(&s.normal[2 * c]) * reaction[c];
        store(i, load<Vec2>(i) + push);
        store(j, load<Vec2>(j) - push);
    }
}

// The same at disks low … high only.
void gather_at(Scaled& s, std::int64_t low, std::int64_t high, std::int64_t begin) {
    for (auto c = begin; c < std::int64_t(s.v.size()); ++c) {
        const std::int64_t i = s.first[c], j = s.second[c];
        const Vec2 push = load<Vec2>(&s.normal[2 * c]) * s.ahead[c];
        if (low <= i && i < high) store(&s.u[2 * i], load<Vec2>(&s.u[2 * i]) + push);
        if (low <= j && j < high) store(&s.u[2 * j], load<Vec2>(&s.u[2 * j]) - push);
    }
}

// v of contacts begin … end, two at a time.
[[gnu::always_inline]] inline void approach_scaled(const Scaled& s, double* v, std::int64_t begin, std::int64_t end) {
    const double *u = s.u.data(), *normal = s.normal.data();
    const auto product = [&](std::int64_t c) { return load<Vec2>(normal + 2 * c) * (load<Vec2>(u + 2 * s.first[c]) - load<Vec2>(u + 2 * s.second[c])); };
    for (; begin + 2 <= end; begin += 2) {
        const Vec2 one = product(begin), other = product(begin + 1);
        store(v + begin, __builtin_shufflevector(one, other, 0, 2) + __builtin_shufflevector(one, other, 1, 3));
    }
    if (begin < end) v[begin] = product(begin)[0] + product(begin)[1];
}

// u of the disks low … high from the contacts of their parts and those between parts.
LEVELS void velocities(Scaled& s, const Parts& parts, int mine, int end) {
    const auto n = parts.disk.back(), low = parts.disk[mine], high = parts.disk[end];
    std::fill(s.u.begin() + 2 * low, s.u.begin() + 2 * high, 0.0);
    for (int p = mine; p < end; ++p) {
        gather(s, s.ahead.data(), parts.contact[p], parts.contact[p + 1]);
        s.u[2 * (n + p)] = s.u[2 * (n + p) + 1] = 0.0;
    }
    if (parts.count() > 1) gather_at(s, low, high, parts.contact.back());
    for (auto i = low; i < high; ++i) s.u[2 * i] *= s.inverse[i], s.u[2 * i + 1] *= s.inverse[i];
}

// The error of contacts begin … end, how many change sides, and how many press.
LEVELS Measured measure_piece(Scaled& s, std::int64_t begin, std::int64_t end) {
    Measured measured{0.0, 0.0, 0.0};  // clang leaves out a constructor that only clones call
    approach_scaled(s, s.v.data(), begin, end);
    for (auto c = begin; c < end; ++c) {
        const double gradient = s.v[c] - s.pull[c];
        measured.error = std::max(measured.error, std::abs(std::min(s.ahead[c], gradient)) * s.root[c]);
        const bool active = s.ahead[c] > gradient;
        measured.changed += active != bool(s.closed[c]);
        s.closed[c] = active;
        measured.pressed += active;
    }
    return measured;
}

// A step of contacts begin … end; how much it goes uphill.
LEVELS double move(Scaled& s, std::int64_t begin, std::int64_t end, double step, double beta) {
    approach_scaled(s, s.v.data(), begin, end);
    const double *v = s.v.data(), *pull = s.pull.data();
    double *__restrict now = s.now.data(), *__restrict ahead = s.ahead.data();
    std::array<double, 8> uphill{};  // in one order on every machine
    const auto one = [&](std::int64_t c, double& sum) {
        const double gradient = v[c] - pull[c];
        const double down = ahead[c] - step * gradient, next = down > 0.0 ? down : 0.0, change = next - now[c];
        sum += gradient * change;
        now[c] = next;
        ahead[c] = next + beta * change;
    };
    for (; begin + 8 <= end; begin += 8)
        for (int lane = 0; lane < 8; ++lane) one(begin + lane, uphill[lane]);
    for (int lane = 0; begin < end; ++begin, ++lane) one(begin, uphill[lane]);
    double sum = 0.0;
    for (double part : uphill) sum += part;
    return sum;
}

// The largest eigenvalue of the scaled Delassus operator, by power iteration, with a margin of 2 %.
double norm(Scaled& s) {
    const auto k = std::int64_t(s.v.size());
    Vector v(k);
    for (std::int64_t c = 0; c < k; ++c) v[c] = 1.0 + 0.37 * double((c * 7919) % 101) / 101.0;
    const auto size = [&] {
        double square = 0.0;
        for (double value : v) square += value * value;
        return std::sqrt(square);
    };
    // 10 rounds are far from the largest number: what they make is not scaled in between
    double before = 1.0;
    for (int round = 0; round < POWER_ITERATIONS; ++round) {
        if (round == POWER_ITERATIONS - 1) before = size();
        std::fill(s.u.begin(), s.u.end(), 0.0);
        gather(s, v.data(), 0, k);
        for (std::size_t i = 0; i < s.inverse.size(); ++i) s.u[2 * i] *= s.inverse[i], s.u[2 * i + 1] *= s.inverse[i];
        approach_scaled(s, v.data(), 0, k);
    }
    return 1.02 * size() / before;
}

Scaled scaled_of(const ImpactProblem& s, const Parts& parts) {
    Scaled scaled;
    const int count = parts.count();
    scaled.first.resize(s.k), scaled.second.resize(s.k), scaled.normal.resize(2 * std::size_t(s.k)), scaled.root.resize(s.k);
    for (int c = 0, p = 0; c < s.k; ++c) {
        while (p < count - 1 && c >= parts.contact[p + 1]) ++p;
        scaled.root[c] = std::sqrt(s.inverse_mass[c]);
        scaled.normal[2 * c] = s.nx[c] / scaled.root[c], scaled.normal[2 * c + 1] = s.ny[c] / scaled.root[c];
        scaled.first[c] = std::uint32_t(s.first[c]);
        scaled.second[c] = std::uint32_t(s.second[c] >= 0 ? s.second[c] : s.n + p);
    }
    scaled.inverse.assign(s.n + count, 0.0), scaled.u.assign(2 * std::size_t(s.n + count), 0.0);
    for (int i = 0; i < s.n; ++i) {
        scaled.inverse[i] = 1.0 / s.mass[s.d * i];
        scaled.u[2 * i] = s.free[s.d * i], scaled.u[2 * i + 1] = s.free[s.d * i + 1];
    }
    scaled.pull.resize(s.k), scaled.v.resize(s.k);
    approach_scaled(scaled, scaled.pull.data(), 0, s.k);
    for (int c = 0; c < s.k; ++c) scaled.pull[c] -= s.max_approach[c] / scaled.root[c];
    scaled.closed.assign(s.k, 0);
    return scaled;
}

}  // namespace

DescentResult descend(const ImpactProblem& s, const Parts& parts, Team& team, const DescentLimits& limits) {
    Scaled scaled = scaled_of(s, parts);
    const double step = 1.0 / norm(scaled), tolerance = limits.tolerance * s.scale;
    const double redundant = 2.0 * s.n * limits.redundant;
    scaled.now.resize(s.k);
    for (int c = 0; c < s.k; ++c) scaled.now[c] = std::max(scaled.pull[c], 0.0) * step;
    scaled.ahead = scaled.now;

    // Each thread sweeps over parts of its own; contacts between parts come after those within.
    const int count = parts.count(), check = s.k < FEW ? OFTEN : CHECK;
    const int kinds = parts.contact.back() < s.k ? 2 : 1;
    const auto between = s.k - parts.contact.back();
    std::vector<std::array<Measured, 2>> measured(count);
    std::vector<std::array<double, 2>> uphill(count);
    int sweeps = limits.max_sweeps;
    team.run([&](int me) {
        const int mine = count * me / team.threads(), end = count * (me + 1) / team.threads();
        int met = 0;
        double since = 0.0;  // sweeps since the last restart
        const auto for_pieces = [&](auto&& visit) {
            for (int p = mine; p < end; ++p) {
                visit(p, 0, parts.contact[p], parts.contact[p + 1]);
                if (kinds == 2) visit(p, 1, parts.contact.back() + between * p / count, parts.contact.back() + between * (p + 1) / count);
            }
        };
        for (int sweep = 0; sweep < limits.max_sweeps; ++sweep) {
            velocities(scaled, parts, mine, end);
            team.meet(++met);
            if (sweep % check == check - 1) {
                for_pieces([&](int p, int kind, std::int64_t a, std::int64_t b) { measured[p][kind] = measure_piece(scaled, a, b); });
                team.meet(++met);
                Measured total;
                for (const auto& both : measured)
                    for (const Measured& one : both) {
                        total.error = std::max(total.error, one.error);
                        total.changed += one.changed, total.pressed += one.pressed;
                    }
                const double minimum = sweep + 1 >= LATE ? redundant : REDUNDANT * redundant;
                if (total.error <= tolerance || total.changed <= limits.unchanged_tolerance || (sweep + 1 >= EARLY && total.pressed > minimum)) {
                    if (me == 0) sweeps = sweep + 1;
                    return;
                }
            }
            const double beta = since / (since + 2.0);
            since += 1.0;
            for_pieces([&](int p, int kind, std::int64_t a, std::int64_t b) { uphill[p][kind] = move(scaled, a, b, step, beta); });
            team.meet(++met);
            double sum = 0.0;
            for (const auto& both : uphill) sum += both[0] + both[1];
            if (sum > 0.0 || sweep == limits.max_sweeps - 1) {
                since = 0.0;
                for_pieces([&](int, int, std::int64_t a, std::int64_t b) { std::copy(scaled.now.begin() + a, scaled.now.begin() + b, scaled.ahead.begin() + a); });
                team.meet(++met);
            }
        }
    });
    DescentResult found{Vector(s.k), s.free, sweeps};
    for (int c = 0; c < s.k; ++c) {
        scaled.ahead[c] = std::max(scaled.ahead[c], 0.0);
        found.reaction[c] = scaled.ahead[c] / scaled.root[c];
    }
    std::fill(scaled.u.begin(), scaled.u.end(), 0.0);
    gather(scaled, scaled.ahead.data(), 0, s.k);
    for (int i = 0; i < s.n; ++i) {
        found.velocity[s.d * i] -= scaled.u[2 * i] * scaled.inverse[i];
        found.velocity[s.d * i + 1] -= scaled.u[2 * i + 1] * scaled.inverse[i];
    }
    return found;
}

}  // namespace nscd
