#include "coarse_grain.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace nscd {

namespace {

using std::numbers::pi;

constexpr int MAX_CELLS = 512;   // along the longer side of the points
// Below this length, in widths, a branch is a point: erf's difference would lose more than the midpoint does.
constexpr double SHORT = 1e-5;

// Points sorted into square cells at least as large as a reach.
class Cells {
public:
    Cells(In points, double reach) : points_(points) {
        const std::size_t m = points.size() / 2;
        double high[2] = {-INFINITE, -INFINITE};
        for (std::size_t i = 0; i < 2 * m; ++i) low_[i & 1] = std::min(low_[i & 1], points[i]), high[i & 1] = std::max(high[i & 1], points[i]);
        side_ = std::max(reach, std::max(high[0] - low_[0], high[1] - low_[1]) / MAX_CELLS);
        for (int a : {0, 1}) count_[a] = m ? std::int64_t((high[a] - low_[a]) / side_) + 1 : 0;
        begins_.assign(count_[0] * count_[1] + 1, 0);
        std::vector<std::int64_t> cell(m);
        for (std::size_t i = 0; i < m; ++i) {
            cell[i] = std::int64_t((points[2 * i] - low_[0]) / side_) * count_[1] + std::int64_t((points[2 * i + 1] - low_[1]) / side_);
            ++begins_[cell[i] + 1];
        }
        std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
        order_.resize(m);
        Starts next(begins_.begin(), begins_.end());
        for (std::size_t i = 0; i < m; ++i) order_[next[cell[i]]++] = Index(i);
    }
    // Visits the points of all cells that a box meets: number, x, y.
    template <class Visit>
    void visit_near(double x0, double x1, double y0, double y1, Visit visit) const {
        const auto first = [&](double z, int a) { return std::int64_t(std::clamp(std::floor((z - low_[a]) / side_), 0.0, double(count_[a]))); };
        const auto last = [&](double z, int a) { return std::int64_t(std::clamp(std::floor((z - low_[a]) / side_), -1.0, double(count_[a] - 1))); };
        const std::int64_t bottom = first(y0, 1), top = last(y1, 1);
        if (bottom > top) return;
        for (std::int64_t column = first(x0, 0); column <= last(x1, 0); ++column)
            for (std::int64_t index = begins_[column * count_[1] + bottom]; index < begins_[column * count_[1] + top + 1]; ++index)
                visit(order_[index], points_[2 * order_[index]], points_[2 * order_[index] + 1]);
    }

private:
    In points_;
    Indices order_;
    Starts begins_;
    double low_[2] = {INFINITE, INFINITE}, side_;
    std::int64_t count_[2];
};

// φ (1/m²) at a squared distance (m²), and s of ∇φ(d) = s·d.
struct At { double value, slope; };
At at(const Kernel& kernel, double square) {
    const double w2 = kernel.width * kernel.width;
    if (kernel.compact) {
        const double inside = std::max(1.0 - square / (10.0 * w2), 0.0), first = inside * inside / (pi * 10.0 * w2);
        return {4.0 * first * inside, -2.4 * first / w2};
    }
    const double value = std::exp(-0.5 * square / w2) / (2.0 * pi * w2);
    return {value, -value / w2};
}

// ∫₀¹ φ ds on a branch of this length, seen from a point that is `along` after its start and `across` beside it (m).
double along_branch(const Kernel& kernel, double along, double across, double length) {
    if (length < SHORT * kernel.width) {
        const double middle = along - 0.5 * length;
        return at(kernel, middle * middle + across * across).value;
    }
    if (kernel.compact) {
        const double square = 10.0 * kernel.width * kernel.width - across * across;
        if (square <= 0.0) return 0.0;
        const double half = std::sqrt(square), a = std::max(-half, -along), b = std::min(half, length - along);
        if (a >= b) return 0.0;
        const double middle = 0.5 * (a + b), reach = 0.5 * (b - a);
        // Gauss–Legendre with 4 points is exact for this polynomial of degree 6
        constexpr double rule[2][2] = {{0.33998104358485626, 0.6521451548625461}, {0.8611363115940526, 0.34785484513745385}};
        double total = 0.0;
        for (const auto& [node, weight] : rule)
            for (double side : {-1.0, 1.0}) {
                const double s = middle + side * node * reach;
                total += weight * at(kernel, s * s + across * across).value;
            }
        return total * reach / length;
    }
    const double scale = 1.0 / (std::numbers::sqrt2 * kernel.width), beside = across * scale;
    const double difference = std::erf(along * scale) - std::erf((along - length) * scale);
    return std::exp(-beside * beside) / (2.0 * pi * kernel.width * kernel.width) * difference * kernel.width * std::sqrt(0.5 * pi) / length;
}

}  // namespace

