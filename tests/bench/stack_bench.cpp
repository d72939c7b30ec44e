// Nanoseconds a texel that an image stack takes besides decoding, and for decoding, by kind of layer; one thread.
// usage: scree_stack_bench [WORD | FILE...]: layers, all or those whose names hold the word; or decoding of files.
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "tests/common/test_support.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/mosaic/stack.h"
#include "tools/source/isolated_decoder.h"

namespace scree {
namespace {

constexpr int kSide = 4096;
constexpr std::int64_t kBandRows = 64;

double seconds(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Layout {
    const char* name;
    int channels;
    double step, turn_deg;
    int epsg;
    Kernel kernel;
};

void write_picture(const std::string& path, const Layout& layout) {
    test::TestTiff t;
    t.width = t.height = kSide;
    t.channels = layout.channels;
    t.rows_per_strip = 4;
    if (t.channels == 4) t.extra_sample = EXTRASAMPLE_UNASSALPHA;
    const double c = std::cos(layout.turn_deg * M_PI / 180), s = std::sin(layout.turn_deg * M_PI / 180);
    // About the middle of the grid; in zone 32 that lies further east.
    double x = 500000, y = 5300000;
    auto from = Crs::parse("EPSG:32633"), to = Crs::parse("EPSG:" + std::to_string(layout.epsg));
    auto move = CrsTransform::make(*from, *to);
    std::vector<double> xs{x}, ys{y};
    move->apply(xs, ys);
    const double half = kSide / 2;
    t.matrix = {c, s, 0, xs[0] - half * c - half * s, s, -c, 0, ys[0] - half * s + half * c, 0, 0, 0, 0, 0, 0, 0, 1};
    t.model_type = ModelTypeProjected;
    t.raster_type = RasterPixelIsArea;
    t.projected = layout.epsg;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(kSide) * kSide * static_cast<std::size_t>(t.channels));
    std::uint64_t random = 1;
    for (std::size_t k = 0; k < bytes.size(); ++k) {
        random = random * 6364136223846793005U + 1442695040888963407U;
        bytes[k] = t.channels == 4 && k % 4 == 3 ? 255 : static_cast<std::uint8_t>(random >> 56);
    }
    test::write_tiff(path, t, bytes.data());
}

std::vector<PlacedFile> placed(const std::string& path) {
    auto image = ImageSource::open(path);
    std::vector<PlacedFile> files;
    if (image)
        files.push_back(
            {path, (*image)->info(), *(*image)->georeference(), *Crs::parse((*image)->georeference()->crs)});
    return files;
}

void measure(const Layout& layout, const test::TemporaryFolder& folder) {
    const std::string path = folder.file("image.tif");
    write_picture(path, layout);
    const auto files = placed(path);
    const auto layers = group_layers(files);
    StackOptions options;
    options.kernel = layout.kernel;
    options.temporary = folder.file("t");
    // Points that lie well within the image.
    const std::int64_t points = static_cast<std::int64_t>(kSide * 0.6 / layout.step) / 64 * 64;
    const double off = layout.step == 1 ? 0.5 : 0.37;
    const double half = std::floor(static_cast<double>(points) / 2) * layout.step;
    const TargetGrid grid{500000 - half + off, 5300000 + half - off, layout.step};
    auto stack = ImageStack::open(files, *layers, grid, *Crs::parse("EPSG:32633"), options);
    if (!stack) return;
    std::vector<std::uint32_t> out(static_cast<std::size_t>(points * kBandRows));
    double preparing = 0, sampling = 0, best = 1e9;
    std::int64_t holes = 0;
    const double decoders = decoder_usage().cpu_seconds;
    for (std::int64_t j = 0; j + kBandRows <= points; j += kBandRows) {
        (*stack)->release_north_of(j);
        double at = seconds(CLOCK_PROCESS_CPUTIME_ID);
        if (!(*stack)->prepare(0, j, points, kBandRows, {})) return;
        preparing += seconds(CLOCK_PROCESS_CPUTIME_ID) - at;
        for (int again = 0; again < 2; ++again) {
            at = seconds(CLOCK_PROCESS_CPUTIME_ID);
            if (!(*stack)->sample(0, j, points, kBandRows, out.data(), points)) return;
            const double took = seconds(CLOCK_PROCESS_CPUTIME_ID) - at;
            if (again == 0) sampling += took;
            best = std::min(best, took);
        }
        for (const std::uint32_t v : out) holes += v == 0;
    }
    const double texels = static_cast<double>(points * points), band = static_cast<double>(points * kBandRows);
    fmt::print("{:34} prepare {:6.2f} + decoder {:5.2f}, sample {:6.2f} (best band {:6.2f}) ns/texel; {} holes\n",
               layout.name, preparing / texels * 1e9, (decoder_usage().cpu_seconds - decoders) / texels * 1e9,
               sampling / texels * 1e9, best / band * 1e9, holes);
}

void decode(const std::string& path) {
    auto image = ImageSource::open(path);
    if (!image) return fmt::print("{}\n", image.error().message);
    const ImageInfo info = (*image)->info();
    const double own = seconds(CLOCK_PROCESS_CPUTIME_ID), decoders = decoder_usage().cpu_seconds;
    const double wall = seconds(CLOCK_MONOTONIC);
    std::vector<std::uint8_t> out(static_cast<std::size_t>(info.width * 16 * 4));
    unsigned sum = 0;
    for (std::int64_t row = 0; row < info.height; row += 16) {
        const std::int64_t end = std::min(row + 16, info.height);
        if (auto ok =
                (*image)->read_rgba8(row, end, {out.data(), static_cast<std::size_t>((end - row) * info.width * 4)});
            !ok)
            return fmt::print("{}\n", ok.error().message);
        sum += out[static_cast<std::size_t>(row % 1000)];
    }
    fmt::print("{}: {} x {}: own {:.3f} + decoder {:.3f} CPU s, {:.3f} s ({})\n", path, info.width, info.height,
               seconds(CLOCK_PROCESS_CPUTIME_ID) - own, decoder_usage().cpu_seconds - decoders,
               seconds(CLOCK_MONOTONIC) - wall, sum);
}

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    using namespace scree;
    const std::string word = argc > 1 ? argv[1] : "";
    if (word.find('.') != std::string::npos) {
        for (int k = 1; k < argc; ++k) decode(argv[k]);
        return 0;
    }
    const test::TemporaryFolder folder;
    for (const Layout& layout : {Layout{"on the grid, RGB", 3, 1, 0, 32633, Kernel::bilinear},
                                 Layout{"on the grid, RGBA", 4, 1, 0, 32633, Kernel::bilinear},
                                 Layout{"bilinear, RGB", 3, 0.8, 0, 32633, Kernel::bilinear},
                                 Layout{"bilinear, RGBA", 4, 0.8, 0, 32633, Kernel::bilinear},
                                 Layout{"cubic, RGB", 3, 0.8, 0, 32633, Kernel::cubic},
                                 Layout{"mean of 1.3, RGB", 3, 1.3, 0, 32633, Kernel::bilinear},
                                 Layout{"mean of 3.1, RGB", 3, 3.1, 0, 32633, Kernel::bilinear},
                                 Layout{"turned by 3 degrees, bilinear", 3, 0.8, 3, 32633, Kernel::bilinear},
                                 Layout{"turned by 30 degrees, bilinear", 3, 0.8, 30, 32633, Kernel::bilinear},
                                 Layout{"another zone, bilinear", 3, 0.8, 0, 32632, Kernel::bilinear},
                                 Layout{"another zone, cubic", 3, 0.8, 0, 32632, Kernel::cubic},
                                 Layout{"another zone, mean of 1.3", 3, 1.3, 0, 32632, Kernel::bilinear}})
        if (std::string(layout.name).find(word) != std::string::npos) measure(layout, folder);
    return 0;
}
