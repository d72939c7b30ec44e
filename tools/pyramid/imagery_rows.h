// Texel rows of the finest texture level from a georeferenced image: bilinear between pixel centres, an exact copy
// where the texels coincide with the pixels. Reads the image once, forward, holding two rows and the reader's own band.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "tools/source/image_source.h"

namespace scree {

/// Texel centres in CRS metres: x = first_x + c * step, y = first_y - r * step.
struct TexelGrid {
    double first_x = 0, first_y = 0;
    double step = 1;
    std::int64_t width = 0;
};

class ImageryRows {
public:
    /// `source` must be north-up and square enough (checked by the plan).
    ImageryRows(ImageSource& source, const Georeference& where, const TexelGrid& grid);

    /// Texel row r (ascending calls): RGBA, alpha 0 where the image has nothing.
    Result<void> sample(std::int64_t r, std::span<std::uint8_t> out);
    static std::int64_t bytes_needed(const ImageInfo& info, std::int64_t texels_wide);

private:
    Result<const std::uint8_t*> image_row(std::int64_t row);

    ImageSource& source_;
    std::int64_t width_, height_;
    double row_first_, row_step_;  // image row of texel row r = row_first + r * row_step
    struct Column {
        std::int32_t left;     // pixel index, -1: outside
        std::uint16_t weight;  // of the right neighbour, 0..256
    };
    std::vector<Column> columns_;
    std::int64_t copy_from_ = -1;  // identity columns: first pixel, else -1
    std::int64_t copy_texel_ = 0, copy_count_ = 0;
    std::vector<std::uint8_t> band_;
    std::int64_t band_first_ = 0, band_rows_ = 0;
};

}  // namespace scree
