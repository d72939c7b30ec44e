#include "tools/mosaic/sample_positions.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kCheckedCells = 32;  // along each axis: where a grid has more, every so many-th is checked
constexpr int kQuarters = 4;                // a cell is checked on a 5 x 5 grid: an odd error is nought at its middles

PlanePoint mix(const PlanePoint& a, const PlanePoint& b, double t) {
    return {(1 - t) * a.x + t * b.x, (1 - t) * a.y + t * b.y};
}

double distance(const PlanePoint& a, const PlanePoint& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// First and one past the last column of some control cells, and the cells between which are looked at.
std::vector<std::int64_t> checked_cells(const ControlAxis& axis) {
    const std::int64_t cells = axis.points() - 1, looked_at = std::min(cells, kCheckedCells);
    std::vector<std::int64_t> chosen;
    for (std::int64_t k = 0; k < looked_at; ++k)
        chosen.push_back(looked_at == 1 ? 0 : k * (cells - 1) / (looked_at - 1));
    return chosen;
}

}  // namespace

std::int64_t ControlAxis::cell(double sample) const {
    const auto before = static_cast<std::int64_t>(std::floor(sample / static_cast<double>(step)));
    return std::clamp<std::int64_t>(before, 0, points() - 2);
}

struct SamplePositions::Impl {
    Impl(Georeference place, Crs source, Crs target)
        : where(std::move(place)), from(std::move(source)), to(std::move(target)) {}

    Georeference where;
    Crs from, to;
    bool affine = false;
    ControlAxis columns, rows;
    std::mutex mutex;
    std::vector<CrsTransform> idle;  // PROJ's objects serve a thread at a time

    Result<CrsTransform> take() {
        {
            const std::lock_guard lock(mutex);
            if (!idle.empty()) {
                CrsTransform transform = std::move(idle.back());
                idle.pop_back();
                return transform;
            }
        }
        return CrsTransform::make(from, to);
    }
    void give_back(CrsTransform transform) {
        const std::lock_guard lock(mutex);
        idle.push_back(std::move(transform));
    }

    // Places of samples, given as columns and rows in x and y.
    Result<void> transform(std::vector<double>& x, std::vector<double>& y) {
        for (std::size_t k = 0; k < x.size(); ++k) {
            const double column = x[k], row = y[k];
            x[k] = where.x(column, row);
            y[k] = where.y(column, row);
        }
        if (affine) return {};
        auto transform = take();
        if (!transform) return transform.error();
        transform->apply(x, y);
        give_back(std::move(*transform));
        for (std::size_t k = 0; k < x.size(); ++k)
            if (!std::isfinite(x[k]) || !std::isfinite(y[k])) x[k] = y[k] = kNaN;
        return {};
    }

    // Greatest distance, in samples, of what is interpolated from the corners of one cell to what is exact. Places
    // without an image are passed over.
    double cell_error(std::span<const double> x, std::span<const double> y, double columns_wide,
                      double rows_high) const {
        constexpr int kSide = kQuarters + 1;
        const auto at = [&](int c, int r) {
            const auto k = static_cast<std::size_t>(r * kSide + c);
            return PlanePoint{x[k], y[k]};
        };
        const PlanePoint nw = at(0, 0), ne = at(kQuarters, 0), sw = at(0, kQuarters), se = at(kQuarters, kQuarters);
        const double sample = std::min({distance(nw, ne) / columns_wide, distance(sw, se) / columns_wide,
                                        distance(nw, sw) / rows_high, distance(ne, se) / rows_high});
        if (!(sample > 0)) return 0;
        double worst = 0;
        for (int r = 0; r < kSide; ++r)
            for (int c = 0; c < kSide; ++c) {
                const double s = static_cast<double>(c) / kQuarters, t = static_cast<double>(r) / kQuarters;
                const double off = distance(mix(mix(nw, ne, s), mix(sw, se, s), t), at(c, r)) / sample;
                if (off > worst) worst = off;
            }
        return worst;
    }

