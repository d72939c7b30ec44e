// What grid points read of a layer: the window of samples around them.
#pragma once

#include <cstdint>
#include <optional>

#include "tools/mosaic/layer.h"
#include "tools/mosaic/sample_rectangle.h"
#include "tools/source/resample.h"

namespace scree {

/// Samples held to make a rectangle; larger ones are halved.
inline constexpr std::int64_t kMostWindowSamples = std::int64_t{1} << 18;

/// What the kernel and the margins of rounding may read around the points' own samples; none where no point meets the
/// layer. The windows of some of the points lie within that of all.
std::optional<SampleRectangle> source_window(const SourcePoints& points, const Layer& layer, const ResampleRule& rule);

/// Chunks of the map (WarpMap::kChunk points a side), by the points' indices.
std::int64_t chunk_of(std::int64_t i);
std::int64_t chunk_middle(std::int64_t i);

}  // namespace scree
