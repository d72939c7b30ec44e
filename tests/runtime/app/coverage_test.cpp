#include "runtime/app/coverage.h"

#include <gtest/gtest.h>

#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

class Coverage : public testing::Test {
protected:
    Coverage() : terrain_(shape(), test::rough_heights(4, 600)), residency_(terrain_), selector_(terrain_.dataset()) {
        residency_.add_all();
        const Lattice& l = terrain_.lattice();
        camera_ = *look_at({l.x_m(30), l.y_m(30), 3000}, {l.x_m(30), l.y_m(30), 0}, 40, 800, 800);
        draws_ = selector_.select({&camera_, 1}, test::with_tau(1), residency_).draws[0];
    }
    static test::TerrainShape shape() {
        test::TerrainShape s;
        s.cells_x = 61;  // the last column of tiles holds 5 of its 8 cells
        s.cells_y = 64;
        return s;
    }
    std::int64_t holes(const DrawList& draws) const {
        return count_holes(terrain_.dataset(), residency_, camera_, draws);
    }
    std::int64_t cells(TileId id) const {
        const std::int64_t extent = terrain_.lattice().tile_extent(id.level), west = id.x * extent;
        return (std::min<std::int64_t>(west + extent, 61) - west) * extent;
    }

    test::SyntheticTerrain terrain_;
    test::FakeResidency residency_;
    Selector selector_;
    Camera camera_;
    DrawList draws_;
};

TEST_F(Coverage, OfACompleteFrameIsWhole) {
    ASSERT_GT(draws_.size(), 10u);
    EXPECT_EQ(holes(draws_), 0);
}

TEST_F(Coverage, CountsTheCellsOfEachMissingNode) {
    for (std::size_t k = 0; k < draws_.size(); ++k) {
        DrawList fewer = draws_;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
        EXPECT_EQ(holes(fewer), cells(draws_[k].tile));
    }
    EXPECT_EQ(holes({}), 61 * 64);
}

TEST_F(Coverage, CountsTheCellsOfEachNodeDrawnTwice) {
    for (std::size_t k = 0; k < draws_.size(); ++k) {
        DrawList more = draws_;
        more.push_back(draws_[k]);
        EXPECT_EQ(holes(more), cells(draws_[k].tile));
    }
}

TEST_F(Coverage, CountsTheCellsOfANodeDrawnOverItsOwnParts) {
    for (const DrawItem& item : draws_) {
        if (item.tile.level == 0) continue;
        DrawList more = draws_;
        DrawItem over = item;
        over.tile = parent_of(item.tile);
        more.push_back(over);
        std::int64_t under = 0;
        for (const DrawItem& other : draws_)
            under += other.tile.level > over.tile.level && ancestor_at(other.tile, over.tile.level) == over.tile
                         ? cells(other.tile)
                         : 0;
        EXPECT_EQ(holes(more), under);
    }
}

TEST_F(Coverage, DoesNotMissWhatIsOutOfViewOrAbsent) {
    const Lattice& l = terrain_.lattice();
    const Camera away = *look_at({l.x_m(30), l.y_m(30), 3000}, {l.x_m(30), l.y_m(30), 6000}, 40, 800, 800);
    EXPECT_EQ(count_holes(terrain_.dataset(), residency_, away, {}), 0);
    const test::SyntheticTerrain half(shape(), test::rough_heights(4, 600),
                                      [](std::int64_t i, std::int64_t) { return i < 32; });
    test::FakeResidency all(half);
    all.add_all();
    EXPECT_EQ(count_holes(half.dataset(), all, camera_, {}), 32 * 64);
}

}  // namespace
}  // namespace scree
