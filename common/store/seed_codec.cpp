#include "common/store/seed_codec.h"

#include <fmt/format.h>
#include <zstd.h>

#include <cassert>
#include <cstring>

namespace scree {
namespace {

// Channels that are stored: all four, or the colours of an opaque tile.
constexpr std::uint8_t kOpaque = 3, kWithAlpha = 4;

Error bad(std::string what) { return {ErrorCode::store, "seed: " + std::move(what)}; }

}  // namespace

std::vector<std::uint8_t> encode_seed(const std::uint8_t* rgba, std::size_t row_bytes, int size) {
    const auto side = static_cast<std::size_t>(size), count = side * side;
    std::uint8_t channels = kOpaque;
    for (std::size_t r = 0; r < side; ++r)
        for (std::size_t c = 0; c < side; ++c)
            if (rgba[r * row_bytes + 4 * c + 3] != 255) channels = kWithAlpha;
    std::vector<std::uint8_t> plain(count * channels);
    for (std::size_t k = 0; k < channels; ++k) {
        std::uint8_t before = 0;
        for (std::size_t r = 0; r < side; ++r)
            for (std::size_t c = 0; c < side; ++c) {
                const std::uint8_t* pixel = rgba + r * row_bytes + 4 * c;
                const std::uint8_t value = pixel[3] == 0 ? std::uint8_t{0} : pixel[k];
                plain[k * count + r * side + c] = static_cast<std::uint8_t>(value - before);
                before = value;
            }
    }
    std::vector<std::uint8_t> payload(1 + ZSTD_compressBound(plain.size()));
    payload[0] = channels;
    const std::size_t packed = ZSTD_compress(payload.data() + 1, payload.size() - 1, plain.data(), plain.size(), 1);
    assert(ZSTD_isError(packed) == 0);
    payload.resize(1 + packed);
    return payload;
}

Result<void> decode_seed(std::span<const std::uint8_t> payload, int codec, int size, std::uint8_t* rgba,
                         std::size_t row_bytes) {
    if (codec != static_cast<int>(SeedCodec::left)) return bad(fmt::format("unknown codec {}", codec));
    if (payload.empty() || (payload[0] != kOpaque && payload[0] != kWithAlpha)) return bad("channels out of range");
    const std::size_t channels = payload[0];
    const auto packed = payload.subspan(1);
    const auto side = static_cast<std::size_t>(size), count = side * side;
    if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != count * channels ||
        ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size())
        return bad("compressed part does not hold one tile");
    std::vector<std::uint8_t> plain(count * channels);
    const std::size_t got = ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
    if (ZSTD_isError(got) != 0 || got != plain.size()) return bad("compressed part is damaged");
    for (std::size_t k = 0; k < 4; ++k) {
        std::uint8_t value = 0;
        for (std::size_t r = 0; r < side; ++r)
            for (std::size_t c = 0; c < side; ++c) {
                if (k < channels) value = static_cast<std::uint8_t>(value + plain[k * count + r * side + c]);
                rgba[r * row_bytes + 4 * c + k] = k < channels ? value : std::uint8_t{255};
            }
    }
    return {};
}

}  // namespace scree
