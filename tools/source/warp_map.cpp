#include "tools/source/warp_map.h"

#include <emmintrin.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace scree {
namespace {

constexpr int kSide = static_cast<int>(WarpMap::kChunk);
constexpr int kNodes = kSide + 1;

struct Place {
    double column, row;
};

bool is_somewhere(const Place& place) { return place.column == place.column; }

/// From CRS coordinates to fractional samples.
struct SourceAffine {
    double first_x = 0, first_y = 0;
    double column_by_x = 1, column_by_y = 0, row_by_x = 0, row_by_y = -1;  ///< samples a unit
    bool axis_aligned = true;
    double column_x = 1, row_y = -1;
    double turn = 0, middle_x = 0;  ///< of a geographic source

    Place linear(double dx, double dy) const {
        // Quotients, not products with a reciprocal: whole multiples of the step are whole samples.
        if (axis_aligned) return {dx / column_x, dy / row_y};
        return {dx * column_by_x + dy * column_by_y, dx * row_by_x + dy * row_by_y};
    }
    Place operator()(double x, double y) const {
        if (turn > 0 && std::abs(x - middle_x) > turn / 2) x = middle_x + std::remainder(x - middle_x, turn);
        return linear(x - first_x, y - first_y);
    }
};

Result<SourceAffine> invert(const Georeference& source, double turn, const WarpOptions& options) {
    const double determinant = source.column_x * source.row_y - source.row_x * source.column_y;
    SourceAffine out;
    out.first_x = source.first_x;
    out.first_y = source.first_y;
    out.column_by_x = source.row_y / determinant;
    out.column_by_y = -source.row_x / determinant;
    out.row_by_x = -source.column_y / determinant;
    out.row_by_y = source.column_x / determinant;
    out.axis_aligned = source.axis_aligned();
    out.column_x = source.column_x;
    out.row_y = source.row_y;
    const double sum =
        out.column_by_x + out.column_by_y + out.row_by_x + out.row_by_y + source.first_x + source.first_y;
    if (determinant == 0 || !std::isfinite(determinant) || !std::isfinite(sum)) {
        return Error{
            ErrorCode::input,
            fmt::format("a raster with steps ({}, {}) and ({}, {}) from ({}, {}) covers no area", source.column_x,
                        source.column_y, source.row_x, source.row_y, source.first_x, source.first_y)};
    }
    out.turn = turn;
    if (options.source_columns > 0 && options.source_rows > 0) {
        out.middle_x = source.x(static_cast<double>(options.source_columns - 1) / 2,
                                static_cast<double>(options.source_rows - 1) / 2);
    } else {
        out.middle_x = source.first_x - source.column_x / 2 + std::copysign(turn / 2, source.column_x);
    }
    return out;
}

/// Column and row of grid point (i, j) without a CRS between: origin + i * by_i + j * by_j.
struct GridAffine {
    Place origin{}, by_i{}, by_j{};
};

GridAffine compose(const TargetGrid& grid, const SourceAffine& affine) {
    // The origins' difference comes first: coordinates of 1e7 m have no digits left for samples of 1 mm.
    return {affine.linear(grid.x_m - affine.first_x, grid.y_m - affine.first_y), affine.linear(grid.step_m, 0),
            affine.linear(0, -grid.step_m)};
}

std::int64_t floor_to_chunk(std::int64_t i) {
    const std::int64_t rest = i % WarpMap::kChunk;
    return i - (rest < 0 ? rest + WarpMap::kChunk : rest);
}

/// out[i] = start + slope * ((first + i) * step), two at a time.
void fill_line(double start, double slope, double first, double step, std::int64_t count, double* out) {
    const __m128d starts = _mm_set1_pd(start), slopes = _mm_set1_pd(slope), steps = _mm_set1_pd(step);
    __m128d at = _mm_set_pd(first + 1, first);
    std::int64_t i = 0;
    for (; i + 2 <= count; i += 2) {
        _mm_storeu_pd(out + i, _mm_add_pd(starts, _mm_mul_pd(slopes, _mm_mul_pd(at, steps))));
        at = _mm_add_pd(at, _mm_set1_pd(2));
    }
    if (i < count) out[i] = start + slope * ((first + static_cast<double>(i)) * step);
}

/// A square of a chunk; it stands for the points [i, i + size) x [j, j + size) and has corners on all four sides.
struct Cell {
    int i, j, size;
};

/// Points of a chunk that are asked for, and where they go.
struct Request {
    int left, top, right, bottom;  ///< in the chunk; right and bottom excluded
    std::ptrdiff_t first, pitch;   ///< the chunk's point (0, 0) in `out`, asked for or not, and from row to row
    SourcePoints out;

