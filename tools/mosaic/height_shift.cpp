#include "tools/mosaic/height_shift.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

constexpr std::int64_t kBlock = 64;
constexpr double kSecondHeight_m = 1000;   // besides 0, where the line between heights is taken from
constexpr double kFarthestHeight_m = 1e4;  // at which lines are compared
// Grids are bilinear by cells. Where one edge of cells crosses a block, the chord is off by at most twice as much as at
// the middle, along either axis.
constexpr double kCheckedBound_m = kHeightShiftBound_m / 4;

}  // namespace

Result<HeightShift> HeightShift::make(const PlacedFile& file) {
    const DatumChange& change = *file.datum_change;
    auto from = VerticalCrs::parse(change.from);
    if (!from) return Error{from.error().code, fmt::format("{}: {}", file.path, from.error().message)};
    auto to = VerticalCrs::parse(change.to);
    if (!to) return Error{to.error().code, fmt::format("{}: {}", file.path, to.error().message)};
    auto shift = VerticalShift::make(file.crs, *from, *to, change.area);
    if (!shift) return Error{shift.error().code, fmt::format("{}: {}", file.path, shift.error().message)};
    return HeightShift(file, std::move(*shift));
}

template <std::size_t N>
std::array<HeightShift::Line, N> HeightShift::lines_at(const std::array<double, N>& columns,
                                                       const std::array<double, N>& rows) const {
    std::array<double, 2 * N> x{}, y{}, z{};
    for (std::size_t k = 0; k < N; ++k) {
        x[2 * k] = x[2 * k + 1] = file_->where.x(columns[k], rows[k]);
        y[2 * k] = y[2 * k + 1] = file_->where.y(columns[k], rows[k]);
        z[2 * k + 1] = kSecondHeight_m;
    }
    shift_.apply(x, y, z);
    std::array<Line, N> lines;
    for (std::size_t k = 0; k < N; ++k) lines[k] = {z[2 * k], (z[2 * k + 1] - z[2 * k]) / kSecondHeight_m};
    return lines;
}

Result<void> HeightShift::apply(std::int64_t begin, std::int64_t end, std::span<double> values) const {
    const std::int64_t width = file_->info.width;
    for (std::int64_t row = begin / kBlock * kBlock; row < end; row += kBlock)
        for (std::int64_t column = 0; column < width; column += kBlock)
            if (auto ok = apply_block({column, row, kBlock}, {begin, end, values}); !ok) return ok;
    return {};
}

Result<void> HeightShift::apply_sample(const Block& block, double& value) const {
    const Line line = lines_at<1>({static_cast<double>(block.column)}, {static_cast<double>(block.row)})[0];
    const double shifted = line.offset + line.slope * value;
    if (!std::isfinite(shifted))
        return Error{
            ErrorCode::input,
            fmt::format("{}: \"{}\" says nothing of the place of row {}, column {}, so its height {} cannot be "
                        "brought from {} to {}",
                        file_->path, shift_.operation(), block.row, block.column, value, file_->datum_change->from,
                        file_->datum_change->to)};
    value = shifted;
    return {};
}

Result<void> HeightShift::apply_block(const Block& block, const Rows& rows) const {
    const std::int64_t width = file_->info.width;
    const std::int64_t west = block.column, east = std::min(block.column + block.side, width);
    const std::int64_t north = std::max(block.row, rows.begin), south = std::min(block.row + block.side, rows.end);
    const auto at = [&](std::int64_t column, std::int64_t row) -> double& {
        return rows.values[static_cast<std::size_t>((row - rows.begin) * width + column)];
    };
    bool any = false;
    for (std::int64_t r = north; r < south && !any; ++r)
        for (std::int64_t c = west; c < east && !any; ++c) any = std::isfinite(at(c, r));
    if (!any) return {};
    if (block.side == 1) return apply_sample(block, at(block.column, block.row));

    const auto left = static_cast<double>(block.column), top = static_cast<double>(block.row),
               side = static_cast<double>(block.side);
    const double right = left + side, bottom = top + side, middle_x = left + side / 2, middle_y = top + side / 2;
    const auto lines = lines_at<9>({left, right, left, right, middle_x, middle_x, left, right, middle_x},
                                   {top, top, bottom, bottom, middle_y, top, middle_y, middle_y, bottom});
    const auto between = [&](double u, double v) {
        const auto mix = [&](double a, double b, double c, double d) {
            return std::lerp(std::lerp(a, b, u), std::lerp(c, d, u), v);
        };
        return Line{mix(lines[0].offset, lines[1].offset, lines[2].offset, lines[3].offset),
                    mix(lines[0].slope, lines[1].slope, lines[2].slope, lines[3].slope)};
    };
    const std::array<Line, 5> middles = {between(0.5, 0.5), between(0.5, 0), between(0, 0.5), between(1, 0.5),
                                         between(0.5, 1)};
    bool close = true;
    for (std::size_t k = 0; k < middles.size(); ++k) {
        const Line& exact = lines[4 + k];
        // NaN is never close.
        close = close && std::abs(middles[k].offset - exact.offset) +
                                 std::abs(middles[k].slope - exact.slope) * kFarthestHeight_m <=
                             kCheckedBound_m;
    }
    if (!close) {
        const std::int64_t half = block.side / 2;
        for (const Block& quarter :
             {Block{block.column, block.row, half}, Block{block.column + half, block.row, half},
              Block{block.column, block.row + half, half}, Block{block.column + half, block.row + half, half}})
            if (auto ok = apply_block(quarter, rows); !ok) return ok;
        return {};
    }
    for (std::int64_t r = north; r < south; ++r)
        for (std::int64_t c = west; c < east; ++c) {
            double& value = at(c, r);
            if (!std::isfinite(value)) continue;
            const Line line = between((static_cast<double>(c) - left) / side, (static_cast<double>(r) - top) / side);
            value = line.offset + line.slope * value;
        }
    return {};
}

}  // namespace scree
