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
#include "tests/common/depth_map.h"

namespace scree::test {
namespace {

struct Ground {
    Lattice lattice;
    std::int64_t width, height;  // padded finest cells
    std::vector<std::int32_t> z;
    std::vector<std::uint8_t> cells;    // valid in the source
    std::vector<std::uint8_t> present;  // finest cells within a present cell of their leaf
    DepthMap depth, texture_depth;

    std::int32_t sample(std::int64_t i, std::int64_t j) const {
        return z[static_cast<std::size_t>(j * (width + 1) + i)];
    }
    bool is_leaf(TileId id) const {
        return depth.exists(id) && (id.level == lattice.deepest_level || !depth.refined(id));
    }
    TileId leaf_over(std::int64_t i, std::int64_t j) const {
        TileId id{lattice.deepest_level, i >> lattice.tile_cells_log2, j >> lattice.tile_cells_log2};
        while (!is_leaf(id)) id = parent_of(id);
        return id;
    }
    bool cell(std::int64_t i, std::int64_t j) const {
        return i >= 0 && j >= 0 && i < width && j < height && present[static_cast<std::size_t>(j * width + i)] != 0;
    }
    // A leaf's cell is present where all of the source is.
    void find_present() {
        present = cells;
        for (std::int64_t j = 0; j < height; ++j)
            for (std::int64_t i = 0; i < width; ++i) {
                const std::int64_t side = lattice.step(leaf_over(i, j).level);
                for (std::int64_t v = j / side * side; v < (j / side + 1) * side; ++v)
                    for (std::int64_t u = i / side * side; u < (i / side + 1) * side; ++u)
                        if (cells[static_cast<std::size_t>(v * width + u)] == 0)
                            present[static_cast<std::size_t>(j * width + i)] = 0;
            }
    }
    bool any_cell(LatticePoint from, std::int64_t extent) const {
        for (std::int64_t j = from.j; j < from.j + extent; ++j)
            for (std::int64_t i = from.i; i < from.i + extent; ++i)
                if (cell(i, j)) return true;
        return false;
    }
    // Height, times the leaf's step, of the finest surface at (i, j) seen from finest cell (ci, cj).
    double surface(std::int64_t ci, std::int64_t cj, std::int64_t i, std::int64_t j) const {
        const TileId leaf = leaf_over(ci, cj);
        const std::int64_t side = lattice.step(leaf.level);
        const std::int64_t wi = ci / side * side, nj = cj / side * side, u = i - wi, v = j - nj;
        const double nw = sample(wi, nj), ne = sample(wi + side, nj), sw = sample(wi, nj + side),
                     se = sample(wi + side, nj + side);
        const auto w = static_cast<double>(side), a = static_cast<double>(u), b = static_cast<double>(v);
        if ((wi / side + nj / side) % 2 == 0)
            return nw + (u > v ? a * (ne - nw) + b * (se - ne) : b * (sw - nw) + a * (se - sw)) / w;
        if (u + v < side) return nw + (a * (ne - nw) + b * (sw - nw)) / w;
        return se + ((w - a) * (sw - se) + (w - b) * (ne - se)) / w;
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
    if (t.varying) {
        Random depths(t.seed);
        g.depth = DepthMap::random(depths, g.lattice, g.lattice.deepest_level, t.graded);
        g.texture_depth = DepthMap::random(depths, g.lattice, t.texture_deepest_level, false);
    }
    g.find_present();
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
                // A vertex counts for the cells inside this tile only, each of which sees its own leaf.
                for (int k = 0; k < 4; ++k) {
                    const std::int64_t ci = i - (k & 1), cj = j - (k >> 1);
                    if (ci < 0 || cj < 0 || ci >= l.tile_extent(id.level) || cj >= l.tile_extent(id.level) ||
                        !ground.cell(corner.i + ci, corner.j + cj))
                        continue;
                    const double drawn =
                        drawn_height(samples, l.tile_cells_log2, {geomip, mask}, i, j, l.step(id.level)).quanta();
                    worst = std::max(
                        worst,
                        std::abs(ground.surface(corner.i + ci, corner.j + cj, corner.i + i, corner.j + j) - drawn));
                }
            }
    return worst;
}

void add_heights(const Ground& ground, SmallStore& store) {
    const Lattice& l = ground.lattice;
    const int m = l.tile_cells();
    int coarsest_leaf = l.deepest_level;
    for (int level = l.deepest_level; level >= 0; --level)
        for (std::int64_t y = 0; y < l.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < l.tiles_x(level); ++x) {
                const TileId id{level, x, y};
                const LatticePoint corner = l.corner(id);
                if (!ground.depth.exists(id) || !ground.any_cell(corner, l.tile_extent(level))) continue;
                const std::int64_t step = l.step(level);
                HeightTile tile;
                tile.header.texture_ends = level < store.dataset.texture_deepest_level &&
                                           !(ground.texture_depth.exists(id) && ground.texture_depth.refined(id));
                for (int j = 0; j <= m; ++j)
                    for (int i = 0; i <= m; ++i)
                        tile.samples.push_back(ground.sample(corner.i + i * step, corner.j + j * step));
                if (ground.is_leaf(id)) {
                    coarsest_leaf = std::min(coarsest_leaf, level);
                    bool all = true;
                    for (int k = 0; k < m * m; ++k) {
                        tile.presence.push_back(ground.cell(corner.i + k % m * step, corner.j + k / m * step) ? 1 : 0);
                        all = all && tile.presence.back() != 0;
                    }
                    store.dataset.present_cells += std::count(tile.presence.begin(), tile.presence.end(), 1);
                    if (all) tile.presence.clear();
                } else {
                    for (int q = 0; q < 4; ++q)
                        if (const auto child = store.heights.find(child_of(id, q)); child != store.heights.end()) {
                            HeightTileHeader& header = tile.header;
                            const HeightTileHeader& below = child->second.header;
                            const bool leaf = below.is_leaf() && level + 1 < l.deepest_level;
                            header.child_mask = static_cast<std::uint8_t>(header.child_mask | 1 << q);
                            header.leaf_mask = static_cast<std::uint8_t>(header.leaf_mask | int{leaf} << q);
                            header.texture_end_mask =
                                static_cast<std::uint8_t>(header.texture_end_mask | int{below.texture_ends} << q);
                        }
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
    if (coarsest_leaf < l.deepest_level) store.dataset.coarsest_leaf_level = coarsest_leaf;
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

// Alpha of a whole texture level, as the deepest textures there have it: by the cells under their texels' centres.
Alpha alpha_by_cells(const Ground& ground, int level, std::int64_t size) {
    const Lattice& l = ground.lattice;
    const std::int64_t width = l.tiles_x(level) * size, height = l.tiles_y(level) * size;
    const double texel_cells = std::ldexp(l.tile_cells(), l.deepest_level - level) / static_cast<double>(size);
    const auto centre = [&](std::int64_t texel) {
        return static_cast<std::int64_t>(std::floor((static_cast<double>(texel) + 0.5) * texel_cells));
    };
    Alpha alpha;
    for (std::int64_t r = 0; r < height; ++r)
        for (std::int64_t c = 0; c < width; ++c) alpha.push_back(ground.cell(centre(c), centre(r)) ? 255 : 0);
    return alpha;
}

void add_textures(const Ground& ground, SmallStore& store) {
    const Lattice& l = ground.lattice;
    const int deepest = store.dataset.texture_deepest_level;
    const std::int64_t size = store.dataset.texture_size();
    const auto side = [&](int level) { return std::pair(l.tiles_x(level) * size, l.tiles_y(level) * size); };
    // Which tiles hold a texel of the deepest level over a present cell.
    const Alpha finest = alpha_by_cells(ground, deepest, size);
    const auto any_opaque = [&](TileId id) {
        const std::int64_t texels = size << (deepest - id.level);
        for (std::int64_t r = id.y * texels; r < (id.y + 1) * texels; ++r)
            for (std::int64_t c = id.x * texels; c < (id.x + 1) * texels; ++c)
                if (finest[static_cast<std::size_t>(r * side(deepest).first + c)] != 0) return true;
        return false;
    };
    const auto wanted = [&](TileId id) {
        if (!ground.texture_depth.exists(id)) return false;
        if (id.level <= l.deepest_level && ground.depth.exists(id)) return store.heights.count(id) != 0;
        return any_opaque(id);
    };
    Alpha below;
    for (int level = deepest; level >= 0; --level) {
        const auto [width, height] = side(level);
        Alpha alpha = alpha_by_cells(ground, level, size);
        if (level < deepest) {
            const Alpha averaged = halved(below, 2 * width, 2 * height);
            for (std::int64_t r = 0; r < height; ++r)
                for (std::int64_t c = 0; c < width; ++c) {
                    const TileId over{level, c / size, r / size};
                    const auto k = static_cast<std::size_t>(r * width + c);
                    if (ground.texture_depth.exists(over) && ground.texture_depth.refined(over)) alpha[k] = averaged[k];
                }
        }
        for (std::int64_t y = 0; y < l.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < l.tiles_x(level); ++x) {
                const TileId id{level, x, y};
                if (!wanted(id)) continue;
                Alpha texels;
                for (std::int64_t r = y * size; r < (y + 1) * size; ++r)
                    for (std::int64_t c = x * size; c < (x + 1) * size; ++c)
                        texels.push_back(alpha[static_cast<std::size_t>(r * width + c)]);
                TextureTile tile = texture_of(texels, store.dataset.texture_size_log2);
                for (int q = 0; q < 4; ++q)
                    if (store.textures.count(child_of(id, q)) != 0)
                        tile.child_mask = static_cast<std::uint8_t>(tile.child_mask | 1 << q);
                store.textures[id] = std::move(tile);
            }
        below = std::move(alpha);
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
        const HeightCodec codec = height_codecs()[static_cast<std::size_t>(row++) % height_codecs().size()].codec;
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
    int coarsest = terrain.texture_deepest_level;
    for (const auto& [id, tile] : store.textures)
        if (terrain.varying && !ground.texture_depth.refined(id)) coarsest = std::min(coarsest, id.level);
    if (coarsest < terrain.texture_deepest_level) store.dataset.coarsest_texture_level = coarsest;
    store.dataset.height_tiles = static_cast<std::int64_t>(store.heights.size());
    store.dataset.texture_tiles = static_cast<std::int64_t>(store.textures.size());
    return store;
}

}  // namespace scree::test
