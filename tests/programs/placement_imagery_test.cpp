// Proof of placement of imagery: colour waves of known slope, written through every path, come back from the store
// where they were, within a hundredth of a pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_support.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

// Levels rise and fall along a wave that is oblique to the raster; blue is red's complement, so
// that whatever rounding or compression prefer, they prefer it in both directions.
constexpr double kOblique = 0.31;

struct Wave {
    SampleGrid grid;
    double along_columns = 1, along_rows = kOblique;
    double rise = 3;  ///< levels a pixel

    // 0..255 and back.
    double phase(double x, double y) const {
        const auto [c, r] = grid.sample_of(x, y);
        return rise * (along_columns * c + along_rows * r) + 17000;
    }
    static double level(double phase) {
        const double at = std::fmod(phase, 510);
        return at <= 255 ? at : 510 - at;
    }
    double slope(double phase) const { return std::fmod(phase, 510) <= 255 ? rise : -rise; }
    /// Pixels to the next crest or trough.
    double to_turn(double phase) const {
        const double at = std::fmod(phase, 255);
        return std::min(at, 255 - at) / rise;
    }
};

struct Texel {
    double red = 0, blue = 0;
    bool opaque = false;
};

// BC1: two colours of 5, 6 and 5 bits and two between them, or one and none.
Texel bc1_texel(const std::uint8_t* block, int x, int y) {
    const int a = block[0] | block[1] << 8, b = block[2] | block[3] << 8, pick = block[4 + y] >> (2 * x) & 3;
    const auto five = [](int v) { return static_cast<double>((v & 31) << 3 | (v & 31) >> 2); };
    if (a <= b && pick == 3) return {};
    const double share = pick == 0 ? 0 : pick == 1 ? 1 : a > b ? (pick == 2 ? 1.0 / 3 : 2.0 / 3) : 0.5;
    const auto between = [&](int shift) { return five(a >> shift) * (1 - share) + five(b >> shift) * share; };
    return {between(11), between(0), true};
}

struct ImageCheck {
    double worst = 0;             ///< levels
    double sum = 0, squares = 0;  ///< of residual times slope, and of the slope
    double red = 0, blue = 0;     ///< sums of residuals
    std::int64_t texels = 0, deepest = 0, bare = 0;
};

// Over the texels where textures end whose neighbourhood is within the image and away from the wave's turns.
ImageCheck compare_texels(const StoreUnderTest& store, const Wave& wave) {
    const Dataset& d = store.dataset();
    const int size = d.texture_size();
    const Move move(d.crs, wave.grid.crs);
    ImageCheck check;
    const auto look = [&](const SqliteStore::RowView& row) {
        const auto id = tile_from_key(store.lattice(), row.key);
        const auto tile = decode_texture_tile(row.payload, d.texture_size_log2, row.codec);
        EXPECT_TRUE(id && tile);
        if (!id || !tile || tile->child_mask != 0) return true;
        const double texel_m = d.texel_m(id->level);
        const std::uint8_t* blocks = tile->blocks.data() + bc1_mip_offset(d.texture_size_log2, 0);
        std::vector<double> x, y;
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < size; ++c) {
                x.push_back(d.lattice.origin_x_m + (static_cast<double>(id->x * size + c) + 0.5) * texel_m);
                y.push_back(d.lattice.origin_y_m - (static_cast<double>(id->y * size + r) + 0.5) * texel_m);
            }
        const std::vector<double> store_x = x, store_y = y;
        move(x, y);
        const double east = d.lattice.x_m(static_cast<double>(d.lattice.cells_x)),
                     south = d.lattice.y_m(static_cast<double>(d.lattice.cells_y));
        const double texel_px = texel_m / ground_step(wave.grid, d.crs), clear = 1.5 + texel_px;
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < size; ++c) {
                const auto k = static_cast<std::size_t>(r * size + c);
                if (store_x[k] > east || store_y[k] < south) continue;
                const auto [u, v] = wave.grid.sample_of(x[k], y[k]);
                if (!(std::min({u, v, wave.grid.width - 1 - u, wave.grid.height - 1 - v}) > clear)) continue;
                const double phase = wave.phase(x[k], y[k]);
                if (wave.to_turn(phase) < 2 * clear) continue;
                const Texel t = bc1_texel(blocks + 8 * (r / 4 * (size / 4) + c / 4), c % 4, r % 4);
                ++check.texels;
                check.deepest += id->level == d.texture_deepest_level;
                check.bare += !t.opaque;
                const double off = (t.red + 255 - t.blue) / 2 - Wave::level(phase);
                check.worst = std::max(check.worst, std::abs(off));
                check.sum += off * wave.slope(phase);
                check.squares += wave.rise * wave.rise;
                check.red += t.red - Wave::level(phase);
                check.blue += t.blue - 255 + Wave::level(phase);
            }
        return true;
    };
    EXPECT_TRUE(store.store().for_each(TileKind::texture, look));
    return check;
}

struct ImageSetup {
    SampleGrid image;
    SampleGrid heights = north_up("EPSG:32633", 452345, 5298765, 30, 97, 97);
    bool matrix = false, png = false;
    std::vector<std::array<int, 4>> parts = {};
    std::vector<std::string> arguments = {};
    double rise = 3;
    int half_pixels = 0;                  ///< of the nearest kernel
    std::vector<SampleGrid> insets = {};  ///< finer images of the same wave
};

