#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "common/mesh/drawn_surface.h"
#include "common/query/ground.h"
#include "tools/cli/dataset_label.h"
#include "tools/cli/export_raster.h"

namespace scree {
namespace {

constexpr std::int64_t kBlock = GeotiffWriter::kBlock;

// Evenly spaced positions along one axis, in finest cells: x_m, or y_m counted south, from `start_m` in steps of
// step_m.
struct Axis {
    double start_m = 0, step_m = 1;
    double origin_m = 0, spacing_m = 1;
    bool south = false;
    std::int64_t count = 0;

    double at(std::int64_t k) const {
        const double along_m = static_cast<double>(k) * step_m, metres = south ? start_m - along_m : start_m + along_m;
        return on_lattice((south ? origin_m - metres : metres - origin_m) / spacing_m, metres, origin_m, spacing_m);
    }
    bool on_samples() const {
        for (std::int64_t k = 0; k < count; ++k)
            if (at(k) != std::floor(at(k))) return false;
        return true;
    }
};

struct HeightGrid {
    Axis columns, rows;
    int level = 0;           ///< nothing finer is asked for
    bool on_samples = true;  ///< every position is a sample of that level
};

// Multiples of `step` cells within from_m..to_m, which are counted from the origin.
Axis axis_of_samples(const Lattice& l, std::int64_t cells, std::int64_t step, double from, double to, bool south) {
    const auto last = static_cast<double>(cells / step);
    const double low = std::clamp(std::ceil(from / static_cast<double>(step)), 0.0, last + 1),
                 high = std::clamp(std::floor(to / static_cast<double>(step)), -1.0, last);
    Axis axis;
    axis.origin_m = south ? l.origin_y_m : l.origin_x_m;
    axis.spacing_m = l.spacing_m;
    axis.south = south;
    axis.step_m = static_cast<double>(step) * l.spacing_m;
    axis.start_m = south ? l.y_m(low * static_cast<double>(step)) : l.x_m(low * static_cast<double>(step));
    axis.count = static_cast<std::int64_t>(high - low) + 1;
    return axis;
}

Result<HeightGrid> grid_of_level(const Lattice& l, const ExportBox& box, int level) {
    const auto i = [&](double x) { return on_lattice(l.i_of(x), x, l.origin_x_m, l.spacing_m); };
    const auto j = [&](double y) { return on_lattice(l.j_of(y), y, l.origin_y_m, l.spacing_m); };
    const std::int64_t step = l.step(level);
    HeightGrid grid{axis_of_samples(l, l.cells_x, step, i(box.x_min), i(box.x_max), false),
                    axis_of_samples(l, l.cells_y, step, j(box.y_max), j(box.y_min), true), level, true};
    if (grid.columns.count < 1 || grid.rows.count < 1)
        return Error{ErrorCode::usage,
                     fmt::format("--box {},{},{},{} holds no sample of level {}, which are {} m apart", box.x_min,
                                 box.y_min, box.x_max, box.y_max, level, static_cast<double>(step) * l.spacing_m)};
    return grid;
}

Result<HeightGrid> grid_of_size(const Lattice& l, const ExportBox& box, std::pair<int, int> size) {
    const ExportBox whole = whole_extent(l);
    if (size.first < 2 || size.second < 2 || !(box.x_max > box.x_min) || !(box.y_max > box.y_min))
        return Error{ErrorCode::usage,
                     fmt::format("--size {}x{} over a box of {} x {} m: two samples and a length are "
                                 "needed either way",
                                 size.first, size.second, box.x_max - box.x_min, box.y_max - box.y_min)};
    if (box.x_min > whole.x_max || box.x_max < whole.x_min || box.y_min > whole.y_max || box.y_max < whole.y_min)
        return Error{ErrorCode::usage, fmt::format("--box {},{},{},{} lies beside the store's extent", box.x_min,
                                                   box.y_min, box.x_max, box.y_max)};
    HeightGrid grid;
    grid.columns = {box.x_min, (box.x_max - box.x_min) / (size.first - 1), l.origin_x_m, l.spacing_m, false,
                    size.first};
    grid.rows = {box.y_max, (box.y_max - box.y_min) / (size.second - 1), l.origin_y_m, l.spacing_m, true, size.second};
    grid.level = l.deepest_level;
    grid.on_samples = grid.columns.on_samples() && grid.rows.on_samples();
    return grid;
}

// Metres that stored samples may be: the ranges of the roots.
Result<std::pair<double, double>> height_range(const Dataset& d, Ground& ground) {
    double low = d.min_height_m, high = d.max_height_m;
    for (std::int64_t y = 0; y < d.lattice.root_rows; ++y)
        for (std::int64_t x = 0; x < d.lattice.root_columns; ++x) {
            auto root = ground.view({0, x, y});
            if (!root) return root.error();
            if (!*root) continue;
            low = std::min(low, d.height_m((*root)->header->own.min_n));
            high = std::max(high, d.height_m((*root)->header->own.max_n));
        }
    return std::pair(low, high);
}

struct SampleFormat {
    SampleType type;
    double nodata;
};

// Integers where all heights are; else the smaller float that keeps a height's quantum apart from the next.
SampleFormat format_of(const Dataset& d, bool whole_metres, std::pair<double, double> range) {
    constexpr double kUsualNodata = -32768;  // exact in all four types, and below any height on earth
    const bool usual = range.first > kUsualNodata || range.second < kUsualNodata;
    if (whole_metres && range.first > kUsualNodata && range.second <= 32767) return {SampleType::i16, kUsualNodata};
    constexpr double kLeastInt = std::numeric_limits<std::int32_t>::min(),
                     kGreatestInt = std::numeric_limits<std::int32_t>::max();
    if (whole_metres && range.first > kLeastInt && range.second <= kGreatestInt) return {SampleType::i32, kLeastInt};
    const double largest = std::max(std::abs(range.first), std::abs(range.second));
    const bool single = largest * std::numeric_limits<float>::epsilon() <= d.height_quantum_m / 2;
    const double lowest = static_cast<double>(std::numeric_limits<float>::lowest());
    return {single ? SampleType::f32 : SampleType::f64, usual ? kUsualNodata : lowest};
}

template <class T>
void put(std::span<std::uint8_t> bytes, std::size_t index, T value) {
    std::memcpy(bytes.data() + index * sizeof(T), &value, sizeof(T));
}

void put_height(std::span<std::uint8_t> bytes, SampleType type, std::size_t index, double height_m) {
    switch (type) {
        case SampleType::i16:
            return put(bytes, index, static_cast<std::int16_t>(height_m));
        case SampleType::i32:
            return put(bytes, index, static_cast<std::int32_t>(height_m));
        case SampleType::f32:
            return put(bytes, index, static_cast<float>(height_m));
        default:
            return put(bytes, index, height_m);
    }
}

// One block at a time, by a walk down to the leaves that it touches.
class HeightBlocks {
public:
    HeightBlocks(const Dataset& d, Ground& ground, const HeightGrid& grid, SampleFormat format)
        : dataset_(d), ground_(ground), grid_(grid), format_(format) {
        const Lattice& l = d.lattice;
        // Without a void anywhere nobody needs to look at the leaves.
        const bool no_voids = !d.coarsest_leaf_level && d.present_cells == l.cells_x * l.cells_y;
        last_level_ = no_voids && grid.on_samples ? grid.level : l.deepest_level;
    }

