#include "common/store/height_codec.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "common/mesh/geometric_error.h"
#include "common/store/byte_io.h"
#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

std::vector<HeightCodec> all_codecs() {
    std::vector<HeightCodec> all;
    for (const NamedHeightCodec& named : height_codecs()) all.push_back(named.codec);
    return all;
}
const std::vector<HeightCodec> kCodecs = all_codecs();

TEST(HeightCodec, EveryOneHasANumberAndANameOfItsOwn) {
    std::set<std::string> names;
    for (std::size_t k = 0; k < kCodecs.size(); ++k) {
        EXPECT_EQ(static_cast<std::size_t>(kCodecs[k]), k);
        EXPECT_TRUE(names.insert(height_codecs()[k].name).second) << height_codecs()[k].name;
    }
    // Stores have them by these.
    EXPECT_STREQ(height_codecs()[0].name, "raw");
    EXPECT_STREQ(height_codecs()[1].name, "plane");
}

HeightBounds random_bounds(test::Random& random, int n) {
    HeightBounds bounds;
    bounds.min_n = test::uniform(random, -kMaxHeightUnits, 0);
    bounds.max_n = test::uniform(random, 0, kMaxHeightUnits);
    float error = 0;
    for (int g = 0; g < n; ++g)
        bounds.error_n[static_cast<std::size_t>(g)] = error += static_cast<float>(test::uniform(random, 0, 1000)) / 8;
    return bounds;
}

HeightTile random_tile(test::Random& random, int n, int amplitude) {
    HeightTile tile;
    tile.header.child_mask = static_cast<std::uint8_t>(test::uniform(random, 0, 15));
    tile.header.leaf_mask = static_cast<std::uint8_t>(test::uniform(random, 0, 15) & tile.header.child_mask);
    tile.header.texture_ends = test::uniform(random, 0, 1) == 1;
    tile.header.texture_end_mask = static_cast<std::uint8_t>(test::uniform(random, 0, 15) & tile.header.child_mask);
    tile.header.own = random_bounds(random, n);
    for (std::size_t q = 0; q < 4; ++q)
        if ((tile.header.child_mask >> q & 1) != 0) tile.header.children[q] = random_bounds(random, n);
    tile.samples = test::random_samples(random, n, amplitude);
    switch (test::uniform(random, 0, 3)) {
        case 0:
            tile.presence = test::random_presence(random, n, 50);
            break;
        case 1:
            tile.presence.assign(std::size_t{1} << (2 * n), 0);
            break;
        case 2:
            tile.presence.assign(std::size_t{1} << (2 * n), 1);
            break;
        default:
            break;
    }
    return tile;
}

HeightTile small_tile() {
    test::Random random(7);
    HeightTile tile = random_tile(random, 2, 1000);
    tile.header.child_mask = 5;
    tile.header.leaf_mask = 4;
    tile.header.texture_ends = false;
    tile.header.texture_end_mask = 1;
    tile.header.children = {};
    tile.header.children[0] = tile.header.children[2] = tile.header.own;
    tile.presence = test::random_presence(random, 2, 50);
    return tile;
}

TEST(HeightCodec, RandomTilesComeBackExactly) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 300; ++k) {
        const int n = test::uniform(random, kMinTileCellsLog2, 6);
        constexpr int kAmplitudes[] = {0, 1, 100, 40000, kMaxHeightUnits};
        const HeightTile tile = random_tile(random, n, kAmplitudes[test::uniform(random, 0, 4)]);
        for (const HeightCodec codec : kCodecs) {
            const auto bytes = encode_height_tile(tile, n, codec);
            const auto back = decode_height_tile(bytes, n, static_cast<int>(codec));
            ASSERT_TRUE(back.ok()) << back.error().message;
            ASSERT_EQ(*back, tile);
        }
    }
}

TEST(HeightCodec, AHeightOutOfRangeIsRefusedWhereverItStands) {
    const HeightTile sound = small_tile();
    for (const HeightCodec codec : kCodecs)
        for (std::size_t k = 0; k < sound.samples.size(); ++k)
            for (const std::int32_t bad :
                 {kMaxHeightUnits + 1, -kMaxHeightUnits - 1, std::int32_t{1} << 30, -(std::int32_t{1} << 30)}) {
                HeightTile tile = sound;
                tile.samples[k] = bad;
                EXPECT_FALSE(decode_height_tile(encode_height_tile(tile, 2, codec), 2, static_cast<int>(codec)).ok());
            }
}

TEST(HeightCodec, ATileDecodedIntoAnUsedOneKeepsNothingOfIt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    HeightTile reused;
    for (int k = 0; k < 300; ++k) {
        const int n = test::uniform(random, kMinTileCellsLog2, 5);
        const HeightTile tile = random_tile(random, n, 1000);
        const HeightCodec codec = kCodecs[static_cast<std::size_t>(k) % kCodecs.size()];
        auto bytes = encode_height_tile(tile, n, codec);
        ASSERT_TRUE(decode_height_tile(bytes, n, static_cast<int>(codec), reused).ok());
        ASSERT_EQ(reused, tile);
        bytes.resize(bytes.size() / 2);
        ASSERT_FALSE(decode_height_tile(bytes, n, static_cast<int>(codec), reused).ok());
    }
}

