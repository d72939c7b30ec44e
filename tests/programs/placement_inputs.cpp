#include "tests/programs/placement_inputs.h"

#include <fmt/format.h>

#include <OpenImageIO/imageio.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "tests/tools/source/test_tiff.h"

namespace scree::test {
namespace {

void require(bool done, const std::string& path) {
    if (!done) throw std::runtime_error("cannot write " + path);
}

std::ofstream open_output(const std::string& path) {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    require(out.good(), path);
    return out;
}

int epsg_of(const std::string& crs) { return std::stoi(crs.substr(crs.find(':') + 1)); }
bool in_degrees(const std::string& crs) { return crs == "EPSG:4326"; }

template <class T>
std::vector<T> samples_of(const SampleGrid& grid, const SampleValue& value) {
    std::vector<T> samples;
    for (int r = 0; r < grid.height; ++r)
        for (int c = 0; c < grid.width; ++c) samples.push_back(static_cast<T>(value(c, r)));
    return samples;
}

// The raster-space point (0, 0) of a GeoTIFF: the first sample of points, the outer corner of areas.
void place_geotiff(TestTiff& t, const SampleGrid& g, bool matrix) {
    const double outward = g.area ? -0.5 : 0;
    const double x = g.x(outward, outward), y = g.y(outward, outward);
    if (matrix) {
        t.matrix = {g.column_x, g.row_x, 0, x, g.column_y, g.row_y, 0, y, 0, 0, 0, 0, 0, 0, 0, 1};
    } else {
        t.scale = {g.column_x, -g.row_y, 0};
        t.tie_points = {0, 0, 0, x, y, 0};
    }
    t.raster_type = g.area ? RasterPixelIsArea : RasterPixelIsPoint;
    if (in_degrees(g.crs)) {
        t.model_type = ModelTypeGeographic;
        t.geographic = epsg_of(g.crs);
    } else {
        t.model_type = ModelTypeProjected;
        t.projected = epsg_of(g.crs);
    }
}

// Names the centre of the first pixel, whatever pixels stand for.
void write_world_file(const std::string& path, const SampleGrid& g) {
    open_output(path) << fmt::format("{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n{:.17g}\n", g.column_x, g.column_y,
                                     g.row_x, g.row_y, g.first_x, g.first_y);
}

void write_float_tiff(const std::string& path, HeightFormat format, const SampleGrid& g, const SampleValue& value) {
    TestTiff t = layout_of<float>(static_cast<std::uint32_t>(g.width), static_cast<std::uint32_t>(g.height));
    t.rows_per_strip = 7;
    if (format == HeightFormat::tiled || format == HeightFormat::matrix_tiled) t.tile = 32;
    if (format != HeightFormat::world_file_tiff)
        place_geotiff(t, g, format == HeightFormat::matrix || format == HeightFormat::matrix_tiled);
    const auto samples = samples_of<float>(g, value);
    require(write_tiff(path, t, samples.data()), path);
}

// The header that .asc and .flt share; their y is that of the southernmost row.
std::string grid_header(const SampleGrid& g, bool corner) {
    const double outward = corner ? 0.5 : 0;
    const char* word = corner ? "corner" : "center";
    std::string text = fmt::format("ncols {}\nnrows {}\nxll{} {:.17g}\nyll{} {:.17g}\n", g.width, g.height, word,
                                   g.first_x - outward * g.column_x, word, g.y(0, g.height - 1) + outward * g.row_y);
    if (g.column_x == -g.row_y) return text + fmt::format("cellsize {:.17g}\n", g.column_x);
    return text + fmt::format("dx {:.17g}\ndy {:.17g}\n", g.column_x, -g.row_y);
}

void write_ascii(const std::string& path, const SampleGrid& g, bool corner, const SampleValue& value) {
    std::ofstream out = open_output(path);
    out << grid_header(g, corner);
    for (int r = 0; r < g.height; ++r) {
        for (int c = 0; c < g.width; ++c) out << fmt::format("{:.9g} ", value(c, r));
        out << '\n';
    }
}

template <class T>
void write_raw(const std::string& path, const SampleGrid& g, bool big_endian, const SampleValue& value) {
    std::ofstream out = open_output(path);
    for (const T sample : samples_of<T>(g, value)) {
        std::array<char, sizeof(T)> bytes{};
        std::memcpy(bytes.data(), &sample, sizeof(T));
        if (big_endian) std::reverse(bytes.begin(), bytes.end());
        out.write(bytes.data(), bytes.size());
    }
}

void write_bil_header(const std::string& path, const SampleGrid& g) {
    open_output(path) << fmt::format(
        "BYTEORDER I\nLAYOUT BIL\nNROWS {}\nNCOLS {}\nNBANDS 1\nNBITS 16\nPIXELTYPE SIGNEDINT\n"
        "ULXMAP {:.17g}\nULYMAP {:.17g}\nXDIM {:.17g}\nYDIM {:.17g}\n",
        g.height, g.width, g.first_x, g.first_y, g.column_x, -g.row_y);
}

std::string hgt_name(const SampleGrid& g) {
    const auto south = static_cast<int>(std::lround(g.y(0, g.height - 1))), west = static_cast<int>(g.first_x);
    return fmt::format("{}{:02}{}{:03}.hgt", south < 0 ? 'S' : 'N', std::abs(south), west < 0 ? 'W' : 'E',
                       std::abs(west));
}

std::string dms(double degrees, char positive, char negative) {
    const auto seconds = static_cast<int>(std::lround(std::abs(degrees) * 3600));
    return fmt::format("{:03}{:02}{:02}{}", seconds / 3600, seconds / 60 % 60, seconds % 60,
                       degrees < 0 ? negative : positive);
}

// MIL-PRF-89020B: columns from the west, each from south to north.
void write_dted(const std::string& path, const SampleGrid& g, const SampleValue& value) {
    std::string file = fmt::format("UHL1{}{}{:04}{:04}0030U  {:12}{:04}{:04}0", dms(g.first_x, 'E', 'W'),
                                   dms(g.y(0, g.height - 1), 'N', 'S'), std::lround(g.column_x * 36000),
                                   std::lround(-g.row_y * 36000), "", g.width, g.height);
    file.resize(80, ' ');
    file += "DSIU";
    file.resize(80 + 648, ' ');
    file += "ACC";
    file.resize(80 + 648 + 2700, ' ');
    const auto put16 = [](std::string& to, int v) {
        to.push_back(static_cast<char>(v >> 8));
        to.push_back(static_cast<char>(v));
    };
    for (int c = 0; c < g.width; ++c) {
        std::string record("\xAA\0", 2);
        put16(record, c);
        put16(record, c);
        put16(record, 0);
        for (int r = g.height - 1; r >= 0; --r) {
            const int z = static_cast<int>(value(c, r));
            put16(record, z < 0 ? 0x8000 | -z : z);
        }
        unsigned sum = 0;
        for (const char b : record) sum += static_cast<unsigned char>(b);
        put16(record, static_cast<int>(sum >> 16));
        put16(record, static_cast<int>(sum & 0xFFFF));
        file += record;
    }
    open_output(path) << file;
}

// USGS, "Standards for Digital Elevation Models", part 2: profiles from the west, each from south to north, in records
// of 1024 characters.
void write_usgs_dem(const std::string& path, const SampleGrid& g, const SampleValue& value) {
    constexpr std::size_t kRecord = 1024;
    constexpr int kMostRows = 146;  // that a profile's first record has room for
    require(g.height <= kMostRows, path);
    std::string file(144, ' ');
    file += fmt::format("{:6}{:6}{:6}{:6}", 1, 1, 1, epsg_of(g.crs) - 32600);
    file.resize(528, ' ');
    file += fmt::format("{:6}{:6}{:6}", 2, 2, 4);
    file.resize(816, ' ');
    file += fmt::format("{:12.6E}{:12.6E}{:12.6E}{:6}{:6}", g.column_x, -g.row_y, 1.0, 1, g.width);
    file.resize(890, ' ');
    file += " 3";
    file.resize(kRecord, ' ');
    for (int c = 0; c < g.width; ++c) {
        file += fmt::format("{:6}{:6}{:6}{:6}{:24.15E}{:24.15E}{:24.15E}{:24.15E}{:24.15E}", 1, c + 1, g.height, 1,
                            g.x(c, 0), g.y(0, g.height - 1), 0.0, 0.0, 0.0);
        for (int r = g.height - 1; r >= 0; --r) file += fmt::format("{:6}", static_cast<int>(value(c, r)));
        file.resize((static_cast<std::size_t>(c) + 2) * kRecord, ' ');
    }
    open_output(path) << file;
}

// Golden Software, "Surfer 6 Grid File Format": limits are those of the outermost samples, rows go from south to north.
void write_surfer(const std::string& path, const SampleGrid& g, const SampleValue& value) {
    std::ofstream out = open_output(path);
    const auto put = [&](auto number) {
        std::array<char, sizeof(number)> bytes{};
        std::memcpy(bytes.data(), &number, sizeof(number));
        out.write(bytes.data(), bytes.size());
    };
    out << "DSBB";
    for (const int side : {g.width, g.height}) put(static_cast<std::int16_t>(side));
    for (const double x : {g.first_x, g.x(g.width - 1, 0)}) put(x);
    for (const double y : {g.y(0, g.height - 1), g.first_y}) put(y);
    for (const double z : {0.0, 1e4}) put(z);
    for (int r = g.height - 1; r >= 0; --r)
        for (int c = 0; c < g.width; ++c) put(static_cast<float>(value(c, r)));
}

void write_pixels(const std::string& path, const SampleGrid& g, int channels, OIIO::TypeDesc type, const void* pixels) {
    const auto out = OIIO::ImageOutput::create(path);
    require(out && out->open(path, OIIO::ImageSpec(g.width, g.height, channels, type)) &&
                out->write_image(type, pixels) && out->close(),
            path);
}

std::vector<std::uint8_t> ramp_pixels(const SampleGrid& g, const SampleValue& level) {
    std::vector<std::uint8_t> pixels;
    for (int r = 0; r < g.height; ++r)
        for (int c = 0; c < g.width; ++c) {
            const auto red = static_cast<std::uint8_t>(std::lround(level(c, r)));
            pixels.insert(pixels.end(), {red, 128, static_cast<std::uint8_t>(255 - red)});
        }
    return pixels;
}

}  // namespace

std::pair<double, double> SampleGrid::sample_of(double px, double py) const {
    const double dx = px - first_x, dy = py - first_y, area_of_cell = column_x * row_y - column_y * row_x;
    return {(dx * row_y - dy * row_x) / area_of_cell, (dy * column_x - dx * column_y) / area_of_cell};
}

SampleGrid SampleGrid::part(int column, int row, int columns, int rows) const {
    SampleGrid p = *this;
    p.first_x = x(column, row);
    p.first_y = y(column, row);
    p.width = columns;
    p.height = rows;
    return p;
}

SampleGrid SampleGrid::turned(double degrees) const {
    const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    SampleGrid t = *this;
    t.column_x = c * column_x - s * column_y;
    t.column_y = s * column_x + c * column_y;
    t.row_x = c * row_x - s * row_y;
    t.row_y = s * row_x + c * row_y;
    return t;
}

SampleGrid north_up(const std::string& crs, double x, double y, double step, int width, int height, double step_y) {
    SampleGrid g;
    g.crs = crs;
    g.first_x = x;
    g.first_y = y;
    g.column_x = step;
    g.row_y = step_y == 0 ? -step : -step_y;
    g.width = width;
    g.height = height;
    return g;
}

std::string write_placed_heights(const std::string& folder, const std::string& name, HeightFormat format,
                                 const SampleGrid& g, const SampleValue& value) {
    const std::string stem = folder + "/" + name;
    switch (format) {
        case HeightFormat::ascii_corner:
        case HeightFormat::ascii_center:
            write_ascii(stem + ".asc", g, format == HeightFormat::ascii_corner, value);
            return stem + ".asc";
        case HeightFormat::float_corner:
        case HeightFormat::float_center:
            open_output(stem + ".hdr") << grid_header(g, format == HeightFormat::float_corner)
                                       << "byteorder LSBFIRST\n";
            write_raw<float>(stem + ".flt", g, false, value);
            return stem + ".flt";
        case HeightFormat::bil:
            write_bil_header(stem + ".hdr", g);
            write_raw<std::int16_t>(stem + ".bil", g, false, value);
            return stem + ".bil";
        case HeightFormat::hgt:
            write_raw<std::int16_t>(folder + "/" + hgt_name(g), g, true, value);
            return folder + "/" + hgt_name(g);
        case HeightFormat::dted:
            write_dted(stem + ".dt0", g, value);
            return stem + ".dt0";
        case HeightFormat::usgs_dem:
            write_usgs_dem(stem + ".dem", g, value);
            return stem + ".dem";
        case HeightFormat::surfer:
            write_surfer(stem + ".grd", g, value);
            return stem + ".grd";
        case HeightFormat::png: {
            const auto samples = samples_of<std::uint16_t>(g, value);
            write_pixels(stem + ".png", g, 1, OIIO::TypeDesc::UINT16, samples.data());
            write_world_file(stem + ".pgw", g);
            return stem + ".png";
        }
        default:
            write_float_tiff(stem + ".tif", format, g, value);
            if (format == HeightFormat::world_file_tiff) write_world_file(stem + ".tfw", g);
            return stem + ".tif";
    }
}

std::vector<PlacedExample> placed_grid_examples() {
    const SampleGrid points = north_up("EPSG:32633", 452345.5, 5298765.25, 30, 75, 67);
    SampleGrid areas = points;
    areas.area = true;
    SampleGrid oblong = areas;
    oblong.row_y = -41;
    SampleGrid oblong_points = points;
    oblong_points.row_y = -41;
    const SampleGrid degrees = north_up("EPSG:4326", 13.7, 47.4, 1.0 / 1200, 61, 67);
    const std::vector<std::string> utm{"--assume-crs", "EPSG:32633"};
    return {{HeightFormat::ascii_corner, areas, utm},
            {HeightFormat::ascii_corner, oblong, utm},
            {HeightFormat::ascii_center, areas, utm},
            {HeightFormat::ascii_center, oblong, utm},
            {HeightFormat::float_corner, areas, utm},
            {HeightFormat::float_center, areas, utm},
            {HeightFormat::bil, areas, utm},
            {HeightFormat::usgs_dem, points, {}},
            {HeightFormat::surfer, points, utm},
            {HeightFormat::surfer, oblong_points, utm},
            {HeightFormat::surfer, degrees, {"--assume-crs", "EPSG:4326"}},
            {HeightFormat::dted, north_up("EPSG:4326", 14, 48, 1.0 / 120, 121, 121), {}},
            {HeightFormat::hgt, north_up("EPSG:4326", -71, -30, 1.0 / 600, 601, 1201, 1.0 / 1200), {}, 27}};
}

std::string write_placed_image(const std::string& folder, const std::string& name, const SampleGrid& g, bool matrix,
                               const SampleValue& level) {
    const std::string path = folder + "/" + name + ".tif";
    TestTiff t;
    t.width = static_cast<std::uint32_t>(g.width);
    t.height = static_cast<std::uint32_t>(g.height);
    t.channels = 3;
    t.rows_per_strip = 11;
    place_geotiff(t, g, matrix);
    const auto pixels = ramp_pixels(g, level);
    require(write_tiff(path, t, pixels.data()), path);
    return path;
}

std::string write_placed_png(const std::string& folder, const std::string& name, const SampleGrid& g,
                             const SampleValue& level) {
    const std::string stem = folder + "/" + name;
    const auto pixels = ramp_pixels(g, level);
    write_pixels(stem + ".png", g, 3, OIIO::TypeDesc::UINT8, pixels.data());
    write_world_file(stem + ".pgw", g);
    return stem + ".png";
}

}  // namespace scree::test
