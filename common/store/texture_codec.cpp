#include "common/store/texture_codec.h"

#include <fmt/format.h>
#include <zstd.h>

#include <cassert>
#include <cstring>
#include <memory>

#include "common/store/byte_io.h"

namespace scree {
namespace {

Error bad(std::string what) { return {ErrorCode::store, "texture tile: " + std::move(what)}; }

}  // namespace

std::vector<std::uint8_t> encode_texture_tile(const TextureTile& tile, int size_log2, TextureCodec codec) {
    const std::size_t size = bc1_chain_bytes(size_log2);
    assert(tile.blocks.size() == size);
    std::vector<std::uint8_t> payload;
    ByteWriter out(payload);
    out.u8(tile.child_mask);
    if (codec == TextureCodec::raw) {
        out.bytes(tile.blocks);
        return payload;
    }
    // Byte k of every block's endpoints stands together; selectors follow whole.
    const std::size_t blocks = size / 8;
    std::vector<std::uint8_t> plain(size);
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::uint8_t* block = tile.blocks.data() + 8 * b;
        for (std::size_t k = 0; k < 4; ++k) plain[k * blocks + b] = block[k];
        std::memcpy(plain.data() + 4 * blocks + 4 * b, block + 4, 4);
    }
    thread_local std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context{ZSTD_createCCtx(), ZSTD_freeCCtx};
    std::vector<std::uint8_t> packed(ZSTD_compressBound(size));
    const std::size_t packed_size =
        ZSTD_compressCCtx(context.get(), packed.data(), packed.size(), plain.data(), plain.size(), 1);
    assert(ZSTD_isError(packed_size) == 0);
    out.bytes({packed.data(), packed_size});
    return payload;
}

Result<TextureTile> decode_texture_tile(std::span<const std::uint8_t> payload, int size_log2, int codec) {
    TextureTile tile;
    if (auto ok = decode_texture_tile(payload, size_log2, codec, tile); !ok) return ok.error();
    return tile;
}

Result<void> decode_texture_tile(std::span<const std::uint8_t> payload, int size_log2, int codec, TextureTile& tile) {
    const std::size_t size = bc1_chain_bytes(size_log2);
    ByteReader in(payload);
    tile.child_mask = in.u8();
    if (!in.ok() || tile.child_mask > 15) return bad(fmt::format("child bits {} out of range", tile.child_mask));
    const auto rest = in.bytes(in.remaining());
    if (codec == static_cast<int>(TextureCodec::raw)) {
        if (rest.size() != size) return bad(fmt::format("{} bytes instead of {}", rest.size(), size));
        tile.blocks.assign(rest.begin(), rest.end());
        return {};
    }
    if (codec != static_cast<int>(TextureCodec::split)) return bad(fmt::format("unknown codec {}", codec));
    if (ZSTD_getFrameContentSize(rest.data(), rest.size()) != size ||
        ZSTD_findFrameCompressedSize(rest.data(), rest.size()) != rest.size())
        return bad("compressed part does not hold one tile");
    thread_local std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context{ZSTD_createDCtx(), ZSTD_freeDCtx};
    thread_local std::vector<std::uint8_t> plain;
    plain.resize(size);
    const std::size_t got = ZSTD_decompressDCtx(context.get(), plain.data(), plain.size(), rest.data(), rest.size());
    if (ZSTD_isError(got) != 0 || got != size) return bad("compressed part is damaged");
    // Endpoint planes and selectors as the encoder set them apart.
    const std::size_t blocks = size / 8;
    tile.blocks.resize(size);
    const std::uint8_t *p0 = plain.data(), *p1 = p0 + blocks, *p2 = p1 + blocks, *p3 = p2 + blocks;
    const std::uint8_t* selectors = p3 + blocks;
    std::uint8_t* out = tile.blocks.data();
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::uint8_t block[8] = {p0[b],
                                       p1[b],
                                       p2[b],
                                       p3[b],
                                       selectors[4 * b],
                                       selectors[4 * b + 1],
                                       selectors[4 * b + 2],
                                       selectors[4 * b + 3]};
        std::memcpy(out + 8 * b, block, 8);
    }
    return {};
}

}  // namespace scree
