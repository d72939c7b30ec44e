// A mountain landscape without end, as a pure function of the place: the ground that `scree synth` samples. Only
// integer hashes and + - * / sqrt, so the same seed gives the same bits on every x86-64 (built with -ffp-contract=off).
// Immutable after construction: any thread may call.
#pragma once

#include <cstdint>
#include <span>

namespace scree {

struct Colour {
    std::uint8_t red = 0;
    std::uint8_t green = 0;
    std::uint8_t blue = 0;
};

/// What changes over hundreds of metres: cheap to interpolate between samples. 0..1 each.
struct Cover {
    float patch = 0;  ///< fields, clearings
    float wide = 0;   ///< dry and wet sides of a valley
};

class Landscape {
public:
    explicit Landscape(std::uint64_t seed);

    /// Metres above the datum at east, south metres from the north-west corner; lakes are flat at kLakeLevel_m.
    float height_m(double east_m, double south_m) const;
    /// The same along a row: out[i] is the height at first_east_m + i * step_m. Faster than one by one.
    void heights_m(double first_east_m, double step_m, double south_m, std::span<float> out) const;

    Cover cover(double east_m, double south_m) const;

    /// The ground that is drawn at a place: its height and dz/deast, dz/dsouth in metres per metre.
    struct Ground {
        float height_m = 0;
        float slope_east = 0;
        float slope_south = 0;
        Cover cover;
    };
    /// What a satellite sees there around noon: land cover by height, slope and moisture, mildly shaded from the
    /// north-west.
    Colour colour(double east_m, double south_m, const Ground& ground) const;

    static constexpr float kLakeLevel_m = 455;

private:
    struct Range {
        float uplift = 0;   ///< share of the full height that mountains reach here
        float floor_m = 0;  ///< height of the valley floors
    };
    Range range_at(double east_m, double south_m) const;

    std::uint32_t salt_;
};

}  // namespace scree
