// Readers of DEM formats. The first byte of an input says which; the rest is the file, or its text header where the
// samples themselves need no parsing.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "tests/fuzz/file_input.h"
#include "tests/fuzz/fuzz_target.h"
#include "tools/source/grid_file.h"
#include "tools/source/raster_formats.h"

namespace scree::fuzz {
namespace {

// A header that stands beside samples is fuzzed instead of them where the name begins with b, and for c.dat.
constexpr std::array kNames = {"a.asc", "a.dt1", "b.bil", "b.bip",       "b.bsq", "b.flt",
                               "b.dem", "c.dem", "c.dat", "N37W123.hgt", "d.grd"};

std::string dted() {
    std::string file =
        fmt::format("UHL1{}{}{:04}{:04}0030U  {:12}{:04}{:04}0", "0015930E", "0101500S", 1800, 1200, "", 5, 6);
    file.resize(80 + 648 + 2700, ' ');
    for (unsigned column = 0; column < 5; ++column) {
        std::string record("\xAA\0\0\0\0\0\0\0", 8);
        record[3] = record[5] = static_cast<char>(column);
        record.resize(20, static_cast<char>(column));
        unsigned sum = 0;
        for (const char c : record) sum += static_cast<unsigned char>(c);
        for (int shift = 24; shift >= 0; shift -= 8) record += static_cast<char>(sum >> shift);
        file += record;
    }
    return file;
}

std::string raw_header(const char* layout) {
    return fmt::format(
        "BYTEORDER M\nLAYOUT {}\nNROWS 3\nNCOLS 4\nNBANDS 3\nNBITS 16\nPIXELTYPE SIGNEDINT\nBANDROWBYTES 8\n"
        "TOTALROWBYTES 24\nBANDGAPBYTES 0\nSKIPBYTES 2\nNODATA -9999\nULXMAP 1\nULYMAP 2\nXDIM 3\nYDIM 4\n",
        layout);
}

// Three profiles of 2, 150 and 1 values, which start at different rows.
std::string usgs_dem(const char* system, const char* step_z, const char* record_end) {
    std::string file(144, ' ');
    file += fmt::format("     1     1{}", system);
    file.resize(528, ' ');
    file += "     2     2     4";
    file.resize(816, ' ');
    file += fmt::format("0.300000E+020.300000E+02{}     1     3", step_z);
    file.resize(888, ' ');
    file += " 2 1";
    const bool padded = *record_end == '\0';
    if (padded) file.resize(1024, ' ');
    file += record_end;
    for (const int values : {2, 150, 1}) {
        static constexpr const char* kStarts[] = {"0.600000000000000D+06", "0.600030000000000D+06",
                                                  "0.600060000000000D+06"};
        const std::size_t number = values == 2 ? 1 : values == 1 ? 3 : 2;
        std::string records =
            fmt::format("{:6}{:6}{:6}{:6}{:>24}{:>24}{:>24}{:>24}{:>24}", 1, number, values, 1, kStarts[number - 1],
                        values == 1 ? "0.400003D+07" : "0.4D+07", "0.0", "0", "1");
        for (int i = 0; i < values; ++i) {
            if (padded && i == 146) records.resize(1024, ' ');
            records += fmt::format("{:6}", i % 7 == 1 ? -32767 : i * 31);
        }
        if (padded) records.resize((records.size() + 1023) / 1024 * 1024, ' ');
        file += records + record_end;
    }
    return file;
}

std::string surfer() {
    std::string file = "DSBB";
    const auto put = [&](auto number) {
        std::array<char, sizeof(number)> bytes{};
        std::memcpy(bytes.data(), &number, sizeof(number));
        file.append(bytes.data(), bytes.size());
    };
    for (const int side : {5, 4}) put(static_cast<std::int16_t>(side));
    for (const double limit : {1000.0, 1040.0, 5000.0, 5060.0, 0.0, 19.0}) put(limit);
    for (int i = 0; i < 20; ++i) put(static_cast<float>(i));
    return file;
}

std::string of_kind(std::size_t name, const std::string& content) { return static_cast<char>(name) + content; }

// The file that an input stands for, with its header where it has one.
std::string lay_out(std::string_view input) {
    const std::string name = kNames[static_cast<unsigned char>(input[0]) % kNames.size()];
    const std::string_view content = input.substr(1);
    const std::string path = folder().path(name);
    const bool headered = name[0] == 'b' || name == "c.dat";
    static const std::string kSamples(997, '\x11');
    folder().write(name, headered ? std::string_view(kSamples) : content);
    const std::filesystem::path header = std::filesystem::path(path).replace_extension(".hdr");
    if (headered)
        folder().write(header.filename().string(), content);
    else
        std::filesystem::remove(header);
    return path;
}

// A format without a seed is not fuzzed: mutations do not find a signature.
void require_a_seed_of_every_format(const std::vector<std::string>& seeds) {
    for (const GridFormat& format : grid_formats()) {
        const bool has_one = std::any_of(seeds.begin(), seeds.end(), [&](const std::string& seed) {
            return grid_format_of(lay_out(seed)) == &format;
        });
        require(has_one, fmt::format("{} has no seed", format.name).c_str());
    }
}

void decode_all(const std::string& path, GridFile& grid) {
    const DecodedLayout& layout = grid.decoder->layout();
    require(layout.width > 0 && layout.height > 0 && layout.channels > 0, "an opened grid has samples");
    const std::size_t row_bytes = static_cast<std::size_t>(layout.width * layout.channels) * memory_bytes(layout.type);
    require(row_bytes <= 64 * std::filesystem::file_size(path), "a row is no larger than the file lets it be");
    std::vector<std::byte> rows(row_bytes * 2);
    for (std::int64_t begin = 0; begin < layout.height; begin += 2) {
        const std::int64_t end = std::min(begin + 2, layout.height);
        if (!grid.decoder->decode(begin, end, rows.data())) return;
    }
    static_cast<void>(grid.decoder->decode(0, 1, rows.data()));
}

}  // namespace

std::vector<std::string> seeds() {
    const std::vector<std::string> all = {
        of_kind(0, "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 5000\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 5 6\n"),
        of_kind(0, "NROWS 2 NCOLS 2 YLLCENTER 1 XLLCENTER 2 DX 1 DY 2\n1.5 -2e3 nan +7"), of_kind(1, dted()),
        of_kind(2, raw_header("BIL")), of_kind(3, raw_header("BIP")), of_kind(4, raw_header("BSQ")),
        of_kind(5, "ncols 4\nnrows 5\nxllcorner 1\nyllcorner 2\ncellsize 3\nNODATA_value -9999\nbyteorder MSBFIRST\n"),
        of_kind(7, usgs_dem("     1    10", "0.100000E+01", "")),
        of_kind(7, usgs_dem("     1    10", "0.100000E+00", "\r\n")),
        of_kind(7, usgs_dem("     2   401", "0.100000E+01", "")),
        of_kind(8,
                "ENVI\nsamples = 4\nlines = 3\ndata type = 1\nmap info = {UTM, 2, 3, 5, 6, 7, 7, 33, North, WGS-84, "
                "units=Meters, rotation=30}\n"),
        of_kind(2, "NROWS 3\nNCOLS 4\nNBITS 16\nDX 2\nDY 3\nXLLCORNER 1\nYLLCENTER 2\n"),
        of_kind(8,
                "ENVI\ndescription = {\n x}\nsamples = 4\nlines = 3\nbands = 2\nheader offset = 1\ndata type = 2\n"
                "interleave = bil\nbyte order = 1\nmap info = {UTM, 1, 1, 5, 6, 7, 8, 33, North, WGS-84}\n"
                "coordinate system string = {GEOGCS[\"x\"]}\ndata ignore value = -1\n"),
        // Of another size than a tile's: georeference_fuzz has whole ones.
        of_kind(9, "x"), of_kind(10, surfer())};
    require_a_seed_of_every_format(all);
    return all;
}

}  // namespace scree::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace scree;
    using namespace scree::fuzz;
    if (size == 0) return 0;
    const std::string path = lay_out(text_of(data, size));
    Result<std::optional<GridFile>> grid = open_grid_file(path);
    if (!grid) {
        require(grid.error().code == ErrorCode::input, "what cannot be read is an input error");
        return 0;
    }
    if (!grid->has_value()) return 0;
    if ((*grid)->georeference) {
        const Georeference& place = *(*grid)->georeference;
        require(std::isfinite(place.first_x) && std::isfinite(place.first_y) &&
                    place.column_x * place.row_y != place.column_y * place.row_x,
                "an opened grid lies somewhere");
    }
    decode_all(path, **grid);
    return 0;
}
