// Hypsometry: the colour of a height, for ground that has no imagery. Plain arithmetic (no function whose last bit
// depends on a library), so that a store's bytes are the same everywhere. Immutable; any thread.
//
// Colours go by absolute elevation, as on physical maps: grey-green lowland over sand and ochre to brown and grey, the
// higher the lighter in the end, white for what is really high. After Imhof, Cartographic Relief Presentation (1982),
// chapter 13, and Patterson and Jenny, "The development and rationale of cross-blended hypsometric tints",
// Cartographic Perspectives 69 (2011): muted, and no green so strong that a desert would seem a meadow. A range too
// narrow to show anything so is stretched about where it lies, but never into the greys and whites.
#pragma once

#include <array>
#include <vector>

namespace scree {

/// sRGB, 0..255.
struct TintColour {
    double r = 0, g = 0, b = 0;
};

class Hypsometry {
public:
    /// The heights of all the ground, metres; any finite numbers. Below -500 m no land lies dry: then what is under 0
    /// is sea.
    Hypsometry(double min_height_m, double max_height_m);

    TintColour at(double height_m) const;

private:
    static constexpr int kEntries = 1024;
    TintColour exact(double height_m) const;

    double min_m_, per_m_;  ///< entries a metre
    bool has_sea_;
    double from_ = 0, scale_ = 1;  ///< stretches the scale of elevations
    std::vector<TintColour> table_;
};

}  // namespace scree
