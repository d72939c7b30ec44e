#include "runtime/view/edge_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

struct Mask {
    std::int64_t columns = 0, rows = 0;
    std::vector<std::uint8_t> present;
    bool is(std::int64_t x, std::int64_t y) const {
        return x >= 0 && y >= 0 && x < columns && y < rows && present[static_cast<std::size_t>(y * columns + x)] != 0;
    }
};

/// Mostly ground, with holes of all sizes.
Mask random_mask(test::Random& random) {
    Mask mask{test::uniform(random, 1, 40), test::uniform(random, 1, 40), {}};
    mask.present.assign(static_cast<std::size_t>(mask.columns * mask.rows), 1);
    for (std::int64_t hole = test::uniform(random, 0, 6); hole > 0; --hole) {
        const std::int64_t x0 = test::uniform(random, 0, static_cast<int>(mask.columns) - 1),
                           y0 = test::uniform(random, 0, static_cast<int>(mask.rows) - 1),
                           w = test::uniform(random, 1, 12), h = test::uniform(random, 1, 12);
        for (std::int64_t y = y0; y < std::min(y0 + h, mask.rows); ++y)
            for (std::int64_t x = x0; x < std::min(x0 + w, mask.columns); ++x)
                mask.present[static_cast<std::size_t>(y * mask.columns + x)] = 0;
    }
    return mask;
}

double brute_distance(const Mask& mask, std::int64_t x, std::int64_t y) {
    double least = 1e9;
    for (std::int64_t j = -1; j <= mask.rows; ++j)
        for (std::int64_t i = -1; i <= mask.columns; ++i)
            if (!mask.is(i, j))
                least = std::min(least, std::hypot(static_cast<double>(i - x), static_cast<double>(j - y)));
    return least;
}

TEST(EdgeField, DistancesAreThoseToTheNearestAbsentCell) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 60; ++round) {
        const Mask mask = random_mask(random);
        const auto most = static_cast<float>(test::uniform(random, 1, 30));
        const auto found = distance_to_absence(mask.present, mask.columns, most);
        for (std::int64_t y = 0; y < mask.rows; ++y)
            for (std::int64_t x = 0; x < mask.columns; ++x) {
                const double exact = brute_distance(mask, x, y);
                const auto d = static_cast<double>(found[static_cast<std::size_t>(y * mask.columns + x)]);
                if (exact <= static_cast<double>(most)) {
                    ASSERT_NEAR(d, exact, 1e-5) << x << ' ' << y;
                } else {
                    ASSERT_GE(d, static_cast<double>(most) - 1e-5) << x << ' ' << y;
                }
            }
    }
}

TEST(EdgeField, NarrowVoidsAreNone) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 60; ++round) {
        const Mask mask = random_mask(random);
        const std::int64_t width = test::uniform(random, 1, 9), reach = width / 2;
        const auto absent_square = [&](std::int64_t x, std::int64_t y) {
            for (std::int64_t j = y; j < y + width; ++j)
                for (std::int64_t i = x; i < x + width; ++i)
                    if (mask.is(i, j)) return false;
            return true;
        };
        const auto found = without_narrow_absence(mask.present, mask.columns, width);
        for (std::int64_t y = 0; y < mask.rows; ++y)
            for (std::int64_t x = 0; x < mask.columns; ++x) {
                bool near = false;
                for (std::int64_t j = y - reach - width + 1; j <= y + reach; ++j)
                    for (std::int64_t i = x - reach - width + 1; i <= x + reach; ++i)
                        near = near || absent_square(i, j);
                ASSERT_EQ(found[static_cast<std::size_t>(y * mask.columns + x)] != 0, mask.is(x, y) || !near)
                    << x << ' ' << y << " width " << width;
            }
    }
}

