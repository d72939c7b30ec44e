// Highlight: what a tile's colour may tell in place of its imagery's, and in which colours. Pure; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace scree {

enum class Highlight : std::uint8_t {
    none,
    level,   ///< the tile's level
    geomip,  ///< how much sparser than its samples the tile is drawn, by powers of two
    error    ///< how far off the surface drawn may be
};

/// sRGB and 255. Of level and geomip, `value` is the number: eight colours in turn, light and dark by turns, so that
/// neighbours differ to every kind of colour vision. Of error, 0 (dark blue) to 1 (yellow), lighter throughout by even
/// steps; beyond them, the ends. Of none, black.
std::array<std::uint8_t, 4> highlight_colour(Highlight highlight, double value);

/// "level", "geomip", "error", "none"; nothing of other words.
std::optional<Highlight> highlight_from(std::string_view name);

}  // namespace scree
