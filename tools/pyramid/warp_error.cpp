#include "tools/pyramid/warp_error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "tools/mosaic/sample_positions.h"
#include "tools/mosaic/sample_rectangle.h"
#include "tools/mosaic/visible_samples.h"

namespace scree {
namespace {

constexpr std::int64_t kBlock = RasterSpool<float>::kBlock;
constexpr std::int64_t kMaxWindow = std::int64_t{1} << 18;  // lattice points held at a time by a thread
constexpr std::size_t kBlocksAtOnce = 4096;                 // whose sums wait to be added in order
constexpr double kOnLine = 1e-6;                            // cells: so near a line a place belongs to both sides

struct Sum {
    double greatest_m = 0, squares = 0;
    std::int64_t samples = 0;

    void add(double error_m) {
        greatest_m = std::max(greatest_m, error_m);
        squares += error_m * error_m;
        ++samples;
    }
    void add(const Sum& other) {
        greatest_m = std::max(greatest_m, other.greatest_m);
        squares += other.squares;
        samples += other.samples;
    }
};

// A place on the finest stored surface: the cell of the leaf over it, in steps of that leaf's level.
struct SurfacePlace {
    int level = 0;
    std::int64_t ci = 0, cj = 0;
    double u = 0, v = 0;
};

// At most four, where lines cross.
struct SurfacePlaces {
    std::array<SurfacePlace, 4> all;
    std::size_t count = 0;
    const SurfacePlace* begin() const { return all.data(); }
    const SurfacePlace* end() const { return all.data() + count; }
};

struct PointBox {
    std::int64_t i0 = std::numeric_limits<std::int64_t>::max(), j0 = i0, i1 = -1, j1 = -1;  // points, ends included

    bool empty() const { return i1 < i0; }
    std::int64_t columns() const { return i1 - i0 + 1; }
    std::int64_t count() const { return empty() ? 0 : columns() * (j1 - j0 + 1); }
    void add_cell(std::int64_t ci, std::int64_t cj) {
        i0 = std::min(i0, ci);
        j0 = std::min(j0, cj);
        i1 = std::max(i1, ci + 1);
        j1 = std::max(j1, cj + 1);
    }
};

// The finest stored surface: the base's where no finer layer goes on, else that of the leaf there. Any thread.
class FinestSurface {
public:
    explicit FinestSurface(const WarpErrorJob& job)
        : job_(job), base_level_(job.plan.base_lattice().deepest_level), lattice_(job.plan.lattice) {}

    int base_level() const { return base_level_; }
    int levels() const { return lattice_.deepest_level + 1 - base_level_; }

    /// The leaf over the finest tile asked for last: neighbouring samples ask for the same one.
    struct RecentLeaf {
        std::int64_t tile_x = -1, tile_y = -1;
        int level = 0;
    };

    /// The cells at a place: several where it is on a line between them.
    SurfacePlaces places_at(double i, double j, RecentLeaf& recent) const {
        SurfacePlaces places;
        const FinestCells columns(i, lattice_.cells_x), rows(j, lattice_.cells_y);
        for (std::size_t r = 0; r < rows.count; ++r)
            for (std::size_t c = 0; c < columns.count; ++c) {
                const std::int64_t fi = columns.cell[c], fj = rows.cell[r];
                const int level = leaf_level(fi, fj, recent), shift = lattice_.deepest_level - level;
                SurfacePlace p{level, fi >> shift, fj >> shift, 0, 0};
                const auto known = std::find_if(places.begin(), places.end(), [&](const SurfacePlace& q) {
                    return q.level == p.level && q.ci == p.ci && q.cj == p.cj;
                });
                if (known != places.end()) continue;
                const double step = 1 / static_cast<double>(std::int64_t{1} << shift);  // exact
                p.u = std::clamp(i * step - static_cast<double>(p.ci), 0.0, 1.0);
                p.v = std::clamp(j * step - static_cast<double>(p.cj), 0.0, 1.0);
                places.all[places.count++] = p;
            }
        return places;
    }

