// Speed and quality of the BC1 encoder beside stb_dxt and libsquish, on one thread. Items are pixels.
// SCREE_DATA names the folder of the real images; without it only the synthetic ones run.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "tools/pyramid/bc1_kernel.h"

#include <squish.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_DXT_STATIC
#define STB_DXT_IMPLEMENTATION
#include <stb/stb_dxt.h>
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace {

struct Image {
    std::string name;
    std::size_t width = 0;  // multiples of 4
    std::size_t height = 0;
    std::vector<std::uint8_t> rgba;
};

using RowEncoder = void (*)(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count,
                            std::uint8_t* out);

template <void (*kEncodeBlock)(std::uint8_t* out, const std::uint8_t* pixels)>
void by_blocks(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out) {
    std::array<std::uint8_t, 64> pixels{};
    for (std::size_t block = 0; block < block_count; ++block) {
        for (std::size_t y = 0; y < 4; ++y) {
            std::memcpy(&pixels[y * 16], rgba + y * row_bytes + block * 16, 16);
        }
        kEncodeBlock(out + block * 8, pixels.data());
    }
}

void stb_normal(std::uint8_t* out, const std::uint8_t* pixels) {
    stb_compress_dxt_block(out, pixels, 0, STB_DXT_NORMAL);
}
void stb_high_quality(std::uint8_t* out, const std::uint8_t* pixels) {
    stb_compress_dxt_block(out, pixels, 0, STB_DXT_HIGHQUAL);
}
void squish_range(std::uint8_t* out, const std::uint8_t* pixels) {
    squish::Compress(pixels, out, squish::kDxt1 | squish::kColourRangeFit);
}

template <scree::Bc1Kernel* kKernel>
void by_kernel(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out) {
    scree::encode_bc1_row_with(kKernel, rgba, row_bytes, block_count, out);
}

void encode(const Image& image, RowEncoder encoder, std::vector<std::uint8_t>& out) {
    for (std::size_t row = 0; row < image.height / 4; ++row) {
        encoder(&image.rgba[row * 16 * image.width], image.width * 4, image.width / 4, &out[row * image.width * 2]);
    }
}

double psnr_db(const Image& image, const std::vector<std::uint8_t>& blocks) {
    double error = 0;
    std::array<std::uint8_t, 64> pixels{};
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        squish::Decompress(pixels.data(), &blocks[i * 8], squish::kDxt1);
        const std::size_t x = i % (image.width / 4) * 4;
        const std::size_t y = i / (image.width / 4) * 4;
        for (std::size_t k = 0; k < 64; ++k) {
            const int off = pixels[k] - image.rgba[((y + k / 16) * image.width + x) * 4 + k % 16];
            error += off * off;  // alpha is 255 on both sides
        }
    }
    const double samples = static_cast<double>(image.width * image.height * 3);
    return 10 * std::log10(255.0 * 255.0 * samples / error);
}

void measure(benchmark::State& state, const Image& image, RowEncoder encoder) {
    std::vector<std::uint8_t> out(image.width * image.height / 2);
    for (auto _ : state) {
        encode(image, encoder, out);
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(image.width * image.height) *
                            static_cast<std::int64_t>(state.iterations()));
    state.counters["PSNR_dB"] = psnr_db(image, out);
}

Image opaque_copy(const std::string& name, const std::uint8_t* rgba, std::size_t width, std::size_t height) {
    Image image{name, width / 4 * 4, height / 4 * 4, {}};
    for (std::size_t y = 0; y < image.height; ++y) {
        const std::uint8_t* row = rgba + y * width * 4;
        image.rgba.insert(image.rgba.end(), row, row + image.width * 4);
    }
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
        image.rgba[i] = 255;
    }
    return image;
}

std::vector<Image> images() {
    constexpr std::size_t kSide = 1024;
    std::vector<Image> all;
    std::mt19937 random(1);
    std::vector<std::uint8_t> noise(kSide * kSide * 4);
    for (std::uint8_t& value : noise) {
        value = static_cast<std::uint8_t>(random());
    }
    all.push_back(opaque_copy("noise", noise.data(), kSide, kSide));
    const std::vector<std::uint8_t> solid(kSide * kSide * 4, 77);
    all.push_back(opaque_copy("solid", solid.data(), kSide, kSide));
    if (const char* folder = std::getenv("SCREE_DATA")) {
        for (const char* file : {"puget/ps_texture_1k.png", "world/earth-blue-marble.jpg"}) {
            int width = 0;
            int height = 0;
            int channels = 0;
            const std::string path = std::string(folder) + '/' + file;
            if (std::uint8_t* rgba = stbi_load(path.c_str(), &width, &height, &channels, 4)) {
                all.push_back(
                    opaque_copy(file, rgba, static_cast<std::size_t>(width), static_cast<std::size_t>(height)));
                stbi_image_free(rgba);
            }
        }
    }
    return all;
}

}  // namespace

int main(int argc, char** argv) {
    struct Named {
        const char* name;
        RowEncoder encoder;
        bool runs_here;
    };
    const std::array<Named, 6> encoders{
        {{"stb_dxt", by_blocks<stb_normal>, true},
         {"stb_dxt_highqual", by_blocks<stb_high_quality>, true},
         {"squish_range", by_blocks<squish_range>, true},
         {"scree_sse2", by_kernel<scree::bc1_kernel_sse2>, true},
         {"scree_avx2", by_kernel<scree::bc1_kernel_avx2>, __builtin_cpu_supports("avx2") != 0},
         {"scree_avx512", by_kernel<scree::bc1_kernel_avx512>, __builtin_cpu_supports("avx512bw") != 0}}};
    const std::vector<Image> all = images();
    for (const Image& image : all) {
        for (const Named& named : encoders) {
            if (named.runs_here) {
                const std::string name = std::string(named.name) + '/' + image.name;
                benchmark::RegisterBenchmark(name.c_str(), measure, std::cref(image), named.encoder);
            }
        }
    }
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
