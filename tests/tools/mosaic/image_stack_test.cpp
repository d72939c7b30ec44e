// Whatever is asked for in whatever order, a point gets what the files and the grid make of it. The reference decodes
// everything, lays the files over one another in memory and resamples the whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/common/test_support.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/mosaic/layer_pixels.h"
#include "tools/mosaic/stack.h"

namespace scree {
namespace {

using Pixels = std::vector<std::uint32_t>;

struct Picture {
    int width = 100, height = 80;
    int channels = 3;  ///< 4: with alpha
    double first_x = 0, first_y = 0, column_x = 10, column_y = 0, row_x = 0, row_y = -10;
    int epsg = 32633;
    std::uint32_t tile = 0, rows_per_strip = 3;
};

// Rough, so that a sample more or less in a mean is seen; with holes and half-transparent places where there is alpha.
void write_picture(const std::string& path, const Picture& p, test::Random& random) {
    test::TestTiff t;
    t.width = static_cast<std::uint32_t>(p.width);
    t.height = static_cast<std::uint32_t>(p.height);
    t.channels = p.channels;
    t.rows_per_strip = p.rows_per_strip;
    t.tile = p.tile;
    if (p.channels == 4) t.extra_sample = EXTRASAMPLE_UNASSALPHA;
    t.matrix = {p.column_x, p.row_x, 0, p.first_x, p.column_y, p.row_y, 0, p.first_y, 0, 0, 0, 0, 0, 0, 0, 1};
    t.model_type = ModelTypeProjected;
    t.raster_type = RasterPixelIsArea;
    t.projected = p.epsg;
    std::vector<std::uint8_t> bytes;
    const int patch = test::uniform(random, 5, 30);
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x) {
            for (int c = 0; c < 3; ++c) bytes.push_back(static_cast<std::uint8_t>(test::uniform(random, 0, 255)));
            if (p.channels < 4) continue;
            const int kind = (x / patch * 7 + y / patch * 3) % 5;
            bytes.push_back(static_cast<std::uint8_t>(kind == 0 ? 0 : kind == 1 ? test::uniform(random, 0, 255) : 255));
        }
    ASSERT_TRUE(test::write_tiff(path, t, bytes.data()));
}

PlacedFile placed(const std::string& path) {
    auto image = ImageSource::open(path);
    EXPECT_TRUE(image.ok()) << path;
    auto crs = Crs::parse((*image)->georeference()->crs);
    EXPECT_TRUE(crs.ok());
    return {path, (*image)->info(), *(*image)->georeference(), std::move(*crs)};
}

struct Scene {
    std::vector<PlacedFile> files;
    std::vector<Layer> layers;
    TargetGrid grid;
    Crs crs = *Crs::parse("EPSG:32633");
    StackOptions options;

