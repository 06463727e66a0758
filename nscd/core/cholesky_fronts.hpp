// Multifrontal Cholesky factorisation over the separator tree: dense blocks, the fastest for large crowds.
//
// Each node of the tree eliminates its disks in a dense front of themselves and the later disks that they reach;
// what is left, the Schur complement, goes to the parent's front. Duff & Reid, ACM Trans. Math. Softw. 9 (1983) 302.
#pragma once

#include <atomic>
#include <memory>

#include "elimination_order.hpp"

namespace nscd {

// What can be done at the same time: subtrees of the tree of fronts, and the fronts above them one by one. The tree
// is cut in the same way for any number of threads, so that they get the same bits.
struct Tasks {
    Indices end;      // (t) the node before which each ends; its root is the last one
    Indices parent;   // (t) the task whose node is the parent of its root, −1 where there is none
    Indices order;    // (t) in which they are taken: subtrees first
    Starts carry;    // (t+1) where what it leaves to those above begins, a place for each disk in the border of its root
    Indices onward;   // (carry[t]) where that is added: a place among the n disks, or n and a place in what the next leaves
    Indices target;   // for each disk in the border of a node, the same
    int count() const { return int(end.size()); }
};

class Fronts {
public:
    // Plan the fronts of contacts (first and second are places), with d unknowns a disk, for a team.
    Fronts(const Ordering& ordering, const Graph& graph, const Indices& first, const Indices& second, int d, Team& team,
           int shared);

    bool factorise(const ImpactProblem& s, In theta);  // Â + CᵀΘC for theta (k) kg; false where rounding left it indefinite
    void solve(Out b);                          // b ← (L Lᵀ)⁻¹ b, (n·d)

private:
    struct Front;
    void plan_borders(const Ordering& ordering, const Graph& graph);
    void plan_elements(const Indices& first, const Indices& second);
    void plan_tasks(const Ordering& ordering, bool single);
    void plan_storage(const Indices& parent);
    void for_tasks(bool upward, const std::function<void(int task, int me)>& visit);
    bool factorise_task(const ImpactProblem& s, const double* theta, int task, int me);
    void add_child(const Front& front, const double* update, std::span<const Index> inner, Indices& to);
    void forward_task(double* flat, int task, int me);
    void back_task(double* flat, int task, int me);

    int n_, d_;
    Team& team_;
    Indices first_, end_;                    // (m) places that a node eliminates
    Starts border_start_;                   // (m+1) and later places in its front, increasing
    Indices border_, inner_;                 // inner: their places in the parent's front
    Indices child_, sibling_;                // (m) the tree, −1 ends
    Starts element_start_;                  // (m+1) and contacts that are added to a node
    Indices element_, left_, right_;         // left, right: local places of their disks, right −1 for a wall
    Starts panel_start_, update_start_;     // where the rows of Lᵀ begin in store; where Schur complements do: two
                                            // stacks, for even and odd depths, so that a node's is not where its
                                            // children's are; those of the roots of tasks stand before the stacks
    Starts stays_;                          // (m) 1 where a Schur complement is not in the stacks
    std::int64_t stacks_ = 0, widest_ = 8;  // how many numbers the stacks of a thread, and a row of a front, have
    AlignedVector store_, solution_;
    std::vector<AlignedVector> work_;                // for each thread
    std::vector<Indices> runs_;
    Tasks tasks_;
    std::unique_ptr<std::atomic<int>[]> done_;  // (t) the last job in which a task was done
    int job_ = 0;
};

}  // namespace nscd
