// Downsampling of RGBA texels by two, in linear light and weighted by alpha. Source of the rule: colours are sRGB, so
// their mean is taken of their linear intensities; alpha is a plain mean (docs/store-format.md, "Alpha").
#pragma once

#include <cstdint>

namespace scree {

/// Two rows of 2*count RGBA texels to one of count. Alpha: (sum of four + 2) >> 2. Transparent sources have no weight
/// in the colour. Thread-safe; deterministic.
void downsample_rgba_row(const std::uint8_t* upper, const std::uint8_t* lower, std::int64_t count, std::uint8_t* out);

}  // namespace scree
