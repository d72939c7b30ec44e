// Every TIFF, PNG, JPEG, BMP and PNM of the collection under $SCREE_DATA/zoo against GDAL's reading of it: colours,
// alpha and the first band's values.
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tools/source/image_source.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 23;

std::string quoted(const std::string& text) { return "'" + text + "'"; }

std::optional<std::string> output_of(const std::string& command) {
    std::FILE* pipe = ::popen(("GDAL_PAM_ENABLED=NO timeout 60 " + command + " 2>/dev/null").c_str(), "r");
    if (pipe == nullptr) return std::nullopt;
    std::string text;
    std::array<char, 4096> block{};
    while (const std::size_t got = std::fread(block.data(), 1, block.size(), pipe)) text.append(block.data(), got);
    const int status = ::pclose(pipe);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
    return text;
}

std::string after(const std::string& text, const std::string& key) {
    const std::size_t at = text.find(key);
    if (at == std::string::npos) return "";
    return text.substr(at + key.size(), text.find_first_of(",\n ", at + key.size()) - at - key.size());
}

struct GdalBand {
    std::string type, meaning;
    int bits = 0;  ///< NBITS, where fewer than the type's
};

struct GdalImage {
    std::int64_t width = 0, height = 0;
    std::vector<GdalBand> bands;
    bool premultiplied = false, min_is_white = false;
    int alpha() const {
        for (std::size_t i = 0; i < bands.size(); ++i)
            if (bands[i].meaning == "Alpha") return static_cast<int>(i);
        return -1;
    }
};

std::optional<GdalImage> gdal_facts(const std::string& path) {
    const auto text = output_of("gdalinfo -norat -noct " + quoted(path));
    if (!text) return std::nullopt;
    GdalImage image;
    std::istringstream lines(*text);
    for (std::string line; std::getline(lines, line);) {
        if (line.rfind("Size is ", 0) == 0) {
            char comma = 0;
            std::istringstream(line.substr(8)) >> image.width >> comma >> image.height;
        }
        if (line.rfind("Band ", 0) == 0) image.bands.push_back({after(line, "Type="), after(line, "ColorInterp="), 0});
        if (line.find(" NBITS=") != std::string::npos && !image.bands.empty())
            image.bands.back().bits = std::atoi(after(line, "NBITS=").c_str());
        image.premultiplied |= line.find("ALPHA=PREMULTIPLIED") != std::string::npos;
        image.min_is_white |= line.find("MINISWHITE=YES") != std::string::npos;
    }
    if (image.bands.empty()) return std::nullopt;
    return image;
}

struct Raw {
    std::string bytes;
    std::string type;
    double at(std::size_t i) const {
        if (type == "Byte") return as<std::uint8_t>(i);
        if (type == "UInt16") return as<std::uint16_t>(i);
        if (type == "Int16") return as<std::int16_t>(i);
        if (type == "UInt32") return as<std::uint32_t>(i);
        if (type == "Int32") return as<std::int32_t>(i);
        if (type == "UInt64") return as<std::uint64_t>(i);
        if (type == "Int64") return as<std::int64_t>(i);
        if (type == "Float32") return as<float>(i);
        return as<double>(i);
    }
    static double full(const std::string& type) {
        static const std::map<std::string, double> kFull = {{"Byte", 255},         {"UInt16", 65535},
                                                            {"Int16", 32767},      {"UInt32", 4294967295},
                                                            {"Int32", 2147483647}, {"UInt64", 18446744073709551615.0},
                                                            {"Float32", 1},        {"Int64", 9223372036854775807.0},
                                                            {"Float64", 1}};
        return kFull.at(type);
    }
    template <class T>
    double as(std::size_t i) const {
        T value{};
        std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
        return static_cast<double>(value);
    }
};

// Bands one after another, then the mask of the first; of a palette its red, green, blue and alpha.
std::optional<Raw> gdal_samples(const std::string& path, const GdalImage& image, const test::TempDirectory& directory) {
    const bool palette = image.bands[0].meaning == "Palette";
    std::string command = "gdal_translate -q -of ENVI -co INTERLEAVE=BSQ ";
    if (palette) {
        command += "-expand rgba ";
    } else {
        for (std::size_t band = 1; band <= image.bands.size(); ++band) command += "-b " + std::to_string(band) + " ";
        command += "-b mask ";
    }
    const bool wide = image.bands[0].type.find("64") != std::string::npos;  // ENVI has no 64-bit integers
    if (wide) command += "-ot Float64 ";
    const std::string raw = directory.path("gdal.raw");
    if (!output_of(command + quoted(path) + " " + quoted(raw))) return std::nullopt;
    Raw samples{test::read_bytes(raw), palette ? "Byte" : wide ? "Float64" : image.bands[0].type};
    return samples;
}

