#include "runtime/lod/bisection.h"

#include <cassert>

#include "common/height_tile.h"

namespace scree {

Bisection::Bisection(int cells_log2, bool odd) : cells_log2_(cells_log2), odd_(odd) {
    assert(cells_log2 >= 1 && cells_log2 <= kMaxTileCellsLog2);
    vertices_.resize(static_cast<std::size_t>(row()) * static_cast<std::size_t>(row()));
    roots_ = roots(cells_log2, 0, 0);
    order_.reserve(vertices_.size() - 4);
    first_.assign(2, 0);
    std::vector<BisectionTriangle> triangles(roots_.begin(), roots_.end()), halves;
    for (int level = 1; level <= levels(); ++level) {
        halves.clear();
        for (const BisectionTriangle& t : triangles) {
            const std::int32_t v = t.middle();
            BisectionVertex& vertex = vertices_[static_cast<std::size_t>(v)];
            if (vertex.level == 0) {
                vertex.level = level;
                vertex.ends = {t.left, t.right};
                vertex.parents[0] = t.apex;
                order_.push_back(v);
            } else {
                vertex.parents[1] = t.apex;
            }
            halves.push_back(t.left_half());
            halves.push_back(t.right_half());
        }
        first_.push_back(order_.size());
        triangles.swap(halves);
    }
    for (const std::int32_t v : order_)
        for (const std::int32_t parent : vertex(v).parents) {
            if (parent < 0) continue;
            auto& children = vertices_[static_cast<std::size_t>(parent)].children;
            for (std::int32_t& child : children)
                if (child < 0) {
                    child = v;
                    break;
                }
        }
}

std::array<BisectionTriangle, 2> Bisection::roots(int stride_log2, int x, int y) const {
    assert(stride_log2 >= 0 && stride_log2 <= cells_log2_);
    const int s = 1 << stride_log2;
    const std::int32_t nw = index(x * s, y * s), ne = index(x * s + s, y * s), sw = index(x * s, y * s + s),
                       se = index(x * s + s, y * s + s);
    // Within the tile cells alternate from its own corner; the tile itself is a cell of its level.
    const bool odd = stride_log2 == cells_log2_ ? odd_ : (x + y) % 2 != 0;
    if (odd) return {{{nw, sw, ne}, {se, ne, sw}}};
    return {{{ne, nw, se}, {sw, se, nw}}};
}

}  // namespace scree
