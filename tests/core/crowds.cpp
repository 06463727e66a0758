// Crowds through every way of the core, for the sanitizers (`make sanitize`): lattices with vacancies, pressed into each
// other or not, with and without dissipation and friction, by each method, by rows and by fronts, alone and by threads.
// The sanitizer of threads sees only what threads do together.
#include <cstdio>
#include <random>

#include "impact_solver.hpp"
#include "contacts.hpp"
#include "solve_frames.hpp"
#include "friction_solver.hpp"
#include "motion.hpp"

using namespace nscd;

namespace {

#if defined(__SANITIZE_THREAD__)
constexpr bool THREADS_ONLY = true;
#else
constexpr bool THREADS_ONLY = false;
#endif

struct Crowd {
    Vector position, velocity, radius, mass;
};

Crowd crowd(std::mt19937& draw, int n, double spacing, double decades) {
    std::uniform_real_distribution<double> one(0.0, 1.0);
    Crowd of;
    const int side = int(std::sqrt(1.3 * n)) + 1;
    for (int i = 0; i < side * side && int(of.radius.size()) < n; ++i) {
        if (one(draw) < 0.15) continue;
        const int row = i / side, column = i % side;
        of.position.push_back(spacing * (column + 0.5 * (row % 2)) + 0.3), of.position.push_back(0.866 * spacing * row + 0.25);
        of.velocity.push_back(one(draw) - 0.5), of.velocity.push_back(-one(draw));
        of.radius.push_back(0.25), of.mass.push_back(75.0 * std::pow(10.0, decades * (one(draw) - 0.5)));
    }
    return of;
}

bool report(const char* what, int n, bool passed) {
    if (!passed) std::printf("%s: wrong for %d disks\n", what, n);
    return passed;
}

// The same disks as solid ones that rub, some contacts of which dissipate.
FrictionProblem friction_problem(const ImpactProblem& s, const Crowd& c, double dissipation) {
    FrictionProblem p;
    static_cast<ImpactProblem&>(p) = s;
    p.lever_first = p.lever_second = Vector(s.k, 0.25);
    p.mass.clear(), p.left_velocity.clear();
    for (int i = 0; i < s.n; ++i) {
        for (double m : {c.mass[i], c.mass[i], 0.03125 * c.mass[i]}) p.mass.push_back(m);
        for (double u : {c.velocity[2 * i], c.velocity[2 * i + 1], 0.1}) p.left_velocity.push_back(u);
    }
    for (int e = 0; e < s.k; ++e) {
        if (s.second[e] < 0) p.lever_second[e] = 0.0;
        p.friction.push_back(e % 5 ? 0.3 : 0.0);
    }
    p.normal_dashpot.assign(s.k, dissipation), p.tangential_dashpot.assign(s.k, 0.0);
    p.scale = 1.0;
    p.prepare();
    return p;
}

}  // namespace

int main() {
    std::mt19937 draw(1);
    const Vector start{-50.0, 0.0, 0.0, -1.0}, along{100.0, 0.0, 0.0, 50.0};
    const Indices vertex{0, 1, 2, 3};
    const Mask inner(4, 0);
    const Segments walls{2, start, along, vertex, inner, 50.0};
    bool passed = true;
    for (int n : {1, 2, 3, 7, 20, 60, 150, 400})
        for (double spacing : {0.49, 0.4999999999})
            for (double decades : {0.0, 4.0}) {
                const Crowd c = crowd(draw, n, spacing, decades);
                const int size = int(c.radius.size());
                const ContactPairs contacts = find_contact_pairs(c.position, c.radius, walls, 1e-3);
                const Neighbours neighbours = with_normals(contacts);
                const ImpactProblem s = impact_problem_of({c.position, c.velocity, c.radius, c.mass, {}}, neighbours.first, neighbours.second, neighbours.normal);
                if (THREADS_ONLY && n < 60) continue;
                for (int way = THREADS_ONLY ? 6 : 0; way < 8; ++way) {
                    Options options;
                    options.canonical = way != 1;
                    if (way >= 2 && way <= 3) options.solver = way == 2 ? Solver::INTERIOR_POINT : Solver::ACTIVE_SET;
                    if (way >= 4) options.sizes.multifrontal = 0;
                    if (way >= 5) options.sizes.shared = 1, options.threads = way == 5 ? 1 : 3;
                    ImpactProblem law = s;
                    if (way == 7) {
                        law.normal_dashpot.assign(s.k, 30.0), law.tangential_dashpot.assign(s.k, 10.0), law.d = 3;
                        law.lever_first = law.lever_second = Vector(s.k, 0.25);
                        law.mass.clear(), law.left_velocity.clear();
                        for (int i = 0; i < size; ++i) {
                            for (double m : {c.mass[i], c.mass[i], 0.03 * c.mass[i]}) law.mass.push_back(m);
                            for (double u : {c.velocity[2 * i], c.velocity[2 * i + 1], 0.1}) law.left_velocity.push_back(u);
                        }
                        law.free = law.left_velocity;
                    }
                    const Solution solution = solve_one_sided(law, options);
                    const Certificate of = certificate_of(law, solution.reaction, solution.velocity);
                    const bool solved = of.finite && of.residual <= 1e-8 && of.momentum_error <= 1e-8;
                    passed = report("answer", size, solved || options.solver == Solver::ACTIVE_SET) && passed;
                }
                if (THREADS_ONLY) continue;
                for (double dissipation : {0.0, 10.0}) {
                    if (size > 60 || decades > 0.0) continue;
                    FrictionProblem p = friction_problem(s, c, dissipation);
                    const FrictionResult solution = solve_friction(p, {1e-8, size < 8 ? 3 : 1, c.radius});
                    const FrictionCertificate of = certificate_of(p, solution.solution);
                    passed = report("friction", size, std::max(of.natural_map, of.momentum_error) <= 1e-8) && passed;
                    if (dissipation == 0.0) solve_friction(p, {.tolerance = 1e-6, .in_step = true, .reaction = solution.solution.reaction, .tangential = solution.solution.tangential}), solve_friction(p, {.tolerance = 1e-6, .in_step = true});
                }
                const std::vector<std::int64_t> frames{0, size};
                std::vector<std::int64_t> ids(size);
                for (int i = 0; i < size; ++i) ids[i] = i + 1;
                const Film film{frames, ids, c.position, c.velocity, c.radius, c.mass, walls};
                passed = report("film", size, solve_film(film, {1e-3, 0.5, 1e-8, true}).answered[0]) && passed;
                for (double tolerance : {1e-8, 1e-4})
                    for (double friction : {0.0, 0.3}) {
                        if (decades > 0.0 || (friction > 0.0 && size > 60)) continue;
                        Motion crowd;
                        crowd.law = {1e-2, 0.5, 0.0, -1.0, 0.3, friction, tolerance, 0.1, 50.0};
                        crowd.walls = walls, crowd.radius = c.radius, crowd.mass = c.mass;
                        crowd.now.position = c.position, crowd.now.velocity = c.velocity, crowd.now.spin.assign(size, 0.0);
                        Report done;
                        for (int step = 0; step < 3; ++step)
                            passed = report("step", size, crowd.advance([](In x) { return Vector(x.size(), 0.5); }, done)) && passed;
                    }
            }
    return passed ? 0 : 1;
}
