// Where the samples of a layer stand in another CRS: exact at control points, every `step` samples in both directions
// and on the last column and row, bilinear between them. The step is the largest power of two that keeps the positions
// within 1e-3 of a sample's distance of PROJ's own, found by halving; an affine layer has its four corners. Nothing of
// the grid is kept: control points are made for the window that asks. Immutable; every call from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "tools/mosaic/layer.h"

namespace scree {

/// Greatest distance between an interpolated position and PROJ's own, in samples, where it is checked.
inline constexpr double kPositionBoundSamples = 1e-3;

/// The columns (or rows) of a layer that bear control points: 0, step, 2 step... and the last one.
struct ControlAxis {
    std::int64_t count = 0;  ///< samples along the axis, at least 2
    std::int64_t step = 1;

    std::int64_t points() const { return (count - 2) / step + 2; }
    std::int64_t at(std::int64_t point) const { return point >= points() - 1 ? count - 1 : point * step; }
    /// The control cell that a sample lies in: point `cell` is before it, `cell + 1` after it or on it.
    std::int64_t cell(double sample) const;
};

struct PlanePoint {
    double x = 0, y = 0;  ///< NaN, both: no place in the CRS
};

class SamplePositions {
public:
    /// Errors: CrsTransform::make's. The layer has at least 2 x 2 samples.
    static Result<SamplePositions> make(const Layer& layer, const Crs& to);

    ControlAxis columns() const;
    ControlAxis rows() const;
    /// The control points [column, column + columns) x [row, row + rows), counted in control points, row-major.
    Result<void> control(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                         std::span<PlanePoint> out) const;

    /// Positions of the samples in [column, column + columns) x [row, row + rows).
    class Window {
    public:
        PlanePoint position(double column, double row) const;

    private:
        friend class SamplePositions;
        ControlAxis columns_, rows_;
        std::int64_t first_column_ = 0, first_row_ = 0, pitch_ = 0;
        std::vector<PlanePoint> points_;
    };
    Result<Window> window(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows) const;

    SamplePositions(SamplePositions&&) noexcept;
    SamplePositions& operator=(SamplePositions&&) noexcept;
    ~SamplePositions();

private:
    struct Impl;
    explicit SamplePositions(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
