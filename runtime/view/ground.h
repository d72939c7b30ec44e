// Ground: exact heights of the finest stored surface, read through the store. One thread per object.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <unordered_map>

#include "common/store/tile_store.h"

namespace scree {

class Ground {
public:
    static Result<std::unique_ptr<Ground>> open(const TileStore& store);

    /// Height in metres of the finest surface at (x, y) in the dataset's CRS; nullopt where nothing is present.
    /// Errors: those of the store.
    Result<std::optional<double>> height(double x_m, double y_m);
    /// A deepest-level tile, or null where none is stored. Valid until the next call.
    Result<const HeightTile*> tile(TileId id);

private:
    Ground(const TileStore& store, std::unique_ptr<TileReader> reader);
    const TileStore& store_;
    std::unique_ptr<TileReader> reader_;
    struct Cached {
        TileId id;
        bool exists;
        HeightTile tile;
    };
    std::list<Cached> recent_;
};

}  // namespace scree
