#include "tools/source/geotiff_writer.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <geotiff/geokeys.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

#include <array>
#include <cassert>
#include <charconv>
#include <cstring>

#include "tools/source/tiff_file.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxSide = std::int64_t{1} << 30;
// Offset and length of each stand in memory: 64 MB.
constexpr std::int64_t kMaxBlocks = std::int64_t{1} << 22;
// Of classic TIFF's 4 GiB; deflate may lengthen what it cannot shorten.
constexpr double kMaxClassicBytes = 3.9e9;

struct Format {
    int bytes;
    int sample_format;
};

Format format_of(SampleType type) {
    switch (type) {
        case SampleType::u8:
            return {1, SAMPLEFORMAT_UINT};
        case SampleType::i8:
            return {1, SAMPLEFORMAT_INT};
        case SampleType::u16:
            return {2, SAMPLEFORMAT_UINT};
        case SampleType::i16:
            return {2, SAMPLEFORMAT_INT};
        case SampleType::u32:
            return {4, SAMPLEFORMAT_UINT};
        case SampleType::i32:
            return {4, SAMPLEFORMAT_INT};
        case SampleType::u64:
            return {8, SAMPLEFORMAT_UINT};
        case SampleType::i64:
            return {8, SAMPLEFORMAT_INT};
        case SampleType::f16:
            return {2, SAMPLEFORMAT_IEEEFP};
        case SampleType::f32:
            return {4, SAMPLEFORMAT_IEEEFP};
        case SampleType::f64:
            return {8, SAMPLEFORMAT_IEEEFP};
    }
    return {1, SAMPLEFORMAT_UINT};
}

std::int64_t blocks_along(std::int64_t samples) {
    return (samples + GeotiffWriter::kBlock - 1) / GeotiffWriter::kBlock;
}

// The number of "EPSG:n" where a key of 16 bits holds it; 32767 means user-defined there.
std::optional<int> epsg_code(const std::string& text) {
    constexpr std::string_view kPrefix = "EPSG:";
    if (text.rfind(kPrefix, 0) != 0) return std::nullopt;
    int code = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + kPrefix.size(), end, code);
    if (error != std::errc{} || stop != end || code < 1 || code > 65535 || code == KvUserDefined) return std::nullopt;
    return code;
}

struct KeysDeleter {
    void operator()(GTIF* keys) const { GTIFFree(keys); }
};

void set_text(GTIF* keys, geokey_t key, const std::string& text) {
    if (!text.empty()) GTIFKeySet(keys, key, TYPE_ASCII, 0, text.c_str());
}

void set_crs(GTIF* keys, const Crs& crs) {
    const auto code = epsg_code(crs.text());
    const std::string wkt = code ? std::string() : crs.esri_wkt();
    // ESRI's way of saying a CRS without a code; GDAL looks for it where the model is user-defined.
    const int model = crs.geographic() ? ModelTypeGeographic : wkt.empty() ? ModelTypeProjected : KvUserDefined;
    GTIFKeySet(keys, GTModelTypeGeoKey, TYPE_SHORT, 1, model);
    GTIFKeySet(keys, crs.geographic() ? GeographicTypeGeoKey : ProjectedCSTypeGeoKey, TYPE_SHORT, 1,
               code.value_or(KvUserDefined));
    set_text(keys, GTCitationGeoKey, crs.name());
    if (code) return;
    if (!crs.geographic() && crs.metres_per_unit() == 1)
        GTIFKeySet(keys, ProjLinearUnitsGeoKey, TYPE_SHORT, 1, Linear_Meter);
    if (!wkt.empty())
        set_text(keys, crs.geographic() ? GeogCitationGeoKey : PCSCitationGeoKey, "ESRI PE String = " + wkt);
}

bool set_keys(TIFF* file, const GeotiffLayout& layout) {
    const std::unique_ptr<GTIF, KeysDeleter> keys(GTIFNew(file));
    if (!keys) return false;
    GTIFKeySet(keys.get(), GTRasterTypeGeoKey, TYPE_SHORT, 1, layout.point ? RasterPixelIsPoint : RasterPixelIsArea);
    if (layout.crs) set_crs(keys.get(), *layout.crs);
    if (const auto vertical = epsg_code(layout.vertical)) {
        GTIFKeySet(keys.get(), VerticalCSTypeGeoKey, TYPE_SHORT, 1, *vertical);
        GTIFKeySet(keys.get(), VerticalUnitsGeoKey, TYPE_SHORT, 1, Linear_Meter);
    }
    return GTIFWriteKeys(keys.get()) == 1;
}

