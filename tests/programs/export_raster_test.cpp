// Exported GeoTIFFs hold what the store holds, where the store holds it: by the file's own samples, by a store built
// from it, and by the word of GDAL where that is installed.
#include <gtest/gtest.h>
#include <tiffio.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "common/query/ground.h"
#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

struct Raster {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 0, format = 0, channels = 0;
    std::vector<double> values;  // row-major, interleaved

    double at(std::int64_t i, std::int64_t j, int channel = 0) const {
        return values[static_cast<std::size_t>((j * width + i) * channels + channel)];
    }
};

double value_of(const std::uint8_t* bytes, int bits, int format) {
    const auto as = [bytes](auto value) {
        std::memcpy(&value, bytes, sizeof value);
        return static_cast<double>(value);
    };
    if (format == SAMPLEFORMAT_IEEEFP) return bits == 32 ? as(float{}) : as(double{});
    if (format == SAMPLEFORMAT_INT) return bits == 16 ? as(std::int16_t{}) : as(std::int32_t{});
    return bytes[0];
}

Raster read_raster(const std::string& path) {
    Raster raster;
    TIFFSetWarningHandler(nullptr);  // GDAL's tag is unknown to libtiff
    TIFF* file = TIFFOpen(path.c_str(), "r");
    EXPECT_NE(file, nullptr) << path;
    if (file == nullptr) return raster;
    TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &raster.width);
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &raster.height);
    TIFFGetField(file, TIFFTAG_BITSPERSAMPLE, &raster.bits);
    TIFFGetField(file, TIFFTAG_SAMPLEFORMAT, &raster.format);
    TIFFGetField(file, TIFFTAG_SAMPLESPERPIXEL, &raster.channels);
    std::uint32_t side = 0;
    TIFFGetField(file, TIFFTAG_TILEWIDTH, &side);
    EXPECT_EQ(TIFFIsTiled(file), 1);
    const std::size_t bytes = raster.bits / 8u, pixel = bytes * raster.channels;
    raster.values.resize(std::size_t{raster.width} * raster.height * raster.channels);
    std::vector<std::uint8_t> tile(static_cast<std::size_t>(TIFFTileSize(file)));
    for (std::uint32_t y = 0; y < raster.height; y += side)
        for (std::uint32_t x = 0; x < raster.width; x += side) {
            EXPECT_GE(TIFFReadTile(file, tile.data(), x, y, 0, 0), 0);
            for (std::uint32_t r = y; r < std::min(y + side, raster.height); ++r)
                for (std::uint32_t c = x; c < std::min(x + side, raster.width); ++c)
                    for (std::uint32_t k = 0; k < raster.channels; ++k)
                        raster.values[(std::size_t{r} * raster.width + c) * raster.channels + k] =
                            value_of(&tile[((r - y) * side + c - x) * pixel + k * bytes], raster.bits, raster.format);
        }
    TIFFClose(file);
    return raster;
}

// A sample that no cell of four valid corners touches is none.
bool touched(const HeightGrid& grid, int i, int j) {
    const auto valid = [&](int a, int b) { return grid.at(a, b) > -9000; };
    for (int b = std::max(j - 1, 0); b <= std::min(j, grid.height - 2); ++b)
        for (int a = std::max(i - 1, 0); a <= std::min(i, grid.width - 2); ++a)
            if (valid(a, b) && valid(a + 1, b) && valid(a, b + 1) && valid(a + 1, b + 1)) return true;
    return false;
}

HeightGrid hills_with_voids(int width, int height) {
    HeightGrid grid = hills(width, height, seed());
    for (int j = 40; j < 75; ++j)
        for (int i = 130; i < 190; ++i) grid.at(i, j) = -9999;
    for (int j = height - 30; j < height; ++j)
        for (int i = 0; i < 20 + j % 7; ++i) grid.at(i, j) = -9999;
    grid.at(10, 10) = -9999;
    return grid;
}

