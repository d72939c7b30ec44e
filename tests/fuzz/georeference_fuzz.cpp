// What places a raster: GeoTIFF tags, world files, .prj files, names of .hgt tiles, GDAL's metadata and .aux.xml. The
// first byte of an input says which.
#include <cmath>
#include <filesystem>

#include "tests/fuzz/file_input.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/source/gdal_metadata.h"
#include "tools/source/georeference.h"
#include "tools/source/grid_file.h"
#include "tools/source/pam_file.h"
#include "tools/source/projection_file.h"

namespace scree::fuzz {
namespace {

std::string tiff_bytes(const test::TestTiff& tiff) {
    const std::vector<std::uint8_t> pixels(12, 7);
    const std::string path = folder().path("seed.tif");
    require(test::write_tiff(path, tiff, pixels.data()), "a seed can be written");
    return test::read_bytes(path);
}

std::string placed_tiff(bool own_grid) {
    test::TestTiff tiff;
    tiff.scale = {30, 20, 0};
    tiff.tie_points = {0, 0, 0, 1000, 5000, 0};
    tiff.model_type = ModelTypeProjected;
    tiff.projected = own_grid ? KvUserDefined : 32633;
    tiff.vertical = 5703;
    tiff.citation = "somewhere";
    tiff.gdal_metadata = "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.01</Item></GDALMetadata>";
    if (!own_grid) return tiff_bytes(tiff);
    tiff.geographic = 4230;
    tiff.linear_unit = Linear_Foot;
    tiff.short_keys = {{ProjectionGeoKey, KvUserDefined}, {ProjCoordTransGeoKey, CT_LambertConfConic_2SP}};
    tiff.double_keys = {{ProjFalseOriginLongGeoKey, 9.5},
                        {ProjFalseOriginLatGeoKey, 10},
                        {ProjStdParallel1GeoKey, 10},
                        {ProjStdParallel2GeoKey, 20}};
    return tiff_bytes(tiff);
}

std::string rotated_tiff() {
    test::TestTiff tiff;
    tiff.matrix = {30, 5, 0, 1000, 5, -20, 0, 5000, 0, 0, 0, 0, 0, 0, 0, 1};
    tiff.model_type = ModelTypeGeographic;
    tiff.geographic = KvUserDefined;
    tiff.double_keys = {{GeogSemiMajorAxisGeoKey, 6371000}, {GeogInvFlatteningGeoKey, 300}};
    return tiff_bytes(tiff);
}

void check(const Result<std::optional<Georeference>>& read) {
    if (!read) {
        require(read.error().code == ErrorCode::input, "what cannot be placed is an input error");
    } else if (read->has_value()) {
        const Georeference& place = **read;
        require(std::isfinite(place.x(3, 4)) && std::isfinite(place.y(3, 4)), "a placed raster lies somewhere");
        require(place.height_unit_m >= 0 && std::isfinite(place.height_unit_m), "a unit of height is a length");
    }
}

// A tile whose name is the input's first line; its bytes are never read.
void open_named_tile(std::string_view text) {
    std::string name = std::string(text.substr(0, std::min<std::size_t>(text.find('\n'), 60)));
    std::erase(name, '/');
    std::erase(name, '\0');
    const std::string path = folder().path(name + ".hgt");
    folder().write(name + ".hgt", "x");
    std::filesystem::resize_file(path, 2884802);
    const auto file = open_grid_file(path);
    if (file && file->has_value()) check((*file)->georeference);
    std::filesystem::remove(path);
}

}  // namespace

std::vector<std::string> seeds() {
    return {
        '\0' + placed_tiff(false),
        '\0' + placed_tiff(true),
        '\0' + rotated_tiff(),
        std::string("\1") + "2.5\r\n0\r\n0.0\r\n-2.5e0\r\n+400001.25\r\n5299998.75\r\n",
        std::string("\2") + "Projection    UTM\nZone 10\nDatum         WGS84\nZunits        METERS\nUnits  METERS\n",
        std::string("\2") + "PROJCS[\"x\",GEOGCS[\"y\"]]",
        std::string("\3") + "N37W123",
        std::string("\3") + "NASADEM_HGT_n05_w001_v2",
        std::string("\4") +
            "<GDALMetadata>\n<Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-5</Item>\n"
            "<Item name='U' role='unittype' sample='0'>ft</Item></GDALMetadata>",
        std::string("\5") +
            "<PAMDataset>\n <SRS dataAxisToSRSAxisMapping=\"2,1\">GEOGCS[&quot;WGS 84&quot;,&lt;&amp;]</SRS>\n"
            " <GeoTransform>  1.5e+02, 30, 2,  4.4e+06, 1, -20</GeoTransform>\n"
            " <PAMRasterBand band=\"2\"><NoDataValue>1</NoDataValue></PAMRasterBand>\n"
            " <PAMRasterBand band=\"1\">\n  <NoDataValue le_hex_equiv=\"00\">-9999</NoDataValue>\n </PAMRasterBand>\n"
            "</PAMDataset>"};
}

}  // namespace scree::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace scree;
    using namespace scree::fuzz;
    if (size == 0) return 0;
    const std::string_view content = text_of(data + 1, size - 1);
    switch (data[0] % 6) {
        case 0:
            check(read_georeference(folder().write("t.tif", content)));
            break;
        case 1:
            folder().write("w.pgw", content);
            check(read_world_file(folder().path("w.png")));
            break;
        case 2: {
            folder().write("p.prj", content);
            Georeference place;
            const auto taken = take_projection_file(folder().path("p.png"), place);
            require(taken.ok() || taken.error().code == ErrorCode::input, "what cannot be read is an input error");
            break;
        }
        case 3:
            open_named_tile(content);
            break;
        case 5: {
            const auto pam = parse_pam(content);
            require(pam.ok() || pam.error().code == ErrorCode::input, "what cannot be read is an input error");
            Georeference place;
            if (pam && pam->geotransform && place_by(*pam, "p", place)) check(std::optional(place));
            break;
        }
        default: {
            const GdalBandMetadata band = parse_gdal_metadata(content);
            require(std::isfinite(band.scale) && band.scale != 0 && std::isfinite(band.offset), "scales are numbers");
        }
    }
    return 0;
}
