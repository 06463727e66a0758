#include "frames.hpp"

#include <algorithm>

#include "answer.hpp"

namespace nscd {

namespace {

// The answer of the frame before helps where it has this share of the contacts.
constexpr double ALIKE = 0.8;
// Centres that are nearer to each other, or to a wall, than this (m) have no normal, or none that is known.
constexpr double SAME_PLACE = 1e-290;

// What is known of the frame before.
struct Before {
    std::vector<std::int64_t> keys;            // (k) of its contacts, rising
    std::span<const std::int64_t> ids;         // (n) of its disks
    Numbers reaction, velocity;                // empty where it was not answered
};

// The answer before for the contacts and disks of this frame; none where few of them were there.
void guess(const Before& before, const std::vector<std::int64_t>& keys, std::span<const std::int64_t> ids, In left, Asked& asked) {
    asked.reaction.clear(), asked.velocity.clear();
    if (before.reaction.empty()) return;
    Carried reaction = carried_over(before.keys, before.reaction, keys);
    if (double(reaction.known) < ALIKE * double(keys.size()) || largest(reaction.values) == 0.0) return;
    asked.velocity.assign(left.begin(), left.end());
    std::size_t at = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        while (at < before.ids.size() && before.ids[at] < ids[i]) ++at;
        if (at < before.ids.size() && before.ids[at] == ids[i])
            for (int a = 0; a < 2; ++a) asked.velocity[2 * i + a] = before.velocity[2 * at + a];
    }
    asked.reaction = std::move(reaction.values);
}

// Whether contacts can be computed with: see `find_contacts`, which says what is wrong.
bool sound(const Touching& at, In radius, double deepest) {
    for (std::size_t c = 0; c < at.size(); ++c) {
        double least = radius[at.first[c]];
        if (std::int64_t(c) < at.pairs) least = std::min(least, radius[at.second[c]]);
        if (!(at.distance[c] > SAME_PLACE && -at.gap[c] / least <= deepest)) return false;
    }
    return at.pairs >= 0;
}

}  // namespace

System system_at(const Touching& at, In mass, In left) {
    System s;
    const std::size_t k = at.size(), n = mass.size();
    s.n = int(n), s.k = int(k);
    s.first.resize(k), s.second.resize(k), s.nx.resize(k), s.ny.resize(k), s.inverse_mass.resize(k);
    for (std::size_t c = 0; c < k; ++c) {
        s.first[c] = Index(at.first[c]);
        s.second[c] = std::int64_t(c) < at.pairs ? Index(at.second[c]) : -1;
        s.nx[c] = at.vector[2 * c] / at.distance[c], s.ny[c] = at.vector[2 * c + 1] / at.distance[c];
        s.inverse_mass[c] = 1.0 / mass[s.first[c]] + (s.second[c] >= 0 ? 1.0 / mass[s.second[c]] : 0.0);
    }
    s.offset.assign(k, 0.0);
    s.mass.resize(2 * n);
    for (std::size_t i = 0; i < 2 * n; ++i) s.mass[i] = mass[i / 2];
    s.left.assign(left.begin(), left.end());
    s.free = s.left;
    s.measure();
    return s;
}

FilmAnswer solve_film(const Film& film, const FramesAsked& asked) {
    const std::size_t frames = film.start.size() - 1;
    FilmAnswer found;
    found.start.assign(frames + 1, 0), found.answered.assign(frames, 0);
    found.residual.assign(frames, 0.0), found.velocity_error.assign(frames, 0.0);
    Before before;
    Asked search;
    search.tolerance = asked.tolerance, search.least = asked.least;
    for (std::size_t f = 0; f < frames; ++f) {
        const std::size_t a = film.start[f], n = film.start[f + 1] - film.start[f];
        const In position = film.position.subspan(2 * a, 2 * n), left = film.left.subspan(2 * a, 2 * n);
        const In radius = film.radius.subspan(a, n), mass = film.mass.subspan(a, n);
        const auto ids = film.ids.subspan(a, n);
        double far = film.walls.far, smallest = INFINITE, whole = 0.0;
        for (double x : position) far = std::max(far, std::abs(x));
        for (std::size_t i = 0; i < n; ++i) smallest = std::min(smallest, radius[i]), whole += mass[i];
        const double gap = asked.gap + rounding_of(far);
        bool solved = far <= FARTHEST * smallest && asked.gap <= smallest;
        Touching at;
        if (solved) at = touching(position, radius, film.walls, gap);
        solved = solved && sound(at, radius, asked.deepest);
        const bool any = solved && at.size() > 0;
        if (any) {
            System s = system_at(at, mass, left);
            s.x.resize(n), s.y.resize(n);
            for (std::size_t i = 0; i < n; ++i) s.x[i] = position[2 * i], s.y[i] = position[2 * i + 1];
            std::vector<std::int64_t> keys = keys_of(at, ids);
            guess(before, keys, ids, left, search);
            Answer answer = climb(s, search);
            Certificate of = certified(s, answer.reaction, answer.velocity);
            // reactions that are not known to be canonical may depend on the frame before
            solved = of.finite && std::isfinite(answer.distance) && std::max(of.residual, of.momentum_error) <= asked.tolerance &&
                     (answer.least || !asked.least);
            if (solved) {
                for (std::size_t c = 0; c < at.size(); ++c) {
                    const bool wall = std::int64_t(c) >= at.pairs;
                    found.first.push_back(std::int64_t(a) + at.first[c]);
                    found.second.push_back(wall ? at.second[c] : std::int64_t(a) + at.second[c]);
                    found.is_wall.push_back(wall);
                    found.normal.push_back(s.nx[c]), found.normal.push_back(s.ny[c]);
                }
                found.gap.insert(found.gap.end(), at.gap.begin(), at.gap.end());
                found.reaction.insert(found.reaction.end(), answer.reaction.begin(), answer.reaction.end());
                found.impulse.insert(found.impulse.end(), of.impulse.begin(), of.impulse.end());
                found.residual[f] = of.residual, found.velocity_error[f] = answer.distance / std::sqrt(whole);
                before = {std::move(keys), ids, std::move(answer.reaction), std::move(answer.velocity)};
            }
        }
        if (!(any && solved)) before.reaction.clear();
        found.answered[f] = solved;
        found.start[f + 1] = std::int64_t(found.gap.size());
    }
    return found;
}

}  // namespace nscd
