#include "friction_newton.hpp"

#include <algorithm>

#include "rounding.hpp"

namespace nscd {

namespace {

// Of the central path: iterations at most, and without progress (ten times as many far from the answer).
constexpr int ITERATIONS = 100, PATIENCE = 5;
constexpr double NEAR_ANSWER = 1e-6;
// Compliance of the edges relative to their Delassus diagonal: a proximal term of the iteration only.
constexpr double EDGE_RIGID = 1e-14, LEAST_EDGE = 1e-300;
// Equalities are met to this share of the scale, or until a step no longer halves what is missed.
constexpr double MET = 1e-15, SLOWER = 0.5;

void set_sliding(const FrictionProblem& p, const States& states, In v, FrictionSolution& iterate) {
    for (int c = 0; c < p.k; ++c)
        if (states.tangential_state[c] != STICK) iterate.tangential[c] = slope(states.tangential_state[c], p.friction[c]) * normal_push(p, c, v[c], iterate.reaction[c]);
}

}  // namespace

States::States(Mask tangential_states) : closed(tangential_states.size()), tangential_state(std::move(tangential_states)) {
    for (std::size_t c = 0; c < tangential_state.size(); ++c) closed[c] = tangential_state[c] != FREE;
}

std::uint64_t States::key() const {
    std::uint64_t key = 1469598103934665603u;
    for (std::size_t c = 0; c < tangential_state.size(); ++c) {
        key ^= 4u * closed[c] + tangential_state[c] + 1u;
        key *= 1099511628211u;
        key ^= key >> 29;
    }
    return key;
}

void find_states(const FrictionProblem& p, In v, In s, In lam, In tau, States& states) {
    for (int c = 0; c < p.k; ++c) {
        const double pressed = lam[c] + (v[c] - p.max_approach[c]) / p.inverse_mass[c];
        const double normal = p.normal_dashpot[c] * (v[c] + p.left_approach[c]) + std::max(pressed, 0.0);
        const double limit = p.friction[c] * std::max(normal, 0.0), wanted = tau[c] + s[c] / p.tangent_inverse[c];
        states.closed[c] = pressed > 0.0;
        states.tangential_state[c] = !(normal > 0.0) ? FREE : wanted > limit ? FORWARD : wanted < -limit ? BACKWARD : limit == 0.0 ? FORWARD : STICK;
    }
}

States states_of(const FrictionProblem& p, const FrictionSolution& iterate) {
    States states(p.k);
    Vector v(p.k), s(p.k);
    contact_velocities(p, iterate.velocity, v, s);
    find_states(p, v, s, iterate.reaction, iterate.tangential, states);
    return states;
}

bool solve_fixed_state(const FrictionProblem& p, FrictionFactor& factor, const States& states, double penalty, int steps, FrictionSolution& iterate) {
    const int k = p.k;
    Weights weights(k);
    Vector v(k), s(k), dv(k), ds(k), normal(k), tangential(k), residual(p.mass.size());
    for (int c = 0; c < k; ++c) {
        weights.nn[c] = p.normal_dashpot[c], weights.tt[c] = p.tangential_dashpot[c];
        if (states.closed[c]) weights.nn[c] += penalty / p.inverse_mass[c];
        else iterate.reaction[c] = 0.0;
        if (states.tangential_state[c] == STICK) weights.tt[c] += penalty / p.tangent_inverse[c];
        weights.tn[c] = slope(states.tangential_state[c], p.friction[c]) * weights.nn[c];
    }
    if (!factor.factorise(p, weights)) return false;
    double before = INFINITE;
    contact_velocities(p, iterate.velocity, v, s);
    for (int step = 0; step < steps; ++step) {
        double unbalanced = 0.0;
        set_sliding(p, states, v, iterate);
        for (int c = 0; c < k; ++c) {
            normal[c] = tangential[c] = 0.0;
            if (states.closed[c]) {
                unbalanced = max_or_nan(unbalanced, std::abs(v[c] - p.max_approach[c]));
                normal[c] = penalty / p.inverse_mass[c] * (v[c] - p.max_approach[c]);
                tangential[c] = slope(states.tangential_state[c], p.friction[c]) * normal[c];
            }
            if (states.tangential_state[c] == STICK) {
                unbalanced = max_or_nan(unbalanced, std::abs(s[c]));
                tangential[c] = penalty / p.tangent_inverse[c] * s[c];
            }
        }
        imbalance(p, iterate.velocity, v, s, iterate.reaction, iterate.tangential, residual);
        for (int i = 0; i < p.n; ++i)
            for (int a = 0; a < 2; ++a) unbalanced = max_or_nan(unbalanced, std::abs(residual[3 * i + a]) / p.mass[3 * i + a]);
        if (unbalanced <= MET * p.scale || !(unbalanced <= SLOWER * before)) break;
        before = unbalanced;
        for (double& value : residual) value = -value;
        add_impulses(p, normal, tangential, -1.0, residual);
        factor.solve(residual);
        contact_velocities(p, residual, dv, ds);
        for (int c = 0; c < k; ++c) {
            if (states.closed[c]) iterate.reaction[c] += normal[c] + penalty / p.inverse_mass[c] * dv[c];
            if (states.tangential_state[c] == STICK) iterate.tangential[c] += tangential[c] + penalty / p.tangent_inverse[c] * ds[c];
        }
        for (std::size_t i = 0; i < residual.size(); ++i) iterate.velocity[i] += residual[i];
        contact_velocities(p, iterate.velocity, v, s);
    }
    set_sliding(p, states, v, iterate);
    return true;
}

Vector newton(const FrictionProblem& p, FrictionFactor& factor, States states, FrictionSolution& iterate, double tolerance, int rounds, double penalty) {
    Vector best = island_errors(p, iterate);
    FrictionSolution best_solution = iterate;
    std::vector<std::uint64_t> visited;
    for (int round = 0; round < rounds; ++round) {
        const std::uint64_t key = states.key();
        if (std::find(visited.begin(), visited.end(), key) != visited.end()) break;
        visited.push_back(key);
        if (!solve_fixed_state(p, factor, states, penalty, FRICTION_STEPS, iterate)) break;
        const Vector error = island_errors(p, iterate);
        for (int c = 0; c < p.k; ++c) {
            const Index island = p.island[p.first[c]];
            if (error[island] < best[island]) best_solution.reaction[c] = iterate.reaction[c], best_solution.tangential[c] = iterate.tangential[c];
        }
        for (int i = 0; i < p.n; ++i)
            if (error[p.island[i]] < best[p.island[i]]) std::copy_n(iterate.velocity.begin() + 3 * i, 3, best_solution.velocity.begin() + 3 * i);
        double worst = 0.0;
        bool wild = false;
        for (std::size_t m = 0; m < best.size(); ++m) {
            best[m] = std::min(best[m], error[m]);
            worst = std::max(worst, best[m]);
            wild = wild || !(error[m] < INFINITE);
        }
        if (worst <= tolerance || wild) break;
        states = states_of(p, iterate);
    }
    iterate = std::move(best_solution);
    return best;
}

FrictionSolution convex_programme(const FrictionProblem& p, FrictionFactor& factor, double accuracy) {
    const int k = p.k;
    const std::size_t size = p.mass.size();
    Weights weights(k);
    Vector v(k), s(k), normal(k), tangential(k), theta(2 * k), wanted(2 * k), primal(2 * k), moved(2 * k), product(2 * k), slack_step(2 * k),
        edge_step(2 * k), weight(k), dual(size), step(size), slack(2 * k), edge(2 * k), u = p.left_velocity;
    FrictionSolution best{Vector(k, 0.0), Vector(k, 0.0), p.left_velocity};
    double best_error = INFINITE;
    for (int c = 0; c < k; ++c) weight[c] = p.inverse_mass[c] + p.friction[c] * p.friction[c] * p.tangent_inverse[c];
    const double minimum = *std::min_element(weight.begin(), weight.end());
    for (int e = 0; e < 2 * k; ++e) slack[e] = p.scale * std::sqrt(weight[e / 2] / minimum), edge[e] = p.scale / std::sqrt(weight[e / 2] * minimum);
    const auto edge_velocities = [&](In iterate) {
        contact_velocities(p, iterate, v, s);
        for (int c = 0; c < k; ++c) moved[2 * c] = v[c] + p.friction[c] * s[c], moved[2 * c + 1] = v[c] - p.friction[c] * s[c];
    };
    const auto percussions = [&](In multipliers) {
        for (int c = 0; c < k; ++c) {
            normal[c] = multipliers[2 * c] + multipliers[2 * c + 1];
            tangential[c] = p.friction[c] * (multipliers[2 * c] - multipliers[2 * c + 1]);
        }
    };
    int iteration = 0, stalled = 0;
    while (true) {
        edge_velocities(u);
        percussions(edge);
        imbalance(p, u, v, s, normal, tangential, dual);
        double mean = 0.0, error = 0.0;
        for (int e = 0; e < 2 * k; ++e) {
            const double gap = p.max_approach[e / 2] - moved[e];
            primal[e] = slack[e] - gap;
            mean += slack[e] * edge[e] / (2 * k);
            error = max_or_nan(error, std::abs(std::min(weight[e / 2] * edge[e], gap)));
        }
        for (int i = 0; i < p.n; ++i)
            for (int a = 0; a < 2; ++a) error = max_or_nan(error, std::abs(dual[3 * i + a]) / p.mass[3 * i + a]);
        error /= p.scale;
        stalled = error < 0.9 * best_error ? 0 : stalled + 1;
        if (error < best_error) best_error = error, best = {normal, tangential, u};
        if (error <= accuracy || !(error < INFINITE) || iteration == ITERATIONS) break;
        if (stalled > (best_error < NEAR_ANSWER ? PATIENCE : 10 * PATIENCE)) break;
        ++iteration;
        for (int c = 0; c < k; ++c) {
            const double one = theta[2 * c] = 1.0 / (slack[2 * c] / edge[2 * c] + EDGE_RIGID * weight[c]);
            const double two = theta[2 * c + 1] = 1.0 / (slack[2 * c + 1] / edge[2 * c + 1] + EDGE_RIGID * weight[c]);
            const double mu = p.friction[c];
            weights.nn[c] = one + two + p.normal_dashpot[c];
            weights.tt[c] = mu * mu * (one + two) + p.tangential_dashpot[c];
            weights.tn[c] = weights.nt[c] = mu * (one - two);
        }
        for (int e = 0; e < 2 * k; ++e) product[e] = slack[e] * edge[e];
        if (!factor.factorise(p, weights)) break;
        double length = 0.0;
        for (int stage = 0; stage < 2; ++stage) {  // predictor, corrector
            for (int e = 0; e < 2 * k; ++e) {
                wanted[e] = primal[e] - product[e] / edge[e];
                moved[e] = theta[e] * wanted[e];
            }
            for (std::size_t i = 0; i < size; ++i) step[i] = -dual[i];
            percussions(moved);
            add_impulses(p, normal, tangential, -1.0, step);
            factor.solve(step);
            edge_velocities(step);
            double fastest = 1.0;
            for (int e = 0; e < 2 * k; ++e) {
                edge_step[e] = theta[e] * (moved[e] + wanted[e]);
                slack_step[e] = -(product[e] + slack[e] * edge_step[e]) / edge[e];
                fastest = std::max({fastest, -slack_step[e] / slack[e], -edge_step[e] / edge[e]});
            }
            length = 1.0 / fastest;
            if (stage == 1) continue;
            double after = 0.0;
            for (int e = 0; e < 2 * k; ++e) after += (slack[e] + length * slack_step[e]) * (edge[e] + length * edge_step[e]) / (2 * k);
            double centring = cube(after / mean);
            if (length < 0.1) centring = std::max(centring, 0.3);
            for (int e = 0; e < 2 * k; ++e) product[e] += slack_step[e] * edge_step[e] - centring * mean;
        }
        length *= std::min(std::max(0.995, 1.0 - 10.0 * error), 0.99999);
        for (std::size_t i = 0; i < size; ++i) u[i] += length * step[i];
        for (int e = 0; e < 2 * k; ++e) {
            slack[e] = std::max(slack[e] + length * slack_step[e], LEAST_EDGE);
            edge[e] = std::max(edge[e] + length * edge_step[e], LEAST_EDGE);
        }
    }
    return best;
}

}  // namespace nscd
