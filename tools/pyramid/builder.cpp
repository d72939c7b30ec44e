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
#include "tools/pyramid/texture_pyramid.h"
#include "tools/pyramid/tint.h"
#include "tools/source/isolated_decoder.h"

namespace scree {
namespace {

constexpr std::int64_t kSpoolBandRows = 16;

Error interrupted() { return {ErrorCode::interrupted, "stopped; nothing was written"}; }

Result<void> spool_heights(BuildPlan& plan, const BuildOptions& options, HeightSpool& spool, Progress& progress,
                           const std::atomic<bool>& stop, double pixels_done) {
    const ImageInfo& info = plan.dem->info();
    const VoidRule voids(info, options);
    std::vector<double> band(static_cast<std::size_t>(kSpoolBandRows * info.width));
    for (std::int64_t j = 0; j < info.height; j += kSpoolBandRows) {
        if (stop) return interrupted();
        const std::int64_t rows = std::min(kSpoolBandRows, info.height - j);
        const auto count = static_cast<std::size_t>(rows * info.width);
        if (auto ok = plan.dem->read_channel(j, j + rows, std::span<double>(band.data(), count)); !ok) return ok;
        for (std::int64_t r = 0; r < rows; ++r) {
            const std::span<double> row(band.data() + r * info.width, static_cast<std::size_t>(info.width));
            voids.apply(row);
            if (auto ok = spool.append(row); !ok) return ok;
        }
        progress.update(pixels_done + static_cast<double>((j + rows) * info.width) / 1e6);
    }
    return {};
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

// Imagery where there is any, tint elsewhere, nothing over absent cells.
void compose_row(const CellRows& cells, const Lattice& lattice, double cells_per_texel, std::int64_t width,
                 bool imagery, std::uint8_t* texels) {
    const std::uint8_t* present = cells.present();
    const std::uint8_t* tint = cells.tint();
    const auto per_cell = static_cast<std::int64_t>(std::llround(1 / std::min(cells_per_texel, 1.0)));
    std::int64_t c = 0;
    for (std::int64_t cell = 0; cell < lattice.cells_x && c < width;) {
        const std::int64_t run = std::min(per_cell, width - c);
        if (present[cell] == 0) {
            std::memset(texels + 4 * c, 0, static_cast<std::size_t>(4 * run));
        } else {
            for (std::int64_t k = c; k < c + run; ++k)
                if (!imagery || texels[4 * k + 3] < 128)
                    std::memcpy(texels + 4 * k, tint + 4 * cell, 4);
                else
                    texels[4 * k + 3] = 255;
        }
        c += run;
        cell += 1;
    }
    std::memset(texels + 4 * c, 0, static_cast<std::size_t>(4 * (width - c)));
}

struct TextureStage {
    BuildPlan& plan;
    HeightSpool& spool;
    const HeightQuantizer& quantizer;
    const HeightPyramidResult& heights;
    SqliteStoreWriter& writer;
    Progress& progress;
    const std::atomic<bool>& stop;
    double pixels_done;
};

Result<std::int64_t> build_textures(TextureStage& s) {
    const Dataset& d = s.plan.dataset;
    const Lattice& lattice = d.lattice;
    TexturePyramid pyramid({&s.writer, lattice, d.texture_size_log2, d.texture_deepest_level, &s.heights.tiles});
    const double cells_per_texel = d.texel_m(d.texture_deepest_level) / lattice.spacing_m;  // a power of two, <= 1
    std::optional<ImageryRows> imagery;
    double pixels_per_row = 0;
    if (s.plan.imagery) {
        const double texel = d.texel_m(d.texture_deepest_level);
        imagery.emplace(
            *s.plan.imagery, s.plan.imagery_where,
            TexelGrid{lattice.origin_x_m + texel / 2, lattice.origin_y_m - texel / 2, texel, pyramid.width()});
        const ImageInfo& info = s.plan.imagery->info();
        pixels_per_row =
            static_cast<double>(info.width) * static_cast<double>(info.height) / static_cast<double>(pyramid.height());
    }
    CellRows cells(s.spool, s.quantizer, {d.min_height_m, d.max_height_m, lattice.spacing_m});
    const std::int64_t row_bytes = pyramid.width() * 4;
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
                if (auto ok = imagery->sample(r + k, {texels, static_cast<std::size_t>(row_bytes)}); !ok)
                    return ok.error();
            if (auto ok = cells.move_to(cell_row); !ok) return ok.error();
            compose_row(cells, lattice, cells_per_texel, pyramid.width(), imagery.has_value(), texels);
        }
        if (auto ok = pyramid.push(); !ok) return ok.error();
        s.progress.update(s.pixels_done + static_cast<double>(r) * pixels_per_row / 1e6);
    }
    return pyramid.finish();
}

}  // namespace