void coarse_grain(In points, In where, In values, const Kernel& kernel, Out field, Out gradient) {
    const Cells cells(points, kernel.reach);
    const std::size_t n = where.size() / 2, d = n ? values.size() / n : 0;
    const double far = kernel.reach * kernel.reach, reach = kernel.reach;
    for (std::size_t i = 0; i < n; ++i) {
        const double x = where[2 * i], y = where[2 * i + 1];
        cells.visit_near(x - reach, x + reach, y - reach, y + reach, [&](Index k, double px, double py) {
            const double dx = px - x, dy = py - y, square = dx * dx + dy * dy;
            if (square > far) return;
            const auto [value, slope] = at(kernel, square);
            for (std::size_t c = 0; c < d; ++c) {
                const double what = values[d * i + c];
                field[d * k + c] += what * value;
                gradient[2 * (d * k + c)] += what * slope * dx, gradient[2 * (d * k + c) + 1] += what * slope * dy;
            }
        });
    }
}

void coarse_grain_stress(In points, const Loads& loads, const Kernel& kernel, Out stress, Out divergence, Out traction) {
    const Cells cells(points, kernel.reach);
    const double far = kernel.reach * kernel.reach, reach = kernel.reach;
    for (std::size_t c = 0; c < loads.is_wall.size(); ++c) {
        const double x = loads.start[2 * c], y = loads.start[2 * c + 1], lx = loads.branch[2 * c], ly = loads.branch[2 * c + 1];
        const double px = loads.impulse[2 * c], py = loads.impulse[2 * c + 1], length = std::sqrt(lx * lx + ly * ly);
        if (px == 0.0 && py == 0.0) continue;
        const double ex = length > 0.0 ? lx / length : 1.0, ey = length > 0.0 ? ly / length : 0.0;
        const auto [left, right] = std::minmax({x, x + lx});
        const auto [low, high] = std::minmax({y, y + ly});
        cells.visit_near(left - reach, right + reach, low - reach, high + reach, [&](Index k, double at_x, double at_y) {
            const double dx = at_x - x, dy = at_y - y, along = dx * ex + dy * ey, across = dy * ex - dx * ey;
            const double beyond = std::max({0.0, -along, along - length});
            if (across * across + beyond * beyond > far) return;
            const double mean = along_branch(kernel, along, across, length);
            stress[4 * k] -= px * lx * mean, stress[4 * k + 1] -= px * ly * mean;
            stress[4 * k + 2] -= py * lx * mean, stress[4 * k + 3] -= py * ly * mean;
            // ℓ·∇ of the line integral is φ at the start less φ at the end
            const double end = at(kernel, (dx - lx) * (dx - lx) + (dy - ly) * (dy - ly)).value;
            const double change = at(kernel, dx * dx + dy * dy).value - end;
            divergence[2 * k] -= px * change, divergence[2 * k + 1] -= py * change;
            if (loads.is_wall[c]) traction[2 * k] -= px * end, traction[2 * k + 1] -= py * end;
        });
    }
}

}  // namespace nscd
