#include "tools/pyramid/bc1_encoder.h"

#include <algorithm>
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

constexpr SolidTable kThird5 = solid_table(5, 2);
constexpr SolidTable kThird6 = solid_table(6, 2);
constexpr SolidTable kHalf5 = solid_table(5, 1);
constexpr SolidTable kHalf6 = solid_table(6, 1);

using Colour = std::array<int, 3>;

struct Block {
    unsigned first = 0;
    unsigned second = 0;
    std::uint32_t selectors = 0;
};

unsigned packed565(int r, int g, int b) { return static_cast<unsigned>(r << 11 | g << 5 | b); }

Colour unpacked565(unsigned colour) {
    return {decoded_level(static_cast<int>(colour >> 11), 5), decoded_level(static_cast<int>(colour >> 5 & 63U), 6),
            decoded_level(static_cast<int>(colour & 31U), 5)};
}

void write_block(const Block& block, std::uint8_t* out) {
    out[0] = static_cast<std::uint8_t>(block.first);
    out[1] = static_cast<std::uint8_t>(block.first >> 8);
    out[2] = static_cast<std::uint8_t>(block.second);
    out[3] = static_cast<std::uint8_t>(block.second >> 8);
    for (unsigned i = 0; i < 4; ++i) {
        out[4 + i] = static_cast<std::uint8_t>(block.selectors >> 8 * i);
    }
}

struct Endpoints {
    unsigned first = 0;
    unsigned second = 0;
};

struct SolidEndpoints {
    Endpoints ends;
    int squared_error = 0;
};

SolidEndpoints solid_endpoints(const SolidTable& table5, const SolidTable& table6, const Colour& colour) {
    const CodePair r = table5[static_cast<std::size_t>(colour[0])];
    const CodePair g = table6[static_cast<std::size_t>(colour[1])];
    const CodePair b = table5[static_cast<std::size_t>(colour[2])];
    return {{packed565(r.first, g.first, b.first), packed565(r.second, g.second, b.second)},
            r.squared_error + g.squared_error + b.squared_error};
}

Block solid_block(const Colour& colour) {
    const auto [thirds, error_of_thirds] = solid_endpoints(kThird5, kThird6, colour);
    const auto [halves, error_of_halves] = solid_endpoints(kHalf5, kHalf6, colour);
    if (error_of_halves < error_of_thirds) {
        // Three-colour mode: the greater endpoint second, every texel the middle.
        return {std::min(halves.first, halves.second), std::max(halves.first, halves.second), 0xAAAAAAAAU};
    }
    if (thirds.first > thirds.second) {
        return {thirds.first, thirds.second, 0xAAAAAAAAU};  // two thirds of the first
    }
    if (thirds.first < thirds.second) {
        return {thirds.second, thirds.first, 0xFFFFFFFFU};  // two thirds of the second
    }
    return {thirds.first, thirds.second, 0};  // equal: three-colour mode, where index 3 would be transparent
}

// Blocks with transparent texels: three colours, fitted to the opaque texels alone. They stand along the rims of the
// data only, so clarity goes before speed here.

int squared_distance(const Colour& a, const Colour& b) {
    int distance = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        distance += (a[c] - b[c]) * (a[c] - b[c]);
    }
    return distance;
}

Colour middle(const Endpoints& ends) {
    const Colour a = unpacked565(ends.first);
    const Colour b = unpacked565(ends.second);
    return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

struct OpaqueTexels {
    int count = 0;
    std::array<Colour, 16> colour{};
    std::array<int, 16> position{};
};

OpaqueTexels opaque_texels(const std::uint8_t* rgba, std::size_t row_bytes) {
    OpaqueTexels texels;
    for (int i = 0; i < 16; ++i) {
        const std::uint8_t* texel =
            rgba + static_cast<std::size_t>(i / 4) * row_bytes + static_cast<std::size_t>(i % 4) * 4;
        if ((texel[3] & kOpaqueAlpha) != 0) {
            const auto k = static_cast<std::size_t>(texels.count++);
            texels.colour[k] = {texel[0], texel[1], texel[2]};
            texels.position[k] = i;
        }
    }
    return texels;
}

Colour rounded_mean(const Colour& sum, int count) {
    return {(sum[0] + count / 2) / count, (sum[1] + count / 2) / count, (sum[2] + count / 2) / count};
}

Colour rounded_mean(const OpaqueTexels& texels) {
    Colour sum{};
    for (std::size_t k = 0; k < static_cast<std::size_t>(texels.count); ++k) {
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += texels.colour[k][c];
        }
    }
    return rounded_mean(sum, texels.count);
}

struct Candidate {
    Endpoints ends;
    std::array<int, 16> halves{};  // of the way from the second endpoint (0) to the first (2), for each opaque texel
    int error = 0;
};

/// Gives every texel the nearest of the three colours.
Candidate with_nearest_colours(const OpaqueTexels& texels, const Endpoints& ends) {
    const std::array<Colour, 3> palette{unpacked565(ends.second), middle(ends), unpacked565(ends.first)};
    Candidate candidate;
    candidate.ends = ends;
    for (std::size_t k = 0; k < static_cast<std::size_t>(texels.count); ++k) {
        int best = 3 * 255 * 255 + 1;
        for (int halves = 0; halves < 3; ++halves) {
            const int error = squared_distance(texels.colour[k], palette[static_cast<std::size_t>(halves)]);
            if (error < best) {
                best = error;
                candidate.halves[k] = halves;
            }
        }
        candidate.error += best;
    }
    return candidate;
}

