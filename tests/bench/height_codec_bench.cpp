// The height codec beside the same idea written down plainly (plane predictor, zigzag, byte planes, Zstandard level 1),
// on one thread, over the deepest tiles of DEMs and of made terrains. scree_height_codec_bench DEM...
#include <fmt/format.h>
#include <zstd.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/process_usage.h"
#include "common/store/height_codec.h"
#include "tools/pyramid/height_quantizer.h"
#include "tools/source/height_source.h"

namespace {

using namespace scree;

constexpr int kLog2 = 5, kPitch = (1 << kLog2) + 1, kSamples = kPitch * kPitch;
constexpr std::size_t kMostTiles = 4096;

using Bytes = std::vector<std::uint8_t>;
using Samples = std::vector<std::int32_t>;

// --- the plain codec ---

Bytes plain_encode(const Samples& z) {
    Bytes planes(4 * kSamples);
    for (int j = 0; j < kPitch; ++j)
        for (int i = 0; i < kPitch; ++i) {
            const int k = j * kPitch + i;
            const auto at = [&](int back) { return z[static_cast<std::size_t>(k - back)]; };
            const std::int32_t predicted = i > 0 && j > 0 ? at(1) + at(kPitch) - at(kPitch + 1)
                                           : i > 0        ? at(1)
                                           : j > 0        ? at(kPitch)
                                                          : 0;
            const std::int32_t r = at(0) - predicted;
            const std::uint32_t zigzag = (static_cast<std::uint32_t>(r) << 1) ^ static_cast<std::uint32_t>(r >> 31);
            for (int b = 0; b < 4; ++b)
                planes[static_cast<std::size_t>(b * kSamples + k)] = static_cast<std::uint8_t>(zigzag >> (8 * b));
        }
    static ZSTD_CCtx* const context = ZSTD_createCCtx();
    Bytes packed(ZSTD_compressBound(planes.size()));
    packed.resize(ZSTD_compressCCtx(context, packed.data(), packed.size(), planes.data(), planes.size(), 1));
    return packed;
}

Samples plain_decode(const Bytes& packed) {
    static ZSTD_DCtx* const context = ZSTD_createDCtx();
    Bytes planes(4 * kSamples);
    ZSTD_decompressDCtx(context, planes.data(), planes.size(), packed.data(), packed.size());
    Samples z(kSamples);
    for (int j = 0; j < kPitch; ++j)
        for (int i = 0; i < kPitch; ++i) {
            const int k = j * kPitch + i;
            std::uint32_t zigzag = 0;
            for (int b = 0; b < 4; ++b)
                zigzag |= std::uint32_t{planes[static_cast<std::size_t>(b * kSamples + k)]} << (8 * b);
            const auto at = [&](int back) { return z[static_cast<std::size_t>(k - back)]; };
            const std::int32_t predicted = i > 0 && j > 0 ? at(1) + at(kPitch) - at(kPitch + 1)
                                           : i > 0        ? at(1)
                                           : j > 0        ? at(kPitch)
                                                          : 0;
            z[static_cast<std::size_t>(k)] = predicted + static_cast<std::int32_t>((zigzag >> 1) ^ (~(zigzag & 1) + 1));
        }
    return z;
}

// --- terrains ---

struct Terrain {
    std::string name;
    std::vector<Samples> tiles;
};

Terrain of_file(const std::string& path) {
    auto dem = open_heights(path, {});
    if (!dem) {
        fmt::print(stderr, "{}\n", dem.error().message);
        std::exit(1);
    }
    const ImageInfo& info = (*dem)->info();
    const HeightQuantizer quantizer{1, 0, 0, is_integer(info.type) ? 1 : 1.0 / 64};
    Terrain terrain{path.substr(path.rfind('/') + 1), {}};
    std::vector<double> band(static_cast<std::size_t>(kPitch * info.width));
    for (std::int64_t j = 0; j + kPitch <= info.height && terrain.tiles.size() < kMostTiles; j += kPitch) {
        if (!(*dem)->read_channel(j, j + kPitch, std::span<double>(band))) std::exit(1);
        for (std::int64_t i = 0; i + kPitch <= info.width && terrain.tiles.size() < kMostTiles; i += kPitch) {
            Samples tile;
            for (int r = 0; r < kPitch; ++r)
                for (int c = 0; c < kPitch; ++c) {
                    const double v = band[static_cast<std::size_t>(r * info.width + i + c)];
                    tile.push_back(quantizer.quantize(std::isfinite(v) ? v : 0));
                }
            terrain.tiles.push_back(std::move(tile));
        }
    }
    return terrain;
}

Terrain made(const char* name, const std::function<double(int x, int y)>& height) {
    Terrain terrain{name, {}};
    for (int t = 0; t < 1024; ++t) {
        Samples tile;
        for (int r = 0; r < kPitch; ++r)
            for (int c = 0; c < kPitch; ++c)
                tile.push_back(static_cast<std::int32_t>(std::lround(height(t % 32 * 32 + c, t / 32 * 32 + r))));
        terrain.tiles.push_back(std::move(tile));
    }
    return terrain;
}

// --- measuring ---

// Million samples a second; CPU time, the best of seven.
double rate(std::size_t tiles, const std::function<void(std::size_t)>& work) {
    double best = 0;
    for (int pass = 0; pass < 7; ++pass) {
        const double start = thread_cpu_seconds();
        for (std::size_t t = 0; t < tiles; ++t) work(t);
        const double s = thread_cpu_seconds() - start;
        best = std::max(best, static_cast<double>(tiles) * kSamples / 1e6 / s);
    }
    return best;
}

double bytes_a_sample(const std::vector<Bytes>& packed) {
    std::size_t bytes = 0;
    for (const Bytes& b : packed) bytes += b.size();
    return static_cast<double>(bytes) / static_cast<double>(packed.size()) / kSamples;
}

void report(const Terrain& terrain) {
    const std::size_t count = terrain.tiles.size();
    std::vector<HeightTile> tiles(count);
    for (std::size_t t = 0; t < count; ++t) tiles[t].samples = terrain.tiles[t];
    std::vector<Bytes> ours(count), plain(count);
    const double our_encode =
        rate(count, [&](std::size_t t) { ours[t] = encode_height_tile(tiles[t], kLog2, HeightCodec::plane); });
    const double plain_rate = rate(count, [&](std::size_t t) { plain[t] = plain_encode(terrain.tiles[t]); });
    HeightTile decoded;
    const double our_decode = rate(count, [&](std::size_t t) {
        if (!decode_height_tile(ours[t], kLog2, static_cast<int>(HeightCodec::plane), decoded) ||
            decoded.samples != terrain.tiles[t])
            std::abort();
    });
    const double plain_decode_rate = rate(count, [&](std::size_t t) {
        if (plain_decode(plain[t]) != terrain.tiles[t]) std::abort();
    });
    fmt::print("| {} | {:.3f} / {:.3f} | {:.0f} / {:.0f} | {:.0f} / {:.0f} |\n", terrain.name, bytes_a_sample(ours),
               bytes_a_sample(plain), our_encode, plain_rate, our_decode, plain_decode_rate);
}

}  // namespace

int main(int argc, char** argv) {
    fmt::print("Scree / plain\n| terrain | bytes a sample | encode MSamples/s | decode MSamples/s |\n");
    for (int k = 1; k < argc; ++k) report(of_file(argv[k]));
    report(made("smooth", [](int x, int y) { return 30000 + 20000 * std::sin(x * 0.004) * std::cos(y * 0.005); }));
    report(made("constant", [](int, int) { return 7.0; }));
    std::mt19937 random(1);
    report(made("noise", [&](int, int) { return static_cast<double>(random() % 4096); }));
}