double byte_of(double value, double full) {
    return std::isnan(value) ? 0 : std::floor(std::clamp(value, 0.0, full) * 255 / full + 0.5);
}

using Pixel = std::array<double, 4>;

// What read_rgba8 promises for GDAL's samples of a pixel.
Pixel expected_pixel(const GdalImage& image, const Raw& raw, std::size_t pixel) {
    const auto count = static_cast<std::size_t>(image.width * image.height);
    Pixel result{};
    if (image.bands[0].meaning == "Palette") {
        for (std::size_t c = 0; c < 4; ++c) result[c] = raw.at(c * count + pixel);
        return result;
    }
    const bool odd = image.bands[0].bits > 0 && image.bands[0].type.rfind("Float", 0) != 0;
    const double full = odd ? std::exp2(image.bands[0].bits) - 1 : Raw::full(image.bands[0].type);
    std::vector<std::size_t> shown;
    for (std::size_t band = 0; band < image.bands.size(); ++band)
        if (static_cast<int>(band) != image.alpha()) shown.push_back(band);
    if (shown.size() < 3) shown = {shown[0], shown[0], shown[0]};
    const int alpha = image.alpha();
    result[3] = raw.at(image.bands.size() * count + pixel) > 0 ? 255 : 0;
    if (alpha >= 0) result[3] = byte_of(raw.at(static_cast<std::size_t>(alpha) * count + pixel), full);
    for (std::size_t c = 0; c < 3; ++c) {
        double value = raw.at(shown[c] * count + pixel);
        if (std::isnan(value)) result[3] = 0;
        if (image.premultiplied && result[3] > 0)
            value = value * full / raw.at(static_cast<std::size_t>(alpha) * count + pixel);
        result[c] = byte_of(value, full);
        if (image.min_is_white) result[c] = 255 - result[c];
    }
    return result;
}

struct Differences {
    double colour = 0, alpha = 0, value = 0;
};

Differences differences(const GdalImage& image, const Raw& raw, ImageSource& source, std::string& failure) {
    const auto count = static_cast<std::size_t>(image.width * image.height);
    std::vector<std::uint8_t> rgba(count * 4);
    std::vector<double> values(count);
    Differences found;
    if (auto read = source.read_rgba8(0, image.height, rgba); !read) {
        failure = read.error().message;
        return found;
    }
    const bool heights = !source.info().values_are_colours && image.bands[0].meaning != "Palette";
    if (heights) {
        EXPECT_TRUE(source.read_channel(0, image.height, std::span<double>(values)).ok());
    }
    for (std::size_t i = 0; i < count; ++i) {
        const Pixel expected = expected_pixel(image, raw, i);
        found.alpha = std::max(found.alpha, std::abs(expected[3] - rgba[i * 4 + 3]));
        for (std::size_t c = 0; c < 3 && expected[3] > 0; ++c)
            found.colour = std::max(found.colour, std::abs(expected[c] - rgba[i * 4 + c]));
        if (heights && !std::isnan(values[i])) {
            const double value = raw.at(i);
            if (value != values[i]) found.value = std::max(found.value, std::abs(value - values[i]));
        }
    }
    return found;
}

bool is_image(const std::filesystem::path& path) {
    static const std::set<std::string> kKinds = {".tif", ".jpg", ".png", ".bmp", ".pnm"};
    return kKinds.count(path.extension().string()) > 0;
}

struct Known {
    double colour = 0, alpha = 0, value = 0;
};

