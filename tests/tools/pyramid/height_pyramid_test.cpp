#include "tools/pyramid/height_pyramid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/geometric_error.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

HeightPyramidJob job_of(HeightSpool& spool, TileWriter& writer, const Lattice& lattice,
                        const HeightQuantizer& quantizer) {
    HeightPyramidJob job;
    job.spool = &spool;
    job.writer = &writer;
    job.lattice = lattice;
    job.quantizer = quantizer;
    return job;
}

// A small DEM, spooled and built; beside it the truth, sample by sample.
class BuiltPyramid {
public:
    BuiltPyramid(std::int64_t width, std::int64_t height, int tile_cells_log2, int void_percent, test::Random& random)
        : width_(width), height_(height) {
        lattice_ = *make_lattice(0, 0, 1, width - 1, height - 1, tile_cells_log2);
        auto spool = HeightSpool::create(folder_.file("heights"), width, height, false);
        EXPECT_TRUE(spool);
        const int patch = test::uniform(random, 1, 9);
        std::vector<std::uint8_t> patches(static_cast<std::size_t>((width / patch + 1) * (height / patch + 1)));
        for (auto& p : patches) p = test::uniform(random, 0, 99) < void_percent ? 1 : 0;
        std::vector<double> row(static_cast<std::size_t>(width));
        for (std::int64_t j = 0; j < height; ++j) {
            for (std::int64_t i = 0; i < width; ++i) {
                const bool absent = patches[static_cast<std::size_t>(j / patch * (width / patch + 1) + i / patch)] != 0;
                row[static_cast<std::size_t>(i)] =
                    absent ? kVoid
                           : std::round(40 * std::sin(0.05 * static_cast<double>(i * i + 3 * j))) +
                                 test::uniform(random, -20, 20);
            }
            EXPECT_TRUE((*spool)->append(row));
        }
        usable_ = (*spool)->finish().ok();
        if (!usable_) return;
        values_.resize(static_cast<std::size_t>(width * height));
        valid_.resize(values_.size());
        for (std::int64_t j = 0; j < height; ++j) {
            std::vector<std::uint8_t> valid(static_cast<std::size_t>(width));
            EXPECT_TRUE((*spool)->read_row(j, row, valid));
            for (std::int64_t i = 0; i < width; ++i) {
                values_[static_cast<std::size_t>(j * width + i)] =
                    quantizer_.quantize(row[static_cast<std::size_t>(i)]);
                valid_[static_cast<std::size_t>(j * width + i)] = valid[static_cast<std::size_t>(i)];
            }
        }
        auto writer = SqliteStoreWriter::create(folder_.file("s.scree"));
        EXPECT_TRUE(writer);
        TileWriter tiles(**writer);
        HeightPyramidJob job = job_of(**spool, tiles, lattice_, quantizer_);
        index_ = std::make_unique<HeightIndex>(lattice_, lattice_.deepest_level);
        job.index = index_.get();
        auto built = build_height_pyramid(job);
        EXPECT_TRUE(built);
        EXPECT_TRUE(tiles.flush());
        result_ = *built;
        if (result_.tile_count == 0) return;
        Dataset d;
        d.lattice = lattice_;
        d.height_quantum_m = quantizer_.quantum_m;
        d.height_tiles = result_.tile_count;
        d.present_cells = result_.present_cells;
        d.min_height_m = d.height_m(result_.min_n);
        d.max_height_m = d.height_m(result_.max_n);
        d.texture_tiles = 1;
        const auto ok = (*writer)->finish(d);
        EXPECT_TRUE(ok) << ok.error().message;
        auto store = SqliteStore::open(folder_.file("s.scree"));
        EXPECT_TRUE(store) << (store ? "" : store.error().message);
        if (store) {
            store_ = std::move(*store);
            reader_ = std::move(*store_->open_reader());
        }
    }

