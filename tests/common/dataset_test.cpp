#include "common/dataset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using Json = nlohmann::ordered_json;

Dataset example() {
    Dataset d;
    d.lattice = *make_lattice(304814.5, 2789143.25, 20, 1000, 700, 5);
    d.crs = "EPSG:32651";
    d.crs_name = "WGS 84 / UTM zone 51N";
    d.vertical_datum = "EPSG:5773";
    d.height_offset_m = -12.5;
    d.height_quantum_m = 1.0 / 64;
    d.height_quantum_error_m = 1.0 / 128;
    d.warp_error_m = 0.1;
    d.min_height_m = 3.7;
    d.max_height_m = 1093.2000000000001;
    d.texture_size_log2 = 8;
    d.texture_deepest_level = 4;
    d.has_imagery = true;
    d.height_tiles = 1000;
    d.texture_tiles = 300;
    d.present_cells = 699999;
    d.sources = {{"dem \xC3\xA9.tif", "heights", 1 << 20, 1001, 701}, {"photo.tif", "imagery", 1LL << 40, 8000, 5600}};
    d.attribution = "\"quoted\", \\ and\nlines";
    return d;
}

TEST(DatasetJson, ComesBackExactlyAndIsDeterministic) {
    const Dataset d = example();
    const std::string text = dataset_to_json(d);
    const auto back = dataset_from_json(text);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(dataset_to_json(*back), text);
    EXPECT_EQ(back->lattice, d.lattice);
    EXPECT_EQ(back->max_height_m, d.max_height_m);
    EXPECT_EQ(back->warp_error_m, d.warp_error_m);
    ASSERT_EQ(back->sources.size(), 2u);
    EXPECT_EQ(back->sources[1].bytes, 1LL << 40);
    EXPECT_EQ(back->sources[0].name, d.sources[0].name);
    EXPECT_EQ(back->attribution, d.attribution);
    EXPECT_TRUE(back->has_imagery);
}

TEST(DatasetJson, FingerprintsOfSourcesMayBeMissingAndAreCheckedWhereTheyStand) {
    Dataset d = example();
    EXPECT_EQ(dataset_to_json(d).find("fingerprint"), std::string::npos);
    d.sources[1].fingerprint = "0123456789abcdef";
    const std::string text = dataset_to_json(d);
    const auto back = dataset_from_json(text);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->sources[0].fingerprint, "");
    EXPECT_EQ(back->sources[1].fingerprint, "0123456789abcdef");
    EXPECT_EQ(dataset_to_json(*back), text);
    for (const char* wrong : {"\"\"", "\"0123456789abcde\"", "\"0123456789ABCDEF\"", "\"0123456789abcdef0\"", "7"}) {
        std::string bad = text;
        bad.replace(bad.find("\"0123456789abcdef\""), 18, wrong);
        const auto refused = dataset_from_json(bad);
        ASSERT_FALSE(refused.ok()) << wrong;
        EXPECT_NE(refused.error().message.find("fingerprint"), std::string::npos) << refused.error().message;
    }
}

TEST(DatasetJson, SidecarsOfASourceComeBack) {
    Dataset d = example();
    EXPECT_EQ(dataset_to_json(d).find("sidecars"), std::string::npos);
    d.sources[0].sidecars = {{"dem.prj", "0123456789abcdef"}, {"dem.tfw", "fedcba9876543210"}};
    const auto back = dataset_from_json(dataset_to_json(d));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->sources[0].sidecars, d.sources[0].sidecars);
    EXPECT_TRUE(back->sources[1].sidecars.empty());
    d.sources[0].sidecars["dem.prj"] = "no digits";
    const auto refused = dataset_from_json(dataset_to_json(d));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("sidecars"), std::string::npos) << refused.error().message;
}

TEST(DatasetJson, TheLevelOfTheCoarsestLeafIsSaidWhereDepthVariesOnly) {
    Dataset d = example();
    EXPECT_EQ(dataset_to_json(d).find("coarsest_leaf_level"), std::string::npos);
    EXPECT_EQ(dataset_from_json(dataset_to_json(d))->least_leaf_level(), d.lattice.deepest_level);
    d.coarsest_leaf_level = 2;
    const std::string text = dataset_to_json(d);
    const auto back = dataset_from_json(text);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->coarsest_leaf_level, 2);
    EXPECT_EQ(back->least_leaf_level(), 2);
    EXPECT_EQ(dataset_to_json(*back), text);
    for (const Json& value : {Json(-1), Json(d.lattice.deepest_level), Json(1e300), Json("2"), Json(nullptr)}) {
        Json bad = Json::parse(text);
        bad["coarsest_leaf_level"] = value;
        EXPECT_FALSE(dataset_from_json(bad.dump()).ok()) << value;
    }
}

TEST(Dataset, ExaggeratedIsAllThatIsInMetresOfHeightAndNothingElse) {
    const Dataset plain = example();
    Dataset d = plain;
    ASSERT_TRUE(d.exaggerate(4).ok());
    EXPECT_EQ(d.exaggeration, 4);
    EXPECT_EQ(d.height_offset_m, 4 * plain.height_offset_m);
    EXPECT_EQ(d.height_quantum_m, 4 * plain.height_quantum_m);
    EXPECT_EQ(d.height_quantum_error_m, 4 * plain.height_quantum_error_m);
    EXPECT_EQ(d.warp_error_m, 4 * plain.warp_error_m);
    EXPECT_EQ(d.min_height_m, 4 * plain.min_height_m);
    EXPECT_EQ(d.max_height_m, 4 * plain.max_height_m);
    EXPECT_EQ(d.lattice, plain.lattice);
    ASSERT_TRUE(d.exaggerate(0.25).ok());
    EXPECT_EQ(dataset_to_json(d), dataset_to_json(plain));
    for (const double factor : {0.0, -1.0, 0.009, 101.0, std::nan("")})
        EXPECT_EQ(d.exaggerate(factor).error().code, ErrorCode::usage) << factor;
    d.height_quantum_m = 1e5;
    EXPECT_EQ(d.exaggerate(100).error().code, ErrorCode::usage) << "a quantum of 10 000 km";
}

