#include "runtime/lod/block_selection.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scree {

BlockSelection::BlockSelection(const Bisection& bisection)
    : bisection_(&bisection), active_(bisection.vertex_count()), lock_(bisection.vertex_count()) {
    clear();
}

void BlockSelection::clear() {
    std::fill(active_.begin(), active_.end(), std::uint8_t{0});
    std::fill(lock_.begin(), lock_.end(), std::uint8_t{0});
    const int m = bisection_->cells();
    for (const int j : {0, m})
        for (const int i : {0, m}) active_[static_cast<std::size_t>(bisection_->index(i, j))] = 1;
}

void BlockSelection::set(std::int32_t vertex, bool active) {
    active_[static_cast<std::size_t>(vertex)] = active ? 1 : 0;
    for (const std::int32_t parent : bisection_->vertex(vertex).parents) {
        if (parent < 0) continue;
        std::uint8_t& lock = lock_[static_cast<std::size_t>(parent)];
        lock = static_cast<std::uint8_t>(active ? lock + 1 : lock - 1);
    }
}

void BlockSelection::add(std::int32_t vertex) {
    if (vertex < 0 || is_active(vertex)) return;
    active_[static_cast<std::size_t>(vertex)] = 1;
    for (const std::int32_t parent : bisection_->vertex(vertex).parents) add(parent);
}

void BlockSelection::emit(std::vector<std::uint32_t>& indices) const {
    for (const BisectionTriangle& root : bisection_->roots()) emit(root, 1, indices);
}

void BlockSelection::emit(int stride_log2, int x, int y, std::vector<std::uint32_t>& indices) const {
    const int level = 2 * (bisection_->cells_log2() - stride_log2) + 1;
    for (const BisectionTriangle& root : bisection_->roots(stride_log2, x, y)) emit(root, level, indices);
}

void BlockSelection::emit(const BisectionTriangle& t, int level, std::vector<std::uint32_t>& indices) const {
    if (level <= bisection_->levels() && is_active(t.middle())) {
        emit(t.left_half(), level + 1, indices);
        emit(t.right_half(), level + 1, indices);
        return;
    }
    const std::size_t at = indices.size();
    indices.resize(at + 3);
    indices[at] = static_cast<std::uint32_t>(t.apex);
    indices[at + 1] = static_cast<std::uint32_t>(t.left);
    indices[at + 2] = static_cast<std::uint32_t>(t.right);
}

std::int64_t BlockSelection::triangles() const {
    std::int64_t count = 2;
    for (const std::int32_t v : bisection_->coarse_to_fine())
        if (is_active(v)) count += bisection_->vertex(v).parents[1] < 0 ? 1 : 2;
    return count;
}

void surface_heights(const Bisection& bisection, std::span<const std::uint8_t> active, std::span<const double> z,
                     std::span<double> out) {
    assert(active.size() == z.size() && out.size() == z.size());
    std::copy(z.begin(), z.end(), out.begin());
    for (const std::int32_t v : bisection.coarse_to_fine()) {
        if (active[static_cast<std::size_t>(v)] != 0) continue;
        const auto [a, b] = bisection.vertex(v).ends;
        out[static_cast<std::size_t>(v)] = (out[static_cast<std::size_t>(a)] + out[static_cast<std::size_t>(b)]) / 2;
    }
}

}  // namespace scree