TEST(EdgeField, IsNothingWhereGroundMayEndAndFarFromItAllThere) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 30; ++round) {
        const Mask mask = random_mask(random);
        const double band = static_cast<double>(test::uniform(random, 2, 12));
        const EdgeField field({6, mask.columns, mask.rows, 1}, mask.present, band);
        for (std::int64_t y = 0; y < mask.rows; ++y)
            for (std::int64_t x = 0; x < mask.columns; ++x) {
                const int value = field.values()[static_cast<std::size_t>(y * mask.columns + x)];
                const double exact = brute_distance(mask, x, y);
                if (exact <= 1) {
                    ASSERT_EQ(value, 0);
                } else if (exact >= band) {
                    ASSERT_EQ(value, EdgeField::kFar);
                } else {
                    ASSERT_NEAR(value, 255 * (exact - 1) / (band - 1), 0.51);
                }
            }
        // A square is near where any of its cells, or of those that values are interpolated with, is.
        for (int depth = 0; depth <= 8; ++depth) {
            const double side = std::ldexp(64.0, -depth);
            for (std::int64_t y = 0; static_cast<double>(y) * side < static_cast<double>(mask.rows); ++y)
                for (std::int64_t x = 0; static_cast<double>(x) * side < static_cast<double>(mask.columns); ++x) {
                    const auto least = [&](double reach) {
                        const auto first = [&](std::int64_t k) {
                            return static_cast<std::int64_t>(std::floor(static_cast<double>(k) * side - reach));
                        };
                        const auto last = [&](std::int64_t k) {
                            return static_cast<std::int64_t>(std::ceil(static_cast<double>(k + 1) * side + reach)) - 1;
                        };
                        int value = EdgeField::kFar;
                        for (std::int64_t j = std::max<std::int64_t>(first(y), 0);
                             j <= std::min(last(y), mask.rows - 1); ++j)
                            for (std::int64_t i = std::max<std::int64_t>(first(x), 0);
                                 i <= std::min(last(x), mask.columns - 1); ++i)
                                value = std::min<int>(value,
                                                      field.values()[static_cast<std::size_t>(j * mask.columns + i)]);
                        return value;
                    };
                    if (least(0.5) < EdgeField::kFar) {
                        ASSERT_TRUE(field.is_near_end(depth, x, y)) << depth << ' ' << x << ' ' << y;
                    }
                    if (least(3) == EdgeField::kFar) {
                        ASSERT_FALSE(field.is_near_end(depth, x, y)) << depth << ' ' << x << ' ' << y;
                    }
                }
        }
    }
}

/// Textures of 16 x 16 texels, some absent.
class AlphaStore final : public TileStore, public TileReader {
public:
    Dataset d;
    std::map<TileId, TextureTile> tiles;

    const Dataset& dataset() const override { return d; }
    Result<std::unique_ptr<TileReader>> open_reader() const override { return {std::make_unique<AlphaStore>(*this)}; }
    Result<bool> read(TileKind kind, TileId id, TileRow& row) override {
        const auto found = tiles.find(id);
        if (kind != TileKind::texture || found == tiles.end()) return false;
        row.codec = static_cast<int>(TextureCodec::raw);
        row.payload = encode_texture_tile(found->second, d.texture_size_log2, TextureCodec::raw);
        return true;
    }
};

template <class Has>
TextureTile texture_with(int size_log2, const Has& has) {
    TextureTile tile;
    for (int mip = size_log2; mip >= 0; --mip) {
        const int size = 1 << (size_log2 - mip), blocks = std::max(size / 4, 1);
        for (int by = 0; by < blocks; ++by)
            for (int bx = 0; bx < blocks; ++bx) {
                std::uint32_t selectors = 0;
                for (int k = 0; k < 16; ++k) {
                    const int x = std::min(4 * bx + k % 4, size - 1), y = std::min(4 * by + k / 4, size - 1);
                    if (!has(((2 * x + 1) << mip) / 2, ((2 * y + 1) << mip) / 2)) selectors |= 3u << (2 * k);
                }
                // Four colours, the last of which is opaque, where nothing is absent.
                const bool whole = selectors == 0;
                if (whole) selectors = 0xffffffffu;
                for (const unsigned endpoint : {whole ? 0x2222u : 0x1111u, whole ? 0x1111u : 0x2222u})
                    for (const unsigned shift : {0u, 8u})
                        tile.blocks.push_back(static_cast<std::uint8_t>(endpoint >> shift));
                for (const unsigned shift : {0u, 8u, 16u, 24u})
                    tile.blocks.push_back(static_cast<std::uint8_t>(selectors >> shift));
            }
    }
    return tile;
}