class ExportRaster : public ::testing::Test {
protected:
    void build_voids() {
        grid_ = hills_with_voids(300, 270);
        write_heights_i16(dem_, grid_, {}, "-9999");
        build_store_from({dem_, "--texture-size", "64", "--fill", "none"}, store_);
    }
    nlohmann::json export_to(const std::string& file, std::vector<std::string> more = {},
                             const char* what = "--heights", const std::string& store = "") {
        std::vector<std::string> arguments{"export", store.empty() ? store_ : store, what, file, "--json", "-",
                                           "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return report_of(scree(arguments));
    }
    // A store made from what was exported exports the same bytes: the same heights in the same place.
    void expect_rebuilt_alike(const std::string& exported) {
        build_store_from({exported, "--fill", "none"}, folder_.file("again.scree"));
        export_to(folder_.file("again.tif"), {"--force"}, "--heights", folder_.file("again.scree"));
        EXPECT_TRUE(read_bytes(exported) == read_bytes(folder_.file("again.tif")));
        const auto before = report_of(scree({"info", store_, "--json", "-"})),
                   after = report_of(scree({"info", folder_.file("again.scree"), "--json", "-"}));
        for (const char* key : {"origin_m", "spacing_m", "cells", "present_cells", "crs", "corners_deg"})
            EXPECT_EQ(before[key], after[key]) << key;
    }
    // Every sample of an export with a step of `step_m` is what the finest surface is there.
    void expect_as_queried(const std::string& file, const nlohmann::json& report, double tolerance_m) {
        auto store = SqliteStore::open(store_);
        ASSERT_TRUE(store);
        auto ground = Ground::open(**store);
        ASSERT_TRUE(ground);
        const Raster raster = read_raster(file);
        const double x = report["origin_m"][0], y = report["origin_m"][1], nodata = report["nodata"];
        std::int64_t absent = 0;
        for (std::uint32_t j = 0; j < raster.height; ++j)
            for (std::uint32_t i = 0; i < raster.width; ++i) {
                auto height = (*ground)->height(x + i * report["step_m"][0].get<double>(),
                                                y - j * report["step_m"][1].get<double>());
                ASSERT_TRUE(height);
                absent += *height ? 0 : 1;
                ASSERT_NEAR(raster.at(i, j), *height ? (*height)->height_m : nodata, tolerance_m)
                    << "at " << i << ", " << j;
            }
        EXPECT_EQ(report["absent"], absent);
    }

    TemporaryFolder folder_;
    HeightGrid grid_;
    const std::string dem_ = folder_.file("d.tif"), store_ = folder_.file("s.scree"), out_ = folder_.file("out.tif");
};

TEST_F(ExportRaster, WholeMetresWithVoidsComeBackAsSixteenBits) {
    SCREE_TRACE_SEED();
    build_voids();
    const auto report = export_to(out_);
    const Raster raster = read_raster(out_);
    ASSERT_EQ(raster.width, 300u);
    ASSERT_EQ(raster.height, 270u);
    EXPECT_EQ(raster.bits, 16);
    EXPECT_EQ(raster.format, SAMPLEFORMAT_INT);
    std::int64_t absent = 0;
    for (int j = 0; j < 270; ++j)
        for (int i = 0; i < 300; ++i) {
            absent += touched(grid_, i, j) ? 0 : 1;
            ASSERT_EQ(raster.at(i, j), touched(grid_, i, j) ? grid_.at(i, j) : -32768) << i << ", " << j;
        }
    EXPECT_GT(absent, 500);
    EXPECT_EQ(report["absent"], absent);
    EXPECT_EQ(report["type"], "int16");
    expect_rebuilt_alike(out_);
}

TEST_F(ExportRaster, FractionsOfMetresComeBackAsFloats) {
    SCREE_TRACE_SEED();
    grid_ = hills_with_voids(260, 259);
    for (float& z : grid_.z)
        if (z > -9000) z = z * 0.37f + 0.123f;
    write_heights(dem_, grid_, {}, "-9999");
    build_store_from({dem_, "--texture-size", "64", "--fill", "none"}, store_);
    const auto report = export_to(out_);
    const Raster raster = read_raster(out_);
    EXPECT_EQ(raster.bits, 32);
    EXPECT_EQ(raster.format, SAMPLEFORMAT_IEEEFP);
    for (int j = 0; j < 259; ++j)
        for (int i = 0; i < 260; ++i) {
            const double expected = touched(grid_, i, j) ? static_cast<double>(grid_.at(i, j)) : -32768;
            ASSERT_NEAR(raster.at(i, j), expected, 1.0 / 128) << i << ", " << j;
        }
    expect_as_queried(out_, report, 0);
    expect_rebuilt_alike(out_);
}

TEST_F(ExportRaster, HeightsBeyondSixteenBitsTakeThirtyTwo) {
    grid_ = hills(40, 33, 1);
    for (float& z : grid_.z) z += 40000;
    write_heights_u16(dem_, grid_, nullptr);
    build_store_from({dem_, "--spacing", "10", "--texture-size", "64"}, store_);
    EXPECT_EQ(export_to(out_)["type"], "int32");
    const Raster raster = read_raster(out_);
    for (int j = 0; j < 33; ++j)
        for (int i = 0; i < 40; ++i) ASSERT_EQ(raster.at(i, j), grid_.at(i, j));
}

TEST_F(ExportRaster, ABoxHoldsTheSamplesWithinIt) {
    SCREE_TRACE_SEED();
    build_voids();
    Random random(seed());
    for (int round = 0; round < 12; ++round) {
        const int level = uniform(random, 1, 4), step = 16 >> level;
        const int left = uniform(random, -30, 280), top = uniform(random, -30, 250),
                  right = left + uniform(random, 16, 300), bottom = top + uniform(random, 16, 300);
        // A little within on every side, so that samples on the edges are left out, or a little beyond.
        const double margin = round % 2 == 0 ? 3 : -0.25;
        const std::string box = "--box=" + std::to_string(400000 + left * 10 + margin) + "," +
                                std::to_string(5300000 - bottom * 10 + margin) + "," +
                                std::to_string(400000 + right * 10 - margin) + "," +
                                std::to_string(5300000 - top * 10 - margin);
        SCOPED_TRACE(box + " level " + std::to_string(level));
        const auto within = [&](int at, int low, int high) {
            return at % step == 0 && (margin < 0 ? at >= low && at <= high : at > low && at < high);
        };
        std::vector<int> columns, rows;
        for (int i = 0; i < 300; ++i)
            if (within(i, left, right)) columns.push_back(i);
        for (int j = 0; j < 270; ++j)
            if (within(j, top, bottom)) rows.push_back(j);
        if (columns.empty() || rows.empty()) continue;
        const auto report = export_to(out_, {box, "--level", std::to_string(level), "--force"});
        EXPECT_EQ(report["origin_m"][0], 400000 + columns[0] * 10);
        EXPECT_EQ(report["origin_m"][1], 5300000 - rows[0] * 10);
        EXPECT_EQ(report["step_m"][0], step * 10);
        const Raster raster = read_raster(out_);
        ASSERT_EQ(raster.width, columns.size());
        ASSERT_EQ(raster.height, rows.size());
        for (std::size_t j = 0; j < rows.size(); ++j)
            for (std::size_t i = 0; i < columns.size(); ++i) {
                const int a = columns[i], b = rows[j];
                ASSERT_EQ(raster.at(static_cast<int>(i), static_cast<int>(j)),
                          touched(grid_, a, b) ? grid_.at(a, b) : -32768)
                    << a << ", " << b;
            }
    }
}

TEST_F(ExportRaster, ACoarserLevelIsEveryOtherSample) {
    grid_ = hills(300, 270, 3);  // without voids: coarse tiles answer
    write_heights_i16(dem_, grid_, {});
    build_store_from({dem_, "--texture-size", "64", "--fill", "none"}, store_);
    for (int level = 0; level < 4; ++level) {
        const int step = 16 >> level;
        export_to(out_, {"--level", std::to_string(level), "--force"});
        const Raster raster = read_raster(out_);
        ASSERT_EQ(raster.width, static_cast<std::uint32_t>(299 / step + 1));
        ASSERT_EQ(raster.height, static_cast<std::uint32_t>(269 / step + 1));
        for (int j = 0; j * step < 270; ++j)
            for (int i = 0; i * step < 300; ++i) ASSERT_EQ(raster.at(i, j), grid_.at(i * step, j * step));
    }
}

TEST_F(ExportRaster, ASizeSamplesTheSurface) {
    build_voids();
    // Every tenth of a metre between samples, and beyond the extent.
    auto report = export_to(out_, {"--box", "399953,5298011,402013.7,5300021", "--size", "129x65"});
    EXPECT_EQ(report["type"], "float32");
    EXPECT_EQ(report["size"], nlohmann::json({129, 65}));
    EXPECT_DOUBLE_EQ(report["step_m"][0].get<double>(), (402013.7 - 399953) / 128);
    expect_as_queried(out_, report, 1e-4);
    // Samples of the store are taken as they are.
    report = export_to(out_, {"--box", "400000,5297440,402560,5300000", "--size", "129", "--force"});
    EXPECT_EQ(report["type"], "int16");
    EXPECT_EQ(report["step_m"][0], 20);
    expect_as_queried(out_, report, 0);
}

TEST_F(ExportRaster, WhereDepthVariesTheLeafSurfaceAnswers) {
    write_heights_i16(dem_, hills(80, 70, 5), {400000, 5300000, 40, 32633});
    write_heights_i16(folder_.file("inset.tif"), hills(120, 100, 6), {401200, 5299200, 5, 32633});
    build_store_from({dem_, folder_.file("inset.tif"), "--texture-size", "64", "--tile-size", "9"}, store_);
    auto store = SqliteStore::open(store_);
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->dataset().coarsest_leaf_level) << "the test should meet leaves of several depths";
    const int finest = (*store)->dataset().lattice.deepest_level, coarsest = *(*store)->dataset().coarsest_leaf_level;
    for (const int level : {finest, finest - 1, coarsest}) {
        const auto report = export_to(out_, {"--level", std::to_string(level), "--force"});
        EXPECT_EQ(report["type"], level > coarsest ? "float32" : report["type"]);
        expect_as_queried(out_, report, 1e-4);
    }
    const auto info = report_of(scree({"info", store_, "--json", "-"}));
    EXPECT_EQ(info["coarsest_leaf_level"], coarsest);
    EXPECT_NE(scree({"info", store_}).out.find("depth varies"), std::string::npos);
}

