#include "tests/programs/sample_inputs.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include "tests/tools/source/test_tiff.h"

namespace scree::test {
namespace {

void place_tiff(TestTiff& t, const Place& place) {
    t.scale = {place.step, place.step, 0};
    t.tie_points = {0, 0, 0, place.x, place.y, 0};
    t.model_type = ModelTypeProjected;
    t.raster_type = place.area ? RasterPixelIsArea : RasterPixelIsPoint;
    t.projected = place.epsg;
}

void write(const std::string& path, const TestTiff& t, const void* samples) {
    if (!write_tiff(path, t, samples)) throw std::runtime_error("cannot write " + path);
}

template <class T>
std::vector<T> cast_samples(const HeightGrid& grid) {
    std::vector<T> samples(grid.z.size());
    for (std::size_t k = 0; k < samples.size(); ++k) samples[k] = static_cast<T>(std::isnan(grid.z[k]) ? 0 : grid.z[k]);
    return samples;
}

template <class T>
TestTiff layout(const HeightGrid& grid, const char* nodata) {
    TestTiff t = layout_of<T>(static_cast<std::uint32_t>(grid.width), static_cast<std::uint32_t>(grid.height));
    t.rows_per_strip = 16;
    t.nodata = nodata;
    return t;
}

}  // namespace

HeightGrid hills(int width, int height, std::uint64_t seed, double amplitude_m) {
    HeightGrid grid{width, height,
                    std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    std::mt19937_64 random(seed);
    const auto phase = [&] { return static_cast<double>(random() % 10000) / 1000; };
    double a[6], b[6], p[6];
    for (int k = 0; k < 6; ++k) {
        const double wave = std::exp2(-k) * 90;
        a[k] = (0.4 + phase() / 10) / wave;
        b[k] = (0.4 + phase() / 10) / wave;
        p[k] = phase();
    }
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            double z = 0;
            for (int k = 0; k < 6; ++k)
                z += std::exp2(-k) * std::sin(6.28 * (a[k] * i + (k % 2 == 0 ? b[k] : -b[k]) * j) + p[k]);
            grid.at(i, j) = static_cast<float>(std::round(1000 + amplitude_m * z + static_cast<double>(random() % 5)));
        }
    return grid;
}

void write_heights(const std::string& path, const HeightGrid& grid, const Place& place, const char* nodata) {
    TestTiff t = layout<float>(grid, nodata);
    place_tiff(t, place);
    write(path, t, grid.z.data());
}

void write_heights_u16(const std::string& path, const HeightGrid& grid, const Place* place, const char* nodata) {
    TestTiff t = layout<std::uint16_t>(grid, nodata);
    if (place != nullptr) place_tiff(t, *place);
    const auto samples = cast_samples<std::uint16_t>(grid);
    write(path, t, samples.data());
}

void write_heights_i16(const std::string& path, const HeightGrid& grid, const Place& place, const char* nodata) {
    TestTiff t = layout<std::int16_t>(grid, nodata);
    place_tiff(t, place);
    const auto samples = cast_samples<std::int16_t>(grid);
    write(path, t, samples.data());
}

void write_geographic_heights(const std::string& path, const HeightGrid& grid) {
    TestTiff t = layout<float>(grid, nullptr);
    t.scale = {0.001, 0.001, 0};
    t.tie_points = {0, 0, 0, 14.5, 47.25, 0};
    t.model_type = ModelTypeGeographic;
    t.raster_type = RasterPixelIsPoint;
    t.geographic = 4326;
    write(path, t, grid.z.data());
}

void write_image(const std::string& path, int width, int height, int channels, int bits, const Place* place,
                 const Colour& colour) {
    TestTiff t;
    t.width = static_cast<std::uint32_t>(width);
    t.height = static_cast<std::uint32_t>(height);
    t.channels = channels;
    t.bits = bits;
    if (channels == 2 || channels == 4) t.extra_sample = EXTRASAMPLE_UNASSALPHA;
    if (place != nullptr) {
        place_tiff(t, *place);
        t.raster_type = RasterPixelIsArea;
    }
    std::vector<std::uint8_t> bytes;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) {
                const std::uint32_t v = colour(x, y, c);
                bytes.push_back(static_cast<std::uint8_t>(v));
                if (bits == 16) bytes.push_back(static_cast<std::uint8_t>(v >> 8));
            }
    write(path, t, bytes.data());
}

std::uint32_t patchwork(int x, int y, int channel) {
    const unsigned patch = static_cast<unsigned>(x / 7 * 31 + y / 5 * 17 + channel * 101) * 2654435761u;
    return (patch >> 24) / 2 + static_cast<unsigned>(x + y + channel * 40) % 100;
}

}  // namespace scree::test