void expect_wave_in_place(const ImageSetup& in, const Wave& wave) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.file("in"));
    std::vector<std::string> arguments{write_placed_heights(folder.file("in"), "heights", HeightFormat::striped,
                                                            in.heights, [](int, int) { return 7; })};
    arguments.push_back("--imagery");
    auto parts = in.parts;
    if (parts.empty()) parts.push_back({0, 0, in.image.width, in.image.height});
    for (const auto& [c, r, columns, rows] : parts) {
        const SampleGrid part = in.image.part(c, r, columns, rows);
        const auto level = [&](int i, int j) { return Wave::level(wave.phase(part.x(i, j), part.y(i, j))); };
        const std::string name = "image" + std::to_string(arguments.size());
        arguments.push_back(in.png ? write_placed_png(folder.file("in"), name, part, level)
                                   : write_placed_image(folder.file("in"), name, part, in.matrix, level));
    }
    for (const SampleGrid& inset : in.insets)
        arguments.push_back(
            write_placed_image(folder.file("in"), "inset" + std::to_string(arguments.size()), inset, true,
                               [&](int i, int j) { return Wave::level(wave.phase(inset.x(i, j), inset.y(i, j))); }));
    arguments.insert(arguments.end(), in.arguments.begin(), in.arguments.end());
    build_store_from(arguments, folder.file("s.scree"));
    const StoreUnderTest store(folder.file("s.scree"));
    const ImageCheck check = compare_texels(store, wave);
    const double moved_px = check.sum / check.squares;
    EXPECT_GT(check.texels, 20000);
    EXPECT_EQ(check.bare, 0);
    if (!in.insets.empty()) {
        ASSERT_TRUE(store.dataset().coarsest_texture_level.has_value());
        EXPECT_GT(check.deepest, 3000) << "on the inset's side";
        EXPECT_GT(check.texels - check.deepest, 20000) << "on the other";
    }
    EXPECT_LT(std::abs(moved_px), kBoundSamples);
    // Half a level in the mean; a texel within a step of BC1's five bits besides what both roundings to bytes may take.
    const auto texels = static_cast<double>(check.texels);
    EXPECT_LT(std::abs(check.red) / texels, 0.5);
    EXPECT_LT(std::abs(check.blue) / texels, 0.5);
    EXPECT_LT(check.worst, 1 + 255.0 / 31 + in.half_pixels * wave.rise * (1 + kOblique) / 2) << "levels";
    if (std::getenv("SCREE_PLACEMENT_TELL") != nullptr)
        std::printf("    %lld texels, moved by %.5f pixels, worst %.3f levels, red %.3f blue %.3f\n",
                    static_cast<long long>(check.texels), moved_px, check.worst, check.red / texels,
                    check.blue / texels);
}

void expect_image_in_place(const ImageSetup& in) {
    {
        SCOPED_TRACE("along columns");
        expect_wave_in_place(in, {in.image, 1, kOblique, in.rise});
    }
    {
        SCOPED_TRACE("along rows");
        expect_wave_in_place(in, {in.image, kOblique, 1, in.rise});
    }
}

const SampleGrid kImage = of_areas(north_up("EPSG:32633", 452300, 5298810, 9.3, 330, 330));

TEST(PlacementOfImagery, OfAreasAndPoints) {
    expect_image_in_place(ImageSetup{kImage});
    SampleGrid points = kImage;
    points.area = false;
    expect_image_in_place(ImageSetup{points});
    ImageSetup png{kImage};
    png.png = true;
    png.arguments = {"--assume-crs", "EPSG:32633"};
    expect_image_in_place(png);
}

TEST(PlacementOfImagery, OfTurnedAndSouthUpImages) {
    for (SampleGrid image : {kImage.turned(30), south_up(kImage)}) {
        image.first_x += 400;
        ImageSetup in{image};
        in.matrix = true;
        expect_image_in_place(in);
    }
}

TEST(PlacementOfImagery, OfOtherCrs) {
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:4326", 14.366, 47.843, 1.0 / 9000, 340, 240))});
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:3857", 1599300, 6080800, 13.7, 330, 330))});
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:32632", 900100, 5313500, 9, 400, 400))});
}

TEST(PlacementOfImagery, OfEveryKernelAndAnyScale) {
    for (const char* kernel : {"bilinear", "cubic", "nearest"})
        for (const double pixel : {4.1, 7.4, 29.0}) {
            if (std::string(kernel) == "cubic" && pixel < 20) continue;  // means, as bilinear gives
            SCOPED_TRACE(std::string(kernel) + ", " + std::to_string(pixel));
            ImageSetup in{of_areas(north_up("EPSG:32633", 452300, 5298810, pixel, 300, 300)).turned(-3)};
            in.matrix = true;
            in.arguments = {"--resampling", kernel};
            in.half_pixels = std::string(kernel) == "nearest";
            if (pixel > 20) in.rise = 7;
            expect_image_in_place(in);
        }
}

TEST(PlacementOfImagery, OfMosaicsAtTheirJoints) {
    ImageSetup in{kImage};
    in.parts = quarters(kImage, 0);
    expect_image_in_place(in);
    std::reverse(in.parts.begin(), in.parts.end());
    in.image = kImage.turned(-10);
    in.matrix = true;
    expect_image_in_place(in);
}

TEST(PlacementOfImagery, OfBothSidesOfAStepOfResolution) {
    ImageSetup in{of_areas(north_up("EPSG:32633", 452300, 5298810, 9.3, 330, 330))};
    in.arguments = {"--texture-size", "64"};
    const SampleGrid fine = of_areas(north_up("EPSG:32633", 453417.2, 5297633.1, 1.13, 230, 190));
    for (const SampleGrid& inset : {fine, fine.turned(33)}) {
        in.insets = {inset};
        expect_image_in_place(in);
    }
}

}  // namespace
}  // namespace scree::test