using Texel = std::array<double, 4>;

// EXT_texture_compression_s3tc, unrounded.
Texel bc1_texel(const std::uint8_t* block, std::int64_t x, std::int64_t y) {
    const unsigned c0 = block[0] | unsigned{block[1]} << 8, c1 = block[2] | unsigned{block[3]} << 8;
    const unsigned index = block[4 + y] >> (2 * x) & 3;
    const auto part = [](unsigned c, std::size_t channel) {
        return channel == 0   ? (c >> 11) * 255 / 31.0
               : channel == 1 ? (c >> 5 & 63) * 255 / 63.0
                              : (c & 31) * 255 / 31.0;
    };
    Texel texel{0, 0, 0, c0 <= c1 && index == 3 ? 0.0 : 255.0};
    for (std::size_t k = 0; k < 3; ++k) {
        const double a = part(c0, k), b = part(c1, k);
        const double four[4] = {a, b, (2 * a + b) / 3, (a + 2 * b) / 3}, three[4] = {a, b, (a + b) / 2, 0};
        texel[k] = c0 > c1 ? four[index] : three[index];
    }
    return texel;
}

class ExportImagery : public ExportRaster {
protected:
    void SetUp() override {
        build_voids();
        const Place whole{399995, 5300005, 2.5, 32633, true};
        write_image(folder_.file("i.tif"), 1200, 1080, 3, 8, &whole, patchwork);
        build_store_from(
            {dem_, "--imagery", folder_.file("i.tif"), "--texture-size", "64", "--fill", "none", "--force"}, store_);
        open_store();
    }
    void open_store() {
        tiles_.clear();
        auto store = SqliteStore::open(store_);
        ASSERT_TRUE(store);
        opened_ = std::move(*store);
        auto reader = opened_->open_reader();
        ASSERT_TRUE(reader);
        reader_ = std::move(*reader);
    }
    // Of the finest stored tile at or above `level` there; nothing where no tile is.
    Texel texel_of(int level, std::int64_t c, std::int64_t r) {
        const Dataset& d = opened_->dataset();
        const int log2 = d.texture_size_log2;
        for (int l = level; l >= 0; --l, c >>= 1, r >>= 1) {
            const TileId id{l, c >> log2, r >> log2};
            auto known = tiles_.find(id);
            if (known == tiles_.end()) {
                TileRow row;
                const auto found = reader_->read(TileKind::texture, id, row);
                auto tile = *found ? read_texture_tile(*reader_, d, id) : Result<TextureTile>(TextureTile{});
                known = tiles_.emplace(id, *tile).first;
            }
            if (known->second.blocks.empty()) continue;
            if (l < level && known->second.child_mask != 0) return {};
            const std::int64_t x = c & (d.texture_size() - 1), y = r & (d.texture_size() - 1);
            return bc1_texel(
                known->second.blocks.data() + bc1_mip_offset(log2, 0) + 8 * (y / 4 * (d.texture_size() / 4) + x / 4),
                x % 4, y % 4);
        }
        return {};
    }
    // A tile above `level` that is not refined.
    bool ends_above(int level) {
        const Dataset& d = opened_->dataset();
        bool ends = false;
        (void)opened_->for_each(TileKind::texture, [&](const SqliteStore::RowView& row) {
            const auto id = tile_from_key(d.lattice, row.key);
            const auto tile = decode_texture_tile(row.payload, d.texture_size_log2, row.codec);
            ends = ends || (id && tile && id->level < level && tile->child_mask == 0);
            return !ends;
        });
        return ends;
    }
    void expect_texels(const Raster& raster, int level, std::int64_t column, std::int64_t row) {
        ASSERT_EQ(raster.channels, 4);
        std::int64_t transparent = 0;
        for (std::int64_t j = 0; j < raster.height; ++j)
            for (std::int64_t i = 0; i < raster.width; ++i) {
                const Texel expected = texel_of(level, column + i, row + j);
                for (int k = 0; k < 3; ++k)
                    ASSERT_NEAR(raster.at(i, j, k), expected[static_cast<std::size_t>(k)], 0.5 + 1e-9)
                        << i << ", " << j;
                ASSERT_EQ(raster.at(i, j, 3), expected[3]) << i << ", " << j;
                transparent += expected[3] == 0 ? 1 : 0;
            }
        EXPECT_GT(transparent, 0) << "the test should meet a void";
    }

