#include "elimination_order.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

#include "levels.hpp"

namespace nscd {

Graph graph_of(int n, const Indices& first, const Indices& second) {
    Graph graph{Starts(n + 1, 0), {}};
    for (std::size_t c = 0; c < first.size(); ++c)
        if (second[c] >= 0) ++graph.start[first[c] + 1], ++graph.start[second[c] + 1];
    std::partial_sum(graph.start.begin(), graph.start.end(), graph.start.begin());
    graph.neighbour.resize(graph.start[n]);
    Starts at(graph.start.begin(), graph.start.end() - 1);
    for (std::size_t c = 0; c < first.size(); ++c)
        if (second[c] >= 0) {
            graph.neighbour[at[first[c]]++] = second[c];
            graph.neighbour[at[second[c]]++] = first[c];
        }
    return graph;
}

static Indices inverse_of(const Indices& order) {
    Indices index(order.size());
    for (std::size_t q = 0; q < order.size(); ++q) index[order[q]] = Index(q);
    return index;
}

LEVELS Ordering minimum_degree(const Graph& graph) {
    using Word = std::uint64_t;
    const int n = int(graph.start.size()) - 1, words = (n + 63) / 64;
    std::vector<Word> bits(std::size_t(n) * words, 0);
    Indices degree(n, 0), head(n + 1, -1), after(n, -1), before(n, -1), reach(n), order(n);
    const auto row = [&](Index a) { return bits.data() + std::size_t(a) * words; };
    for (int a = 0; a < n; ++a) {
        for (auto e = graph.start[a]; e < graph.start[a + 1]; ++e) {
            const Index b = graph.neighbour[e];
            row(a)[b >> 6] |= Word{1} << (b & 63);
        }
        for (int w = 0; w < words; ++w) degree[a] += std::popcount(row(a)[w]);
    }
    // disks of each degree, as doubly linked lists
    const auto link = [&](Index a) {
        after[a] = head[degree[a]], before[a] = -1;
        if (after[a] >= 0) before[after[a]] = a;
        head[degree[a]] = a;
    };
    const auto unlink = [&](Index a) {
        (before[a] >= 0 ? after[before[a]] : head[degree[a]]) = after[a];
        if (after[a] >= 0) before[after[a]] = before[a];
    };
    for (int a = n - 1; a >= 0; --a) link(a);
    for (int k = 0, lowest = 0; k < n; ++k) {
        while (head[lowest] < 0) ++lowest;
        const Index v = head[lowest];
        unlink(v);
        order[k] = v;
        int count = 0;
        for (int w = 0; w < words; ++w)
            for (Word x = row(v)[w]; x; x &= x - 1) reach[count++] = 64 * w + std::countr_zero(x);
        for (int q = 0; q < count; ++q) {
            const Index u = reach[q];
            unlink(u);
            Word *own = row(u), *other = row(v);
            int now = 0;
            for (int w = 0; w < words; ++w) now += std::popcount(own[w] |= other[w]);
            own[v >> 6] &= ~(Word{1} << (v & 63));
            own[u >> 6] &= ~(Word{1} << (u & 63));
            degree[u] = now -= 2;
            link(u);
            lowest = std::min(lowest, now);
        }
    }
    return {order, inverse_of(order), {}, {}, {}};
}

namespace {

// Where a disk lies; OUTSIDE the part that is cut.
enum Side : std::uint8_t { OUTSIDE, LEFT, STRIP, RIGHT, CUT };
// In place of the next disk of a path: none, and the end of the strip.
constexpr Index NOBODY = -1, END = -2;
// A cut is sought among this share of the disks of a part on either side of the median, or that of so many
// layers, in parts of at least SMALL disks: a wider strip has smaller cuts, but less equal halves.
constexpr double STRIP_SHARE = 0.15, LAYERS = 10.0;
constexpr int SMALL = 30;
// A crowd that is shared is cut into so many pieces, which then are cut at the same time.
constexpr int PIECES = 8;

// Paths through a strip. Disk a is entered by gate 2a and left by gate 2a + 1, and only one path leads from the
// one to the other.
struct Paths {
    Indices after, before;  // (n) the next disk of the path through a disk, and the one before
    Indices visited, came;     // (2n) when a gate was reached last, and from which
    Indices stack;          // of gates
    explicit Paths(int n) : after(n), before(n), visited(2 * n), came(2 * n), stack(2 * n) {}
};

struct Node {
    int first, end, parent;
};
struct Piece {
    int low, high, parent;
};

class Cutter {
public:
    Cutter(In x, In y, const Graph& graph, Indices& nodes, std::vector<Side>& side, Indices& part, int leaf)
        : x_(x), y_(y), graph_(graph), nodes_(nodes), side_(side), part_(part), leaf_(leaf), paths_(int(nodes.size())) {}

