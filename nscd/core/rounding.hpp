// Functions made of operations that IEEE 754 fixes. Those of libm, sqrt aside, differ in the last digit between processors and
// libraries, and with them a crowd's whole future.
#pragma once

#include <cmath>

namespace nscd {

inline double cube(double x) { return x * x * x; }

struct Turn { double cosine, sine; };

// Series at a small share of the angle (rad), which is doubled again.
inline Turn turn_by(double angle) {
    int doublings = 0;
    for (; std::abs(angle) > 0.125 && doublings < 64; ++doublings) angle *= 0.5;
    const double q = angle * angle;
    double sine = angle * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))));
    double less = 0.5 * q * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0)))));  // 1 − cos
    for (; doublings > 0; --doublings) {
        const double half = sine;
        sine = 2.0 * half * (1.0 - less), less = 2.0 * half * half;
    }
    return {1.0 - less, sine};
}

// −log(1 − u) for u in [0, 1), a draw of the exponential law where u is uniform.
inline double exponential_of(double u) {
    int power = 0;
    double part = std::frexp(1.0 - u, &power);
    if (part < 0.7071067811865476) part *= 2.0, --power;
    const double t = (part - 1.0) / (part + 1.0), q = t * t;
    double sum = 0.0;
    for (int odd = 23; odd > 0; odd -= 2) sum = sum * q + 1.0 / odd;
    return -(power * 0.6931471805599453 + 2.0 * t * sum);
}

}  // namespace nscd