    std::unique_ptr<SqliteStore> opened_;
    std::unique_ptr<TileReader> reader_;
    std::map<TileId, TextureTile> tiles_;
};

TEST_F(ExportImagery, TexelsAreThoseOfTheStoreAtEveryLevel) {
    const Dataset& d = opened_->dataset();
    for (int level = d.texture_deepest_level; level >= 0; --level) {
        SCOPED_TRACE(level);
        const auto report = export_to(out_, {"--level", std::to_string(level), "--force"}, "--imagery");
        const double texel_m = d.texel_m(level);
        EXPECT_EQ(report["step_m"][0], texel_m);
        EXPECT_EQ(report["size"], nlohmann::json({std::ceil(2990 / texel_m), std::ceil(2690 / texel_m)}));
        EXPECT_EQ(report["origin_m"], nlohmann::json({400000, 5300000}));
        expect_texels(read_raster(out_), level, 0, 0);
    }
}

TEST_F(ExportImagery, ABoxHoldsTheTexelsThatItMeets) {
    const Dataset& d = opened_->dataset();
    const int level = d.texture_deepest_level;
    const double w = d.texel_m(level);
    const auto report = export_to(out_, {"--box", "401201,5299001,402001,5299701"}, "--imagery");
    const auto column = static_cast<std::int64_t>(1201 / w), row = static_cast<std::int64_t>(299 / w);
    EXPECT_EQ(report["origin_m"],
              nlohmann::json({400000 + static_cast<double>(column) * w, 5300000 - static_cast<double>(row) * w}));
    const Raster raster = read_raster(out_);
    EXPECT_EQ(raster.width, std::ceil(2001 / w) - static_cast<double>(column));
    EXPECT_EQ(raster.height, std::ceil(999 / w) - static_cast<double>(row));
    expect_texels(raster, level, column, row);
}

