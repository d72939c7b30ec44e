// How the bands of an image become 8-bit RGB(A).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

/// Value `low` is shown black, `high` white, in between linear (in files whose 0 is white, the other way round). One
/// for all bands and all files of a mosaic. low < high, both finite.
struct Stretch {
    double low = 0, high = 255;
    /// Files of 8 bits stay as they are (so what choose_stretch found: beside 16-bit files a mosaic's 8-bit ones are
    /// finished pictures). False, for what a user typed: every file is stretched.
    bool spares_8bit = false;
    friend bool operator==(const Stretch&, const Stretch&) = default;
};

/// What the channels of a file mean, whatever its format:
/// - Alpha is a channel that the file declares as such (TIFF: ExtraSamples 1 or 2); a fourth band alone is none.
/// - Palettes, CMYK (R = (255-C)(255-K)/255, no profile), YCbCr and CIE Lab count as three bands of 8 bits, RGB.
/// - A TIFF's transparency mask makes transparent; where it has a sample for each band, a pixel goes when all shown
///   bands are masked out.
/// - Orientation (TIFF tag 274, EXIF) is ignored, as GDAL does: rows and columns are those that are stored, which is
///   what a world file or a GeoTIFF's tags place.
struct ColourReading {
    /// 1-based bands shown as red, green, blue (three), or as grey (one). Empty: the file's first three besides alpha,
    /// or its first one where it has fewer. Alpha is always the file's own.
    std::vector<int> bands;
    std::optional<Stretch> stretch;  ///< none: 8-bit as they are, others over their type's range, floats over 0..1
    /// A pixel whose shown bands all hold it is transparent; besides the file's tag (in a TIFF's palette an index). A
    /// float pixel with NaN in a shown band always is.
    std::optional<double> nodata;
};

struct OpenOptions;

/// What --stretch stands for when it is not given: nullopt where every file is 8-bit (palettes, CMYK and fewer bits
/// count as such); else percentiles 2 and 98 of the shown bands of the others together (nodata and transparent pixels
/// aside), from evenly spread strips or rows of tiles, at most about 2^24 samples; the same for the same files in the
/// same order. A constant image comes out mid-grey. options.colours.stretch is not used. Holds the samples as float32
/// (64 MiB) besides one file's unit. Errors: those of opening and reading a file.
Result<std::optional<Stretch>> choose_stretch(const std::vector<std::string>& images, const OpenOptions& options);

}  // namespace scree
