#include "common/store/texture_codec.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <algorithm>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr TextureCodec kCodecs[] = {TextureCodec::raw, TextureCodec::split};

TextureTile random_tile(test::Random& random, int size_log2, bool noisy) {
    TextureTile tile;
    tile.child_mask = static_cast<std::uint8_t>(test::uniform(random, 0, 15));
    tile.blocks.resize(bc1_chain_bytes(size_log2));
    for (auto& byte : tile.blocks) byte = noisy ? static_cast<std::uint8_t>(random()) : std::uint8_t{0};
    return tile;
}

TEST(TextureTile, OffsetsOfMipsTileTheChainCoarsestFirst) {
    for (int log2 = kMinTextureSizeLog2; log2 <= kMaxTextureSizeLog2; ++log2) {
        EXPECT_EQ(bc1_mip_offset(log2, log2), 0u);
        for (int mip = log2; mip > 0; --mip)
            EXPECT_EQ(bc1_mip_offset(log2, mip) + bc1_mip_bytes(log2, mip), bc1_mip_offset(log2, mip - 1));
        EXPECT_EQ(bc1_mip_offset(log2, 0) + bc1_mip_bytes(log2, 0), bc1_chain_bytes(log2));
    }
    for (int log2 = 3; log2 <= kMaxTextureSizeLog2; ++log2) {  // the closed form of docs/store-format.md
        const std::size_t half_square = std::size_t{1} << (2 * log2 - 1);
        EXPECT_EQ(bc1_mip_offset(log2, 0), 24 + (half_square - 32) / 3);
    }
    EXPECT_EQ(bc1_chain_bytes(8), 43704u);  // 32768 + 8192 + 2048 + 512 + 128 + 32 + 3 * 8
}

TEST(TextureCodec, RandomTilesComeBackExactly) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 60; ++k) {
        const int log2 = test::uniform(random, kMinTextureSizeLog2, 8);
        const TextureTile tile = random_tile(random, log2, k % 3 != 0);
        for (const TextureCodec codec : kCodecs) {
            const auto back =
                decode_texture_tile(encode_texture_tile(tile, log2, codec), log2, static_cast<int>(codec));
            ASSERT_TRUE(back.ok()) << back.error().message;
            ASSERT_EQ(*back, tile);
        }
    }
}

TEST(TextureCodec, TilesOfTheGreatestSizeComeBackExactly) {
    test::Random random(1);
    for (const bool noisy : {false, true}) {
        const TextureTile tile = random_tile(random, kMaxTextureSizeLog2, noisy);
        const auto back = decode_texture_tile(encode_texture_tile(tile, kMaxTextureSizeLog2, TextureCodec::split),
                                              kMaxTextureSizeLog2, static_cast<int>(TextureCodec::split));
        ASSERT_TRUE(back.ok()) << back.error().message;
        ASSERT_EQ(*back, tile);
    }
}

/// What docs/store-format.md says a frame of codec 1 holds.
std::vector<std::uint8_t> planes_and_selectors(const TextureTile& tile) {
    std::vector<std::uint8_t> content;
    for (std::size_t byte = 0; byte < 4; ++byte)
        for (std::size_t at = byte; at < tile.blocks.size(); at += 8) content.push_back(tile.blocks[at]);
    for (std::size_t at = 4; at < tile.blocks.size(); at += 8)
        content.insert(content.end(), &tile.blocks[at], &tile.blocks[at] + 4);
    return content;
}

TEST(TextureCodec, TheSplitFrameHoldsPlanesAndSelectorsAsDocumented) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const int log2 : {kMinTextureSizeLog2, 4, 8})
        for (const bool noisy : {false, true}) {
            const TextureTile tile = random_tile(random, log2, noisy);
            const auto payload = encode_texture_tile(tile, log2, TextureCodec::split);
            std::vector<std::uint8_t> content(tile.blocks.size());
            ASSERT_EQ(ZSTD_decompress(content.data(), content.size(), payload.data() + 1, payload.size() - 1),
                      content.size());
            EXPECT_EQ(content, planes_and_selectors(tile));
        }
}

TEST(TextureCodec, AnyFrameOfTheDocumentedContentIsRead) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const int level : {-5, 1, 19}) {
        const TextureTile tile = random_tile(random, 8, level == 1);
        const auto content = planes_and_selectors(tile);
        std::vector<std::uint8_t> payload(1 + ZSTD_compressBound(content.size()));
        payload[0] = tile.child_mask;
        payload.resize(1 +
                       ZSTD_compress(payload.data() + 1, payload.size() - 1, content.data(), content.size(), level));
        const auto back = decode_texture_tile(payload, 8, static_cast<int>(TextureCodec::split));
        ASSERT_TRUE(back.ok()) << back.error().message;
        EXPECT_EQ(*back, tile);
    }
}

