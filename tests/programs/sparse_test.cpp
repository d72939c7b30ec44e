// Mosaics of places far apart: what lies between costs nothing and changes nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

constexpr double kVoid = -9999;
constexpr double kStep = 30;

double land(double x, double y) {
    const double u = (x - 450000) / 1000, v = (y - 5298000) / 1000;
    return 700 + 240 * std::sin(1.7 * u + 0.4) * std::cos(1.3 * v) + 60 * std::sin(5.1 * u - 2.3 * v);
}

class Sparse : public ::testing::Test {
protected:
    SampleGrid at(int column, int row, int width, int height, double step = kStep) const {
        return north_up("EPSG:32633", 450000 + column * kStep, 5298000 - row * kStep, step, width, height);
    }
    std::string write(const std::string& name, const SampleGrid& grid, const SampleValue& value) {
        return write_placed_heights(folder_.file(""), name, HeightFormat::striped, grid, value);
    }
    // Heights with holes, at the rim too.
    std::string island(const std::string& name, const SampleGrid& grid, Random& random) {
        const int a = uniform(random, 5, 19), b = uniform(random, 5, 19), percent = uniform(random, 0, 60);
        std::vector<std::uint8_t> holes(400);
        for (auto& hole : holes) hole = uniform(random, 0, 99) < percent;
        return write(name, grid, [&](int c, int r) {
            const bool hole = holes[static_cast<std::size_t>(c / a % 20 * 20 + r / b % 20)] != 0;
            return hole && c + r > 0 ? kVoid : land(grid.x(c, r), grid.y(c, r));
        });
    }
    nlohmann::json build(std::vector<std::string> files, const std::string& store,
                         const std::vector<std::string>& more = {}) {
        files.insert(files.end(), more.begin(), more.end());
        files.insert(files.end(), {"--nodata", "-9999", "--force"});
        return build_store_from(files, store);
    }
    // A dataset names its sources: tiles alone.
    static std::string tiles_of(const std::string& store) {
        std::string all;
        const auto opened = SqliteStore::open(store);
        for (const TileKind kind : {TileKind::height, TileKind::texture, TileKind::seed}) {
            const auto ok = (*opened)->for_each(kind, [&](const SqliteStore::RowView& row) {
                all += std::to_string(row.key) + ' ';
                all.append(row.payload.begin(), row.payload.end());
                return true;
            });
            EXPECT_TRUE(ok);
        }
        return all;
    }

    TemporaryFolder folder_;
};

// A file of voids alone that covers everything lets the build look at all of it, and gives nothing.
TEST_F(Sparse, MosaicsHaveTheTilesOfOneThatIsLookedAtAllOver) {
    SCREE_TRACE_SEED();
    Random random(seed());
    for (int round = 0; round < 8; ++round) {
        const int size = std::array{5, 9, 17, 33}[static_cast<std::size_t>(round % 4)];
        const int side = 60 + 12 * size, width = side + uniform(random, 0, 40), height = side + uniform(random, 0, 40);
        std::vector<std::string> files;
        std::vector<std::string> more{"--tile-size", std::to_string(size), "--texture-size", "16"};
        // At both corners, so that the extent is known, and somewhere.
        files.push_back(island("north_west", at(0, 0, 24, 31), random));
        files.push_back(island("south_east", at(width - 30, height - 22, 30, 22), random));
        files.push_back(
            island("somewhere", at(uniform(random, 40, width - 40), uniform(random, 40, height - 40), 9, 11), random));
        if (round % 2 == 1)  // finer than the rest
            files.push_back(island("fine", at(3, 3, 61, 45, kStep / 8), random));
        if (round % 3 == 2) {
            const SampleGrid image = at(0, 0, 70, 50, kStep / 3);
            const std::string path = write_placed_image(folder_.file(""), "image", image, false,
                                                        [](int c, int r) { return (c * 7 + r * 13) % 251; });
            more.insert(more.end(), {"--imagery", path});
        }
        if (round % 4 == 3) more.insert(more.end(), {"--fill", "none"});
        build(files, folder_.file("sparse.scree"), more);
        const SampleGrid all = at(0, 0, width, height);
        files.push_back(write("nothing", all, [](int, int) { return kVoid; }));
        build(files, folder_.file("dense.scree"), more);
        ASSERT_TRUE(tiles_of(folder_.file("sparse.scree")) == tiles_of(folder_.file("dense.scree"))) << round;
    }
}

TEST_F(Sparse, MosaicsTakeTheRoomOfTheirFiles) {
    Random random(seed());
    const std::string here = island("here", at(0, 0, 257, 257), random),
                      there = island("there", at(60000, 60000, 257, 257), random);
    // Spooled whole it would take 14 GB of disk, and hours.
    const auto both = build({here, there}, folder_.file("both.scree"));
    const auto one = build({here}, folder_.file("one.scree")), other = build({there}, folder_.file("other.scree"));
    const auto sum = [&](const char* what) { return one[what].get<double>() + other[what].get<double>(); };
    // The tiles above them, and those whose borders fall otherwise.
    EXPECT_LE(both["height_tiles"].get<double>(), sum("height_tiles") + 60);
    EXPECT_LE(both["store_bytes"].get<double>(), 1.5 * sum("store_bytes"));
    const auto verified = report_of(scree({"verify", folder_.file("both.scree"), "--quiet", "--json", "-"}));
    EXPECT_EQ(verified.value("bound_violations", -1), 0);
    EXPECT_EQ(verified.value("shared_samples_differing", -1), 0);
}

}  // namespace
}  // namespace scree::test
