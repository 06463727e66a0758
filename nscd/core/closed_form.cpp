#include "closed_form.hpp"

#include <algorithm>

namespace nscd {

int components(int n, std::span<const Index> first, std::span<const Index> second, Indices& label) {
    Indices root(n);
    for (int i = 0; i < n; ++i) root[i] = i;
    const auto find = [&](Index i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (std::size_t c = 0; c < first.size(); ++c) {
        if (second[c] < 0) continue;
        const Index i = find(first[c]), j = find(second[c]);
        root[std::max(i, j)] = std::min(i, j);
    }
    label.resize(n);
    int count = 0;
    for (int i = 0; i < n; ++i)  // a root comes before all that it leads
        label[i] = root[i] == i ? count++ : label[find(root[i])];
    return count;
}

Islands islands_of(const ImpactProblem& s) {
    Islands islands;
    islands.count = components(s.n, s.first, s.second, islands.label);
    islands.contacts.assign(islands.count, 0), islands.disks.assign(islands.count, 0);
    islands.pressed.assign(islands.count, 0), islands.forest.assign(islands.count, 0);
    Mask walled(islands.count, 0);
    Vector v(s.k);
    approach(s, s.free, v);
    for (int i = 0; i < s.n; ++i) ++islands.disks[islands.label[i]];
    for (int c = 0; c < s.k; ++c) {
        const Index island = islands.label[s.first[c]];
        ++islands.contacts[island];
        if (s.second[c] < 0) walled[island] = 1;
        if (v[c] > s.max_approach[c]) islands.pressed[island] = 1;
    }
    for (int m = 0; m < islands.count; ++m) islands.forest[m] = islands.contacts[m] < islands.disks[m] + walled[m];
    return islands;
}

RemainingContacts solve_single_contacts(const ImpactProblem& s, Vector& reaction, Vector& velocity) {
    const Islands islands = islands_of(s);
    const auto has_many = [&](Index island) {
        return islands.pressed[island] && (islands.contacts[island] > 1 || s.dissipative() || s.compound());
    };
    reaction.assign(s.k, 0.0);
    velocity = s.free;
    RemainingContacts remaining;
    remaining.index.assign(s.n, -1);
    for (int c = 0; c < s.k; ++c) {
        const Index i = s.first[c], j = s.second[c], island = islands.label[i];
        if (has_many(island)) {
            remaining.contact.push_back(c);
            remaining.forest = remaining.forest && islands.forest[island];
        } else if (islands.pressed[island]) {
            remaining.single = true;
            double closing = s.nx[c] * s.free[2 * i] + s.ny[c] * s.free[2 * i + 1] - s.max_approach[c];
            if (j >= 0) closing -= s.nx[c] * s.free[2 * j] + s.ny[c] * s.free[2 * j + 1];
            reaction[c] = std::max(closing / s.inverse_mass[c], 0.0);
            const double normal[2] = {s.nx[c], s.ny[c]};
            for (int a = 0; a < 2; ++a) {
                velocity[2 * i + a] -= reaction[c] * normal[a] / s.mass[2 * i + a];
                if (j >= 0) velocity[2 * j + a] += reaction[c] * normal[a] / s.mass[2 * j + a];
            }
        }
    }
    for (int i = 0; i < s.n; ++i)
        if (has_many(islands.label[i])) {
            remaining.index[i] = Index(remaining.disk.size());
            remaining.disk.push_back(i);
        }
    return remaining;
}

Branches branches_of(const ImpactProblem& s) {
    Starts start(s.n + 1, 0);
    for (int c = 0; c < s.k; ++c)
        if (s.second[c] >= 0) ++start[s.first[c] + 1], ++start[s.second[c] + 1];
    for (int a = 0; a < s.n; ++a) start[a + 1] += start[a];
    Indices contact(start[s.n]);
    Starts at(start.begin(), start.end() - 1);
    Branches branches{Indices(s.n), Indices(s.n, -1), Indices(s.n, -1)};
    for (int c = 0; c < s.k; ++c) {
        if (s.second[c] >= 0)
            contact[at[s.first[c]]++] = contact[at[s.second[c]]++] = c;
        else
            branches.link[s.first[c]] = c;
    }
    Mask visited(s.n, 0);
    int count = 0;
    for (bool walled : {true, false})  // a tree with a wall contact grows from there
        for (int root = 0; root < s.n; ++root) {
            if (visited[root] || (walled && branches.link[root] < 0)) continue;
            visited[root] = 1;
            int head = count;
            branches.order[count++] = root;
            for (; head < count; ++head) {
                const Index a = branches.order[head];
                for (auto e = start[a]; e < start[a + 1]; ++e) {
                    const Index c = contact[e], b = s.first[c] == a ? s.second[c] : s.first[c];
                    if (visited[b]) continue;
                    visited[b] = 1;
                    branches.parent[b] = a, branches.link[b] = c;
                    branches.order[count++] = b;
                }
            }
        }
    return branches;
}

void close_tree(const ImpactProblem& s, const Branches& branches, MaskView closed, In free, In max_approach, Out reaction, Out u) {
    struct Body {
        double xx, xy, yy;  // kg, A
        double px, py;      // kg m/s, A u of the disk and all behind it, left to itself
        double ux, uy;      // m/s, that u
        double bx, by;      // 1/kg, A⁻¹ n
        double effective_mass;  // kg, 1/(n·A⁻¹n)
    };
    std::vector<Body> bodies(s.n);
    for (int a = 0; a < s.n; ++a) {
        const double m = s.mass[2 * a];
        bodies[a] = {m, 0.0, m, m * free[2 * a], m * free[2 * a + 1], 0.0, 0.0, 0.0, 0.0, 0.0};
    }
    for (int q = s.n - 1; q >= 0; --q) {
        const Index a = branches.order[q], c = branches.link[a], p = branches.parent[a];
        Body& b = bodies[a];
        const double determinant = b.xx * b.yy - b.xy * b.xy;
        b.ux = (b.yy * b.px - b.xy * b.py) / determinant;
        b.uy = (b.xx * b.py - b.xy * b.px) / determinant;
        if (c < 0 || !closed[c]) continue;
        const double x = s.nx[c], y = s.ny[c];
        b.bx = (b.yy * x - b.xy * y) / determinant;
        b.by = (b.xx * y - b.xy * x) / determinant;
        b.effective_mass = 1.0 / (x * b.bx + y * b.by);
        if (p < 0) continue;
        const double sign = s.first[c] == a ? 1.0 : -1.0;
        const double pull = b.effective_mass * (x * b.ux + y * b.uy - sign * max_approach[c]);
        Body& on = bodies[p];
        on.xx += b.effective_mass * x * x, on.xy += b.effective_mass * x * y, on.yy += b.effective_mass * y * y;
        on.px += pull * x, on.py += pull * y;
    }
    std::fill(reaction.begin(), reaction.end(), 0.0);
    for (int q = 0; q < s.n; ++q) {
        const Index a = branches.order[q], c = branches.link[a], p = branches.parent[a];
        const Body& b = bodies[a];
        u[2 * a] = b.ux, u[2 * a + 1] = b.uy;
        if (c < 0 || !closed[c]) continue;
        const double x = s.nx[c], y = s.ny[c], sign = s.first[c] == a ? 1.0 : -1.0;
        double wanted = sign * max_approach[c];
        if (p >= 0) wanted += x * u[2 * p] + y * u[2 * p + 1];
        reaction[c] = sign * b.effective_mass * (x * b.ux + y * b.uy - wanted);
        u[2 * a] -= sign * reaction[c] * b.bx;
        u[2 * a + 1] -= sign * reaction[c] * b.by;
    }
}

int solve_tree(const ImpactProblem& s, const Branches& branches, Vector& reaction, Vector& velocity) {
    constexpr int ROUNDS = 50;
    Mask closed(s.k, 1);
    Vector v(s.k);
    reaction.assign(s.k, 0.0);
    velocity.resize(2 * std::size_t(s.n));
    int done = 0;
    for (bool changed = true; changed && done < ROUNDS;) {
        ++done;
        close_tree(s, branches, closed, s.free, s.max_approach, reaction, velocity);
        approach(s, velocity, v);
        changed = false;
        for (int c = 0; c < s.k; ++c) {
            // a closed contact stays so unless it pulls: its own velocity is rounding
            const bool now = closed[c] ? reaction[c] >= 0.0 : s.inverse_mass[c] * reaction[c] > s.max_approach[c] - v[c];
            changed = changed || now != bool(closed[c]);
            closed[c] = now;
        }
    }
    for (double& r : reaction) r = std::max(r, 0.0);
    return done;
}

Vector clamped_dashpots(const ImpactProblem& s, const Vector& normal_dashpot, In u) {
    Vector total(u.size()), v(s.k), now = normal_dashpot;
    for (std::size_t i = 0; i < u.size(); ++i) total[i] = u[i] + s.left_velocity[i];
    approach(s, total, v);
    for (int c = 0; c < s.k; ++c)
        if (!(v[c] >= -APPROACH_ROUNDING * s.scale)) now[c] = 0.0;
    return now;
}

}  // namespace nscd
