// An exported DDS is what was encoded, by the word of an independent decoder.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

using Texel = std::array<double, 4>;

// EXT_texture_compression_s3tc, one texel of a block, unrounded: the specification leaves the rounding of thirds open.
Texel bc1_texel(const std::uint8_t* block, int x, int y) {
    const unsigned c0 = block[0] | unsigned{block[1]} << 8, c1 = block[2] | unsigned{block[3]} << 8;
    const unsigned index = block[4 + y] >> (2 * x) & 3;
    const auto part = [](unsigned c, int channel) {
        return channel == 0   ? (c >> 11) * 255 / 31.0
               : channel == 1 ? (c >> 5 & 63) * 255 / 63.0
                              : (c & 31) * 255 / 31.0;
    };
    Texel texel{0, 0, 0, 255};
    for (int k = 0; k < 3; ++k) {
        const double a = part(c0, k), b = part(c1, k);
        const double four[4] = {a, b, (2 * a + b) / 3, (a + 2 * b) / 3}, three[4] = {a, b, (a + b) / 2, 0};
        texel[static_cast<std::size_t>(k)] = c0 > c1 ? four[index] : three[index];
    }
    if (c0 <= c1 && index == 3) texel[3] = 0;
    return texel;
}

void expect_decodes(const std::string& dds, const TextureTile& tile, int size_log2, int& transparent) {
    auto in = OIIO::ImageInput::open(dds);
    ASSERT_TRUE(in) << OIIO::geterror();
    for (int mip = 0; mip <= size_log2; ++mip) {
        SCOPED_TRACE("mip " + std::to_string(mip));
        ASSERT_TRUE(in->seek_subimage(0, mip)) << in->geterror();
        const int side = 1 << (size_log2 - mip);
        ASSERT_EQ(in->spec().width, side);
        ASSERT_EQ(in->spec().height, side);
        const int channels = in->spec().nchannels;
        ASSERT_EQ(channels, 4);
        std::vector<std::uint8_t> pixels(static_cast<std::size_t>(side * side * channels));
        ASSERT_TRUE(in->read_image(0, mip, 0, channels, OIIO::TypeDesc::UINT8, pixels.data())) << in->geterror();
        const std::uint8_t* blocks = tile.blocks.data() + bc1_mip_offset(size_log2, mip);
        const int columns = std::max(1, side / 4);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const Texel expected = bc1_texel(blocks + 8 * (y / 4 * columns + x / 4), x % 4, y % 4);
                const std::uint8_t* found = &pixels[static_cast<std::size_t>((y * side + x) * channels)];
                for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(found[k], expected[k], 1) << "at " << x << ", " << y;
                ASSERT_EQ(found[3], expected[3]) << "at " << x << ", " << y;
                transparent += expected[3] == 0 ? 1 : 0;
            }
    }
    EXPECT_FALSE(in->seek_subimage(0, size_log2 + 1)) << "more mips than the chain has";
}

TEST(Export, DdsDecodesToTheStoredBlocksWithEveryMip) {
    const TemporaryFolder folder;
    HeightGrid grid = hills(70, 61, 12);
    for (int j = 20; j < 40; ++j)
        for (int i = 30; i < 50; ++i) grid.at(i, j) = -9999;
    write_heights(folder.file("d.tif"), grid, {}, "-9999");
    const Place whole{399995, 5300005, 2.5, 32633, true};
    write_image(folder.file("i.tif"), 280, 244, 3, 8, &whole, patchwork);
    build_store_from({folder.file("d.tif"), "--imagery", folder.file("i.tif"), "--texture-size", "64"},
                     folder.file("d.scree"));
    auto store = SqliteStore::open(folder.file("d.scree"));
    ASSERT_TRUE(store) << store.error().message;
    const Dataset& d = (*store)->dataset();
    auto reader = (*store)->open_reader();
    ASSERT_TRUE(reader);
    int exported = 0, transparent = 0;
    for (const TileId id :
         {TileId{0, 0, 0}, TileId{d.texture_deepest_level, 1, 1}, TileId{d.texture_deepest_level, 2, 1}}) {
        const std::string name = std::to_string(id.level) + "/" + std::to_string(id.x) + "/" + std::to_string(id.y);
        SCOPED_TRACE(name);
        auto tile = read_texture_tile(**reader, d, id);
        ASSERT_TRUE(tile) << tile.error().message;
        const std::string dds = folder.file("t" + std::to_string(exported++) + ".dds");
        const auto run = scree({"export", folder.file("d.scree"), "--texture", name, "-o", dds});
        ASSERT_EQ(run.exit_code, 0) << describe(run);

        const auto bytes = read_bytes(dds);  // the blocks themselves, finest first after a header of 128 bytes
        ASSERT_EQ(bytes.size(), 128 + bc1_chain_bytes(d.texture_size_log2));
        std::size_t at = 128;
        for (int mip = 0; mip <= d.texture_size_log2; ++mip) {
            const std::size_t size = bc1_mip_bytes(d.texture_size_log2, mip);
            EXPECT_EQ(
                std::memcmp(bytes.data() + at, tile->blocks.data() + bc1_mip_offset(d.texture_size_log2, mip), size), 0)
                << "mip " << mip;
            at += size;
        }
        expect_decodes(dds, *tile, d.texture_size_log2, transparent);
    }
    EXPECT_GT(transparent, 0) << "the test should meet a void";
}

}  // namespace
}  // namespace scree::test