    Result<bool> close_enough() {
        std::vector<double> x, y;
        for (const std::int64_t cell_row : checked_cells(rows)) {
            x.clear();
            y.clear();
            const auto top = static_cast<double>(rows.at(cell_row)),
                       bottom = static_cast<double>(rows.at(cell_row + 1));
            const std::vector<std::int64_t> cells = checked_cells(columns);
            for (const std::int64_t cell : cells) {
                const auto left = static_cast<double>(columns.at(cell)),
                           right = static_cast<double>(columns.at(cell + 1));
                for (int r = 0; r <= kQuarters; ++r)
                    for (int c = 0; c <= kQuarters; ++c) {
                        x.push_back(left + (right - left) * c / kQuarters);
                        y.push_back(top + (bottom - top) * r / kQuarters);
                    }
            }
            if (auto ok = transform(x, y); !ok) return ok.error();
            constexpr std::size_t kCount = (kQuarters + 1) * (kQuarters + 1);
            for (std::size_t k = 0; k < cells.size(); ++k) {
                const double wide = static_cast<double>(columns.at(cells[k] + 1) - columns.at(cells[k]));
                const double error = cell_error(std::span(x).subspan(k * kCount, kCount),
                                                std::span(y).subspan(k * kCount, kCount), wide, bottom - top);
                if (error > kPositionBoundSamples) return false;
            }
        }
        return true;
    }

    Result<void> choose_step() {
        std::int64_t step = 1;
        while (step < std::max(columns.count, rows.count) - 1) step *= 2;
        for (;; step /= 2) {
            columns.step = rows.step = step;
            if (affine || step == 1) return {};
            auto close = close_enough();
            if (!close) return close.error();
            if (*close) return {};
        }
    }
};

Result<SamplePositions> SamplePositions::make(const Layer& layer, const Crs& to) {
    auto impl = std::make_unique<Impl>(layer.where, layer.crs, to);
    auto transform = CrsTransform::make(layer.crs, to);
    if (!transform) return transform.error();
    impl->affine = transform->identity();
    impl->give_back(std::move(*transform));
    impl->columns.count = layer.columns;
    impl->rows.count = layer.rows;
    if (auto ok = impl->choose_step(); !ok) return ok.error();
    return SamplePositions(std::move(impl));
}

ControlAxis SamplePositions::columns() const { return impl_->columns; }
ControlAxis SamplePositions::rows() const { return impl_->rows; }

Result<void> SamplePositions::control(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                                      std::span<PlanePoint> out) const {
    std::vector<double> x, y;
    for (std::int64_t r = row; r < row + rows; ++r)
        for (std::int64_t c = column; c < column + columns; ++c) {
            x.push_back(static_cast<double>(impl_->columns.at(c)));
            y.push_back(static_cast<double>(impl_->rows.at(r)));
        }
    if (auto ok = impl_->transform(x, y); !ok) return ok;
    for (std::size_t k = 0; k < x.size(); ++k) out[k] = {x[k], y[k]};
    return {};
}

Result<SamplePositions::Window> SamplePositions::window(std::int64_t column, std::int64_t row, std::int64_t columns,
                                                        std::int64_t rows) const {
    Window w;
    w.columns_ = impl_->columns;
    w.rows_ = impl_->rows;
    w.first_column_ = w.columns_.cell(static_cast<double>(column));
    w.first_row_ = w.rows_.cell(static_cast<double>(row));
    w.pitch_ = w.columns_.cell(static_cast<double>(column + columns - 1)) + 2 - w.first_column_;
    const std::int64_t high = w.rows_.cell(static_cast<double>(row + rows - 1)) + 2 - w.first_row_;
    w.points_.resize(static_cast<std::size_t>(w.pitch_ * high));
    if (auto ok = control(w.first_column_, w.first_row_, w.pitch_, high, w.points_); !ok) return ok.error();
    return w;
}

PlanePoint SamplePositions::Window::position(double column, double row) const {
    const std::int64_t cc = columns_.cell(column), cr = rows_.cell(row);
    const auto left = static_cast<double>(columns_.at(cc)), right = static_cast<double>(columns_.at(cc + 1));
    const auto top = static_cast<double>(rows_.at(cr)), bottom = static_cast<double>(rows_.at(cr + 1));
    const PlanePoint* nw = points_.data() + (cr - first_row_) * pitch_ + (cc - first_column_);
    const double s = (column - left) / (right - left);
    return mix(mix(nw[0], nw[1], s), mix(nw[pitch_], nw[pitch_ + 1], s), (row - top) / (bottom - top));
}

SamplePositions::SamplePositions(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SamplePositions::SamplePositions(SamplePositions&&) noexcept = default;
SamplePositions& SamplePositions::operator=(SamplePositions&&) noexcept = default;
SamplePositions::~SamplePositions() = default;

}  // namespace scree
