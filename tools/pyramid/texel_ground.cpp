#include "tools/pyramid/texel_ground.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>

#include "common/store/height_codec.h"
#include "tools/stage_clock.h"

namespace scree {

// What has been read of a tile of the base's deepest level.
struct TexelGround::Tile {
    std::int64_t y = -1;
    bool loaded = false, leaves_loaded = false;
    std::vector<std::uint8_t> present;  // a byte a cell; empty: all
    std::vector<std::uint8_t> tint;     // RGBA a cell
    // Under a refined tile: its refined descendants, and which cells of leaves that lack some are present.
    std::unordered_map<TileId, std::uint8_t, TileIdHash> child_masks;
    std::unordered_map<TileId, std::vector<std::uint8_t>, TileIdHash> leaves;
};

TexelGround::TexelGround(const Dataset& dataset, const Lattice& base, const HeightIndex& index, HeightRowReader read,
                         int texture_level)
    : dataset_(dataset),
      base_(base),
      index_(index),
      read_(std::move(read)),
      tint_({dataset.min_height_m, dataset.max_height_m, base.spacing_m}),
      texels_a_cell_(std::llround(base.spacing_m / dataset.texel_m(texture_level))) {}

TexelGround::~TexelGround() = default;

Result<void> TexelGround::finish(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                                 std::uint8_t* rgba, std::int64_t row_bytes, bool opaque) {
    const std::int64_t side = base_.tile_cells() * texels_a_cell_;  // texels along a tile
    const std::int64_t first = column / side, end = (column + columns + side - 1) / side;
    // Opaque texels over whole ground are what they should be.
    const auto is_done = [&](std::int64_t x) {
        for (std::int64_t y = row / side; opaque && y * side < row + rows; ++y) {
            const TileId id{base_.deepest_level, x, y};
            if (index_.refined(id) || index_.cells(id) != HeightIndex::Cells::all) return false;
        }
        return opaque;
    };
    std::vector<std::pair<std::int64_t, Tile*>> open;
    for (std::int64_t x = first; x < end; ++x) {
        if (is_done(x)) continue;
        auto& tile = columns_[x];
        if (!tile) tile = std::make_unique<Tile>();
        open.emplace_back(x, tile.get());
    }
    std::mutex mutex;
    Result<void> outcome;
    tbb::parallel_for(std::size_t{0}, open.size(), [&](std::size_t k) {
        const StageClock::Scope clock(Stage::filter);
        const auto [x, tile] = open[k];
        const std::int64_t west = std::max(x * side, column), east = std::min((x + 1) * side, column + columns);
        for (std::int64_t r = row; r < row + rows;) {
            const std::int64_t south = std::min((r / side + 1) * side, row + rows);
            const Rectangle part{west, r, east - west, south - r};
            const TileId id{base_.deepest_level, x, r / side};
            std::uint8_t* corner = rgba + (r - row) * row_bytes + (west - column) * 4;
            if (auto ok = finish_part(*tile, id, part, corner, row_bytes); !ok) {
                const std::lock_guard lock(mutex);
                if (outcome) outcome = ok;
                return;
            }
            r = south;
        }
    });
    return outcome;
}

namespace {

bool all_opaque(const std::uint8_t* rgba, std::int64_t columns) {
    constexpr std::uint64_t kAlphas = 0xFF000000FF000000U;  // of two texels
    std::uint64_t all = kAlphas;
    std::int64_t c = 0;
    for (; c + 8 <= columns; c += 8) {
        std::uint64_t pairs[4];
        std::memcpy(pairs, rgba + 4 * c, sizeof pairs);
        all &= pairs[0] & pairs[1] & pairs[2] & pairs[3];
    }
    std::uint8_t rest = 255;
    for (; c < columns; ++c) rest &= rgba[4 * c + 3];
    return all == kAlphas && rest == 255;
}

}  // namespace

Result<void> TexelGround::finish_part(Tile& tile, TileId id, const Rectangle& part, std::uint8_t* rgba,
                                      std::int64_t row_bytes) {
    const bool refined = index_.refined(id);
    const HeightIndex::Cells cells = refined ? HeightIndex::Cells::some : index_.cells(id);
    if (tile.y != id.y) {
        tile = {};
        tile.y = id.y;
    }
    for (std::int64_t r = 0; r < part.rows; ++r) {
        std::uint8_t* texels = rgba + r * row_bytes;
        if (cells == HeightIndex::Cells::none) {
            std::memset(texels, 0, static_cast<std::size_t>(part.columns * 4));
            continue;
        }
        if (cells == HeightIndex::Cells::all && all_opaque(texels, part.columns)) continue;
        if (!tile.loaded)
            if (auto ok = load(tile, id); !ok) return ok;
        if (refined && !tile.leaves_loaded)
            if (auto ok = load_leaves(tile, id); !ok) return ok;
        const std::int64_t m = base_.tile_cells();
        const std::int64_t cell_row = (part.row + r) / texels_a_cell_ - id.y * m;
        for (std::int64_t c = 0; c < part.columns; ++c) {
            const std::int64_t cell = cell_row * m + (part.column + c) / texels_a_cell_ - id.x * m;
            const bool present = refined ? leaf_present(tile, id, part.column + c, part.row + r)
                                         : tile.present.empty() || tile.present[static_cast<std::size_t>(cell)] != 0;
            std::uint8_t* texel = texels + 4 * c;
            if (!present)
                std::memset(texel, 0, 4);
            else if (texel[3] < 128)
                std::memcpy(texel, tile.tint.data() + 4 * cell, 4);
            else
                texel[3] = 255;
        }
    }
    return {};
}

Result<void> TexelGround::load(Tile& tile, TileId id) const {
    TileRow row;
    auto found = read_(id, row);
    if (!found) return found.error();
    if (!*found) return Error{ErrorCode::store, fmt::format("height tile {}/{}/{} is missing", id.level, id.x, id.y)};
    auto decoded = decode_height_tile(row.payload, base_.tile_cells_log2, row.codec);
    if (!decoded) return decoded.error();
    tile.present = std::move(decoded->presence);
    const auto m = static_cast<std::size_t>(base_.tile_cells());
    std::vector<double> metres(decoded->samples.size());
    std::transform(decoded->samples.begin(), decoded->samples.end(), metres.begin(),
                   [&](std::int32_t n) { return dataset_.height_m(n); });
    tile.tint.resize(m * m * 4);
    for (std::size_t r = 0; r < m; ++r)
        tint_.row({metres.data() + r * (m + 1), m + 1}, {metres.data() + (r + 1) * (m + 1), m + 1},
                  {tile.tint.data() + r * m * 4, m * 4});
    tile.loaded = true;
    return {};
}

// Walks down from a refined tile: only marks are looked at, but of leaves that lack cells.
Result<void> TexelGround::load_leaves(Tile& tile, TileId id) const {
    std::vector<TileId> open{id};
    TileRow row;
    while (!open.empty()) {
        const TileId at = open.back();
        open.pop_back();
        auto found = read_(at, row);
        if (!found) return found.error();
        const auto marks = *found ? height_marks(row.payload) : std::nullopt;
        if (!marks)
            return Error{ErrorCode::store, fmt::format("height tile {}/{}/{} is missing", at.level, at.x, at.y)};
        if (marks->child_mask != 0) {
            tile.child_masks.emplace(at, marks->child_mask);
            for (int q = 0; q < 4; ++q)
                if ((marks->child_mask >> q & 1) != 0) open.push_back(child_of(at, q));
        } else if (marks->some_absent) {
            auto decoded = decode_height_tile(row.payload, base_.tile_cells_log2, row.codec);
            if (!decoded) return decoded.error();
            tile.leaves.emplace(at, std::move(decoded->presence));
        }
    }
    tile.leaves_loaded = true;
    return {};
}

// The cell, of whichever leaf, that the texel's centre lies in.
bool TexelGround::leaf_present(const Tile& tile, TileId id, std::int64_t column, std::int64_t row) const {
    const Lattice& l = dataset_.lattice;
    const double scale = std::ldexp(1.0, l.deepest_level - base_.deepest_level) / static_cast<double>(texels_a_cell_);
    const auto i = static_cast<std::int64_t>((static_cast<double>(column) + 0.5) * scale),
               j = static_cast<std::int64_t>((static_cast<double>(row) + 0.5) * scale);
    for (auto refined = tile.child_masks.find(id); refined != tile.child_masks.end();
         refined = tile.child_masks.find(id)) {
        const std::int64_t extent = l.tile_extent(id.level + 1);
        id = {id.level + 1, i / extent, j / extent};
        if ((refined->second >> quadrant_of(id) & 1) == 0) return false;
    }
    const auto leaf = tile.leaves.find(id);
    if (leaf == tile.leaves.end()) return true;
    const LatticePoint corner = l.corner(id);
    const std::int64_t step = l.step(id.level);
    return leaf->second[static_cast<std::size_t>((j - corner.j) / step * l.tile_cells() + (i - corner.i) / step)] != 0;
}

// Cells of the leaf under texture tile `id` that hold the centre of a texel of the deepest level.
bool TexelGround::any_present(const HeightTile& tile, TileId leaf, TileId id) const {
    const int n = base_.tile_cells_log2, down = id.level - leaf.level;
    const std::int64_t m = std::int64_t{1} << n;
    const auto first = [&](std::int64_t at, std::int64_t of_leaf) {
        const std::int64_t inside = at - (of_leaf << down);  // tiles like it in the leaf
        return down <= n ? inside << (n - down) : inside >> (down - n);
    };
    const std::int64_t i0 = first(id.x, leaf.x), j0 = first(id.y, leaf.y);
    const std::int64_t side = down <= n ? std::int64_t{1} << (n - down) : 1;
    // A texel of more than a cell: its centre is a corner of cells, and counts as the one east and south of it.
    const int texel_log2 = n - (dataset_.texture_deepest_level - leaf.level) - dataset_.texture_size_log2;
    const auto hit = [&](std::int64_t cell) {
        return texel_log2 <= 0 || (cell & ((std::int64_t{1} << texel_log2) - 1)) == std::int64_t{1} << (texel_log2 - 1);
    };
    for (std::int64_t j = j0; j < j0 + side; ++j)
        for (std::int64_t i = i0; i < i0 + side; ++i)
            if (hit(i) && hit(j) && tile.presence[static_cast<std::size_t>(j * m + i)] != 0) return true;
    return false;
}

Result<bool> TexelGround::shows(TileId id) const {
    const TileId base_tile = ancestor_at(id, base_.deepest_level);
    const HeightIndex::Cells cells = index_.cells(base_tile);
    const bool refined = index_.refined(base_tile);
    if (!refined && cells != HeightIndex::Cells::some) return cells == HeightIndex::Cells::all;
    TileId leaf = base_tile;
    TileRow row;
    for (;;) {
        auto found = read_(leaf, row);
        if (!found) return found.error();
        if (!*found) return false;
        const auto marks = height_marks(row.payload);
        if (!marks || marks->child_mask == 0 || leaf.level >= id.level) break;
        leaf = ancestor_at(id, leaf.level + 1);
    }
    auto tile = decode_height_tile(row.payload, base_.tile_cells_log2, row.codec);
    if (!tile) return tile.error();
    if (tile->presence.empty()) return true;
    return any_present(*tile, leaf, id);
}

}  // namespace scree
