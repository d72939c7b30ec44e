// Small georeferenced heights and images for the programs to read, each known to the test sample by sample.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace scree::test {

/// Heights, row-major from the north-west; NaN is a void.
struct HeightGrid {
    int width = 0, height = 0;
    std::vector<float> z;
    float& at(int i, int j) {
        return z[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)];
    }
    float at(int i, int j) const { return const_cast<HeightGrid&>(*this).at(i, j); }
};

/// Rough hills of whole metres: no two neighbourhoods alike, steep enough that every level of detail matters.
HeightGrid hills(int width, int height, std::uint64_t seed, double amplitude_m = 400);

/// Where the north-west sample (point) or corner (area) lies, and how far apart samples are.
struct Place {
    double x = 400000, y = 5300000, step = 10;
    int epsg = 32633;
    bool area = false;
};

void write_heights(const std::string& path, const HeightGrid& grid, const Place& place = {},
                   const char* nodata = nullptr);
/// Whole metres as 16-bit integers; no georeference when `place` is null.
void write_heights_u16(const std::string& path, const HeightGrid& grid, const Place* place,
                       const char* nodata = nullptr);
void write_heights_i16(const std::string& path, const HeightGrid& grid, const Place& place,
                       const char* nodata = nullptr);
/// Degrees instead of metres.
void write_geographic_heights(const std::string& path, const HeightGrid& grid);

using Colour = std::function<std::uint32_t(int x, int y, int channel)>;
/// 8 or 16 bits a channel, 1 to 4 channels, PixelIsArea.
void write_image(const std::string& path, int width, int height, int channels, int bits, const Place* place,
                 const Colour& colour);
/// Something colourful.
std::uint32_t patchwork(int x, int y, int channel);

}  // namespace scree::test