TEST_F(ExportImagery, ACoarserTexelStandsForSeveralWhereTexturesEnd) {
    HeightGrid land = hills(80, 70, 5);
    for (int row = 29; row < 35; ++row) std::fill_n(&land.at(46, row), 3, -9999.0f);
    write_heights_i16(dem_, land, {400000, 5300000, 40, 32633}, "-9999");
    write_heights_i16(folder_.file("inset.tif"), hills(120, 100, 6), {401200, 5299200, 5, 32633});
    const auto image = [&](const std::string& name, int width, int height, const Place& place) {
        write_image(folder_.file(name), width, height, 3, 8, &place, patchwork);
        return folder_.file(name);
    };
    const std::string under = image("under.tif", 80, 70, {400000, 5300000, 40, 32633, true}),
                      fine = image("fine.tif", 120, 100, {401190, 5299210, 5, 32633, true});
    build_store_from({dem_, folder_.file("inset.tif"), "--imagery", under, fine, "--texture-size", "16", "--tile-size",
                      "9", "--fill", "none", "--force"},
                     store_);
    open_store();
    const int level = opened_->dataset().texture_deepest_level;
    ASSERT_TRUE(ends_above(level));
    export_to(out_, {}, "--imagery");
    expect_texels(read_raster(out_), level, 0, 0);
    // A box over the corner where the fine image ends.
    const double w = opened_->dataset().texel_m(level);
    export_to(out_, {"--force", "--box", "401700,5298400,402000,5298900"}, "--imagery");
    expect_texels(read_raster(out_), level, static_cast<std::int64_t>(1700 / w), static_cast<std::int64_t>(1100 / w));
}

