// Speed and quality of the BC1 encoder beside stb_dxt and libsquish, on one thread: MPix/s of CPU time (the best of
// several turns, taken in rotation so that all encoders see the same machine) and RGB PSNR over the opaque texels.
// Usage: scree_bc1_bench [TURNS [ENCODER...]]; the first encoder is the measure of the others.
// SCREE_DATA names the folder of the real images; without it only the painted ones run.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <squish.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tools/pyramid/bc1_kernel.h"

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
#pragma GCC diagnostic pop

namespace {

struct Image {
    std::string name;
    std::size_t width = 0;  // multiples of 4
    std::size_t height = 0;
    std::vector<std::uint8_t> rgba;
    bool flat = false;  // of one colour throughout: every encoder skips it, and none is judged by it
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

void stb_high_quality(std::uint8_t* out, const std::uint8_t* pixels) {
    stb_compress_dxt_block(out, pixels, 0, STB_DXT_HIGHQUAL);
}
void squish_cluster(std::uint8_t* out, const std::uint8_t* pixels) {
    squish::Compress(pixels, out, squish::kDxt1 | squish::kColourClusterFit);
}

template <scree::Bc1Kernel* kKernel>
void by_kernel(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out) {
    scree::encode_bc1_row_with(kKernel, rgba, row_bytes, block_count, out);
}

struct Named {
    const char* name;
    RowEncoder encoder;
    bool runs_here;
};

/// Those of `wanted`; all if it names none.
std::vector<Named> encoders(const std::set<std::string>& wanted) {
    const bool avx2 = __builtin_cpu_supports("avx2") != 0;
    const bool avx512 = scree::bc1_kernel_avx512_runs_here();
    std::vector<Named> all{{"stb HQ", by_blocks<stb_high_quality>, true},
                           {"SSE2", by_kernel<scree::bc1_kernel_sse2>, true},
                           {"AVX2", by_kernel<scree::bc1_kernel_avx2>, avx2},
                           {"AVX-512", by_kernel<scree::bc1_kernel_avx512>, avx512},
                           {"high AVX2", by_kernel<scree::bc1_high_kernel_avx2>, avx2},
                           {"high AVX-512", by_kernel<scree::bc1_high_kernel_avx512>, avx512},
                           {"squish cluster", by_blocks<squish_cluster>, true}};
    std::erase_if(
        all, [&](const Named& named) { return !named.runs_here || (!wanted.empty() && !wanted.contains(named.name)); });
    return all;
}

void encode(const Image& image, RowEncoder encoder, std::vector<std::uint8_t>& out) {
    for (std::size_t row = 0; row < image.height / 4; ++row) {
        encoder(&image.rgba[row * 16 * image.width], image.width * 4, image.width / 4, &out[row * image.width * 2]);
    }
}

double cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

/// Seconds for one encoding of the image: the mean over at least 10 ms.
double timed_turn(const Image& image, RowEncoder encoder, std::vector<std::uint8_t>& out) {
    const double start = cpu_seconds();
    for (int repeats = 1;; ++repeats) {
        encode(image, encoder, out);
        const double spent = cpu_seconds() - start;
        if (spent >= 0.01) {
            return spent / repeats;
        }
    }
}

double psnr_db(const Image& image, const std::vector<std::uint8_t>& blocks) {
    double error = 0;
    double samples = 0;
    std::array<std::uint8_t, 64> pixels{};
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        squish::Decompress(pixels.data(), &blocks[i * 8], squish::kDxt1);
        const std::size_t x = i % (image.width / 4) * 4;
        const std::size_t y = i / (image.width / 4) * 4;
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t* source = &image.rgba[((y + k / 4) * image.width + x + k % 4) * 4];
            if (source[3] < 128) {
                continue;
            }
            for (std::size_t c = 0; c < 3; ++c) {
                const int off = pixels[4 * k + c] - source[c];
                error += off * off;
                ++samples;
            }
        }
    }
    return 10 * std::log10(255.0 * 255.0 * samples / error);
}

Image blank(const std::string& name, std::size_t width, std::size_t height) {
    return {name, width / 4 * 4, height / 4 * 4, std::vector<std::uint8_t>(width / 4 * 4 * (height / 4 * 4) * 4, 255)};
}

