// Builds whose textures end at levels that vary by place: fine images over coarse ones, wherever they lie.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

namespace fs = std::filesystem;
using List = std::vector<std::string>;

List operator+(List a, const List& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

// EXT_texture_compression_s3tc: red of a texel; negative where it is transparent.
double red_of(const std::uint8_t* block, int x, int y) {
    const unsigned a = block[0] | unsigned{block[1]} << 8, b = block[2] | unsigned{block[3]} << 8;
    const unsigned index = block[4 + y] >> (2 * x) & 3;
    if (a <= b && index == 3) return -1;
    const double share = index < 2 ? index : a <= b ? 0.5 : index == 2 ? 1.0 / 3 : 2.0 / 3;
    return ((a >> 11) * (1 - share) + (b >> 11) * share) * 255 / 31;
}

constexpr double kWest = 400000, kNorth = 5300000;

// Land of 10 m cells with holes in it.
class TextureDepths : public ::testing::Test {
protected:
    void SetUp() override {
        fs::create_directory(folder_.file("out"));
        fs::create_directory(folder_.file("later"));
    }

    std::string dem(int width, int height, std::uint64_t seed, bool holes = true) {
        HeightGrid grid = hills(width, height, seed);
        if (holes)
            for (int j = 5; j < height / 4; ++j)
                for (int i = width / 2; i < width - 9; ++i) grid.at(i, j) = -9999;
        write_heights(folder_.file("dem.tif"), grid, {}, "-9999");
        return folder_.file("dem.tif");
    }
    // Heights of 2.5 m within those of dem(), with holes of their own.
    std::string fine_dem(std::uint64_t seed) {
        HeightGrid grid = hills(90, 80, seed);
        for (int j = 0; j < 80; ++j)
            for (int i = 0; i < 90; ++i)
                if ((i * 3 + j * 7) % 41 == 0) grid.at(i, j) = -9999;
        write_heights(folder_.file("fine_dem.tif"), grid, {kWest + 210, kNorth - 90, 2.5}, "-9999");
        return folder_.file("fine_dem.tif");
    }
    // `x`, `y`: of its north-west corner, metres from the land's.
    std::string image(const std::string& name, int width, int height, double x, double y, double step, int shade,
                      int channels = 3) {
        const Place place{kWest + x, kNorth - y, step, 32633, true};
        write_image(folder_.file(name), width, height, channels, 8, &place, [&](int i, int j, int c) -> std::uint32_t {
            if (c == 3) return (i / 23 + j / 17) % 3 == 0 ? 0 : 255;
            return (patchwork(i, j, c) + static_cast<std::uint32_t>(shade)) & 255;
        });
        return folder_.file(name);
    }
    // Turned, or of the neighbouring zone; x, y as above.
    std::string turned(const std::string& name, int width, int height, double x, double y, double step, double degrees,
                       bool other_zone) {
        SampleGrid grid = north_up("EPSG:32633", kWest + x, kNorth - y, step, width, height);
        if (other_zone) grid = north_up("EPSG:32632", kWest + 448868 + x, kNorth + 9672 - y, step, width, height);
        grid.area = true;
        return write_placed_image(folder_.file(""), name, grid.turned(degrees), true,
                                  [&](int i, int j) { return (i * 7 + j * 5) % 200 + 20; });
    }
    nlohmann::json build(const List& inputs, const std::string& store, const List& more = {}) {
        return build_store_from(inputs + List{"--texture-size", "16", "--force"} + more, store);
    }
    void expect_sound(const std::string& store) {
        const auto verified = scree({"verify", store, "--quiet"});
        EXPECT_EQ(verified.exit_code, 0) << describe(verified);
    }

    std::map<TileId, std::uint8_t> texture_tiles(const std::string& path, Dataset& dataset) {
        std::map<TileId, std::uint8_t> masks;
        const auto store = SqliteStore::open(path);
        if (!store) return masks;
        dataset = (*store)->dataset();
        const auto ok = (*store)->for_each(TileKind::texture, [&](const SqliteStore::RowView& row) {
            const auto id = tile_from_key(dataset.lattice, row.key);
            if (id) masks[*id] = row.payload[0];
            return true;
        });
        EXPECT_TRUE(ok.ok());
        return masks;
    }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("out/s.scree"), partial_ = store_ + ".partial",
                      whole_ = folder_.file("whole.scree");
};

// Metres from the land's north-west corner, and the level that the image asks for.
struct Cover {
    double west, north, east, south;
    int level;
};

TEST_F(TextureDepths, TilesEndWhereTheirImagesDo) {
    const List inputs{dem(257, 193, 4, false), "--imagery", image("base.tif", 520, 390, 0, 0, 5, 0),
                      image("middle.tif", 300, 200, 610, 505, 1.25, 40),
                      image("fine.tif", 200, 300, 903.2, 411.7, 10.0 / 64, 90)};
    build(inputs, store_);
    Dataset d;
    const auto tiles = texture_tiles(store_, d);
    const auto level_of = [&](double pixel_m) {
        int level = 0;
        while (d.texel_m(level) > 1.1 * pixel_m) ++level;
        return level;
    };
    const std::vector<Cover> covers{{0, 0, 2600, 1950, level_of(5)},
                                    {610, 505, 985, 755, level_of(1.25)},
                                    {903.2, 411.7, 903.2 + 31.25, 411.7 + 46.875, level_of(10.0 / 64)}};
    ASSERT_EQ(d.texture_deepest_level, covers.back().level);
    ASSERT_EQ(d.coarsest_texture_level, covers.front().level);
    ASSERT_GE(covers.back().level - covers.front().level, 5) << "deep enough for a deep district";
    // By hand, from the roots down.
    std::size_t expected = 0;
    const auto refined = [&](TileId id) {
        const double side = d.texel_m(id.level) * d.texture_size(), west = side * static_cast<double>(id.x),
                     north = side * static_cast<double>(id.y);
        return std::any_of(covers.begin(), covers.end(), [&](const Cover& c) {
            return c.level > id.level && c.west < west + side - 1e-3 && c.east > west + 1e-3 &&
                   c.north < north + side - 1e-3 && c.south > north + 1e-3;
        });
    };
    std::vector<TileId> open{{0, 0, 0}};
    while (!open.empty()) {
        const TileId id = open.back();
        open.pop_back();
        const double side = d.texel_m(id.level) * d.texture_size();
        if (side * static_cast<double>(id.x) >= 2560 || side * static_cast<double>(id.y) >= 1920) continue;
        ++expected;
        ASSERT_EQ(tiles.count(id), 1u) << id.level << "/" << id.x << "/" << id.y;
        ASSERT_EQ(tiles.at(id) != 0, refined(id)) << id.level << "/" << id.x << "/" << id.y;
        if (!refined(id)) continue;
        for (int q = 0; q < 4; ++q) open.push_back(child_of(id, q));
    }
    EXPECT_EQ(tiles.size(), expected);
    expect_sound(store_);
    const auto info = report_of(scree({"info", store_, "--json", "-"}));
    EXPECT_EQ(info.value("coarsest_texture_level", -1), d.least_texture_level());
    std::vector<int> of_level(static_cast<std::size_t>(d.texture_deepest_level + 1));
    for (const auto& [id, mask] : tiles) ++of_level[static_cast<std::size_t>(id.level)];
    EXPECT_EQ(info["texture_tiles_of_level"], nlohmann::json(of_level));
    const std::string told = scree({"info", store_}).out;
    EXPECT_NE(told.find("depth varies by place"), std::string::npos) << told;
}

TEST_F(TextureDepths, TakeLittleMoreThanTheirImagesApart) {
    const std::string base = image("base.tif", 1025, 1025, 0, 0, 10, 0),
                      fine = image("fine.tif", 1024, 1024, 3203, 4101, 10.0 / 32, 90);
    const auto both = build({dem(1025, 1025, 4, false), "--imagery", base, fine}, store_);
    const auto below = build({folder_.file("dem.tif"), "--imagery", base}, whole_);
    // The inset's part of the land, cut by its samples.
    HeightGrid grid = hills(34, 34, 4);
    write_heights(folder_.file("part.tif"), grid, {kWest + 3200, kNorth - 4100});
    const auto above = build({folder_.file("part.tif"), "--imagery", fine}, whole_);
    for (const char* what : {"texture_tiles", "store_bytes"})
        EXPECT_LE(both[what].get<double>(), 1.1 * (below[what].get<double>() + above[what].get<double>())) << what;
    EXPECT_GT(both["texture_tiles"].get<double>(), above["texture_tiles"].get<double>());
}

TEST_F(TextureDepths, ImagesOfOneResolutionOverAllOfTheLandAreStoredAsEver) {
    const std::string land = dem(120, 90, 4);
    build({land, "--imagery", image("a.tif", 300, 400, 0, 0, 2.5, 0), image("b.tif", 300, 400, 600, 0, 2.5, 9)},
          store_);
    Dataset d;
    texture_tiles(store_, d);
    EXPECT_FALSE(d.coarsest_texture_level.has_value());
    const auto store = SqliteStore::open(store_);
    ASSERT_TRUE(store.ok());
    const auto ok = (*store)->for_each(TileKind::seed, [&](const SqliteStore::RowView& row) {
        EXPECT_EQ(tile_from_key(d.lattice, row.key)->level, d.texture_deepest_level - 4);
        return true;
    });
    EXPECT_TRUE(ok.ok());
}

// Whatever of an inset's last tiles it does not fill shows what lies under it: nowhere black, nowhere bare.
TEST_F(TextureDepths, WhereAnInsetEndsItsTilesShowWhatLiesUnderIt) {
    const auto plain = [&](const std::string& name, int width, int height, double x, double y, double step, int red) {
        const Place place{kWest + x, kNorth - y, step, 32633, true};
        write_image(folder_.file(name), width, height, 3, 8, &place,
                    [&](int, int, int c) { return static_cast<std::uint32_t>(c == 0 ? red : 100); });
        return folder_.file(name);
    };
    const List inputs{dem(129, 129, 4, false), "--imagery", plain("base.tif", 130, 130, 0, 0, 10, 60),
                      plain("fine.tif", 150, 170, 333.3, 444.4, 0.625, 200)};
    build(inputs, store_);
    const auto store = SqliteStore::open(store_);
    ASSERT_TRUE(store.ok());
    const Dataset& d = (*store)->dataset();
    std::int64_t within = 0, beyond = 0;
    const auto look = [&](const SqliteStore::RowView& row) {
        const auto id = tile_from_key(d.lattice, row.key);
        const auto tile = decode_texture_tile(row.payload, d.texture_size_log2, row.codec);
        EXPECT_TRUE(id && tile);
        if (!id || !tile || id->level < d.least_texture_level()) return true;
        const double texel = d.texel_m(id->level);
        const std::uint8_t* blocks = tile->blocks.data() + bc1_mip_offset(d.texture_size_log2, 0);
        for (int r = 0; r < 16; ++r)
            for (int c = 0; c < 16; ++c) {
                const double x = (static_cast<double>(id->x * 16 + c) + 0.5) * texel,
                             y = (static_cast<double>(id->y * 16 + r) + 0.5) * texel;
                if (x > 1280 || y > 1280) continue;
                const double red = red_of(blocks + 8 * (r / 4 * 4 + c / 4), c % 4, r % 4);
                const bool near = x > 333.3 - 8 * texel && x < 333.3 + 93.75 + 8 * texel && y > 444.4 - 8 * texel &&
                                  y < 444.4 + 106.25 + 8 * texel;
                const bool inside = x > 333.3 + 8 * texel && x < 333.3 + 93.75 - 8 * texel && y > 444.4 + 8 * texel &&
                                    y < 444.4 + 106.25 - 8 * texel;
                const double least = inside ? 195 : 55, most = near ? 205 : 65;
                EXPECT_TRUE(red >= least && red <= most)
                    << red << " at " << id->level << "/" << id->x << "/" << id->y << ", " << c << ", " << r;
                within += inside;
                beyond += !near && id->level == d.texture_deepest_level;
            }
        return !HasFailure();
    };
    EXPECT_TRUE((*store)->for_each(TileKind::texture, look));
    EXPECT_GT(within, 5000);
    EXPECT_GT(beyond, 500) << "of the deepest level";
}

// Images of several resolutions, aligned and not, holed, turned, in another zone.
class RandomMosaic {
public:
    RandomMosaic(int round, Random& random) : round_(round), random_(random) {}

    template <class Fixture>
    std::string next(Fixture& f, bool later = false) {
        const std::string name =
            (later ? "later/i" : "i") + std::to_string(round_) + "_" + std::to_string(made_++) + ".tif";
        const double step = 10 / std::pow(2.0, uniform(random_, 0, 6)) * (uniform(random_, 0, 1) == 0 ? 1 : 0.83);
        const int width = uniform(random_, 20, 260), height = uniform(random_, 20, 260), kind = uniform(random_, 0, 5);
        // Each reaches the land.
        const double x = uniform(random_, 30, 500) + (kind == 0 ? 0 : 3.3), y = uniform(random_, 30, 500);
        if (kind == 4)
            return f.turned(name.substr(0, name.size() - 4), width, height, x, y, step, uniform(random_, 3, 80), false);
        if (kind == 5) return f.turned(name.substr(0, name.size() - 4), width, height, x, y, step, 0, true);
        return f.image(name, width, height, x, y, step, made_ * 31, kind == 3 ? 4 : 3);
    }

private:
    int round_, made_ = 0;
    Random& random_;
};

class RandomTextureDepths : public TextureDepths {
public:
    using TextureDepths::image;
    using TextureDepths::turned;
};

TEST_F(RandomTextureDepths, ThreadsMemoryAndInterruptionsDoNotShow) {
    SCREE_TRACE_SEED();
    Random random(seed());
    int varying = 0, killed = 0;
    for (int round = 0; round < 6 && !HasFailure(); ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        RandomMosaic mosaic(round, random);
        List inputs{dem(uniform(random, 60, 140), uniform(random, 60, 110), static_cast<std::uint64_t>(round))};
        if (uniform(random, 0, 1) == 1) inputs.push_back(fine_dem(static_cast<std::uint64_t>(round)));
        const char* const cells[] = {"9", "129", "33", "257"};
        inputs = inputs + List{"--fill",         "none",
                               "--tile-size",    cells[uniform(random, 0, 3)],
                               "--texture-size", round % 2 == 0 ? "16" : "32",
                               "--imagery"};
        if (round % 4 != 3) inputs.push_back(image("base" + std::to_string(round) + ".tif", 150, 120, 0, 0, 10, 7));
        for (int k = uniform(random, 1, 5); k > 0; --k) inputs.push_back(mosaic.next(*this));
        build_store_from(inputs + List{"--force", "--threads", "1"}, whole_);
        expect_sound(whole_);
        const std::string digest = digest_of(whole_);
        Dataset d;
        texture_tiles(whole_, d);
        varying += d.coarsest_texture_level.has_value();
        for (int way = 0; way < 3; ++way) {
            std::string trace;
            for (int attempt = 0; !fs::exists(store_); ++attempt) {
                ProgramOptions options;
                options.signal = uniform(random, 0, 1) == 0 ? SIGKILL : SIGINT;
                const double share = attempt < 3 ? uniform(random, 0, 110) / 100.0 : 1000;
                const auto whole = static_cast<double>(fs::file_size(whole_));
                options.signal_when = [&, share, whole] {
                    std::error_code error;
                    const auto bytes = fs::file_size(partial_, error);
                    return !error && static_cast<double>(bytes) >= share * whole;
                };
                const List how{"--threads", std::to_string(uniform(random, 1, 4)), "--memory",
                               std::to_string(uniform(random, 192, 600)) + "M"};
                const auto run = scree(List{"build"} + inputs + List{"-o", store_, "--quiet"} + how, options);
                trace += how[1] + " threads, " + how[3] + ", cut off at " + std::to_string(share) + "; ";
                ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 137 || run.exit_code == 130)
                    << trace << describe(run);
                killed += run.exit_code != 0;
            }
            EXPECT_EQ(digest_of(store_), digest) << trace;
            fs::remove(store_);
        }
    }
    EXPECT_GT(varying, 2);
    std::printf("    %d of 6 of varying depth, %d builds cut off\n", varying, killed);
}