// Ground is west of a slanted line through both roots; of the texels only the finest, whose level is not whole, tell it
// to a texel.
TEST(EdgeField, ReadsWhatHasGroundOfTheTexturesThereAre) {
    AlphaStore store;
    store.d.lattice = *make_lattice(0, 0, 1, 128, 64, 4);
    store.d.texture_size_log2 = 4;
    store.d.texture_deepest_level = 3;
    const Lattice& l = store.d.lattice;
    ASSERT_EQ(l.root_columns, 2);
    const auto has_ground = [](double x, double y) { return x + 0.5 * y < 70; };
    for (int level = 0; level <= 3; ++level)
        for (std::int64_t y = 0; y < l.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < l.tiles_x(level); ++x) {
                if (level == 3 && x == 6) continue;  // the textures end above
                const double texel = std::ldexp(64.0, -level - 4);
                store.tiles[{level, x, y}] = texture_with(4, [&](int i, int j) {
                    return has_ground((static_cast<double>(16 * x + i) + 0.5) * texel,
                                      (static_cast<double>(16 * y + j) + 0.5) * texel);
                });
            }
    const EdgeField::Shape shape = EdgeField::shape_of(store.d, EdgeField::kMostCells);
    EXPECT_EQ(shape.root_cells_log2, 7);
    EXPECT_EQ(shape.columns, 256);
    EXPECT_EQ(shape.rows, 128);
    EXPECT_EQ(shape.cell_side, 0.5);
    const double band_m = 10;
    const auto field = EdgeField::read(store, band_m, EdgeField::kMostCells);
    ASSERT_NE(field, nullptr);
    for (std::int64_t y = 0; y < shape.rows; ++y)
        for (std::int64_t x = 0; x < shape.columns; ++x) {
            const double px = 0.5 * (static_cast<double>(x) + 0.5), py = 0.5 * (static_cast<double>(y) + 0.5);
            const double inside_m = std::min({px, py, 64 - py, (70 - px - 0.5 * py) / std::hypot(1, 0.5)});
            const int value = field->values()[static_cast<std::size_t>(y * shape.columns + x)];
            if (inside_m < 0) {
                ASSERT_EQ(value, 0) << px << ' ' << py;
            } else {
                const double share = std::clamp(inside_m / band_m, 0.0, 1.0);
                ASSERT_NEAR(value / 255.0, share, 0.11) << px << ' ' << py;
            }
        }
    // Without any texture to read, only the box ends.
    store.tiles.clear();
    const auto box = EdgeField::read(store, band_m, EdgeField::kMostCells);
    EXPECT_EQ(box->values()[static_cast<std::size_t>(64 * shape.columns + 200)], EdgeField::kFar);
    EXPECT_EQ(box->values()[0], 0);
}

TEST(EdgeField, OfAWideDatasetHasNoMoreCellsThanItMay) {
    for (const auto& [x, y] :
         {std::pair<std::int64_t, std::int64_t>{kMaxCellsPerSide, 1}, {1, 3'000'000}, {4097, 4097}, {1, 1}}) {
        const auto lattice = make_lattice(0, 0, 1, x, y, 5);
        if (!lattice) continue;
        Dataset d;
        d.lattice = *lattice;
        d.texture_deepest_level = 20;
        for (const bool of_two : {false, true})
            for (const std::int64_t bytes : {std::int64_t{1} << 16, std::int64_t{1} << 20, std::int64_t{1} << 40}) {
                const auto within = EdgeField::shape_of(d, EdgeField::cells_in(bytes, of_two));
                EXPECT_LE(EdgeField::bytes(within, of_two), std::max<std::int64_t>(bytes, 64 * 10));
            }
        const auto shape = EdgeField::shape_of(d, EdgeField::kMostCells);
        EXPECT_LE(shape.columns * shape.rows, EdgeField::kMostCells);
        EXPECT_GE(static_cast<double>(shape.columns) * shape.cell_side, static_cast<double>(x));
        EXPECT_GE(static_cast<double>(shape.rows) * shape.cell_side, static_cast<double>(y));
        EXPECT_LE(EdgeField::bytes(shape, true), std::int64_t{6} << 20);
    }
}

}  // namespace
}  // namespace scree