    WarpMap::Bounds* bounds = nullptr;  ///< where only these are wanted; then there is no `out`

    bool meets(const Cell& cell) const {
        return cell.i < right && cell.i + cell.size > left && cell.j < bottom && cell.j + cell.size > top;
    }
    std::size_t index(int i, int j) const { return static_cast<std::size_t>(first + j * pitch + i); }
};

/// Places within a cell that are compared: middles of the edges and the centre, where the error of bilinear
/// interpolation of a quadratic is greatest, and four at quarters, because that of a cubic is nought at the middles.
constexpr std::array<std::array<int, 2>, 9> kCheckedQuarters = {
    {{2, 0}, {0, 2}, {2, 2}, {4, 2}, {2, 4}, {1, 1}, {3, 1}, {1, 3}, {3, 3}}};

/// Half of the bound is used up where it is checked; the other half is for what lies between.
constexpr double kCheckedBound = kWarpBoundSamples / 2;

/// One thread's transform and the chunk that it is at.
class Worker {
public:
    explicit Worker(CrsTransform transform) : transform_(std::move(transform)) {
        places_.resize(std::size_t{kNodes} * kNodes);
        known_.resize(places_.size());
    }

    /// Coordinates in the source's CRS.
    void coordinates(std::span<double> x, std::span<double> y) const { transform_.apply(x, y); }

    void map_chunk(const TargetGrid& grid, const SourceAffine& affine, std::int64_t i0, std::int64_t j0,
                   const Request& request);

private:
    static std::size_t index(int i, int j) {
        return static_cast<std::size_t>(j) * kNodes + static_cast<std::size_t>(i);
    }
    const Place& at(int i, int j) const { return places_[index(i, j)]; }
    void want(int i, int j);
    void want_nodes(const Cell& cell);
    void evaluate(const TargetGrid& grid, const SourceAffine& affine, std::int64_t i0, std::int64_t j0);
    enum class Fit { interpolate, divide, every_point };
    Fit judge(const Cell& cell) const;
    void fill(const Cell& cell, const Request& request) const;
    void bound(const Cell& cell, const Request& request) const;
    void bound_every_point(const Cell& cell, const Request& request) const;
    void want_every_point(const Cell& cell, const Request& request);
    void copy_every_point(const Cell& cell, const Request& request) const;

    CrsTransform transform_;
    std::vector<Place> places_;
    std::vector<std::uint8_t> known_;
    std::vector<Cell> cells_, next_cells_, single_;
    std::vector<std::array<int, 2>> wanted_;
    std::vector<double> x_, y_;
};

void Worker::want(int i, int j) {
    std::uint8_t& known = known_[index(i, j)];
    if (known == 0) wanted_.push_back({i, j});
    known = 1;
}

void Worker::want_nodes(const Cell& cell) {
    for (int corner = 0; corner < 4; ++corner) {
        want(cell.i + (corner & 1) * cell.size, cell.j + (corner >> 1) * cell.size);
    }
    for (const auto& [u, v] : kCheckedQuarters) want(cell.i + cell.size * u / 4, cell.j + cell.size * v / 4);
}

void Worker::evaluate(const TargetGrid& grid, const SourceAffine& affine, std::int64_t i0, std::int64_t j0) {
    x_.resize(wanted_.size());
    y_.resize(wanted_.size());
    for (std::size_t k = 0; k < wanted_.size(); ++k) {
        x_[k] = grid.x_m + static_cast<double>(i0 + wanted_[k][0]) * grid.step_m;
        y_[k] = grid.y_m - static_cast<double>(j0 + wanted_[k][1]) * grid.step_m;
    }
    transform_.apply(x_, y_);
    for (std::size_t k = 0; k < wanted_.size(); ++k)
        places_[index(wanted_[k][0], wanted_[k][1])] = affine(x_[k], y_[k]);
    wanted_.clear();
}

/// Bilinear between a cell's corners. Steps are powers of two, so s and t are exact.
struct Patch {
    Place a, b, c, d;  ///< north-west, north-east, south-west, south-east