Result<void> announce_build(const BuildPlan& plan, const BuildOptions& options) {
    std::error_code error;
    for (const std::string* input : {&options.dem, options.imagery ? &*options.imagery : nullptr})
        if (input != nullptr && std::filesystem::equivalent(*input, options.out, error))
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
    const ImageInfo dem = plan.dem->info();
    const double dem_pixels = static_cast<double>(dem.width) * static_cast<double>(dem.height) / 1e6;
    double image_pixels = 0;
    if (plan.imagery)
        image_pixels =
            static_cast<double>(plan.imagery->info().width) * static_cast<double>(plan.imagery->info().height) / 1e6;

    auto partial = PartialFile::create(options.out + ".partial");
    if (!partial) return partial.error();
    auto spool = HeightSpool::create(options.out + ".heights", dem.width, dem.height, !fits_float32(dem.type));
    if (!spool) return spool.error();
    auto writer = SqliteStoreWriter::create((*partial)->path());
    if (!writer) return writer.error();
    Progress progress("building", "MPix", options.quiet);
    progress.set_total(2 * dem_pixels + image_pixels);

    if (auto ok = spool_heights(plan, options, **spool, progress, stop, 0); !ok) return ok.error();
    auto summary = (*spool)->finish();
    if (!summary) return Error{summary.error().code, fmt::format("{}: {}", options.dem, summary.error().message)};
    auto quantizer = choose_quantizer({is_integer(dem.type), options.height_scale, options.height_offset_m,
                                       options.height_quantum_m, summary->min_raw, summary->max_raw});
    if (!quantizer) return Error{quantizer.error().code, fmt::format("{}: {}", options.dem, quantizer.error().message)};

    auto heights = build_height_pyramid({spool->get(), writer->get(), d.lattice, *quantizer, [&](std::int64_t rows) {
                                             progress.update(dem_pixels + static_cast<double>(rows * dem.width) / 1e6);
                                             return !stop.load();
                                         }});
    if (!heights) return heights.error().code == ErrorCode::interrupted ? interrupted() : heights.error();
    if (heights->tile_count == 0)
        return Error{ErrorCode::input,
                     fmt::format("{}: no cell has four valid corners: there is nothing to build", options.dem)};
    d.height_offset_m = quantizer->height_offset_m;
    d.height_quantum_m = quantizer->quantum_m;
    d.height_quantum_error_m = heights->worst_quantum_error_m > 0 ? quantizer->quantum_m / 2 : 0;
    d.min_height_m = d.height_m(heights->min_n);
    d.max_height_m = d.height_m(heights->max_n);
    d.height_tiles = heights->tile_count;
    d.present_cells = heights->present_cells;

    TextureStage stage{plan, **spool, *quantizer, *heights, **writer, progress, stop, 2 * dem_pixels};
    auto textures = build_textures(stage);
    if (!textures) return textures.error();
    d.texture_tiles = *textures;
    if (auto ok = (*writer)->finish(d); !ok) return ok.error();
    if (stop) return interrupted();
    if (auto ok = (*partial)->rename_to(options.out); !ok) return ok.error();
    progress.finish();

    BuildReport report;
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    report.cpu_seconds = usage.cpu_seconds + decoders.cpu_seconds;
    report.peak_rss_bytes = usage.peak_rss_bytes + decoders.peak_rss_bytes;
    report.source_megapixels = dem_pixels + image_pixels;
    report.height_tiles = d.height_tiles;
    report.texture_tiles = d.texture_tiles;
    std::error_code error;
    report.store_bytes = static_cast<std::int64_t>(std::filesystem::file_size(options.out, error));
    return report;
}

}  // namespace scree
