#include "tools/mosaic/stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/mosaic/height_shift.h"
#include "tools/mosaic/source_window.h"
#include "tools/source/suspect_values.h"

namespace scree {
namespace {

constexpr std::int64_t kBandRows = RasterSpool<float>::kBlock;
constexpr double kOnGrid = 1e-3;  // samples
constexpr double kUncovered = -std::numeric_limits<double>::infinity();
constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

// Points (i + c * stride, j + r * stride).
struct Rectangle {
    std::int64_t i = 0, j = 0, columns = 0, rows = 0, stride = 1;
    std::int64_t count() const { return columns * rows; }
};

template <class T>
struct SpooledLayer {
    Layer layer;
    std::unique_ptr<RasterSpool<T>> spool;
};

// A layer with the way from grid points into it.
template <class T>
struct LayerOnGrid {
    const SpooledLayer<T>* spooled;
    WarpMap map;
    Kernel kernel;
    double reach = 1;  // of a step, that a point stands for
};

Error interrupted() { return {ErrorCode::interrupted, "stopped; nothing was written"}; }

// Void or uncovered, for points that got no height: what the nearest sample is.
double kind_of_nothing(const std::vector<double>& window, const SampleRectangle& w, double column, double row) {
    if (!std::isfinite(column) || !std::isfinite(row)) return kUncovered;
    const auto c = static_cast<std::int64_t>(std::nearbyint(column)) - w.column;
    const auto r = static_cast<std::int64_t>(std::nearbyint(row)) - w.row;
    if (c < 0 || r < 0 || c >= w.columns || r >= w.rows) return kUncovered;
    return window[static_cast<std::size_t>(r * w.columns + c)];
}

bool is_void_or_value(double v) { return v != kUncovered; }

// The layer's values at points that have none yet. The area lies within one chunk of the map.
template <class T>
class LayerSampler {
public:
    LayerSampler(const LayerOnGrid<T>& layer, const Rectangle& area) : layer_(layer) {
        const auto count = static_cast<std::size_t>(area.count());
        columns_.resize(count);
        rows_.resize(count);
        points_ = {columns_, rows_};
        if (area.stride == 1)
            layer.map.map(area.i, area.j, area.columns, area.rows, points_);
        else
            map_sparse(area);
        // One footprint a chunk of the map: what is asked for does not change what is given.
        WarpMap::Shrink shrink = layer.map.shrink_at(chunk_middle(area.i), chunk_middle(area.j));
        shrink.columns *= layer.reach;
        shrink.rows *= layer.reach;
        rule_ = {layer.kernel, shrink, layer.spooled->layer.half_sample_rim, layer.spooled->layer.columns,
                 layer.spooled->layer.rows};
    }

    std::optional<SampleRectangle> window() const { return source_window(points_, layer_.spooled->layer, rule_); }

    Result<void> overlay(const SampleRectangle& w, std::span<double> out) {
        // The boxes of scattered files are mostly empty.
        if (!layer_.spooled->spool->holds_any(w.column, w.row, w.columns, w.rows)) return {};
        const auto count = static_cast<std::size_t>(w.count());
        std::vector<T> stored(count);
        if (auto ok = layer_.spooled->spool->read(w.column, w.row, w.columns, w.rows, stored); !ok) return ok;
        const std::vector<double> values(stored.begin(), stored.end());
        std::vector<double> finite = values, fresh(out.size());
        for (double& v : finite)
            if (!std::isfinite(v)) v = kVoid;
        resample_heights({w.column, w.row, w.columns, w.rows, finite}, points_, rule_, fresh);
        for (std::size_t k = 0; k < out.size(); ++k) {
            if (std::isfinite(out[k])) continue;
            const double v = std::isfinite(fresh[k]) ? fresh[k] : kind_of_nothing(values, w, columns_[k], rows_[k]);
            if (std::isfinite(fresh[k]))
                out[k] = v;
            else if (is_void_or_value(v))
                out[k] = kVoid;
        }
        return {};
    }

private:
    void map_sparse(const Rectangle& area) {
        const std::int64_t across = (area.columns - 1) * area.stride + 1, down = (area.rows - 1) * area.stride + 1;
        std::vector<double> columns(static_cast<std::size_t>(across * down)), rows(columns.size());
        layer_.map.map(area.i, area.j, across, down, {columns, rows});
        std::size_t k = 0;
        for (std::int64_t r = 0; r < down; r += area.stride)
            for (std::int64_t c = 0; c < across; c += area.stride, ++k) {
                columns_[k] = columns[static_cast<std::size_t>(r * across + c)];
                rows_[k] = rows[static_cast<std::size_t>(r * across + c)];
            }
    }

