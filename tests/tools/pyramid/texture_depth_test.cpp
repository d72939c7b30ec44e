#include "tools/pyramid/texture_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/common/test_support.h"

namespace scree {
namespace {

struct Mark {
    double west, north, east, south;
    int level;
};

// By the definition: tile by tile.
class Defined {
public:
    Defined(const Lattice& lattice, int least, std::vector<Mark> marks)
        : lattice_(lattice), least_(least), marks_(std::move(marks)) {}
    double side(int level) const {
        return std::ldexp(static_cast<double>(lattice_.tile_cells()), lattice_.deepest_level - level);
    }
    bool over_data(TileId id) const {
        return static_cast<double>(id.x) * side(id.level) < static_cast<double>(lattice_.cells_x) &&
               static_cast<double>(id.y) * side(id.level) < static_cast<double>(lattice_.cells_y);
    }
    bool touches(const Mark& m, TileId id) const {
        const double s = side(id.level), west = s * static_cast<double>(id.x), north = s * static_cast<double>(id.y);
        return m.west < west + s && m.east > west && m.north < north + s && m.south > north &&
               m.west < static_cast<double>(lattice_.cells_x) && m.north < static_cast<double>(lattice_.cells_y);
    }
    bool refined(TileId id) const {
        return over_data(id) && (id.level < least_ || std::any_of(marks_.begin(), marks_.end(), [&](const Mark& m) {
                                     return m.level > id.level && touches(m, id);
                                 }));
    }

private:
    Lattice lattice_;
    int least_;
    std::vector<Mark> marks_;
};

std::vector<std::int64_t> listed(const TextureDepth::Runs& runs) {
    std::vector<std::int64_t> all;
    for (const auto& [begin, end] : runs) {
        EXPECT_LT(begin, end);
        EXPECT_TRUE(all.empty() || all.back() < begin) << "in order";
        for (std::int64_t x = begin; x < end; ++x) all.push_back(x);
    }
    return all;
}

TEST(TextureDepth, RefinesWhatMarksTouchAndNothingElse) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int varying = 0, seeded = 0;
    for (int round = 0; round < 25 && !::testing::Test::HasFailure(); ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        const Lattice lattice = *make_lattice(0, 0, 1, test::uniform(random, 5, 90), test::uniform(random, 5, 90), 2);
        const int least = test::uniform(random, 0, 3);
        TextureDepth depth(lattice, 4, least);
        std::vector<Mark> marks;
        for (int k = test::uniform(random, 0, 4); k > 0; --k) {
            // A quarter cell from any tile's border, which a texel's share of slack may not pass.
            const auto at = [&](int most) { return test::uniform(random, -10, most) + 0.25; };
            const double west = at(80), north = at(80);
            marks.push_back({west, north, west + test::uniform(random, 1, 60), north + test::uniform(random, 1, 60),
                             test::uniform(random, 0, 8)});
            if (k == 4) marks.back() = {-1, -1, 100, 100, test::uniform(random, 2, 6)};
            depth.mark(marks.back().west, marks.back().north, marks.back().east, marks.back().south,
                       marks.back().level);
        }
        depth.finish();
        const Defined defined(lattice, least, marks);
        int deepest = least, coarsest = -1;
        for (int level = 0; level <= 9; ++level)
            for (std::int64_t y = 0; y < depth.rows(level); ++y)
                for (std::int64_t x = 0; x < depth.columns(level); ++x) {
                    const TileId id{level, x, y};
                    ASSERT_EQ(depth.refined(id), defined.refined(id)) << level << "/" << x << "/" << y;
                    if (defined.refined(id)) deepest = std::max(deepest, level + 1);
                    if (!defined.refined(id) && coarsest < 0) coarsest = level;
                }
        EXPECT_EQ(depth.deepest(), deepest);
        EXPECT_EQ(depth.coarsest(), coarsest);
        varying += depth.varies();
        for (int level = 0; level <= deepest; ++level) {
            std::int64_t count = 0;
            for (std::int64_t y = 0; y < depth.rows(level); ++y) {
                const std::int64_t begin = test::uniform(random, 0, 3), end = depth.columns(level) - begin / 2;
                std::vector<std::int64_t> refined, there, leaves;
                for (std::int64_t x = 0; x < depth.columns(level); ++x) {
                    const TileId id{level, x, y};
                    const bool exists = level == 0 || defined.refined(parent_of(id));
                    count += exists;
                    if (x < begin || x >= end) continue;
                    if (exists) there.push_back(x);
                    if (defined.refined(id)) refined.push_back(x);
                    if (exists && !defined.refined(id)) leaves.push_back(x);
                }
                EXPECT_EQ(listed(depth.runs(level, y, begin, end)), there);
                EXPECT_EQ(listed(depth.refined_runs(level, y, begin, end)), refined);
                EXPECT_EQ(listed(depth.leaf_runs(level, y, begin, end)), leaves);
            }
            EXPECT_EQ(depth.count(level), count);
        }
        for (std::int64_t y = 0; y < depth.rows(coarsest); ++y)
            for (std::int64_t x = 0; x < depth.columns(coarsest); ++x) {
                int under = coarsest;
                for (int level = coarsest; level < deepest; ++level)
                    for (std::int64_t j = y << (level - coarsest); j < (y + 1) << (level - coarsest); ++j)
                        for (std::int64_t i = x << (level - coarsest); i < (x + 1) << (level - coarsest); ++i)
                            if (defined.refined({level, i, j})) under = level + 1;
                EXPECT_EQ(depth.deepest_under(coarsest, y, x, x + 1), under);
                EXPECT_EQ(depth.seeded({coarsest, x, y}), under >= coarsest + 4);
                seeded += under >= coarsest + 4;
            }
    }
    EXPECT_GT(varying, 5);
    EXPECT_GT(seeded, 5);
}

TEST(TextureDepth, ABorderOnATilesBorderIsNoReasonToRefineBeyondIt) {
    const Lattice lattice = *make_lattice(0, 0, 1, 64, 64, 2);
    TextureDepth depth(lattice, 4, 2);
    depth.mark(16 - 1e-9, 16 - 1e-9, 32 + 1e-9, 32 + 1e-9, 5);
    depth.finish();
    EXPECT_EQ(depth.count(5), 16 * 16 / 2 / 2) << "texture tiles of 2 x 2 cells";
}

}  // namespace
}  // namespace scree
