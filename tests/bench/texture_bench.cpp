// The texture side of a build besides DXT1: the 2 x 2 filter in linear light and the tile codec, on one thread, CPU
// time, the best of several turns. Usage: scree_texture_bench [STORE...]: tiles of stores for the codec.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <vector>

#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tools/pyramid/texture_filter_kernel.h"

namespace {

double cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

double best_seconds(const std::function<void()>& work) {
    double best = 1e9;
    for (int turn = 0; turn < 15; ++turn) {
        const double start = cpu_seconds();
        work();
        best = std::min(best, cpu_seconds() - start);
    }
    return best;
}

void measure_filter(const char* name, const std::function<std::uint8_t(std::mt19937&)>& alpha) {
    constexpr std::size_t kWidth = 2048;
    constexpr int kRows = 400;
    std::mt19937 random(1);
    std::vector<std::uint8_t> upper(kWidth * 4), lower(kWidth * 4), out(kWidth * 2);
    for (auto* row : {&upper, &lower}) {
        for (std::size_t i = 0; i < row->size(); ++i) {
            (*row)[i] = i % 4 == 3 ? alpha(random) : static_cast<std::uint8_t>(random());
        }
    }
    const auto measure = [&](const char* kernel, scree::FilterRow* row, bool runs_here) {
        if (!runs_here) return;
        const double seconds = best_seconds([&] {
            for (int k = 0; k < kRows; ++k) {
                row(scree::filter_tables(), upper.data(), lower.data(), kWidth / 2, out.data());
            }
        });
        fmt::print("filter, {}, {}: {:.0f} MPix/s of the finer level\n", name, kernel,
                   kWidth * 2 * kRows / seconds * 1e-6);
    };
    measure("scalar", scree::filter_row_scalar, true);
    measure("AVX2", scree::filter_row_avx2, scree::filter_row_avx2_runs_here());
    measure("AVX-512", scree::filter_row_avx512, scree::filter_row_avx512_runs_here());
}

/// Encodes and decodes again up to 1000 tiles, evenly spread over the store.
bool measure_codec(const char* path) {
    const auto store = scree::SqliteStore::open(path);
    const auto contents = store ? (*store)->contents() : scree::Result<scree::SqliteStore::Contents>(store.error());
    if (!contents) {
        fmt::print(stderr, "{}\n", contents.error().message);
        return false;
    }
    const int log2 = (*store)->dataset().texture_size_log2;
    const std::int64_t stride = contents->texture_rows / 1000 + 1;
    std::vector<scree::TextureTile> tiles;
    std::int64_t row = 0;
    const auto visited = (*store)->for_each(scree::TileKind::texture, [&](const scree::SqliteStore::RowView& view) {
        if (row++ % stride == 0) {
            if (auto tile = scree::decode_texture_tile(view.payload, log2, view.codec)) {
                tiles.push_back(std::move(*tile));
            }
        }
        return true;
    });
    if (!visited || tiles.empty()) {
        fmt::print(stderr, "{}: no texture tile can be read\n", path);
        return false;
    }
    std::vector<std::vector<std::uint8_t>> payloads(tiles.size());
    const double encoding = best_seconds([&] {
        for (std::size_t k = 0; k < tiles.size(); ++k) {
            payloads[k] = scree::encode_texture_tile(tiles[k], log2, scree::TextureCodec::split);
        }
    });
    std::size_t bytes = 0;
    scree::TextureTile reused;
    const double decoding = best_seconds([&] {
        bytes = 0;
        for (const auto& payload : payloads) {
            bytes += payload.size();
            (void)scree::decode_texture_tile(payload, log2, static_cast<int>(scree::TextureCodec::split), reused);
        }
    });
    const auto raw = static_cast<double>(tiles.size() * scree::bc1_chain_bytes(log2));
    const double texels = 2 * raw;
    fmt::print("codec, {}: {} tiles, {:.4f} bytes a texel of 0.5, {:.3f} ns a texel to encode, decoding {:.2f} GB/s\n",
               path, tiles.size(), static_cast<double>(bytes) / texels, encoding / texels * 1e9, raw / decoding * 1e-9);
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    measure_filter("opaque", [](std::mt19937&) { return std::uint8_t{255}; });
    measure_filter("transparent", [](std::mt19937&) { return std::uint8_t{0}; });
    measure_filter("one texel in 16 transparent",
                   [](std::mt19937& random) { return static_cast<std::uint8_t>(random() % 16 == 0 ? 0 : 255); });
    for (int k = 1; k < argc; ++k) {
        if (!measure_codec(argv[k])) {
            return 1;
        }
    }
    return 0;
}
