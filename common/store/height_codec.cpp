#include "common/store/height_codec.h"

#include <fmt/format.h>
#include <zstd.h>

#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <memory>

#include "common/store/byte_io.h"

namespace scree {
namespace {

constexpr std::uint8_t kHasPresence = 1, kTextureEnds = 2;
constexpr std::uint8_t kUnusedFlags = 0x0C;

Error bad(std::string what) { return {ErrorCode::store, "height tile: " + std::move(what)}; }

std::uint32_t zigzag(std::int32_t v) {
    return (static_cast<std::uint32_t>(v) << 1) ^ static_cast<std::uint32_t>(v >> 31);
}
std::int32_t unzigzag(std::uint32_t v) { return static_cast<std::int32_t>((v >> 1) ^ (~(v & 1) + 1)); }

void write_bounds(ByteWriter& out, const HeightBounds& bounds, int levels) {
    out.i32(bounds.min_n);
    out.i32(bounds.max_n);
    for (int g = 0; g < levels; ++g) out.f32(bounds.error_n[static_cast<std::size_t>(g)]);
}

bool read_bounds(ByteReader& in, HeightBounds& bounds, int levels) {
    bounds.min_n = in.i32();
    bounds.max_n = in.i32();
    bool good = bounds.min_n <= bounds.max_n && bounds.min_n >= -kMaxHeightUnits && bounds.max_n <= kMaxHeightUnits;
    float previous = 0;
    for (int g = 0; g < levels; ++g) {
        const float error = in.f32();
        good = good && std::isfinite(error) && error >= previous && error <= kMaxErrorUnits;
        bounds.error_n[static_cast<std::size_t>(g)] = error;
        previous = error;
    }
    return good;
}

// Residuals of the plane predictor west + north - northwest, zigzag coded; the first row and column predict from what
// there is. Loops that vectors can take. Returns the bits that any of them has.
std::uint32_t predict(std::span<const std::int32_t> samples, std::size_t pitch, std::span<std::uint32_t> residuals) {
    std::uint32_t all = 0;
    const std::int32_t* z = samples.data();
    std::uint32_t* out = residuals.data();
    for (std::size_t j = 0; j < pitch; ++j, z += pitch, out += pitch) {
        out[0] = zigzag(j == 0 ? z[0] : z[0] - *(z - pitch));
        if (j == 0) {
            for (std::size_t i = 1; i < pitch; ++i) out[i] = zigzag(z[i] - z[i - 1]);
        } else {
            const std::int32_t* above = z - pitch;
            for (std::size_t i = 1; i < pitch; ++i) out[i] = zigzag(z[i] - z[i - 1] - (above[i] - above[i - 1]));
        }
        for (std::size_t i = 0; i < pitch; ++i) all |= out[i];
    }
    return all;
}

// Bytes of the values, the lowest of all first.
void split(std::span<const std::uint32_t> values, std::size_t planes, std::span<std::uint8_t> bytes) {
    const std::size_t count = values.size();
    const std::uint32_t* from = values.data();
    for (std::size_t plane = 0; plane < planes; ++plane) {
        std::uint8_t* to = bytes.data() + plane * count;
        const auto shift = static_cast<unsigned>(8 * plane);
        for (std::size_t k = 0; k < count; ++k) to[k] = static_cast<std::uint8_t>(from[k] >> shift);
    }
}

struct ZstdContexts {
    std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> compress{ZSTD_createCCtx(), ZSTD_freeCCtx};
    std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> decompress{ZSTD_createDCtx(), ZSTD_freeDCtx};
};
ZstdContexts& zstd_contexts() {
    thread_local ZstdContexts contexts;
    return contexts;
}

void append_presence(std::vector<std::uint8_t>& out, const std::vector<std::uint8_t>& presence) {
    std::uint8_t byte = 0;
    for (std::size_t k = 0; k < presence.size(); ++k) {
        byte = static_cast<std::uint8_t>(byte | (presence[k] != 0) << (k % 8));
        if (k % 8 == 7 || k + 1 == presence.size()) {
            out.push_back(byte);
            byte = 0;
        }
    }
}

Result<void> read_presence(ByteReader& in, std::size_t cells, std::vector<std::uint8_t>& presence) {
    const auto bits = in.bytes((cells + 7) / 8);
    if (!in.ok()) return bad("presence bits are cut short");
    presence.resize(cells);
    for (std::size_t k = 0; k < cells; ++k) presence[k] = (bits[k / 8] >> (k % 8)) & 1;
    return {};
}

// --- codecs of residuals: zigzag, byte planes, Zstandard ---

// Zigzag coded residuals of all samples; returns the bits that any of them has.
using Predict = std::uint32_t (*)(std::span<const std::int32_t> samples, std::size_t pitch,
                                  std::span<std::uint32_t> residuals);
// Makes `above`, a row of samples (zeros over the first), the next one; may spoil `residuals`. Sums wrap.
using UndoRow = void (*)(std::span<std::uint32_t> residuals, std::span<std::uint32_t> above);

// West + north - northwest, undone, is a running sum along the row, added to the row above.
void undo_plane(std::span<std::uint32_t> residuals, std::span<std::uint32_t> above) {
    std::uint32_t sum = 0;
    for (std::uint32_t& value : residuals) value = sum += value;
    for (std::size_t k = 0; k < above.size(); ++k) above[k] += residuals[k];
}

// A row's residuals, put together from the byte planes of all `count`.
void gather_row(const std::uint8_t* from, std::size_t planes, std::size_t count, std::span<std::uint32_t> values) {
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = from[k];
    for (std::size_t p = 1; p < planes; ++p) {
        const std::uint8_t* bytes = from + p * count;
        const auto shift = static_cast<unsigned>(8 * p);
        for (std::size_t k = 0; k < values.size(); ++k) values[k] |= std::uint32_t{bytes[k]} << shift;
    }
    for (std::uint32_t& value : values) value = static_cast<std::uint32_t>(unzigzag(value));
}

// Samples from byte planes of residuals. Sums cannot wrap back into range unseen: in raster order the first height out
// of range is less than 2^31 + 2^25 away. False: there is one.
template <UndoRow undo_row>
bool undo_prediction(std::span<const std::uint8_t> plain, std::size_t planes, std::size_t pitch,
                     std::span<std::int32_t> samples) {
    constexpr std::uint32_t kRange = 2u * kMaxHeightUnits;
    std::uint32_t outside = 0;  // has a bit above kRange's where a height is out of range
    std::array<std::uint32_t, (1 << kMaxTileCellsLog2) + 1> residuals, above{};
    for (std::size_t start = 0; start < samples.size(); start += pitch) {
        gather_row(plain.data() + start, planes, samples.size(), {residuals.data(), pitch});
        undo_row({residuals.data(), pitch}, {above.data(), pitch});
        for (std::size_t k = 0; k < pitch; ++k) {
            const std::uint32_t height = above[k] + kMaxHeightUnits;
            outside |= height | (kRange - height);
            samples[start + k] = static_cast<std::int32_t>(above[k]);
        }
    }
    return outside >> std::bit_width(kRange) == 0;
}

template <Predict predict_samples>
void encode_residuals(const HeightTile& tile, int n, std::vector<std::uint8_t>& payload) {
    thread_local std::vector<std::uint32_t> residuals;
    thread_local std::vector<std::uint8_t> plain, packed;
    const std::size_t count = tile.samples.size();
    residuals.resize(count);
    const std::uint32_t all = predict_samples(tile.samples, (std::size_t{1} << n) + 1, residuals);
    const auto planes = static_cast<std::size_t>(std::max(1, (static_cast<int>(std::bit_width(all)) + 7) / 8));
    plain.resize(count * planes);
    split(residuals, planes, plain);
    append_presence(plain, tile.presence);

    packed.resize(ZSTD_compressBound(plain.size()));
    const std::size_t size =
        ZSTD_compressCCtx(zstd_contexts().compress.get(), packed.data(), packed.size(), plain.data(), plain.size(), 1);
    assert(ZSTD_isError(size) == 0);
    payload.reserve(payload.size() + 1 + size);
    ByteWriter out(payload);
    out.u8(static_cast<std::uint8_t>(planes));
    out.bytes({packed.data(), size});
}

// The one frame that is the rest of the payload.
Result<void> unpack(ByteReader& in, std::size_t expected, std::vector<std::uint8_t>& plain) {
    const auto packed = in.bytes(in.remaining());
    if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != expected ||
        ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size())
        return bad("compressed part does not hold one tile");
    plain.resize(expected);
    const std::size_t size =
        ZSTD_decompressDCtx(zstd_contexts().decompress.get(), plain.data(), plain.size(), packed.data(), packed.size());
    if (ZSTD_isError(size) != 0 || size != expected) return bad("compressed part is damaged");
    return {};
}

template <UndoRow undo_row>
Result<void> decode_residuals(ByteReader& in, int n, bool has_presence, HeightTile& tile) {
    const std::size_t pitch = (std::size_t{1} << n) + 1, count = pitch * pitch, cells = std::size_t{1} << (2 * n);
    const std::size_t planes = in.u8();
    if (!in.ok() || planes < 1 || planes > 4) return bad(fmt::format("{} byte planes", planes));
    const std::size_t sample_bytes = count * planes, presence_bytes = has_presence ? (cells + 7) / 8 : 0;
    thread_local std::vector<std::uint8_t> plain;
    if (auto ok = unpack(in, sample_bytes + presence_bytes, plain); !ok) return ok;
    tile.samples.resize(count);
    if (!undo_prediction<undo_row>(plain, planes, pitch, tile.samples)) return bad("a height is out of range");
    if (!has_presence) return {};
    ByteReader bits({plain.data() + sample_bytes, presence_bytes});
    return read_presence(bits, cells, tile.presence);
}

// --- raw ---

void encode_raw(const HeightTile& tile, int, std::vector<std::uint8_t>& payload) {
    ByteWriter out(payload);
    for (const std::int32_t v : tile.samples) out.i32(v);
    append_presence(payload, tile.presence);
}

Result<void> decode_raw(ByteReader& in, int n, bool has_presence, HeightTile& tile) {
    const std::size_t pitch = (std::size_t{1} << n) + 1, count = pitch * pitch;
    const auto bytes = in.bytes(count * 4);
    if (!in.ok()) return bad("samples are cut short");
    tile.samples.resize(count);
    ByteReader values(bytes);
    for (auto& v : tile.samples) v = values.i32();
    for (const std::int32_t v : tile.samples)
        if (v < -kMaxHeightUnits || v > kMaxHeightUnits) return bad(fmt::format("height {} is out of range", v));
    return has_presence ? read_presence(in, std::size_t{1} << (2 * n), tile.presence) : Result<void>{};
}

// --- the table ---

// What a codec makes of samples and presence; the header before them is the same for all.
struct Method {
    HeightCodec codec;
    const char* name;
    int bytes_a_sample;
    void (*encode)(const HeightTile& tile, int n, std::vector<std::uint8_t>& payload);  // appends
    // Leaves bytes that it does not want; the caller refuses them. What it does not read must stay empty.
    Result<void> (*decode)(ByteReader& in, int n, bool has_presence, HeightTile& tile);
};

// By number. The only place that lists them.
constexpr std::array kMethods{
    Method{HeightCodec::raw, "raw", 4, encode_raw, decode_raw},
    Method{HeightCodec::plane, "plane", 2, encode_residuals<predict>, decode_residuals<undo_plane>},
};

constexpr auto kNamed = [] {
    std::array<NamedHeightCodec, kMethods.size()> named{};
    for (std::size_t k = 0; k < named.size(); ++k)
        named[k] = {kMethods[k].codec, kMethods[k].name, kMethods[k].bytes_a_sample};
    return named;
}();

constexpr bool stands_by_number() {
    for (std::size_t k = 0; k < kMethods.size(); ++k)
        if (static_cast<std::size_t>(kMethods[k].codec) != k) return false;
    return true;
}
static_assert(stands_by_number(), "kMethods[k] must be the codec of number k");
static_assert(kMethods.size() <= 256, "rows hold the number in a byte");

const Method* method_of(int codec) {
    return codec >= 0 && static_cast<std::size_t>(codec) < kMethods.size() ? &kMethods[static_cast<std::size_t>(codec)]
                                                                           : nullptr;
}

Error unknown(int codec) {
    return bad(fmt::format("unknown codec {}: this program knows 0 to {}, a newer one may know it", codec,
                           kMethods.size() - 1));
}

void write_header(ByteWriter& out, const HeightTile& tile, int n) {
    const HeightTileHeader& h = tile.header;
    assert((h.leaf_mask & ~h.child_mask) == 0 && (h.texture_end_mask & ~h.child_mask) == 0);
    out.u8(static_cast<std::uint8_t>(h.child_mask | h.leaf_mask << 4));
    out.u8(static_cast<std::uint8_t>((tile.presence.empty() ? 0 : kHasPresence) | (h.texture_ends ? kTextureEnds : 0) |
                                     h.texture_end_mask << 4));
    write_bounds(out, h.own, geomip_level_count(n));
    for (int q = 0; q < 4; ++q)
        if ((h.child_mask >> q & 1) != 0)
            write_bounds(out, h.children[static_cast<std::size_t>(q)], geomip_level_count(n));
}

Result<void> read_header(ByteReader& in, int n, HeightTileHeader& header, bool& has_presence) {
    header = {};
    const std::uint8_t children = in.u8(), flags = in.u8();
    header.child_mask = children & 15;
    header.leaf_mask = children >> 4;
    header.texture_ends = (flags & kTextureEnds) != 0;
    header.texture_end_mask = flags >> 4;
    has_presence = (flags & kHasPresence) != 0;
    const unsigned of_children = unsigned{header.leaf_mask} | header.texture_end_mask;
    if (!in.ok() || (flags & kUnusedFlags) != 0 || (of_children & ~unsigned{header.child_mask}) != 0)
        return bad(fmt::format("child bits {} or flags {} out of range", children, flags));
    if (!read_bounds(in, header.own, geomip_level_count(n))) return bad("bounds out of range");
    for (int q = 0; q < 4; ++q)
        if ((header.child_mask >> q & 1) != 0 &&
            !read_bounds(in, header.children[static_cast<std::size_t>(q)], geomip_level_count(n)))
            return bad(fmt::format("bounds of child {} out of range", q));
    if (!in.ok()) return bad("header is cut short");
    return {};
}

}  // namespace

