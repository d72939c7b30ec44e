#include "runtime/lod/block_selection.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scree {

bool add_closed(const Bisection& bisection, std::int32_t vertex, std::uint8_t* active) {
    if (active[vertex] != 0) return false;
    active[vertex] = 1;
    for (const std::int32_t parent : bisection.vertex(vertex).parents)
        if (parent >= 0) add_closed(bisection, parent, active);
    return true;
}

namespace {

// The triangles that a triangle split at level `level` (2n + 1: never) is drawn as.
std::uint32_t* emit_triangles(const Bisection& bisection, const std::uint8_t* active, const BisectionTriangle& triangle,
                              int level, std::uint32_t* out) {
    if (level <= bisection.levels() && active[triangle.middle()] != 0) {
        out = emit_triangles(bisection, active, triangle.left_half(), level + 1, out);
        return emit_triangles(bisection, active, triangle.right_half(), level + 1, out);
    }
    *out++ = static_cast<std::uint32_t>(triangle.apex);
    *out++ = static_cast<std::uint32_t>(triangle.left);
    *out++ = static_cast<std::uint32_t>(triangle.right);
    return out;
}

}  // namespace

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

void BlockSelection::add(std::int32_t vertex) { add_closed(*bisection_, vertex, active_.data()); }

void BlockSelection::emit(std::vector<std::uint32_t>& indices) const { emit(bisection_->roots(), 1, indices); }

void BlockSelection::emit(int stride_log2, int x, int y, std::vector<std::uint32_t>& indices) const {
    emit(bisection_->roots(stride_log2, x, y), 2 * (bisection_->cells_log2() - stride_log2) + 1, indices);
}

void BlockSelection::emit(std::span<const BisectionTriangle> triangles, int level,
                          std::vector<std::uint32_t>& indices) const {
    const std::size_t before = indices.size();
    indices.resize(before + most_indices(*bisection_));
    std::uint32_t* out = indices.data() + before;
    for (const BisectionTriangle& t : triangles) out = emit_triangles(*bisection_, active_.data(), t, level, out);
    indices.resize(static_cast<std::size_t>(out - indices.data()));
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