    std::unique_ptr<ImageStack> open() const {
        auto stack = ImageStack::open(files, layers, grid, crs, options);
        EXPECT_TRUE(stack.ok());
        return std::move(*stack);
    }
    std::unique_ptr<ImageStack> read() const {
        auto stack = ImageStack::read(files, layers, grid, crs, options, {});
        EXPECT_TRUE(stack.ok());
        return std::move(*stack);
    }
};

struct Area {
    std::int64_t i = 0, j = 0, columns = 0, rows = 0;
    std::size_t count() const { return static_cast<std::size_t>(columns * rows); }
};

Pixels joined(const Scene& scene, const Layer& layer) {
    Pixels all(static_cast<std::size_t>(layer.columns * layer.rows));
    for (const LayerMember& member : layer.members) {
        const PlacedFile& file = scene.files[member.file];
        auto image = ImageSource::open(file.path);
        Pixels pixels(static_cast<std::size_t>(file.info.width * file.info.height));
        EXPECT_TRUE(
            (*image)
                ->read_rgba8(0, file.info.height, {reinterpret_cast<std::uint8_t*>(pixels.data()), pixels.size() * 4})
                .ok());
        for (std::int64_t r = 0; r < file.info.height; ++r)
            for (std::int64_t c = 0; c < file.info.width; ++c) {
                const std::uint32_t fresh = pixels[static_cast<std::size_t>(r * file.info.width + c)];
                auto& held = all[static_cast<std::size_t>((member.row + r) * layer.columns + member.column + c)];
                if (fresh >> 24 >= 128 || fresh >> 24 > held >> 24) held = fresh;
            }
    }
    return all;
}

// Chunk by chunk of the map, because a chunk has one footprint.
Pixels reference(const Scene& scene, const Area& area) {
    Pixels out(area.count());
    constexpr std::int64_t kChunk = WarpMap::kChunk;
    const auto chunk_begin = [](std::int64_t i) {
        return static_cast<std::int64_t>(std::floor(static_cast<double>(i) / kChunk)) * kChunk;
    };
    for (auto layer = scene.layers.rbegin(); layer != scene.layers.rend(); ++layer) {
        const Pixels pixels = joined(scene, *layer);
        auto map = WarpMap::make(scene.grid, scene.crs, layer->where, layer->crs);
        EXPECT_TRUE(map.ok());
        const Kernel kernel = on_grid(*layer, scene.grid, scene.crs) ? Kernel::nearest : scene.options.kernel;
        for (std::int64_t cj = chunk_begin(area.j); cj < area.j + area.rows; cj += kChunk)
            for (std::int64_t ci = chunk_begin(area.i); ci < area.i + area.columns; ci += kChunk) {
                std::vector<double> column(kChunk * kChunk), row(kChunk * kChunk);
                map->map(ci, cj, kChunk, kChunk, {column, row});
                Pixels fresh(kChunk * kChunk);
                resample_colours({0, 0, layer->columns, layer->rows, pixels}, {column, row},
                                 {kernel, map->shrink_at(ci + kChunk / 2, cj + kChunk / 2), layer->half_sample_rim,
                                  layer->columns, layer->rows},
                                 fresh);
                for (std::int64_t k = 0; k < kChunk * kChunk; ++k) {
                    const std::int64_t i = ci + k % kChunk - area.i, j = cj + k / kChunk - area.j;
                    if (i < 0 || j < 0 || i >= area.columns || j >= area.rows) continue;
                    std::uint32_t& held = out[static_cast<std::size_t>(j * area.columns + i)];
                    const std::uint32_t v = fresh[static_cast<std::size_t>(k)];
                    if (held == 0 && v >> 24 >= 128) held = v | 0xFF000000U;
                }
            }
    }
    return out;
}

class ImageStacks : public ::testing::Test {
protected:
    std::string write(const Picture& picture) {
        const std::string path = folder_.file("p" + std::to_string(count_++) + ".tif");
        write_picture(path, picture, random_);
        return path;
    }
    // Overlapping pieces of one grid.
    void add_layer(Scene& scene, Picture base, int pieces) {
        const int width = base.width, height = base.height;
        const Picture origin = base;
        for (int k = 0; k < pieces; ++k) {
            const int c = k == 0 ? 0 : test::uniform(random_, -width / 2, width),
                      r = k == 0 ? 0 : test::uniform(random_, -height / 2, height);
            base.first_x = origin.first_x + c * origin.column_x + r * origin.row_x;
            base.first_y = origin.first_y + c * origin.column_y + r * origin.row_y;
            base.channels = test::uniform(random_, 3, 4);
            base.tile =
                test::uniform(random_, 0, 1) == 0 ? 0 : 16u * static_cast<unsigned>(test::uniform(random_, 1, 5));
            base.rows_per_strip = static_cast<unsigned>(test::uniform(random_, 1, 100));
            scene.files.push_back(placed(write(base)));
        }
    }
    void finish(Scene& scene, Kernel kernel) {
        scene.options.kernel = kernel;
        scene.options.temporary = folder_.file("t");
        auto layers = group_layers(scene.files);
        ASSERT_TRUE(layers.ok());
        scene.layers = std::move(*layers);
    }
    int said_opaque_ = 0;
    Pixels sample(const ImageStack& stack, const Area& area) {
        Pixels out(area.count(), 0xDEADBEEF);
        const auto opaque = stack.sample(area.i, area.j, area.columns, area.rows, out.data(), area.columns);
        EXPECT_TRUE(opaque.ok());
        if (opaque && *opaque) {
            ++said_opaque_;
            EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](std::uint32_t v) { return v >> 24 == 255; }));
        }
        return out;
    }
    static Pixels part_of(const Pixels& all, const Area& whole, const Area& part) {
        Pixels out;
        for (std::int64_t r = 0; r < part.rows; ++r)
            for (std::int64_t c = 0; c < part.columns; ++c)
                out.push_back(
                    all[static_cast<std::size_t>((part.j - whole.j + r) * whole.columns + part.i - whole.i + c)]);
        return out;
    }
    Area random_part(const Area& whole, int most) {
        Area part;
        part.columns = test::uniform(random_, 1, static_cast<int>(std::min<std::int64_t>(whole.columns, most)));
        part.rows = test::uniform(random_, 1, static_cast<int>(std::min<std::int64_t>(whole.rows, most)));
        part.i = whole.i + test::uniform(random_, 0, static_cast<int>(whole.columns - part.columns));
        part.j = whole.j + test::uniform(random_, 0, static_cast<int>(whole.rows - part.rows));
        return part;
    }
    // Every way of asking.
    void check(const Scene& scene, const Area& whole, const char* what) {
        SCOPED_TRACE(what);
        const Pixels expected = reference(scene, whole);
        ASSERT_TRUE(std::any_of(expected.begin(), expected.end(), [](std::uint32_t v) { return v != 0; }));
        ASSERT_EQ(sample(*scene.read(), whole), expected) << "all at once";
        const auto here_and_there = scene.open();
        for (int k = 0; k < 12; ++k) {
            const Area area = random_part(whole, 150);
            ASSERT_TRUE(here_and_there->prepare(area.i, area.j, area.columns, area.rows, {}).ok());
            for (int n = 0; n < 3; ++n) {
                const Area part = random_part(area, 150);
                ASSERT_EQ(sample(*here_and_there, part), part_of(expected, whole, part)) << part.i << ", " << part.j;
            }
        }
        const auto by_bands = scene.open();
        for (std::int64_t j = whole.j; j < whole.j + whole.rows;) {
            const std::int64_t rows = std::min<std::int64_t>(test::uniform(random_, 1, 90), whole.j + whole.rows - j);
            const std::int64_t ahead =
                std::min<std::int64_t>(rows + test::uniform(random_, 0, 40), whole.j + whole.rows - j);
            by_bands->release_north_of(j);
            ASSERT_TRUE(by_bands->prepare(whole.i, j, whole.columns, ahead, {}).ok());
            by_bands->release_north_of(j);
            const Area band{whole.i, j, whole.columns, rows};
            ASSERT_EQ(sample(*by_bands, band), part_of(expected, whole, band)) << "band at " << j;
            j += rows;
        }
        // Halves, as districts are built: the second one goes back to the north.
        const auto by_districts = scene.open();
        for (std::int64_t j = whole.j; j < whole.j + whole.rows; j += 100) {
            const std::int64_t rows = std::min<std::int64_t>(100, whole.j + whole.rows - j), half = whole.columns / 2;
            by_districts->release_north_of(j);
            for (const std::int64_t i : {std::int64_t{0}, half})
                for (std::int64_t r = 0; r < rows; r += 37) {
                    const Area part{whole.i + i, j + r, i == 0 ? half : whole.columns - half,
                                    std::min<std::int64_t>(37, rows - r)};
                    ASSERT_TRUE(by_districts->prepare(part.i, part.j, part.columns, part.rows, {}).ok());
                    ASSERT_EQ(sample(*by_districts, part), part_of(expected, whole, part)) << part.i << ", " << part.j;
                }
        }
    }

    test::TemporaryFolder folder_;
    test::Random random_{test::seed()};
    int count_ = 0;
};

