#include "common/mesh/level_corrections.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scree {

LevelCorrections level_corrections(std::span<const SlotVertex> vertices, int tile_cells_log2) {
    assert(vertices.size() == slot_vertex_count(tile_cells_log2));
    const std::size_t cells = std::size_t{1} << tile_cells_log2;
    LevelCorrections corrections{};
    for (int g = 1; g < tile_cells_log2; ++g) {
        const std::size_t stride = std::size_t{1} << (g - 1);
        float greatest = 0;
        for (std::size_t j = 0; j <= cells; j += stride)
            // Born at this stride: not both coordinates are multiples of twice as much.
            for (std::size_t i = j % (2 * stride) == 0 ? stride : 0; i <= cells;
                 i += j % (2 * stride) == 0 ? 2 * stride : stride) {
                const SlotVertex& vertex = vertices[j * (cells + 1) + i];
                greatest = std::max(greatest, std::abs(vertex.next_n - vertex.height_n));
            }
        corrections[static_cast<std::size_t>(g)] = greatest;
    }
    return corrections;
}

}  // namespace scree
