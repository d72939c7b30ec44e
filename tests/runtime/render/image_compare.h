// Pictures in tests: load a PNG, and compare one with its golden copy, tolerant of what drivers may round differently.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

struct Image {
    int width_px = 0;
    int height_px = 0;
    std::vector<std::uint8_t> rgb;  ///< sRGB RGB8, top row first
};

/// Errors (ErrorCode::io) name the path and the cause.
Result<Image> load_png(const std::filesystem::path& path);

struct ImageTolerance {
    int per_channel = 2;             ///< larger differences make a pixel a differing one
    double differing_share = 0.001;  ///< of all pixels may differ: edges of triangles, texels on a boundary
};

struct ImageDifference {
    bool same = false;    ///< within the tolerance
    double share = 0;     ///< of pixels that differ by more than per_channel
    int largest = 0;      ///< difference of a channel
    std::string message;  ///< one line for the test's output
};

/// When not the same and `difference_path` is not empty, a picture is written there: golden in grey, differing pixels
/// in red.
ImageDifference compare_images(const Image& golden, const Image& found, const ImageTolerance& tolerance,
                               const std::filesystem::path& difference_path = {});

}  // namespace scree
