#include "friction_sweeps.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "levels.hpp"

namespace nscd {

namespace {

// "A to B": see friction_solver.cpp.
constexpr int MEMORY = 10;           // answers that Anderson's method combines, memory against sweeps
constexpr double GROWTH = 2.0;       // a step that grows by more than this is rejected: combinations that do harm against lost ones
constexpr int CHECK = 50;            // pairs of sweeps between two looks at the natural map: cost of looks against sweeps too many
// Of proximal steps: weight of contacts at first and its bounds, where steps go far or are safe.
constexpr double SOFTEST = 1e1, FIRMEST = 1e8;
constexpr int PROXIMAL_STEPS = 2;    // with one factor, solutions against factorisations; 1 to 4
constexpr int PAIRS = 20;            // of sweeps after a step, their cost against steps; 10 to 40
constexpr int LENGTHS = 3;           // that are tried, each SHORTER than the last, cost against steps; 2 to 4
constexpr double SHORTER = 0.3;
constexpr double ALLOWED = 1.5;      // growth of the natural map, progress against wandering; 1.2 to 2, where the time is 1.35 times

double product(const double* one, const double* two, std::size_t size) {
    double part[8] = {};
    std::size_t a = 0;
    for (; a + 8 <= size; a += 8)
        for (int b = 0; b < 8; ++b) part[b] += one[a + b] * two[a + b];
    double sum = ((part[0] + part[4]) + (part[1] + part[5])) + ((part[2] + part[6]) + (part[3] + part[7]));
    for (; a < size; ++a) sum += one[a] * two[a];
    return sum;
}

constexpr int LANES = 4;
constexpr int APART = 2;  // a processor makes a batch while it waits for the results of the one before: 0.9 of the time; 3 fills fewer lanes
typedef double Vec4 __attribute__((vector_size(32)));

[[gnu::always_inline]] inline Vec4 load(const double* from) {
    Vec4 all;
    std::memcpy(&all, from, sizeof all);
    return all;
}

// Four bodies' (x, y, spin), each a row of u.
struct Moving {
    Vec4 x, y, turn;
};
[[gnu::always_inline]] inline Moving read(const double* u, const Index* at) {
    Vec4 row[LANES];
    for (int l = 0; l < LANES; ++l) row[l] = load(u + 4 * std::size_t(at[l]));
    const Vec4 xt = __builtin_shufflevector(row[0], row[1], 0, 4, 2, 6), y = __builtin_shufflevector(row[0], row[1], 1, 5, 3, 7);
    const Vec4 xt2 = __builtin_shufflevector(row[2], row[3], 0, 4, 2, 6), y2 = __builtin_shufflevector(row[2], row[3], 1, 5, 3, 7);
    return {__builtin_shufflevector(xt, xt2, 0, 1, 4, 5), __builtin_shufflevector(y, y2, 0, 1, 4, 5), __builtin_shufflevector(xt, xt2, 2, 3, 6, 7)};
}
[[gnu::always_inline]] inline void write(const Moving& now, double* u, const Index* at) {
    const Vec4 none{}, xy = __builtin_shufflevector(now.x, now.y, 0, 4, 2, 6), xy2 = __builtin_shufflevector(now.x, now.y, 1, 5, 3, 7);
    const Vec4 t = __builtin_shufflevector(now.turn, none, 0, 4, 2, 6), t2 = __builtin_shufflevector(now.turn, none, 1, 5, 3, 7);
    const Vec4 row[LANES] = {__builtin_shufflevector(xy, t, 0, 1, 4, 5), __builtin_shufflevector(xy2, t2, 0, 1, 4, 5),
                             __builtin_shufflevector(xy, t, 2, 3, 6, 7), __builtin_shufflevector(xy2, t2, 2, 3, 6, 7)};
    for (int l = 0; l < LANES; ++l) std::memcpy(u + 4 * std::size_t(at[l]), &row[l], sizeof(Vec4));
}

struct alignas(32) Pushes {
    double normal[LANES] = {}, tangential[LANES] = {};  // N·s, percussions of the contacts of a batch
};

// The law of a contact, all others given, in each lane.
[[gnu::always_inline]] inline void sweep_four(const Sweeps::Batch& c, Pushes& push, double* u) {
    const Vec4 nx = load(c.nx), ny = load(c.ny), li = load(c.li), lj = load(c.lj), pn = load(push.normal), pt = load(push.tangential);
    Moving a = read(u, c.i), b = read(u, c.j);
    const Vec4 x = a.x - b.x, y = a.y - b.y, turn = li * a.turn + lj * b.turn;
    const Vec4 v = nx * x + ny * y + load(c.w) * pn, s = nx * y - ny * x + turn + load(c.wt) * pt;  // without these percussions
    const Vec4 pressed = (v - load(c.max_approach)) * load(c.by_w), normal = pressed < Vec4{} ? Vec4{} : pressed;
    const Vec4 limit = load(c.friction) * normal, wanted = s * load(c.by_wt), above = wanted < -limit ? -limit : wanted, tangential = limit < above ? limit : above;
    const Vec4 one = normal - pn, two = tangential - pt, dx = nx * one - ny * two, dy = ny * one + nx * two;
    std::memcpy(push.normal, &normal, sizeof normal), std::memcpy(push.tangential, &tangential, sizeof tangential);
    a.x -= dx * load(c.mi), a.y -= dy * load(c.mi), a.turn -= li * two * load(c.si);
    b.x += dx * load(c.mj), b.y += dy * load(c.mj), b.turn -= lj * two * load(c.sj);
    write(a, u, c.i), write(b, u, c.j);
}

LEVELS void sweep_batches(const Sweeps::Batch* batch, int count, Pushes* push, double* u, int pairs) {
    for (; pairs > 0; --pairs) {
        for (int b = 0; b < count; ++b) sweep_four(batch[b], push[b], u);
        for (int b = count - 1; b >= 0; --b) sweep_four(batch[b], push[b], u);
    }
}

}  // namespace

bool solve_dense(Vector& a, Vector& x) {
    const int n = int(x.size());
    for (int q = 0; q < n; ++q) {
        int best = q;
        for (int r = q + 1; r < n; ++r)
            if (std::abs(a[r * n + q]) > std::abs(a[best * n + q])) best = r;
        if (!(std::abs(a[best * n + q]) > 0.0)) return false;
        if (best != q) {
            std::swap_ranges(a.begin() + q * n, a.begin() + (q + 1) * n, a.begin() + best * n);
            std::swap(x[q], x[best]);
        }
        const double by = 1.0 / a[q * n + q];
        for (int r = q + 1; r < n; ++r) {
            const double factor = a[r * n + q] * by;
            if (factor == 0.0) continue;
            for (int c = q + 1; c < n; ++c) a[r * n + c] -= factor * a[q * n + c];
            x[r] -= factor * x[q];
        }
    }
    for (int q = n - 1; q >= 0; --q) {
        for (int c = q + 1; c < n; ++c) x[q] -= a[q * n + c] * x[c];
        x[q] /= a[q * n + q];
    }
    return true;
}

Sweeps::Sweeps(const FrictionProblem& p) : p_(p) {
    if (!p.dissipates && !p.compound()) {
        batches();
        return;
    }
    touch_.resize(p.k);
    for (int c = 0; c < p.k; ++c) {
        const int i = 3 * p.first[c], j = 3 * p.second[c];
        const double w = p.inverse_mass[c], wt = p.tangent_inverse[c];
        touch_[c] = {i, j, p.nx[c], p.ny[c], p.lever_first[c], p.lever_second[c], w, wt, 1.0 / w, 1.0 / wt, p.friction[c], p.max_approach[c],
                     p.normal_dashpot[c], p.tangential_dashpot[c], p.left_approach[c], p.left_sliding[c], 1.0 / p.mass[i], 1.0 / p.mass[i + 2],
                     j >= 0 ? 1.0 / p.mass[j] : 0.0, j >= 0 ? 1.0 / p.mass[j + 2] : 0.0};
        if (!p.compound()) continue;
        Touch& of = touch_[c];
        of.ni = p.turn_first[c], of.nj = p.turn_second[c];
        of.both = of.ni * of.li * of.si + of.nj * of.lj * of.sj;
    }
}

template <bool Dissipates, bool Compound>
[[gnu::always_inline]] inline void Sweeps::sweep(const Touch& c, double& pn, double& pt, double* u) const {
    double *a = u + c.i, *b = u + c.j;
    double x = a[0], y = a[1], turn = c.li * a[2];
    if (c.j >= 0) x -= b[0], y -= b[1], turn += c.lj * b[2];
    double v = c.nx * x + c.ny * y + c.w * pn;  // without this contact's percussion
    if (Compound) v += c.ni * a[2] + (c.j >= 0 ? c.nj * b[2] : 0.0);
    double s = c.nx * y - c.ny * x + turn + c.wt * pt;
    double normal, tangential;
    if (!Dissipates || (c.normal_dashpot == 0.0 && c.tangential_dashpot == 0.0)) {
        normal = std::max((v - c.max_approach) * c.by_w, 0.0);
        if (Compound) s -= c.both * (normal - pn);
        const double limit = c.friction * normal;
        tangential = std::min(std::max(s * c.by_wt, -limit), limit);
    } else {
        const double kn = c.normal_dashpot, kt = c.tangential_dashpot;
        v = (v - c.w * kn * c.left_approach) / (1.0 + c.w * kn);
        const double lam = std::max((v - c.max_approach) * (1.0 + c.w * kn) / c.w, 0.0);
        normal = kn * (std::min(v, c.max_approach) + c.left_approach) + lam;
        if (Compound) s -= c.both * (normal - pn);
        s = (s - c.wt * kt * c.left_sliding) / (1.0 + c.wt * kt);
        const double limit = c.friction * std::max(normal, 0.0);
        const double tau = std::min(std::max(s * (1.0 + c.wt * kt) / c.wt, -limit), limit);
        tangential = kt * (s - c.wt * tau / (1.0 + c.wt * kt) + c.left_sliding) + tau;
    }
    const double one = normal - pn, two = tangential - pt;
    pn = normal, pt = tangential;
    const double dx = c.nx * one - c.ny * two, dy = c.ny * one + c.nx * two;
    a[0] -= dx * c.mi, a[1] -= dy * c.mi, a[2] -= c.li * two * c.si;
    if (c.j >= 0) b[0] += dx * c.mj, b[1] += dy * c.mj, b[2] -= c.lj * two * c.sj;
    if (!Compound) return;
    a[2] -= c.ni * one * c.si;
    if (c.j >= 0) b[2] -= c.nj * one * c.sj;
}

// Each contact in the first batch with a free lane that is APART or more batches after those of its disks: what two contacts
// without a common disk do commutes, so that batches in their order give what contacts in theirs do, bit by bit.
void Sweeps::batches() {
    Indices last(p_.n, -APART), next, used;  // batch of a disk; the batch from which on one may be free, if not itself
    const auto free_from = [&](int b) {
        int end = std::min(b, int(next.size()));
        while (end < int(next.size()) && next[end] != end) end = next[end];
        for (int on, at = b; at < end; at = on) on = next[at], next[at] = end;
        return std::max(b, end);
    };
    for (int c = 0; c < p_.k; ++c) {
        const Index i = p_.first[c], j = p_.second[c];
        const int at = free_from(APART + std::max(last[i], j >= 0 ? last[j] : -APART));
        while (at >= int(next.size())) {
            next.push_back(int(next.size())), used.push_back(0);
            Batch& empty = batch_.emplace_back();
            for (Index l = 0; l < LANES; ++l) empty.i[l] = empty.j[l] = p_.n + l, empty.contact[l] = -1;
        }
        Batch& to = batch_[at];
        const int l = used[at]++;
        if (used[at] == LANES) next[at] = at + 1;
        last[i] = at, to.i[l] = i, to.contact[l] = c;
        if (j >= 0) last[j] = at, to.j[l] = j;
        const double w = p_.inverse_mass[c], wt = p_.tangent_inverse[c];
        to.nx[l] = p_.nx[c], to.ny[l] = p_.ny[c], to.li[l] = p_.lever_first[c], to.lj[l] = p_.lever_second[c];
        to.w[l] = w, to.wt[l] = wt, to.by_w[l] = 1.0 / w, to.by_wt[l] = 1.0 / wt;
        to.friction[l] = p_.friction[c], to.max_approach[l] = p_.max_approach[c];
        to.mi[l] = 1.0 / p_.mass[3 * i], to.si[l] = 1.0 / p_.mass[3 * i + 2];
        if (j >= 0) to.mj[l] = 1.0 / p_.mass[3 * j], to.sj[l] = 1.0 / p_.mass[3 * j + 2];
    }
}

void Sweeps::run(Out pn, Out pt, Out u, int count) const {
    const int k = p_.k;
    if (!batch_.empty()) {
        Vector rows(4 * std::size_t(p_.n + LANES), 0.0);
        for (int i = 0; i < p_.n; ++i) std::copy_n(&u[3 * i], 3, &rows[4 * i]);
        std::vector<Pushes> push(batch_.size());
        for (std::size_t b = 0; b < batch_.size(); ++b)
            for (int l = 0; l < LANES; ++l)
                if (const Index c = batch_[b].contact[l]; c >= 0) push[b].normal[l] = pn[c], push[b].tangential[l] = pt[c];
        sweep_batches(batch_.data(), int(batch_.size()), push.data(), rows.data(), count);
        for (int i = 0; i < p_.n; ++i) std::copy_n(&rows[4 * i], 3, &u[3 * i]);
        for (std::size_t b = 0; b < batch_.size(); ++b)
            for (int l = 0; l < LANES; ++l)
                if (const Index c = batch_[b].contact[l]; c >= 0) pn[c] = push[b].normal[l], pt[c] = push[b].tangential[l];
        return;
    }
    const auto all = [&]<bool Dissipates, bool Compound>() {
        for (int c = 0; c < k; ++c) sweep<Dissipates, Compound>(touch_[c], pn[c], pt[c], u.data());
        for (int c = k - 1; c >= 0; --c) sweep<Dissipates, Compound>(touch_[c], pn[c], pt[c], u.data());
    };
    for (; count > 0; --count) {
        if (!p_.compound()) all.operator()<true, false>();
        else p_.dissipates ? all.operator()<true, true>() : all.operator()<false, true>();
    }
}

double Sweeps::natural_map_residual(In pn, In pt, In u) const {
    Vector v(p_.k), s(p_.k);
    contact_velocities(p_, u, v, s);
    double worst = 0.0;
    for (int c = 0; c < p_.k; ++c) {
        const double lam = pn[c] - p_.normal_dashpot[c] * (v[c] + p_.left_approach[c]), tau = pt[c] - p_.tangential_dashpot[c] * (s[c] + p_.left_sliding[c]);
        const NaturalMapResidual residual = natural_map(p_, c, pn[c], lam, tau, v[c], s[c]);
        worst = max_or_nan(worst, max_or_nan(std::abs(residual.normal), std::abs(residual.tangential)));
    }
    return worst < INFINITE ? worst / p_.scale : INFINITE;
}

double Sweeps::until_converged(Out pn, Out pt, Out u, int max_count, double tolerance, int& done) const {
    double error = INFINITE;
    for (int made = 0; made < max_count && !(error <= tolerance);) {
        equilibrium_velocity(p_, pn, pt, u);
        const int batch = std::min(CHECK, max_count - made);
        this->run(pn, pt, u, batch);
        made += batch, done += batch;
        equilibrium_velocity(p_, pn, pt, u);
        error = natural_map_residual(pn, pt, u);
    }
    return error;
}

double Sweeps::accelerated(Vector& pn, Vector& pt, Vector& u, int blocks, int per_block, double tolerance, int& done) const {
    const std::size_t k = p_.k;
    Vector root(2 * k), x(2 * k), step(2 * k), old_end(2 * k), old_step(2 * k), best_n = pn, best_t = pt;
    for (std::size_t c = 0; c < k; ++c) {
        root[c] = std::sqrt(p_.inverse_mass[c]), root[k + c] = std::sqrt(p_.tangent_inverse[c]);
        x[c] = pn[c] * root[c], x[k + c] = pt[c] * root[k + c];
    }
    std::vector<Vector> ends(MEMORY, Vector(2 * k)), steps(MEMORY, Vector(2 * k));
    double best = INFINITE, before = INFINITE;
    Vector products(MEMORY * MEMORY);  // products of steps
    int stored_count = 0;
    for (int block = 0; block < blocks; ++block) {
        for (std::size_t c = 0; c < k; ++c) pn[c] = x[c] / root[c], pt[c] = x[k + c] / root[k + c];
        equilibrium_velocity(p_, pn, pt, u);
        this->run(pn, pt, u, per_block);
        done += per_block;
        equilibrium_velocity(p_, pn, pt, u);
        const double error = natural_map_residual(pn, pt, u);
        if (error < best) best = error, best_n = pn, best_t = pt;
        if (best <= tolerance || !(error < INFINITE)) break;
        for (std::size_t c = 0; c < k; ++c) {
            step[c] = pn[c] * root[c] - x[c];
            step[k + c] = pt[c] * root[k + c] - x[k + c];
        }
        const double size = product(step.data(), step.data(), 2 * k);
        if (size > GROWTH * GROWTH * before && stored_count > 0) {  // the combination did harm
            stored_count = 0, before = INFINITE;
            x = old_end;
            continue;
        }
        if (before < INFINITE) {
            Vector &ds = steps[stored_count % MEMORY], &de = ends[stored_count % MEMORY];
            for (std::size_t c = 0; c < 2 * k; ++c) ds[c] = step[c] - old_step[c], de[c] = x[c] + step[c] - old_end[c];
            for (int a = 0, b = stored_count % MEMORY; a < std::min(stored_count + 1, MEMORY); ++a)
                products[a * MEMORY + b] = products[b * MEMORY + a] = product(steps[a].data(), ds.data(), 2 * k);
            ++stored_count;
        }
        before = size;
        old_step = step;
        for (std::size_t c = 0; c < 2 * k; ++c) x[c] = old_end[c] = x[c] + step[c];
        const int m = std::min(stored_count, MEMORY);
        if (m == 0) continue;
        Vector gram(m * m), weights(m);
        double trace = 0.0;
        for (int a = 0; a < m; ++a) {
            std::copy_n(&products[a * MEMORY], m, &gram[a * m]);
            weights[a] = product(steps[a].data(), step.data(), 2 * k);
            trace += gram[a * m + a];
        }
        for (int a = 0; a < m; ++a) gram[a * m + a] += 1e-14 * trace + 1e-300;
        if (!solve_dense(gram, weights)) continue;
        for (int a = 0; a < m; ++a)
            for (std::size_t c = 0; c < 2 * k; ++c) x[c] -= weights[a] * ends[a][c];
    }
    pn = std::move(best_n), pt = std::move(best_t);
    equilibrium_velocity(p_, pn, pt, u);
    return best;
}

double proximal_newton(const FrictionProblem& p, const Sweeps& sweeps, FrictionFactor& factor, FrictionSolution& at, int rounds, double tolerance, double& weight, int& pairs) {
    Vector v(p.k), s(p.k);
    // λ and τ of whole percussions, and these again
    const auto full = [&](FrictionSolution& some, double sign) {
        if (!p.dissipates) return;
        contact_velocities(p, some.velocity, v, s);
        for (int c = 0; c < p.k; ++c) {
            some.reaction[c] += sign * p.normal_dashpot[c] * (v[c] + p.left_approach[c]);
            some.tangential[c] += sign * p.tangential_dashpot[c] * (s[c] + p.left_sliding[c]);
        }
    };
    const auto smooth = [&](FrictionSolution& some, int count) {
        equilibrium_velocity(p, some.reaction, some.tangential, some.velocity);
        sweeps.run(some.reaction, some.tangential, some.velocity, count);
        equilibrium_velocity(p, some.reaction, some.tangential, some.velocity);
        full(some, -1.0);
        pairs += count;
    };
    // the natural map over the scale: its largest entry and its Euclidean norm
    const auto error_of = [&](const FrictionSolution& some) {
        contact_velocities(p, some.velocity, v, s);
        double worst = 0.0, square = 0.0;
        for (int c = 0; c < p.k; ++c) {
            const NaturalMapResidual residual = natural_map(p, c, normal_push(p, c, v[c], some.reaction[c]), some.reaction[c], some.tangential[c], v[c], s[c]);
            worst = std::max({worst, std::abs(residual.normal), std::abs(residual.tangential)});
            square += residual.normal * residual.normal + residual.tangential * residual.tangential;
        }
        if (!(square < INFINITE)) return std::pair(INFINITE, INFINITE);
        return std::pair(worst / p.scale, std::sqrt(square) / p.scale);
    };
    full(at, 1.0);
    smooth(at, 0);
    auto error = error_of(at);
    States states(p.k);
    FrictionSolution aim, tried = at;
    for (int round = 0; round < rounds; ++round) {
        if (error.first <= tolerance || !(error.first < INFINITE)) break;
        contact_velocities(p, at.velocity, v, s);
        find_states(p, v, s, at.reaction, at.tangential, states);
        aim = at;
        bool taken_out = false;
        double length = 1.0;
        auto now = error;
        const bool settled = solve_fixed_state(p, factor, states, weight, PROXIMAL_STEPS, aim);
        full(at, 1.0), full(aim, 1.0);
        for (int attempt = 0; settled && attempt < LENGTHS && !taken_out; ++attempt) {
            if (attempt > 0) length *= SHORTER;
            for (int c = 0; c < p.k; ++c) {  // back into the cones
                const double normal = std::max(at.reaction[c] + length * (aim.reaction[c] - at.reaction[c]), 0.0), limit = p.friction[c] * normal;
                const double tangential = at.tangential[c] + length * (aim.tangential[c] - at.tangential[c]);
                tried.reaction[c] = normal;
                tried.tangential[c] = p.tangential_dashpot[c] != 0.0 ? tangential : std::min(std::max(tangential, -limit), limit);
            }
            smooth(tried, PAIRS);
            now = error_of(tried);
            taken_out = now.second < ALLOWED * error.second;
        }
        if (taken_out) {
            std::swap(at, tried);
            error = now;
        } else {
            smooth(at, 2 * PAIRS);
            error = error_of(at);
        }
        weight = std::min(std::max((taken_out && length == 1.0 ? 2.0 : 0.5) * weight, SOFTEST), FIRMEST);
    }
    return error.first;
}

// The reaction of one contact with W (2 × 2) and q.
static std::array<double, 2> alone(const double (&own)[2][2], const double (&free)[2], double mu) {
    if (free[0] >= 0.0) return {0.0, 0.0};
    if (mu == 0.0) return {-free[0] / own[0][0], 0.0};
    const double det = own[0][0] * own[1][1] - own[0][1] * own[1][0];
    if (det > 1e-14 * own[0][0] * own[1][1]) {
        const double normal = (own[0][1] * free[1] - own[1][1] * free[0]) / det, tangential = (own[1][0] * free[0] - own[0][0] * free[1]) / det;
        if (normal >= 0.0 && std::abs(tangential) <= mu * normal) return {normal, tangential};
    }
    for (double sign : {-1.0, 1.0}) {
        const double pressed = own[0][0] + sign * mu * own[0][1];
        if (!(pressed > 0.0)) continue;
        const double normal = -free[0] / pressed, slides = free[1] + (own[1][0] + sign * mu * own[1][1]) * normal;
        if (sign * slides <= 0.0) return {normal, sign * mu * normal};
    }
    return {-free[0] / own[0][0], 0.0};
}

void planar_sweeps(std::span<const Index> start, std::span<const Index> column, In value, In free, In friction, Out r, int sweeps) {
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (std::size_t c = 0; c < friction.size(); ++c) {
            double own[2][2] = {}, residual[2];
            for (std::size_t a = 0; a < 2; ++a) {
                residual[a] = free[2 * c + a];
                for (Index at = start[2 * c + a]; at < start[2 * c + a + 1]; ++at) {
                    if (std::size_t(column[at]) / 2 == c) own[a][column[at] % 2] = value[at];
                    else residual[a] += value[at] * r[column[at]];
                }
            }
            const auto [normal, tangential] = alone(own, residual, friction[c]);
            r[2 * c] = normal, r[2 * c + 1] = tangential;
        }
}

}  // namespace nscd
