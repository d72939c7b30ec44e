// The C API beside the C++ that it stands on.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <limits>

#include "c_api_checks.h"
#include "common/query/ground.h"
#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "tests/common/query/small_world.h"

namespace scree {
namespace {

void write_store(const test::SmallWorld& world, const std::string& path, const std::optional<GeoGrid>& grid = {}) {
    auto writer = SqliteStoreWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const auto& [id, tile] : world.tiles())
        ASSERT_TRUE((*writer)
                        ->put(TileKind::height, *tile_key(world.lattice(), id), static_cast<int>(HeightCodec::raw),
                              encode_height_tile(tile, world.lattice().tile_cells_log2, HeightCodec::raw))
                        .ok());
    Dataset dataset = world.dataset();  // what it says of textures nobody asks
    dataset.height_tiles = static_cast<std::int64_t>(world.tiles().size());
    dataset.texture_tiles = dataset.present_cells = 1;
    dataset.geo_grid = grid;
    ASSERT_TRUE((*writer)->finish(dataset).ok());
}

TEST(CApi, SaysTheHeightsAndTheDatasetOfTheStore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    test::TemporaryFolder folder;
    int present = 0, absent = 0;
    for (int k = 0; k < 8; ++k) {
        const auto world = test::random_world(random, k % 2 == 1);
        const std::string path = folder.file("w" + std::to_string(k) + ".scree");
        write_store(world, path);
        const auto store = SqliteStore::open(path);
        ASSERT_TRUE(store.ok()) << store.error().message;
        auto ground = Ground::open(**store);
        ASSERT_TRUE(ground.ok());
        const Lattice& l = world.lattice();
        std::vector<c_api_point> points;
        for (int p = 0; p < 200; ++p) {
            const double i = test::uniform_real(random, -1, static_cast<double>(l.cells_x) + 1),
                         j = test::uniform_real(random, -1, static_cast<double>(l.cells_y) + 1);
            const auto height = (*ground)->height(l.x_m(i), l.y_m(j));
            ASSERT_TRUE(height.ok());
            ++(height->has_value() ? present : absent);
            constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
            points.push_back({l.x_m(i), l.y_m(j), *height ? (*height)->height_m : kNone,
                              *height ? (*height)->error_bound_m : kNone});
        }
        EXPECT_EQ(check_heights(path.c_str(), points.data(), static_cast<int>(points.size())), 0);
        EXPECT_EQ(check_info(path.c_str(), dataset_to_json((*store)->dataset()).c_str()), 0);
    }
    EXPECT_GT(present, 400);
    EXPECT_GT(absent, 100);
}

TEST(CApi, SaysWhereAPlaceIsOnTheEarthAndWhereAPlaceOnTheEarthIs) {
    test::TemporaryFolder folder;
    const test::SmallWorld world({}, [](std::int64_t i, std::int64_t j) { return static_cast<std::int32_t>(i + j); });
    const std::string with = folder.file("with.scree"), without = folder.file("without.scree");
    GeoGrid grid;
    grid.columns = grid.rows = 2;
    const Lattice& l = world.lattice();
    const double east = l.x_m(static_cast<double>(l.cells_x)), south = l.y_m(static_cast<double>(l.cells_y));
    grid.box_m = {l.origin_x_m, south, east, l.origin_y_m};
    for (const LonLat& at : {LonLat{8, 47}, LonLat{8.01, 47}, LonLat{8, 46.99}, LonLat{8.01, 46.99}})
        grid.normals.push_back(normal_of(at));
    grid.normals = *normals_from_text(normals_to_text(grid), 2, 2);
    write_store(world, with, grid);
    write_store(world, without);
    const double x = 0.7 * l.origin_x_m + 0.3 * east, y = 0.7 * l.origin_y_m + 0.3 * south;
    const auto at = grid.lon_lat(x, y);
    ASSERT_TRUE(at);
    EXPECT_NEAR(at->longitude_deg, 8.003, 1e-5);
    EXPECT_NEAR(at->latitude_deg, 46.997, 1e-5);
    EXPECT_EQ(check_places(with.c_str(), x, y, at->longitude_deg, at->latitude_deg), 0);
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(check_places(without.c_str(), x, y, kNone, kNone), 0);
}

TEST(CApi, SaysWhatIsWrong) {
    test::TemporaryFolder folder;
    const test::SmallWorld world({}, [](std::int64_t i, std::int64_t j) { return static_cast<std::int32_t>(i + j); });
    const std::string damaged = folder.file("damaged.scree"), text = folder.file("text.scree");
    write_store(world, damaged);
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(damaged.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, "UPDATE height SET checksum = checksum + 1", nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(db);
    sqlite3_close(db);
    test::write_bytes(text, std::vector<std::uint8_t>(5000, 'x'));
    EXPECT_EQ(check_errors(folder.file("none.scree").c_str(), text.c_str(), damaged.c_str()), 0);
}

}  // namespace
}  // namespace scree
