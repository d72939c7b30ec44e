#include "tests/tools/verify/small_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/mesh/drawn_surface.h"
#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"

namespace scree::test {
namespace {

struct Ground {
    Lattice lattice;
    std::int64_t width, height;  // padded cells
    std::vector<std::int32_t> z;
    std::vector<std::uint8_t> cells;

    std::int32_t sample(std::int64_t i, std::int64_t j) const {
        return z[static_cast<std::size_t>(j * (width + 1) + i)];
    }
    bool cell(std::int64_t i, std::int64_t j) const {
        return i >= 0 && j >= 0 && i < width && j < height && cells[static_cast<std::size_t>(j * width + i)] != 0;
    }
    bool vertex(std::int64_t i, std::int64_t j) const {
        return cell(i, j) || cell(i - 1, j) || cell(i, j - 1) || cell(i - 1, j - 1);
    }
    bool any_cell(LatticePoint from, std::int64_t extent) const {
        for (std::int64_t j = from.j; j < from.j + extent; ++j)
            for (std::int64_t i = from.i; i < from.i + extent; ++i)
                if (cell(i, j)) return true;
        return false;
    }
};

Ground make_ground(const SmallTerrain& t) {
    std::mt19937_64 random(t.seed);
    const auto percent = [&] { return static_cast<int>(random() % 100); };
    Ground g;
    g.lattice = *make_lattice(1000, 2000, 10, t.cells_x, t.cells_y, t.tile_cells_log2);
    g.width = g.lattice.root_columns * g.lattice.tile_extent(0);
    g.height = g.lattice.root_rows * g.lattice.tile_extent(0);
    g.z.resize(static_cast<std::size_t>((g.width + 1) * (g.height + 1)));
    for (auto& z : g.z)
        z = static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(2 * t.amplitude + 1)) - t.amplitude;
    g.cells.assign(static_cast<std::size_t>(g.width * g.height), 0);
    for (std::int64_t pj = 0; pj < t.cells_y; pj += 4)
        for (std::int64_t pi = 0; pi < t.cells_x; pi += 4) {
            const bool patch = percent() < t.present_percent;
            for (std::int64_t j = pj; j < std::min(pj + 4, t.cells_y); ++j)
                for (std::int64_t i = pi; i < std::min(pi + 4, t.cells_x); ++i)
                    g.cells[static_cast<std::size_t>(j * g.width + i)] =
                        patch && (t.present_percent == 100 || percent() < 95) ? 1 : 0;
        }
    g.cells[0] = 1;
    return g;
}

float rounded_up(double v) {
    const float f = static_cast<float>(v);
    return static_cast<double>(f) < v ? std::nextafter(f, std::numeric_limits<float>::max()) : f;
}

double true_error(const Ground& ground, TileId id, const std::vector<std::int32_t>& samples, int geomip) {
    const Lattice& l = ground.lattice;
    const LatticePoint corner = l.corner(id);
    double worst = 0;
    for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
        for (std::int64_t j = 0; j <= l.tile_extent(id.level); ++j)
            for (std::int64_t i = 0; i <= l.tile_extent(id.level); ++i) {
                // A vertex counts for the cells inside this tile only.
                bool present = false;
                for (int k = 0; k < 4; ++k) {
                    const std::int64_t ci = i - (k & 1), cj = j - (k >> 1);
                    present = present || (ci >= 0 && cj >= 0 && ci < l.tile_extent(id.level) &&
                                          cj < l.tile_extent(id.level) && ground.cell(corner.i + ci, corner.j + cj));
                }
                if (!present) continue;
                const double drawn =
                    drawn_height(samples, l.tile_cells_log2, {geomip, mask}, i, j, l.step(id.level)).quanta();
                worst = std::max(worst, std::abs(ground.sample(corner.i + i, corner.j + j) - drawn));
            }
    return worst;
}

void add_heights(const Ground& ground, SmallStore& store) {
    const Lattice& l = ground.lattice;
    const int m = l.tile_cells();
    for (int level = l.deepest_level; level >= 0; --level)
        for (std::int64_t y = 0; y < l.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < l.tiles_x(level); ++x) {
                const TileId id{level, x, y};
                const LatticePoint corner = l.corner(id);
                if (!ground.any_cell(corner, l.tile_extent(level))) continue;
                HeightTile tile;
                for (int j = 0; j <= m; ++j)
                    for (int i = 0; i <= m; ++i)
                        tile.samples.push_back(
                            ground.sample(corner.i + i * l.step(level), corner.j + j * l.step(level)));
                if (level == l.deepest_level) {
                    bool all = true;
                    for (int k = 0; k < m * m; ++k) {
                        tile.presence.push_back(ground.cell(corner.i + k % m, corner.j + k / m) ? 1 : 0);
                        all = all && tile.presence.back() != 0;
                    }
                    store.dataset.present_cells += std::count(tile.presence.begin(), tile.presence.end(), 1);
                    if (all) tile.presence.clear();
                } else {
                    for (int q = 0; q < 4; ++q)
                        if (store.heights.count(child_of(id, q)) != 0)
                            tile.header.child_mask = static_cast<std::uint8_t>(tile.header.child_mask | 1 << q);
                }
                double running = 0;
                for (int g = 0; g < l.tile_cells_log2; ++g) {
                    running = std::max(running, true_error(ground, id, tile.samples, g));
                    for (int q = 0; q < 4 && g + 1 < l.tile_cells_log2; ++q)
                        if ((tile.header.child_mask >> q & 1) != 0)
                            running = std::max<double>(
                                running,
                                store.heights.at(child_of(id, q)).header.own.error_n[static_cast<std::size_t>(g) + 1]);
                    tile.header.own.error_n[static_cast<std::size_t>(g)] = rounded_up(running);
                }
                store.heights[id] = std::move(tile);
            }
}

using Alpha = std::vector<std::uint8_t>;

Alpha halved(const Alpha& fine, std::int64_t width, std::int64_t height) {
    Alpha coarse;
    for (std::int64_t r = 0; r < height; r += 2)
        for (std::int64_t c = 0; c < width; c += 2) {
            const auto at = [&](std::int64_t y, std::int64_t x) {
                return int{fine[static_cast<std::size_t>(y * width + x)]};
            };
            coarse.push_back(
                static_cast<std::uint8_t>((at(r, c) + at(r, c + 1) + at(r + 1, c) + at(r + 1, c + 1) + 2) >> 2));
        }
    return coarse;
}

// BC1 of a square: three-colour blocks, selector 3 where transparent.
void append_bc1(const Alpha& texels, int size, std::vector<std::uint8_t>& out) {
    for (int r = 0; r < std::max(1, size / 4); ++r)
        for (int c = 0; c < std::max(1, size / 4); ++c) {
            std::uint8_t block[8] = {0, 0, 0xFF, 0xFF, 0, 0, 0, 0};
            for (int k = 0; k < 16; ++k) {
                const int y = (4 * r + k / 4) % size, x = (4 * c + k % 4) % size;
                if (texels[static_cast<std::size_t>(y * size + x)] < 128)
                    block[4 + k / 4] = static_cast<std::uint8_t>(block[4 + k / 4] | 3 << (2 * (k % 4)));
            }
            out.insert(out.end(), block, block + 8);
        }
}

TextureTile texture_of(Alpha texels, int size_log2) {
    std::vector<std::vector<std::uint8_t>> mips;
    for (int log2 = size_log2; log2 >= 0; --log2) {
        mips.emplace_back();
        append_bc1(texels, 1 << log2, mips.back());
        if (log2 > 0) texels = halved(texels, 1 << log2, 1 << log2);
    }
    TextureTile tile;
    for (auto mip = mips.rbegin(); mip != mips.rend(); ++mip)
        tile.blocks.insert(tile.blocks.end(), mip->begin(), mip->end());
    return tile;
}

void add_textures(const Ground& ground, SmallStore& store) {
    const Lattice& l = ground.lattice;
    const int deepest = store.dataset.texture_deepest_level;
    const std::int64_t size = store.dataset.texture_size();
    std::int64_t width = l.tiles_x(deepest) * size, height = l.tiles_y(deepest) * size;
    const double texel_cells = std::ldexp(l.tile_cells(), l.deepest_level - deepest) / static_cast<double>(size);
    Alpha alpha;
    for (std::int64_t r = 0; r < height; ++r)
        for (std::int64_t c = 0; c < width; ++c)
            alpha.push_back(
                ground.cell(static_cast<std::int64_t>(std::floor((static_cast<double>(c) + 0.5) * texel_cells)),
                            static_cast<std::int64_t>(std::floor((static_cast<double>(r) + 0.5) * texel_cells)))
                    ? 255
                    : 0);
    for (int level = deepest; level >= 0; --level) {
        for (std::int64_t y = 0; y < l.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < l.tiles_x(level); ++x) {
                const TileId id{level, x, y};
                Alpha texels;
                for (std::int64_t r = y * size; r < (y + 1) * size; ++r)
                    for (std::int64_t c = x * size; c < (x + 1) * size; ++c)
                        texels.push_back(alpha[static_cast<std::size_t>(r * width + c)]);
                const bool opaque = std::any_of(texels.begin(), texels.end(), [](int a) { return a >= 128; });
                if (level <= l.deepest_level ? store.heights.count(id) == 0 : !opaque) continue;
                TextureTile tile = texture_of(texels, store.dataset.texture_size_log2);
                for (int q = 0; q < 4; ++q)
                    if (store.textures.count(child_of(id, q)) != 0)
                        tile.child_mask = static_cast<std::uint8_t>(tile.child_mask | 1 << q);
                store.textures[id] = std::move(tile);
            }
        alpha = halved(alpha, width, height);
        width /= 2;
        height /= 2;
    }
}

}  // namespace

