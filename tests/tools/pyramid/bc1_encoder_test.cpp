#include "tools/pyramid/bc1_encoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/common/test_support.h"
#include "tools/pyramid/bc1_kernel.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_DXT_STATIC
#define STB_DXT_IMPLEMENTATION
#include <stb/stb_dxt.h>
#pragma GCC diagnostic pop

namespace scree {
namespace {

struct Image {
    std::size_t width = 0;  // multiples of 4
    std::size_t height = 0;
    std::vector<std::uint8_t> rgba;

    Image(std::size_t w, std::size_t h) : width(w), height(h), rgba(w * h * 4, 255) {}
    std::uint8_t* texel(std::size_t x, std::size_t y) { return &rgba[(y * width + x) * 4]; }
    const std::uint8_t* texel(std::size_t x, std::size_t y) const { return &rgba[(y * width + x) * 4]; }
};

// The reference decoder follows the text of EXT_texture_compression_s3tc, with interpolated levels rounded down.

using Texel = std::array<int, 4>;

std::array<Texel, 4> decoded_palette(const std::uint8_t* block) {
    const int first = block[0] + 256 * block[1];
    const int second = block[2] + 256 * block[3];
    const auto expand = [](int code) {
        const int r = code / 2048;
        const int g = code / 32 % 64;
        const int b = code % 32;
        return Texel{r * 8 + r / 4, g * 4 + g / 16, b * 8 + b / 4, 255};
    };
    std::array<Texel, 4> palette{expand(first), expand(second), Texel{0, 0, 0, 255}, Texel{0, 0, 0, 255}};
    for (std::size_t c = 0; c < 3; ++c) {
        const int a = palette[0][c];
        const int b = palette[1][c];
        palette[2][c] = first > second ? (2 * a + b) / 3 : (a + b) / 2;
        palette[3][c] = first > second ? (a + 2 * b) / 3 : 0;
    }
    palette[3][3] = first > second ? 255 : 0;
    return palette;
}

std::array<Texel, 16> decoded(const std::uint8_t* block) {
    const std::array<Texel, 4> palette = decoded_palette(block);
    std::array<Texel, 16> texels{};
    for (std::size_t i = 0; i < 16; ++i) {
        texels[i] = palette[static_cast<std::size_t>(block[4 + i / 4] >> (2 * (i % 4)) & 3)];
    }
    return texels;
}

std::vector<std::uint8_t> encoded(const Image& image, Bc1Kernel* kernel = nullptr) {
    const std::size_t blocks = image.width / 4;
    std::vector<std::uint8_t> out(blocks * (image.height / 4) * 8);
    for (std::size_t row = 0; row < image.height / 4; ++row) {
        const std::uint8_t* pixels = image.texel(0, row * 4);
        std::uint8_t* row_out = &out[row * blocks * 8];
        if (kernel == nullptr) {
            encode_bc1_row(pixels, image.width * 4, blocks, row_out);
        } else {
            encode_bc1_row_with(kernel, pixels, image.width * 4, blocks, row_out);
        }
    }
    return out;
}

std::vector<std::uint8_t> encoded_by_stb(const Image& image) {
    const std::size_t blocks = image.width / 4;
    std::vector<std::uint8_t> out(blocks * (image.height / 4) * 8);
    for (std::size_t i = 0; i < out.size() / 8; ++i) {
        std::array<std::uint8_t, 64> pixels{};
        for (std::size_t y = 0; y < 4; ++y) {
            std::memcpy(&pixels[y * 16], image.texel(i % blocks * 4, i / blocks * 4 + y), 16);
        }
        stb_compress_dxt_block(&out[i * 8], pixels.data(), 0, STB_DXT_HIGHQUAL);
    }
    return out;
}

/// Sum of squared differences of R, G, B.
double squared_error(const Image& image, const std::vector<std::uint8_t>& blocks) {
    const std::size_t across = image.width / 4;
    double error = 0;
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        const std::array<Texel, 16> texels = decoded(&blocks[i * 8]);
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t* source = image.texel(i % across * 4 + k % 4, i / across * 4 + k / 4);
            for (std::size_t c = 0; c < 3; ++c) {
                const double off = source[c] - texels[k][c];
                error += off * off;
            }
        }
    }
    return error;
}