    // Cut nodes low … high, into `pieces` only where that is not 0; what is left then is in `left`.
    std::vector<Node> cut(int low, int high, int pieces, std::vector<Piece>& left) {
        std::vector<Node> found;
        std::vector<Piece> stack{{low, high, -1}};
        while (!stack.empty() && (pieces == 0 || int(stack.size()) < pieces)) {
            auto at = stack.end() - 1;
            if (pieces > 0)  // the largest one
                at = std::max_element(stack.begin(), stack.end(),
                                      [](auto& a, auto& b) { return a.high - a.low < b.high - b.low; });
            const Piece p = *at;
            stack.erase(at);
            const int me = int(found.size());
            found.push_back({p.low, p.high, p.parent});
            if (p.high - p.low <= leaf_) continue;
            double box[4] = {INFINITE, INFINITE, INFINITE, INFINITE};
            for (int q = p.low; q < p.high; ++q) {
                const Index a = nodes_[q];
                box[0] = std::min(box[0], x_[a]), box[1] = std::min(box[1], -x_[a]);
                box[2] = std::min(box[2], y_[a]), box[3] = std::min(box[3], -y_[a]);
            }
            const bool longer_in_x = box[0] + box[1] < box[2] + box[3];
            const In across = longer_in_x ? x_ : y_, along = longer_in_x ? y_ : x_;
            halve(p.low, p.high, across, along);
            const auto [one, two] = arrange(p.low, p.high, along);
            found[me].first = p.low + two;
            if (one > 0) stack.push_back({p.low, p.low + one, me});
            if (two > one) stack.push_back({p.low + one, p.low + two, me});
        }
        left = stack;
        return found;
    }

private:
    bool touches(Index a, Side other) const {
        for (auto e = graph_.start[a]; e < graph_.start[a + 1]; ++e)
            if (side_[graph_.neighbour[e]] == other) return true;
        return false;
    }

    void divide(int low, int high, int middle, In key) {
        std::nth_element(nodes_.begin() + low, nodes_.begin() + middle, nodes_.begin() + high, [&](Index a, Index b) {
            return key[a] < key[b] || (key[a] == key[b] && a < b);
        });
    }

    // On which side of the cut each disk of a part lies: the smallest cut in a strip round the median; in a small
    // part, or where disks reach across the strip, the shorter rim of one half.
    void halve(int low, int high, In across, In along) {
        const int count = high - low, middle = (low + high) / 2;
        if (count >= SMALL) {
            const double fraction = std::min(STRIP_SHARE, LAYERS / std::sqrt(double(count)));
            const int one = low + int((0.5 - fraction) * count), two = low + int((0.5 + fraction) * count);
            divide(low, high, one, across);
            divide(one, high, two, across);
            for (int q = low; q < high; ++q) side_[nodes_[q]] = q < one ? LEFT : q < two ? STRIP : RIGHT;
            bool reach = false;
            for (int q = low; q < one && !reach; ++q) reach = touches(nodes_[q], RIGHT);
            if (!reach) return cut_strip(one, two, across, along);
        }
        divide(low, high, middle, across);
        for (int q = low; q < high; ++q) side_[nodes_[q]] = q < middle ? LEFT : RIGHT;
        int left = 0, right = 0;
        for (int q = low; q < middle; ++q) left += touches(nodes_[q], RIGHT);
        for (int q = middle; q < high; ++q) right += touches(nodes_[q], LEFT);
        const Side rim = left <= right ? LEFT : RIGHT, rest = left <= right ? RIGHT : LEFT;
        for (int q = low; q < high; ++q)
            if (side_[nodes_[q]] == rim && touches(nodes_[q], rest)) side_[nodes_[q]] = CUT;
    }

