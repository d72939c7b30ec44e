#include "tools/pyramid/height_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "tools/pyramid/deep_tree.h"
#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/height_spool.h"
#include "tools/pyramid/rim_support.h"
#include "tools/pyramid/row_bands.h"
#include "tools/pyramid/spool_rows.h"
#include "tools/pyramid/warp_error.h"
#include "tools/source/suspect_values.h"

namespace scree {
namespace {

Error interrupted() { return {ErrorCode::interrupted, "stopped"}; }

// The one DEM whose rows are the lattice's.
Result<void> spool_in_place(const BuildPlan& plan, const BuildOptions& options, HeightSpool& spool, Progress& progress,
                            const std::atomic<bool>& stop, std::vector<std::string>& warnings) {
    auto dem = open_heights(plan.mosaic.heights.front().path, plan.open, options.height_encoding);
    if (!dem) return dem.error();
    const ImageInfo& info = (*dem)->info();
    if (info.width != spool.width() || info.height != spool.height())
        return Error{ErrorCode::input,
                     fmt::format("{}: has changed while it was read", plan.mosaic.heights.front().path)};
    const VoidRule voids(info, options);
    SuspectValues suspects(info, options);
    const auto on_rows = [&](std::int64_t rows) {
        progress.add(static_cast<double>(rows * info.width) / 1e6);
        return !stop.load();
    };
    if (auto ok = spool_rows(**dem, voids, suspects, spool, on_rows); !ok)
        return ok.error().code == ErrorCode::interrupted ? interrupted() : ok.error();
    if (auto warning = suspects.warning(plan.mosaic.heights.front().path)) warnings.push_back(std::move(*warning));
    return {};
}

StackOptions stack_options(const BuildPlan& plan, const BuildOptions& options) {
    return {options.kernel, plan.open, options, options.out};
}

Result<std::unique_ptr<HeightStack>> read_stack(const BuildPlan& plan, const BuildOptions& options, Progress& progress,
                                                const std::atomic<bool>& stop) {
    const MosaicPlan& m = plan.mosaic;
    const auto on_samples = [&](std::int64_t samples) {
        progress.add(static_cast<double>(samples) / 1e6);
        return !stop.load();
    };
    return HeightStack::read(m.heights, m.height_layers, m.same_units, stack_options(plan, options), on_samples);
}

TargetGrid grid_of(const Lattice& lattice) { return {lattice.origin_x_m, lattice.origin_y_m, lattice.spacing_m}; }

Result<void> spool_stack(const BuildPlan& plan, const HeightStack& stack, HeightSpool& spool,
                         const std::atomic<bool>& stop) {
    // Where finer layers deepen the pyramid these are points of the finest lattice, no means over coarse cells.
    auto grid =
        stack.on(grid_of(plan.mosaic.base_lattice()), plan.mosaic.crs, std::ldexp(1.0, -plan.mosaic.base_shift));
    if (!grid) return grid.error();
    const auto make = [&](std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                          std::span<double> out) { return (*grid)->sample(i, j, columns, rows, 1, out); };
    const auto reached = [&](std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows) {
        return plan.coverage.reaches(i, j, columns, rows);
    };
    RowBands<double> bands(spool.width(), make, spool.sparse() ? reached : RowBands<double>::Wanted());
    for (std::int64_t j = 0; j < spool.height(); ++j) {
        if (stop) return interrupted();
        if (spool.sparse()) {
            std::span<const double> row;
            if (!spool.covered(j).empty()) {
                auto values = bands.row(j);
                if (!values) return values.error();
                row = *values;
            }
            if (auto ok = spool.append_covered(row); !ok) return ok;
            continue;
        }
        auto values = bands.row(j);
        if (!values) return values.error();
        if (auto ok = spool.append(*values); !ok) return ok;
    }
    return {};
}

// Interior voids get heights; what was left is said.
Result<void> fill_voids(const BuildPlan& plan, const BuildOptions& options, const HeightUnits& units,
                        HeightSpool& spool, const std::atomic<bool>& stop, HeightStageResult& report,
                        HeightRange& range) {
    FillRule rule = options.fill;
    rule.integer = plan.integer_heights;
    if (rule.kind == FillRule::Kind::value) rule.value = (rule.value - units.offset_m) / units.scale;
    auto filled = fill_interior_voids(spool, rule, options.memory_bytes / 8, [&] { return !stop.load(); });
    if (!filled) return filled.error().code == ErrorCode::interrupted ? interrupted() : filled.error();
    report.filled_samples = filled->filled_samples;
    if (filled->filled_samples > 0) range.include({filled->min_raw, filled->max_raw});
    if (filled->filled_samples > 0)
        report.notes.push_back(
            fmt::format("{} samples of {} interior voids were filled", filled->filled_samples, filled->filled_regions));
    if (filled->too_large_regions > 0)
        report.notes.push_back(fmt::format(
            "{} interior voids ({} samples) are too large to fill and stay absent; the largest spans {} x {} "
            "samples at column {}, row {} of the lattice",
            filled->too_large_regions, filled->too_large_samples, filled->largest_left.width,
            filled->largest_left.height, filled->largest_left.west, filled->largest_left.north));
    return {};
}

// Where finer layers go on below the dense part.
struct DeepPart {
    explicit DeepPart(const BuildPlan& plan) : tree(plan.mosaic.lattice, plan.mosaic.base_lattice().deepest_level) {}