void set_nodata(TIFF* file, double nodata) {
    static char name[] = "GDALNoDataValue";
    static const TIFFFieldInfo kInfo[] = {{42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name}};
    TIFFMergeFieldInfo(file, kInfo, 1);
    TIFFSetField(file, 42113, fmt::format("{}", nodata).c_str());
}

void set_samples(TIFF* file, const GeotiffLayout& layout) {
    const Format format = format_of(layout.type);
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(layout.width));
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(layout.height));
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, layout.channels);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, format.bytes * 8);
    TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, format.sample_format);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, layout.channels == 4 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    if (layout.channels == 4) {
        const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
        TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    }
    TIFFSetField(file, TIFFTAG_TILEWIDTH, static_cast<std::uint32_t>(GeotiffWriter::kBlock));
    TIFFSetField(file, TIFFTAG_TILELENGTH, static_cast<std::uint32_t>(GeotiffWriter::kBlock));
    TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(file, TIFFTAG_PREDICTOR,
                 format.sample_format == SAMPLEFORMAT_IEEEFP ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
}

void set_place(TIFF* file, const GeotiffLayout& layout) {
    const std::array<double, 3> scale = {layout.step_x, layout.step_y, 0};
    const std::array<double, 6> tie_point = {0, 0, 0, layout.x, layout.y, 0};
    TIFFSetField(file, TIFFTAG_GEOPIXELSCALE, 3, scale.data());
    TIFFSetField(file, TIFFTAG_GEOTIEPOINTS, 6, tie_point.data());
}

}  // namespace

std::string geotiff_sidecar(const Crs& crs) {
    if (epsg_code(crs.text())) return {};
    const std::string wkt = crs.esri_wkt();
    return (wkt.empty() ? crs.text() : wkt) + "\n";
}

Result<std::unique_ptr<GeotiffWriter>> GeotiffWriter::create(const std::string& path, const GeotiffLayout& layout) {
    assert(layout.channels == 1 || layout.channels == 4);
    if (layout.width < 1 || layout.height < 1 || layout.width > kMaxSide || layout.height > kMaxSide ||
        blocks_along(layout.width) > kMaxBlocks / blocks_along(layout.height))
        return Error{ErrorCode::usage, fmt::format("{} x {} samples are too many for one file: {} blocks of {} x {} at "
                                                   "most; a box or a coarser level makes them fewer",
                                                   layout.width, layout.height, kMaxBlocks, kBlock, kBlock)};
    const double bytes = static_cast<double>(layout.width + kBlock) * static_cast<double>(layout.height + kBlock) *
                         layout.channels * format_of(layout.type).bytes;
    auto file = std::make_unique<TiffFile>(path, bytes > kMaxClassicBytes ? "w8" : "w");
    std::unique_ptr<GeotiffWriter> writer(new GeotiffWriter(path, layout, std::move(file)));
    if (!writer->file_->valid()) return writer->failure();
    TIFF* const tiff = writer->file_->get();
    set_samples(tiff, layout);
    set_place(tiff, layout);
    if (layout.nodata) set_nodata(tiff, *layout.nodata);
    if (!set_keys(tiff, layout) || !writer->file_->messages().empty()) return writer->failure();
    return writer;
}

GeotiffWriter::GeotiffWriter(std::string path, const GeotiffLayout& layout, std::unique_ptr<TiffFile> file)
    : path_(std::move(path)),
      width_(layout.width),
      height_(layout.height),
      pixel_bytes_(static_cast<std::size_t>(layout.channels * format_of(layout.type).bytes)),
      file_(std::move(file)) {}

GeotiffWriter::~GeotiffWriter() = default;

Error GeotiffWriter::failure() const {
    const std::string& why = file_->messages();
    return {ErrorCode::io, fmt::format("{}: cannot be written{}{}", path_, why.empty() ? "" : ": ", why)};
}

std::size_t GeotiffWriter::block_bytes() const { return static_cast<std::size_t>(kBlock * kBlock) * pixel_bytes_; }

Result<void> GeotiffWriter::write_block(std::int64_t column, std::int64_t row, std::span<std::uint8_t> samples) {
    assert(samples.size() == block_bytes());
    assert(column >= 0 && row >= 0 && column * kBlock < width_ && row * kBlock < height_);
    const auto written = TIFFWriteTile(file_->get(), samples.data(), static_cast<std::uint32_t>(column * kBlock),
                                       static_cast<std::uint32_t>(row * kBlock), 0, 0);
    if (written < 0 || !file_->messages().empty()) return failure();
    return {};
}

Result<void> GeotiffWriter::finish() {
    if (!file_->flush_and_close()) return failure();
    return {};
}

}  // namespace scree
