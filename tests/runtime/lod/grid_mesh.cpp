#include "tests/runtime/lod/grid_mesh.h"

namespace scree::test {

GridMesh::GridMesh(int tile_cells_log2)
    : cells_(1 << tile_cells_log2),
      levels_(2 * tile_cells_log2),
      roots_{{{{{cells_, 0}, {0, 0}, {cells_, cells_}}}, {{{0, cells_}, {cells_, cells_}, {0, 0}}}}},
      selected_(static_cast<std::size_t>(cells_ + 1) * static_cast<std::size_t>(cells_ + 1)) {}

void GridMesh::select_stride(int stride) {
    for (int j = 0; j <= cells_; j += stride)
        for (int i = 0; i <= cells_; i += stride) set(i, j, true);
}

void GridMesh::select_random(Random& random, int percent) {
    for (std::uint8_t& selected : selected_)
        if (uniform(random, 0, 99) < percent) selected = 1;
}

std::array<GridMesh::Triangle, 2> GridMesh::halves(const Triangle& t) {
    const auto& [apex, left, right] = t;
    const Vertex middle{(left.i + right.i) / 2, (left.j + right.j) / 2};
    return {{{middle, apex, left}, {middle, right, apex}}};
}

bool GridMesh::is_selected(const Triangle& t) const {
    return selected_[index((t[1].i + t[2].i) / 2, (t[1].j + t[2].j) / 2)] != 0;
}

// A triangle that is split is there only where those that it came from were split too: its apex is their middle.
void GridMesh::close(const Triangle& t, int level, int wanted) {
    if (level == wanted) {
        if (is_selected(t)) set(t[0].i, t[0].j, true);
        return;
    }
    for (const Triangle& half : halves(t)) close(half, level + 1, wanted);
}

void GridMesh::emit(const Triangle& t, int level, std::vector<std::uint32_t>& out) const {
    if (level < levels_ && is_selected(t)) {
        for (const Triangle& half : halves(t)) emit(half, level + 1, out);
        return;
    }
    for (const Vertex& v : t) out.push_back(static_cast<std::uint32_t>(index(v.i, v.j)));
}

std::vector<std::uint32_t> GridMesh::indices() {
    for (int level = levels_ - 1; level > 0; --level)
        for (const Triangle& root : roots_) close(root, 0, level);
    std::vector<std::uint32_t> out;
    for (const Triangle& root : roots_) emit(root, 0, out);
    return out;
}

}  // namespace scree::test