    DeepTree tree;
    std::unique_ptr<HeightGrid> grid;
    std::optional<DeepHeights> heights;
};

// Every block of samples that a layer has deepens the tiles under it.
Result<void> mark_layer(const MosaicPlan& m, const HeightStack& stack, std::size_t k, DeepTree& tree) {
    const Layer& layer = stack.layer(k);
    auto transform = CrsTransform::make(layer.crs, m.crs);
    if (!transform) return transform.error();
    constexpr auto kBlock = static_cast<double>(RasterSpool<float>::kBlock);
    const auto last_column = static_cast<double>(layer.columns - 1), last_row = static_cast<double>(layer.rows - 1);
    for (const HeightStack::Block& block : stack.blocks(k)) {
        std::vector<double> x, y;
        for (const double v : {0.0, kBlock / 2, kBlock})
            for (const double u : {0.0, kBlock / 2, kBlock}) {
                const double column = std::min(static_cast<double>(block.column) + u, last_column),
                             row = std::min(static_cast<double>(block.row) + v, last_row);
                x.push_back(layer.where.x(column, row));
                y.push_back(layer.where.y(column, row));
            }
        transform->apply(x, y);
        double west = std::numeric_limits<double>::infinity(), north = west, east = -west, south = -west;
        for (std::size_t p = 0; p < x.size(); ++p) {
            const double i = m.lattice.i_of(x[p]), j = m.lattice.j_of(y[p]);
            if (!std::isfinite(i) || !std::isfinite(j)) continue;
            west = std::min(west, i);
            east = std::max(east, i);
            north = std::min(north, j);
            south = std::max(south, j);
        }
        if (west <= east) tree.mark(west, north, east, south, m.layer_level[k]);
    }
    return {};
}

Result<std::unique_ptr<DeepPart>> plan_depth(const BuildPlan& plan, const HeightStack& stack, HeightSpool& spool,
                                             const HeightQuantizer& quantizer) {
    const MosaicPlan& m = plan.mosaic;
    auto deep = std::make_unique<DeepPart>(plan);
    for (std::size_t k = 0; k < stack.layer_count(); ++k)
        if (auto ok = mark_layer(m, stack, k, deep->tree); !ok) return ok.error();
    deep->tree.grade();
    auto grid = stack.on(m.finest_grid(), m.crs);
    if (!grid) return grid.error();
    deep->grid = std::move(*grid);
    auto support = rim_support(spool, *deep->grid, deep->tree, m.lattice.tile_cells_log2, m.base_shift);
    if (!support) return support.error();
    spool.set_support(std::move(*support));
    deep->heights.emplace(*deep->grid, spool, quantizer, m.base_shift);
    return deep;
}

}  // namespace

Result<HeightStageResult> build_heights(const BuildPlan& plan, const BuildOptions& options, TileWriter& writer,
                                        HeightIndex& index, Progress& progress, const std::atomic<bool>& stop) {
    const Lattice lattice = plan.mosaic.base_lattice();
    const std::int64_t width = lattice.cells_x + 1, height = lattice.cells_y + 1;
    auto spool = HeightSpool::create(options.out + ".heights", width, height, plan.wide_heights, &plan.coverage);
    if (!spool) return spool.error();
    std::unique_ptr<HeightStack> stack;
    if (!plan.heights_in_place) {
        auto read = read_stack(plan, options, progress, stop);
        if (!read) return read.error();
        stack = std::move(*read);
    }
    HeightStageResult result;
    if (stack) result.warnings = stack->warnings();
    auto spooled = stack ? spool_stack(plan, *stack, **spool, stop)
                         : spool_in_place(plan, options, **spool, progress, stop, result.warnings);
    if (!spooled) return spooled.error();
    const std::string& first_dem = plan.mosaic.heights.front().path;
    auto summary = (*spool)->finish();
    if (!summary) return Error{summary.error().code, fmt::format("{}: {}", first_dem, summary.error().message)};
    HeightRange range{summary->min_raw, summary->max_raw};
    if (plan.mosaic.base_shift > 0) range.include(stack->range());  // between the spool's points there are others
    HeightUnits units;
    if (plan.mosaic.same_units)
        units = units_of(plan.mosaic.heights.front().info, plan.mosaic.heights.front().where, options);
    if (auto ok = fill_voids(plan, options, units, **spool, stop, result, range); !ok) return ok.error();
    auto quantizer = choose_quantizer(
        {plan.integer_heights, units.scale, units.offset_m, options.height_quantum_m, range.low, range.high});
    if (!quantizer) return Error{quantizer.error().code, fmt::format("{}: {}", first_dem, quantizer.error().message)};

    std::unique_ptr<DeepPart> deep;
    if (plan.mosaic.base_shift > 0) {
        auto planned = plan_depth(plan, *stack, **spool, *quantizer);
        if (!planned) return planned.error();
        deep = std::move(*planned);
    }
    WarpError warp;
    if (stack && (!plan.mosaic.heights_copied || deep)) {
        WarpErrorJob job{*stack, plan.mosaic.same_units, **spool, plan.mosaic, *quantizer};
        if (deep) {
            job.tree = &deep->tree;
            job.deep = &*deep->heights;
        }
        job.stop = &stop;
        auto measured = measure_warp_error(job);
        if (!measured) return measured.error();
        warp = *measured;
    }
    HeightPyramidJob job;
    job.spool = spool->get();
    job.writer = &writer;
    job.lattice = lattice;
    job.quantizer = *quantizer;
    job.on_rows = [&](std::int64_t) {
        progress.add(static_cast<double>(width) / 1e6);
        return !stop.load();
    };
    job.index = &index;
    job.coverage = plan.coverage.everything() ? nullptr : &plan.coverage;
    job.finest = plan.dataset.lattice;
    job.textures = &plan.textures;
    job.codec = options.height_codec;
    if (deep) {
        job.deep_tree = &deep->tree;
        job.deep_heights = &*deep->heights;
    }
    auto heights = build_height_pyramid(job);
    if (!heights) return heights.error();
    if (heights->tile_count == 0)
        return Error{ErrorCode::input,
                     fmt::format("{}: no cell has four valid corners: there is nothing to build", first_dem)};
    Dataset& d = result.dataset;
    d = plan.dataset;
    d.height_offset_m = quantizer->height_offset_m;
    d.height_quantum_m = quantizer->quantum_m;
    d.height_quantum_error_m = heights->worst_quantum_error_m > 0 ? quantizer->quantum_m / 2 : 0;
    d.warp_error_m = warp.greatest_m;
    d.min_height_m = d.height_m(heights->min_n);
    d.max_height_m = d.height_m(heights->max_n);
    d.height_tiles = heights->tile_count;
    d.present_cells = heights->present_cells;
    if (heights->coarsest_leaf_level < d.lattice.deepest_level) d.coarsest_leaf_level = heights->coarsest_leaf_level;
    result.warp_rms_m = warp.rms_m;
    return result;
}

}  // namespace scree
