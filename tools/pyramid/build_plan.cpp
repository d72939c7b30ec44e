#include "tools/pyramid/build_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <set>
#include <thread>
#include <tuple>

#include "tools/pyramid/build_record.h"
#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/height_spool.h"
#include "tools/pyramid/level_imagery.h"
#include "tools/pyramid/texture_stage.h"
#include "tools/source/fingerprint.h"
#include "tools/source/isolated_decoder.h"
#include "tools/source/sidecars.h"

namespace scree {
namespace {

// Measured on Debian 12: the program with SQLite's cache and PROJ. Decoders are measured as they run: 16 MiB for
// libtiff, 120 MiB more for OpenImageIO.
constexpr std::int64_t kProcessBytes = std::int64_t{28} << 20;
// Windows of at most 2^18 samples, as stored and as values, with what the kernel makes of them.
constexpr std::int64_t kSamplingBytesAThread = std::int64_t{6} << 20;
constexpr double kTexelTolerance = 1.1;  // a texel may be this much coarser than a source pixel

std::int64_t threads_of(const BuildOptions& o) {
    return o.threads > 0 ? o.threads : std::max(1u, std::thread::hardware_concurrency());
}

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

Result<int> log2_of(int value, int minimum_log2, int maximum_log2, const char* option, const char* allowed) {
    for (int k = minimum_log2; k <= maximum_log2; ++k)
        if (value == 1 << k) return k;
    return usage_error(fmt::format("{} is not one of {}", option, allowed));
}

// The smallest level whose texel is no more than 1.1 source pixels; and never coarser than a texel a cell of the dense
// part, because alpha says where heights end.
int texture_depth(const Dataset& dataset, double cell_m, double source_texel_m) {
    const double wanted = std::min(kTexelTolerance * source_texel_m, cell_m * (1 + 1e-9));
    int level = 0;
    while (level < kMaxLevel && dataset.texel_m(level) > wanted) ++level;
    return level;
}

bool north_up(const Georeference& where) { return where.axis_aligned() && where.column_x > 0 && where.row_y < 0; }

// Files that are read straight through, row by row, need no copy.
void choose_ways(BuildPlan& plan) {
    const MosaicPlan& m = plan.mosaic;
    plan.heights_in_place = m.base_shift == 0 && m.heights.size() == 1 && m.heights_copied && m.same_units &&
                            north_up(m.heights.front().where);
    plan.integer_heights =
        m.heights_copied && m.same_units &&
        std::all_of(m.heights.begin(), m.heights.end(), [](const PlacedFile& f) { return is_integer(f.info.type); });
    plan.wide_heights = !m.same_units || std::any_of(m.heights.begin(), m.heights.end(),
                                                     [](const PlacedFile& f) { return !fits_float32(f.info.type); });
}

std::int64_t widest_band_bytes(const std::vector<PlacedFile>& files, std::int64_t bytes_a_sample) {
    std::int64_t most = 0;
    for (const PlacedFile& f : files) most = std::max(most, f.info.width * 64 * bytes_a_sample + 2 * f.info.unit_bytes);
    return most;
}

// A file's box, or where it is turned or in another CRS the boxes of blocks of it, in finest cells; with a texel around
// those, for what their sides do between the points that are looked at.
Result<void> mark_image(const BuildPlan& plan, const PlacedFile& file, int level, TextureDepth& textures) {
    const Lattice& l = plan.dataset.lattice;
    const double rim = file.where.raster_is_point ? 0 : 0.5;
    const double first = -rim, last_column = static_cast<double>(file.info.width - 1) + rim,
                 last_row = static_cast<double>(file.info.height - 1) + rim;
    const bool aligned = file.where.axis_aligned() && file.crs.same_as(plan.mosaic.crs);
    constexpr double kBlock = 128;
    const double across = aligned ? last_column - first : kBlock, down = aligned ? last_row - first : kBlock;
    const double around = aligned ? 0 : plan.dataset.texel_m(level) / l.spacing_m;
    auto transform = CrsTransform::make(file.crs, plan.mosaic.crs);
    if (!transform) return transform.error();
    std::vector<double> x, y;
    for (double row = first; row < last_row; row += down)
        for (double column = first; column < last_column; column += across) {
            x.clear();
            y.clear();
            for (const double v : {0.0, 0.5, 1.0})
                for (const double u : {0.0, 0.5, 1.0}) {
                    const double c = std::min(column + u * across, last_column), r = std::min(row + v * down, last_row);
                    x.push_back(file.where.x(c, r));
                    y.push_back(file.where.y(c, r));
                }
            if (!aligned) transform->apply(x, y);
            double west = std::numeric_limits<double>::infinity(), north = west, east = -west, south = -west;
            for (std::size_t k = 0; k < x.size(); ++k) {
                const double i = l.i_of(x[k]), j = l.j_of(y[k]);
                if (!std::isfinite(i) || !std::isfinite(j)) continue;
                west = std::min(west, i);
                east = std::max(east, i);
                north = std::min(north, j);
                south = std::max(south, j);
            }
            if (west <= east) textures.mark(west - around, north - around, east + around, south + around, level);
        }
    return {};
}

// Which textures are refined: those over images that ask for it.
Result<void> plan_textures(BuildPlan& plan) {
    Dataset& d = plan.dataset;
    const MosaicPlan& m = plan.mosaic;
    const double cell_m = m.base_lattice().spacing_m;
    TextureDepth textures(d.lattice, d.texture_size_log2, texture_depth(d, cell_m, cell_m));
    for (std::size_t k = 0; k < m.imagery.size(); ++k) {
        const int level = texture_depth(d, cell_m, m.pixel_m[k]);
        if (!tile_key(d.lattice, {level, 0, 0}))
            return input_error(
                fmt::format("{}: imagery of {} m a pixel needs texture level {}, beyond the format's "
                            "keys",
                            m.imagery[k].path, m.pixel_m[k], level));
        plan.image_level.push_back(level);
        if (auto ok = mark_image(plan, m.imagery[k], level, textures); !ok) return ok;
    }
    textures.finish();
    d.texture_deepest_level = textures.deepest();
    if (textures.varies()) d.coarsest_texture_level = textures.coarsest();
    plan.textures = std::move(textures);
    return {};
}

Result<std::vector<PlaneBox>> boxes_of(const std::vector<PlacedFile>& files, const Crs& crs) {
    std::vector<PlaneBox> boxes;
    for (const PlacedFile& f : files) {
        auto box = box_of(f, crs);
        if (!box) return box.error();
        boxes.push_back(*box);
    }
    return boxes;
}

Result<void> plan_coverage(BuildPlan& plan) {
    const MosaicPlan& m = plan.mosaic;
    if (m.heights.size() < 2) return {};
    auto places = boxes_of(m.heights, m.crs);
    if (!places) return places.error();
    const Lattice base = m.base_lattice();
    std::vector<Coverage::Box> boxes;
    for (const PlaneBox& b : *places)
        boxes.push_back({base.i_of(b.west), base.j_of(b.north), base.i_of(b.east), base.j_of(b.south)});
    plan.coverage = Coverage(base, boxes);
    return {};
}

// Texels side by side that are made at once under the coarsest level, and what that takes: as many as there is memory
// for, because images are decoded in whole rows.
std::int64_t plan_deep_textures(const BuildOptions& o, std::int64_t others, BuildPlan& plan) {
    const Dataset& d = plan.dataset;
    if (!plan.textures.varies()) return 0;
    const auto bytes = [&](std::int64_t wide) { return TextureStage::bytes_needed(d, wide) + wide * 64 * 4; };
    std::int64_t wide = TextureStage::least_deep_texels(d);
    const auto most = static_cast<std::int64_t>(
        std::ceil(static_cast<double>(d.lattice.cells_x) * d.lattice.spacing_m / d.texel_m(d.texture_deepest_level)));
    while (wide < most && others + bytes(2 * wide) <= o.memory_bytes) wide *= 2;
    plan.deep_texels_wide = wide;
    return bytes(wide);
}

void plan_resources(const BuildOptions& o, BuildPlan& plan) {
    const Dataset& d = plan.dataset;
    const MosaicPlan& m = plan.mosaic;
    const Lattice base = m.base_lattice();
    const std::int64_t width = base.cells_x + 1, rows = base.cells_y + 1;
    std::int64_t heights = height_pyramid_bytes(base, o.height_codec) + width * 32 * 8;
    if (plan.heights_in_place)
        heights += 2 * m.heights.front().info.unit_bytes;
    else
        heights = std::max(
            {heights, widest_band_bytes(m.heights, 12), width * 64 * 8 + threads_of(o) * kSamplingBytesAThread});
    const std::int64_t texels_wide =
        base.cells_x * static_cast<std::int64_t>(std::ceil(base.spacing_m / d.texel_m(d.least_texture_level())));
    std::int64_t texture = TextureStage::bytes_needed(d, texels_wide);
    if (!m.imagery.empty()) texture += texels_wide * 64 * 4 + threads_of(o) * kSamplingBytesAThread;
    // Pixels of a band of tiles that go deeper, as they come up from there.
    if (plan.textures.varies()) texture += texels_wide * d.texture_size() * 4;
    texture += plan_deep_textures(o, kProcessBytes + decoder_usage().peak_rss_bytes + texture, plan);
    plan.memory_bytes = kProcessBytes + decoder_usage().peak_rss_bytes + std::max(heights, texture);
    const double share = Coverage::tile_count(plan.coverage, base, base.deepest_level) /
                         Coverage::tile_count({}, base, base.deepest_level);
    plan.temporary_bytes = static_cast<std::int64_t>(
        share * static_cast<double>(HeightSpool::bytes_needed(width, rows, plan.wide_heights)));
    if (!plan.heights_in_place) plan.temporary_bytes += height_stack_bytes(m.heights);
    plan.temporary_bytes += LevelImagery::temporary_bytes(plan);

    double height_tiles = 0, texture_tiles = 0;
    for (int level = 0; level <= std::max(base.deepest_level, d.texture_deepest_level); ++level) {
        const int above = std::min(level, base.deepest_level);
        const double tiles = std::ldexp(Coverage::tile_count(plan.coverage, base, above), 2 * (level - above));
        if (level <= base.deepest_level) height_tiles += tiles;
        if (level <= d.texture_deepest_level)
            texture_tiles += std::min(static_cast<double>(plan.textures.count(level)), tiles);
    }
    for (std::size_t k = 0; k < m.height_layers.size(); ++k) {
        if (m.layer_level[k] <= base.deepest_level) continue;
        // With parents and what grading adds.
        for (const LayerMember& member : m.height_layers[k].members)
            height_tiles += 2 + 2 * static_cast<double>(m.heights[member.file].info.width) *
                                    static_cast<double>(m.heights[member.file].info.height) /
                                    std::ldexp(1.0, 2 * base.tile_cells_log2);
    }
    const double samples = base.tile_samples() * base.tile_samples();
    plan.store_bytes_estimate =
        static_cast<std::int64_t>(height_tiles * (samples * named(o.height_codec).bytes_a_sample + 200) +
                                  texture_tiles * static_cast<double>(bc1_chain_bytes(d.texture_size_log2)) * 1.02);
}

SourceRecord source_record(const std::string& path, const char* role, const ImageInfo& info) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    return {std::filesystem::path(path).filename().string(),
            role,
            error ? 0 : static_cast<std::int64_t>(bytes),
            info.width,
            info.height,
            fingerprint_of(path)};
}

// Bottom to top where files overlap, by name where they do not: the order of files that do not overlap changes nothing.
std::vector<std::size_t> canonical_order(const std::vector<PlacedFile>& files, const std::vector<PlaneBox>& boxes) {
    const auto meet = [&](std::size_t a, std::size_t b) {
        const PlaneBox &p = boxes[a], &q = boxes[b];
        return p.west <= q.east && q.west <= p.east && p.south <= q.north && q.south <= p.north;
    };
    const auto name = [&](std::size_t k) { return std::filesystem::path(files[k].path).filename().string(); };
    std::vector<std::size_t> under(files.size());  // how many files that are not yet listed lie below
    std::vector<std::vector<std::size_t>> over(files.size());
    for (std::size_t a = 0; a < files.size(); ++a)
        for (std::size_t b = a + 1; b < files.size(); ++b)
            if (meet(a, b)) {
                over[a].push_back(b);
                ++under[b];
            }
    std::set<std::tuple<std::string, std::string, std::size_t>> ready;
    const auto enter = [&](std::size_t k) {
        if (under[k] == 0) ready.emplace(name(k), fingerprint_of(files[k].path), k);
    };
    for (std::size_t k = 0; k < files.size(); ++k) enter(k);
    std::vector<std::size_t> order;
    while (!ready.empty()) {
        const std::size_t k = std::get<2>(*ready.begin());
        ready.erase(ready.begin());
        order.push_back(k);
        for (const std::size_t above : over[k]) {
            --under[above];
            enter(above);
        }
    }
    return order;
}

// Of each file: what its layer's samples are counted from, and which of its sides are the layer's, where resampling
// ends otherwise than at a neighbour without samples (SourceRecord::layer).
std::vector<std::string> layer_names(const std::vector<PlacedFile>& files, const std::vector<Layer>& layers,
                                     const Crs& crs) {
    std::vector<std::string> names(files.size());
    for (const Layer& layer : layers) {
        const Georeference& w = layer.where;
        const std::string grid = fmt::format("{}|{}|{}|{}|{}|{}|{}", w.first_x, w.first_y, w.column_x, w.column_y,
                                             w.row_x, w.row_y, layer.half_sample_rim);
        for (const LayerMember& member : layer.members) {
            const PlacedFile& f = files[member.file];
            const unsigned sides = (member.column == 0 ? kWestSide : 0u) | (member.row == 0 ? kNorthSide : 0u) |
                                   (member.column + f.info.width == layer.columns ? kEastSide : 0u) |
                                   (member.row + f.info.height == layer.rows ? kSouthSide : 0u);
            const unsigned straight = north_up(w) && layer.crs.same_as(crs) ? kStraight : 0u;
            names[member.file] = fmt::format("{:016x}{:02x}", fingerprint_of_bytes(grid), sides | straight);
        }
    }
    return names;
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

    OpenOptions open;
    open.max_unit_bytes = o.memory_bytes / 4;
    open.colours = o.colours;
    auto mosaic = plan_mosaic({o.dems, o.images, o.crs, o.assume_crs, o, o.assume_same_datum, open, *tile_log2});
    if (!mosaic) return mosaic.error();
    BuildPlan plan(std::move(*mosaic));
    plan.open = open;
    const MosaicPlan& m = plan.mosaic;
    if (!m.imagery.empty() && !plan.open.colours.stretch) {
        std::vector<std::string> images;
        for (const PlacedFile& f : m.imagery) images.push_back(f.path);
        auto stretch = choose_stretch(images, plan.open);
        if (!stretch) return stretch.error();
        plan.open.colours.stretch = *stretch;
    }
    Dataset& d = plan.dataset;
    d.lattice = m.lattice;
    d.texture_size_log2 = *texture_log2;
    if (m.crs_known) {
        d.crs = m.crs.text();
        d.crs_name = m.crs.name();
    }
    d.vertical_datum = m.vertical_datum;
    d.attribution = o.attribution;
    d.options = options_record(o, m.imagery.empty() ? std::nullopt : plan.open.colours.stretch);
    for (const auto& [files, layers_of, role] :
         {std::tuple(&m.heights, &m.height_layers, "heights"), std::tuple(&m.imagery, &m.image_layers, "imagery")}) {
        auto boxes = boxes_of(*files, m.crs);
        if (!boxes) return boxes.error();
        const std::vector<std::string> layers = layer_names(*files, *layers_of, m.crs);
        for (const std::size_t k : canonical_order(*files, *boxes)) {
            SourceRecord record = source_record((*files)[k].path, role, (*files)[k].info);
            const PlaneBox& b = (*boxes)[k];
            record.box_m = {b.west, b.south, b.east, b.north};
            record.layer = layers[k];
            record.sidecars = sidecar_prints((*files)[k].path);
            d.sources.push_back(std::move(record));
        }
    }
    d.has_imagery = !m.imagery.empty();
    if (auto ok = plan_coverage(plan); !ok) return ok.error();
    if (auto ok = plan_textures(plan); !ok) return ok.error();
    choose_ways(plan);
    plan_resources(o, plan);
    if (plan.memory_bytes > o.memory_bytes)
        return usage_error(fmt::format("--memory {} MiB is not enough for these widths: {} MiB are needed",
                                       o.memory_bytes >> 20, (plan.memory_bytes >> 20) + 1));
    return plan;
}

}  // namespace scree