double psnr_db(const Image& image, const std::vector<std::uint8_t>& blocks) {
    const double mean = squared_error(image, blocks) / static_cast<double>(image.width * image.height * 3);
    return 10 * std::log10(255.0 * 255.0 / mean);
}

using Random = std::mt19937;  // its sequence is fixed by the standard; the distributions' are not

int below(Random& random, int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); }

std::uint8_t level(double value) { return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0) + 0.5); }

/// Smooth noise of one octave, -1..1, cells of `cell` pixels.
class SmoothNoise {
public:
    explicit SmoothNoise(unsigned seed) : random_(seed) {
        for (double& value : lattice_) {
            value = below(random_, 2001) / 1000.0 - 1.0;
        }
    }
    double at(double x, double y) const {
        const auto fx = static_cast<std::size_t>(x);
        const auto fy = static_cast<std::size_t>(y);
        const double u = x - static_cast<double>(fx);
        const double v = y - static_cast<double>(fy);
        const double top = value(fx, fy) * (1 - u) + value(fx + 1, fy) * u;
        const double bottom = value(fx, fy + 1) * (1 - u) + value(fx + 1, fy + 1) * u;
        return top * (1 - v) + bottom * v;
    }

private:
    double value(std::size_t x, std::size_t y) const { return lattice_[y % 64 * 64 + x % 64]; }
    Random random_;
    std::array<double, 4096> lattice_{};
};

struct Scene {
    std::string name;
    std::function<Image()> paint;
};

constexpr std::size_t kSide = 256;

Image painted(const std::function<void(std::size_t x, std::size_t y, std::uint8_t* texel)>& paint) {
    Image image(kSide, kSide);
    for (std::size_t y = 0; y < kSide; ++y) {
        for (std::size_t x = 0; x < kSide; ++x) {
            paint(x, y, image.texel(x, y));
        }
    }
    return image;
}

Image noise() {
    Random random(1);
    return painted([&](std::size_t, std::size_t, std::uint8_t* texel) {
        for (int c = 0; c < 3; ++c) {
            texel[c] = static_cast<std::uint8_t>(below(random, 256));
        }
    });
}

Image gradients() {
    return painted([](std::size_t x, std::size_t y, std::uint8_t* texel) {
        texel[0] = static_cast<std::uint8_t>(x);
        texel[1] = static_cast<std::uint8_t>(y);
        texel[2] = static_cast<std::uint8_t>((x + y) / 2);
    });
}

Image grey_gradient() {
    return painted([](std::size_t x, std::size_t y, std::uint8_t* texel) {
        texel[0] = texel[1] = texel[2] = static_cast<std::uint8_t>((x + y) / 2);
    });
}

Image snow() {
    const SmoothNoise shade(2);
    Random random(3);
    return painted([&](std::size_t x, std::size_t y, std::uint8_t* texel) {
        const double s = shade.at(static_cast<double>(x) / 24, static_cast<double>(y) / 24);
        const double grain = below(random, 5) - 2;
        texel[0] = level(232 + 18 * s + grain);
        texel[1] = level(236 + 16 * s + grain);
        texel[2] = level(244 + 10 * s + grain);
    });
}

Image forest() {
    const SmoothNoise crowns(4);
    const SmoothNoise species(5);
    Random random(6);
    return painted([&](std::size_t x, std::size_t y, std::uint8_t* texel) {
        const double c = crowns.at(static_cast<double>(x) / 3, static_cast<double>(y) / 3);
        const double s = species.at(static_cast<double>(x) / 30, static_cast<double>(y) / 30);
        const double grain = below(random, 17) - 8;
        texel[0] = level(48 + 30 * c + 14 * s + grain);
        texel[1] = level(66 + 38 * c + grain);
        texel[2] = level(38 + 22 * c - 8 * s + grain);
    });
}

