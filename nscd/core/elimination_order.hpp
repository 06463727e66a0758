// In which order disks are eliminated: by minimum degree in small crowds, by nested dissection in large ones.
#pragma once

#include "problem.hpp"
#include "team.hpp"

namespace nscd {

// A crowd of at least SHARED disks is cut into parts on which threads work at the same time.
inline constexpr int SHARED = 10'000;

// Neighbours of each disk a: neighbour[start[a]] … neighbour[start[a + 1] − 1].
struct Graph {
    Starts start;
    Indices neighbour;
};
Graph graph_of(int n, const Indices& first, const Indices& second);

struct Ordering {
    Indices order, index;                       // (n) the disk at each place, and its inverse
    Indices node_first, node_end, node_parent;  // (m) places that each node of the separator tree eliminates,
                                               // children before parents; its parent, −1 at the root
};

// Eliminate a disk with the fewest neighbours, which become neighbours of each other, and so on. Neighbours are
// kept as bits, n²/8 bytes: for crowds of up to some thousands. George & Liu, SIAM Review 31 (1989) 1.
Ordering minimum_degree(const Graph& graph);

// Cut the crowd in two near the median of its longer side, through as few disks as possible, eliminate these
// last, and so on in both halves down to `leaf` disks: George, SIAM J. Numer. Anal. 10 (1973) 345. The fewest
// disks that part both sides of a strip are as many as there are paths through it that share no disk, found
// one by one: Ford & Fulkerson, Canad. J. Math. 8 (1956) 399. `shared`: from so many disks on threads cut.
Ordering dissect(In x, In y, const Graph& graph, int leaf, Team& team, int shared);

// The nodes of a dissection, kept for a crowd whose contacts hardly change. A contact between parts that were apart moves a disk
// into what parts them.
class ReusableOrder {
public:
    // The order of the disks `disk` (n, numbers in the crowd) with such places x, y and contacts first, second (of these n).
    Ordering order_of(In x, In y, const Indices& first, const Indices& second, std::span<const Index> disk, int leaf, Team& team, int shared);
    void forget() { uses_ = 0; }

private:
    bool repair(const Indices& first, const Indices& second, std::span<const Index> disk);
    Ordering of_nodes(std::span<const Index> disk);

    Indices node_;           // (crowd) of each disk, −1 where it has none
    Indices order_;          // those that have one, by node
    Indices parent_, below_; // (m) of each node, −1 at the root; the first of the nodes below it, which come just before it
    int uses_ = 0;
};

// Parts of a crowd: disks that are near each other in the order of elimination, and the contacts within.
struct Parts {
    Starts disk;     // (p+1) where the disks of each begin
    Starts contact;  // (p+1) where the contacts within each begin; those between parts follow
    int count() const { return int(disk.size()) - 1; }
};
// The order (k) of contacts by parts, and within by the place of their first disk.
Indices by_parts(const Indices& index, const Indices& first, const Indices& second, int count, Parts& parts);

}  // namespace nscd