/// The pair of texels farthest apart.
Endpoints farthest_pair(const OpaqueTexels& texels) {
    int longest = -1;
    Colour a{};
    Colour b{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(texels.count); ++i) {
        for (std::size_t j = i; j < static_cast<std::size_t>(texels.count); ++j) {
            const int length = squared_distance(texels.colour[i], texels.colour[j]);
            if (length > longest) {
                longest = length;
                a = texels.colour[i];
                b = texels.colour[j];
            }
        }
    }
    const auto packed = [](const Colour& colour) {
        return packed565((colour[0] * 31 + 127) / 255, (colour[1] * 63 + 127) / 255, (colour[2] * 31 + 127) / 255);
    };
    return {packed(a), packed(b)};
}

int quantized(float level, int largest) {
    const float code = level * static_cast<float>(largest) / 255.0F + 0.5F;
    return static_cast<int>(std::clamp(code, 0.0F, static_cast<float>(largest)));
}

/// Least squares for the halves of `candidate`; its own endpoints if all texels have the same.
Endpoints refitted(const OpaqueTexels& texels, const Candidate& candidate) {
    int hh = 0;
    int hl = 0;
    int ll = 0;
    Colour high_sum{};
    Colour low_sum{};
    for (std::size_t k = 0; k < static_cast<std::size_t>(texels.count); ++k) {
        const int high = candidate.halves[k];
        const int low = 2 - high;
        hh += high * high;
        hl += high * low;
        ll += low * low;
        for (std::size_t c = 0; c < 3; ++c) {
            high_sum[c] += high * texels.colour[k][c];
            low_sum[c] += low * texels.colour[k][c];
        }
    }
    const int determinant = hh * ll - hl * hl;
    if (determinant == 0) {
        return candidate.ends;
    }
    const float scale = 2.0F / static_cast<float>(determinant);
    std::array<int, 3> first{};
    std::array<int, 3> second{};
    for (std::size_t c = 0; c < 3; ++c) {
        const int largest = c == 1 ? 63 : 31;
        first[c] = quantized(static_cast<float>(high_sum[c] * ll - low_sum[c] * hl) * scale, largest);
        second[c] = quantized(static_cast<float>(low_sum[c] * hh - high_sum[c] * hl) * scale, largest);
    }
    return {packed565(first[0], first[1], first[2]), packed565(second[0], second[1], second[2])};
}

Block three_colour_block(const OpaqueTexels& texels) {
    constexpr int kRounds = 3;
    Candidate best = with_nearest_colours(texels, solid_endpoints(kHalf5, kHalf6, rounded_mean(texels)).ends);
    Candidate current = with_nearest_colours(texels, farthest_pair(texels));
    for (int round = 0; round <= kRounds; ++round) {
        if (current.error < best.error) {
            best = current;
        }
        current = with_nearest_colours(texels, refitted(texels, current));
    }
    // Three-colour mode wants the greater endpoint second.
    const bool exchange = best.ends.first > best.ends.second;
    constexpr std::array<std::uint32_t, 3> kSelector{1, 2, 0};
    Block block{std::min(best.ends.first, best.ends.second), std::max(best.ends.first, best.ends.second), 0xFFFFFFFFU};
    for (std::size_t k = 0; k < static_cast<std::size_t>(texels.count); ++k) {
        const int halves = exchange ? 2 - best.halves[k] : best.halves[k];
        const std::uint32_t flipped = 3U ^ kSelector[static_cast<std::size_t>(halves)];
        block.selectors ^= flipped << 2 * texels.position[k];
    }
    return block;
}

}  // namespace

void encode_bc1_special_block(const std::uint8_t* rgba, std::size_t row_bytes, std::uint8_t* out) {
    // Seas and margins are full of one colour: their blocks take the short way.
    Colour sum{};
    unsigned opaque = kOpaqueAlpha;
    for (std::size_t y = 0; y < 4; ++y) {
        for (std::size_t x = 0; x < 4; ++x) {
            const std::uint8_t* texel = rgba + y * row_bytes + x * 4;
            sum[0] += texel[0];
            sum[1] += texel[1];
            sum[2] += texel[2];
            opaque &= texel[3];
        }
    }
    if (opaque != 0) {
        write_block(solid_block(rounded_mean(sum, 16)), out);
        return;
    }
    const OpaqueTexels texels = opaque_texels(rgba, row_bytes);
    if (texels.count == 0) {
        write_block({0, 0, 0xFFFFFFFFU}, out);
    } else {
        write_block(three_colour_block(texels), out);
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

bool bc1_kernel_avx512_runs_here() { return __builtin_cpu_supports("avx512bw") != 0; }

Bc1Kernel* best_bc1_kernel() {
    if (bc1_kernel_avx512_runs_here()) {
        return bc1_kernel_avx512;
    }
    return __builtin_cpu_supports("avx2") ? bc1_kernel_avx2 : bc1_kernel_sse2;
}

void encode_bc1_row(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out) {
    static Bc1Kernel* const kernel = best_bc1_kernel();
    encode_bc1_row_with(kernel, rgba, row_bytes, block_count, out);
}

}  // namespace scree
