// Path following by pivots: from a problem whose answer is known to the one that is asked.
//
// The contact velocities are perturbed, C u + t a and T u + t d, so that percussions at hand are the answer at t = 1. As t goes
// to 0 the answer moves on a piecewise linear path, on which one contact at a time changes its state. Closed contacts yield by
// εw a newton-second away from these percussions, which keeps redundant ones apart. Lemke, Management Science 11 (1965) 681;
// Cottle, Pang & Stone, The Linear Complementarity Problem (1992), section 4.4.
#pragma once

#include <array>

#include "friction_sweeps.hpp"

namespace nscd {

// Random numbers of [0, 1), the same everywhere: Steele, Lea & Flood, OOPSLA (2014) 453.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t word();
    double number() { return double(word() >> 11) * 0x1p-53; }

private:
    std::uint64_t state_;
};

// Compliance of closed contacts about their reference, relative to w. Where a closed contact opens without a new factorisation,
// its square is lost in digits: so a soft one for long paths.
inline constexpr double PATH_SOFT = 1e-5;

class Path {
public:
    enum class End { ARRIVED, LOOP, AWAY, LONG, BROKEN };

    Path(const FrictionProblem& p, FrictionFactor& factor);

    double compliance = PATH_SOFT;
    int pivots = 0;                       // made in all paths

    // Put λ and τ of a nearly converged answer on the corners of their law: 0 where the contact opens by more than it
    // presses, ±μλ where it slides by more than it may still hold.
    static void clean(const FrictionProblem& p, FrictionSolution& iterate);
    // Begin at t = 1 with percussions within their cones; contacts on the brink get up to `noise` m/s away from it.
    void begin(const FrictionSolution& start, double noise, std::uint64_t seed);
    // Follow the path from t = 1, at first in the direction `direction` of t, to t = 0 with at most `max_pivots` pivots.
    End follow(double direction, int max_pivots);
    const States& states() const { return now_; }  // at the end
    FrictionSolution solution() const;                        // where it arrived

private:
    // What must stay ≥ 0, and its derivative by t: of a closed contact λ, of an open one its gap; where it sticks what is left
    // of friction either way; where it slides how fast, and p_n; where nothing holds −p_n. Infinite where another says the same.
    struct Margin {
        double value = INFINITE, rate = 0.0;
    };
    using Margins = std::array<Margin, 3>;
    Margins margins(int c, double t) const;
    struct Event {
        double step = INFINITE;
        int contact = -1, which = 0;
    };
    Event next_event(double t, double direction);
    int change(const Event& event, double t);
    int change_tangential_state(int c, int which, double t);
    void set_forces(std::array<Vector, 4>& x, double t, double offset) const;
    bool restart(double t);
    void add_column(int c);
    void find_rate();
    void move(double step);

    const FrictionProblem& p_;
    FrictionFactor& factor_;
    States now_, base_;                      // states now, and when the matrix was factorised
    Vector origin_;                         // (n·3) velocities where the path begins
    std::array<Vector, 2> start_, reference_, push_;  // (k) C u − b and T u, λ and τ there; a and d
    std::array<Vector, 2> firm_;            // (k) 1/(εw) and 1/(εw_t)
    Vector reference_push_;                      // (k) N·s, p_n where the path begins
    Vector u_, rate_, base_rate_;           // (n·3) by how much velocities have changed since, so that what firm contacts make of
                                             // a change is not lost in the digits of the whole; derivatives by t, with the
                                             // states now and with those of the factor
    std::array<Vector, 4> x_, dx_;          // (k) the same of C u, T u, λ and τ
    Indices changed_, slot_;                  // contacts whose state is not that of `base_`, and where they are among them
    Weights weights_;
    std::vector<Vector> columns_;           // what unit percussions along n and t of each do with the factor's matrix
    Vector gram_, base_rate_at_;                   // at each other; `base_rate_` at each
    Vector residual_, matrix_, solution_, normal_, tangential_;
    std::vector<std::uint64_t> visited_;
};

// Put λ and τ back into their cones; velocities that balance them, where nothing dissipates.
void into_cones(const FrictionProblem& p, FrictionSolution& iterate);

// The proximal point method, each step of which is made exactly, by a path of pivots.
//
// A step asks for percussions that obey the law while closed contacts yield by εw a newton-second away from the percussions
// before. It passes the folds at which Newton's method on the same equations stops. Contacts get firmer where few of them
// change their state, and softer where the path closes on itself: with soft contacts the step is short, and its answer is the
// only one. Where percussions have no bound or no single value they drift, and firm steps are what takes the drift to the next
// change of a state. Rockafellar, SIAM J. Control Optim. 14 (1976) 877.
class ProximalPoints {
public:
    ProximalPoints(const FrictionProblem& p, Path& path, FrictionSolution at);
    // Make one step: whether it was made. λ and τ after it; what it cost, in pivots.
    bool step();
    const FrictionSolution& at() const { return at_; }
    int pivots = 0, cost = 0;             // of the last step

private:
    const FrictionProblem& p_;
    Path& path_;
    FrictionSolution at_;
    double compliance_;
    int max_pivots_, tries_ = 0;
};

}  // namespace nscd
