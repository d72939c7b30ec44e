// Level-to-level errors of a tile, as de Boer measures them: what a geomip level misses of the one below it, not of the
// finest data. They underestimate (Scree lod, C12); nothing that promises anything goes by them.
#pragma once

#include <array>
#include <span>

#include "common/lattice.h"
#include "common/mesh/vertex_slot.h"

namespace scree {

/// [g], 1 <= g < n: greatest distance, in quanta, of the vertices born at geomip level g - 1 from the surface of level
/// g, edges whole. [0] and what lies behind are 0.
using LevelCorrections = std::array<float, kMaxTileCellsLog2>;

/// `vertices`: as fill_vertex_slot() made them; next_n holds each vertex' height on the next coarser surface. Pure.
LevelCorrections level_corrections(std::span<const SlotVertex> vertices, int tile_cells_log2);

}  // namespace scree