nlohmann::json gdalinfo(const std::string& file) {
    const auto run = run_program("gdalinfo", {"-json", file});
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    return nlohmann::json::parse(run.out, nullptr, false);
}

TEST_F(ExportImagery, GdalReadsPlaceCrsAndNodata) {
    if (!on_path("gdalinfo")) GTEST_SKIP() << "needs gdalinfo (gdal-bin)";
    export_to(out_);
    auto info = gdalinfo(out_);
    ASSERT_TRUE(info.is_object());
    EXPECT_EQ(info["size"], nlohmann::json({300, 270}));
    // GDAL places the corner of a pixel whose middle is the sample.
    EXPECT_EQ(info["geoTransform"], nlohmann::json({399995.0, 10.0, 0.0, 5300005.0, 0.0, -10.0}));
    EXPECT_EQ(info["cornerCoordinates"]["lowerRight"], nlohmann::json({402995.0, 5297305.0}));
    EXPECT_EQ(info["metadata"][""]["AREA_OR_POINT"], "Point");
    EXPECT_EQ(info["bands"][0]["noDataValue"], -32768);
    EXPECT_EQ(info["bands"][0]["type"], "Int16");
    const std::string wkt = info["coordinateSystem"]["wkt"];
    EXPECT_NE(wkt.find("ID[\"EPSG\",32633]]"), std::string::npos) << wkt;

    export_to(out_, {"--force"}, "--imagery");
    info = gdalinfo(out_);
    EXPECT_EQ(info["geoTransform"], nlohmann::json({400000.0, 2.5, 0.0, 5300000.0, 0.0, -2.5}));
    EXPECT_EQ(info["metadata"][""]["AREA_OR_POINT"], "Area");
    ASSERT_EQ(info["bands"].size(), 4u);
    EXPECT_EQ(info["bands"][3]["colorInterpretation"], "Alpha");
}

TEST_F(ExportRaster, ACrsWithoutACodeIsSaidByKeysAndBySidecar) {
    write_geographic_heights(dem_, hills(90, 80, 8));
    const std::string conic = "+proj=lcc +lat_0=47.2 +lon_0=14.5 +lat_1=47 +lat_2=47.5 +datum=WGS84 +units=m";
    build_store_from({dem_, "--crs", conic, "--texture-size", "64"}, store_);
    const auto report = export_to(out_);
    EXPECT_EQ(report["projection_file"], folder_.file("out.prj"));
    const auto before = report_of(scree({"info", store_, "--json", "-"}));
    ASSERT_NE(before["crs"].get<std::string>().rfind("EPSG", 0), 0u);
    for (const bool with_sidecar : {true, false}) {
        SCOPED_TRACE(with_sidecar);
        if (!with_sidecar) std::filesystem::remove(folder_.file("out.prj"));
        build_store_from({out_, "--force"}, folder_.file("again.scree"));
        const auto after = report_of(scree({"info", folder_.file("again.scree"), "--json", "-"}));
        EXPECT_EQ(after["origin_m"], before["origin_m"]);
        EXPECT_EQ(after["cells"], before["cells"]);
        ASSERT_EQ(after["corners_deg"].size(), 4u);
        for (int k = 0; k < 4; ++k)
            for (int c = 0; c < 2; ++c)
                EXPECT_NEAR(after["corners_deg"][k][c].get<double>(), before["corners_deg"][k][c].get<double>(), 1e-9);
    }
    const std::string told = scree({"info", store_}).out;
    EXPECT_EQ(told.find("PROJCRS"), std::string::npos) << told;
    if (!on_path("gdalinfo")) return;
    const std::string wkt = gdalinfo(out_)["coordinateSystem"]["wkt"];
    EXPECT_NE(wkt.find("Lambert Conic Conformal (2SP)"), std::string::npos) << wkt;
}

