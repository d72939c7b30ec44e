#include "tools/pyramid/build_record.h"

#include <gtest/gtest.h>

#include "common/store/height_codec.h"

namespace scree {
namespace {

using Record = std::map<std::string, std::string>;

// A value for each that is not the default.
const Record kAll = {{"crs", "EPSG:32633"},
                     {"assume-crs", "EPSG:4326"},
                     {"assume-same-datum", "yes"},
                     {"resampling", "cubic"},
                     {"fill", "12.5"},
                     {"spacing", "2.5"},
                     {"height-scale", "0.1"},
                     {"height-offset", "-7"},
                     {"vertical-crs", "EPSG:5773"},
                     {"nodata", "-9999"},
                     {"height-quantum", "0.25"},
                     {"height-codec", "raw"},
                     {"bands", "3,2,1"},
                     {"stretch", "auto 10,900"},
                     {"imagery-nodata", "0"},
                     {"texture-quality", "high"},
                     {"tile-size", "17"},
                     {"texture-size", "64"}};

TEST(BuildRecord, EveryOptionComesBack) {
    for (const std::string& name : recorded_options()) {
        ASSERT_EQ(kAll.count(name), 1u) << "no value here for --" << name;
        const Record record{{name, kAll.at(name)}};
        BuildOptions options;
        const auto applied = apply_record(record, options);
        ASSERT_TRUE(applied) << applied.error().message;
        EXPECT_EQ(options_record(options, options.colours.stretch), record);
    }
    BuildOptions options;
    ASSERT_TRUE(apply_record(kAll, options));
    EXPECT_EQ(options_record(options, options.colours.stretch), kAll);
}

TEST(BuildRecord, DefaultsAreNotRecorded) { EXPECT_EQ(options_record({}, std::nullopt), Record{}); }

TEST(BuildRecord, EveryHeightCodecIsRecordedByItsName) {
    for (const NamedHeightCodec& codec : height_codecs()) {
        BuildOptions options;
        options.height_codec = codec.codec;
        const Record record = options_record(options, std::nullopt);
        EXPECT_EQ(record,
                  codec.codec == BuildOptions{}.height_codec ? Record{} : Record({{"height-codec", codec.name}}));
        BuildOptions again;
        ASSERT_TRUE(apply_record(record, again));
        EXPECT_EQ(again.height_codec, codec.codec);
    }
}

TEST(BuildRecord, WhatIsUnknownIsRefusedAndNamed) {
    for (const auto& [name, value] : {std::pair{"no-such-option", "1"}, std::pair{"height-codec", "newer"}}) {
        BuildOptions options;
        const auto applied = apply_record({{name, value}}, options);
        ASSERT_FALSE(applied);
        EXPECT_EQ(applied.error().code, ErrorCode::store);
        EXPECT_NE(applied.error().message.find(std::string("--") + name + " " + value), std::string::npos);
    }
}

}  // namespace
}  // namespace scree
