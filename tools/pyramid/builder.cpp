#include "tools/pyramid/builder.h"

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <thread>

#include "common/process_usage.h"
#include "common/report.h"
#include "tools/partial_file.h"
#include "tools/progress.h"
#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/height_spool.h"
#include "tools/pyramid/imagery_rows.h"
#include "tools/pyramid/row_bands.h"
#include "tools/pyramid/spool_rows.h"
#include "tools/pyramid/texture_pyramid.h"
#include "tools/pyramid/tint.h"
#include "tools/pyramid/warp_error.h"
#include "tools/source/isolated_decoder.h"
#include "tools/source/suspect_values.h"

namespace scree {
namespace {

Error interrupted() { return {ErrorCode::interrupted, "stopped; nothing was written"}; }

double megapixels(const std::vector<PlacedFile>& files) {
    double sum = 0;
    for (const PlacedFile& f : files)
        sum += static_cast<double>(f.info.width) * static_cast<double>(f.info.height) / 1e6;
    return sum;
}
double image_megapixels(const BuildPlan& plan) { return megapixels(plan.mosaic.imagery); }

// The one DEM whose rows are the lattice's.
Result<void> spool_in_place(const BuildPlan& plan, const BuildOptions& options, HeightSpool& spool, Progress& progress,
                            const std::atomic<bool>& stop, std::vector<std::string>& warnings) {
    auto dem = open_heights(plan.mosaic.heights.front().path, plan.open);
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
    RowBands<double> bands(spool.width(),
                           [&](std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                               std::span<double> out) { return (*grid)->sample(i, j, columns, rows, 1, out); });
    for (std::int64_t j = 0; j < spool.height(); ++j) {
        if (stop) return interrupted();
        auto values = bands.row(j);
        if (!values) return values.error();
        if (auto ok = spool.append(*values); !ok) return ok;
    }
    return {};
}

// Interior voids get heights; what was left is said.
Result<void> fill_voids(const BuildPlan& plan, const BuildOptions& options, const HeightUnits& units,
                        HeightSpool& spool, const std::atomic<bool>& stop, BuildReport& report, HeightRange& range) {
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
    explicit DeepPart(const BuildPlan& plan)
        : tree(plan.mosaic.lattice, plan.mosaic.base_lattice().deepest_level),
          presence(plan.dataset.texture_deepest_level) {}

    DeepTree tree;
    std::unique_ptr<HeightGrid> grid;
    std::optional<DeepHeights> heights;
    DeepPresence presence;
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

Result<std::unique_ptr<DeepPart>> plan_depth(const BuildPlan& plan, const HeightStack& stack, const HeightSpool& spool,
                                             const HeightQuantizer& quantizer) {
    const MosaicPlan& m = plan.mosaic;
    auto deep = std::make_unique<DeepPart>(plan);
    for (std::size_t k = 0; k < stack.layer_count(); ++k)
        if (auto ok = mark_layer(m, stack, k, deep->tree); !ok) return ok.error();
    deep->tree.grade();
    auto grid = stack.on(m.finest_grid(), m.crs);
    if (!grid) return grid.error();
    deep->grid = std::move(*grid);
    deep->heights.emplace(*deep->grid, spool, quantizer, m.base_shift);
    return deep;
}

// Presence and tint of the cells under the texel rows, taken from the spool as rows are asked for in order.
class CellRows {
public:
    CellRows(HeightSpool& spool, const HeightQuantizer& quantizer, const TintOptions& tint)
        : spool_(spool), quantizer_(quantizer), tint_options_(tint) {
        const auto width = static_cast<std::size_t>(spool.width());
        for (auto* v : {&upper_, &lower_}) v->resize(width);
        for (auto* v : {&upper_valid_, &lower_valid_, &present_}) v->resize(width);
        tint_.resize((width - 1) * 4);
    }

    Result<void> move_to(std::int64_t cell_row) {
        if (cell_row == row_) return {};
        if (row_ >= 0 && cell_row == row_ + 1) {
            std::swap(upper_, lower_);
            std::swap(upper_valid_, lower_valid_);
        } else if (auto ok = load(cell_row, upper_, upper_valid_); !ok) {
            return ok;
        }
        if (auto ok = load(cell_row + 1, lower_, lower_valid_); !ok) return ok;
        row_ = cell_row;
        for (std::size_t i = 0; i + 1 < upper_valid_.size(); ++i)
            present_[i] = upper_valid_[i] & upper_valid_[i + 1] & lower_valid_[i] & lower_valid_[i + 1];
        tint_row(upper_, lower_, tint_options_, tint_);
        return {};
    }
    const std::uint8_t* present() const { return present_.data(); }
    const std::uint8_t* tint() const { return tint_.data(); }

private:
    Result<void> load(std::int64_t j, std::vector<double>& values, std::vector<std::uint8_t>& valid) {
        if (auto ok = spool_.read_row(j, values, valid); !ok) return ok;
        for (double& v : values) v = quantizer_.metres(v);
        return {};
    }

    HeightSpool& spool_;
    HeightQuantizer quantizer_;
    TintOptions tint_options_;
    std::int64_t row_ = -1;
    std::vector<double> upper_, lower_;
    std::vector<std::uint8_t> upper_valid_, lower_valid_, present_, tint_;
};

// Which texels of a row show terrain: by the cells of the dense part, and under refined tiles by those of the leaves.
class TexelPresence {
public:
    TexelPresence(const MosaicPlan& plan, const DeepPart* deep, double texels_a_cell, std::int64_t width)
        : plan_(plan),
          base_(plan.base_lattice()),
          deep_(deep),
          texels_a_cell_(texels_a_cell),
          present_(static_cast<std::size_t>(width)) {}

    /// Row r; `cells`: presence of the dense cells under it.
    std::span<const std::uint8_t> row(std::int64_t r, const std::uint8_t* cells) {
        const auto width = static_cast<std::int64_t>(present_.size());
        const auto run = static_cast<std::int64_t>(texels_a_cell_);
        for (std::int64_t c = 0; c < width; ++c) {
            const std::int64_t cell = c / run;
            present_[static_cast<std::size_t>(c)] = cell < base_.cells_x ? cells[cell] : std::uint8_t{0};
        }
        if (deep_ != nullptr) look_deeper(r, run);
        return present_;
    }

private:
    void look_deeper(std::int64_t r, std::int64_t run) {
        const std::int64_t m = base_.tile_cells(), y = r / run / m;
        const std::int64_t columns = (base_.cells_x + m - 1) / m;
        for (std::int64_t x = 0; x < columns; ++x) {
            const TileId tile{base_.deepest_level, x, y};
            if (!deep_->tree.refined(tile)) continue;
            const std::int64_t end = std::min((x + 1) * m, base_.cells_x) * run;
            for (std::int64_t c = x * m * run; c < end; ++c)
                present_[static_cast<std::size_t>(c)] = present(tile, c, r) ? 1 : 0;
        }
    }

    // The cell, of whichever leaf, that the texel's centre lies in.
    bool present(TileId tile, std::int64_t c, std::int64_t r) const {
        const double scale = std::ldexp(1.0, plan_.base_shift) / texels_a_cell_;
        const auto i = static_cast<std::int64_t>((static_cast<double>(c) + 0.5) * scale),
                   j = static_cast<std::int64_t>((static_cast<double>(r) + 0.5) * scale);
        const Lattice& l = plan_.lattice;
        while (deep_->tree.refined(tile)) {
            const std::int64_t extent = l.tile_extent(tile.level + 1);
            tile = {tile.level + 1, i / extent, j / extent};
        }
        const LatticePoint corner = l.corner(tile);
        const std::int64_t step = l.step(tile.level);
        return deep_->presence.present(
            tile, static_cast<std::size_t>((j - corner.j) / step * l.tile_cells() + (i - corner.i) / step));
    }

    const MosaicPlan& plan_;
    Lattice base_;
    const DeepPart* deep_;
    double texels_a_cell_;
    std::vector<std::uint8_t> present_;
};

// Imagery where there is any, tint elsewhere, nothing over absent cells.
void compose_row(std::span<const std::uint8_t> present, const std::uint8_t* tint, std::int64_t texels_a_cell,
                 bool imagery, std::uint8_t* texels) {
    const auto width = static_cast<std::int64_t>(present.size());
    for (std::int64_t c = 0; c < width; ++c) {
        std::uint8_t* texel = texels + 4 * c;
        if (present[static_cast<std::size_t>(c)] == 0)
            std::memset(texel, 0, 4);
        else if (!imagery || texel[3] < 128)
            std::memcpy(texel, tint + 4 * (c / texels_a_cell), 4);
        else
            texel[3] = 255;
    }
}

// Rows of RGBA texels of the imagery, in order; alpha 0 where it has none.
using TexelRows = std::function<Result<void>(std::int64_t r, std::span<std::uint8_t> out)>;

struct TextureStage {
    const BuildPlan& plan;
    const BuildOptions& options;
    HeightSpool& spool;
    const HeightQuantizer& quantizer;
    const HeightPyramidResult& heights;
    const DeepPart* deep;
    SqliteStoreWriter& writer;
    Progress& progress;
    const std::atomic<bool>& stop;
};

Result<std::int64_t> compose_textures(TextureStage& s, const TexelRows& imagery) {
    const Dataset& d = s.plan.dataset;
    const Lattice lattice = s.plan.mosaic.base_lattice();
    TexturePyramid pyramid({&s.writer, lattice, d.texture_size_log2, d.texture_deepest_level, &s.heights.tiles,
                            s.deep != nullptr ? &s.deep->presence : nullptr});
    const double cells_per_texel = d.texel_m(d.texture_deepest_level) / lattice.spacing_m;  // a power of two, <= 1
    CellRows cells(s.spool, s.quantizer, {d.min_height_m, d.max_height_m, lattice.spacing_m});
    const std::int64_t row_bytes = pyramid.width() * 4;
    const auto texels_a_cell = static_cast<std::int64_t>(std::llround(1 / cells_per_texel));
    TexelPresence presence(s.plan.mosaic, s.deep, static_cast<double>(texels_a_cell), pyramid.width());
    const double pixels_per_row = image_megapixels(s.plan) / static_cast<double>(pyramid.height());
    for (std::int64_t r = 0; r < pyramid.height(); r += pyramid.rows_per_push()) {
        if (s.stop) return interrupted();
        for (std::int64_t k = 0; k < pyramid.rows_per_push(); ++k) {
            std::uint8_t* texels = pyramid.rows() + k * row_bytes;
            const auto cell_row = static_cast<std::int64_t>((static_cast<double>(r + k) + 0.5) * cells_per_texel);
            if (cell_row >= lattice.cells_y) {
                std::memset(texels, 0, static_cast<std::size_t>(row_bytes));
                continue;
            }
            if (imagery)
                if (auto ok = imagery(r + k, {texels, static_cast<std::size_t>(row_bytes)}); !ok) return ok.error();
            if (auto ok = cells.move_to(cell_row); !ok) return ok.error();
            compose_row(presence.row(r + k, cells.present()), cells.tint(), texels_a_cell, static_cast<bool>(imagery),
                        texels);
        }
        if (auto ok = pyramid.push(); !ok) return ok.error();
        s.progress.add(pixels_per_row * pyramid.rows_per_push());
    }
    return pyramid.finish();
}

Result<std::int64_t> build_textures(TextureStage& s) {
    const Dataset& d = s.plan.dataset;
    const MosaicPlan& m = s.plan.mosaic;
    if (m.imagery.empty()) return compose_textures(s, {});
    const double texel = d.texel_m(d.texture_deepest_level);
    const TargetGrid grid{d.lattice.origin_x_m + texel / 2, d.lattice.origin_y_m - texel / 2, texel};
    const std::int64_t width = TexturePyramid::width_of(m.base_lattice(), d.texture_size_log2, d.texture_deepest_level);
    if (s.plan.imagery_in_place) {
        auto image = ImageSource::open(m.imagery.front().path, s.plan.open);
        if (!image) return image.error();
        ImageryRows rows(**image, m.imagery.front().where, {grid.x_m, grid.y_m, grid.step_m, width});
        return compose_textures(s, [&](std::int64_t r, std::span<std::uint8_t> out) { return rows.sample(r, out); });
    }
    auto stack = ImageStack::read(m.imagery, m.image_layers, grid, m.crs, stack_options(s.plan, s.options),
                                  [&](std::int64_t) { return !s.stop.load(); });
    if (!stack) return stack.error();
    RowBands<std::uint32_t> bands(
        width, [&](std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                   std::span<std::uint32_t> out) { return (*stack)->sample(i, j, columns, rows, out); });
    return compose_textures(s, [&](std::int64_t r, std::span<std::uint8_t> out) -> Result<void> {
        auto row = bands.row(r);
        if (!row) return row.error();
        std::memcpy(out.data(), row->data(), out.size());
        return {};
    });
}

}  // namespace

Result<void> announce_build(const BuildPlan& plan, const BuildOptions& options) {
    std::error_code error;
    for (const auto* files : {&plan.mosaic.heights, &plan.mosaic.imagery})
        for (const PlacedFile& input : *files)
            if (std::filesystem::equivalent(input.path, options.out, error))
                return Error{ErrorCode::usage,
                             fmt::format("{}: is an input, and the output would replace it", options.out)};
    if (std::filesystem::exists(options.out, error) && !options.force)
        return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", options.out)};
    const auto folder = std::filesystem::absolute(options.out, error).parent_path();
    struct statvfs space {};
    if (::statvfs(folder.c_str(), &space) != 0)
        return Error{ErrorCode::io, fmt::format("{}: {}", folder.string(), std::strerror(errno))};
    const auto free_bytes = static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize);
    const double needed = static_cast<double>(plan.temporary_bytes + plan.store_bytes_estimate);
    if (!options.quiet)
        note("disk: up to {:.1f} MB for the store and {:.1f} MB while building; {:.0f} MB are free\n",
             static_cast<double>(plan.store_bytes_estimate) / 1e6, static_cast<double>(plan.temporary_bytes) / 1e6,
             free_bytes / 1e6);
    if (needed > free_bytes)
        return Error{ErrorCode::io, fmt::format("{}: {:.0f} MB may be needed and {:.0f} MB are free", folder.string(),
                                                needed / 1e6, free_bytes / 1e6)};
    return {};
}

Result<BuildReport> build_store(BuildPlan plan, const BuildOptions& options, const std::atomic<bool>& stop) {
    const auto start = std::chrono::steady_clock::now();
    const int threads =
        options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    Dataset& d = plan.dataset;
    const Lattice lattice = plan.mosaic.base_lattice();
    const std::int64_t width = lattice.cells_x + 1, height = lattice.cells_y + 1;
    const double dem_pixels = megapixels(plan.mosaic.heights),
                 lattice_points = static_cast<double>(width) * static_cast<double>(height) / 1e6;

    auto partial = PartialFile::create(options.out + ".partial");
    if (!partial) return partial.error();
    auto spool = HeightSpool::create(options.out + ".heights", width, height, plan.wide_heights);
    if (!spool) return spool.error();
    auto writer = SqliteStoreWriter::create((*partial)->path());
    if (!writer) return writer.error();
    Progress progress("building", "MPix", options.quiet);
    progress.set_total(dem_pixels + lattice_points + image_megapixels(plan));

    std::unique_ptr<HeightStack> stack;
    if (!plan.heights_in_place) {
        auto read = read_stack(plan, options, progress, stop);
        if (!read) return read.error();
        stack = std::move(*read);
    }
    BuildReport report;
    if (stack) report.warnings = stack->warnings();
    auto spooled = stack ? spool_stack(plan, *stack, **spool, stop)
                         : spool_in_place(plan, options, **spool, progress, stop, report.warnings);
    if (!spooled) return spooled.error();
    const std::string& first_dem = plan.mosaic.heights.front().path;
    auto summary = (*spool)->finish();
    if (!summary) return Error{summary.error().code, fmt::format("{}: {}", first_dem, summary.error().message)};
    HeightRange range{summary->min_raw, summary->max_raw};
    if (plan.mosaic.base_shift > 0) range.include(stack->range());  // between the spool's points there are others
    HeightUnits units;
    if (plan.mosaic.same_units)
        units = units_of(plan.mosaic.heights.front().info, plan.mosaic.heights.front().where, options);
    if (auto ok = fill_voids(plan, options, units, **spool, stop, report, range); !ok) return ok.error();
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
    auto heights = build_height_pyramid({spool->get(), writer->get(), lattice, *quantizer,
                                         [&](std::int64_t) {
                                             progress.add(static_cast<double>(width) / 1e6);
                                             return !stop.load();
                                         },
                                         deep ? &deep->tree : nullptr, deep ? &*deep->heights : nullptr,
                                         deep ? &deep->presence : nullptr, d.lattice});
    if (!heights) return heights.error().code == ErrorCode::interrupted ? interrupted() : heights.error();
    if (heights->tile_count == 0)
        return Error{ErrorCode::input,
                     fmt::format("{}: no cell has four valid corners: there is nothing to build", first_dem)};
    d.height_offset_m = quantizer->height_offset_m;
    d.height_quantum_m = quantizer->quantum_m;
    d.height_quantum_error_m = heights->worst_quantum_error_m > 0 ? quantizer->quantum_m / 2 : 0;
    d.warp_error_m = warp.greatest_m;
    d.min_height_m = d.height_m(heights->min_n);
    d.max_height_m = d.height_m(heights->max_n);
    d.height_tiles = heights->tile_count;
    d.present_cells = heights->present_cells;
    if (heights->coarsest_leaf_level < d.lattice.deepest_level) d.coarsest_leaf_level = heights->coarsest_leaf_level;

    TextureStage stage{plan, options, **spool, *quantizer, *heights, deep.get(), **writer, progress, stop};
    auto textures = build_textures(stage);
    if (!textures) return textures.error();
    d.texture_tiles = *textures;
    if (auto ok = (*writer)->finish(d); !ok) return ok.error();
    if (stop) return interrupted();
    if (auto ok = (*partial)->rename_to(options.out); !ok) return ok.error();
    progress.finish();

    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    report.cpu_seconds = usage.cpu_seconds + decoders.cpu_seconds;
    report.peak_rss_bytes = usage.peak_rss_bytes + decoders.peak_rss_bytes;
    report.warp_error_m = warp.greatest_m;
    report.warp_rms_m = warp.rms_m;
    report.source_megapixels = dem_pixels + image_megapixels(plan);
    report.height_tiles = d.height_tiles;
    report.texture_tiles = d.texture_tiles;
    std::error_code error;
    report.store_bytes = static_cast<std::int64_t>(std::filesystem::file_size(options.out, error));
    return report;
}

}  // namespace scree