    Result<std::int64_t> fill(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                              std::span<std::uint8_t> samples) {
        i_.clear();
        j_.clear();
        for (std::int64_t k = 0; k < columns; ++k) i_.push_back(grid_.columns.at(column + k));
        for (std::int64_t k = 0; k < rows; ++k) j_.push_back(grid_.rows.at(row + k));
        height_m_.assign(static_cast<std::size_t>(columns * rows), format_.nodata);
        answered_.assign(height_m_.size(), 0);
        const Lattice& l = dataset_.lattice;
        for (std::int64_t y = 0; y < l.root_rows; ++y)
            for (std::int64_t x = 0; x < l.root_columns; ++x)
                if (auto ok = visit({0, x, y}); !ok) return ok.error();
        for (std::size_t r = 0; r < j_.size(); ++r)
            for (std::size_t c = 0; c < kBlock; ++c)
                put_height(samples, format_.type, r * kBlock + c,
                           c < i_.size() ? height_m_[r * i_.size() + c] : format_.nodata);
        return std::count(answered_.begin(), answered_.end(), 0);
    }

private:
    struct Part {
        std::size_t first, end;
    };
    static Part part_of(const std::vector<double>& positions, std::int64_t from, std::int64_t to) {
        const auto first = std::lower_bound(positions.begin(), positions.end(), static_cast<double>(from));
        const auto end = std::upper_bound(first, positions.end(), static_cast<double>(to));
        return {static_cast<std::size_t>(first - positions.begin()), static_cast<std::size_t>(end - positions.begin())};
    }

    Result<void> visit(TileId id) {
        const Lattice& l = dataset_.lattice;
        const LatticePoint corner = l.corner(id);
        const Part columns = part_of(i_, corner.i, corner.i + l.tile_extent(id.level)),
                   rows = part_of(j_, corner.j, corner.j + l.tile_extent(id.level));
        if (columns.first == columns.end || rows.first == rows.end) return {};
        auto tile = ground_.view(id);
        if (!tile) return tile.error();
        if (!*tile) return {};
        const HeightTileHeader& header = *(*tile)->header;
        if (header.is_leaf() || id.level >= last_level_) {
            sample(id, **tile, columns, rows);
            return {};
        }
        const unsigned children = header.child_mask;  // the view ends with the next one
        for (int q = 0; q < 4; ++q)
            if ((children >> q & 1) != 0)
                if (auto ok = visit(child_of(id, q)); !ok) return ok;
        return {};
    }