    /// The points of `box` at a level: heights in metres, and one byte each, 1 = valid.
    Result<void> read(int level, const PointBox& box, std::vector<double>& height_m,
                      std::vector<std::uint8_t>& valid) const {
        height_m.resize(static_cast<std::size_t>(box.count()));
        valid.resize(height_m.size());
        const std::int64_t columns = box.columns(), rows = box.j1 - box.j0 + 1;
        const HeightQuantizer& q = job_.quantizer;
        if (level == base_level_) {
            if (auto ok = job_.spool.read_window(box.i0, box.j0, columns, rows, height_m, valid); !ok) return ok;
            for (double& v : height_m) v = q.height_offset_m + q.quantize(v) * q.quantum_m;
            return {};
        }
        std::vector<std::int32_t> quanta(height_m.size());
        const std::int64_t stride = lattice_.step(level);
        double unused = 0;
        if (auto ok = job_.deep->sample(box.i0 * stride, box.j0 * stride, columns, rows, stride, quanta, valid, unused);
            !ok)
            return ok;
        std::transform(quanta.begin(), quanta.end(), height_m.begin(),
                       [&](std::int32_t n) { return q.height_offset_m + n * q.quantum_m; });
        return {};
    }

private:
    // The finest cells of a row or column that a coordinate lies in: two where it is on the line between them.
    struct FinestCells {
        FinestCells(double at, std::int64_t cells) {
            for (const double side : {kOnLine, -kOnLine}) {
                if (!(at + side >= 0 && at + side < static_cast<double>(cells))) continue;
                const auto found = static_cast<std::int64_t>(at + side);
                if (count == 0 || found != cell[0]) cell[count++] = found;
            }
        }
        std::array<std::int64_t, 2> cell{};
        std::size_t count = 0;
    };

    int leaf_level(std::int64_t fi, std::int64_t fj, RecentLeaf& recent) const {
        if (job_.tree == nullptr) return base_level_;
        const TileId finest{lattice_.deepest_level, fi >> lattice_.tile_cells_log2, fj >> lattice_.tile_cells_log2};
        if (finest.x == recent.tile_x && finest.y == recent.tile_y) return recent.level;
        int level = base_level_;
        while (job_.tree->refined(ancestor_at(finest, level))) ++level;
        recent = {finest.x, finest.y, level};
        return level;
    }

    const WarpErrorJob& job_;
    int base_level_;
    Lattice lattice_;
};

// Points of one level of the surface around the samples of a rectangle.
struct LevelWindow {
    PointBox box;
    std::vector<double> height_m;
    std::vector<std::uint8_t> valid;

    bool present(const SurfacePlace& p) const {
        const auto k = static_cast<std::size_t>((p.cj - box.j0) * box.columns() + p.ci - box.i0);
        const std::size_t below = k + static_cast<std::size_t>(box.columns());
        return (valid[k] & valid[k + 1] & valid[below] & valid[below + 1]) != 0;
    }

    // The diagonal goes from the north-west corner where ci + cj is even (common/mesh/tile_patterns.h).
    double surface_at(const SurfacePlace& p) const {
        const auto k = static_cast<std::size_t>((p.cj - box.j0) * box.columns() + p.ci - box.i0);
        const std::size_t below = k + static_cast<std::size_t>(box.columns());
        const double nw = height_m[k], ne = height_m[k + 1], sw = height_m[below], se = height_m[below + 1];
        const double u = p.u, v = p.v;
        if ((p.ci + p.cj) % 2 == 0)
            return u >= v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
        return u + v <= 1 ? nw + u * (ne - nw) + v * (sw - nw) : se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
    }
};

class LayerJudge {
public:
    LayerJudge(const WarpErrorJob& job, std::size_t layer, const VisibleSamples& samples,
               const SamplePositions& positions)
        : job_(job),
          surface_(job),
          index_(layer),
          layer_(job.stack.layer(layer)),
          samples_(samples),
          positions_(positions) {}

    Result<Sum> judge(HeightStack::Block block) const {
        return judge({block.column, block.row, std::min(kBlock, layer_.columns - block.column),
                      std::min(kBlock, layer_.rows - block.row)});
    }

private:
    struct Truth {
        SurfacePlaces places;
        double height_m;
    };

