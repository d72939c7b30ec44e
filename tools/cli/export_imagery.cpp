#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/query/height_query.h"
#include "common/store/texture_codec.h"
#include "tools/cli/dataset_label.h"
#include "tools/cli/export_raster.h"

namespace scree {
namespace {

constexpr std::int64_t kBlock = GeotiffWriter::kBlock;

using Texel = std::array<std::uint8_t, 4>;

// EXT_texture_compression_s3tc, every colour rounded once, to nearest.
Texel bc1_texel(const std::uint8_t* block, unsigned x, unsigned y) {
    const unsigned c0 = block[0] | unsigned{block[1]} << 8, c1 = block[2] | unsigned{block[3]} << 8;
    const unsigned selector = block[4 + y] >> (2 * x) & 3;
    const bool four_colours = c0 > c1;
    if (!four_colours && selector == 3) return {0, 0, 0, 0};
    // Shares of the first endpoint and of both together.
    const unsigned whole = selector < 2   ? 1
                           : four_colours ? 3
                                          : 2,
                   first = selector == 0   ? 1
                           : selector == 1 ? 0
                                           : whole - (selector == 2 ? 1 : 2);
    const auto part = [](unsigned c, int channel) {
        return channel == 0 ? c >> 11 : channel == 1 ? c >> 5 & 63 : c & 31;
    };
    Texel texel{0, 0, 0, 255};
    for (int k = 0; k < 3; ++k) {
        const unsigned sum = first * part(c0, k) + (whole - first) * part(c1, k), full = whole * (k == 1 ? 63 : 31);
        texel[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>((2 * 255 * sum + full) / (2 * full));
    }
    return texel;
}

// Texels of the level along one axis.
struct TexelRange {
    std::int64_t first = 0, count = 0;
};

// Those that meet from..to, counted in texels, of the `extent` that has data.
TexelRange meeting(double from, double to, double extent) {
    const double low = std::clamp(std::floor(from), 0.0, std::ceil(extent)),
                 high = std::clamp(std::ceil(to), low, std::ceil(extent));
    return {static_cast<std::int64_t>(low), static_cast<std::int64_t>(high - low)};
}

class ImageryBlocks {
public:
    ImageryBlocks(const Dataset& d, TileReader& reader, int level, TexelRange columns, TexelRange rows)
        : dataset_(d), reader_(reader), level_(level), columns_(columns), rows_(rows) {}

    Result<std::int64_t> fill(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                              std::span<std::uint8_t> samples) {
        west_ = columns_.first + column;
        north_ = rows_.first + row;
        east_ = west_ + columns;
        south_ = north_ + rows;
        opaque_ = 0;
        for (std::int64_t y = 0; y < dataset_.lattice.root_rows; ++y)
            for (std::int64_t x = 0; x < dataset_.lattice.root_columns; ++x)
                if (auto ok = visit({0, x, y}, samples); !ok) return ok.error();
        return columns * rows - opaque_;
    }

private:
    Result<void> visit(TileId id, std::span<std::uint8_t> samples) {
        const std::int64_t extent = std::int64_t{dataset_.texture_size()} << (level_ - id.level);
        if (id.x * extent >= east_ || (id.x + 1) * extent <= west_ || id.y * extent >= south_ ||
            (id.y + 1) * extent <= north_)
            return {};
        auto tile = read(id);
        if (!tile) return tile.error();
        if (!*tile) return {};
        const unsigned children = tile_.child_mask;
        if (children == 0 || id.level == level_) {
            copy(id, extent, samples);
            return {};
        }
        for (int q = 0; q < 4; ++q)
            if ((children >> q & 1) != 0)
                if (auto ok = visit(child_of(id, q), samples); !ok) return ok;
        return {};
    }

    // Into tile_. False: there is no such root.
    Result<bool> read(TileId id) {
        const auto named = [id](const Error& error) {
            return Error{error.code, fmt::format("texture tile {}/{}/{}: {}", id.level, id.x, id.y, error.message)};
        };
        auto found = reader_.read(TileKind::texture, id, row_);
        if (!found) return named(found.error());
        if (!*found && id.level > 0) return named({ErrorCode::store, "is missing from the store"});
        if (!*found) return false;
        if (auto ok = decode_texture_tile(row_.payload, dataset_.texture_size_log2, row_.codec, tile_); !ok)
            return named(ok.error());
        return true;
    }

    void copy(TileId id, std::int64_t extent, std::span<std::uint8_t> samples) {
        const int shift = level_ - id.level, size_log2 = dataset_.texture_size_log2;
        const std::uint8_t* blocks = tile_.blocks.data() + bc1_mip_offset(size_log2, 0);
        const std::int64_t pitch = dataset_.texture_size() / 4, left = id.x * extent, top = id.y * extent;
        for (std::int64_t y = std::max(north_, top); y < std::min(south_, top + extent); ++y)
            for (std::int64_t x = std::max(west_, left); x < std::min(east_, left + extent); ++x) {
                const std::int64_t c = (x - left) >> shift, r = (y - top) >> shift;
                const Texel texel = bc1_texel(blocks + 8 * (r / 4 * pitch + c / 4), static_cast<unsigned>(c % 4),
                                              static_cast<unsigned>(r % 4));
                std::memcpy(samples.data() + 4 * ((y - north_) * kBlock + x - west_), texel.data(), 4);
                opaque_ += texel[3] != 0 ? 1 : 0;
            }
    }

    const Dataset& dataset_;
    TileReader& reader_;
    int level_;
    TexelRange columns_, rows_;
    std::int64_t west_ = 0, north_ = 0, east_ = 0, south_ = 0;  // of the block, in texels
    std::int64_t opaque_ = 0;
    TileRow row_;
    TextureTile tile_;
};

}  // namespace

Result<RasterReport> export_imagery(const SqliteStore& store, const RasterExport& options) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const int level = options.level.value_or(d.texture_deepest_level);
    if (level < 0 || level > d.texture_deepest_level)
        return Error{ErrorCode::usage,
                     fmt::format("--level {}: the textures' levels are 0..{}", level, d.texture_deepest_level)};
    const ExportBox box = options.box.value_or(whole_extent(l));
    const double texel_m = d.texel_m(level), cells_a_texel = texel_m / l.spacing_m;
    const auto across = [&](double metres, double origin_m, double sign) {
        return on_lattice(sign * (metres - origin_m) / texel_m, metres, origin_m, texel_m);
    };
    const TexelRange columns = meeting(across(box.x_min, l.origin_x_m, 1), across(box.x_max, l.origin_x_m, 1),
                                       static_cast<double>(l.cells_x) / cells_a_texel),
                     rows = meeting(across(box.y_max, l.origin_y_m, -1), across(box.y_min, l.origin_y_m, -1),
                                    static_cast<double>(l.cells_y) / cells_a_texel);
    if (columns.count < 1 || rows.count < 1)
        return Error{ErrorCode::usage, fmt::format("--box {},{},{},{} meets no texel of the store", box.x_min,
                                                   box.y_min, box.x_max, box.y_max)};
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    GeotiffLayout layout;
    layout.width = columns.count;
    layout.height = rows.count;
    layout.type = SampleType::u8;
    layout.channels = 4;
    layout.point = false;
    layout.x = l.origin_x_m + static_cast<double>(columns.first) * texel_m;
    layout.y = l.origin_y_m - static_cast<double>(rows.first) * texel_m;
    layout.step_x = layout.step_y = texel_m;
    layout.crs = crs_of(d);
    ImageryBlocks blocks(d, **reader, level, columns, rows);
    auto report = write_raster(
        options, layout,
        [&](std::int64_t column, std::int64_t row, std::int64_t block_columns, std::int64_t block_rows,
            std::span<std::uint8_t> samples) { return blocks.fill(column, row, block_columns, block_rows, samples); });
    if (report) report->level = level;
    return report;
}

}  // namespace scree