Image town() {
    constexpr std::array<std::array<int, 3>, 6> kRoofs{
        {{168, 92, 70}, {122, 120, 124}, {205, 198, 186}, {84, 96, 60}, {60, 62, 68}, {150, 140, 120}}};
    Random random(7);
    std::vector<std::size_t> roof((kSide / 8) * (kSide / 8));
    for (std::size_t& r : roof) {
        r = random() % kRoofs.size();
    }
    return painted([&](std::size_t x, std::size_t y, std::uint8_t* texel) {
        const std::size_t slanted = (x + y / 5) % kSide;
        const bool street = slanted % 23 < 3 || y % 31 < 3;
        const std::size_t house = y / 8 * (kSide / 8) + slanted / 8;
        const double grain = below(random, 7) - 3;
        for (std::size_t c = 0; c < 3; ++c) {
            texel[c] = level((street ? 96 : kRoofs[roof[house]][c]) + grain);
        }
    });
}

Image sea() {
    Random random(8);
    return painted([&](std::size_t, std::size_t y, std::uint8_t* texel) {
        texel[0] = static_cast<std::uint8_t>(10 + below(random, 2));
        texel[1] = static_cast<std::uint8_t>(40 + static_cast<int>(y / 64) + below(random, 3));
        texel[2] = static_cast<std::uint8_t>(90 + below(random, 2));
    });
}

std::vector<Scene> scenes() {
    return {{"Noise", noise}, {"Gradients", gradients}, {"GreyGradient", grey_gradient},
            {"Snow", snow},   {"Forest", forest},       {"Town", town},
            {"Sea", sea}};
}

struct NamedKernel {
    std::string name;
    Bc1Kernel* kernel = nullptr;
    bool runs_here = false;
};

std::vector<NamedKernel> kernels(TextureQuality quality) {
    const bool high = quality == TextureQuality::high;
    return {{"Sse2", high ? bc1_high_kernel_sse2 : bc1_kernel_sse2, true},
            {"Avx2", high ? bc1_high_kernel_avx2 : bc1_kernel_avx2, __builtin_cpu_supports("avx2") != 0},
            {"Avx512", high ? bc1_high_kernel_avx512 : bc1_kernel_avx512, bc1_kernel_avx512_runs_here()}};
}

constexpr TextureQuality kQualities[] = {TextureQuality::normal, TextureQuality::high};

/// Blocks of every character side by side: noise, few levels, solid, two colours, with and without transparent texels.
Image random_blocks(unsigned seed, bool with_alpha) {
    Random random(seed);
    Image image(4 * 259, 4 * 12);
    for (std::size_t by = 0; by < image.height / 4; ++by) {
        for (std::size_t bx = 0; bx < image.width / 4; ++bx) {
            const int kind = below(random, 6);
            const int alpha_kind = with_alpha ? below(random, 4) : 3;
            std::array<int, 6> base{};
            for (int& value : base) {
                value = below(random, 256);
            }
            for (std::size_t i = 0; i < 16; ++i) {
                std::uint8_t* texel = image.texel(bx * 4 + i % 4, by * 4 + i / 4);
                const bool other = below(random, 2) != 0;
                const int along = below(random, 65);
                for (std::size_t c = 0; c < 3; ++c) {
                    const int a = base[c];
                    const int b = base[c + 3];
                    int value = a;
                    if (kind == 0) {
                        value = below(random, 256);
                    } else if (kind == 1) {
                        value = a + below(random, 3);
                    } else if (kind == 2) {
                        value = other ? a : b;
                    } else if (kind == 3) {
                        value = a + (b - a) * along / 64;
                    } else if (kind == 4) {
                        value = a + (b - a) * along / 64 + below(random, 9) - 4;
                    }
                    texel[c] = level(value);
                }
                const std::array<int, 4> alphas{below(random, 256), other ? 127 : 128, 0, 255};
                texel[3] = static_cast<std::uint8_t>(alphas[static_cast<std::size_t>(alpha_kind)]);
            }
        }
    }
    return image;
}