Image painted_noise() {
    Image image = blank("noise", 512, 512);
    std::mt19937 random(1);
    for (std::size_t i = 0; i < image.rgba.size(); ++i) {
        if (i % 4 != 3) {
            image.rgba[i] = static_cast<std::uint8_t>(random());
        }
    }
    return image;
}

/// Roofs of ten texels along slanted streets, with grain. (No image of the real data resolves a town.)
Image painted_town() {
    constexpr std::array<std::array<int, 3>, 6> kRoofs{
        {{168, 92, 70}, {122, 120, 124}, {205, 198, 186}, {84, 96, 60}, {60, 62, 68}, {150, 140, 120}}};
    Image image = blank("town (painted)", 512, 512);
    std::mt19937 random(7);
    std::vector<std::size_t> roof(4096);
    for (std::size_t& r : roof) {
        r = random() % kRoofs.size();
    }
    for (std::size_t y = 0; y < image.height; ++y) {
        for (std::size_t x = 0; x < image.width; ++x) {
            const std::size_t slanted = x + y / 5;
            const bool street = slanted % 43 < 4 || y % 61 < 4;
            const std::array<int, 3>& colour = kRoofs[roof[(y / 10 * 61 + slanted / 10) % roof.size()]];
            const int grain = static_cast<int>(random() % 13) - 6;
            for (std::size_t c = 0; c < 3; ++c) {
                image.rgba[(y * image.width + x) * 4 + c] =
                    static_cast<std::uint8_t>(std::clamp((street ? 96 : colour[c]) + grain, 0, 255));
            }
        }
    }
    return image;
}

/// The town with round holes of 6 to 40 texels, transparent black inside as the pyramid's filter leaves them.
Image painted_alpha(const Image& town) {
    Image image = town;
    image.name = "alpha (painted)";
    std::mt19937 random(9);
    for (int hole = 0; hole < 60; ++hole) {
        const int cx = static_cast<int>(random() % image.width);
        const int cy = static_cast<int>(random() % image.height);
        const int radius = 3 + static_cast<int>(random() % 18);
        for (int y = std::max(0, cy - radius); y < std::min(static_cast<int>(image.height), cy + radius); ++y) {
            for (int x = std::max(0, cx - radius); x < std::min(static_cast<int>(image.width), cx + radius); ++x) {
                if ((x - cx) * (x - cx) + (y - cy) * (y - cy) < radius * radius) {
                    std::memset(
                        &image.rgba[(static_cast<std::size_t>(y) * image.width + static_cast<std::size_t>(x)) * 4], 0,
                        4);
                }
            }
        }
    }
    return image;
}

struct Crop {
    const char* name;
    const char* file;
    int x, y, width, height;
};

/// What each shows was chosen by eye. Widths are multiples of 64, as rows of tiles are: whole groups of blocks.
constexpr Crop kCrops[] = {{"snow", "world/earth-blue-marble.jpg", 1760, 1860, 1024, 160},
                           {"water", "world/earth-blue-marble.jpg", 200, 600, 512, 384},
                           {"forest", "rmnp/rmnp-rgb.tif", 264, 14, 192, 128},
                           {"mountains", "rmnp/rmnp-rgb.tif", 14, 14, 448, 340},
                           {"desert", "world/earth-blue-marble.jpg", 1880, 620, 384, 200},
                           {"hypsometric", "puget/ps_texture_1k.png", 0, 0, 1024, 1024}};

bool read_crop(const std::string& folder, const Crop& crop, Image& image) {
    const auto input = OIIO::ImageInput::open(folder + '/' + crop.file);
    if (!input) {
        return false;
    }
    const OIIO::ImageSpec& spec = input->spec();
    const auto channels = static_cast<std::size_t>(spec.nchannels);
    if (channels < 3 || crop.x + crop.width > spec.width || crop.y + crop.height > spec.height) {
        return false;
    }
    const auto file_width = static_cast<std::size_t>(spec.width);
    std::vector<std::uint8_t> pixels(file_width * static_cast<std::size_t>(spec.height) * channels);
    if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT8, pixels.data())) {
        return false;
    }
    image = blank(crop.name, static_cast<std::size_t>(crop.width), static_cast<std::size_t>(crop.height));
    for (std::size_t y = 0; y < image.height; ++y) {
        for (std::size_t x = 0; x < image.width; ++x) {
            const std::size_t from =
                (y + static_cast<std::size_t>(crop.y)) * file_width + x + static_cast<std::size_t>(crop.x);
            std::memcpy(&image.rgba[(y * image.width + x) * 4], &pixels[from * channels], 3);
        }
    }
    return true;
}