    // Reorder a part: left, right, cut; where the second and the third begin. The cut along itself, so that what
    // a part leaves to its separators are whole runs of them.
    std::pair<int, int> arrange(int low, int high, In along) {
        int size = low, one = 0, two = 0;
        for (Side which : {LEFT, RIGHT, CUT}) {
            one = two, two = size;
            for (int q = low; q < high; ++q)
                if (side_[nodes_[q]] == which) part_[size++] = nodes_[q];
        }
        std::stable_sort(part_.begin() + two, part_.begin() + size, [&](Index a, Index b) { return along[a] < along[b]; });
        std::copy(part_.begin() + low, part_.begin() + high, nodes_.begin() + low);
        for (int q = low; q < high; ++q) side_[nodes_[q]] = OUTSIDE;
        return {one - low, two - low};
    }

    // Take the fewest disks of the strip nodes[one … two] into the cut, the others to the left or to the right. By
    // Menger's theorem they are as many as disjoint paths; what a last search cannot reach lies beyond.
    void cut_strip(int one, int two, In across, In along) {
        Indices rim;
        for (int q = one; q < two; ++q) {
            const Index a = nodes_[q];
            if (touches(a, LEFT)) rim.push_back(a);
            paths_.after[a] = paths_.before[a] = NOBODY;
            paths_.visited[2 * a] = paths_.visited[2 * a + 1] = 0;
        }
        std::stable_sort(rim.begin(), rim.end(), [&](Index a, Index b) { return along[a] < along[b]; });
        int stamp = 0;
        for (int found = 1; found;) {
            ++stamp;
            found = 0;
            for (Index a : rim) {
                if (paths_.before[a] == END) {
                    paths_.visited[2 * a] = stamp;
                } else if (paths_.visited[2 * a] != stamp) {
                    const Index last = search(a, stamp, across);
                    if (last >= 0) add(last), ++found;
                }
            }
        }
        for (int q = one; q < two; ++q) {
            const Index a = nodes_[q];
            side_[a] = paths_.visited[2 * a + 1] == stamp ? LEFT : paths_.visited[2 * a] == stamp ? CUT : RIGHT;
        }
    }

    // Depth first, to the right first, for a path from a disk at the left to the right; the gate where it ends, −1
    // if there is none. A path may take away a part of one that was found: it enters a disk of that path, follows
    // it back, and leaves it at a disk before.
    Index search(Index begin, int stamp, In across) {
        auto& [after, before, visited, came, stack] = paths_;
        int top = 1;
        stack[0] = 2 * begin;
        visited[2 * begin] = stamp, came[2 * begin] = -1;
        while (top > 0) {
            const Index gate = stack[--top], a = gate >> 1;
            Index following = -1;
            if ((gate & 1) == 0) {
                if (before[a] == NOBODY) following = gate + 1;
                else if (before[a] != END) following = 2 * before[a] + 1;
            } else if (touches(a, RIGHT)) {
                return gate;
            } else if (before[a] != NOBODY) {
                following = gate - 1;
            }
            if (following >= 0 && visited[following] != stamp) {
                visited[following] = stamp, came[following] = gate;
                stack[top++] = following;
            }
            if ((gate & 1) == 0) continue;
            const int bottom = top;
            for (auto e = graph_.start[a]; e < graph_.start[a + 1]; ++e) {
                const Index b = graph_.neighbour[e];
                if (side_[b] != STRIP || after[a] == b || visited[2 * b] == stamp) continue;
                visited[2 * b] = stamp, came[2 * b] = gate;
                int at = top++;
                for (; at > bottom && across[stack[at - 1] >> 1] > across[b]; --at) stack[at] = stack[at - 1];
                stack[at] = 2 * b;
            }
        }
        return -1;
    }