    void check() {
        if (!usable_) return;
        std::int64_t tiles = 0;
        for (int level = lattice_.deepest_level; level >= 0; --level)
            for (std::int64_t y = 0; y < lattice_.tiles_y(level); ++y)
                for (std::int64_t x = 0; x < lattice_.tiles_x(level); ++x) {
                    const TileId id{level, x, y};
                    SCOPED_TRACE("tile " + std::to_string(level) + "/" + std::to_string(x) + "/" + std::to_string(y));
                    ASSERT_EQ(index_->stored(id), has_present_cell(id));
                    if (!has_present_cell(id)) continue;
                    ++tiles;
                    check_tile(id);
                    if (::testing::Test::HasFailure()) return;
                }
        EXPECT_EQ(result_.tile_count, tiles);
        std::int64_t cells = 0;
        std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = -low;
        for (std::int64_t j = 0; j < height_; ++j)
            for (std::int64_t i = 0; i < width_; ++i) {
                cells += present(i, j) ? 1 : 0;
                if (valid_[static_cast<std::size_t>(j * width_ + i)] == 0) continue;
                low = std::min(low, sample(i, j));
                high = std::max(high, sample(i, j));
            }
        EXPECT_EQ(result_.present_cells, cells);
        EXPECT_EQ(result_.min_n, low);
        EXPECT_EQ(result_.max_n, high);
    }

private:
    std::int32_t sample(std::int64_t i, std::int64_t j) const {
        return values_[static_cast<std::size_t>(std::min(j, height_ - 1) * width_ + std::min(i, width_ - 1))];
    }
    bool valid(std::int64_t i, std::int64_t j) const { return valid_[static_cast<std::size_t>(j * width_ + i)] != 0; }
    bool present(std::int64_t i, std::int64_t j) const {
        return i + 1 < width_ && j + 1 < height_ && valid(i, j) && valid(i + 1, j) && valid(i, j + 1) &&
               valid(i + 1, j + 1);
    }
    bool has_present_cell(TileId id) const {
        const LatticePoint c = lattice_.corner(id);
        const std::int64_t extent = lattice_.tile_extent(id.level);
        for (std::int64_t j = c.j; j < std::min(c.j + extent, height_ - 1); ++j)
            for (std::int64_t i = c.i; i < std::min(c.i + extent, width_ - 1); ++i)
                if (present(i, j)) return true;
        return false;
    }
    // Largest distance of the tile's surface at one geomip level from the finest vertices of present cells, any mask.
    double error(TileId id, int geomip, const std::vector<std::int32_t>& samples) const {
        const LatticePoint c = lattice_.corner(id);
        const std::int64_t extent = lattice_.tile_extent(id.level), step = lattice_.step(id.level);
        double worst = 0;
        for (std::int64_t j = c.j; j <= c.j + extent; ++j)
            for (std::int64_t i = c.i; i <= c.i + extent; ++i) {
                bool used = false;  // by a present cell of this extent
                for (const auto& [di, dj] : {std::pair{-1, -1}, {0, -1}, {-1, 0}, {0, 0}}) {
                    const std::int64_t ci = i + di, cj = j + dj;
                    used = used || (ci >= c.i && cj >= c.j && ci < c.i + extent && cj < c.j + extent &&
                                    ci < width_ - 1 && cj < height_ - 1 && present(ci, cj));
                }
                if (!used) continue;
                for (unsigned mask = 0; mask < 16; ++mask) {
                    const ExactHeight z =
                        drawn_height(samples, lattice_.tile_cells_log2, {geomip, mask}, i - c.i, j - c.j, step);
                    worst = std::max(worst, std::abs(z.quanta() - sample(i, j)));
                }
            }
        return worst;
    }
    void check_tile(TileId id) {
        auto tile = read_height_tile(*reader_, store_->dataset(), id);
        ASSERT_TRUE(tile) << tile.error().message;
        const int n = lattice_.tile_cells_log2;
        const std::int64_t m = lattice_.tile_cells(), step = lattice_.step(id.level);
        const LatticePoint c = lattice_.corner(id);
        HeightBounds want;
        want.min_n = std::numeric_limits<std::int32_t>::max();
        want.max_n = -want.min_n;
        for (std::int64_t r = 0; r <= m; ++r)
            for (std::int64_t k = 0; k <= m; ++k) {
                const std::int32_t z = sample(c.i + k * step, c.j + r * step);
                ASSERT_EQ(tile->samples[static_cast<std::size_t>(r * (m + 1) + k)], z) << "sample " << k << ", " << r;
                want.min_n = std::min(want.min_n, z);
                want.max_n = std::max(want.max_n, z);
            }
        const bool deepest = id.level == lattice_.deepest_level;
        if (deepest) {
            EXPECT_EQ(index_->cells(id), tile->presence.empty() ? HeightIndex::Cells::all : HeightIndex::Cells::some);
            EXPECT_FALSE(index_->refined(id));
        }
        if (deepest)
            for (std::int64_t r = 0; r < m; ++r)
                for (std::int64_t k = 0; k < m; ++k) {
                    const bool stored =
                        tile->presence.empty() || tile->presence[static_cast<std::size_t>(r * m + k)] != 0;
                    ASSERT_EQ(stored, c.i + k < width_ && c.j + r < height_ && present(c.i + k, c.j + r))
                        << "cell " << k << ", " << r;
                }
        int child_mask = 0;
        for (int q = 0; q < 4 && !deepest; ++q) {
            if (!has_present_cell(child_of(id, q))) continue;
            child_mask |= 1 << q;
            const HeightBounds& child = bounds_.at(child_of(id, q));
            EXPECT_EQ(tile->header.children[static_cast<std::size_t>(q)], child);
            want.min_n = std::min(want.min_n, child.min_n);
            want.max_n = std::max(want.max_n, child.max_n);
        }
        EXPECT_EQ(tile->header.child_mask, child_mask);
        double running = 0;
        for (int g = 0; g < n; ++g) {
            double worst = 0;
            if (deepest || g == n - 1)
                worst = error(id, g, tile->samples);
            else
                for (int q = 0; q < 4; ++q)
                    if ((child_mask >> q & 1) != 0)
                        worst = std::max<double>(worst,
                                                 bounds_.at(child_of(id, q)).error_n[static_cast<std::size_t>(g + 1)]);
            running = round_up_to_float(std::max(1.25 * running, worst));
            want.error_n[static_cast<std::size_t>(g)] = static_cast<float>(running);
            // Whatever the rule, the bound must hold for the surface itself.
            EXPECT_GE(want.error_n[static_cast<std::size_t>(g)], error(id, g, tile->samples));
        }
        EXPECT_EQ(tile->header.own, want);
        bounds_[id] = want;
    }