TEST_F(RandomTextureDepths, UpdatesEndInTheStoreOfABuild) {
    SCREE_TRACE_SEED();
    Random random(seed());
    for (int round = 0; round < 3 && !HasFailure(); ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        RandomMosaic mosaic(round, random);
        const List size{"--texture-size", "16", "--tile-size", round % 2 == 0 ? "33" : "9"};
        List land{dem(uniform(random, 60, 140), uniform(random, 60, 110), static_cast<std::uint64_t>(round))};
        if (round == 1) land.push_back(fine_dem(static_cast<std::uint64_t>(round)));
        List images{image("base" + std::to_string(round) + ".tif", 150, 120, 0, 0, 10, 7)};
        images.push_back(mosaic.next(*this));
        build_store_from(land + size + List{"--force", "--imagery"} + images, store_);
        for (int step = 0; step < 4 && !HasFailure(); ++step) {
            List arguments{"update", store_,      "--quiet",        "--json",
                           "-",      "--sources", folder_.file(""), folder_.file("later")};
            std::string told;
            if (images.size() > 1 && uniform(random, 0, 1) == 1) {
                const auto gone = images.begin() + uniform(random, 1, static_cast<int>(images.size()) - 1);
                arguments = arguments + List{"--remove", fs::path(*gone).filename().string()};
                told = "without " + *gone;
                images.erase(gone);
            }
            if (step != 1 || told.empty()) {
                images.push_back(mosaic.next(*this));
                arguments = arguments + List{"--imagery", images.back()};
                told += " with " + images.back();
            }
            SCOPED_TRACE("step " + std::to_string(step) + " " + told);
            const auto run = scree(arguments);
            ASSERT_EQ(run.exit_code, 0) << describe(run);
            build_store_from(land + size + List{"--force", "--imagery"} + images, whole_);
            EXPECT_EQ(digest_of(store_), digest_of(whole_));
            expect_sound(store_);
        }
    }
}

