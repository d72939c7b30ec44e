#include "runtime/lod/height_raster.h"

#include <fmt/format.h>

#include <algorithm>

namespace scree {
namespace {

constexpr const char* kUnless = "--cracks dike holds a whole raster in memory; without it the store can be shown";

Result<void> check_shape(const Dataset& d, std::int64_t budget_bytes, std::int64_t bytes_per_sample) {
    const Lattice& l = d.lattice;
    // Of at most 2^30 cells a side each.
    const double bytes =
        static_cast<double>(l.cells_x + 1) * static_cast<double>(l.cells_y + 1) * static_cast<double>(bytes_per_sample);
    if (!(bytes <= static_cast<double>(budget_bytes)))
        return Error{
            ErrorCode::usage,
            fmt::format("{} x {} samples as separate blocks take {:.0f} MiB, more than --budget, {:.0f} MiB: {}",
                        l.cells_x + 1, l.cells_y + 1, bytes / 1048576, static_cast<double>(budget_bytes) / 1048576,
                        kUnless)};
    if (d.coarsest_leaf_level)
        return Error{ErrorCode::usage,
                     fmt::format("the depth of the store's heights varies by place, from level {} to {}: {}",
                                 *d.coarsest_leaf_level, l.deepest_level, kUnless)};
    if (d.present_cells != l.cells_x * l.cells_y)
        return Error{ErrorCode::usage,
                     fmt::format("{} of the store's {} cells are absent: {}", l.cells_x * l.cells_y - d.present_cells,
                                 l.cells_x * l.cells_y, kUnless)};
    return {};
}

}  // namespace

Result<HeightRaster> read_height_raster(const TileStore& store, std::int64_t budget_bytes,
                                        std::int64_t bytes_per_sample, const LoadProgress& progress) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    if (auto ok = check_shape(d, budget_bytes, bytes_per_sample); !ok) return ok.error();
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    HeightRaster raster{l.cells_x + 1, l.cells_y + 1, l.origin_x_m, l.origin_y_m, l.spacing_m, {}};
    raster.z.resize(static_cast<std::size_t>(raster.columns * raster.rows));
    const std::int64_t m = l.tile_cells();
    for (std::int64_t y = 0; y * m < l.cells_y; ++y) {
        if (progress && !progress(static_cast<double>(y * m) / static_cast<double>(l.cells_y)))
            return Error{ErrorCode::interrupted, "stopped"};
        for (std::int64_t x = 0; x * m < l.cells_x; ++x) {
            auto tile = read_height_tile(**reader, d, {l.deepest_level, x, y});
            if (!tile) return tile.error();
            for (std::int64_t j = 0; j <= std::min(m, l.cells_y - y * m); ++j)
                for (std::int64_t i = 0; i <= std::min(m, l.cells_x - x * m); ++i)
                    raster.z[static_cast<std::size_t>((y * m + j) * raster.columns + x * m + i)] =
                        d.height_m(tile->samples[static_cast<std::size_t>(j * l.tile_samples() + i)]);
        }
    }
    return raster;
}

}  // namespace scree