constexpr Area kWhole{-20, -30, 300, 260};

TEST_F(ImageStacks, GiveTheSameWhateverIsAskedForWhen) {
    SCREE_TRACE_SEED();
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (const double step : {10.0, 7.3, 13.0, 45.0}) {
            // Points on the base's samples, or anywhere.
            const double offset = step == 10 ? 0 : 3.21;
            for (const bool warped : {false, true}) {
                Scene scene;
                scene.grid = {500000 + offset, 5300000 - offset, step};
                Picture base;
                base.width = static_cast<int>(130 * step / 10);
                base.height = static_cast<int>(100 * step / 10);
                base.first_x = 499995;
                base.first_y = 5300005;
                add_layer(scene, base, 4);
                Picture top = base;
                top.first_x += 300;
                top.first_y -= 400;
                if (warped) {
                    const double turn = test::uniform(random_, 0, 1) == 0 ? 0.6 : 3.0;
                    top.column_x = 9 * std::cos(turn);
                    top.column_y = 9 * std::sin(turn);
                    top.row_x = 9 * std::sin(turn);
                    top.row_y = -9 * std::cos(turn);
                } else {
                    top.row_y = test::uniform(random_, 0, 1) == 0 ? -11 : 11;
                }
                add_layer(scene, top, 2);
                ASSERT_NO_FATAL_FAILURE(finish(scene, kernel));
                ASSERT_EQ(scene.layers.size(), 2u);
                // None, a few blocks, enough.
                constexpr std::array<std::int64_t, 3> kMemory{0, 30 * SpooledPixels::kBlockBytes, 1 << 27};
                scene.options.spool_memory_bytes = kMemory[static_cast<std::size_t>(test::uniform(random_, 0, 2))];
                ASSERT_NO_FATAL_FAILURE(check(scene, kWhole, warped ? "turned" : "aligned"));
            }
        }
    }
}

