#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "tools/source/grid_file.h"
#include "tools/source/raw_samples.h"

namespace scree {
namespace {

constexpr std::size_t kHeaderBytes = 56;
constexpr std::int64_t kSampleBytes = 4;
constexpr const char* kBlank = "1.70141e38";

struct Header {
    std::int64_t columns = 0, rows = 0;
    double west = 0, east = 0, south = 0, north = 0;  ///< of the outermost samples
};

// `bytes` holds sizeof(T) of them from `at`.
template <class T>
T little_endian(std::string_view bytes, std::size_t at) {
    static_assert(std::endian::native == std::endian::little);
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

// What follows the extent, the range of the heights, is passed over: nothing depends on it, and writers leave it stale.
Header header_of(std::string_view bytes) {
    Header header;
    header.columns = little_endian<std::int16_t>(bytes, 4);
    header.rows = little_endian<std::int16_t>(bytes, 6);
    header.west = little_endian<double>(bytes, 8);
    header.east = little_endian<double>(bytes, 16);
    header.south = little_endian<double>(bytes, 24);
    header.north = little_endian<double>(bytes, 32);
    return header;
}

Result<Header> read_header(const ByteFile& file) {
    const Result<std::string> bytes = file.head(kHeaderBytes);
    if (!bytes) return bytes.error();
    if (bytes->starts_with("DSAA") || bytes->starts_with("DSRB"))
        return unusable_grid(file.path(), fmt::format("a Surfer grid of the kind {}; only DSBB, the binary grid of "
                                                      "Surfer 6, is read: save it as that",
                                                      bytes->substr(0, 4)));
    if (!bytes->starts_with("DSBB")) return unusable_grid(file.path(), "no Surfer 6 grid: it does not begin with DSBB");
    if (bytes->size() < kHeaderBytes)
        return unusable_grid(file.path(), fmt::format("a Surfer 6 grid of {} bytes, but its header alone takes {}; it "
                                                      "is cut off",
                                                      bytes->size(), kHeaderBytes));
    return header_of(*bytes);
}

// The file ends with the last sample. One that goes on has more columns than its header says (they are counted in 16
// bits), and every row would be sheared.
Result<void> check_sides(const ByteFile& file, const Header& header) {
    if (header.columns < 2 || header.rows < 2)
        return unusable_grid(file.path(),
                             fmt::format("its header says {} x {} samples; less than two a side have no distance, so "
                                         "they cannot be placed",
                                         header.columns, header.rows));
    const std::int64_t needed = static_cast<std::int64_t>(kHeaderBytes) + header.columns * header.rows * kSampleBytes;
    if (needed == file.size()) return {};
    return unusable_grid(file.path(),
                         fmt::format("{} x {} samples need {} bytes, but the file has {}; it is cut off or its header "
                                     "is wrong",
                                     header.columns, header.rows, needed, file.size()));
}

Result<void> check_extent(const std::string& path, const char* axis, double low, double high) {
    if (low < high && std::isfinite(high - low)) return {};
    return unusable_grid(
        path, fmt::format("its header says that {} goes from {} to {}, so it lies nowhere", axis, low, high));
}

// Limits are those of the outermost samples, which are points.
Georeference place_of(const Header& header) {
    Georeference place;
    place.first_x = header.west;
    place.first_y = header.north;
    place.column_x = (header.east - header.west) / static_cast<double>(header.columns - 1);
    place.row_y = -(header.north - header.south) / static_cast<double>(header.rows - 1);
    place.raster_is_point = true;
    return place;
}

// Rows lie from south to north; they are read from the last one on, because a lattice takes over only what is north-up.
RawSamples samples_of(const Header& header) {
    RawSamples samples;
    samples.width = header.columns;
    samples.height = header.rows;
    samples.type = SampleType::f32;
    samples.pixel_bytes = samples.channel_bytes = kSampleBytes;
    const std::int64_t row_bytes = kSampleBytes * header.columns;
    samples.row_bytes = -row_bytes;
    samples.first = static_cast<std::int64_t>(kHeaderBytes) + (header.rows - 1) * row_bytes;
    return samples;
}

}  // namespace

bool looks_like_surfer(std::string_view start) {
    return start.starts_with("DSBB") || start.starts_with("DSAA") || start.starts_with("DSRB");
}

Result<GridFile> open_surfer(ByteFile file) {
    const Result<Header> header = read_header(file);
    if (!header) return header.error();
    if (auto ok = check_sides(file, *header); !ok) return ok.error();
    if (auto ok = check_extent(file.path(), "x", header->west, header->east); !ok) return ok.error();
    if (auto ok = check_extent(file.path(), "y", header->south, header->north); !ok) return ok.error();
    GridFile grid;
    grid.nodata = kBlank;
    grid.georeference = place_of(*header);
    if (auto ok = check_place(*grid.georeference, file.path(), "its header"); !ok) return ok.error();
    Result<std::unique_ptr<PixelDecoder>> decoder = make_raw_decoder(std::move(file), samples_of(*header));
    if (!decoder) return decoder.error();
    grid.decoder = std::move(*decoder);
    return grid;
}

}  // namespace scree