TEST_F(ExportRaster, OutputIsWholeOrAbsentAndNotReplacedUnasked) {
    build_voids();
    ProgramOptions full;
    full.largest_file_bytes = 20000;
    const auto run = scree({"export", store_, "--heights", out_, "--quiet"}, full);
    EXPECT_EQ(run.exit_code, 5) << describe(run);
    EXPECT_NE(run.err.find(out_), std::string::npos) << run.err;
    expect_only(folder_.file(""), {"d.tif", "s.scree"});

    export_to(out_);
    const auto before = read_bytes(out_);
    const auto refused = scree({"export", store_, "--heights", out_, "--level", "2", "--quiet"});
    EXPECT_EQ(refused.exit_code, 2) << describe(refused);
    EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
    EXPECT_TRUE(read_bytes(out_) == before);
    export_to(out_, {"--level", "2", "--force"});
    EXPECT_FALSE(read_bytes(out_) == before);
    expect_only(folder_.file(""), {"d.tif", "s.scree", "out.tif"});
}

TEST_F(ExportRaster, WhatCannotBeMeantIsRefused) {
    build_voids();
    const std::vector<std::vector<std::string>> wrong = {
        {},
        {"--heights", out_, "--imagery", out_},
        {"--heights", out_, "--level", "9"},
        {"--heights", out_, "--level=-1"},
        {"--imagery", out_, "--level", "99"},
        {"--heights", out_, "--box", "1,2,3"},
        {"--heights", out_, "--box", "1,2,3,nan"},
        {"--heights", out_, "--box", "400100,5299000,400000,5299500"},
        {"--heights", out_, "--box", "0,0,1,1"},
        {"--imagery", out_, "--box", "0,0,1,1"},
        {"--heights", out_, "--box", "0,0,1,1", "--size", "9"},
        {"--heights", out_, "--box", "400001,5299001,400002,5299002"},
        {"--heights", out_, "--size", "1"},
        {"--heights", out_, "--size", "x"},
        {"--heights", out_, "--size", "2000000000"},
        {"--heights", out_, "--size", "9", "--level", "1"},
        {"--imagery", out_, "--size", "9"},
        {"--heights", out_, "-o", out_},
        {"--texture", "0/0/0", "-o", out_, "--box", "0,0,1,1"},
    };
    for (const auto& more : wrong) {
        std::vector<std::string> arguments{"export", store_, "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const auto run = scree(arguments);
        EXPECT_EQ(run.exit_code, 2) << describe(run);
        EXPECT_NE(run.err, "");
    }
    expect_only(folder_.file(""), {"d.tif", "s.scree"});
}

TEST_F(ExportRaster, InfoTellsCornersAndFingerprints) {
    build_voids();
    const auto info = report_of(scree({"info", store_, "--json", "-"}));
    // As gdalinfo says it of (400000, 5300000).
    EXPECT_NEAR(info["corners_deg"][0][0].get<double>(), 13.663409, 1e-6);
    EXPECT_NEAR(info["corners_deg"][0][1].get<double>(), 47.845561, 1e-6);
    EXPECT_GT(info["corners_deg"][1][0], info["corners_deg"][0][0]);
    EXPECT_LT(info["corners_deg"][2][1], info["corners_deg"][0][1]);
    const std::string fingerprint = info["sources"][0]["fingerprint"];
    EXPECT_EQ(fingerprint.size(), 16u);
    const std::string told = scree({"info", store_}).out;
    EXPECT_NE(told.find(fingerprint), std::string::npos) << told;
    EXPECT_NE(told.find("EPSG:32633 (WGS 84 / UTM zone 33N)"), std::string::npos) << told;
    EXPECT_NE(told.find("NW 13.663409 47.845561"), std::string::npos) << told;
    // One sample changes the file, not its size.
    grid_.at(3, 3) += 1;
    write_heights_i16(dem_, grid_, {}, "-9999");
    build_store_from({dem_, "--texture-size", "64", "--force"}, store_);
    EXPECT_NE(report_of(scree({"info", store_, "--json", "-"}))["sources"][0]["fingerprint"], fingerprint);
}

}  // namespace
}  // namespace scree::test
