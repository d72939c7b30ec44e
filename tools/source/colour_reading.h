// How the bands of an image become 8-bit RGB(A).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

/// Value `low` is shown black, `high` white, in between linear. One for all bands and all files of a mosaic.
struct Stretch {
    double low = 0, high = 255;
    friend bool operator==(const Stretch&, const Stretch&) = default;
};

struct ColourReading {
    /// 1-based bands shown as red, green, blue (three), or as grey (one). Empty: the file's first three, or its first
    /// one where it has fewer. Alpha is always the file's own.
    std::vector<int> bands;
    std::optional<Stretch> stretch;  ///< none: 8-bit as they are; see choose_stretch for others
    std::optional<double> nodata;    ///< a pixel whose shown bands all hold it is transparent; besides the file's tag
};

struct OpenOptions;

/// What --stretch stands for when it is not given: nullopt where every file is 8-bit; else percentiles 2 and 98 of the
/// shown bands over all files together (nodata and transparent pixels aside), from evenly spread strips of at most
/// about 2^24 samples; the same for the same files in the same order.
Result<std::optional<Stretch>> choose_stretch(const std::vector<std::string>& images, const OpenOptions& options);

}  // namespace scree