std::span<const NamedHeightCodec> height_codecs() { return kNamed; }

std::vector<std::uint8_t> encode_height_tile(const HeightTile& tile, int n, HeightCodec codec) {
    const Method* method = method_of(static_cast<int>(codec));
    assert(method != nullptr);
    assert(tile.samples.size() == ((std::size_t{1} << n) + 1) * ((std::size_t{1} << n) + 1));
    assert(tile.presence.empty() || tile.presence.size() == std::size_t{1} << (2 * n));
    std::vector<std::uint8_t> payload;
    ByteWriter out(payload);
    write_header(out, tile, n);
    method->encode(tile, n, payload);
    return payload;
}

Result<HeightTile> decode_height_tile(std::span<const std::uint8_t> payload, int n, int codec) {
    HeightTile tile;
    if (auto ok = decode_height_tile(payload, n, codec, tile); !ok) return ok.error();
    return tile;
}

Result<void> decode_height_tile(std::span<const std::uint8_t> payload, int n, int codec, HeightTile& tile) {
    const Method* method = method_of(codec);
    if (method == nullptr) return unknown(codec);
    tile.presence.clear();
    ByteReader in(payload);
    bool has_presence = false;
    if (auto ok = read_header(in, n, tile.header, has_presence); !ok) return ok;
    if (auto ok = method->decode(in, n, has_presence, tile); !ok) return ok;
    if (in.remaining() != 0) return bad(fmt::format("{} bytes too many", in.remaining()));
    return {};
}

std::optional<HeightMarks> height_marks(std::span<const std::uint8_t> payload) {
    if (payload.size() < 2) return std::nullopt;
    return HeightMarks{static_cast<std::uint8_t>(payload[0] & 15), (payload[1] & kHasPresence) != 0};
}

bool set_texture_ends(std::span<std::uint8_t> payload, bool own, std::uint8_t children) {
    if (payload.size() < 2) return false;
    const unsigned stored = payload[0] & 15u, presence = payload[1] & kHasPresence;
    payload[1] = static_cast<std::uint8_t>(presence | (own ? kTextureEnds : 0u) | (children & stored) << 4);
    return true;
}

}  // namespace scree