void SmallStore::copy_bounds_to_parents() {
    for (auto& [id, tile] : heights)
        for (int q = 0; q < 4; ++q)
            if (const auto child = heights.find(child_of(id, q)); child != heights.end())
                tile.header.children[static_cast<std::size_t>(q)] = child->second.header.own;
}

void SmallStore::recompute_ranges() {
    for (auto it = heights.rbegin(); it != heights.rend(); ++it) {  // deepest level first
        HeightBounds& own = it->second.header.own;
        own.min_n = *std::min_element(it->second.samples.begin(), it->second.samples.end());
        own.max_n = *std::max_element(it->second.samples.begin(), it->second.samples.end());
        for (int q = 0; q < 4; ++q)
            if (const auto child = heights.find(child_of(it->first, q)); child != heights.end()) {
                own.min_n = std::min(own.min_n, child->second.header.own.min_n);
                own.max_n = std::max(own.max_n, child->second.header.own.max_n);
            }
    }
    copy_bounds_to_parents();
}

void SmallStore::write(const std::string& path) const {
    auto writer = SqliteStoreWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    const Lattice& l = dataset.lattice;
    int row = 0;
    for (const auto& [id, tile] : heights) {
        const auto codec = row++ % 2 == 0 ? HeightCodec::plane : HeightCodec::raw;
        ASSERT_TRUE((*writer)
                        ->put(TileKind::height, *tile_key(l, id), static_cast<int>(codec),
                              encode_height_tile(tile, l.tile_cells_log2, codec))
                        .ok());
    }
    for (const auto& [id, tile] : textures) {
        const auto codec = row++ % 2 == 0 ? TextureCodec::split : TextureCodec::raw;
        ASSERT_TRUE((*writer)
                        ->put(TileKind::texture, *tile_key(l, id), static_cast<int>(codec),
                              encode_texture_tile(tile, dataset.texture_size_log2, codec))
                        .ok());
    }
    ASSERT_TRUE((*writer)->finish(dataset).ok());
}

SmallStore make_small_store(const SmallTerrain& terrain) {
    const Ground ground = make_ground(terrain);
    SmallStore store;
    store.dataset.lattice = ground.lattice;
    store.dataset.height_quantum_m = 0.5;
    store.dataset.texture_size_log2 = terrain.texture_size_log2;
    store.dataset.texture_deepest_level = terrain.texture_deepest_level;
    add_heights(ground, store);
    store.recompute_ranges();
    add_textures(ground, store);
    store.dataset.height_tiles = static_cast<std::int64_t>(store.heights.size());
    store.dataset.texture_tiles = static_cast<std::int64_t>(store.textures.size());
    return store;
}

}  // namespace scree::test