/// Areas of one colour and transparent ones, in runs of many lengths, with noise and rims between.
Image flat_areas(unsigned seed) {
    Random random(seed);
    Image image(4 * 259, 4 * 12);
    for (std::size_t by = 0; by < image.height / 4; ++by) {
        for (std::size_t bx = 0; bx < image.width / 4;) {
            const int kind = below(random, 5);
            const std::size_t end = std::min(image.width / 4, bx + 1 + random() % 60);
            const std::array<int, 3> colour{below(random, 256), below(random, 256), below(random, 256)};
            for (; bx < end; ++bx) {
                for (std::size_t i = 0; i < 16; ++i) {
                    std::uint8_t* texel = image.texel(bx * 4 + i % 4, by * 4 + i / 4);
                    for (std::size_t c = 0; c < 3; ++c) {
                        texel[c] = static_cast<std::uint8_t>(kind == 0 ? below(random, 256) : colour[c]);
                    }
                    texel[3] = static_cast<std::uint8_t>(kind == 1 ? 0 : kind == 2 ? below(random, 2) * 255 : 255);
                }
            }
        }
    }
    return image;
}

/// The least squared error over all blocks that show a single colour, by trying all of them. Channels are independent
/// but for the mode.
int best_solid_error(const std::array<int, 3>& colour) {
    static const auto attainable = [] {
        std::array<std::array<std::array<int, 256>, 2>, 2> best{};  // [third, half][5, 6 bits][level]
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t six = 0; six < 2; ++six) {
                best[half][six].fill(256 * 256);
                const int codes = six == 1 ? 64 : 32;
                for (int first = 0; first < codes; ++first) {
                    for (int second = 0; second < codes; ++second) {
                        const auto expand = [&](int v) { return six == 1 ? v * 4 + v / 16 : v * 8 + v / 4; };
                        const int a = expand(first);
                        const int b = expand(second);
                        const int shown = half == 1 ? (a + b) / 2 : (2 * a + b) / 3;
                        for (int wanted = 0; wanted < 256; ++wanted) {
                            int& error = best[half][six][static_cast<std::size_t>(wanted)];
                            error = std::min(error, (shown - wanted) * (shown - wanted));
                        }
                    }
                }
            }
        }
        return best;
    }();
    std::array<int, 2> total{};
    for (std::size_t half = 0; half < 2; ++half) {
        for (std::size_t c = 0; c < 3; ++c) {
            total[half] += attainable[half][c == 1 ? 1 : 0][static_cast<std::size_t>(colour[c])];
        }
    }
    return std::min(total[0], total[1]);
}

void expect_best_solid(const std::array<int, 3>& colour) {
    Image image(4, 4);
    for (std::size_t i = 0; i < 16; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            image.texel(i % 4, i / 4)[c] = static_cast<std::uint8_t>(colour[c]);
        }
    }
    const std::vector<std::uint8_t> block = encoded(image);
    EXPECT_EQ(squared_error(image, block), 16 * best_solid_error(colour))
        << colour[0] << ' ' << colour[1] << ' ' << colour[2];
    EXPECT_EQ(decoded(block.data())[0][3], 255);
}

TEST(Bc1Encoder, IsNotWorseThanStbHighQualityOnAnyScene) {
    for (const Scene& scene : scenes()) {
        const Image image = scene.paint();
        const double ours = psnr_db(image, encoded(image));
        const double stb = psnr_db(image, encoded_by_stb(image));
        EXPECT_GE(ours, stb) << scene.name;
        RecordProperty(scene.name, std::to_string(ours) + " dB, stb_dxt " + std::to_string(stb) + " dB");
    }
}