    // On lines between leaves of two depths the deeper one answers, as in height_at.
    void sample(TileId id, const HeightTileView& tile, Part columns, Part rows) {
        const Lattice& l = dataset_.lattice;
        const LatticePoint corner = l.corner(id);
        const auto step = static_cast<double>(l.step(id.level));
        const auto depth = static_cast<std::int8_t>(id.level + 1);
        for (std::size_t r = rows.first; r < rows.end; ++r) {
            const double t = (j_[r] - static_cast<double>(corner.j)) / step;
            for (std::size_t c = columns.first; c < columns.end; ++c) {
                const double s = (i_[c] - static_cast<double>(corner.i)) / step;
                const std::size_t at = r * i_.size() + c;
                if (depth <= answered_[at] || !touches_present(tile, s, t)) continue;
                answered_[at] = depth;
                height_m_[at] = dataset_.height_m(quanta(tile, s, t));
            }
        }
    }

    double quanta(const HeightTileView& tile, double s, double t) const {
        const auto i = static_cast<std::size_t>(s), j = static_cast<std::size_t>(t);
        if (static_cast<double>(i) == s && static_cast<double>(j) == t)
            return tile.samples[j * static_cast<std::size_t>(dataset_.lattice.tile_samples()) + i];
        return drawn_height_at(tile.samples, dataset_.lattice.tile_cells_log2, {0, 0}, s, t);
    }

    // Cells include their edges.
    bool touches_present(const HeightTileView& tile, double s, double t) const {
        if (tile.presence.empty()) return true;
        const int m = dataset_.lattice.tile_cells();
        const auto cells = [m](double at) {
            const int whole = static_cast<int>(at);
            return std::pair(static_cast<double>(whole) == at ? std::max(whole - 1, 0) : whole, std::min(whole, m - 1));
        };
        const auto [west, east] = cells(s);
        const auto [north, south] = cells(t);
        for (int j = north; j <= south; ++j)
            for (int i = west; i <= east; ++i)
                if (tile.presence[static_cast<std::size_t>(j * m + i)] != 0) return true;
        return false;
    }

    const Dataset& dataset_;
    Ground& ground_;
    const HeightGrid& grid_;
    SampleFormat format_;
    int last_level_ = 0;
    std::vector<double> i_, j_;          // of the block's columns and rows
    std::vector<double> height_m_;       // of its samples
    std::vector<std::int8_t> answered_;  // level + 1 of the leaf that did; 0: absent
};

bool whole_metres(const Dataset& d, const HeightGrid& grid) {
    // Between the samples of a leaf that is coarser than asked for, heights are interpolated.
    if (!grid.on_samples || d.least_leaf_level() < grid.level) return false;
    return d.height_quantum_m == std::floor(d.height_quantum_m) && d.height_offset_m == std::floor(d.height_offset_m);
}

}  // namespace

Result<RasterReport> export_heights(const SqliteStore& store, const RasterExport& options) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const int level = options.level.value_or(l.deepest_level);
    if (level < 0 || level > l.deepest_level)
        return Error{ErrorCode::usage,
                     fmt::format("--level {}: the heights' levels are 0..{}", level, l.deepest_level)};
    const ExportBox box = options.box.value_or(whole_extent(l));
    const auto grid = options.size ? grid_of_size(l, box, *options.size) : grid_of_level(l, box, level);
    if (!grid) return grid.error();
    auto ground = Ground::open(store);
    if (!ground) return ground.error();
    const auto range = height_range(d, **ground);
    if (!range) return range.error();
    const SampleFormat format = format_of(d, whole_metres(d, *grid), *range);
    GeotiffLayout layout;
    layout.width = grid->columns.count;
    layout.height = grid->rows.count;
    layout.type = format.type;
    layout.x = grid->columns.start_m;
    layout.y = grid->rows.start_m;
    layout.step_x = grid->columns.step_m;
    layout.step_y = grid->rows.step_m;
    layout.crs = crs_of(d);
    layout.vertical = d.vertical_datum;
    layout.nodata = format.nodata;
    HeightBlocks blocks(d, **ground, *grid, format);
    auto report =
        write_raster(options, layout,
                     [&](std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                         std::span<std::uint8_t> samples) { return blocks.fill(column, row, columns, rows, samples); });
    if (report) report->level = grid->level;
    return report;
}

}  // namespace scree
