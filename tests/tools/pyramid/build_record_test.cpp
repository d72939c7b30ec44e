#include "tools/pyramid/build_record.h"

#include <gtest/gtest.h>

#include "common/store/height_codec.h"
#include "tools/pyramid/build_state.h"

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
                     {"source-vertical-crs", "a.tif=EPSG:5773\nb=c.tif=EPSG:3855"},
                     {"height-encoding", "mapbox"},
                     {"nodata", "-9999"},
                     {"height-quantum", "0.25"},
                     {"height-codec", "raw"},
                     {"texture-codec", "raw"},
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

TEST(BuildState, NamesTheSidecarThatChanged) {
    Dataset begun;
    begun.sources.push_back({"a.flt", "heights", 8, 2, 2, "0123456789abcdef"});
    begun.sources.push_back({"b.flt", "heights", 8, 2, 2, "0123456789abcdef"});
    begun.sources[1].sidecars = {{"b.hdr", "00000000000000aa"}, {"b.prj", "00000000000000bb"}};
    const auto difference = [&](const std::map<std::string, std::string>& sidecars) {
        Dataset now = begun;
        now.sources[1].sidecars = sidecars;
        return identity_difference(identity_of(begun), identity_of(now)).value_or("none");
    };
    EXPECT_EQ(difference(begun.sources[1].sidecars), "none");
    EXPECT_EQ(difference({{"b.hdr", "00000000000000aa"}, {"b.prj", "00000000000000bc"}}),
              "other sidecars: since then b.prj has changed");
    EXPECT_EQ(difference({{"b.prj", "00000000000000bb"}}), "other sidecars: since then b.hdr is gone");
    EXPECT_EQ(difference({}), "other sidecars: since then b.hdr is gone, b.prj is gone");
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

TEST(BuildRecord, EveryTextureCodecIsRecordedByItsName) {
    for (const NamedTextureCodec& codec : texture_codecs()) {
        BuildOptions options;
        options.texture_codec = codec.codec;
        const Record record = options_record(options, std::nullopt);
        EXPECT_EQ(record,
                  codec.codec == BuildOptions{}.texture_codec ? Record{} : Record({{"texture-codec", codec.name}}));
        BuildOptions again;
        ASSERT_TRUE(apply_record(record, again));
        EXPECT_EQ(again.texture_codec, codec.codec);
    }
}

TEST(BuildRecord, WhatIsUnknownIsRefusedAndNamed) {
    for (const auto& [name, value] :
         {std::pair{"no-such-option", "1"}, std::pair{"height-codec", "newer"}, std::pair{"texture-codec", "newer"}}) {
        BuildOptions options;
        const auto applied = apply_record({{name, value}}, options);
        ASSERT_FALSE(applied);
        EXPECT_EQ(applied.error().code, ErrorCode::store);
        EXPECT_NE(applied.error().message.find(std::string("--") + name + " " + value), std::string::npos);
    }
}

}  // namespace
}  // namespace scree
