#include "tools/pyramid/texture_pyramid.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tools/pyramid/bc1_encoder.h"
#include "tools/pyramid/texture_filter.h"
#include "tools/pyramid/tile_set.h"

namespace scree {
namespace {

struct Texels {
    std::int64_t width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
    const std::uint8_t* row(std::int64_t y) const { return &rgba[static_cast<std::size_t>(4 * y * width)]; }
    std::uint8_t* at(std::int64_t x, std::int64_t y) { return &rgba[static_cast<std::size_t>(4 * (y * width + x))]; }

    Texels halved() const {
        Texels out{width / 2, height / 2, std::vector<std::uint8_t>(rgba.size() / 4)};
        for (std::int64_t y = 0; y < out.height; ++y)
            downsample_rgba_row(row(2 * y), row(2 * y + 1), out.width, out.at(0, y));
        return out;
    }
};

// Pushes random texels over part of the cells, and keeps the whole finest level padded to the roots as the truth.
class BuiltTextures {
public:
    BuiltTextures(std::int64_t cells_x, std::int64_t cells_y, int tile_cells_log2, int size_log2, int extra_levels,
                  test::Random& random)
        : size_log2_(size_log2), side_(std::int64_t{1} << size_log2) {
        lattice_ = *make_lattice(0, 0, 1, cells_x, cells_y, tile_cells_log2);
        // At least a texel a cell.
        deepest_ = std::max(0, lattice_.deepest_level + tile_cells_log2 - size_log2) + extra_levels;
        Texels finest{lattice_.tiles_x(0) * side_ << deepest_, lattice_.tiles_y(0) * side_ << deepest_, {}};
        finest.rgba.resize(static_cast<std::size_t>(4 * finest.width * finest.height));
        const int texels_log2 = deepest_ + size_log2 - lattice_.deepest_level - tile_cells_log2;  // a cell
        std::vector<std::uint8_t> present(static_cast<std::size_t>(cells_x * cells_y));
        const int patch = test::uniform(random, 1, 12);
        for (std::int64_t j = 0; j < cells_y; ++j)
            for (std::int64_t i = 0; i < cells_x; ++i)
                present[static_cast<std::size_t>(j * cells_x + i)] = ((i / patch * 7 + j / patch * 5) % 3) != 0 ? 1 : 0;
        present[0] = 1;
        tiles_ = TileSet(lattice_, lattice_.deepest_level);
        for (std::int64_t j = 0; j < cells_y; ++j)
            for (std::int64_t i = 0; i < cells_x; ++i) {
                if (present[static_cast<std::size_t>(j * cells_x + i)] == 0) continue;
                for (int level = 0; level <= lattice_.deepest_level; ++level)
                    tiles_.insert({level, i / lattice_.tile_extent(level), j / lattice_.tile_extent(level)});
            }
        auto writer = SqliteStoreWriter::create(folder_.file("s.scree"));
        EXPECT_TRUE(writer);
        levels_[deepest_] = std::move(finest);
        fill(cells_x, cells_y, texels_log2, present, random);
        root_level_ = std::max(0, deepest_ - test::uniform(random, 0, 3));
        build(**writer);
        Dataset d;
        d.lattice = lattice_;
        d.texture_size_log2 = size_log2;
        d.texture_deepest_level = deepest_;
        d.height_tiles = d.present_cells = 1;
        d.texture_tiles = written_;
        const auto ok = (*writer)->finish(d);
        EXPECT_TRUE(ok) << ok.error().message;
        store_ = std::move(*SqliteStore::open(folder_.file("s.scree")));
        reader_ = std::move(*store_->open_reader());
    }