void expect_as_gdal_reads(const std::string& folder, const std::map<std::string, Known>& differing,
                          const std::set<std::string>& refused) {
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) GTEST_SKIP() << "needs the folder that $SCREE_DATA names";
    if (!output_of("gdalinfo --version")) GTEST_SKIP() << "needs gdalinfo and gdal_translate (gdal-bin)";
    const test::TempDirectory directory;
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(std::string(root) + "/zoo/" + folder))
        if (is_image(entry.path())) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    int compared = 0;
    for (const auto& path : paths) {
        const std::string name = path.filename().string();
        SCOPED_TRACE(name);
        const auto image = gdal_facts(path.string());
        if (!image || image->bands.size() > 16 || image->width * image->height > kMaxPixels) continue;
        const auto source = ImageSource::open(path.string());
        if (!source) {
            EXPECT_TRUE(refused.count(name) > 0) << source.error().message;
            continue;
        }
        const auto raw = gdal_samples(path.string(), *image, directory);
        if (!raw) continue;  // damaged
        ASSERT_EQ((*source)->info().width, image->width);
        ASSERT_EQ((*source)->info().height, image->height);
        std::string failure;
        const Differences found = differences(*image, *raw, **source, failure);
        if (!failure.empty()) {
            EXPECT_TRUE(refused.count(name) > 0) << failure;
            continue;
        }
        EXPECT_EQ(refused.count(name), 0u) << "is read now";
        const auto known = differing.find(name);
        const Known allowed = known == differing.end() ? Known{} : known->second;
        EXPECT_TRUE(found.colour <= allowed.colour && found.alpha <= allowed.alpha && found.value <= allowed.value)
            << name << " differs by " << found.colour << " in colour, " << found.alpha << " in alpha, " << found.value
            << " in its first band's values";
        ++compared;
    }
    EXPECT_GT(compared, 10);
    std::printf("%d of %zu files compared\n", compared, paths.size());
}

TEST(ZooAgainstGdal, PngSuite) {
    // GDAL 3.6 hands out interlaced 16-bit PNGs in the file's byte order; see the next test.
    const Known swapped{255, 255, 65535};
    expect_as_gdal_reads("pngsuite",
                         {{"basi0g16.png", swapped},
                          {"basi2c16.png", swapped},
                          {"basi4a16.png", swapped},
                          {"basi6a16.png", swapped},
                          {"bgai4a16.png", swapped}},
                         {});
}

TEST(PngSuite, InterlacedPicturesEqualTheirTwins) {
    for (const std::string kind : {"0g16", "2c16", "4a16", "6a16", "3p08", "0g01"}) {
        SCREE_DATA_OR_SKIP(plain_path, "zoo/pngsuite/basn" + kind + ".png");
        SCREE_DATA_OR_SKIP(interlaced_path, "zoo/pngsuite/basi" + kind + ".png");
        std::vector<std::vector<std::uint8_t>> pictures;
        for (const std::string& path : {plain_path, interlaced_path}) {
            const auto source = ImageSource::open(path);
            ASSERT_TRUE(source.ok());
            pictures.emplace_back(static_cast<std::size_t>((*source)->info().width * (*source)->info().height * 4));
            ASSERT_TRUE((*source)->read_rgba8(0, (*source)->info().height, pictures.back()).ok());
        }
        EXPECT_EQ(pictures[0], pictures[1]) << kind;
    }
}
TEST(ZooAgainstGdal, ExifOrientationIsIgnored) { expect_as_gdal_reads("exif", {}, {}); }
TEST(ZooAgainstGdal, GdalsOwnTestFiles) {
    const std::map<std::string, Known> differing = {
        {"bug4468.tif", {255, 0, 0}},  // associated alpha: GDAL hands its colours out as they are stored
        // An array of sizes that is one short: GDAL takes the last strip for unwritten, libtiff infers its size.
        {"stripbytecounts_count_not_same_as_stripoffsets_count.tif", {90, 0, 90}},
    };
    const std::set<std::string> refused = {
        // complex numbers
        "cfloat32.tif", "cfloat64.tif", "cint16.tif", "cint32.tif", "cint_sar.tif", "complex_float32.tif",
        "complex_int32.tif",
        // 24-bit floats; 12-bit JPEG; LogLuv; run-length BMP
        "float24.tif", "mandrilmini_12bitjpeg.tif", "uint16_sgilog.tif", "byte_rle8.bmp",
        // tiles without a size, which only GDAL's own convention knows; PackBits that ends early
        "cog_sparse_strile_arrays_zeroified_when_possible.tif", "cog_strile_arrays_zeroified_when_possible.tif",
        "contig_tiled.tif", "separate_tiled.tif",
        // placed by control points alone
        "byte_gcp.tif", "byte_gcp_pixelispoint.tif"};
    expect_as_gdal_reads("gdal_gcore/data", differing, refused);
}

}  // namespace
}  // namespace scree
