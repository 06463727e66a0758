// Impulses summed contact by contact: over the steps of a rigid motion, and over those of an engine.
#pragma once

#include <algorithm>
#include <utility>

#include "arrays.hpp"

namespace nscd {

// Sums by key, found by hashing. No key is 0.
template <class Sum>
class Keyed {
public:
    Sum& at(std::int64_t key) {
        if (2 * (used_ + 1) > slots_.size()) widen();
        auto& [stored_key, sum] = place_of(key);
        if (stored_key == 0) stored_key = key, ++used_;
        return sum;
    }
    // All of them, by key; then there are none.
    std::vector<std::pair<std::int64_t, Sum>> take() {
        std::vector<std::pair<std::int64_t, Sum>> sums;
        for (auto& slot : slots_)
            if (slot.first) sums.push_back(std::exchange(slot, {}));
        std::sort(sums.begin(), sums.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
        used_ = 0;
        return sums;
    }

private:
    std::pair<std::int64_t, Sum>& place_of(std::int64_t key) {
        std::size_t slot = (std::uint64_t(key) * 0x9E3779B97F4A7C1u) >> 20;
        while (slots_[slot &= slots_.size() - 1].first != 0 && slots_[slot].first != key) ++slot;
        return slots_[slot];
    }
    void widen() {
        auto entries = std::exchange(slots_, std::vector<std::pair<std::int64_t, Sum>>(2 * slots_.size()));
        for (auto& slot : entries)
            if (slot.first) place_of(slot.first) = slot;
    }
    std::vector<std::pair<std::int64_t, Sum>> slots_ = std::vector<std::pair<std::int64_t, Sum>>(1 << 12);
    std::size_t used_ = 0;
};

inline constexpr int ID_BITS = 31;  // numbers of disks, and with walls behind them, are below 2³¹
inline constexpr std::int64_t ID_MASK = (std::int64_t{1} << ID_BITS) - 1;

// Of a window of time of n disks.
class WindowSums {
public:
    explicit WindowSums(std::int64_t n) : n_(n) {}
    struct Sum {
        std::int64_t steps = 0;             // in how many steps it was pressed
        double x = 0.0, y = 0.0, gap = 0.0; // normal and gap of the last of them
        double px = 0.0, py = 0.0;
    };
    // friction (k) N·s along (−n_y, n_x), or none.
    void add(std::span<const Index> first, std::span<const Index> second, std::span<const Index> wall, In normal, In gap, In reaction, In friction);
    std::vector<std::pair<std::int64_t, Sum>> close() { return sums_.take(); }  // key: first · 2³¹ + second, or n + wall

private:
    std::int64_t n_;
    Keyed<Sum> sums_;
};

// Of an engine whose disks have ids, between two frames.
class EngineSums {
public:
    struct Sum { double x = 0.0, y = 0.0; };
    static constexpr std::int64_t WALL = std::int64_t{1} << 2 * ID_BITS;
    // Pairs: ids (k·2); forces (k·4) N on the first, two parts (x, y); times: s, what makes their sum the impulse on the second.
    void add_pairs(In ids, In forces, double times);
    // Disks at a wall, numbered from 1: rows (n·columns) of whether it is touched, and the force (x, y) N on the disk.
    void add_wall(std::int64_t wall, std::span<const Index> ids, In rows, std::size_t columns, double times);
    std::vector<std::pair<std::int64_t, Sum>> close() { return sums_.take(); }  // key: first · 2³¹ + second; WALL + id · 2³¹ + wall

private:
    Keyed<Sum> sums_;
};

}  // namespace nscd
