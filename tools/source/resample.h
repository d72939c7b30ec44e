// Values of a raster between its samples. Kernels: nearest; bilinear; cubic (Keys 1981, a = -1/2). Where the target is
// coarser than the source the kernels but nearest become means over the target cell's footprint (a box along each
// axis), so that nothing between the points is lost. Voids have no weight; a point whose nearest sample is void is
// void.
#pragma once

#include <cstdint>
#include <span>

#include "tools/source/warp_map.h"

namespace scree {

enum class Kernel { nearest, bilinear, cubic };

/// A window of a source: sample (first_column + c, first_row + r) is values[r * columns + c]. What lies outside the
/// source's whole raster must be NaN (heights) or alpha 0 (colour) in it.
template <class T>
struct SampleWindow {
    std::int64_t first_column = 0, first_row = 0, columns = 0, rows = 0;
    std::span<const T> values;
};

/// How far around a point (in samples) a kernel reads at that shrink: windows must hold so much on all sides.
std::int64_t kernel_reach(Kernel kernel, double shrink);

/// Heights, NaN = void. `half_sample_rim`: points up to half a sample outside the outermost sample centres take the
/// edge's value (area rasters reach that far; point rasters do not). source_columns/rows: the whole raster's size.
struct ResampleRule {
    Kernel kernel = Kernel::bilinear;
    WarpMap::Shrink shrink;
    bool half_sample_rim = false;
    std::int64_t source_columns = 0, source_rows = 0;
};
void resample_heights(const SampleWindow<double>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<double> out);
/// RGBA, 4 bytes a sample (one uint32, R lowest byte); colour is weighted by alpha, unassociated; alpha of the result
/// is the weighted mean of alpha, and 0 outside.
void resample_colours(const SampleWindow<std::uint32_t>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<std::uint32_t> out);

}  // namespace scree
