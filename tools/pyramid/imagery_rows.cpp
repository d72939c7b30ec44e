#include "tools/pyramid/imagery_rows.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace scree {
namespace {

constexpr std::int64_t kBandRows = 16;
constexpr double kAligned = 1e-6;  // pixels: below this the texels are the pixels

// Position in pixels to a left neighbour and the right one's weight; outside the half-pixel rim: none.
bool locate(double u, std::int64_t size, std::int64_t& left, int& weight) {
    if (!(u >= -0.5 - kAligned && u <= static_cast<double>(size) - 0.5 + kAligned)) return false;
    u = std::clamp(u, 0.0, static_cast<double>(size - 1));
    left = std::min(static_cast<std::int64_t>(u), std::max<std::int64_t>(size - 2, 0));
    weight = static_cast<int>(std::lround((u - static_cast<double>(left)) * 256));
    return true;
}

}  // namespace

ImageryRows::ImageryRows(ImageSource& source, const Georeference& where, const TexelGrid& grid)
    : source_(source),
      width_(source.info().width),
      height_(source.info().height),
      row_first_((grid.first_y - where.first_y) / where.row_y),
      row_step_(-grid.step / where.row_y),
      columns_(static_cast<std::size_t>(grid.width)) {
    const double first = (grid.first_x - where.first_x) / where.column_x, step = grid.step / where.column_x;
    for (std::int64_t c = 0; c < grid.width; ++c) {
        std::int64_t left = -1;
        int weight = 0;
        if (!locate(first + static_cast<double>(c) * step, width_, left, weight)) left = -1;
        columns_[static_cast<std::size_t>(c)] = {static_cast<std::int32_t>(left), static_cast<std::uint16_t>(weight)};
    }
    const double drift = std::abs(step - 1) * static_cast<double>(grid.width);
    if (drift < kAligned && std::abs(first - std::nearbyint(first)) < kAligned) {
        const auto shift = static_cast<std::int64_t>(std::nearbyint(first));
        copy_texel_ = std::max<std::int64_t>(0, -shift);
        copy_from_ = copy_texel_ + shift;
        copy_count_ = std::max<std::int64_t>(0, std::min(grid.width - copy_texel_, width_ - copy_from_));
    }
}

std::int64_t ImageryRows::bytes_needed(const ImageInfo& info, std::int64_t texels_wide) {
    return (kBandRows + 1) * info.width * 4 + texels_wide * static_cast<std::int64_t>(sizeof(Column)) +
           2 * info.unit_bytes;
}

Result<const std::uint8_t*> ImageryRows::image_row(std::int64_t row) {
    if (row < band_first_ || row >= band_first_ + band_rows_) {
        // Keep the last row when moving on: bilinear filtering asks for pairs.
        const std::int64_t count = std::min(kBandRows, height_ - row);
        band_.resize(static_cast<std::size_t>((kBandRows + 1) * width_ * 4));
        std::int64_t kept = 0;
        if (band_rows_ > 0 && row == band_first_ + band_rows_) {
            std::memmove(band_.data(), band_.data() + (band_rows_ - 1) * width_ * 4,
                         static_cast<std::size_t>(width_ * 4));
            kept = 1;
        }
        const auto bytes = static_cast<std::size_t>(count * width_ * 4);
        if (auto ok = source_.read_rgba8(row, row + count, {band_.data() + kept * width_ * 4, bytes}); !ok)
            return ok.error();
        band_first_ = row - kept;
        band_rows_ = count + kept;
    }
    return static_cast<const std::uint8_t*>(band_.data() + (row - band_first_) * width_ * 4);
}

Result<void> ImageryRows::sample(std::int64_t r, std::span<std::uint8_t> out) {
    std::int64_t top = 0;
    int weight_y = 0;
    if (!locate(row_first_ + static_cast<double>(r) * row_step_, height_, top, weight_y)) {
        std::fill(out.begin(), out.end(), std::uint8_t{0});
        return {};
    }
    auto upper = image_row(top);
    if (!upper) return upper.error();
    const std::uint8_t* a = *upper;
    const std::uint8_t* b = a;
    if (weight_y != 0 && height_ > 1) {
        auto lower = image_row(top + 1);
        if (!lower) return lower.error();
        b = *lower;
        a = *image_row(top);  // still held: the band keeps its last row
    }
    if (weight_y == 0 && copy_from_ >= 0) {
        std::fill(out.begin(), out.end(), std::uint8_t{0});
        std::memcpy(out.data() + copy_texel_ * 4, a + copy_from_ * 4, static_cast<std::size_t>(copy_count_ * 4));
        return {};
    }
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        std::uint8_t* o = out.data() + 4 * c;
        const Column column = columns_[c];
        if (column.left < 0) {
            std::memset(o, 0, 4);
            continue;
        }
        const std::size_t left = static_cast<std::size_t>(column.left) * 4;
        const std::size_t right = left + (column.weight != 0 ? 4 : 0);
        const int wx = column.weight, vx = 256 - wx, wy = weight_y, vy = 256 - wy;
        // Pixels without alpha lend no colour: the nearest of the four decides whether there is imagery.
        if ((a[left + 3] & a[right + 3] & b[left + 3] & b[right + 3]) != 255) {
            const std::uint8_t* nearest = (wy < 128 ? a : b) + (wx < 128 ? left : right);
            std::memcpy(o, nearest, 4);
            continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const int value = (a[left + k] * vx + a[right + k] * wx) * vy + (b[left + k] * vx + b[right + k] * wx) * wy;
            o[k] = static_cast<std::uint8_t>((value + 32768) >> 16);
        }
        o[3] = 255;
    }
    return {};
}

}  // namespace scree