    void check() {
        std::int64_t tiles = 0;
        for (int level = deepest_; level >= root_level_; --level)
            for (std::int64_t y = 0; y < lattice_.tiles_y(level); ++y)
                for (std::int64_t x = 0; x < lattice_.tiles_x(level); ++x) {
                    const TileId id{level, x, y};
                    SCOPED_TRACE("tile " + std::to_string(level) + "/" + std::to_string(x) + "/" + std::to_string(y));
                    TileRow row;
                    auto found = reader_->read(TileKind::texture, id, row);
                    ASSERT_TRUE(found) << found.error().message;
                    ASSERT_EQ(*found, exists(id));
                    if (!exists(id)) continue;
                    ++tiles;
                    check_tile(id);
                    if (::testing::Test::HasFailure()) return;
                }
        EXPECT_EQ(written_, tiles);
    }

private:
    void fill(std::int64_t cells_x, std::int64_t cells_y, int texels_log2, const std::vector<std::uint8_t>& present,
              test::Random& random) {
        Texels& finest = levels_[deepest_];
        for (std::int64_t y = 0; y < cells_y << texels_log2; ++y)
            for (std::int64_t x = 0; x < cells_x << texels_log2; ++x) {
                const std::int64_t i = x >> texels_log2, j = y >> texels_log2;
                if (present[static_cast<std::size_t>(j * cells_x + i)] == 0) continue;
                const std::uint8_t texel[4] = {static_cast<std::uint8_t>(x * 3 + test::uniform(random, 0, 60)),
                                               static_cast<std::uint8_t>(y * 5),
                                               static_cast<std::uint8_t>(test::uniform(random, 0, 255)), 255};
                std::memcpy(finest.at(x, y), texel, 4);
            }
        for (int level = deepest_ - 1; level >= -size_log2_; --level) levels_[level] = levels_[level + 1].halved();
    }
    // Rectangle by rectangle: all at once where the root level is 0 and there is one root.
    void build(SqliteStoreWriter& writer) {
        const std::int64_t columns = (levels_[root_level_].width / side_ + 1) / 2;
        std::int64_t covered = 0;
        for (std::int64_t y = 0; y < levels_[root_level_].height / side_; ++y)
            for (std::int64_t x = 0; x < levels_[root_level_].width / side_; x += columns)
                covered += build(writer, x, y, columns);
        EXPECT_GE(covered, lattice_.cells_x * lattice_.cells_y);
    }
    std::int64_t build(SqliteStoreWriter& writer, std::int64_t x0, std::int64_t y0, std::int64_t columns) {
        TexturePyramidJob job;
        job.lattice = lattice_;
        job.texture_size_log2 = size_log2_;
        job.deepest_level = deepest_;
        job.root_level = root_level_;
        job.first_column = x0;
        job.first_row = y0;
        job.columns = columns;
        job.rows = 1;
        job.stored = [&](TileId id) { return tiles_.contains(id); };
        job.shared_levels = lattice_.deepest_level;
        job.sink = [&](TileId id, const std::vector<std::uint8_t>& payload) {
            return writer.put(TileKind::texture, *tile_key(lattice_, id), static_cast<int>(TextureCodec::split),
                              payload);
        };
        TexturePyramid pyramid(job);
        const auto extent = pyramid.extent();
        EXPECT_EQ(side_ % pyramid.rows_per_push(), 0);
        EXPECT_EQ(extent.columns % side_, 0);
        EXPECT_EQ(extent.rows % side_, 0);
        EXPECT_EQ(extent.first_column, x0 * side_ << (deepest_ - root_level_));
        EXPECT_EQ(extent.first_row, y0 * side_ << (deepest_ - root_level_));
        if (extent.columns == 0 || extent.rows == 0) return 0;
        const std::int64_t step = pyramid.rows_per_push();
        int buffer = 0;
        for (std::int64_t r = 0; r < extent.rows; r += step, buffer = 1 - buffer) {
            for (std::int64_t k = 0; k < step; ++k)
                std::memcpy(pyramid.rows(buffer) + 4 * k * extent.columns,
                            levels_[deepest_].at(extent.first_column, extent.first_row + r + k),
                            static_cast<std::size_t>(4 * extent.columns));
            const auto ok = pyramid.push(buffer);
            EXPECT_TRUE(ok) << ok.error().message;
        }
        auto written = pyramid.finish();
        EXPECT_TRUE(written);
        written_ += *written;
        check_seeds(pyramid, x0, y0);
        return extent.columns * extent.rows;
    }
    void check_seeds(const TexturePyramid& pyramid, std::int64_t x0, std::int64_t y0) {
        const TexturePyramid::Seeds& seeds = pyramid.seeds();
        Texels& level = levels_[root_level_];
        EXPECT_EQ(seeds.rows, side_);
        for (std::int64_t r = 0; r < seeds.rows; ++r)
            EXPECT_EQ(std::memcmp(seeds.rgba.data() + 4 * r * seeds.columns, level.at(x0 * side_, y0 * side_ + r),
                                  static_cast<std::size_t>(4 * seeds.columns)),
                      0);
    }

