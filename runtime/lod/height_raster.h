// HeightRaster: the finest heights of a store, whole, in memory: what the paper's own layout is cut from.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/store/tile_store.h"

namespace scree {

/// Sample (i, j) lies at west + i spacing, north - j spacing; z[j * columns + i], metres.
struct HeightRaster {
    std::int64_t columns = 0, rows = 0;
    double west_m = 0, north_m = 0, spacing_m = 1;
    std::vector<double> z;

    double at(std::int64_t i, std::int64_t j) const { return z[static_cast<std::size_t>(j * columns + i)]; }
    double x_m(double i) const { return west_m + i * spacing_m; }
    double y_m(double j) const { return north_m - j * spacing_m; }
};

/// Told the share that is done, 0 to 1, ever so often; false: stop, which is ErrorCode::interrupted. Empty: nobody
/// asks.
using LoadProgress = std::function<bool(double share)>;

/// Every sample of a store's deepest level. Errors: ErrorCode::usage where `bytes_per_sample` of them would not fit the
/// budget, where cells are absent, and where the heights' depth varies by place: --cracks dike shows none of these;
/// those of the store.
Result<HeightRaster> read_height_raster(const TileStore& store, std::int64_t budget_bytes,
                                        std::int64_t bytes_per_sample, const LoadProgress& progress = {});

}  // namespace scree
