// What verify says of sound stores: nothing.
#include "tools/verify/verify.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/test_support.h"
#include "tests/tools/verify/small_store.h"
#include "tools/source/crs.h"
#include "tools/source/geo_grid_maker.h"
#include "tools/verify/geo_check.h"

namespace scree {
namespace {

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    return text;
}

VerifyReport verify(const test::SmallStore& store) {
    const test::TemporaryFolder folder;
    store.write(folder.file("store.scree"));
    const auto report = verify_store(folder.file("store.scree"));
    EXPECT_TRUE(report.ok()) << report.error().message;
    return report.ok() ? *report : VerifyReport{};
}

void expect_sound(const test::SmallTerrain& terrain) {
    const test::SmallStore store = test::make_small_store(terrain);
    const VerifyReport report = verify(store);
    EXPECT_TRUE(report.sound()) << joined(report.problems);
    EXPECT_EQ(report.tiles_checked, static_cast<std::int64_t>(store.heights.size() + store.textures.size()));
    EXPECT_GT(report.bounds_checked, 0);
}

test::SmallStore store_in_taiwan() {
    test::SmallStore store = test::make_small_store({.cells_x = 16, .cells_y = 12});
    Dataset& d = store.dataset;
    d.lattice.origin_x_m = 300000;
    d.lattice.origin_y_m = 2770000;
    d.crs = "EPSG:32651";
    d.geo_grid = make_geo_grid(d.lattice, d.crs);
    EXPECT_TRUE(d.geo_grid);
    return store;
}

TEST(VerifyLonLat, IsMeasuredAnewAndWithinWhatIsStated) {
    const test::SmallStore store = store_in_taiwan();
    const VerifyReport report = verify(store);
    EXPECT_TRUE(report.sound()) << joined(report.problems);
    ASSERT_TRUE(report.lon_lat.error_m);
    EXPECT_EQ(report.lon_lat.reason, "");
    EXPECT_GT(*report.lon_lat.error_m, 0);
    EXPECT_LE(*report.lon_lat.error_m, store.dataset.geo_grid->error_m);
}

TEST(VerifyLonLat, AGridThatIsElsewhereIsAProblem) {
    test::SmallStore store = store_in_taiwan();
    for (double& side : store.dataset.geo_grid->box_m) side += 0.1;
    const VerifyReport report = verify(store);
    EXPECT_FALSE(report.sound());
    ASSERT_TRUE(report.lon_lat.error_m);
    EXPECT_NEAR(*report.lon_lat.error_m, std::sqrt(0.02), 0.01);
    ASSERT_EQ(report.problems.size(), 1u);
    EXPECT_NE(report.problems[0].find("longitudes and latitudes are off by 0.1"), std::string::npos)
        << report.problems[0];
}

TEST(VerifyLonLat, MayBeATenthMoreThanIsStated) {
    test::SmallStore store = store_in_taiwan();
    for (double& side : store.dataset.geo_grid->box_m) side += 0.1;
    const GeoCheck moved = check_geo_grid(store.dataset);
    ASSERT_TRUE(moved.error_m);
    const double least = (*moved.error_m - 0.001) / 1.1;
    store.dataset.geo_grid->error_m = least * 1.001;
    EXPECT_FALSE(check_geo_grid(store.dataset).broken);
    store.dataset.geo_grid->error_m = least * 0.999;
    EXPECT_TRUE(check_geo_grid(store.dataset).broken);
}

// Two machines may have two shifts from a datum to WGS 84, each as far from the truth as PROJ says.
TEST(VerifyLonLat, LeavesRoomForAShiftThatIsNotExact) {
    test::SmallStore store = store_in_taiwan();
    Dataset& d = store.dataset;
    d.crs = "EPSG:23031";  // ED50, some metres
    const auto to_degrees = CrsTransform::make(*Crs::parse(d.crs), *Crs::parse("EPSG:4326"));
    ASSERT_TRUE(to_degrees);
    const double accuracy_m = to_degrees->accuracy_m();
    ASSERT_GT(accuracy_m, 0.5);
    const auto moved_by = [&](double metres) {
        d.geo_grid = make_geo_grid(d.lattice, d.crs);
        for (std::size_t side : {1U, 3U}) d.geo_grid->box_m[side] += metres;
        return check_geo_grid(d);
    };
    d.lattice.origin_y_m = 4800000;
    const GeoCheck near = moved_by(1.9 * accuracy_m), far = moved_by(2.2 * accuracy_m);
    EXPECT_FALSE(near.broken);
    EXPECT_NE(near.reason.find("the datum shift is known to"), std::string::npos) << near.reason;
    EXPECT_TRUE(far.broken);
}

TEST(VerifyLonLat, ADatumOfWhichPROJIsNotSureBreaksNothing) {
    test::SmallStore store = store_in_taiwan();
    Dataset& d = store.dataset;
    d.crs = "+proj=utm +zone=51 +ellps=krass +type=crs";
    const auto to_degrees = CrsTransform::make(*Crs::parse(d.crs), *Crs::parse("EPSG:4326"));
    ASSERT_TRUE(to_degrees);
    ASSERT_LT(to_degrees->accuracy_m(), 0);
    d.geo_grid = make_geo_grid(d.lattice, d.crs);
    ASSERT_TRUE(d.geo_grid);
    for (double& side : d.geo_grid->box_m) side += 100;
    const GeoCheck check = check_geo_grid(d);
    EXPECT_FALSE(check.broken);
    ASSERT_TRUE(check.error_m);
    EXPECT_GT(*check.error_m, 100);
    EXPECT_EQ(check.reason, "PROJ does not say how sure its datum shift is");
}

TEST(VerifyLonLat, SaysWhyNothingWasCompared) {
    test::SmallStore store = store_in_taiwan();
    store.dataset.crs = "EPSG:999999";
    EXPECT_EQ(verify(store).lon_lat.reason, "PROJ does not know the CRS");
    store.dataset.geo_grid.reset();
    const VerifyReport report = verify(store);
    EXPECT_EQ(report.lon_lat.reason, "the store has none");
    EXPECT_FALSE(report.lon_lat.error_m);
    EXPECT_TRUE(report.sound());
}

TEST(VerifySound, OneTile) { expect_sound({.cells_x = 4, .cells_y = 4, .texture_deepest_level = 0}); }

TEST(VerifySound, CountsOfASquareOfFourLeaves) {
    const VerifyReport report =
        verify(test::make_small_store({.cells_x = 8, .cells_y = 8, .texture_deepest_level = 1}));
    EXPECT_TRUE(report.sound()) << joined(report.problems);
    EXPECT_EQ(report.tiles_checked, 10);
    EXPECT_EQ(report.shared_samples_compared, 4 * 5 + 4 * 9);  // four inner edges, four quadrants of the root
    EXPECT_EQ(report.bounds_checked, 4 * 2 + 4 * 1 + 1);       // leaves; root against each leaf; root's coarsest
}

TEST(VerifySound, SeveralRootsAndDataThatEndInsideATile) {
    expect_sound({.cells_x = 45, .cells_y = 13});
    expect_sound({.cells_x = 5, .cells_y = 37});
}

TEST(VerifySound, HolesOfEverySize) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed)
        for (const int percent : {15, 50, 85}) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(percent) + " %");
            expect_sound({.cells_x = 29, .cells_y = 22, .present_percent = percent, .seed = seed});
        }
}

