// Crowds through every way of the core, for the sanitizers (`make sanitize`): lattices with vacancies, pressed into each
// other or not, with and without dissipation and friction, by each method, by rows and by fronts, alone and by threads.
// The sanitizer of threads sees only what threads do together.
#include <cstdio>
#include <random>

#include "answer.hpp"
#include "contacts.hpp"
#include "frames.hpp"
#include "friction_answer.hpp"
#include "motion.hpp"

using namespace nscd;

namespace {

#if defined(__SANITIZE_THREAD__)
constexpr bool THREADS_ONLY = true;
#else
constexpr bool THREADS_ONLY = false;
#endif

struct Crowd {
    Numbers position, velocity, radius, mass;
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

bool told(const char* what, int n, bool sound) {
    if (!sound) std::printf("%s: wrong for %d disks\n", what, n);
    return sound;
}

// The same disks as solid ones that rub, some contacts of which dissipate.
Rubbing rubbing(const System& s, const Crowd& c, double dissipation) {
    Rubbing p;
    static_cast<System&>(p) = s;
    p.lever_first = p.lever_second = Numbers(s.k, 0.25);
    p.mass.clear(), p.left.clear();
    for (int i = 0; i < s.n; ++i) {
        for (double m : {c.mass[i], c.mass[i], 0.03125 * c.mass[i]}) p.mass.push_back(m);
        for (double u : {c.velocity[2 * i], c.velocity[2 * i + 1], 0.1}) p.left.push_back(u);
    }
    for (int e = 0; e < s.k; ++e) {
        if (s.second[e] < 0) p.lever_second[e] = 0.0;
        p.friction.push_back(e % 5 ? 0.3 : 0.0);
    }
    p.along.assign(s.k, dissipation), p.across.assign(s.k, 0.0);
    p.scale = 1.0;
    p.prepare();
    return p;
}

}  // namespace

int main() {
    std::mt19937 draw(1);
    const Numbers start{-50.0, 0.0, 0.0, -1.0}, along{100.0, 0.0, 0.0, 50.0};
    const Places vertex{0, 1, 2, 3};
    const Flags inner(4, 0);
    const Segments walls{2, start, along, vertex, inner, 50.0};
    bool sound = true;
    for (int n : {1, 2, 3, 7, 20, 60, 150, 400})
        for (double spacing : {0.49, 0.4999999999})
            for (double decades : {0.0, 4.0}) {
                const Crowd c = crowd(draw, n, spacing, decades);
                const int size = int(c.radius.size());
                const Touching at = touching(c.position, c.radius, walls, 1e-3);
                const Neighbours near = named(at);
                const System s = system_of({c.position, c.velocity, c.radius, c.mass, {}}, near.first, near.second, near.normal);
                if (THREADS_ONLY && n < 60) continue;
                for (int way = THREADS_ONLY ? 6 : 0; way < 8; ++way) {
                    Asked asked;
                    asked.least = way != 1;
                    if (way >= 2 && way <= 3) asked.method = way == 2 ? Method::INTERIOR_POINT : Method::ACTIVE_SET;
                    if (way >= 4) asked.sizes.many = 0;
                    if (way >= 5) asked.sizes.shared = 1, asked.threads = way == 5 ? 1 : 3;
                    System law = s;
                    if (way == 7) {
                        law.along.assign(s.k, 30.0), law.across.assign(s.k, 10.0), law.d = 3;
                        law.lever_first = law.lever_second = Numbers(s.k, 0.25);
                        law.mass.clear(), law.left.clear();
                        for (int i = 0; i < size; ++i) {
                            for (double m : {c.mass[i], c.mass[i], 0.03 * c.mass[i]}) law.mass.push_back(m);
                            for (double u : {c.velocity[2 * i], c.velocity[2 * i + 1], 0.1}) law.left.push_back(u);
                        }
                        law.free = law.left;
                    }
                    const Answer answer = solve_one_sided(law, asked);
                    const Certificate of = certified(law, answer.reaction, answer.velocity);
                    const bool solved = of.finite && of.residual <= 1e-8 && of.momentum_error <= 1e-8;
                    sound = told("answer", size, solved || asked.method == Method::ACTIVE_SET) && sound;
                }
                if (THREADS_ONLY) continue;
                for (double dissipation : {0.0, 10.0}) {
                    if (size > 60 || decades > 0.0) continue;
                    Rubbing p = rubbing(s, c, dissipation);
                    const FrictionAnswer answer = solve_friction(p, {1e-8, size < 8 ? 3 : 1, c.radius});
                    const FrictionCertificate of = certified(p, answer.at);
                    sound = told("friction", size, std::max(of.natural_map, of.momentum_error) <= 1e-8) && sound;
                    if (dissipation == 0.0) solve_friction(p, {.tolerance = 1e-6, .in_step = true, .lam = answer.at.lam, .tau = answer.at.tau}), solve_friction(p, {.tolerance = 1e-6, .in_step = true});
                }
                const std::vector<std::int64_t> frames{0, size};
                std::vector<std::int64_t> ids(size);
                for (int i = 0; i < size; ++i) ids[i] = i + 1;
                const Film film{frames, ids, c.position, c.velocity, c.radius, c.mass, walls};
                sound = told("film", size, solve_film(film, {1e-3, 0.5, 1e-8, true}).answered[0]) && sound;
                for (double tolerance : {1e-8, 1e-4})
                    for (double friction : {0.0, 0.3}) {
                        if (decades > 0.0 || (friction > 0.0 && size > 60)) continue;
                        Motion crowd;
                        crowd.law = {1e-2, 0.5, 0.0, -1.0, 0.3, friction, tolerance, 0.1, 50.0};
                        crowd.walls = walls, crowd.radius = c.radius, crowd.mass = c.mass;
                        crowd.now.position = c.position, crowd.now.velocity = c.velocity, crowd.now.spin.assign(size, 0.0);
                        Report report;
                        for (int step = 0; step < 3; ++step)
                            sound = told("step", size, crowd.advance([](In x) { return Numbers(x.size(), 0.5); }, report)) && sound;
                    }
            }
    return sound ? 0 : 1;
}