    Place left(double t) const { return {a.column + (c.column - a.column) * t, a.row + (c.row - a.row) * t}; }
    Place right(double t) const { return {b.column + (d.column - b.column) * t, b.row + (d.row - b.row) * t}; }
};

/// A cell that is partly nowhere is taken point by point: an edge of the domain may run anywhere through it.
Worker::Fit Worker::judge(const Cell& cell) const {
    const int far_i = cell.i + cell.size, far_j = cell.j + cell.size;
    const Patch patch{at(cell.i, cell.j), at(far_i, cell.j), at(cell.i, far_j), at(far_i, far_j)};
    if (!is_somewhere(patch.a) || !is_somewhere(patch.b) || !is_somewhere(patch.c) || !is_somewhere(patch.d)) {
        return Fit::every_point;
    }
    bool fits = true;
    for (const auto& [u, v] : kCheckedQuarters) {
        const int di = cell.size * u / 4, dj = cell.size * v / 4;
        const Place& place = at(cell.i + di, cell.j + dj);
        if (!is_somewhere(place)) return Fit::every_point;
        const double s = static_cast<double>(di) / cell.size, t = static_cast<double>(dj) / cell.size;
        const Place left = patch.left(t), right = patch.right(t);
        const double column = left.column + (right.column - left.column) * s - place.column;
        const double row = left.row + (right.row - left.row) * s - place.row;
        fits = fits && column * column + row * row <= kCheckedBound * kCheckedBound;
    }
    if (fits) return Fit::interpolate;
    // Below four points a side nearly all are known.
    return cell.size <= 4 ? Fit::every_point : Fit::divide;
}

void Worker::fill(const Cell& cell, const Request& request) const {
    const int far_i = cell.i + cell.size, far_j = cell.j + cell.size;
    const Patch patch{at(cell.i, cell.j), at(far_i, cell.j), at(cell.i, far_j), at(far_i, far_j)};
    const int first = std::max(cell.i, request.left), last = std::min(far_i, request.right);
    const double step = 1.0 / cell.size;
    for (int j = std::max(cell.j, request.top); j < std::min(far_j, request.bottom); ++j) {
        const Place left = patch.left((j - cell.j) * step), right = patch.right((j - cell.j) * step);
        const double columns = right.column - left.column, rows = right.row - left.row;
        double* const column = &request.out.column[request.index(first, j)];
        double* const row = &request.out.row[request.index(first, j)];
        fill_line(left.column, columns, first - cell.i, step, last - first, column);
        fill_line(left.row, rows, first - cell.i, step, last - first, row);
    }
}

void include(WarpMap::Bounds& bounds, const Place& place) {
    if (!is_somewhere(place)) return;
    bounds.west = std::min(bounds.west, place.column);
    bounds.east = std::max(bounds.east, place.column);
    bounds.north = std::min(bounds.north, place.row);
    bounds.south = std::max(bounds.south, place.row);
}

// What is bilinear is greatest and least at corners.
void Worker::bound(const Cell& cell, const Request& request) const {
    for (int corner = 0; corner < 4; ++corner)
        include(*request.bounds, at(cell.i + (corner & 1) * cell.size, cell.j + (corner >> 1) * cell.size));
}

void Worker::bound_every_point(const Cell& cell, const Request& request) const {
    for (int j = std::max(cell.j, request.top); j < std::min(cell.j + cell.size, request.bottom); ++j)
        for (int i = std::max(cell.i, request.left); i < std::min(cell.i + cell.size, request.right); ++i)
            include(*request.bounds, at(i, j));
}

void Worker::want_every_point(const Cell& cell, const Request& request) {
    for (int j = std::max(cell.j, request.top); j < std::min(cell.j + cell.size, request.bottom); ++j) {
        for (int i = std::max(cell.i, request.left); i < std::min(cell.i + cell.size, request.right); ++i) want(i, j);
    }
}

void Worker::copy_every_point(const Cell& cell, const Request& request) const {
    for (int j = std::max(cell.j, request.top); j < std::min(cell.j + cell.size, request.bottom); ++j) {
        for (int i = std::max(cell.i, request.left); i < std::min(cell.i + cell.size, request.right); ++i) {
            request.out.column[request.index(i, j)] = at(i, j).column;
            request.out.row[request.index(i, j)] = at(i, j).row;
        }
    }
}

// Cells are divided until they fit, level by level, so that transforms come in batches. Whether a cell fits depends on
// its own nodes alone: leaving out cells that nobody asks for changes no other.
void Worker::map_chunk(const TargetGrid& grid, const SourceAffine& affine, std::int64_t i0, std::int64_t j0,
                       const Request& request) {
    std::fill(known_.begin(), known_.end(), std::uint8_t{0});
    cells_.assign(1, {0, 0, kSide});
    single_.clear();
    while (!cells_.empty()) {
        for (const Cell& cell : cells_) want_nodes(cell);
        evaluate(grid, affine, i0, j0);
        next_cells_.clear();
        for (const Cell& cell : cells_) {
            const Fit fit = judge(cell);
            if (fit == Fit::interpolate) request.bounds != nullptr ? bound(cell, request) : fill(cell, request);
            if (fit == Fit::every_point) single_.push_back(cell);
            if (fit != Fit::divide) continue;
            for (int part = 0; part < 4; ++part) {
                const int half = cell.size / 2;
                const Cell child{cell.i + (part & 1) * half, cell.j + (part >> 1) * half, half};
                if (request.meets(child)) next_cells_.push_back(child);
            }
        }
        cells_.swap(next_cells_);
    }
    for (const Cell& cell : single_) want_every_point(cell, request);
    evaluate(grid, affine, i0, j0);
    for (const Cell& cell : single_)
        request.bounds != nullptr ? bound_every_point(cell, request) : copy_every_point(cell, request);
}

/// Workers that nobody is using.
class WorkerPool {
public:
    WorkerPool(Crs from, Crs to, const LonLatBox* area)
        : from_(std::move(from)), to_(std::move(to)), area_(area != nullptr ? std::optional(*area) : std::nullopt) {}