TEST(Bc1Encoder, EveryTexelDecodesTransparentExactlyBelowAlpha128) {
    const Image image = random_blocks(11, true);
    const std::vector<std::uint8_t> blocks = encoded(image);
    const std::size_t across = image.width / 4;
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        const std::array<Texel, 16> texels = decoded(&blocks[i * 8]);
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t* source = image.texel(i % across * 4 + k % 4, i / across * 4 + k / 4);
            ASSERT_EQ(texels[k][3], source[3] < 128 ? 0 : 255) << "block " << i << " texel " << k;
        }
    }
}

TEST(Bc1Encoder, ColourOfTransparentTexelsDoesNotInfluenceTheBytes) {
    const Image image = random_blocks(12, true);
    Image repainted = image;
    Random random(13);
    for (std::size_t i = 0; i < repainted.rgba.size(); i += 4) {
        if (repainted.rgba[i + 3] < 128) {
            for (std::size_t c = 0; c < 3; ++c) {
                repainted.rgba[i + c] = static_cast<std::uint8_t>(below(random, 256));
            }
        }
    }
    ASSERT_NE(repainted.rgba, image.rgba);
    EXPECT_EQ(encoded(repainted), encoded(image));
}

TEST(Bc1Encoder, AlphaWithinOpaqueOrTransparentDoesNotInfluenceTheBytes) {
    const Image image = random_blocks(14, true);
    Image hard = image;
    for (std::size_t i = 3; i < hard.rgba.size(); i += 4) {
        hard.rgba[i] = hard.rgba[i] < 128 ? 0 : 255;
    }
    ASSERT_NE(hard.rgba, image.rgba);
    EXPECT_EQ(encoded(hard), encoded(image));
}

TEST(Bc1Encoder, OpaqueTexelsOfATransparentBlockKeepTheirColours) {
    // Two colours that BC1 holds exactly, in halves of the block beside a transparent column.
    Image image(4, 4);
    for (std::size_t i = 0; i < 16; ++i) {
        std::uint8_t* texel = image.texel(i % 4, i / 4);
        const std::array<std::uint8_t, 4> colour =
            i / 4 < 2 ? std::array<std::uint8_t, 4>{255, 0, 0, 255} : std::array<std::uint8_t, 4>{0, 0, 255, 255};
        std::copy(colour.begin(), colour.end(), texel);
        if (i % 4 == 3) {
            texel[3] = 0;
        }
    }
    const std::array<Texel, 16> texels = decoded(encoded(image).data());
    for (std::size_t i = 0; i < 16; ++i) {
        const Texel wanted = i / 4 < 2 ? Texel{255, 0, 0, 255} : Texel{0, 0, 255, 255};
        EXPECT_EQ(texels[i], i % 4 == 3 ? (Texel{0, 0, 0, 0}) : wanted) << i;
    }
}

/// PSNR over the opaque texels.
double opaque_psnr_db(const Image& image, const std::vector<std::uint8_t>& blocks) {
    const std::size_t across = image.width / 4;
    double error = 0;
    double samples = 0;
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        const std::array<Texel, 16> texels = decoded(&blocks[i * 8]);
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t* source = image.texel(i % across * 4 + k % 4, i / across * 4 + k / 4);
            for (std::size_t c = 0; c < 3 && source[3] >= 128; ++c) {
                const double off = source[c] - texels[k][c];
                error += off * off;
                ++samples;
            }
        }
    }
    return 10 * std::log10(255.0 * 255.0 * samples / error);
}

TEST(Bc1Encoder, RimsAreNotWorseThanStbMakesThem) {
    // Every block has transparent texels, black as the pyramid's filter leaves them: stb_dxt fits its four colours to
    // them too, and shows the opaque ones with what is left.
    for (const Scene& scene : scenes()) {
        Image image = scene.paint();
        for (std::size_t y = 0; y < image.height; ++y) {
            for (std::size_t x = 0; x < image.width; ++x) {
                if ((x + y / 8) % 4 == 0) {
                    std::memset(image.texel(x, y), 0, 4);
                }
            }
        }
        EXPECT_GE(opaque_psnr_db(image, encoded(image)), opaque_psnr_db(image, encoded_by_stb(image)) + 0.5)
            << scene.name;
    }
}

