// What a store's rows hold: height and texture payloads and the dataset's JSON. The first byte of an input says which,
// the second the tile's size and codec.
#include <cmath>
#include <random>
#include <span>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"
#include "common/texture_tile.h"
#include "tests/common/test_support.h"
#include "tests/fuzz/fuzz_target.h"

namespace scree::fuzz {
namespace {

constexpr int kCellsLog2 = 3;
constexpr int kTextureLog2 = 4;

std::string height_seed(HeightCodec codec, bool with_presence) {
    test::Random random(7);
    HeightTile tile;
    tile.samples = test::random_samples(random, kCellsLog2, 1000);
    if (with_presence) tile.presence = test::random_presence(random, kCellsLog2, 70);
    tile.header.own.min_n = -1000;
    tile.header.own.max_n = 1000;
    for (int g = 0; g < kCellsLog2; ++g)
        tile.header.own.error_n[static_cast<std::size_t>(g)] = std::pow(1.5f, static_cast<float>(g));
    const auto bytes = encode_height_tile(tile, kCellsLog2, codec);
    return std::string{'\0', static_cast<char>(codec)} + std::string(bytes.begin(), bytes.end());
}

std::string texture_seed(TextureCodec codec) {
    TextureTile tile;
    tile.blocks.resize(bc1_chain_bytes(kTextureLog2));
    for (std::size_t i = 0; i < tile.blocks.size(); ++i) tile.blocks[i] = static_cast<std::uint8_t>(i * 37);
    const auto bytes = encode_texture_tile(tile, kTextureLog2, codec);
    return std::string{'\1', static_cast<char>(codec)} + std::string(bytes.begin(), bytes.end());
}

Dataset dataset() {
    Dataset d;
    d.crs = "EPSG:32633";
    d.sources = {{"a.tif", "heights", 100, 20, 30}, {"b.tif", "imagery", 100, 20, 30}};
    return d;
}

}  // namespace

std::vector<std::string> seeds() {
    std::vector<std::string> all{texture_seed(TextureCodec::raw), texture_seed(TextureCodec::split),
                                 std::string("\2\0", 2) + dataset_to_json(dataset())};
    for (const NamedHeightCodec& named : height_codecs())
        for (const bool with_presence : {false, true}) all.push_back(height_seed(named.codec, with_presence));
    return all;
}

}  // namespace scree::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace scree;
    using namespace scree::fuzz;
    if (size < 2) return 0;
    const std::span<const std::uint8_t> payload(data + 2, size - 2);
    if (data[0] % 3 == 0) {
        const int codec = data[1] % (static_cast<int>(height_codecs().size()) + 1);  // one that is unknown, too
        const auto tile = decode_height_tile(payload, kCellsLog2, codec);
        if (!tile) {
            require(tile.error().code == ErrorCode::store, "a damaged payload is a store error");
        } else {
            for (const std::int32_t n : tile->samples) require(std::abs(n) <= kMaxHeightUnits, "heights are in range");
            for (const NamedHeightCodec& named : height_codecs()) {
                const auto again = encode_height_tile(*tile, kCellsLog2, named.codec);
                const auto same = decode_height_tile(again, kCellsLog2, static_cast<int>(named.codec));
                require(same.ok() && *same == *tile, "what was decoded survives a round trip");
            }
        }
    } else if (data[0] % 3 == 1) {
        const auto tile = decode_texture_tile(payload, kTextureLog2, data[1] % 3);
        require(tile.ok() || tile.error().code == ErrorCode::store, "a damaged payload is a store error");
        if (tile) require(tile->blocks.size() == bc1_chain_bytes(kTextureLog2), "a texture has all its mips");
    } else {
        const auto read = dataset_from_json(std::string(payload.begin(), payload.end()));
        if (!read) {
            require(read.error().code == ErrorCode::store, "a damaged dataset is a store error");
        } else {
            require(read->check().ok(), "a dataset that was read is sound");
            const auto again = dataset_from_json(dataset_to_json(*read));
            require(again.ok() && dataset_to_json(*again) == dataset_to_json(*read), "it survives a round trip");
        }
    }
    return 0;
}