TEST(DatasetJson, NumbersKeepEveryBit) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::uniform_real_distribution<double> place(-9e8, 9e8);
    for (int k = 0; k < 2000; ++k) {
        Dataset d = example();
        d.lattice.origin_x_m = place(random);
        d.lattice.origin_y_m = place(random);
        d.height_offset_m = place(random) * 1e-6;
        const auto back = dataset_from_json(dataset_to_json(d));
        ASSERT_TRUE(back.ok());
        ASSERT_EQ(back->lattice.origin_x_m, d.lattice.origin_x_m);
        ASSERT_EQ(back->lattice.origin_y_m, d.lattice.origin_y_m);
        ASSERT_EQ(back->height_offset_m, d.height_offset_m);
    }
}

TEST(DatasetJson, EveryMissingFieldIsNamed) {
    const Json good = Json::parse(dataset_to_json(example()));
    for (const auto& item : good.items()) {
        Json bad = good;
        bad.erase(item.key());
        const auto result = dataset_from_json(bad.dump());
        ASSERT_FALSE(result.ok()) << item.key();
        EXPECT_EQ(result.error().code, ErrorCode::store);
        EXPECT_NE(result.error().message.find(item.key()), std::string::npos) << result.error().message;
    }
}

TEST(DatasetJson, EveryFieldOfAnotherTypeIsRefused) {
    const Json good = Json::parse(dataset_to_json(example()));
    for (const auto& item : good.items()) {
        for (const Json& value : {Json(nullptr), Json::object(), Json::array({1}), Json::array({Json::array()})}) {
            Json bad = good;
            bad[item.key()] = value;
            EXPECT_FALSE(dataset_from_json(bad.dump()).ok()) << item.key() << " = " << value;
        }
        if (!item.value().is_string()) {
            Json bad = good;
            bad[item.key()] = "text";
            EXPECT_FALSE(dataset_from_json(bad.dump()).ok()) << item.key();
        }
    }
}

TEST(DatasetJson, ValuesOutOfRangeAreRefused) {
    const Json good = Json::parse(dataset_to_json(example()));
    const auto refused = [&](const char* key, const Json& value) {
        Json bad = good;
        bad[key] = value;
        return !dataset_from_json(bad.dump()).ok();
    };
    for (const char* key :
         {"cells_x", "cells_y", "deepest_level", "tile_cells_log2", "root_rows", "root_columns", "texture_size_log2",
          "texture_deepest_level", "height_tiles", "texture_tiles", "present_cells"})
        for (const Json& value : {Json(-1), Json(INT64_MAX), Json(INT64_MIN), Json(UINT64_MAX), Json(1e300), Json(0.5)})
            EXPECT_TRUE(refused(key, value) || (value == INT64_MAX && (std::string(key).ends_with("tiles") ||
                                                                       std::string(key) == "present_cells")))
                << key << " = " << value;
    for (const Json& value : {Json(0), Json(-1), Json(1e300)}) {
        EXPECT_TRUE(refused("spacing_m", value));
        EXPECT_TRUE(refused("height_quantum_m", value));
    }
    EXPECT_TRUE(refused("origin_x_m", 1e300));
    EXPECT_TRUE(refused("min_height_m", 5000));  // above the maximum
    EXPECT_TRUE(refused("height_tiles", 0));
}

TEST(DatasetJson, AnotherVersionIsRefusedAndBothAreNamed) {
    Json json = Json::parse(dataset_to_json(example()));
    json["format_version"] = 77;
    const auto result = dataset_from_json(json.dump());
    ASSERT_FALSE(result.ok());
    EXPECT_NE(result.error().message.find("77"), std::string::npos);
    EXPECT_NE(result.error().message.find(std::to_string(kFormatVersion)), std::string::npos);
}

TEST(DatasetJson, TextThatIsNoDescriptionIsRefused) {
    for (const std::string& text :
         {std::string(), std::string("null"), std::string("[]"), std::string("{"), std::string("{}"),
          std::string("\xFF\xFE"), std::string(1000000, '['), std::string(100000, '{'),
          std::string("{\"format_version\":1e999}"), std::string("{\"format_version\":NaN}"), std::string("\0{}", 3)})
        EXPECT_FALSE(dataset_from_json(text).ok()) << text.substr(0, 30);
}

TEST(DatasetJson, RandomChangesNeverCrash) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const std::string good = dataset_to_json(example());
    for (int k = 0; k < 20000; ++k) {
        std::string text = good;
        for (int changes = test::uniform(random, 1, 4); changes > 0; --changes)
            text[random() % text.size()] = static_cast<char>(random());
        const auto result = dataset_from_json(text);
        if (result) {
            EXPECT_TRUE(result->check().ok());
        }
    }
}

}  // namespace
}  // namespace scree
