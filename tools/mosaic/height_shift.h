// Heights of one file brought to another vertical reference, sample by sample. The shift varies slowly: it is PROJ's
// own at the corners of blocks of the file's samples and bilinear between them; a block is halved until its middle and
// the middles of its sides agree with PROJ within a quarter of kHeightShiftBound_m. Blocks are those of the file, so a
// sample's height does not depend on the rows asked for.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "common/result.h"
#include "tools/mosaic/layer.h"
#include "tools/source/vertical_crs.h"

namespace scree {

/// A sixteenth of the quantum that resampled heights are rounded to.
inline constexpr double kHeightShiftBound_m = 1.0 / 1024;

class HeightShift {
public:
    /// The file and its datum change (PlacedFile::datum_change) must outlive it. Errors: VerticalShift::make's.
    static Result<HeightShift> make(const PlacedFile& file);

    /// Rows [begin, end) of the file, in metres, row-major, in place; NaN and infinities stay. Errors:
    /// ErrorCode::input, naming the first sample for which there is no shift.
    Result<void> apply(std::int64_t begin, std::int64_t end, std::span<double> values) const;

private:
    // Height = offset + slope * height.
    struct Line {
        double offset = 0, slope = 1;
    };
    struct Rows {
        std::int64_t begin = 0, end = 0;
        std::span<double> values;
    };
    struct Block {
        std::int64_t column = 0, row = 0, side = 0;
    };
    HeightShift(const PlacedFile& file, VerticalShift shift) : file_(&file), shift_(std::move(shift)) {}
    template <std::size_t N>
    std::array<Line, N> lines_at(const std::array<double, N>& columns, const std::array<double, N>& rows) const;
    Result<void> apply_block(const Block& block, const Rows& rows) const;
    Result<void> apply_sample(const Block& block, double& value) const;

    const PlacedFile* file_;
    VerticalShift shift_;
};

}  // namespace scree