std::vector<Image> images() {
    std::vector<Image> all;
    if (const char* folder = std::getenv("SCREE_DATA")) {
        for (const Crop& crop : kCrops) {
            Image image;
            if (read_crop(folder, crop, image)) {
                all.push_back(std::move(image));
            } else {
                fmt::print(stderr, "{}/{} cannot be read: no image \"{}\"\n", folder, crop.file, crop.name);
            }
        }
    } else {
        fmt::print(stderr, "SCREE_DATA is not set: the real images are left out\n");
    }
    all.push_back(painted_town());
    all.push_back(painted_alpha(all.back()));
    all.push_back(painted_noise());
    Image sea = blank("one colour", 512, 512);
    for (std::size_t i = 0; i < sea.rgba.size(); i += 4) {
        std::memcpy(&sea.rgba[i], "\x0d\x2c\x4d\xff", 4);
    }
    sea.flat = true;
    all.push_back(std::move(sea));
    Image empty = blank("all transparent", 512, 512);
    std::fill(empty.rgba.begin(), empty.rgba.end(), std::uint8_t{0});
    empty.flat = true;
    all.push_back(std::move(empty));
    return all;
}

struct Measured {
    double mpix_per_s = 0;
    double db = 0;
};

std::vector<Measured> measure(const Image& image, const std::vector<Named>& named, int turns) {
    std::vector<double> seconds(named.size(), 1e9);
    std::vector<Measured> all(named.size());
    std::vector<std::uint8_t> out(image.width * image.height / 2);
    for (int turn = 0; turn < turns; ++turn) {
        for (std::size_t i = 0; i < named.size(); ++i) {
            seconds[i] = std::min(seconds[i], timed_turn(image, named[i].encoder, out));
            all[i].db = psnr_db(image, out);
        }
    }
    for (std::size_t i = 0; i < named.size(); ++i) {
        all[i].mpix_per_s = static_cast<double>(image.width * image.height) / seconds[i] * 1e-6;
    }
    return all;
}

struct Worst {
    double value = 1e9;
    std::string image;
    void take(double candidate, const std::string& name) {
        if (candidate < value) {
            value = candidate;
            image = name;
        }
    }
};

}  // namespace

int main(int argc, char** argv) {
    const int turns = argc > 1 ? std::max(1, std::atoi(argv[1])) : 7;
    const std::vector<Named> named = encoders(std::set<std::string>(argv + std::min(argc, 2), argv + argc));
    fmt::print("| image |");
    for (const Named& n : named) {
        fmt::print(" {} MPix/s | x | dB |", n.name);
    }
    fmt::print("\n| --- |");
    for (std::size_t i = 0; i < named.size(); ++i) {
        fmt::print(" --- | --- | --- |");
    }
    fmt::print("\n");
    // Quality is held against stb_dxt, that of the slow kernels against libsquish.
    std::vector<std::size_t> reference(named.size(), 0);
    for (std::size_t i = 0; i < named.size(); ++i) {
        for (std::size_t k = 0; k < named.size(); ++k) {
            if (std::string(named[i].name).starts_with("high") && std::string(named[k].name).starts_with("squish")) {
                reference[i] = k;
            }
        }
    }
    std::vector<Worst> ratio(named.size());
    std::vector<Worst> gain(named.size());
    for (const Image& image : images()) {
        const std::vector<Measured> all = measure(image, named, turns);
        fmt::print("| {} |", image.name);
        for (std::size_t i = 0; i < named.size(); ++i) {
            const double times = all[i].mpix_per_s / all[0].mpix_per_s;
            fmt::print(" {:.0f} | {:.1f} | {:.2f} |", all[i].mpix_per_s, times, all[i].db);
            if (image.flat) {
                continue;
            }
            ratio[i].take(times, image.name);
            gain[i].take(all[i].db - all[reference[i]].db, image.name);
        }
        fmt::print("\n");
        std::fflush(stdout);
    }
    fmt::print("\n");
    for (std::size_t i = 1; i < named.size(); ++i) {
        fmt::print("{}: at least {:.1f} times {} (worst: {}), at least {:+.3f} dB beside {} (worst: {})\n",
                   named[i].name, ratio[i].value, named[0].name, ratio[i].image, gain[i].value,
                   named[reference[i]].name, gain[i].image);
    }
    return 0;
}