/// Endpoints that rise slowly, as in photographs; selectors at random or all alike.
TextureTile smooth_tile(test::Random& random, bool flat) {
    TextureTile tile = random_tile(random, 8, true);
    for (std::size_t at = 0; at < tile.blocks.size(); at += 8) {
        tile.blocks[at + 1] = tile.blocks[at + 3] = static_cast<std::uint8_t>(at / 4096);
        tile.blocks[at] = static_cast<std::uint8_t>(test::uniform(random, 0, 15));
        tile.blocks[at + 2] = static_cast<std::uint8_t>(test::uniform(random, 0, 15));
        if (flat) std::fill_n(&tile.blocks[at + 4], 4, std::uint8_t{0xAA});
    }
    return tile;
}

TEST(TextureCodec, EndpointsArePackedAndFlatSelectorsToo) {
    test::Random random(1);
    const std::size_t size = bc1_chain_bytes(8);
    EXPECT_LT(encode_texture_tile(smooth_tile(random, false), 8, TextureCodec::split).size(), size * 2 / 3);
    EXPECT_LT(encode_texture_tile(smooth_tile(random, true), 8, TextureCodec::split).size(), size / 4);
    EXPECT_LT(encode_texture_tile(random_tile(random, 8, true), 8, TextureCodec::split).size(), size + 64);
}

TEST(TextureCodec, ATileDecodedIntoAnUsedOneKeepsNothingOfIt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    TextureTile reused;
    for (int k = 0; k < 40; ++k) {
        const int log2 = test::uniform(random, kMinTextureSizeLog2, 8);
        const TextureTile tile = random_tile(random, log2, k % 3 != 0);
        const TextureCodec codec = kCodecs[k % 2];
        const auto bytes = encode_texture_tile(tile, log2, codec);
        ASSERT_TRUE(decode_texture_tile(bytes, log2, static_cast<int>(codec), reused).ok());
        ASSERT_EQ(reused, tile);
    }
}

TEST(TextureCodec, EveryTruncatedPrefixIsRefused) {
    test::Random random(1);
    const TextureTile tile = random_tile(random, 4, true);
    for (const TextureCodec codec : kCodecs) {
        const auto bytes = encode_texture_tile(tile, 4, codec);
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const auto result = decode_texture_tile(std::span(bytes).first(size), 4, static_cast<int>(codec));
            ASSERT_FALSE(result.ok()) << size;
            EXPECT_EQ(result.error().code, ErrorCode::store);
        }
    }
}

TEST(TextureCodec, ExtraBytesAreRefused) {
    test::Random random(1);
    const TextureTile tile = random_tile(random, 4, true);
    for (const TextureCodec codec : kCodecs) {
        auto bytes = encode_texture_tile(tile, 4, codec);
        const auto second = bytes;
        bytes.push_back(0);
        EXPECT_FALSE(decode_texture_tile(bytes, 4, static_cast<int>(codec)).ok());
        bytes.pop_back();
        bytes.insert(bytes.end(), second.begin() + 1, second.end());
        EXPECT_FALSE(decode_texture_tile(bytes, 4, static_cast<int>(codec)).ok());
    }
}

TEST(TextureCodec, BadChildBitsUnknownCodecsAndOtherSizesAreRefused) {
    test::Random random(1);
    const TextureTile tile = random_tile(random, 4, true);
    for (const TextureCodec codec : kCodecs) {
        auto bytes = encode_texture_tile(tile, 4, codec);
        for (const int other : {-1, 2, 255}) EXPECT_FALSE(decode_texture_tile(bytes, 4, other).ok());
        for (int log2 = 5; log2 <= kMaxTextureSizeLog2; ++log2)
            EXPECT_FALSE(decode_texture_tile(bytes, log2, static_cast<int>(codec)).ok());
        for (const int mask : {16, 128, 255}) {
            bytes[0] = static_cast<std::uint8_t>(mask);
            EXPECT_FALSE(decode_texture_tile(bytes, 4, static_cast<int>(codec)).ok());
        }
    }
}

TEST(TextureCodec, RandomBitFlipsNeverCrash) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const TextureTile tile = random_tile(random, 4, false);
    for (int k = 0; k < 20000; ++k) {
        const TextureCodec codec = kCodecs[k % 2];
        auto bytes = encode_texture_tile(tile, 4, codec);
        for (int flips = test::uniform(random, 1, 4); flips > 0; --flips) {
            const int bit = test::uniform(random, 0, static_cast<int>(bytes.size()) * 8 - 1);
            bytes[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1 << bit % 8);
        }
        const auto back = decode_texture_tile(bytes, 4, static_cast<int>(codec));
        if (back) {
            ASSERT_EQ(back->blocks.size(), bc1_chain_bytes(4));
        }
    }
}

}  // namespace
}  // namespace scree
