// Updates against builds: whatever changed, the store is the one that a build from all its sources would have made.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

// Land of 200 x 160 cells of 10 m, images of 2.5 m: 4 x 3 districts of 256 texels where tiles are of 16 texels.
class Updates : public ::testing::Test {
protected:
    void SetUp() override {
        for (const char* name : {"first", "later"}) std::filesystem::create_directory(folder_.file(name));
    }

    std::string dem(const std::string& name, int width, int height, std::uint64_t seed, double x = 0, double y = 0,
                    double amplitude_m = 400) {
        Place place;
        place.x += x;
        place.y -= y;
        HeightGrid grid = hills(width, height, seed, amplitude_m);
        // The range of all heights stays, so that the tint's colours do.
        for (float& z : grid.z) z = std::clamp(z, 10.0f, 300.0f);
        if (name == "patch.tif") std::fill(grid.z.begin(), grid.z.end(), 123.0f);
        if (name == "base.tif") grid.z[0] = 0, grid.z[1] = 310;
        write_heights(folder_.file(name), grid, place);
        return folder_.file(name);
    }
    // `x`, `y`: of its north-west corner, metres from the land's.
    std::string image(const std::string& name, int width, int height, double x, double y, int shade, int epsg = 32633,
                      double step = 2.5) {
        Place place{400000 + x, 5300000 - y, step, epsg, true};
        write_image(folder_.file(name), width, height, 3, 8, &place, [&](int i, int j, int c) {
            return (patchwork(i, j, c) + static_cast<std::uint32_t>(shade)) & 255;
        });
        return folder_.file(name);
    }
    using List = std::vector<std::string>;
    nlohmann::json build(const List& dems, const List& images, const std::string& store, const List& more = {}) {
        List arguments = dems;
        if (!images.empty()) arguments.push_back("--imagery");
        arguments.insert(arguments.end(), images.begin(), images.end());
        arguments.insert(arguments.end(), {"--texture-size", "16", "--force"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return build_store_from(arguments, store);
    }
    ProgramRun update(const List& arguments) {
        List all{"update", store_};
        all.insert(all.end(), arguments.begin(), arguments.end());
        all.insert(all.end(), {"--quiet", "--json", "-", "--sources", folder_.file(""), folder_.file("later")});
        return scree(all);
    }
    void expect_same_as_build(const List& dems, const List& images, const List& more = {}) {
        build(dems, images, whole_, more);
        EXPECT_EQ(digest_of(store_), digest_of(whole_));
        const auto verified = scree({"verify", store_, "--quiet"});
        EXPECT_EQ(verified.exit_code, 0) << describe(verified);
    }

    TemporaryFolder folder_;
    std::string store_ = folder_.file("s.scree"), whole_ = folder_.file("whole.scree");
};

TEST_F(Updates, ANewImageIsBuiltWhereItLies) {
    const std::string base = dem("base.tif", 200, 160, 3), under = image("under.tif", 800, 640, 0, 0, 0);
    build({base}, {under}, store_);
    const std::string patch = image("patch.tif", 60, 40, 700, 300, 90);
    const auto report = report_of(update({"--imagery", patch}));
    expect_keys(report, {"seconds", "cpu_seconds", "peak_rss_bytes", "districts", "districts_built",
                         "height_tiles_written", "texture_tiles_written", "tiles_removed", "warnings"});
    EXPECT_EQ(report.value("districts", 0), 12);
    EXPECT_LE(report.value("districts_built", 99), 2);
    EXPECT_EQ(report.value("height_tiles_written", -1), 0);
    EXPECT_LT(report.value("texture_tiles_written", 9999), 80) << "only tiles that changed, of 2700";
    expect_same_as_build({base}, {under, patch});
}

TEST_F(Updates, AStoreWithoutLongitudesGetsThem) {
    const std::string base = dem("base.tif", 200, 160, 3), under = image("under.tif", 800, 640, 0, 0, 0);
    build({base}, {under}, store_);
    {
        auto writer = SqliteStoreWriter::amend(store_);
        ASSERT_TRUE(writer.ok());
        Dataset old = (*SqliteStore::open(store_))->dataset();
        ASSERT_TRUE(old.geo_grid);
        old.geo_grid.reset();
        ASSERT_TRUE((*writer)->finish(old).ok());
    }
    EXPECT_FALSE(report_of(scree({"info", store_, "--json", "-"})).contains("geo_grid"));
    const std::string patch = image("patch.tif", 60, 40, 700, 300, 90);
    report_of(update({"--imagery", patch}));
    expect_same_as_build({base}, {under, patch});
    EXPECT_TRUE(report_of(scree({"info", store_, "--json", "-"}))["geo_grid"].contains("error_m"));
}

TEST_F(Updates, RemovedImagesUncoverWhatLiesUnderThem) {
    const std::string base = dem("base.tif", 200, 160, 4), under = image("under.tif", 400, 640, 0, 0, 0),
                      patch = image("patch.tif", 300, 200, 600, 300, 90);
    build({base}, {under, patch}, store_);
    const auto report = report_of(update({"--remove", "patch.tif"}));
    EXPECT_LT(report.value("districts_built", 99), 12);
    expect_same_as_build({base}, {under});
}

TEST_F(Updates, AnImageOfTheSameNameReplacesItInItsPlace) {
    const std::string base = dem("base.tif", 200, 160, 5), under = image("under.tif", 800, 640, 0, 0, 0),
                      middle = image("middle.tif", 300, 200, 200, 300, 90),
                      top = image("top.tif", 100, 100, 300, 400, 170);
    build({base}, {under, middle, top}, store_);
    const std::string fresh = image("later/middle.tif", 280, 220, 250, 310, 30);
    report_of(update({"--imagery", fresh}));
    expect_same_as_build({base}, {under, fresh, top});
    // Changed where it stands, in the middle of the file: only the user can know.
    image("later/middle.tif", 280, 220, 250, 310, 31);
    report_of(update({"--imagery", fresh}));
    expect_same_as_build({base}, {under, fresh, top});
}

TEST_F(Updates, NewAndChangedHeightsRewriteTheTilesThatTheyTouch) {
    const std::string base = dem("base.tif", 201, 161, 6), under = image("under.tif", 500, 640, 0, 0, 0);
    build({base}, {under}, store_);
    const std::string patch = dem("patch.tif", 20, 20, 77, 400, 400);
    const auto report = report_of(update({patch}));
    EXPECT_GT(report.value("height_tiles_written", 0), 0);
    EXPECT_LT(report.value("height_tiles_written", 99), 12) << "of 49";
    EXPECT_LT(report.value("districts_built", 99), 12);
    expect_same_as_build({base, patch}, {under});
    report_of(update({"--remove", "patch.tif"}));
    expect_same_as_build({base}, {under});
}

TEST_F(Updates, AbsentGroundComesAndGoes) {
    HeightGrid grid = hills(200, 160, 9);
    for (int j = 0; j < 160; ++j)
        for (int i = 120; i < 200; ++i) grid.at(i, j) = -9999;
    write_heights(folder_.file("half.tif"), grid, {}, "-9999");
    const std::string base = folder_.file("half.tif"), under = image("under.tif", 400, 640, 0, 0, 0);
    build({base}, {under}, store_);
    const std::string rest = dem("rest.tif", 100, 100, 12, 1000, 100);
    report_of(update({rest}));
    expect_same_as_build({base, rest}, {under});
    report_of(update({"--remove", "rest.tif"}));
    expect_same_as_build({base}, {under});
}

TEST_F(Updates, KeepTheStretchThatTheBuildChose) {
    const std::string base = dem("base.tif", 200, 160, 3);
    const auto deep = [&](const std::string& name, int width, double x, std::uint32_t least) {
        Place place{400000 + x, 5300000, 2.5, 32633, true};
        write_image(folder_.file(name), width, 640, 3, 16, &place,
                    [&](int i, int j, int c) { return least + 40 * patchwork(i, j, c); });
        return folder_.file(name);
    };
    const std::string under = deep("under.tif", 400, 0, 1000), next = deep("next.tif", 400, 1000, 30000);
    build({base}, {under}, store_);
    auto store = SqliteStore::open(store_);
    ASSERT_TRUE(store);
    const auto options = (*store)->dataset().options;
    ASSERT_EQ(options.count("stretch"), 1u);
    EXPECT_EQ(options.at("stretch").rfind("auto ", 0), 0u);
    report_of(update({"--imagery", next}));
    store = SqliteStore::open(store_);
    ASSERT_TRUE(store);
    EXPECT_EQ((*store)->dataset().options, options);
    EXPECT_EQ((*store)->dataset().sources.size(), 3u);
    EXPECT_EQ(scree({"verify", store_, "--quiet"}).exit_code, 0);
}

TEST_F(Updates, AnyChangesInAnyOrder) {
    SCREE_TRACE_SEED();
    Random random(seed());
    for (int round = 0; round < 3 && !HasFailure(); ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        const List kernel = round % 2 == 0 ? List{} : List{"--resampling", "cubic"};
        const List dems{dem("base.tif", 180, 150, 40 + static_cast<std::uint64_t>(round))};
        std::map<std::string, std::string> files;
        List images;
        int made = 0;
        const auto add = [&] {
            const std::string name = "i" + std::to_string(round) + "_" + std::to_string(made++) + ".tif";
            // On the texels, between them, half as fine, in the neighbouring zone.
            const int kind = uniform(random, 0, 3);
            const double shift = kind == 0 ? 0 : 1.1, step = kind == 2 ? 5 : 2.5;
            const int width = uniform(random, 20, 400), height = uniform(random, 20, 400);
            // Each reaches into the land, wherever it begins.
            const double x = 2.5 * uniform(random, 45 - width, 600) + shift,
                         y = 2.5 * uniform(random, 45 - height, 500) + shift;
            const std::string path = kind == 3 ? image(name, width, height, 448868 + x, y - 9672, made * 31, 32632)
                                               : image(name, width, height, x, y, made * 31, 32633, step);
            images.push_back(path);
            return path;
        };
        images.push_back(image("under" + std::to_string(round) + ".tif", 720, 600, 0, 0, round));
        for (int k = 0; k < 3; ++k) add();
        List before = images;
        build(dems, before, store_, kernel);
        for (int step = 0; step < 3 && !HasFailure(); ++step) {
            List arguments;
            if (images.size() > 2 && uniform(random, 0, 1) == 1) {
                const auto gone = images.begin() + uniform(random, 1, static_cast<int>(images.size()) - 1);
                arguments.insert(arguments.end(), {"--remove", std::filesystem::path(*gone).filename().string()});
                images.erase(gone);
            }
            arguments.insert(arguments.end(), {"--imagery", add()});
            const auto run = update(arguments);
            ASSERT_EQ(run.exit_code, 0) << describe(run);
            expect_same_as_build(dems, images, kernel);
        }
    }
}

TEST_F(Updates, SayWhatStandsInTheWay) {
    const std::string base = dem("base.tif", 200, 160, 3), under = image("first/under.tif", 800, 640, 0, 0, 0);
    build({base}, {under}, store_);
    const std::string digest = digest_of(store_);
    const auto refused = [&](const List& arguments, int code, const std::string& what) {
        const auto run = update(arguments);
        EXPECT_EQ(run.exit_code, code) << describe(run);
        EXPECT_NE(run.err.find(what), std::string::npos) << describe(run);
        EXPECT_EQ(digest_of(store_), digest);
        EXPECT_FALSE(std::filesystem::exists(store_ + ".update"));
    };
    const std::string patch = image("patch.tif", 60, 40, 700, 300, 90);
    refused({"--imagery", patch}, 3, "under.tif");  // its folder is not named
    refused({}, 2, "nothing to do");
    const List there{"--sources", folder_.file("first")};
    refused({"--remove", "nobody.tif"}, 2, "nobody.tif");
    refused({"--remove", "base.tif", there[0], there[1]}, 2, "no source of heights");
    const std::string far = dem("far.tif", 50, 50, 8, 3000, 0);
    refused({far, there[0], there[1]}, 2, "lattice");
    std::ofstream(folder_.file("junk.tif")) << "no picture";
    refused({"--imagery", folder_.file("junk.tif"), there[0], there[1]}, 3, "junk.tif");
    EXPECT_EQ(scree({"update", folder_.file("none.scree"), patch}).exit_code, 3);
    const auto good = update({"--imagery", patch, there[0], there[1]});
    EXPECT_EQ(good.exit_code, 0) << describe(good);
}

}  // namespace
}  // namespace scree::test