TEST(Bc1Encoder, AnAllTransparentBlockHasOneEncoding) {
    Random random(15);
    const std::vector<std::uint8_t> wanted{0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF};
    for (int repeat = 0; repeat < 20; ++repeat) {
        Image image(4, 4);
        for (std::size_t i = 0; i < image.rgba.size(); ++i) {
            image.rgba[i] = static_cast<std::uint8_t>(i % 4 == 3 ? below(random, 128) : below(random, 256));
        }
        EXPECT_EQ(encoded(image), wanted);
    }
}

TEST(Bc1Encoder, AnOpaqueBlockNeverUsesIndexThreeInThreeColourMode) {
    std::vector<Image> images{random_blocks(16, false), random_blocks(17, false)};
    for (const Scene& scene : scenes()) {
        images.push_back(scene.paint());
    }
    for (const Image& image : images) {
        const std::vector<std::uint8_t> blocks = encoded(image);
        for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
            for (const Texel& texel : decoded(&blocks[i * 8])) {
                ASSERT_EQ(texel[3], 255) << "block " << i;
            }
        }
    }
}

TEST(Bc1Encoder, EveryGreyLevelDecodesWithTheLeastAttainableError) {
    for (int grey = 0; grey < 256; ++grey) {
        expect_best_solid({grey, grey, grey});
    }
}

TEST(Bc1Encoder, SolidColoursDecodeWithTheLeastAttainableError) {
    Random random(18);
    for (int repeat = 0; repeat < 5000; ++repeat) {
        expect_best_solid({below(random, 256), below(random, 256), below(random, 256)});
    }
}

TEST(Bc1Encoder, EveryBlockCountGivesTheBytesOfItsBlocks) {
    const Image image = random_blocks(19, true);
    const std::size_t row_bytes = image.width * 4;
    const std::vector<std::uint8_t> all = encoded(image);
    for (std::size_t count = 0; count <= 70; ++count) {
        std::vector<std::uint8_t> out((count + 1) * 8, 0xCD);
        encode_bc1_row(image.rgba.data(), row_bytes, count, out.data());
        EXPECT_TRUE(std::equal(out.begin(), out.end() - 8, all.begin())) << count;
        EXPECT_TRUE(std::all_of(out.end() - 8, out.end(), [](std::uint8_t b) { return b == 0xCD; })) << count;
    }
}

TEST(Bc1Encoder, ReadsNoByteBeyondTheBlocks) {
    // The last row ends with the allocation; AddressSanitizer sees what lies beyond.
    for (const std::size_t count : {1U, 4U, 16U, 17U}) {
        const std::size_t row_bytes = count * 16 + 12;
        const std::vector<std::uint8_t> pixels(3 * row_bytes + count * 16, 90);
        std::vector<std::uint8_t> out(count * 8);
        encode_bc1_row(pixels.data(), row_bytes, count, out.data());
        EXPECT_EQ(decoded(out.data())[0][3], 0);
    }
}

TEST(Bc1Kernel, AllInstructionSetsGiveIdenticalBytes) {
    SCREE_TRACE_SEED();
    const auto seed = static_cast<unsigned>(test::seed());
    std::vector<Image> images{random_blocks(seed, false), random_blocks(seed + 1, true), random_blocks(seed + 2, true),
                              flat_areas(seed + 3)};
    for (const Scene& scene : scenes()) {
        images.push_back(scene.paint());
    }
    for (const TextureQuality quality : kQualities) {
        const std::vector<NamedKernel> all = kernels(quality);
        for (const NamedKernel& kernel : all) {
            if (!kernel.runs_here) {
                continue;
            }
            for (std::size_t i = 0; i < images.size(); ++i) {
                EXPECT_EQ(encoded(images[i], kernel.kernel), encoded(images[i], all[0].kernel))
                    << kernel.name << ' ' << i;
            }
        }
    }
}