TEST_F(TextureDepths, AnUpdateOfAnInsetLeavesOtherDeepDistrictsAlone) {
    const std::string land = dem(257, 257, 3), base = image("base.tif", 257, 257, 0, 0, 10, 0),
                      west = image("west.tif", 200, 200, 200, 300, 0.15, 40),
                      east = image("east.tif", 200, 200, 1800, 1900, 0.15, 90);
    build({land, "--imagery", base, west, east}, store_);
    const std::string fresh = image("later/east.tif", 210, 190, 1801, 1902, 0.15, 130);
    const auto report = report_of(
        scree({"update", store_, "--quiet", "--json", "-", "--sources", folder_.file(""), "--imagery", fresh}));
    Dataset d;
    std::int64_t under_east = 0;
    for (const auto& [id, mask] : texture_tiles(store_, d)) under_east += id.level > d.least_texture_level() ? 1 : 0;
    EXPECT_LT(report.value("texture_tiles_written", 0), under_east * 3 / 4) << "half of the deep tiles are the west's";
    build({land, "--imagery", base, west, fresh}, whole_);
    EXPECT_EQ(digest_of(store_), digest_of(whole_));
    // The first inset, and the last to go.
    for (const char* name : {"west.tif", "east.tif"})
        report_of(scree({"update", store_, "--quiet", "--json", "-", "--sources", folder_.file(""),
                         folder_.file("later"), "--remove", name}));
    build({land, "--imagery", base}, whole_);
    EXPECT_EQ(digest_of(store_), digest_of(whole_));
    report_of(scree({"update", store_, "--quiet", "--json", "-", "--sources", folder_.file(""), folder_.file("later"),
                     "--imagery", west}));
    build({land, "--imagery", base, west}, whole_);
    EXPECT_EQ(digest_of(store_), digest_of(whole_));
}

