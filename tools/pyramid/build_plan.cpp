#include "tools/pyramid/build_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>

#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/height_spool.h"
#include "tools/pyramid/imagery_rows.h"
#include "tools/pyramid/texture_pyramid.h"
#include "tools/source/isolated_decoder.h"

namespace scree {
namespace {

// Measured on Debian 12: the program and SQLite's cache. Decoders are measured as they run: 13 MiB for libtiff, 120 MiB
// more for OpenImageIO.
constexpr std::int64_t kProcessBytes = std::int64_t{20} << 20;
constexpr double kTexelTolerance = 1.1;  // a texel may be this much coarser than a source pixel

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

Result<int> log2_of(int value, int minimum_log2, int maximum_log2, const char* option, const char* allowed) {
    for (int k = minimum_log2; k <= maximum_log2; ++k)
        if (value == 1 << k) return k;
    return usage_error(fmt::format("{} is not one of {}", option, allowed));
}

Result<Lattice> plan_lattice(const BuildOptions& o, const ImageSource& dem, int tile_cells_log2) {
    const auto place = place_heights(o.dem, dem, o);
    if (!place) return place.error();
    return make_lattice(place->x_m, place->y_m, place->step_x_m, dem.info().width - 1, dem.info().height - 1,
                        tile_cells_log2);
}

Result<void> plan_imagery(const BuildOptions& o, BuildPlan& plan) {
    const Lattice& lattice = plan.dataset.lattice;
    const ImageInfo& info = plan.imagery->info();
    const auto& dem_where = plan.dem->georeference();
    const auto& where = plan.imagery->georeference();
    if (dem_where.has_value() != where.has_value())
        return input_error(fmt::format("{} {} georeference and {} {}: either both or neither", o.dem,
                                       dem_where ? "carries a" : "carries no", *o.imagery,
                                       where ? "does" : "does not"));
    if (!where) {
        Georeference covering;  // the image covers the samples' extent edge to edge
        covering.column_x = static_cast<double>(lattice.cells_x) * lattice.spacing_m / static_cast<double>(info.width);
        covering.row_y = -static_cast<double>(lattice.cells_y) * lattice.spacing_m / static_cast<double>(info.height);
        covering.first_x = lattice.origin_x_m + covering.column_x / 2;
        covering.first_y = lattice.origin_y_m + covering.row_y / 2;
        plan.imagery_where = covering;
        return {};
    }
    if (auto ok = check_usable(*o.imagery, *where); !ok) return ok;
    if (!where->crs.empty() && !dem_where->crs.empty() && where->crs != dem_where->crs)
        return input_error(fmt::format("{} is in {}, {} in {}: both must be in one CRS until warping exists",
                                       *o.imagery, where->crs, o.dem, dem_where->crs));
    const double west = where->first_x - where->column_x / 2, north = where->first_y - where->row_y / 2;
    const double east = west + static_cast<double>(info.width) * where->column_x;
    const double south = north + static_cast<double>(info.height) * where->row_y;
    const auto cells_x = static_cast<double>(lattice.cells_x), cells_y = static_cast<double>(lattice.cells_y);
    if (east <= lattice.x_m(0) || west >= lattice.x_m(cells_x) || north <= lattice.y_m(cells_y) ||
        south >= lattice.y_m(0))
        return input_error(fmt::format("{} (x {}..{}, y {}..{}) does not meet {} (x {}..{}, y {}..{})", *o.imagery,
                                       west, east, south, north, o.dem, lattice.x_m(0), lattice.x_m(cells_x),
                                       lattice.y_m(cells_y), lattice.y_m(0)));
    plan.imagery_where = *where;
    return {};
}

// The smallest level whose texel is no more than 1.1 source pixels; and never coarser than a texel a cell, because
// alpha says where heights end.
int texture_depth(const Dataset& dataset, double source_texel_m) {
    const double wanted = std::min(kTexelTolerance * source_texel_m, dataset.lattice.spacing_m * (1 + 1e-9));
    int level = 0;
    while (level < kMaxLevel && dataset.texel_m(level) > wanted) ++level;
    return level;
}

void plan_resources(const BuildOptions& o, BuildPlan& plan) {
    const Dataset& d = plan.dataset;
    const ImageInfo& dem = plan.dem->info();
    const std::int64_t heights = height_pyramid_bytes(d.lattice) + 2 * dem.unit_bytes + dem.width * 32 * 8;
    std::int64_t texture = TexturePyramid::bytes_needed(d.lattice, d.texture_size_log2, d.texture_deepest_level);
    const std::int64_t texels_wide =
        d.lattice.cells_x *
        static_cast<std::int64_t>(std::ceil(d.lattice.spacing_m / d.texel_m(d.texture_deepest_level)));
    if (plan.imagery) texture += ImageryRows::bytes_needed(plan.imagery->info(), texels_wide);
    plan.memory_bytes = kProcessBytes + decoder_usage().peak_rss_bytes + std::max(heights, texture);
    plan.temporary_bytes = HeightSpool::bytes_needed(dem.width, dem.height, !fits_float32(dem.type));

    double height_tiles = 0, texture_tiles = 0;
    for (int level = 0; level <= d.deepest_level(); ++level) {
        const double extent = std::ldexp(d.lattice.tile_cells(), d.lattice.deepest_level - level);
        const double tiles = std::ceil(static_cast<double>(d.lattice.cells_x) / extent) *
                             std::ceil(static_cast<double>(d.lattice.cells_y) / extent);
        if (level <= d.lattice.deepest_level) height_tiles += tiles;
        if (level <= d.texture_deepest_level) texture_tiles += tiles;
    }
    const double samples = d.lattice.tile_samples() * d.lattice.tile_samples();
    plan.store_bytes_estimate =
        static_cast<std::int64_t>(height_tiles * (samples * 2 + 200) +
                                  texture_tiles * static_cast<double>(bc1_chain_bytes(d.texture_size_log2)) * 1.02);
    (void)o;
}

SourceRecord source_record(const std::string& path, const char* role, const ImageInfo& info) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    return {std::filesystem::path(path).filename().string(), role, error ? 0 : static_cast<std::int64_t>(bytes),
            info.width, info.height};
}

}  // namespace

