// Writes the small TIFFs the tests of this room read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <tiffio.h>

#include <geotiff/geokeys.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

namespace scree::test {

struct TestTiff {
    std::uint32_t width = 4;
    std::uint32_t height = 3;
    int channels = 1;
    int bits = 8;
    int format = SAMPLEFORMAT_UINT;
    std::uint32_t rows_per_strip = 2;
    std::uint32_t tile = 0;  ///< side; 0 means strips
    int compression = COMPRESSION_NONE;
    const char* mode = "w";
    bool separate_planes = false;     ///< only with strips
    bool sparse = false;              ///< no pixels are written at all
    std::optional<int> extra_sample;  ///< what the last channel is
    std::optional<int> photometric;
    std::vector<std::uint16_t> colormap;  ///< all reds, all greens, all blues
    std::optional<int> orientation;
    std::vector<std::uint8_t> mask;  ///< a byte a pixel and mask channel, written as bits of a directory of its own
    int mask_channels = 1;
    const char* nodata = nullptr;
    // GeoTIFF
    std::vector<double> scale;
    std::vector<double> tie_points;
    std::vector<double> matrix;
    int raster_type = 0;
    int model_type = 0;
    int projected = 0;
    int geographic = 0;
    int vertical = 0;
    int linear_unit = 0;
    const char* citation = nullptr;
    std::vector<double> intergraph_matrix;
    std::vector<std::pair<int, int>> short_keys;
    std::vector<std::pair<int, double>> double_keys;
    std::string gdal_metadata;
};

inline void add_gdal_tags(TIFF* file) {
    static char metadata[] = "GDALMetadata";
    static char nodata[] = "GDALNoDataValue";
    static const TIFFFieldInfo kInfo[] = {{42112, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, metadata},
                                          {42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, nodata}};
    TIFFMergeFieldInfo(file, kInfo, 2);
}

inline bool write_mask(TIFF* file, const TestTiff& t) {
    if (TIFFWriteDirectory(file) != 1) return false;
    TIFFSetField(file, TIFFTAG_SUBFILETYPE, FILETYPE_MASK);
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, t.width);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, t.height);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, t.mask_channels);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 1);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MASK);
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, t.height);
    const std::size_t samples = static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.mask_channels);
    bool written = true;
    for (std::uint32_t row = 0; row < t.height; ++row) {
        std::vector<std::uint8_t> line((samples + 7) / 8);
        for (std::size_t i = 0; i < samples; ++i)
            if (t.mask[row * samples + i] != 0) line[i / 8] = static_cast<std::uint8_t>(line[i / 8] | 0x80u >> i % 8);
        written = written && TIFFWriteScanline(file, line.data(), row, 0) >= 0;
    }
    return written;
}

