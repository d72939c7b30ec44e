#include "runtime/lod/triangle_walk.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

namespace scree {
namespace {

// Bits 0, 2, 4.. of a Morton code.
int even_bits(int code) {
    int value = 0;
    for (int bit = 0; code >> (2 * bit) != 0; ++bit) value |= (code >> (2 * bit) & 1) << bit;
    return value;
}

/// Where a walk is, and where it writes.
struct Walker {
    std::uint32_t at = 0, end = 0;
    std::uint32_t* out = nullptr;
};

// Each step of a walk waits for the one before: `count` walks wait together. `ended(walker)` is told of each.
template <std::size_t count, class Node, class Ended>
void walk(const std::vector<Node>& nodes, const std::uint8_t* active, std::uint32_t first_vertex,
          std::array<Walker, count> walkers, const Ended& ended) {
    const auto running = [&] {
        unsigned all = 1;
        for (const Walker& w : walkers) all &= static_cast<unsigned>(w.at < w.end);
        return all != 0;
    };
    while (running())
        for (Walker& w : walkers) {
            const Node& node = nodes[w.at];
            const std::uint32_t split = active[node.middle];
            // Written whether it is drawn or not, then kept or not: what splits cannot be foretold.
            w.out[0] = first_vertex + node.corners[0];
            w.out[1] = first_vertex + node.corners[1];
            w.out[2] = first_vertex + node.corners[2];
            w.out += (split - 1) & 3;
            w.at = node.next - ((node.next - w.at - 1) & (0 - split));
        }
    const auto done = std::find_if(walkers.begin(), walkers.end(), [](const Walker& w) { return w.at >= w.end; });
    ended(*done);
    if constexpr (count > 1) {
        std::array<Walker, count - 1> others;
        const auto at = static_cast<std::size_t>(done - walkers.begin());
        for (std::size_t k = 0; k < others.size(); ++k) others[k] = walkers[k < at ? k : k + 1];
        walk(nodes, active, first_vertex, others, ended);
    }
}

}  // namespace

TriangleWalk::TriangleWalk(const Bisection& b) {
    for (const BisectionTriangle& root : b.roots()) add(b, root, 1);
    end_ = static_cast<std::uint32_t>(nodes_.size());
    room_ = room(b);

    std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::uint32_t> node_of;
    for (std::uint32_t at = 0; at < end_; ++at)
        node_of[{nodes_[at].corners[0], nodes_[at].corners[1], nodes_[at].corners[2]}] = at;
    const auto range_of = [&](const BisectionTriangle& t) {
        const std::uint32_t at = node_of.at({static_cast<std::uint32_t>(t.apex), static_cast<std::uint32_t>(t.left),
                                             static_cast<std::uint32_t>(t.right)});
        return Range{at, nodes_[at].next};
    };
    const auto roots = b.roots();
    middle_ = roots[0].middle();
    halves_ = {range_of(roots[0].left_half()), range_of(roots[0].right_half()), range_of(roots[1].left_half()),
               range_of(roots[1].right_half())};
    for (int level = 0; level <= b.cells_log2(); ++level) {
        auto& cells = cells_.emplace_back();
        for (int code = 0; code < 1 << (2 * level); ++code) {
            const auto two = b.roots(b.cells_log2() - level, even_bits(code), even_bits(code >> 1));
            cells.push_back({range_of(two[0]), range_of(two[1])});
        }
    }

    if (b.vertex_count() > std::numeric_limits<std::uint16_t>::max() ||
        nodes_.size() > std::numeric_limits<std::uint16_t>::max())
        return;
    const auto narrow = [](std::uint32_t v) { return static_cast<std::uint16_t>(v); };
    for (const auto& n : nodes_)
        short_nodes_.push_back(
            {narrow(n.middle), narrow(n.next), {narrow(n.corners[0]), narrow(n.corners[1]), narrow(n.corners[2])}});
    nodes_ = {};
}

void TriangleWalk::add(const Bisection& b, const BisectionTriangle& t, int level) {
    const std::size_t at = nodes_.size();
    const bool splits = level <= b.levels();
    nodes_.push_back({static_cast<std::uint32_t>(splits ? static_cast<std::size_t>(t.middle()) : b.vertex_count()),
                      0,
                      {static_cast<std::uint32_t>(t.apex), static_cast<std::uint32_t>(t.left),
                       static_cast<std::uint32_t>(t.right)}});
    if (splits) {
        add(b, t.left_half(), level + 1);
        add(b, t.right_half(), level + 1);
    }
    nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
}

template <std::size_t count>
std::uint32_t* TriangleWalk::emit(const std::uint8_t* active, const std::array<Range, count>& ranges,
                                  std::uint32_t first_vertex, std::uint32_t* out) const {
    // Each writes where it has room for all, then they close up.
    std::array<Walker, count> walkers;
    std::array<std::uint32_t*, count> ends{};
    const std::size_t apart = room_ / count;
    for (std::size_t k = 0; k < count; ++k) walkers[k] = {ranges[k].first, ranges[k].end, out + k * apart};
    const auto ended = [&](const Walker& w) { ends[static_cast<std::size_t>(w.out - out) / apart] = w.out; };
    if (short_nodes_.empty())
        walk(nodes_, active, first_vertex, walkers, ended);
    else
        walk(short_nodes_, active, first_vertex, walkers, ended);
    std::uint32_t* end = ends[0];
    for (std::size_t k = 1; k < count; ++k) end = std::copy(out + k * apart, ends[k], end);
    return end;
}

std::uint32_t* TriangleWalk::emit(const std::uint8_t* active, std::uint32_t first_vertex, std::uint32_t* out) const {
    if (active[middle_] == 0) return emit(active, std::array{Range{0, end_}}, first_vertex, out);
    return emit(active, halves_, first_vertex, out);
}

std::uint32_t* TriangleWalk::emit_cell(const std::uint8_t* active, int level, int code, std::uint32_t* out) const {
    const std::array<Range, 2>& cell = cells_[static_cast<std::size_t>(level)][static_cast<std::size_t>(code)];
    out = emit(active, std::array{cell[0]}, 0, out);
    return emit(active, std::array{cell[1]}, 0, out);
}

}  // namespace scree