TEST_F(TextureDepths, VerifyNoticesALostDeepSeedAndAWrongEnd) {
    const List inputs{dem(65, 65, 3, false), "--imagery", image("base.tif", 65, 65, 0, 0, 10, 0),
                      image("fine.tif", 60, 60, 100, 100, 0.3, 90)};
    const auto damaged = [&](const std::function<void(SqliteStoreWriter&, const Dataset&)>& damage) {
        build(inputs, store_);
        Dataset d;
        texture_tiles(store_, d);
        {
            auto writer = SqliteStoreWriter::amend(store_);
            ASSERT_TRUE(writer.ok());
            damage(**writer, d);
            ASSERT_TRUE((*writer)->finish(d).ok());
        }
        const auto verified = scree({"verify", store_, "--quiet"});
        EXPECT_EQ(verified.exit_code, 1) << describe(verified);
    };
    damaged([](SqliteStoreWriter& writer, const Dataset& d) {
        std::vector<std::int64_t> deep;
        const auto ok = writer.for_each_key(TileKind::seed, [&](std::int64_t key) {
            if (tile_from_key(d.lattice, key)->level == d.coarsest_texture_level) deep.push_back(key);
        });
        EXPECT_TRUE(ok.ok());
        ASSERT_FALSE(deep.empty());
        EXPECT_TRUE(writer.remove(TileKind::seed, deep[0]).ok());
    });
    damaged([](SqliteStoreWriter& writer, const Dataset&) {
        TileRow row;
        const auto found = writer.read(TileKind::height, 1, row);
        ASSERT_TRUE(found.ok() && *found);
        row.payload[1] = static_cast<std::uint8_t>(row.payload[1] ^ 2);
        EXPECT_TRUE(writer.put(TileKind::height, 1, row.codec, row.payload).ok());
    });
}

TEST_F(TextureDepths, MemoryIsBoundedHoweverWideAndDeep) {
    if (kSanitized) GTEST_SKIP() << "resident memory says nothing under AddressSanitizer";
    // Dense it would be 655,360 texels a side.
    const List inputs{dem(1025, 1025, 3), "--imagery", image("base.tif", 1025, 1025, 0, 0, 10, 0),
                      image("fine.tif", 3000, 1000, 5000, 5000, 10.0 / 64, 90)};
    const auto report = build_store_from(inputs + List{"--memory", "192M", "--force"}, store_);
    EXPECT_LE(report.value("peak_rss_bytes", std::int64_t{0}), std::int64_t{192} << 20);
    expect_sound(store_);
}

}  // namespace
}  // namespace scree::test