    bool exists(TileId id) {
        if (id.level > deepest_) return false;
        if (id.level <= lattice_.deepest_level) return tiles_.contains(id);
        Texels& texels = levels_[deepest_];
        const std::int64_t extent = side_ << (deepest_ - id.level);
        for (std::int64_t y = id.y * extent; y < (id.y + 1) * extent; ++y)
            for (std::int64_t x = id.x * extent; x < (id.x + 1) * extent; ++x)
                if (texels.at(x, y)[3] != 0) return true;
        return false;
    }
    void check_tile(TileId id) {
        auto tile = read_texture_tile(*reader_, store_->dataset(), id);
        ASSERT_TRUE(tile) << tile.error().message;
        int child_mask = 0;
        for (int q = 0; q < 4; ++q) child_mask |= exists(child_of(id, q)) ? 1 << q : 0;
        EXPECT_EQ(tile->child_mask, child_mask);
        for (int mip = 0; mip <= size_log2_; ++mip) {
            SCOPED_TRACE("mip " + std::to_string(mip));
            Texels& level = levels_[id.level - mip];
            const std::int64_t side = side_ >> mip, blocks = std::max<std::int64_t>(1, side / 4);
            std::vector<std::uint8_t> want(static_cast<std::size_t>(8 * blocks * blocks));
            for (std::int64_t by = 0; by < blocks; ++by)
                for (std::int64_t bx = 0; bx < blocks; ++bx) {
                    std::uint8_t block[64];
                    for (std::int64_t t = 0; t < 16; ++t)
                        std::memcpy(
                            block + 4 * t,
                            level.at(id.x * side + (4 * bx + t % 4) % side, id.y * side + (4 * by + t / 4) % side), 4);
                    encode_bc1_row(block, 16, 1, &want[static_cast<std::size_t>(8 * (by * blocks + bx))]);
                }
            const std::uint8_t* found = tile->blocks.data() + bc1_mip_offset(size_log2_, mip);
            ASSERT_EQ(std::memcmp(found, want.data(), want.size()), 0);
            if (mip == 0 || side < 4 || id.level - mip < root_level_) continue;
            // The same blocks as in the ancestor's own finest mip.
            auto ancestor = read_texture_tile(*reader_, store_->dataset(), ancestor_at(id, id.level - mip));
            ASSERT_TRUE(ancestor) << ancestor.error().message;
            const std::uint8_t* base = ancestor->blocks.data() + bc1_mip_offset(size_log2_, 0);
            const std::int64_t part = (std::int64_t{1} << mip) - 1, pitch = side_ / 4;
            for (std::int64_t r = 0; r < blocks; ++r)
                ASSERT_EQ(std::memcmp(found + 8 * r * blocks,
                                      base + 8 * (((id.y & part) * blocks + r) * pitch + (id.x & part) * blocks),
                                      static_cast<std::size_t>(8 * blocks)),
                          0);
        }
    }

    test::TemporaryFolder folder_;
    int size_log2_, deepest_ = 0, root_level_ = 0;
    std::int64_t side_;
    Lattice lattice_;
    TileSet tiles_;
    std::int64_t written_ = 0;
    std::unique_ptr<SqliteStore> store_;
    std::unique_ptr<TileReader> reader_;
    std::map<int, Texels> levels_;
};

TEST(TexturePyramid, EveryMipOfEveryTileIsTheFilteredRaster) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 80 && !HasFailure(); ++round) {
        const int cells_x = test::uniform(random, 1, 70), cells_y = test::uniform(random, 1, 70),
                  n = test::uniform(random, 2, 4);
        const int size_log2 = test::uniform(random, 4, 5), extra = test::uniform(random, 0, 2);
        SCOPED_TRACE(std::to_string(cells_x) + " x " + std::to_string(cells_y) + " cells, tiles of " +
                     std::to_string(1 << n) + " cells and " + std::to_string(1 << size_log2) + " texels, " +
                     std::to_string(extra) + " more levels");
        BuiltTextures(cells_x, cells_y, n, size_log2, extra, random).check();
    }
}

TEST(TexturePyramid, ThinShapesWithManyRoots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    for (const auto& [x, y] : {std::pair{1, 1}, {1, 100}, {100, 1}, {5, 64}, {129, 3}, {16, 16}}) {
        SCOPED_TRACE(std::to_string(x) + " x " + std::to_string(y));
        BuiltTextures(x, y, 2, 4, 0, random).check();
        BuiltTextures(x, y, 2, 4, 1, random).check();
    }
}

TEST(TexturePyramid, TexturesMuchDeeperThanHeights) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 2);
    BuiltTextures(9, 13, 4, 4, 4, random).check();
    BuiltTextures(3, 2, 2, 5, 3, random).check();
}

TEST(TexturePyramid, LargeTilesTakeSixteenRowsAPush) {
    test::Random random(test::seed() + 3);
    BuiltTextures(90, 75, 5, 8, 0, random).check();
}

}  // namespace
}  // namespace scree
