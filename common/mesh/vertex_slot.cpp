#include "common/mesh/vertex_slot.h"

#include <algorithm>
#include <cassert>

#include "common/mesh/drawn_surface.h"

namespace scree {
namespace {

// A vertex first appears at geomip level k = the number of factors two its coordinates share; it is drawn up to level k
// and lies on the mid-point of an edge or diagonal of level k + 1.
int birth_level(int i, int j, int deepest) {
    int level = 0;
    while (level < deepest && ((i | j) & 1) == 0) {
        i >>= 1;
        j >>= 1;
        ++level;
    }
    return level;
}

}  // namespace

void fill_vertex_slot(std::span<const std::int32_t> samples, int tile_cells_log2, std::span<SlotVertex> out) {
    const int n = tile_cells_log2;
    const int m = 1 << n;
    const int pitch = m + 1;
    assert(samples.size() == static_cast<std::size_t>(pitch * pitch) && out.size() == slot_vertex_count(n));
    const auto on_level = [&](int i, int j, int level) {
        level = std::min(level, n - 1);
        return static_cast<float>(drawn_height(samples, n, {level, 0}, i, j, 1).quanta());
    };
    for (int j = 0; j <= m; ++j) {
        for (int i = 0; i <= m; ++i) {
            const int birth = birth_level(i, j, n - 1);
            SlotVertex& v = out[static_cast<std::size_t>(j * pitch + i)];
            v.height_n = static_cast<float>(samples[static_cast<std::size_t>(j * pitch + i)]);
            v.next_n = on_level(i, j, birth + 1);
            v.second_next_n = on_level(i, j, birth + 2);
        }
    }
    std::size_t next = static_cast<std::size_t>(pitch * pitch);
    const auto mid_point = [&](int i0, int j0, int i1, int j1) {
        const auto a = samples[static_cast<std::size_t>(j0 * pitch + i0)];
        const auto b = samples[static_cast<std::size_t>(j1 * pitch + i1)];
        const float own = 0.5f * static_cast<float>(a + b);  // |a + b| < 2^24: exact
        const auto on_edge = [&](int level) {
            const std::int64_t u = i0 + i1, v = j0 + j1;
            return static_cast<float>(drawn_height(samples, n, {std::min(level, n - 1), 0}, u, v, 2).quanta());
        };
        out[next++] = {own, on_edge(1), on_edge(2)};
    };
    for (int k = 0; k < m; ++k) mid_point(k, 0, k + 1, 0);
    for (int k = 0; k < m; ++k) mid_point(m, k, m, k + 1);
    for (int k = 0; k < m; ++k) mid_point(k, m, k + 1, m);
    for (int k = 0; k < m; ++k) mid_point(0, k, 0, k + 1);
}

}  // namespace scree