TEST_F(ImageStacks, GiveTheSameAcrossCoordinateSystems) {
    SCREE_TRACE_SEED();
    for (const double step : {6.0, 25.0}) {
        Scene scene;
        scene.grid = {500000.5, 5300000.25, step};
        Picture base;
        base.width = base.height = static_cast<int>(20 * step);
        // The same place from zone 32, where north leans.
        auto move = CrsTransform::make(scene.crs, *Crs::parse("EPSG:32632"));
        ASSERT_TRUE(move.ok());
        std::vector<double> x{500000 + 300.0}, y{5300000 + 200.0};
        move->apply(x, y);
        base.first_x = x[0];
        base.first_y = y[0];
        base.epsg = 32632;
        add_layer(scene, base, 3);
        ASSERT_NO_FATAL_FAILURE(finish(scene, Kernel::bilinear));
        ASSERT_NO_FATAL_FAILURE(check(scene, kWhole, "another zone"));
    }
}

// --- what they hold ---

TEST_F(ImageStacks, NorthUpFilesTakeNoDiskAndOthersGiveItBack) {
    SCREE_TRACE_SEED();
    for (const bool turned : {false, true}) {
        Scene scene;
        scene.grid = {500000, 5300000, 5};
        Picture base;
        base.width = 300;
        base.height = 1000;
        base.first_x = 499990;
        base.first_y = 5300010;
        if (turned) {
            base.column_y = 0.1;
            base.row_x = 0.1;
        }
        add_layer(scene, base, 1);
        ASSERT_NO_FATAL_FAILURE(finish(scene, Kernel::bilinear));
        const std::int64_t planned = ImageStack::temporary_bytes(scene.files, scene.layers, scene.grid, scene.crs);
        const std::int64_t file = std::int64_t{5} * 16 * 64 * 64 * 4;
        EXPECT_EQ(planned, turned ? file : 0);
        EXPECT_EQ(image_stack_bytes(scene.files), file);
        scene.options.spool_memory_bytes = 20 * SpooledPixels::kBlockBytes;
        const auto stack = scene.open();
        std::int64_t most = 0;
        for (std::int64_t j = 0; j < 2000; j += 64) {
            stack->release_north_of(j);
            ASSERT_TRUE(stack->prepare(0, j, 600, 64, {}).ok());
            most = std::max(most, stack->temporary_bytes_taken());
        }
        EXPECT_EQ(most > 0, turned);
        EXPECT_LE(most, file / 4);
    }
}

TEST_F(ImageStacks, MoreFilesSideBySideThanMayBeOpenGoThroughTheDisk) {
    SCREE_TRACE_SEED();
    Scene scene;
    scene.grid = {500000, 5300000, 10};
    Picture tile;
    tile.width = 20;
    tile.height = 90;
    tile.first_y = 5300000;
    for (int k = 0; k < 12; ++k) {
        tile.first_x = 500000 + 200 * k;
        scene.files.push_back(placed(write(tile)));
    }
    ASSERT_NO_FATAL_FAILURE(finish(scene, Kernel::bilinear));
    ASSERT_EQ(scene.layers.size(), 1u);
    EXPECT_GT(ImageStack::temporary_bytes(scene.files, scene.layers, scene.grid, scene.crs), 0);
    ASSERT_NO_FATAL_FAILURE(check(scene, {-5, -5, 260, 110}, "twelve abreast"));
}