    test::TemporaryFolder folder_;
    std::int64_t width_, height_;
    Lattice lattice_;
    HeightQuantizer quantizer_{1, 0, 0, 1};
    bool usable_ = false;
    std::vector<std::int32_t> values_;
    std::vector<std::uint8_t> valid_;
    HeightPyramidResult result_;
    std::unique_ptr<HeightIndex> index_;
    std::unique_ptr<SqliteStore> store_;
    std::unique_ptr<TileReader> reader_;
    std::map<TileId, HeightBounds> bounds_;
};

TEST(HeightPyramid, SmallTerrainsEqualBruteForceTileByTile) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 120 && !HasFailure(); ++round) {
        const int width = test::uniform(random, 2, 40), height = test::uniform(random, 2, 40),
                  n = test::uniform(random, 2, 4);
        const int voids = round % 3 == 0 ? 0 : test::uniform(random, 5, 95);
        SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height) + ", tiles of " + std::to_string(1 << n) +
                     ", voids " + std::to_string(voids) + " %");
        BuiltPyramid(width, height, n, voids, random).check();
    }
}

// More tiles than a thread takes at once, several levels over each.
TEST(HeightPyramid, WideTerrainsEqualBruteForceToo) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 2);
    BuiltPyramid(300, 70, 3, 0, random).check();
    BuiltPyramid(300, 70, 3, 40, random).check();
    BuiltPyramid(150, 20, 2, 10, random).check();
}

