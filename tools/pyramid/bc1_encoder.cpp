#include "tools/pyramid/bc1_encoder.h"

#include <array>
#include <cstring>

#include "tools/pyramid/bc1_kernel.h"

namespace scree {
namespace {

constexpr unsigned kOpaqueAlpha = 128;  // alpha has this bit: opaque
constexpr std::size_t kBlockBytes = 8;

// One colour for a whole block: each channel is looked up as the pair of codes whose interpolated level is nearest
// (after F. Giesen, stb_dxt), and among those the pair closest together, which decoders of other rounding reproduce
// best.

struct CodePair {
    std::uint8_t first = 0;
    std::uint8_t second = 0;
    std::uint8_t squared_error = 0;
};

using SolidTable = std::array<CodePair, 256>;

constexpr int decoded_level(int code, int bits) { return code << (8 - bits) | code >> (2 * bits - 8); }

/// For each level the codes whose (first_weight * first + second) / (first_weight + 1), rounded down, is nearest to it.
constexpr SolidTable solid_table(int bits, int first_weight) {
    constexpr int kUnreached = 1000;
    SolidTable table{};
    std::array<int, 256> distance{};
    distance.fill(kUnreached);
    for (int first = 0; first < 1 << bits; ++first) {
        for (int second = 0; second < 1 << bits; ++second) {
            const int a = decoded_level(first, bits);
            const int b = decoded_level(second, bits);
            const auto level = static_cast<std::size_t>((first_weight * a + b) / (first_weight + 1));
            const int apart = a < b ? b - a : a - b;
            if (apart < distance[level]) {
                distance[level] = apart;
                table[level] = {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(second), 0};
            }
        }
    }
    for (std::size_t level = 0; level < 256; ++level) {
        if (distance[level] != kUnreached) {
            continue;
        }
        for (std::size_t step = 1; step < 256; ++step) {
            const bool below = step <= level && distance[level - step] != kUnreached;
            if (below || (level + step < 256 && distance[level + step] != kUnreached)) {
                table[level] = table[below ? level - step : level + step];
                table[level].squared_error = static_cast<std::uint8_t>(step * step);
                break;
            }
        }
    }
    return table;
}

/// The codes of a channel where BC1 has them, first endpoint in the low half.
struct PlacedPair {
    std::uint32_t ends = 0;
    std::uint32_t squared_error = 0;
};

using PlacedTable = std::array<PlacedPair, 256>;

constexpr PlacedTable placed(const SolidTable& table, int shift) {
    PlacedTable all{};
    for (std::size_t level = 0; level < 256; ++level) {
        const CodePair& pair = table[level];
        all[level] = {std::uint32_t{pair.first} << shift | std::uint32_t{pair.second} << (16 + shift),
                      pair.squared_error};
    }
    return all;
}

using ColourTable = std::array<PlacedTable, 3>;

constexpr ColourTable colour_table(int first_weight) {
    const SolidTable five = solid_table(5, first_weight);
    return {placed(five, 11), placed(solid_table(6, first_weight), 5), placed(five, 0)};
}

constexpr ColourTable kThirds = colour_table(2);
constexpr ColourTable kHalves = colour_table(1);

/// Disjoint bits add up, and so do the errors.
PlacedPair solid_ends(const ColourTable& table, const int colour[3]) {
    const PlacedPair& r = table[0][static_cast<std::size_t>(colour[0])];
    const PlacedPair& g = table[1][static_cast<std::size_t>(colour[1])];
    const PlacedPair& b = table[2][static_cast<std::size_t>(colour[2])];
    return {r.ends | g.ends | b.ends, r.squared_error + g.squared_error + b.squared_error};
}

std::uint32_t exchanged(std::uint32_t ends) { return ends << 16 | ends >> 16; }

/// With the greater endpoint second: three-colour mode.
std::uint32_t three_colour_ends(std::uint32_t ends) { return (ends & 0xFFFFU) > ends >> 16 ? exchanged(ends) : ends; }

/// x86 is little-endian, as the format is.
void write_block(std::uint32_t ends, std::uint32_t selectors, std::uint8_t* out) {
    std::memcpy(out, &ends, 4);
    std::memcpy(out + 4, &selectors, 4);
}

}  // namespace

void encode_bc1_solid_block(const int colour[3], std::uint8_t* out) {
    const PlacedPair thirds = solid_ends(kThirds, colour);
    const PlacedPair halves = solid_ends(kHalves, colour);
    if (halves.squared_error < thirds.squared_error) {
        write_block(three_colour_ends(halves.ends), 0xAAAAAAAAU, out);  // the middle
        return;
    }
    const std::uint32_t first = thirds.ends & 0xFFFFU;
    const std::uint32_t second = thirds.ends >> 16;
    if (first > second) {
        write_block(thirds.ends, 0xAAAAAAAAU, out);  // two thirds of the first
    } else if (first < second) {
        write_block(exchanged(thirds.ends), 0xFFFFFFFFU, out);  // two thirds of the second
    } else {
        write_block(thirds.ends, 0, out);  // equal: three-colour mode, where index 3 would be transparent
    }
}

void encode_bc1_plain_block(const std::uint8_t* rgba, std::size_t row_bytes, std::uint8_t* out) {
    int mean[3] = {0, 0, 0};
    int count = 0;
    std::uint32_t transparent = 0;  // selector 3
    for (std::size_t i = 0; i < 16; ++i) {
        const std::uint8_t* texel = rgba + i / 4 * row_bytes + i % 4 * 4;
        if ((texel[3] & kOpaqueAlpha) == 0) {
            transparent |= 3U << 2 * i;
            continue;
        }
        ++count;
        for (std::size_t c = 0; c < 3; ++c) {
            mean[c] += texel[c];
        }
    }
    if (count == 0) {
        std::memcpy(out, kBc1Transparent, sizeof kBc1Transparent);
        return;
    }
    for (int& channel : mean) {
        channel = (channel + count / 2) / count;
    }
    if (count == 16) {
        encode_bc1_solid_block(mean, out);
    } else {
        write_block(three_colour_ends(solid_ends(kHalves, mean).ends), 0xAAAAAAAAU | transparent, out);
    }
}

void encode_bc1_row_with(Bc1Kernel* kernel, const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count,
                         std::uint8_t* out) {
    const std::size_t rest = block_count % kBc1GroupBlocks;
    const std::size_t whole = block_count - rest;
    kernel(rgba, row_bytes, whole, out);
    if (rest == 0) {
        return;
    }
    constexpr std::size_t kGroupRowBytes = kBc1GroupBlocks * 16;
    std::uint8_t pixels[4 * kGroupRowBytes] = {};
    std::uint8_t blocks[kBc1GroupBlocks * kBlockBytes];
    for (std::size_t y = 0; y < 4; ++y) {
        std::memcpy(pixels + y * kGroupRowBytes, rgba + y * row_bytes + whole * 16, rest * 16);
    }
    kernel(pixels, kGroupRowBytes, kBc1GroupBlocks, blocks);
    std::memcpy(out + whole * kBlockBytes, blocks, rest * kBlockBytes);
}

bool bc1_kernel_avx512_runs_here() {
    return __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512vnni") != 0;
}

Bc1Kernel* best_bc1_kernel(TextureQuality quality) {
    const bool high = quality == TextureQuality::high;
    if (bc1_kernel_avx512_runs_here()) {
        return high ? bc1_high_kernel_avx512 : bc1_kernel_avx512;
    }
    if (__builtin_cpu_supports("avx2")) {
        return high ? bc1_high_kernel_avx2 : bc1_kernel_avx2;
    }
    return high ? bc1_high_kernel_sse2 : bc1_kernel_sse2;
}

void encode_bc1_row(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out,
                    TextureQuality quality) {
    static Bc1Kernel* const normal = best_bc1_kernel(TextureQuality::normal);
    static Bc1Kernel* const high = best_bc1_kernel(TextureQuality::high);
    encode_bc1_row_with(quality == TextureQuality::high ? high : normal, rgba, row_bytes, block_count, out);
}

}  // namespace scree