    Result<void> start() {
        Result<CrsTransform> transform = make();
        if (!transform) return transform.error();
        identity_ = transform->identity();
        free_.push_back(std::make_unique<Worker>(std::move(*transform)));
        return {};
    }
    bool identity() const { return identity_; }

    std::unique_ptr<Worker> take() {
        {
            const std::lock_guard lock(mutex_);
            if (!free_.empty()) return take_free();
        }
        // Outside the lock: it takes milliseconds.
        if (Result<CrsTransform> transform = make()) return std::make_unique<Worker>(std::move(*transform));
        // It could be made once; what is short now (files, memory) need not fail the build: wait for a free one.
        std::unique_lock lock(mutex_);
        returned_.wait(lock, [&] { return !free_.empty(); });
        return take_free();
    }

    void give_back(std::unique_ptr<Worker> worker) {
        {
            const std::lock_guard lock(mutex_);
            free_.push_back(std::move(worker));
        }
        returned_.notify_one();
    }

private:
    Result<CrsTransform> make() const { return CrsTransform::make(from_, to_, area_ ? &*area_ : nullptr); }
    std::unique_ptr<Worker> take_free() {
        std::unique_ptr<Worker> worker = std::move(free_.back());
        free_.pop_back();
        return worker;
    }

    Crs from_, to_;
    std::optional<LonLatBox> area_;
    bool identity_ = false;
    std::mutex mutex_;
    std::condition_variable returned_;
    std::vector<std::unique_ptr<Worker>> free_;
};

/// A worker until the end of the scope.
class Borrowed {
public:
    explicit Borrowed(WorkerPool& pool) : pool_(pool), worker_(pool.take()) {}
    ~Borrowed() { pool_.give_back(std::move(worker_)); }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    Worker* operator->() const { return worker_.get(); }

private:
    WorkerPool& pool_;
    std::unique_ptr<Worker> worker_;
};

}  // namespace

struct WarpMap::Impl {
    Impl(const TargetGrid& target, const SourceAffine& source, Crs from, Crs to, const LonLatBox* area)
        : grid(target), affine(source), direct(compose(target, source)), pool(std::move(from), std::move(to), area) {}

    void for_each_chunk(std::int64_t i0, std::int64_t j0, std::int64_t columns, std::int64_t rows, SourcePoints out,
                        Bounds* bounds) {
        const Borrowed worker(pool);
        for (std::int64_t chunk_j = floor_to_chunk(j0); chunk_j < j0 + rows; chunk_j += kChunk) {
            for (std::int64_t chunk_i = floor_to_chunk(i0); chunk_i < i0 + columns; chunk_i += kChunk) {
                const Request request{static_cast<int>(std::max<std::int64_t>(i0 - chunk_i, 0)),
                                      static_cast<int>(std::max<std::int64_t>(j0 - chunk_j, 0)),
                                      static_cast<int>(std::min(i0 + columns - chunk_i, kChunk)),
                                      static_cast<int>(std::min(j0 + rows - chunk_j, kChunk)),
                                      (chunk_j - j0) * columns + (chunk_i - i0),
                                      columns,
                                      out,
                                      bounds};
                worker->map_chunk(grid, affine, chunk_i, chunk_j, request);
            }
        }
    }

    TargetGrid grid;
    SourceAffine affine;
    GridAffine direct;
    WorkerPool pool;
};

