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
            const Neighbours near = named(at);
            const System s = system_of({position, left, radius, mass, {}}, near.first, near.second, near.normal);
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
                }
                found.normal.insert(found.normal.end(), near.normal.begin(), near.normal.end());
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
