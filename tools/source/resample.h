// Values of a raster between its samples. Kernels: nearest; bilinear; cubic (Keys 1981, "Cubic convolution
// interpolation for digital image processing", a = -1/2). Where the target is coarser than the source the kernels but
// nearest become means over the target cell's footprint (a box along each axis), so that nothing between the points is
// lost: of colours over the areas of pixels, of heights over the bilinear surface, which keeps planes planes at every
// width (a mean over whole samples shifts them by up to 0.08 samples, and slopes would ripple). Between one and two
// samples a point the box of heights grows from nothing, so there is no step where shrinking begins. Voids have no
// weight; a point whose nearest sample is void is void. Cubic is bilinear where one of its 16 samples is void, and
// along an axis within a sample of the raster's edge.
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

/// How far around a point (in samples) a kernel reads at that shrink: windows must hold so much on all sides. What a
/// window does not hold counts as void.
std::int64_t kernel_reach(Kernel kernel, double shrink);

/// `half_sample_rim`: points up to half a sample outside the outermost sample centres take the edge's value (area
/// rasters reach that far; point rasters do not). source_columns/rows: the whole raster's size. Along both limits a
/// point may be 1e-6 samples outside.
struct ResampleRule {
    Kernel kernel = Kernel::bilinear;
    WarpMap::Shrink shrink;
    bool half_sample_rim = false;
    std::int64_t source_columns = 0, source_rows = 0;
};
/// Heights, NaN = void. `out` is as long as the points; calls are independent of each other.
void resample_heights(const SampleWindow<double>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<double> out);
/// RGBA, 4 bytes a sample (one uint32, R lowest byte); colour is weighted by alpha, unassociated; void is alpha 0.
/// Alpha of the result is the weighted mean of alpha over samples of the raster, at least 1, and 0 for void.
void resample_colours(const SampleWindow<std::uint32_t>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<std::uint32_t> out);
/// Points at the crossings of columns and rows: those of row 0 first. Gives what the points one by one would, sooner.
struct SourceLines {
    std::span<const double> column, row;
};
void resample_colour_lines(const SampleWindow<std::uint32_t>& window, const SourceLines& lines,
                           const ResampleRule& rule, std::span<std::uint32_t> out);
/// The sample that Kernel::nearest takes along an axis; -1: the point lies outside.
std::int64_t nearest_sample(double u, std::int64_t size, bool half_sample_rim);

}  // namespace scree