Result<BuildPlan> plan_build(const BuildOptions& o) {
    if (o.memory_bytes < kMinMemoryBytes)
        return usage_error(
            fmt::format("--memory {} MiB is below the minimum of {} MiB", o.memory_bytes >> 20, kMinMemoryBytes >> 20));
    if (auto ok = check_height_reading(o); !ok) return ok.error();
    if (o.height_quantum_m && !(*o.height_quantum_m >= 1e-6 && *o.height_quantum_m <= 1000))
        return usage_error(fmt::format("--height-quantum {} m is outside 1e-6..1000", *o.height_quantum_m));
    auto tile_log2 = log2_of(o.tile_size - 1, kMinTileCellsLog2, kMaxTileCellsLog2,
                             fmt::format("--tile-size {}", o.tile_size).c_str(), "5, 9, 17, 33, 65, 129, 257");
    if (!tile_log2) return tile_log2.error();
    auto texture_log2 =
        log2_of(o.texture_size, kMinTextureSizeLog2, kMaxTextureSizeLog2,
                fmt::format("--texture-size {}", o.texture_size).c_str(), "16, 32, 64, 128, 256, 512, 1024, 2048");
    if (!texture_log2) return texture_log2.error();

    BuildPlan plan;
    const OpenOptions open_options{o.memory_bytes / 4};
    auto dem = open_heights(o.dem, open_options);
    if (!dem) return dem.error();
    plan.dem = std::move(*dem);
    auto lattice = plan_lattice(o, *plan.dem, *tile_log2);
    if (!lattice) return Error{lattice.error().code, lattice.error().message};
    Dataset& d = plan.dataset;
    d.lattice = *lattice;
    d.texture_size_log2 = *texture_log2;
    if (plan.dem->georeference()) {
        d.crs = plan.dem->georeference()->crs;
        d.crs_name = plan.dem->georeference()->crs_name;
        d.vertical_datum = plan.dem->georeference()->vertical_datum;
    }
    d.attribution = o.attribution;
    d.sources.push_back(source_record(o.dem, "heights", plan.dem->info()));
    double source_texel = d.lattice.spacing_m;
    if (o.imagery) {
        auto imagery = ImageSource::open(*o.imagery, open_options);
        if (!imagery) return imagery.error();
        plan.imagery = std::move(*imagery);
        if (auto ok = plan_imagery(o, plan); !ok) return ok.error();
        source_texel = std::min(plan.imagery_where.column_x, -plan.imagery_where.row_y);
        d.has_imagery = true;
        d.sources.push_back(source_record(*o.imagery, "imagery", plan.imagery->info()));
    }
    d.texture_deepest_level = texture_depth(d, source_texel);
    if (!tile_key(d.lattice, {d.texture_deepest_level, 0, 0}))
        return input_error(fmt::format("imagery of {} m a pixel needs texture level {}, beyond the format's keys",
                                       source_texel, d.texture_deepest_level));
    plan_resources(o, plan);
    if (plan.memory_bytes > o.memory_bytes)
        return usage_error(fmt::format("--memory {} MiB is not enough for these widths: {} MiB are needed",
                                       o.memory_bytes >> 20, (plan.memory_bytes >> 20) + 1));
    return plan;
}

}  // namespace scree
