#include "common/lattice.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace scree {
namespace {

std::uint64_t spread_bits(std::uint64_t v) {
    v &= 0xFFFFFFFFu;
    v = (v | (v << 16)) & 0x0000FFFF0000FFFFu;
    v = (v | (v << 8)) & 0x00FF00FF00FF00FFu;
    v = (v | (v << 4)) & 0x0F0F0F0F0F0F0F0Fu;
    v = (v | (v << 2)) & 0x3333333333333333u;
    v = (v | (v << 1)) & 0x5555555555555555u;
    return v;
}

std::uint64_t gather_bits(std::uint64_t v) {
    v &= 0x5555555555555555u;
    v = (v | (v >> 1)) & 0x3333333333333333u;
    v = (v | (v >> 2)) & 0x0F0F0F0F0F0F0F0Fu;
    v = (v | (v >> 4)) & 0x00FF00FF00FF00FFu;
    v = (v | (v >> 8)) & 0x0000FFFF0000FFFFu;
    v = (v | (v >> 16)) & 0x00000000FFFFFFFFu;
    return v;
}

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }

std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return (a + b - 1) / b; }

}  // namespace

Result<void> Lattice::check() const {
    if (!std::isfinite(origin_x_m) || !std::isfinite(origin_y_m) || std::abs(origin_x_m) > 1e9 ||
        std::abs(origin_y_m) > 1e9)
        return input_error(
            fmt::format("lattice origin ({}, {}) m is not a place within 1e9 m", origin_x_m, origin_y_m));
    if (!std::isfinite(spacing_m) || spacing_m < 1e-6 || spacing_m > 1e6)
        return input_error(fmt::format("lattice spacing {} m is outside 1e-6..1e6 m", spacing_m));
    if (cells_x < 1 || cells_y < 1 || cells_x > kMaxCellsPerSide || cells_y > kMaxCellsPerSide)
        return input_error(fmt::format("lattice of {} x {} cells; a side must have 1 to 2^30 cells", cells_x, cells_y));
    if (tile_cells_log2 < kMinTileCellsLog2 || tile_cells_log2 > kMaxTileCellsLog2)
        return input_error(
            fmt::format("tile size {} is not 5, 9, 17, 33, 65, 129 or 257",
                        tile_cells_log2 < 0 || tile_cells_log2 > 30 ? tile_cells_log2 : (1 << tile_cells_log2) + 1));
    if (deepest_level < 0 || deepest_level > kMaxLevel || deepest_level + tile_cells_log2 > 30)
        return input_error(
            fmt::format("deepest level {} with {} cells a tile passes 2^30 cells a side", deepest_level, tile_cells()));
    if (root_rows < 1 || root_columns < 1 || root_rows > kMaxRoots || root_columns > kMaxRoots ||
        root_rows * root_columns > kMaxRoots)
        return input_error(fmt::format("{} x {} roots; at most {} are allowed", root_rows, root_columns, kMaxRoots));
    const std::int64_t root_extent = tile_extent(0);
    if (root_columns * root_extent > kMaxCellsPerSide || root_rows * root_extent > kMaxCellsPerSide)
        return input_error("padded lattice passes 2^30 cells a side");
    if (cells_x > root_columns * root_extent || cells_y > root_rows * root_extent)
        return input_error(fmt::format("{} x {} roots of {} cells do not cover {} x {} cells", root_rows, root_columns,
                                       root_extent, cells_x, cells_y));
    return {};
}

Result<Lattice> make_lattice(double origin_x_m, double origin_y_m, double spacing_m, std::int64_t cells_x,
                             std::int64_t cells_y, int tile_cells_log2) {
    Lattice lattice{origin_x_m, origin_y_m, spacing_m, cells_x, cells_y, 0, tile_cells_log2, 1, 1};
    if (cells_x < 1 || cells_y < 1 || cells_x > kMaxCellsPerSide || cells_y > kMaxCellsPerSide)
        return input_error(
            fmt::format("the heights would need {} x {} cells; a side must have 1 to 2^30 cells", cells_x, cells_y));
    if (tile_cells_log2 < kMinTileCellsLog2 || tile_cells_log2 > kMaxTileCellsLog2) {
        if (auto checked = lattice.check(); !checked) return checked.error();
    }
    const std::int64_t m = lattice.tile_cells();
    while ((m << lattice.deepest_level) < std::min(cells_x, cells_y)) ++lattice.deepest_level;
    for (;; ++lattice.deepest_level) {
        const std::int64_t extent = m << lattice.deepest_level;
        lattice.root_columns = ceil_div(cells_x, extent);
        lattice.root_rows = ceil_div(cells_y, extent);
        if (lattice.root_columns * lattice.root_rows <= kMaxRoots) break;
    }
    if (auto checked = lattice.check(); !checked) return checked.error();
    return lattice;
}

std::optional<std::int64_t> tile_key(const Lattice& lattice, TileId id) {
    if (!lattice.contains(id)) return std::nullopt;
    const std::int64_t mask = (std::int64_t{1} << id.level) - 1;
    const auto morton = spread_bits(static_cast<std::uint64_t>(id.x & mask)) |
                        (spread_bits(static_cast<std::uint64_t>(id.y & mask)) << 1);
    const std::uint64_t prefix = (std::uint64_t{1} << (2 * id.level)) | morton;
    const auto roots = static_cast<std::uint64_t>(lattice.root_rows * lattice.root_columns);
    const auto root = static_cast<std::uint64_t>((id.y >> id.level) * lattice.root_columns + (id.x >> id.level));
    std::uint64_t key = 0;
    if (__builtin_mul_overflow(prefix, roots, &key) || __builtin_add_overflow(key, root, &key) || (key >> 63) != 0)
        return std::nullopt;
    return static_cast<std::int64_t>(key);
}

std::optional<TileId> tile_from_key(const Lattice& lattice, std::int64_t key) {
    if (key < 1) return std::nullopt;
    const auto roots = static_cast<std::uint64_t>(lattice.root_rows * lattice.root_columns);
    const std::uint64_t prefix = static_cast<std::uint64_t>(key) / roots;
    const std::uint64_t root = static_cast<std::uint64_t>(key) % roots;
    if (prefix == 0) return std::nullopt;
    const int top = static_cast<int>(std::bit_width(prefix)) - 1;
    if (top % 2 != 0 || top / 2 > kMaxLevel) return std::nullopt;
    const int level = top / 2;
    const std::uint64_t morton = prefix ^ (std::uint64_t{1} << top);
    const auto columns = static_cast<std::uint64_t>(lattice.root_columns);
    TileId id;
    id.level = level;
    id.x = static_cast<std::int64_t>(((root % columns) << level) | gather_bits(morton));
    id.y = static_cast<std::int64_t>(((root / columns) << level) | gather_bits(morton >> 1));
    return id;
}

}  // namespace scree
