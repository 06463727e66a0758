#include "solve_frames.hpp"

#include <algorithm>

#include "impact_solver.hpp"

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
    Vector reaction, velocity;                // empty where it was not answered
};

// The answer before for the contacts and disks of this frame; none where few of them were there.
void guess(const Before& before, const std::vector<std::int64_t>& keys, std::span<const std::int64_t> ids, In left_velocity, Options& options) {
    options.reaction.clear(), options.velocity.clear();
    if (before.reaction.empty()) return;
    Carried reaction = carried_over(before.keys, before.reaction, keys);
    if (double(reaction.matched) < ALIKE * double(keys.size()) || max_abs(reaction.values) == 0.0) return;
    options.velocity.assign(left_velocity.begin(), left_velocity.end());
    std::size_t at = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        while (at < before.ids.size() && before.ids[at] < ids[i]) ++at;
        if (at < before.ids.size() && before.ids[at] == ids[i])
            for (int a = 0; a < 2; ++a) options.velocity[2 * i + a] = before.velocity[2 * at + a];
    }
    options.reaction = std::move(reaction.values);
}

// Whether contacts can be computed with: see `find_contacts`, which says what is wrong.
bool usable(const ContactPairs& contacts, In radius, double deepest) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        double minimum = radius[contacts.first[c]];
        if (std::int64_t(c) < contacts.pairs) minimum = std::min(minimum, radius[contacts.second[c]]);
        if (!(contacts.distance[c] > SAME_PLACE && -contacts.gap[c] / minimum <= deepest)) return false;
    }
    return contacts.pairs >= 0;
}

}  // namespace

FilmSolution solve_film(const Film& film, const FramesOptions& options) {
    const std::size_t frames = film.start.size() - 1;
    FilmSolution found;
    found.start.assign(frames + 1, 0), found.answered.assign(frames, 0);
    found.residual.assign(frames, 0.0), found.velocity_error.assign(frames, 0.0);
    Before before;
    Options search;
    search.tolerance = options.tolerance, search.canonical = options.canonical;
    for (std::size_t f = 0; f < frames; ++f) {
        const std::size_t a = film.start[f], n = film.start[f + 1] - film.start[f];
        const In position = film.position.subspan(2 * a, 2 * n), left_velocity = film.left_velocity.subspan(2 * a, 2 * n);
        const In radius = film.radius.subspan(a, n), mass = film.mass.subspan(a, n);
        const auto ids = film.ids.subspan(a, n);
        double far = film.walls.far, smallest = INFINITE, total_mass = 0.0;
        for (double x : position) far = std::max(far, std::abs(x));
        for (std::size_t i = 0; i < n; ++i) smallest = std::min(smallest, radius[i]), total_mass += mass[i];
        const double gap = options.gap + rounding_of(far);
        bool solved = far <= FARTHEST * smallest && options.gap <= smallest;
        ContactPairs contacts;
        if (solved) contacts = find_contact_pairs(position, radius, film.walls, gap);
        solved = solved && usable(contacts, radius, options.deepest);
        const bool any = solved && contacts.size() > 0;
        if (any) {
            const Neighbours neighbours = with_normals(contacts);
            const ImpactProblem s = impact_problem_of({position, left_velocity, radius, mass, {}}, neighbours.first, neighbours.second, neighbours.normal);
            std::vector<std::int64_t> keys = keys_of(contacts, ids);
            guess(before, keys, ids, left_velocity, search);
            Solution solution = solve_contacts(s, search);
            Certificate certificate = certificate_of(s, solution.reaction, solution.velocity);
            // reactions that are not known to be canonical may depend on the frame before
            solved = certificate.finite && std::isfinite(solution.error_bound) && std::max(certificate.residual, certificate.momentum_error) <= options.tolerance &&
                     (solution.canonical || !options.canonical);
            if (solved) {
                for (std::size_t c = 0; c < contacts.size(); ++c) {
                    const bool wall = std::int64_t(c) >= contacts.pairs;
                    found.first.push_back(std::int64_t(a) + contacts.first[c]);
                    found.second.push_back(wall ? contacts.second[c] : std::int64_t(a) + contacts.second[c]);
                    found.is_wall.push_back(wall);
                }
                found.normal.insert(found.normal.end(), neighbours.normal.begin(), neighbours.normal.end());
                found.gap.insert(found.gap.end(), contacts.gap.begin(), contacts.gap.end());
                found.reaction.insert(found.reaction.end(), solution.reaction.begin(), solution.reaction.end());
                found.impulse.insert(found.impulse.end(), certificate.impulse.begin(), certificate.impulse.end());
                found.residual[f] = certificate.residual, found.velocity_error[f] = solution.error_bound / std::sqrt(total_mass);
                before = {std::move(keys), ids, std::move(solution.reaction), std::move(solution.velocity)};
            }
        }
        if (!(any && solved)) before.reaction.clear();
        found.answered[f] = solved;
        found.start[f + 1] = std::int64_t(found.gap.size());
    }
    return found;
}

}  // namespace nscd