Result<WarpMap> WarpMap::make(const TargetGrid& grid, const Crs& grid_crs, const Georeference& source,
                              const Crs& source_crs, const WarpOptions& options) {
    if (!(grid.step_m > 0) || !std::isfinite(grid.step_m) || !std::isfinite(grid.x_m) || !std::isfinite(grid.y_m)) {
        return Error{ErrorCode::input,
                     fmt::format("no grid has steps of {} m from ({}, {})", grid.step_m, grid.x_m, grid.y_m)};
    }
    const Result<SourceAffine> affine = invert(source, source_crs.turn(), options);
    if (!affine) return affine.error();
    auto impl = std::make_unique<Impl>(grid, *affine, grid_crs, source_crs, options.area);
    if (const Result<void> started = impl->pool.start(); !started) return started.error();
    return WarpMap(std::move(impl));
}

namespace {

void map_affine(const GridAffine& affine, std::int64_t i0, std::int64_t j0, std::int64_t columns, std::int64_t rows,
                SourcePoints out) {
    double* column = out.column.data();
    double* row = out.row.data();
    for (std::int64_t j = j0; j < j0 + rows; ++j) {
        const double down = static_cast<double>(j);
        const double left_column = affine.origin.column + down * affine.by_j.column;
        const double left_row = affine.origin.row + down * affine.by_j.row;
        fill_line(left_column, affine.by_i.column, static_cast<double>(i0), 1, columns, column);
        fill_line(left_row, affine.by_i.row, static_cast<double>(i0), 1, columns, row);
        column += columns;
        row += columns;
    }
}

}  // namespace

void WarpMap::map(std::int64_t i0, std::int64_t j0, std::int64_t columns, std::int64_t rows, SourcePoints out) const {
    assert(columns >= 0 && rows >= 0);
    assert(out.column.size() == static_cast<std::size_t>(columns * rows) && out.row.size() == out.column.size());
    if (exact()) return map_affine(impl_->direct, i0, j0, columns, rows, out);
    if (columns <= 0 || rows <= 0) return;
    impl_->for_each_chunk(i0, j0, columns, rows, out, nullptr);
}

std::optional<WarpMap::Bounds> WarpMap::bounds(std::int64_t i0, std::int64_t j0, std::int64_t columns,
                                               std::int64_t rows) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Bounds bounds{kInfinity, -kInfinity, kInfinity, -kInfinity};
    if (columns <= 0 || rows <= 0) return std::nullopt;
    if (exact()) {
        for (const std::int64_t i : {i0, i0 + columns - 1})
            for (const std::int64_t j : {j0, j0 + rows - 1}) {
                double column = 0, row = 0;
                map_affine(impl_->direct, i, j, 1, 1, {{&column, 1}, {&row, 1}});
                include(bounds, {column, row});
            }
    } else {
        impl_->for_each_chunk(i0, j0, columns, rows, {}, &bounds);
    }
    if (!(bounds.west <= bounds.east)) return std::nullopt;
    return bounds;
}

WarpMap::Shrink WarpMap::shrink_at(std::int64_t i, std::int64_t j) const {
    if (exact()) {
        const GridAffine& by = impl_->direct;
        return {std::hypot(by.by_i.column, by.by_j.column), std::hypot(by.by_i.row, by.by_j.row)};
    }
    // West, east, north, south.
    const double step = impl_->grid.step_m;
    std::array<double, 4> x{}, y{};
    x.fill(impl_->grid.x_m + static_cast<double>(i) * step);
    y.fill(impl_->grid.y_m - static_cast<double>(j) * step);
    x[0] -= step / 2;
    x[1] += step / 2;
    y[2] += step / 2;
    y[3] -= step / 2;
    Borrowed(impl_->pool)->coordinates(x, y);
    const auto between = [&](std::size_t a, std::size_t b) {
        const double dx = x[b] - x[a];
        const double turn = impl_->affine.turn;
        return impl_->affine.linear(turn > 0 ? std::remainder(dx, turn) : dx, y[b] - y[a]);
    };
    const Place by_i = between(0, 1), by_j = between(2, 3);
    const Shrink shrink{std::hypot(by_i.column, by_j.column), std::hypot(by_i.row, by_j.row)};
    return std::isfinite(shrink.columns) && std::isfinite(shrink.rows) ? shrink : Shrink{};
}

bool WarpMap::exact() const { return impl_->pool.identity(); }

WarpMap::WarpMap(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WarpMap::WarpMap(WarpMap&&) noexcept = default;
WarpMap& WarpMap::operator=(WarpMap&&) noexcept = default;
WarpMap::~WarpMap() = default;

}  // namespace scree
