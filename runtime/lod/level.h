// Level: a continuous geomip level on the absolute scale of strides, log2 of finest cells, in fixed point: exact under
// the additions and comparisons that make neighbours agree bit for bit.
#pragma once

#include <cstdint>

namespace scree {

using Level = std::int32_t;  ///< 1/65536 of a level; 0 is the finest stride

inline constexpr int kLevelBits = 16;
inline constexpr Level kOneLevel = 1 << kLevelBits;

inline constexpr Level level_of(int exponent) { return exponent << kLevelBits; }
inline constexpr int exponent_of(Level level) { return level >> kLevelBits; }
/// A share of a level, rounded towards 0.
inline constexpr Level level_of_share(double share) { return static_cast<Level>(share * kOneLevel); }
/// How far past its exponent: exact in float.
inline constexpr float morph_of(Level level) {
    return static_cast<float>(level & (kOneLevel - 1)) / static_cast<float>(kOneLevel);
}

}  // namespace scree