TEST(HeightCodec, ExtremesAlternatingFromSampleToSampleComeBackExactly) {
    for (int n = kMinTileCellsLog2; n <= kMaxTileCellsLog2; ++n) {
        HeightTile tile;
        const std::size_t pitch = (std::size_t{1} << n) + 1;
        tile.samples.resize(pitch * pitch);
        for (std::size_t k = 0; k < tile.samples.size(); ++k)
            tile.samples[k] = (k % pitch + k / pitch) % 2 == 0 ? kMaxHeightUnits : -kMaxHeightUnits;
        for (const HeightCodec codec : kCodecs) {
            const auto back = decode_height_tile(encode_height_tile(tile, n, codec), n, static_cast<int>(codec));
            ASSERT_TRUE(back.ok());
            EXPECT_EQ(*back, tile);
        }
    }
}

// docs/store-format.md, "Example".
TEST(HeightCodec, TheDocumentedExampleIsWhatTheCodeWrites) {
    HeightTile tile;
    tile.samples = {100, 110, 120, 130, 140, 97,  131, 117, 127, 137, 94,  104, 114,
                    124, 134, 91,  101, 111, 121, 131, 88,  98,  108, 118, 128};
    tile.presence.assign(16, 1);
    tile.presence[14] = tile.presence[15] = 0;
    tile.header.own = {88, 140, {0.0f, 24.0f}};
    const auto vertices = present_vertices(tile.presence, 2);
    const auto errors = leaf_errors({tile.samples.data(), vertices.data(), 2});
    EXPECT_EQ(errors[0], 0);
    EXPECT_EQ(errors[1], 24);

    const auto raw = encode_height_tile(tile, 2, HeightCodec::raw);
    ASSERT_EQ(raw.size(), 120u);
    const std::vector<std::uint8_t> header = {0, 1, 0x58, 0, 0, 0, 0x8c, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xc0, 0x41, 0x64};
    EXPECT_TRUE(std::equal(header.begin(), header.end(), raw.begin()));
    EXPECT_EQ(raw[0x26], 0x61);
    EXPECT_EQ(raw[0x76], 0xff);
    EXPECT_EQ(raw[0x77], 0x3f);
    EXPECT_EQ(row_checksum(0, 1, 0, raw), 0xfd9981d51ac25892u);

    const auto plane = encode_height_tile(tile, 2, HeightCodec::plane);
    ASSERT_GT(plane.size(), 19u);
    EXPECT_TRUE(std::equal(plane.begin(), plane.begin() + 18, raw.begin()));
    EXPECT_EQ(plane[18], 1);
    const std::vector<std::uint8_t> content = {0xc8, 0x14, 0x14, 0x14, 0x14, 5, 0x30, 0x2f, 0, 0, 5, 0x2f, 0x30, 0,
                                               0,    5,    0,    0,    0,    0, 5,    0,    0, 0, 0, 0xff, 0x3f};
    std::vector<std::uint8_t> unpacked(content.size());
    ASSERT_EQ(ZSTD_decompress(unpacked.data(), unpacked.size(), plane.data() + 19, plane.size() - 19), content.size());
    EXPECT_EQ(unpacked, content);
}

TEST(HeightCodec, EveryTruncatedPrefixIsRefused) {
    for (const HeightCodec codec : kCodecs) {
        const auto bytes = encode_height_tile(small_tile(), 2, codec);
        ASSERT_TRUE(decode_height_tile(bytes, 2, static_cast<int>(codec)).ok());
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const auto result = decode_height_tile(std::span(bytes).first(size), 2, static_cast<int>(codec));
            ASSERT_FALSE(result.ok()) << size << " of " << bytes.size();
            EXPECT_EQ(result.error().code, ErrorCode::store);
        }
    }
}

TEST(HeightCodec, ExtraBytesAreRefused) {
    for (const HeightCodec codec : kCodecs) {
        for (const std::size_t extra : {1u, 8u, 1000u}) {
            auto bytes = encode_height_tile(small_tile(), 2, codec);
            bytes.resize(bytes.size() + extra, 0);
            EXPECT_FALSE(decode_height_tile(bytes, 2, static_cast<int>(codec)).ok()) << extra;
        }
        // A second frame behind the first.
        auto bytes = encode_height_tile(small_tile(), 2, codec);
        const auto twice = bytes;
        bytes.insert(bytes.end(), twice.begin(), twice.end());
        EXPECT_FALSE(decode_height_tile(bytes, 2, static_cast<int>(codec)).ok());
    }
}