TEST(Bc1Kernel, TheBestOneIsTheWidestThatRunsHere) {
    for (const TextureQuality quality : kQualities) {
        Bc1Kernel* widest = nullptr;
        for (const NamedKernel& kernel : kernels(quality)) {
            if (kernel.runs_here) {
                widest = kernel.kernel;
            }
        }
        EXPECT_EQ(best_bc1_kernel(quality), widest);
    }
}

TEST(Bc1Kernel, ABlockHasTheSameBytesWhereverItStands) {
    // Flat groups, mixed blocks and the rest of a row each take a way of their own.
    SCREE_TRACE_SEED();
    for (const TextureQuality quality : kQualities) {
        for (const Image& image : {flat_areas(static_cast<unsigned>(test::seed())), random_blocks(23, true)}) {
            for (const NamedKernel& kernel : kernels(quality)) {
                if (!kernel.runs_here) {
                    continue;
                }
                const std::vector<std::uint8_t> all = encoded(image, kernel.kernel);
                const std::size_t across = image.width / 4;
                for (std::size_t i = 0; i < all.size() / 8; i += 3) {
                    std::array<std::uint8_t, 8> alone{};
                    encode_bc1_row_with(kernel.kernel, image.texel(i % across * 4, i / across * 4), image.width * 4, 1,
                                        alone.data());
                    ASSERT_TRUE(std::equal(alone.begin(), alone.end(), &all[i * 8])) << kernel.name << " block " << i;
                }
            }
        }
    }
}

TEST(Bc1HighQuality, GainsOnEveryScene) {
    // In dB; about half of what the search among neighbouring codes contributes would be missing at these figures.
    const std::map<std::string, double> least{{"Noise", 0.027}, {"Gradients", 0.65}, {"GreyGradient", 1.22},
                                              {"Snow", 1.15},   {"Forest", 0.345},   {"Town", 0.88},
                                              {"Sea", 0.35}};
    for (const Scene& scene : scenes()) {
        const Image image = scene.paint();
        const double normal = psnr_db(image, encoded(image));
        const double high = psnr_db(image, encoded(image, best_bc1_kernel(TextureQuality::high)));
        EXPECT_GE(high - normal, least.at(scene.name)) << scene.name;
        RecordProperty(scene.name, std::to_string(high) + " dB, normal " + std::to_string(normal) + " dB");
    }
}

TEST(Bc1HighQuality, IsWhatEncodeBc1RowGivesWhenAsked) {
    const Image image = random_blocks(24, true);
    const std::size_t blocks = image.width / 4;
    std::vector<std::uint8_t> asked(blocks * 8);
    encode_bc1_row(image.rgba.data(), image.width * 4, blocks, asked.data(), TextureQuality::high);
    std::vector<std::uint8_t> wanted = encoded(image, best_bc1_kernel(TextureQuality::high));
    wanted.resize(asked.size());
    EXPECT_EQ(asked, wanted);
    std::vector<std::uint8_t> normal = encoded(image);
    normal.resize(asked.size());
    EXPECT_NE(asked, normal);
}

TEST(Bc1HighQuality, TexelsDecodeTransparentExactlyBelowAlpha128) {
    const Image image = random_blocks(25, true);
    const std::vector<std::uint8_t> blocks = encoded(image, best_bc1_kernel(TextureQuality::high));
    const std::size_t across = image.width / 4;
    for (std::size_t i = 0; i < blocks.size() / 8; ++i) {
        const std::array<Texel, 16> texels = decoded(&blocks[i * 8]);
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t* source = image.texel(i % across * 4 + k % 4, i / across * 4 + k / 4);
            ASSERT_EQ(texels[k][3], source[3] < 128 ? 0 : 255) << "block " << i << " texel " << k;
        }
    }
}

}  // namespace
}  // namespace scree