    const LayerOnGrid<T>& layer_;
    std::vector<double> columns_, rows_;
    SourcePoints points_;
    ResampleRule rule_;
};

bool complete(std::span<const double> out) {
    return std::all_of(out.begin(), out.end(), [](double v) { return std::isfinite(v); });
}

void copy_part(std::span<const double> from, const Rectangle& from_area, std::span<double> to, const Rectangle& to_area,
               const Rectangle& part) {
    for (std::int64_t r = 0; r < part.rows; ++r) {
        const auto at = [&](const Rectangle& area) {
            return ((part.j - area.j) / area.stride + r) * area.columns + (part.i - area.i) / area.stride;
        };
        std::copy_n(from.begin() + at(from_area), part.columns, to.begin() + at(to_area));
    }
}

template <class T>
Result<void> overlay_layer(const LayerOnGrid<T>& layer, const Rectangle& area, std::span<double> out) {
    LayerSampler<T> sampler(layer, area);
    const auto window = sampler.window();
    if (!window) return {};
    if (window->count() <= kMostWindowSamples || area.count() == 1) return sampler.overlay(*window, out);
    // Far more samples than points: quarter by quarter.
    Rectangle first = area, second = area;
    if (area.columns >= area.rows) {
        first.columns = area.columns / 2;
        second.columns = area.columns - first.columns;
        second.i += first.columns * area.stride;
    } else {
        first.rows = area.rows / 2;
        second.rows = area.rows - first.rows;
        second.j += first.rows * area.stride;
    }
    for (const Rectangle& part : {first, second}) {
        std::vector<double> values(static_cast<std::size_t>(part.count()));
        copy_part(out, area, values, part, part);
        if (auto ok = overlay_layer<T>(layer, part, values); !ok) return ok;
        copy_part(values, part, out, area, part);
    }
    return {};
}

template <class T>
Result<void> sample_chunk(const std::vector<LayerOnGrid<T>>& layers, const Rectangle& area, std::span<double> out) {
    std::fill(out.begin(), out.end(), kUncovered);
    for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
        if (auto ok = overlay_layer<T>(*layer, area, out); !ok) return ok;
        if (complete(out)) break;
    }
    return {};
}

// Of the points begin + k * stride: those from `first` on that fall into its chunk of the map. Steps may be far longer
// than chunks.
struct Share {
    std::int64_t first = 0, count = 0;
};
Share share_from(std::int64_t first, std::int64_t begin, std::int64_t count, std::int64_t stride) {
    const std::int64_t at = begin + first * stride, end = (chunk_of(at) + 1) * WarpMap::kChunk;
    return {first, std::min((end - at + stride - 1) / stride, count - first)};
}

template <class T>
Result<void> sample_layers(const std::vector<LayerOnGrid<T>>& layers, const Rectangle& area, std::span<double> out) {
    std::vector<double> values;
    for (Share down; down.first < area.rows; down.first += down.count) {
        down = share_from(down.first, area.j, area.rows, area.stride);
        for (Share across; across.first < area.columns; across.first += across.count) {
            across = share_from(across.first, area.i, area.columns, area.stride);
            const Rectangle part{area.i + across.first * area.stride, area.j + down.first * area.stride, across.count,
                                 down.count, area.stride};
            values.resize(static_cast<std::size_t>(part.count()));
            if (auto ok = sample_chunk<T>(layers, part, values); !ok) return ok;
            copy_part(values, part, out, area, part);
        }
    }
    return {};
}

// Reads a file band by band and lays the bands, cut at the spool's blocks, over its place in the layer.
template <class T, class Read>
Result<void> lay_file(const PlacedFile& file, const LayerMember& place, RasterSpool<T>& spool, const Read& read,
                      const ReadProgress& progress) {
    const std::int64_t width = file.info.width, height = file.info.height;
    std::vector<T> band(static_cast<std::size_t>(kBandRows * width));
    for (std::int64_t row = 0; row < height;) {
        const std::int64_t to_block_end = kBandRows - (place.row + row) % kBandRows;
        const std::int64_t rows = std::min(to_block_end, height - row);
        const std::span<T> values(band.data(), static_cast<std::size_t>(rows * width));
        if (auto ok = read(row, row + rows, values); !ok) return ok;
        if (auto ok = spool.lay(place.column, place.row + row, width, rows, values); !ok) return ok;
        row += rows;
        if (progress && !progress(rows * width)) return interrupted();
    }
    return {};
}

template <class T>
class HeightReader {
public:
    HeightReader(ImageSource& dem, const PlacedFile& file, const HeightReading& reading, bool raw,
                 const HeightShift* shift)
        : dem_(dem),
          shift_(shift),
          path_(file.path),
          voids_(dem.info(), reading),
          suspects_(dem.info(), reading),
          units_(raw ? HeightUnits{} : units_of(dem.info(), file.where, reading)) {}