TEST(HeightCodec, ATileOfAnotherSizeIsRefused) {
    for (const HeightCodec codec : kCodecs) {
        const auto bytes = encode_height_tile(small_tile(), 2, codec);
        for (int n = 3; n <= kMaxTileCellsLog2; ++n)
            EXPECT_FALSE(decode_height_tile(bytes, n, static_cast<int>(codec)).ok());
    }
}

TEST(HeightCodec, UnknownCodecsAreRefused) {
    const int next = static_cast<int>(kCodecs.size());
    for (const HeightCodec known : kCodecs) {
        const auto bytes = encode_height_tile(small_tile(), 2, known);
        for (const int codec :
             {-1, next, next + 1, 255, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
            const auto result = decode_height_tile(bytes, 2, codec);
            ASSERT_FALSE(result.ok()) << codec;
            // That it is unknown, not that what it would have made of the bytes is damaged.
            EXPECT_NE(result.error().message.find(fmt::format("unknown codec {}", codec)), std::string::npos)
                << result.error().message;
        }
    }
}

TEST(HeightCodec, HeaderFieldsOutOfRangeAreRefused) {
    const auto good = encode_height_tile(small_tile(), 2, HeightCodec::raw);
    const auto refused = [&](std::size_t offset, std::vector<std::uint8_t> bytes) {
        auto bad = good;
        std::copy(bytes.begin(), bytes.end(), bad.begin() + static_cast<std::ptrdiff_t>(offset));
        return !decode_height_tile(bad, 2, 0).ok();
    };
    const auto float_bytes = [](float v) {
        std::vector<std::uint8_t> out;
        ByteWriter(out).f32(v);
        return out;
    };
    const auto int_bytes = [](std::int32_t v) {
        std::vector<std::uint8_t> out;
        ByteWriter(out).i32(v);
        return out;
    };
    EXPECT_EQ(good[0], 0x45);
    EXPECT_EQ(good[1], 0x11);
    EXPECT_TRUE(refused(0, {0x25}));  // a leaf among children that do not exist
    EXPECT_TRUE(refused(0, {0xFF}));  // children whose bounds are not there
    EXPECT_FALSE(refused(0, {0x55}));
    EXPECT_TRUE(refused(1, {0x15}));  // flags that mean nothing
    EXPECT_TRUE(refused(1, {0x19}));
    EXPECT_TRUE(refused(1, {0x81}));  // textures that end at children that do not exist
    EXPECT_FALSE(refused(1, {0x53}));
    EXPECT_TRUE(refused(2, int_bytes(-kMaxHeightUnits - 1)));  // minimum
    EXPECT_TRUE(refused(2, int_bytes(kMaxHeightUnits)));       // above the maximum
    EXPECT_TRUE(refused(6, int_bytes(kMaxHeightUnits + 1)));   // maximum
    for (const std::size_t bounds : {2u, 18u, 34u})            // own, child 0, child 2
        for (const float bad :
             {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f, 1e9f}) {
            EXPECT_TRUE(refused(bounds + 8, float_bytes(bad))) << bounds << " " << bad;
            EXPECT_TRUE(refused(bounds + 12, float_bytes(bad))) << bounds << " " << bad;
        }
    EXPECT_TRUE(refused(14, float_bytes(0.0f)));               // an error that falls with the level
    EXPECT_TRUE(refused(50, int_bytes(kMaxHeightUnits + 1)));  // a sample
    EXPECT_TRUE(refused(50, int_bytes(std::numeric_limits<std::int32_t>::min())));
    EXPECT_FALSE(refused(50, int_bytes(-kMaxHeightUnits)));
}

TEST(HeightCodec, PlaneCountsOutOfRangeAreRefused) {
    const auto good = encode_height_tile(small_tile(), 2, HeightCodec::plane);
    for (int planes = 0; planes < 256; ++planes) {
        auto bad = good;
        if (bad[50] == planes) continue;
        bad[50] = static_cast<std::uint8_t>(planes);
        EXPECT_FALSE(decode_height_tile(bad, 2, 1).ok()) << planes;
    }
}

TEST(HeightCodec, RandomBitFlipsNeverCrashAndNeverYieldHeightsOutOfRange) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 20000; ++k) {
        const HeightCodec codec = kCodecs[static_cast<std::size_t>(k) % kCodecs.size()];
        auto bytes = encode_height_tile(small_tile(), 2, codec);
        for (int flips = test::uniform(random, 1, 4); flips > 0; --flips) {
            const int bit = test::uniform(random, 0, static_cast<int>(bytes.size()) * 8 - 1);
            bytes[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1 << bit % 8);
        }
        const auto tile = decode_height_tile(bytes, 2, static_cast<int>(codec));
        if (!tile) continue;
        ASSERT_EQ(tile->samples.size(), 25u);
        for (const std::int32_t z : tile->samples) ASSERT_LE(std::abs(z), kMaxHeightUnits);
    }
}

}  // namespace
}  // namespace scree
