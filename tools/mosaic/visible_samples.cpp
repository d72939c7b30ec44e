#include "tools/mosaic/visible_samples.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "tools/mosaic/sample_positions.h"
#include "tools/mosaic/sample_rectangle.h"

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kRimTolerance = 1e-6;                      // samples, as in resample.h
constexpr std::int64_t kMaxWindow = std::int64_t{1} << 18;  // samples of an upper layer held at a time

// From coordinates in a layer's CRS to its samples.
class LayerPlace {
public:
    explicit LayerPlace(const Layer& layer) : layer_(layer) {
        const Georeference& w = layer.where;
        determinant_ = w.column_x * w.row_y - w.column_y * w.row_x;
        turn_ = layer.crs.turn();
        middle_x_ = w.x(static_cast<double>(layer.columns - 1) / 2, static_cast<double>(layer.rows - 1) / 2);
        rim_ = (layer.half_sample_rim ? 0.5 : 0.0) + kRimTolerance;
    }

    // Nearest sample; false where the place is outside.
    bool nearest(const PlanePoint& place, std::int64_t& column, std::int64_t& row) const {
        const Georeference& w = layer_.where;
        double x = place.x;
        if (turn_ > 0 && std::abs(x - middle_x_) > turn_ / 2) x = middle_x_ + std::remainder(x - middle_x_, turn_);
        const double dx = x - w.first_x, dy = place.y - w.first_y;
        const double c = (dx * w.row_y - dy * w.row_x) / determinant_;
        const double r = (dy * w.column_x - dx * w.column_y) / determinant_;
        const auto last_c = static_cast<double>(layer_.columns - 1), last_r = static_cast<double>(layer_.rows - 1);
        if (!(c >= -rim_ && c <= last_c + rim_ && r >= -rim_ && r <= last_r + rim_)) return false;
        column = static_cast<std::int64_t>(std::clamp(std::nearbyint(c), 0.0, last_c));
        row = static_cast<std::int64_t>(std::clamp(std::nearbyint(r), 0.0, last_r));
        return true;
    }

private:
    const Layer& layer_;
    double determinant_ = 1, turn_ = 0, middle_x_ = 0, rim_ = 0;
};

}  // namespace

struct VisibleSamples::Impl {
    const HeightStack* stack = nullptr;
    std::vector<std::size_t> crs_of;  // of each layer: the first layer with the same CRS
    // Places of a layer's samples in the CRS of layers above it.
    std::map<std::pair<std::size_t, std::size_t>, SamplePositions> positions;

    struct Nearest {
        std::size_t index;  // in the rectangle
        std::int64_t column, row;
    };

    Result<void> hide(std::size_t k, std::size_t upper, const SampleRectangle& area, std::span<double> out,
                      std::int64_t pitch) const {
        const auto found = positions.find({k, crs_of[upper]});
        auto window = found->second.window(area.column, area.row, area.columns, area.rows);
        if (!window) return window.error();
        return hide_under(stack->layer(upper), upper, area, *window, out, pitch);
    }

    Result<void> hide_under(const Layer& layer, std::size_t upper, const SampleRectangle& area,
                            const SamplePositions::Window& window, std::span<double> out, std::int64_t pitch) const {
        const LayerPlace place(layer);
        std::vector<Nearest> points;
        std::int64_t west = layer.columns, east = -1, north = layer.rows, south = -1;
        for (std::int64_t r = 0; r < area.rows; ++r)
            for (std::int64_t c = 0; c < area.columns; ++c) {
                const auto index = static_cast<std::size_t>(r * pitch + c);
                if (!std::isfinite(out[index])) continue;
                Nearest n{index, 0, 0};
                const PlanePoint at =
                    window.position(static_cast<double>(area.column + c), static_cast<double>(area.row + r));
                if (!place.nearest(at, n.column, n.row)) continue;
                west = std::min(west, n.column);
                east = std::max(east, n.column);
                north = std::min(north, n.row);
                south = std::max(south, n.row);
                points.push_back(n);
            }
        if (points.empty()) return {};
        const SampleRectangle above{west, north, east - west + 1, south - north + 1};
        if (above.count() > kMaxWindow && area.count() > 1) return halves(layer, upper, area, window, out, pitch);
        std::vector<double> values(static_cast<std::size_t>(above.count()));
        if (auto ok = stack->samples(upper, above.column, above.row, above.columns, above.rows, values); !ok) return ok;
        for (const Nearest& n : points)
            if (std::isfinite(
                    values[static_cast<std::size_t>((n.row - above.row) * above.columns + n.column - above.column)]))
                out[n.index] = kHiddenSample;
        return {};
    }

    // Where the layer above is far finer.
    Result<void> halves(const Layer& layer, std::size_t upper, const SampleRectangle& area,
                        const SamplePositions::Window& window, std::span<double> out, std::int64_t pitch) const {
        const auto [first, second] = halves_of(area);
        if (auto ok = hide_under(layer, upper, first, window, out, pitch); !ok) return ok;
        const auto skipped = (second.row - area.row) * pitch + second.column - area.column;
        return hide_under(layer, upper, second, window, out.subspan(static_cast<std::size_t>(skipped)), pitch);
    }
};

Result<VisibleSamples> VisibleSamples::make(const HeightStack& stack) {
    auto impl = std::make_unique<Impl>();
    impl->stack = &stack;
    for (std::size_t k = 0; k < stack.layer_count(); ++k) {
        std::size_t same = 0;
        while (!stack.layer(same).crs.same_as(stack.layer(k).crs)) ++same;
        impl->crs_of.push_back(same);
    }
    for (std::size_t k = 0; k < stack.layer_count(); ++k)
        for (std::size_t upper = k + 1; upper < stack.layer_count(); ++upper) {
            const std::pair key{k, impl->crs_of[upper]};
            if (impl->positions.count(key) != 0) continue;
            auto positions = SamplePositions::make(stack.layer(k), stack.layer(upper).crs);
            if (!positions) return positions.error();
            impl->positions.emplace(key, std::move(*positions));
        }
    return VisibleSamples(std::move(impl));
}

Result<void> VisibleSamples::read(std::size_t layer, std::int64_t column, std::int64_t row, std::int64_t columns,
                                  std::int64_t rows, std::span<double> out) const {
    if (auto ok = impl_->stack->samples(layer, column, row, columns, rows, out); !ok) return ok;
    for (double& v : out)
        if (!std::isfinite(v)) v = kNaN;
    const SampleRectangle area{column, row, columns, rows};
    for (std::size_t upper = impl_->stack->layer_count(); upper-- > layer + 1;)
        if (auto ok = impl_->hide(layer, upper, area, out, columns); !ok) return ok;
    return {};
}

VisibleSamples::VisibleSamples(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VisibleSamples::VisibleSamples(VisibleSamples&&) noexcept = default;
VisibleSamples& VisibleSamples::operator=(VisibleSamples&&) noexcept = default;
VisibleSamples::~VisibleSamples() = default;

}  // namespace scree