    Result<void> operator()(std::int64_t begin, std::int64_t end, std::span<T> out) {
        values_.resize(out.size());
        if (auto ok = dem_.read_channel(begin, end, std::span<double>(values_)); !ok) return ok;
        suspects_.add(values_);
        voids_.apply(values_);
        if (units_ != HeightUnits{})
            for (double& v : values_) {
                const double raw = v;
                v = v * units_.scale + units_.offset_m;
                if (std::isinf(v))
                    return Error{ErrorCode::input, fmt::format("{}: value {} times its scale {} is no finite height",
                                                               path_, raw, units_.scale)};
            }
        if (shift_ != nullptr)
            if (auto ok = shift_->apply(begin, end, values_); !ok) return ok;
        for (const double v : values_)
            if (std::isfinite(v)) range_.include({v, v});
        std::transform(values_.begin(), values_.end(), out.begin(), [](double v) { return static_cast<T>(v); });
        return {};
    }

    const HeightRange& range() const { return range_; }
    const SuspectValues& suspects() const { return suspects_; }

private:
    ImageSource& dem_;
    const HeightShift* shift_;  // null: heights stay
    std::string path_;
    VoidRule voids_;
    SuspectValues suspects_;
    HeightRange range_;
    HeightUnits units_;
    std::vector<double> values_;
};

template <class T>
Result<SpooledLayer<T>> empty_layer(Layer layer, const StackOptions& options, T nothing) {
    auto spool = RasterSpool<T>::create(options.temporary + ".layer", layer.columns, layer.rows, nothing);
    if (!spool) return spool.error();
    return SpooledLayer<T>{std::move(layer), std::move(*spool)};
}

template <class T>
Result<std::vector<LayerOnGrid<T>>> place_on(const std::vector<SpooledLayer<T>>& layers, const TargetGrid& grid,
                                             const Crs& grid_crs, Kernel kernel, double reach = 1) {
    std::vector<LayerOnGrid<T>> placed;
    for (const SpooledLayer<T>& l : layers) {
        auto map = WarpMap::make(grid, grid_crs, l.layer.where, l.layer.crs);
        if (!map) return map.error();
        // Points on samples take them as they are, with any kernel; nearest says so to the last bit.
        placed.push_back({&l, std::move(*map), on_grid(l.layer, grid, grid_crs) ? Kernel::nearest : kernel, reach});
    }
    return placed;
}

template <class T>
Result<std::vector<SpooledLayer<T>>> read_heights(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                  bool raw, const StackOptions& options, const ReadProgress& progress,
                                                  HeightRange& range, std::vector<std::string>& warnings) {
    std::vector<SpooledLayer<T>> spooled;
    for (Layer& layer : layers) {
        auto fresh = empty_layer<T>(std::move(layer), options, static_cast<T>(kUncovered));
        if (!fresh) return fresh.error();
        for (const LayerMember& member : fresh->layer.members) {
            const PlacedFile& file = files[member.file];
            auto dem = open_heights(file.path, options.open, options.heights.height_encoding);
            if (!dem) return dem.error();
            if (auto same = check_unchanged(file, (*dem)->info()); !same) return same.error();
            std::optional<HeightShift> shift;
            if (file.datum_change) {
                auto made = HeightShift::make(file);
                if (!made) return made.error();
                shift.emplace(std::move(*made));
            }
            HeightReader<T> reader(**dem, file, options.heights, raw, shift ? &*shift : nullptr);
            if (auto ok = lay_file<T>(
                    file, member, *fresh->spool,
                    [&](std::int64_t begin, std::int64_t end, std::span<T> out) { return reader(begin, end, out); },
                    progress);
                !ok)
                return ok.error();
            range.include(reader.range());
            if (auto warning = reader.suspects().warning(file.path)) warnings.push_back(std::move(*warning));
        }
        spooled.push_back(std::move(*fresh));
    }
    return spooled;
}

std::int64_t samples_of(const std::vector<PlacedFile>& files) {
    std::int64_t samples = 0;
    for (const PlacedFile& f : files)
        samples += (f.info.width + 2 * kBandRows) * (f.info.height + 2 * kBandRows);  // partly filled blocks
    return samples;
}

bool wide(const std::vector<PlacedFile>& files, bool raw, const HeightReading& reading) {
    return std::any_of(files.begin(), files.end(), [&](const PlacedFile& f) {
        return !fits_float32(f.info.type) || f.datum_change ||
               (!raw && units_of(f.info, f.where, reading) != HeightUnits{});
    });
}

}  // namespace