    // Add the path that ends at a gate: first what it takes away from others, then its own steps.
    void add(Index last) {
        auto& [after, before, visited, came, stack] = paths_;
        Index gate = last;
        for (; came[gate] >= 0; gate = came[gate]) {
            const Index a = came[gate] >> 1, b = gate >> 1;
            if (a != b && (gate & 1)) after[b] = before[a] = NOBODY;
        }
        before[gate >> 1] = END;
        for (gate = last; came[gate] >= 0; gate = came[gate]) {
            const Index a = came[gate] >> 1, b = gate >> 1;
            if (a != b && !(gate & 1)) after[a] = b, before[b] = a;
        }
        after[last >> 1] = END;
    }

    In x_, y_;
    const Graph& graph_;
    Indices& nodes_;
    std::vector<Side>& side_;
    Indices& part_;
    int leaf_;
    Paths paths_;
};

}  // namespace

Ordering dissect(In x, In y, const Graph& graph, int leaf, Team& team, int shared) {
    const int n = int(x.size());
    Ordering found;
    found.order.resize(n);
    std::iota(found.order.begin(), found.order.end(), 0);
    std::vector<Side> side(n, OUTSIDE);
    Indices part(n);
    std::vector<Piece> left;
    std::vector<Node> nodes = Cutter(x, y, graph, found.order, side, part, leaf).cut(0, n, n >= shared ? PIECES : 0, left);
    std::vector<std::vector<Node>> pieces(left.size());
    std::vector<Cutter> cutters(left.size(), Cutter(x, y, graph, found.order, side, part, leaf));
    std::atomic<int> next{0};
    team.run([&](int) {
        std::vector<Piece> none;
        for (int p = next++; p < int(left.size()); p = next++) pieces[p] = cutters[p].cut(left[p].low, left[p].high, 0, none);
    });
    for (std::size_t p = 0; p < left.size(); ++p) {
        const int beyond = int(nodes.size());
        for (Node node : pieces[p]) {
            node.parent = node.parent < 0 ? left[p].parent : node.parent + beyond;
            nodes.push_back(node);
        }
    }
    // children first: by the last place, and where a separator is empty the inner part first
    const int m = int(nodes.size());
    Indices rank(m), now(m);
    std::iota(rank.begin(), rank.end(), 0);
    std::sort(rank.begin(), rank.end(), [&](Index a, Index b) {
        return nodes[a].end != nodes[b].end ? nodes[a].end < nodes[b].end : a > b;
    });
    for (int s = 0; s < m; ++s) now[rank[s]] = s;
    found.node_first.resize(m), found.node_end.resize(m), found.node_parent.resize(m);
    for (int s = 0; s < m; ++s) {
        const Node& node = nodes[rank[s]];
        found.node_first[s] = node.first, found.node_end[s] = node.end;
        found.node_parent[s] = node.parent < 0 ? -1 : now[node.parent];
    }
    found.index = inverse_of(found.order);
    return found;
}

// The order of some places below n, the earlier of equal ones first.
static Indices sorted(const Indices& index, int n) {
    Starts begin(n + 1, 0);
    for (Index i : index) ++begin[i + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    Indices order(index.size());
    for (std::size_t c = 0; c < index.size(); ++c) order[begin[index[c]]++] = Index(c);
    return order;
}

// A dissection is kept for so many problems, while no more than this share of the disks are new or moved.
constexpr int MOST_USES = 20;
constexpr double MOVED = 0.02;

Ordering ReusableOrder::order_of(In x, In y, const Indices& first, const Indices& second, std::span<const Index> disk, int leaf, Team& team, int shared) {
    if (const Index last = *std::max_element(disk.begin(), disk.end()); last >= Index(node_.size())) node_.resize(last + 1, -1);
    if (uses_ > 0 && uses_++ < MOST_USES && repair(first, second, disk)) return of_nodes(disk);
    Ordering found = dissect(x, y, graph_of(int(disk.size()), first, second), leaf, team, shared);
    parent_ = found.node_parent, below_.resize(parent_.size()), uses_ = 1;
    std::iota(below_.begin(), below_.end(), 0);
    std::fill(node_.begin(), node_.end(), -1);
    order_.clear();
    for (Index s = 0; s < Index(parent_.size()); ++s) {
        if (parent_[s] >= 0) below_[parent_[s]] = std::min(below_[parent_[s]], below_[s]);
        for (int q = found.node_first[s]; q < found.node_end[s]; ++q) order_.push_back(disk[found.order[q]]), node_[order_.back()] = s;
    }
    return found;
}

bool ReusableOrder::repair(const Indices& first, const Indices& second, std::span<const Index> disk) {
    std::size_t moved = 0;
    for (Index a : disk)
        if (node_[a] < 0) order_.push_back(a), ++moved;
    for (bool begins : {true, false}) {  // who is new begins beside whom it touches, or at the root
        for (std::size_t c = 0; c < first.size(); ++c) {
            if (second[c] < 0) continue;
            Index &one = node_[disk[first[c]]], &other = node_[disk[second[c]]];
            if (begins) {
                (one < 0 ? one : other) = one < 0 || other < 0 ? std::max(one, other) : other;
                continue;
            }
            const Index low = std::min(one, other);
            Index high = std::max(one, other);
            if (below_[high] <= low) continue;
            while (below_[high] > low) high = parent_[high];
            one = high, ++moved;
        }
        for (Index a : disk)
            if (node_[a] < 0) node_[a] = Index(parent_.size()) - 1;
    }
    return double(moved) <= MOVED * double(disk.size());
}

Ordering ReusableOrder::of_nodes(std::span<const Index> disk) {
    const int m = int(parent_.size());
    Indices place(node_.size(), -1), node;
    for (std::size_t i = 0; i < disk.size(); ++i) place[disk[i]] = Index(i);
    for (Index a : order_) node.push_back(node_[a]);
    Indices by_node = sorted(node, m);
    for (Index& q : by_node) q = order_[q];
    order_ = std::move(by_node);
    Ordering found{{}, {}, Indices(m, 0), Indices(m, 0), parent_};
    for (Index a : order_)
        if (place[a] >= 0) found.order.push_back(place[a]), ++found.node_end[node_[a]];
    for (int s = 1; s < m; ++s) found.node_first[s] = found.node_end[s - 1], found.node_end[s] += found.node_first[s];
    found.index = inverse_of(found.order);
    return found;
}

Indices by_parts(const Indices& index, const Indices& first, const Indices& second, int count, Parts& parts) {
    const int n = int(index.size());
    const std::size_t k = first.size();
    parts.disk.resize(count + 1);
    for (int p = 0; p <= count; ++p) parts.disk[p] = std::int64_t(n) * p / count;
    Indices part(n), at(k);
    for (int p = 0; p < count; ++p) std::fill(part.begin() + parts.disk[p], part.begin() + parts.disk[p + 1], p);
    for (std::size_t c = 0; c < k; ++c) at[c] = index[first[c]];
    const Indices row = sorted(at, n);
    Indices within(k);
    for (std::size_t q = 0; q < k; ++q) {
        const Index c = row[q], p = part[index[first[c]]];
        within[q] = second[c] < 0 || part[index[second[c]]] == p ? p : count;
    }
    Indices order = sorted(within, count + 1);
    parts.contact.assign(count + 1, 0);
    for (Index p : within)
        if (p < count) ++parts.contact[p + 1];
    std::partial_sum(parts.contact.begin(), parts.contact.end(), parts.contact.begin());
    for (Index& c : order) c = row[c];
    return order;
}

}  // namespace nscd