TEST(HeightPyramid, ThinTerrainsHaveManyRoots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    for (const auto& [width, height] : {std::pair{2, 131}, {131, 2}, {200, 7}, {6, 90}, {2, 2}, {5, 5}, {6, 5}}) {
        SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
        BuiltPyramid(width, height, 2, 0, random).check();
        BuiltPyramid(width, height, 2, 30, random).check();
    }
}

TEST(HeightPyramid, ErrorsOfTheGreatestReliefStayWithinTheFormat) {
    constexpr int kSamples = 258;
    const test::TemporaryFolder folder;
    auto spool = HeightSpool::create(folder.file("heights"), kSamples, kSamples, false);
    ASSERT_TRUE(spool);
    for (int j = 0; j < kSamples; ++j) {
        std::vector<double> row;
        for (int i = 0; i < kSamples; ++i) row.push_back((i + j) % 2 == 0 ? kMaxHeightUnits : -kMaxHeightUnits);
        ASSERT_TRUE((*spool)->append(row));
    }
    ASSERT_TRUE((*spool)->finish());
    auto writer = SqliteStoreWriter::create(folder.file("s.scree"));
    ASSERT_TRUE(writer);
    const Lattice lattice = *make_lattice(0, 0, 1, kSamples - 1, kSamples - 1, 2);
    TileWriter tiles(**writer);
    auto built = build_height_pyramid(job_of(**spool, tiles, lattice, {1, 0, 0, 1}));
    ASSERT_TRUE(built) << built.error().message;
    ASSERT_TRUE(tiles.flush());
    Dataset dataset;
    dataset.lattice = lattice;
    dataset.height_tiles = built->tile_count;
    dataset.present_cells = built->present_cells;
    dataset.min_height_m = built->min_n;
    dataset.max_height_m = built->max_n;
    dataset.texture_tiles = 1;
    ASSERT_TRUE((*writer)->finish(dataset));
    auto store = SqliteStore::open(folder.file("s.scree"));
    ASSERT_TRUE(store) << store.error().message;
    auto reader = (*store)->open_reader();
    ASSERT_TRUE(reader);
    auto root = read_height_tile(**reader, dataset, {0, 0, 0});
    ASSERT_TRUE(root) << root.error().message;
    EXPECT_EQ(root->header.own.error_n[1], kMaxErrorUnits);
}

TEST(HeightPyramid, StopsWhenAsked) {
    const test::TemporaryFolder folder;
    auto spool = HeightSpool::create(folder.file("heights"), 20, 20, false);
    ASSERT_TRUE(spool);
    const std::vector<double> row(20, 1.0);
    for (int j = 0; j < 20; ++j) ASSERT_TRUE((*spool)->append(row));
    ASSERT_TRUE((*spool)->finish());
    auto writer = SqliteStoreWriter::create(folder.file("s.scree"));
    ASSERT_TRUE(writer);
    std::int64_t seen = 0;
    TileWriter tiles(**writer);
    HeightPyramidJob job = job_of(**spool, tiles, *make_lattice(0, 0, 1, 19, 19, 2), {1, 0, 0, 1});
    job.on_rows = [&](std::int64_t rows) {
        seen = rows;
        return rows < 7;
    };
    auto built = build_height_pyramid(job);
    ASSERT_FALSE(built);
    EXPECT_EQ(built.error().code, ErrorCode::interrupted);
    EXPECT_EQ(seen, 7);
}

}  // namespace
}  // namespace scree