TEST(VerifySound, DepthsThatVaryByPlace) {
    SCREE_TRACE_SEED();
    std::int64_t coarse_leaves = 0, textures_end = 0;
    for (std::uint64_t k = 0; k < 24; ++k) {
        const std::uint64_t seed = test::seed() + k;
        SCOPED_TRACE("seed " + std::to_string(seed));
        const test::SmallTerrain terrain{.cells_x = 27 + 5 * static_cast<std::int64_t>(k % 3),
                                         .cells_y = 30,
                                         .texture_deepest_level = static_cast<int>(k % 6),
                                         .present_percent = k % 2 == 0 ? 100 : 85,
                                         .seed = seed,
                                         .varying = true};
        expect_sound(terrain);
        for (const auto& [id, tile] : test::make_small_store(terrain).heights) {
            coarse_leaves += tile.header.is_leaf() && id.level < 3 ? 1 : 0;
            textures_end += tile.header.texture_ends ? 1 : 0;
        }
    }
    EXPECT_GT(coarse_leaves, 100);
    EXPECT_GT(textures_end, 100);
}

TEST(VerifySound, EveryDepthOfTexture) {
    for (int level = 0; level <= 5; ++level) {
        SCOPED_TRACE("texture level " + std::to_string(level));
        expect_sound({.cells_x = 14, .cells_y = 15, .texture_deepest_level = level, .present_percent = 60});
    }
}

TEST(VerifySound, TexelsFromAnEighthOfACellToBeyondATile) {
    for (const int n : {2, 3, 5})
        for (const int log2 : {4, 5})
            for (int level = 0; level <= 2; ++level) {
                SCOPED_TRACE("n " + std::to_string(n) + ", texture 2^" + std::to_string(log2) + ", level " +
                             std::to_string(level));
                expect_sound({.cells_x = 60,
                              .cells_y = 64,
                              .tile_cells_log2 = n,
                              .texture_size_log2 = log2,
                              .texture_deepest_level = level,
                              .present_percent = 50,
                              .seed = 9});
            }
    expect_sound({.cells_x = 120, .cells_y = 40, .texture_deepest_level = 0, .present_percent = 50});
}

TEST(VerifySound, HeightsAtTheirExtremes) {
    expect_sound({.cells_x = 32, .cells_y = 32, .amplitude = kMaxHeightUnits, .present_percent = 70});
}

TEST(Verify, ProgressRisesFromZeroToOne) {
    const test::TemporaryFolder folder;
    test::make_small_store({}).write(folder.file("store.scree"));
    double last = 0;
    VerifyOptions options;
    options.progress = [&](double fraction) {
        EXPECT_GE(fraction, last);
        EXPECT_LE(fraction, 1.0);
        last = fraction;
    };
    ASSERT_TRUE(verify_store(folder.file("store.scree"), options).ok());
    EXPECT_EQ(last, 1.0);
}

TEST(Verify, StopsWhenAsked) {
    const test::TemporaryFolder folder;
    test::make_small_store({}).write(folder.file("store.scree"));
    std::atomic<bool> stop = true;
    VerifyOptions options;
    options.stop = &stop;
    const auto report = verify_store(folder.file("store.scree"), options);
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::interrupted);
}

TEST(Verify, AMissingStoreIsAnInputError) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(verify_store(folder.file("missing.scree")).error().code, ErrorCode::input);
}

}  // namespace
}  // namespace scree