TEST(OpenImagesTest, KeepTheFilesThatWereUsedLast) {
    const test::TemporaryFolder folder;
    test::Random random(test::seed());
    std::vector<PlacedFile> files;
    for (int k = 0; k < 11; ++k) {
        const std::string path = folder.file(std::to_string(k) + ".tif");
        write_picture(path, {}, random);
        files.push_back(placed(path));
    }
    OpenImages images(files, {});
    for (std::size_t k = 0; k < files.size(); ++k) {
        ASSERT_TRUE(images.open(k).ok());
        ASSERT_TRUE(images.open(0).ok());
    }
    for (std::size_t k = 0; k < files.size(); ++k) EXPECT_EQ(images.is_open(k), k == 0 || k >= 4) << k;
    images.close(0);
    EXPECT_FALSE(images.is_open(0));
    Picture other;
    other.width = 99;
    write_picture(files[0].path, other, random);
    const auto changed = images.open(0);
    ASSERT_FALSE(changed.ok());
    EXPECT_EQ(changed.error().code, ErrorCode::input);
}

// Where it is only guessed which points read a row, what was wanted stays until its points are released.
TEST_F(ImageStacks, AWrongGuessLosesNothingThatIsPrepared) {
    SCREE_TRACE_SEED();
    Picture picture;
    picture.height = 300;
    const std::vector<PlacedFile> files{placed(write(picture))};
    OpenImages images(files, {});
    auto spool = TemporaryFile::create(folder_.file("t"));
    ASSERT_TRUE(spool.ok());
    SpoolMemory memory;
    SpooledPixels pixels(files[0], 0, **spool, 0, memory);
    const SampleRectangle north{0, 0, 100, 128};
    pixels.want(north, 50);
    ASSERT_TRUE(pixels.fetch(images, {}).ok());
    const LastReading long_ago = [](const SampleRectangle&) { return std::int64_t{-1000}; };
    Pixels before(100 * 128), after(100 * 128);
    ASSERT_TRUE(pixels.read(north, before.data(), 100).ok());
    pixels.release(49, long_ago, images);
    ASSERT_TRUE(pixels.read(north, after.data(), 100).ok());
    EXPECT_EQ(before, after);
    pixels.release(50, long_ago, images);
    EXPECT_FALSE(pixels.read(north, after.data(), 100).ok());
    EXPECT_EQ((*spool)->bytes_taken(), 0);
    EXPECT_FALSE(images.is_open(0)) << "nothing is left to decode";
    // What is wanted after all is decoded again.
    pixels.want(north, 60);
    ASSERT_TRUE(pixels.fetch(images, {}).ok());
    ASSERT_TRUE(pixels.read(north, after.data(), 100).ok());
    EXPECT_EQ(before, after);
}

TEST_F(ImageStacks, AReadingThatIsStoppedGoesOn) {
    Scene scene;
    scene.grid = {500000, 5300000, 10};
    Picture base;
    base.height = 300;
    base.first_x = 500000;
    base.first_y = 5300000;
    add_layer(scene, base, 1);
    ASSERT_NO_FATAL_FAILURE(finish(scene, Kernel::bilinear));
    const auto stack = scene.open();
    std::int64_t samples = 0;
    int calls = 0;
    const auto progress = [&](std::int64_t n) {
        samples += n;
        return ++calls != 3;
    };
    const auto stopped = stack->prepare(0, 0, 100, 300, progress);
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
    ASSERT_TRUE(stack->prepare(0, 0, 100, 300, progress).ok());
    EXPECT_EQ(samples, 100 * 300) << "nothing is decoded twice";
    EXPECT_EQ(sample(*stack, {0, 0, 100, 300}), reference(scene, {0, 0, 100, 300}));
}

TEST_F(ImageStacks, AFileWithoutAlphaSaysThatItIsOpaque) {
    Picture p;
    EXPECT_TRUE(placed(write(p)).info.opaque);
    p.channels = 4;
    EXPECT_FALSE(placed(write(p)).info.opaque);
    p.channels = 3;
    OpenOptions options;
    options.colours.nodata = 0;
    auto image = ImageSource::open(write(p), options);
    ASSERT_TRUE(image.ok());
    EXPECT_FALSE((*image)->info().opaque);
}

}  // namespace
}  // namespace scree