/// `samples` are row-major, interleaved, in the file's own type; of fewer than 8 bits packed, each row to whole bytes.
inline bool write_tiff(const std::string& path, const TestTiff& t, const void* samples) {
    TIFF* file = XTIFFOpen(path.c_str(), t.mode);
    if (file == nullptr) return false;
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, t.width);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, t.height);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, t.channels);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, t.bits);
    TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, t.format);
    TIFFSetField(file, TIFFTAG_COMPRESSION, t.compression);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, t.separate_planes ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC,
                 t.photometric.value_or(t.channels >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK));
    if (!t.colormap.empty()) {
        const std::size_t entries = t.colormap.size() / 3;
        TIFFSetField(file, TIFFTAG_COLORMAP, t.colormap.data(), t.colormap.data() + entries,
                     t.colormap.data() + 2 * entries);
    }
    if (t.orientation) TIFFSetField(file, TIFFTAG_ORIENTATION, *t.orientation);
    if (t.photometric == PHOTOMETRIC_YCBCR) TIFFSetField(file, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    if (t.extra_sample) {
        const auto kind = static_cast<std::uint16_t>(*t.extra_sample);
        TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &kind);
    }
    if (t.tile > 0) {
        TIFFSetField(file, TIFFTAG_TILEWIDTH, t.tile);
        TIFFSetField(file, TIFFTAG_TILELENGTH, t.tile);
    } else {
        TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, t.rows_per_strip);
    }
    add_gdal_tags(file);
    if (t.nodata != nullptr) TIFFSetField(file, 42113, t.nodata);
    if (!t.gdal_metadata.empty()) TIFFSetField(file, 42112, t.gdal_metadata.c_str());
    if (!t.intergraph_matrix.empty())
        TIFFSetField(file, TIFFTAG_INTERGRAPH_MATRIX, static_cast<int>(t.intergraph_matrix.size()),
                     t.intergraph_matrix.data());
    if (!t.scale.empty()) TIFFSetField(file, TIFFTAG_GEOPIXELSCALE, static_cast<int>(t.scale.size()), t.scale.data());
    if (!t.tie_points.empty())
        TIFFSetField(file, TIFFTAG_GEOTIEPOINTS, static_cast<int>(t.tie_points.size()), t.tie_points.data());
    if (!t.matrix.empty())
        TIFFSetField(file, TIFFTAG_GEOTRANSMATRIX, static_cast<int>(t.matrix.size()), t.matrix.data());
    if (t.model_type != 0) {
        GTIF* keys = GTIFNew(file);
        GTIFKeySet(keys, GTModelTypeGeoKey, TYPE_SHORT, 1, t.model_type);
        if (t.raster_type != 0) GTIFKeySet(keys, GTRasterTypeGeoKey, TYPE_SHORT, 1, t.raster_type);
        if (t.projected != 0) GTIFKeySet(keys, ProjectedCSTypeGeoKey, TYPE_SHORT, 1, t.projected);
        if (t.geographic != 0) GTIFKeySet(keys, GeographicTypeGeoKey, TYPE_SHORT, 1, t.geographic);
        if (t.vertical != 0) GTIFKeySet(keys, VerticalCSTypeGeoKey, TYPE_SHORT, 1, t.vertical);
        if (t.linear_unit != 0) GTIFKeySet(keys, ProjLinearUnitsGeoKey, TYPE_SHORT, 1, t.linear_unit);
        if (t.citation != nullptr) GTIFKeySet(keys, GTCitationGeoKey, TYPE_ASCII, 0, t.citation);
        for (const auto& [key, value] : t.short_keys)
            GTIFKeySet(keys, static_cast<geokey_t>(key), TYPE_SHORT, 1, value);
        for (const auto& [key, value] : t.double_keys)
            GTIFKeySet(keys, static_cast<geokey_t>(key), TYPE_DOUBLE, 1, value);
        GTIFWriteKeys(keys);
        GTIFFree(keys);
    }

    const auto* bytes = static_cast<const std::uint8_t*>(samples);
    const std::size_t pixel_bytes = static_cast<std::size_t>(t.channels) * static_cast<std::size_t>(t.bits) / 8;
    const std::size_t row_bytes =
        (static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.channels * t.bits) + 7) / 8;
    bool written = true;
    if (t.sparse) {
        written = TIFFWriteCheck(file, t.tile > 0 ? 1 : 0, "write_tiff") == 1;  // the arrays of offsets, all zero
    } else if (t.separate_planes) {
        const std::size_t sample_bytes = static_cast<std::size_t>(t.bits) / 8;
        std::vector<std::uint8_t> line(t.width * sample_bytes);
        for (int plane = 0; plane < t.channels; ++plane) {
            for (std::uint32_t row = 0; row < t.height; ++row) {
                for (std::uint32_t x = 0; x < t.width; ++x)
                    std::memcpy(
                        line.data() + x * sample_bytes,
                        bytes + row * row_bytes + x * pixel_bytes + static_cast<std::size_t>(plane) * sample_bytes,
                        sample_bytes);
                written = written && TIFFWriteScanline(file, line.data(), row, static_cast<std::uint16_t>(plane)) >= 0;
            }
        }
    } else if (t.tile > 0) {
        std::vector<std::uint8_t> tile(static_cast<std::size_t>(t.tile) * t.tile * pixel_bytes);
        for (std::uint32_t y = 0; y < t.height; y += t.tile) {
            for (std::uint32_t x = 0; x < t.width; x += t.tile) {
                std::fill(tile.begin(), tile.end(), std::uint8_t{0});
                const std::size_t columns = std::min(t.tile, t.width - x);
                for (std::uint32_t row = y; row < std::min(y + t.tile, t.height); ++row)
                    std::memcpy(tile.data() + (row - y) * t.tile * pixel_bytes,
                                bytes + row * row_bytes + x * pixel_bytes, columns * pixel_bytes);
                written = written && TIFFWriteTile(file, tile.data(), x, y, 0, 0) >= 0;
            }
        }
    } else {
        std::vector<std::uint8_t> line(row_bytes);  // libtiff may swap bytes in place
        for (std::uint32_t row = 0; row < t.height; ++row) {
            std::memcpy(line.data(), bytes + row * row_bytes, row_bytes);
            written = written && TIFFWriteScanline(file, line.data(), row, 0) >= 0;
        }
    }
    if (!t.mask.empty()) written = written && write_mask(file, t);
    XTIFFClose(file);
    return written;
}

template <class T>
TestTiff layout_of(std::uint32_t width, std::uint32_t height) {
    TestTiff t;
    t.width = width;
    t.height = height;
    t.bits = static_cast<int>(sizeof(T)) * 8;
    t.format = std::is_floating_point_v<T> ? SAMPLEFORMAT_IEEEFP
               : std::is_signed_v<T>       ? SAMPLEFORMAT_INT
                                           : SAMPLEFORMAT_UINT;
    return t;
}

}  // namespace scree::test