bool on_grid(const Layer& layer, const TargetGrid& grid, const Crs& grid_crs) {
    if (!layer.crs.same_as(grid_crs) || !layer.where.axis_aligned()) return false;
    const double last_c = static_cast<double>(layer.columns - 1), last_r = static_cast<double>(layer.rows - 1);
    const auto off = [](double v) { return std::abs(v - std::nearbyint(v)); };
    const Georeference& w = layer.where;
    // Corner by corner: offset and drift of both axes.
    for (const double c : {0.0, last_c})
        for (const double r : {0.0, last_r}) {
            const double i = (w.x(c, r) - grid.x_m) / grid.step_m, j = (grid.y_m - w.y(c, r)) / grid.step_m;
            if (!(off(i) <= kOnGrid && off(j) <= kOnGrid)) return false;
        }
    const auto unit_step = [&](double step, double last) {
        return std::abs(std::abs(step) / grid.step_m - 1) * std::max(1.0, last) <= kOnGrid;
    };
    return unit_step(w.column_x, last_c) && unit_step(w.row_y, last_r);
}

std::int64_t height_stack_bytes(const std::vector<PlacedFile>& files) { return samples_of(files) * 8; }

struct HeightStack::Impl {
    Kernel kernel = Kernel::bilinear;
    std::vector<SpooledLayer<float>> narrow;  // one of the two is empty
    std::vector<SpooledLayer<double>> wide;
    HeightRange range;
    std::vector<std::string> warnings;
};

HeightStack::HeightStack(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HeightStack::~HeightStack() = default;

Result<std::unique_ptr<HeightStack>> HeightStack::read(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                       bool raw_values, const StackOptions& options,
                                                       const ReadProgress& progress) {
    auto impl = std::make_unique<Impl>();
    impl->kernel = options.kernel;
    if (wide(files, raw_values, options.heights)) {
        auto read =
            read_heights<double>(files, std::move(layers), raw_values, options, progress, impl->range, impl->warnings);
        if (!read) return read.error();
        impl->wide = std::move(*read);
    } else {
        auto read =
            read_heights<float>(files, std::move(layers), raw_values, options, progress, impl->range, impl->warnings);
        if (!read) return read.error();
        impl->narrow = std::move(*read);
    }
    return std::unique_ptr<HeightStack>(new HeightStack(std::move(impl)));
}

HeightRange HeightStack::range() const {
    HeightRange range = impl_->range;
    if (impl_->kernel == Kernel::cubic) {
        const double more = (range.high - range.low) / 2;
        range.include({range.low - more, range.high + more});
    }
    return range;
}

const std::vector<std::string>& HeightStack::warnings() const { return impl_->warnings; }
std::size_t HeightStack::layer_count() const { return impl_->narrow.size() + impl_->wide.size(); }

const Layer& HeightStack::layer(std::size_t k) const {
    return impl_->wide.empty() ? impl_->narrow[k].layer : impl_->wide[k].layer;
}

Result<void> HeightStack::samples(std::size_t k, std::int64_t column, std::int64_t row, std::int64_t columns,
                                  std::int64_t rows, std::span<double> out) const {
    if (impl_->narrow.empty()) return impl_->wide[k].spool->read(column, row, columns, rows, out);
    std::vector<float> values(out.size());
    auto ok = impl_->narrow[k].spool->read(column, row, columns, rows, values);
    std::copy(values.begin(), values.end(), out.begin());
    return ok;
}

std::vector<HeightStack::Block> HeightStack::blocks(std::size_t k) const {
    std::vector<Block> blocks;
    const auto add = [&](const auto& spool) {
        for (const auto& corner : spool.corners()) blocks.push_back({corner.column, corner.row});
    };
    if (impl_->wide.empty())
        add(*impl_->narrow[k].spool);
    else
        add(*impl_->wide[k].spool);
    return blocks;
}

struct HeightGrid::Impl {
    std::vector<LayerOnGrid<float>> narrow;
    std::vector<LayerOnGrid<double>> wide;
};

HeightGrid::HeightGrid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HeightGrid::~HeightGrid() = default;

Result<std::unique_ptr<HeightGrid>> HeightStack::on(const TargetGrid& grid, const Crs& grid_crs, double reach) const {
    auto impl = std::make_unique<HeightGrid::Impl>();
    auto narrow = place_on(impl_->narrow, grid, grid_crs, impl_->kernel, reach);
    if (!narrow) return narrow.error();
    auto wide_layers = place_on(impl_->wide, grid, grid_crs, impl_->kernel, reach);
    if (!wide_layers) return wide_layers.error();
    impl->narrow = std::move(*narrow);
    impl->wide = std::move(*wide_layers);
    return std::unique_ptr<HeightGrid>(new HeightGrid(std::move(impl)));
}

Result<void> HeightGrid::sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                std::int64_t stride, std::span<double> out) const {
    const Rectangle area{i, j, columns, rows, stride};
    return impl_->wide.empty() ? sample_layers<float>(impl_->narrow, area, out)
                               : sample_layers<double>(impl_->wide, area, out);
}

}  // namespace scree
