#include "tools/source/raster_formats.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <utility>

#include "tools/source/tiff_file.h"

namespace scree {
namespace {

namespace fs = std::filesystem;

std::string extension_of(const std::string& path) { return lower_case(fs::path(path).extension().string()); }

bool holds(const Extensions& extensions, std::string_view extension) {
    return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

bool begins_as_jpeg2000(std::string_view start) {
    return start.starts_with("\xFF\x4F\xFF\x51") || start.starts_with(std::string_view("\0\0\0\x0CjP  \r\n\x87\n", 12));
}

bool begins_as_pnm(std::string_view start) {
    return start.size() >= 3 && start[0] == 'P' &&
           std::string_view("123456Ff").find(start[1]) != std::string_view::npos &&
           std::isspace(static_cast<unsigned char>(start[2])) != 0;
}

bool begins_as_radiance(std::string_view start) {
    return start.starts_with("#?RADIANCE") || start.starts_with("#?RGBE");
}

// Erdas keeps its rasters in files that are called like raw ones, and TIFFs are called anything.
bool begins_as_tiff_or_erdas(std::string_view start) {
    return start.starts_with("II*") || start.starts_with("MM") || start.starts_with("II+") ||
           start.starts_with("EHFA_HEADER_TAG");
}

// Four bytes or more that no raw grid of heights begins with by chance. Shorter ones (JPEG, BMP, PNM) may well be
// heights: there the name counts.
bool begins_as_image_for_certain(std::string_view start) {
    const auto begins = [&](std::string_view signature) { return start.starts_with(signature); };
    using namespace std::string_view_literals;
    return begins("II*\0"sv) || begins("MM\0*"sv) || begins("II+\0"sv) || begins("MM\0+"sv) ||
           begins("\x89PNG\r\n\x1a\n") || begins("\0\0\0\x0CjP  "sv) ||
           (begins("RIFF") && start.size() >= 12 && start.substr(8, 4) == "WEBP");
}

bool is_called_so(const GridFormat& format, const std::string& path, std::string_view start) {
    const std::string extension = extension_of(path);
    if (holds(format.extensions, extension)) return true;
    return holds(format.headered_extensions, extension) && !begins_as_tiff_or_erdas(start) &&
           header_beside(path).has_value();
}

// Empty for a file that cannot be read.
std::string start_of(const std::string& path) {
    const Result<ByteFile> file = ByteFile::open(path);
    if (!file) return {};
    Result<std::string> start = file->head(kSniffBytes);
    return start ? std::move(*start) : std::string();
}

bool is_grid_in_folder(const GridFormat& format, const std::string& path) {
    const std::string extension = extension_of(path);
    if (holds(format.extensions, extension)) return true;
    if (holds(format.shared_extensions, extension)) return format.begins_so(start_of(path));
    return holds(format.headered_extensions, extension) && header_beside(path).has_value();
}

template <class Formats>
std::string names_of(const Formats& formats) {
    std::string names;
    for (const auto& format : formats) {
        if (!names.empty()) names += ", ";
        names += format.name;
    }
    return names;
}

}  // namespace

std::span<const GridFormat> grid_formats() {
    static const std::array kFormats = {
        GridFormat{.name = "Surfer 6 grid",
                   .shared_extensions = {".grd"},
                   .begins_so = looks_like_surfer,
                   .open = open_surfer},
        GridFormat{
            .name = "DTED", .extensions = {".dt0", ".dt1", ".dt2"}, .begins_so = looks_like_dted, .open = open_dted},
        GridFormat{.name = "SRTM .hgt", .extensions = {".hgt"}, .open = open_hgt},
        GridFormat{.name = "ESRI ASCII grid",
                   .extensions = {".asc"},
                   .begins_so = looks_like_ascii_grid,
                   .open = open_ascii_grid},
        GridFormat{.name = "BIL, BIP, BSQ, GridFloat, ENVI",
                   .extensions = {".bil", ".bip", ".bsq", ".flt"},
                   .headered_extensions = {".dem", ".img", ".raw", ".dat", ".bin", ""},
                   .open = open_raw_grid},
        GridFormat{
            .name = "USGS DEM", .extensions = {".dem"}, .begins_so = looks_like_usgs_dem, .open = open_usgs_dem}};
    return kFormats;
}

const GridFormat* grid_format_of(const std::string& path, std::string_view start) {
    // How it begins counts before what it is called.
    for (const GridFormat& format : grid_formats())
        if (format.begins_so != nullptr && format.begins_so(start)) return &format;
    if (begins_as_image_for_certain(start)) return nullptr;
    for (const GridFormat& format : grid_formats())
        if (is_called_so(format, path, start)) return &format;
    return nullptr;
}

const GridFormat* grid_format_of(const std::string& path) {
    const std::string start = start_of(path);
    return start.empty() ? nullptr : grid_format_of(path, start);
}

std::span<const ImageFormat> image_formats() {
    using View = std::string_view;
    static const std::array kFormats = {
        ImageFormat{ImageKind::tiff, "TIFF", "tiff", {".tif", ".tiff", ".btf"}, begins_as_tiff},
        ImageFormat{ImageKind::png, "PNG", "png", {".png"}, [](View s) { return s.starts_with("\x89PNG\r\n\x1a\n"); }},
        ImageFormat{
            ImageKind::jpeg, "JPEG", "jpeg", {".jpg", ".jpeg"}, [](View s) { return s.starts_with("\xFF\xD8\xFF"); }},
        ImageFormat{ImageKind::jpeg2000, "JPEG 2000", "jpeg2000", {".jp2", ".j2k", ".jpc"}, begins_as_jpeg2000},
        ImageFormat{ImageKind::openexr,
                    "OpenEXR",
                    "openexr",
                    {".exr"},
                    [](View s) { return s.starts_with("\x76\x2f\x31\x01"); }},
        ImageFormat{ImageKind::bmp, "BMP", "bmp", {".bmp"}, [](View s) { return s.starts_with("BM"); }},
        ImageFormat{ImageKind::pnm, "PNM", "pnm", {".pnm", ".pgm", ".ppm"}, begins_as_pnm},
        ImageFormat{ImageKind::webp,
                    "WebP",
                    "webp",
                    {".webp"},
                    [](View s) { return s.starts_with("RIFF") && s.size() >= 12 && s.substr(8, 4) == "WEBP"; }},
        ImageFormat{ImageKind::targa, "Targa", "targa", {".tga"}, nullptr},
        // In folders .hdr is the header of a raw grid.
        ImageFormat{ImageKind::hdr, "Radiance HDR", "hdr", {}, begins_as_radiance}};
    return kFormats;
}

const ImageFormat* image_format_of(const std::string& path, std::string_view start) {
    for (const ImageFormat& format : image_formats())
        if (format.begins_so != nullptr && format.begins_so(start)) return &format;
    const std::string extension = extension_of(path);
    for (const ImageFormat& format : image_formats())
        if (format.begins_so == nullptr && holds(format.extensions, extension)) return &format;
    return nullptr;
}

const ImageFormat& image_format(ImageKind kind) {
    const std::span<const ImageFormat> formats = image_formats();
    return *std::find_if(formats.begin(), formats.end(), [&](const ImageFormat& f) { return f.kind == kind; });
}

bool is_raster_in_folder(const std::string& path) {
    const std::string extension = extension_of(path);
    for (const ImageFormat& format : image_formats())
        if (holds(format.extensions, extension)) return true;
    for (const GridFormat& format : grid_formats())
        if (is_grid_in_folder(format, path)) return true;
    return false;
}

std::optional<std::string> header_beside(const std::string& path) {
    for (const char* extension : {".hdr", ".HDR", ".Hdr"}) {
        std::error_code ignored;
        const std::string replaced = fs::path(path).replace_extension(extension).string();
        if (replaced != path && fs::is_regular_file(replaced, ignored)) return replaced;
        if (fs::is_regular_file(path + extension, ignored)) return path + extension;
    }
    return std::nullopt;
}

std::string image_format_names() { return names_of(image_formats()); }
std::string grid_format_names() { return names_of(grid_formats()); }

}  // namespace scree
