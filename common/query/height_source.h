// HeightSource: the height tiles that a query may look at, all of a store or those in memory. Queries know nothing
// else.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/result.h"

namespace scree {

/// A tile as its source keeps it. Valid until the next call on the source.
struct HeightTileView {
    const HeightTileHeader* header = nullptr;
    std::span<const std::int32_t> samples;   ///< (m+1)^2
    std::span<const std::uint8_t> presence;  ///< as HeightTile::presence
};

class HeightSource {
public:
    virtual ~HeightSource() = default;
    virtual const Dataset& dataset() const = 0;
    /// Asked for roots, and for children that their parent's header names; nullopt: not here, answer from the parent.
    /// Errors: the source's own; one over tiles in memory has none and never blocks.
    virtual Result<std::optional<HeightTileView>> view(TileId id) = 0;
};

/// Metres by which a tile's own surface, drawn whole, may differ from the true heights over present cells: its
/// certified error, and what rounding to quanta and warping cost before the store. What doubles round away is not
/// counted.
inline double surface_error_m(const Dataset& dataset, const HeightTileHeader& header) {
    const double stored_m = dataset.height_quantum_error_m + dataset.warp_error_m;
    // A leaf's surface is the finest; its error_n[0] is about thinned edges.
    if (header.is_leaf()) return stored_m;
    return stored_m + static_cast<double>(header.own.error_n[0]) * dataset.height_quantum_m;
}

}  // namespace scree
