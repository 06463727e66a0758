// Contacts that need no factorisation: islands that nothing presses, single contacts, and trees.
#pragma once

#include "problem.hpp"

namespace nscd {

// Label each of n disks with its connected component over contacts of two disks (walls do not connect);
// the number of components. Union–find with path halving; components are numbered by their first disk.
int components(int n, std::span<const Index> first, std::span<const Index> second, Indices& label);

struct Islands {
    int count = 0;
    Indices label;            // (n) island of each disk
    Indices contacts, disks;  // (count) how many it has
    Mask pressed;           // (count) whether a contact would close without reactions
    Mask forest;            // (count) whether its contacts form a tree, the walls taken as one body
};
Islands islands_of(const ImpactProblem& s);

// What is left for a solver: contacts and disks in their order, and where a disk comes to be.
struct RemainingContacts {
    Indices contact, disk, index;
    bool forest = true;   // whether these contacts form trees
    bool single = false;  // whether any was answered that is alone and pressed
};

// λ = 0 where nothing presses, (Cû − b)/w where a contact is alone in its island.
RemainingContacts solve_single_contacts(const ImpactProblem& s, Vector& reaction, Vector& velocity);

// A forest of contacts: disks from the roots outward, their parents (−1: none, or the wall), and the
// contacts that link them to these (−1: none).
struct Branches {
    Indices order, parent, link;
};
Branches branches_of(const ImpactProblem& s);

// λ (k) and u (n·2) with the `closed` contacts at C u = b, the others without reaction, in linear time.
//
// With its contacts closed, everything behind a disk acts on it as a mass along one normal: m_c = 1/(n·A_c⁻¹n)
// with A_a = m_a I + Σ m_c n nᵀ over the branches behind. One pass from the leaves gives these, one pass back
// the reactions (paper eqs. (5), (6) for a straight chain).
void close_tree(const ImpactProblem& s, const Branches& branches, MaskView closed, In free, In max_approach, Out reaction, Out u);

// The closed ones of contacts that form trees: contacts that pull are opened and open ones that would overlap
// closed, until none is left. Returns the rounds.
int solve_tree(const ImpactProblem& s, const Branches& branches, Vector& reaction, Vector& velocity);

// Units in the last place that approach velocities are known to.
inline constexpr double APPROACH_ROUNDING = 16.0 * EPSILON;

// k_n (k) of `normal_dashpot` where it pushes for right velocities u, 0 where it would pull.
Vector clamped_dashpots(const ImpactProblem& s, const Vector& normal_dashpot, In u);

}  // namespace nscd