    Result<Sum> judge(const SampleRectangle& area) const {
        auto truths = truths_in(area);
        if (!truths) return truths.error();
        Sum sum;
        if (truths->empty()) return sum;
        std::vector<LevelWindow> windows(static_cast<std::size_t>(surface_.levels()));
        for (const Truth& t : *truths)
            for (const SurfacePlace& p : t.places) window_of(windows, p).box.add_cell(p.ci, p.cj);
        std::int64_t points = 0;
        for (const LevelWindow& w : windows) points += w.box.count();
        if (points > kMaxWindow && area.count() > 1) return halves(area);
        for (std::size_t k = 0; k < windows.size(); ++k) {
            if (windows[k].box.empty()) continue;
            LevelWindow& w = windows[k];
            if (auto ok = surface_.read(surface_.base_level() + static_cast<int>(k), w.box, w.height_m, w.valid); !ok)
                return ok.error();
        }
        for (const Truth& t : *truths) {
            double worst = -1;
            for (const SurfacePlace& p : t.places) {
                const LevelWindow& w = window_of(windows, p);
                if (w.present(p)) worst = std::max(worst, std::abs(w.surface_at(p) - t.height_m));
            }
            if (worst >= 0) sum.add(worst);
        }
        return sum;
    }

    LevelWindow& window_of(std::vector<LevelWindow>& windows, const SurfacePlace& p) const {
        return windows[static_cast<std::size_t>(p.level - surface_.base_level())];
    }

    // Samples far wider apart than the lattice's points.
    Result<Sum> halves(const SampleRectangle& area) const {
        const auto [first, second] = halves_of(area);
        auto sum = judge(first);
        if (!sum) return sum;
        auto more = judge(second);
        if (!more) return more;
        sum->add(*more);
        return sum;
    }

    // Samples with a height of their own that lie over the lattice.
    Result<std::vector<Truth>> truths_in(const SampleRectangle& area) const {
        std::vector<double> values(static_cast<std::size_t>(area.count()));
        if (auto ok = samples_.read(index_, area.column, area.row, area.columns, area.rows, values); !ok)
            return ok.error();
        auto window = positions_.window(area.column, area.row, area.columns, area.rows);
        if (!window) return window.error();
        const Lattice& l = job_.plan.lattice;
        std::vector<Truth> truths;
        FinestSurface::RecentLeaf recent;
        std::size_t k = 0;
        for (std::int64_t r = 0; r < area.rows; ++r)
            for (std::int64_t c = 0; c < area.columns; ++c, ++k) {
                if (!std::isfinite(values[k])) continue;
                const PlanePoint at =
                    window->position(static_cast<double>(area.column + c), static_cast<double>(area.row + r));
                auto places = surface_.places_at(l.i_of(at.x), l.j_of(at.y), recent);
                if (places.count == 0) continue;
                truths.push_back({places, job_.raw_values ? job_.quantizer.metres(values[k]) : values[k]});
            }
        return truths;
    }

    const WarpErrorJob& job_;
    FinestSurface surface_;
    std::size_t index_;
    const Layer& layer_;
    const VisibleSamples& samples_;
    const SamplePositions& positions_;
};

// Some blocks in parallel, their sums in order.
Result<Sum> judge_blocks(const LayerJudge& judge, std::span<const HeightStack::Block> blocks,
                         const std::atomic<bool>* stop) {
    std::vector<Sum> sums(blocks.size());
    std::mutex mutex;
    Result<void> outcome;
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t k) {
        if (stop != nullptr && stop->load()) return;
        auto sum = judge.judge(blocks[k]);
        if (sum) {
            sums[k] = *sum;
            return;
        }
        const std::lock_guard lock(mutex);
        if (outcome) outcome = sum.error();
    });
    if (!outcome) return outcome.error();
    if (stop != nullptr && stop->load()) return Error{ErrorCode::interrupted, "stopped; nothing was written"};
    Sum all;
    for (const Sum& sum : sums) all.add(sum);
    return all;
}

}  // namespace

Result<WarpError> measure_warp_error(const WarpErrorJob& job) {
    auto samples = VisibleSamples::make(job.stack);
    if (!samples) return samples.error();
    Sum all;
    for (std::size_t k = 0; k < job.stack.layer_count(); ++k) {
        auto positions = SamplePositions::make(job.stack.layer(k), job.plan.crs);
        if (!positions) return positions.error();
        const LayerJudge judge(job, k, *samples, *positions);
        const std::vector<HeightStack::Block> blocks = job.stack.blocks(k);
        for (std::size_t first = 0; first < blocks.size(); first += kBlocksAtOnce) {
            const std::size_t count = std::min(kBlocksAtOnce, blocks.size() - first);
            auto sum = judge_blocks(judge, std::span(blocks).subspan(first, count), job.stop);
            if (!sum) return sum.error();
            all.add(*sum);
        }
    }
    return WarpError{all.greatest_m, all.samples > 0 ? std::sqrt(all.squares / static_cast<double>(all.samples)) : 0,
                     all.samples};
}

}  // namespace scree
