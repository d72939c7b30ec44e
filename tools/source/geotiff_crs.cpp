#include "tools/source/geotiff_crs.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <geotiff/geo_normalize.h>
#include <geotiff/geokeys.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>

#include <proj.h>

namespace scree {
namespace {

// The longest citation worth keeping: ESRI's hold the WKT of a whole CRS.
constexpr std::size_t kMaxCitationBytes = 16384;
constexpr std::size_t kMaxNameBytes = 200;
constexpr double kFoot_m = 0.3048;
constexpr double kUsSurveyFoot_m = 1200.0 / 3937;

std::optional<std::uint16_t> short_key(GTIF* keys, geokey_t key) {
    unsigned short value = 0;
    if (GTIFKeyGetSHORT(keys, key, &value, 0, 1) != 1) return std::nullopt;
    return value;
}

std::string text_key(GTIF* keys, geokey_t key) {
    int bytes = 0;
    tagtype_t type = TYPE_UNKNOWN;
    const int count = GTIFKeyInfo(keys, key, &bytes, &type);
    if (count <= 0 || type != TYPE_ASCII) return {};
    std::string text(std::min<std::size_t>(static_cast<std::size_t>(count), kMaxCitationBytes) + 1, '\0');
    if (GTIFKeyGetASCII(keys, key, text.data(), static_cast<int>(text.size())) <= 0) return {};
    text.resize(std::min(text.find('\0'), text.size()));
    while (!text.empty() && (text.back() == '|' || std::isspace(static_cast<unsigned char>(text.back()))))
        text.pop_back();
    return text;
}

bool is_code(std::optional<std::uint16_t> value) { return value && *value != KvUndefined && *value != KvUserDefined; }

bool is_length(double metres) { return std::isfinite(metres) && metres > 0; }

// The PROJ context of these keys, which would tell standard error of every code that the registry lacks.
void* quiet_context(GTIF* keys) {
    void* context = GTIFGetPROJContext(keys, 1, nullptr);
    if (context != nullptr) proj_log_level(static_cast<PJ_CONTEXT*>(context), PJ_LOG_NONE);
    return context;
}

double unit_length_m(GTIF* keys, std::uint16_t code) {
    double metres = 1;
    return GTIFGetUOMLengthInfoEx(quiet_context(keys), code, nullptr, &metres) == 1 && is_length(metres) ? metres : 1.0;
}

std::optional<double> registered_unit_m(GTIF* keys, std::optional<std::uint16_t> projected) {
    short registered = 0;
    if (!is_code(projected) ||
        GTIFGetPCSInfoEx(quiet_context(keys), *projected, nullptr, nullptr, &registered, nullptr) != 1 ||
        registered <= 0)
        return std::nullopt;
    return unit_length_m(keys, static_cast<std::uint16_t>(registered));
}

std::optional<double> unit_of_keys_m(GTIF* keys) {
    const auto unit = short_key(keys, ProjLinearUnitsGeoKey);
    if (is_code(unit)) return unit_length_m(keys, *unit);
    double metres = 1;
    if (unit == KvUserDefined && GTIFKeyGetDOUBLE(keys, ProjLinearUnitSizeGeoKey, &metres, 0, 1) == 1 &&
        is_length(metres))
        return metres;
    return std::nullopt;
}

// A name that may stand in WKT's quotes.
std::string quotable(const std::string& text, const char* otherwise) {
    std::string name;
    for (const char c : text.substr(0, kMaxNameBytes))
        if (std::isprint(static_cast<unsigned char>(c)) != 0) name += c == '"' ? '\'' : c;
    return name.empty() ? otherwise : name;
}

// Names that libgeotiff allocates.
template <class Get>
std::string registered_name(Get&& get) {
    char* name = nullptr;
    const int found = get(&name);
    const std::string text = found == 1 && name != nullptr ? name : "";
    GTIFFreeMemory(name);
    return text;
}

std::string authority(int code) {
    return code > 0 && code != KvUserDefined ? fmt::format(",AUTHORITY[\"EPSG\",\"{}\"]", code) : std::string();
}

// The registry has several codes for it.
bool is_degree(const GTIFDefn& defn) { return std::abs(defn.UOMAngleInDegrees - 1) < 1e-9; }

std::optional<std::string> geographic_wkt(GTIF* keys, const GTIFDefn& defn) {
    const double a = defn.SemiMajor;
    const double b = defn.SemiMinor;
    if (!(std::isfinite(a) && a > 0 && std::isfinite(b) && b > 0 && b <= a) || !std::isfinite(defn.PMLongToGreenwich) ||
        !(std::isfinite(defn.UOMAngleInDegrees) && defn.UOMAngleInDegrees > 0))
        return std::nullopt;
    const auto gcs = static_cast<std::uint16_t>(defn.GCS);
    const auto datum = static_cast<std::uint16_t>(defn.Datum);
    const auto ellipsoid = static_cast<std::uint16_t>(defn.Ellipsoid);
    void* context = quiet_context(keys);
    const std::string gcs_name =
        registered_name([&](char** name) { return GTIFGetGCSInfoEx(context, gcs, name, nullptr, nullptr, nullptr); });
    const std::string datum_name =
        registered_name([&](char** name) { return GTIFGetDatumInfoEx(context, datum, name, nullptr); });
    const std::string ellipsoid_name = registered_name(
        [&](char** name) { return GTIFGetEllipsoidInfoEx(context, ellipsoid, name, nullptr, nullptr); });
    std::string shift;
    if (defn.TOWGS84Count == 3 || defn.TOWGS84Count == 7) {
        shift = ",TOWGS84[";
        for (int i = 0; i < 7; ++i)
            shift += fmt::format("{}{}", i > 0 ? "," : "", i < defn.TOWGS84Count ? defn.TOWGS84[i] : 0.0);
        shift += "]";
    }
    // Nine decimals are more than any ellipsoid is defined with, and fewer than the quotient is exact to.
    const double inverse_flattening = a == b ? 0.0 : std::round(a / (a - b) * 1e9) / 1e9;
    constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180;
    return fmt::format("GEOGCS[\"{}\",DATUM[\"{}\",SPHEROID[\"{}\",{},{}]{}{}],PRIMEM[\"{}\",{}],UNIT[\"{}\",{}]{}]",
                       quotable(gcs_name.empty() ? text_key(keys, GeogCitationGeoKey) : gcs_name, "unnamed"),
                       quotable(datum_name, "unknown"), quotable(ellipsoid_name, "unnamed"), a, inverse_flattening,
                       shift, datum_name.empty() ? "" : authority(datum),
                       defn.PMLongToGreenwich == 0 ? "Greenwich" : "other", defn.PMLongToGreenwich,
                       is_degree(defn) ? "degree" : "angle", defn.UOMAngleInDegrees * kRadiansPerDegree,
                       gcs_name.empty() ? "" : authority(gcs));
}

struct Parameter {
    int key;
    const char* name;
};

struct Method {
    int code;
    const char* name;
    std::vector<Parameter> parameters;
};

// GeoTIFF's methods by their names in WKT 1, each parameter under the key that libgeotiff files it.
const std::vector<Method>& methods() {
    const std::vector<Parameter> origin = {{ProjNatOriginLatGeoKey, "latitude_of_origin"},
                                           {ProjNatOriginLongGeoKey, "central_meridian"},
                                           {ProjScaleAtNatOriginGeoKey, "scale_factor"}};
    const std::vector<Parameter> centre = {{ProjCenterLatGeoKey, "latitude_of_center"},
                                           {ProjCenterLongGeoKey, "longitude_of_center"}};
    const std::vector<Parameter> cone = {{ProjStdParallel1GeoKey, "standard_parallel_1"},
                                         {ProjStdParallel2GeoKey, "standard_parallel_2"},
                                         {ProjNatOriginLatGeoKey, "latitude_of_center"},
                                         {ProjNatOriginLongGeoKey, "longitude_of_center"}};
    const std::vector<Parameter> oblique = {{ProjCenterLatGeoKey, "latitude_of_center"},
                                            {ProjCenterLongGeoKey, "longitude_of_center"},
                                            {ProjAzimuthAngleGeoKey, "azimuth"},
                                            {ProjRectifiedGridAngleGeoKey, "rectified_grid_angle"},
                                            {ProjScaleAtCenterGeoKey, "scale_factor"}};
    static const std::vector<Method> kMethods = {
        {CT_TransverseMercator, "Transverse_Mercator", origin},
        {CT_TransvMercator_SouthOriented, "Transverse_Mercator_South_Orientated", origin},
        {CT_LambertConfConic_1SP, "Lambert_Conformal_Conic_1SP", origin},
        {CT_LambertConfConic_2SP,
         "Lambert_Conformal_Conic_2SP",
         {{ProjStdParallel1GeoKey, "standard_parallel_1"},
          {ProjStdParallel2GeoKey, "standard_parallel_2"},
          {ProjFalseOriginLatGeoKey, "latitude_of_origin"},
          {ProjFalseOriginLongGeoKey, "central_meridian"}}},
        {CT_Mercator, "Mercator_1SP", origin},
        {CT_ObliqueStereographic, "Oblique_Stereographic", origin},
        {CT_PolarStereographic,
         "Polar_Stereographic",
         {{ProjNatOriginLatGeoKey, "latitude_of_origin"},
          {ProjStraightVertPoleLongGeoKey, "central_meridian"},
          {ProjScaleAtNatOriginGeoKey, "scale_factor"}}},
        {CT_Stereographic,
         "Stereographic",
         {{ProjCenterLatGeoKey, "latitude_of_origin"},
          {ProjCenterLongGeoKey, "central_meridian"},
          {ProjScaleAtNatOriginGeoKey, "scale_factor"}}},
        {CT_AlbersEqualArea, "Albers_Conic_Equal_Area", cone},
        {CT_EquidistantConic, "Equidistant_Conic", cone},
        {CT_LambertAzimEqualArea, "Lambert_Azimuthal_Equal_Area", centre},
        {CT_AzimuthalEquidistant, "Azimuthal_Equidistant", centre},
        {CT_ObliqueMercator, "Hotine_Oblique_Mercator", oblique},
        {CT_HotineObliqueMercatorAzimuthCenter, "Hotine_Oblique_Mercator_Azimuth_Center", oblique},
        {CT_CassiniSoldner,
         "Cassini_Soldner",
         {{ProjNatOriginLatGeoKey, "latitude_of_origin"}, {ProjNatOriginLongGeoKey, "central_meridian"}}},
        {CT_Polyconic,
         "Polyconic",
         {{ProjNatOriginLatGeoKey, "latitude_of_origin"}, {ProjNatOriginLongGeoKey, "central_meridian"}}},
        {CT_NewZealandMapGrid,
         "New_Zealand_Map_Grid",
         {{ProjCenterLatGeoKey, "latitude_of_origin"}, {ProjCenterLongGeoKey, "central_meridian"}}},
        {CT_Equirectangular,
         "Equirectangular",
         {{ProjCenterLatGeoKey, "latitude_of_origin"},
          {ProjCenterLongGeoKey, "central_meridian"},
          {ProjStdParallel1GeoKey, "standard_parallel_1"}}},
        {CT_Sinusoidal, "Sinusoidal", {{ProjCenterLongGeoKey, "longitude_of_center"}}},
        {CT_CylindricalEqualArea,
         "Cylindrical_Equal_Area",
         {{ProjStdParallel1GeoKey, "standard_parallel_1"}, {ProjNatOriginLongGeoKey, "central_meridian"}}}};
    return kMethods;
}

std::optional<double> parameter(const GTIFDefn& defn, int key) {
    const int count = std::clamp(defn.nParms, 0, MAX_GTIF_PROJPARMS);
    for (int i = 0; i < count; ++i)
        if (defn.ProjParmId[i] == key) return defn.ProjParm[i];
    return std::nullopt;
}

// PROJECTION and PARAMETERs; nullopt for a method that is not known here or lacks a parameter.
std::optional<std::string> projection_wkt(const GTIFDefn& defn, double unit_m) {
    const auto method =
        std::find_if(methods().begin(), methods().end(), [&](const Method& m) { return m.code == defn.CTProjection; });
    if (method == methods().end()) return std::nullopt;
    std::vector<Parameter> parameters = method->parameters;
    std::string name = method->name;
    if (const auto parallel = parameter(defn, ProjStdParallel1GeoKey);
        method->code == CT_Mercator && parallel && *parallel != 0) {
        name = "Mercator_2SP";
        parameters = {{ProjStdParallel1GeoKey, "standard_parallel_1"}, {ProjNatOriginLongGeoKey, "central_meridian"}};
    }
    std::string wkt = fmt::format("PROJECTION[\"{}\"]", name);
    for (const Parameter& p : parameters) {
        const auto value = parameter(defn, p.key);
        if (!value || !std::isfinite(*value)) return std::nullopt;
        wkt += fmt::format(",PARAMETER[\"{}\",{}]", p.name, *value);
    }
    for (const Parameter& p :
         {Parameter{ProjFalseEastingGeoKey, "false_easting"}, Parameter{ProjFalseNorthingGeoKey, "false_northing"}}) {
        const double metres = parameter(defn, p.key).value_or(0);
        if (!std::isfinite(metres)) return std::nullopt;
        wkt += fmt::format(",PARAMETER[\"{}\",{}]", p.name, metres / unit_m);
    }
    return wkt;
}

struct DefnDeleter {
    void operator()(GTIFDefn* defn) const { GTIFFreeDefn(defn); }
};

std::string assembled_wkt(GTIF* keys, bool geographic, double unit_m, const std::string& name) {
    const std::unique_ptr<GTIFDefn, DefnDeleter> defn(GTIFAllocDefn());
    if (!defn || GTIFGetDefn(keys, defn.get()) != 1) return {};
    const auto base = geographic_wkt(keys, *defn);
    if (!base) return {};
    if (geographic) return *base;
    // Keys of angles are in the file's unit, those of the registry in degrees: one is told from the other only here.
    if (!is_degree(*defn)) return {};
    const auto projection = projection_wkt(*defn, unit_m);
    if (!projection) return {};
    return fmt::format("PROJCS[\"{}\",{},{},UNIT[\"{}\",{}]]", quotable(name, "unnamed"), *base, *projection,
                       unit_m == 1 ? "metre" : "unit", unit_m);
}

// "ESRI PE String = PROJCS[...]|" within a citation.
std::string cited_wkt(GTIF* keys) {
    for (const geokey_t key : {GTCitationGeoKey, PCSCitationGeoKey, GeogCitationGeoKey}) {
        const std::string citation = text_key(keys, key);
        const std::size_t mark = citation.find("ESRI PE String");
        if (mark == std::string::npos) continue;
        const std::size_t start = std::min(citation.find("PROJCS[", mark), citation.find("GEOGCS[", mark));
        if (start == std::string::npos) continue;
        return citation.substr(start, citation.rfind(']') + 1 - start);
    }
    return {};
}

void read_vertical(GTIF* keys, GeotiffCrs& said) {
    constexpr std::uint16_t kNavd88Datum = 5103;
    constexpr std::uint16_t kNavd88Height = 5703;
    const auto crs = short_key(keys, VerticalCSTypeGeoKey);
    const auto datum = short_key(keys, VerticalDatumGeoKey);
    // GeoTIFF 1.0 gave NAVD 88 its datum's code where 1.1 wants that of the CRS.
    if (is_code(crs))
        said.vertical = fmt::format("EPSG:{}", *crs == kNavd88Datum ? kNavd88Height : *crs);
    else if (is_code(datum))
        said.vertical = fmt::format("EPSG:{}", *datum);
    const auto unit = short_key(keys, VerticalUnitsGeoKey);
    if (is_code(unit)) {
        double metres = 0;
        if (GTIFGetUOMLengthInfoEx(quiet_context(keys), *unit, nullptr, &metres) == 1 && is_length(metres))
            said.height_unit_m = metres;
    } else if (crs == 6360) {  // NAVD88 height (ftUS)
        said.height_unit_m = kUsSurveyFoot_m;
    } else if (crs == 8228) {  // NAVD88 height (ft)
        said.height_unit_m = kFoot_m;
    }
}

}  // namespace

GeotiffCrs read_geotiff_crs(GTIF* keys) {
    GeotiffCrs said;
    said.raster_is_point = short_key(keys, GTRasterTypeGeoKey) == RasterPixelIsPoint;
    const auto model = short_key(keys, GTModelTypeGeoKey);
    const auto projected = short_key(keys, ProjectedCSTypeGeoKey);
    const auto geographic = short_key(keys, GeographicTypeGeoKey);
    said.geographic = model ? *model == ModelTypeGeographic : (!projected && geographic);
    said.said = model || projected || geographic;
    said.name = text_key(keys, said.geographic ? GeogCitationGeoKey : PCSCitationGeoKey);
    if (said.name.empty()) said.name = text_key(keys, GTCitationGeoKey);
    read_vertical(keys, said);
    if (!said.said) return said;

    const auto code = said.geographic ? geographic : projected;
    const auto registered_m = said.geographic ? std::nullopt : registered_unit_m(keys, projected);
    const auto own_m = said.geographic ? std::nullopt : unit_of_keys_m(keys);
    said.linear_unit_m = own_m.value_or(registered_m.value_or(1));
    const bool overridden = own_m && registered_m && std::abs(*own_m / *registered_m - 1) > 1e-9;
    if (is_code(code) && !overridden) {
        said.crs = fmt::format("EPSG:{}", *code);
        return said;
    }
    if (!is_code(code)) said.crs = cited_wkt(keys);
    if (said.crs.empty()) said.crs = assembled_wkt(keys, said.geographic, said.linear_unit_m, said.name);
    return said;
}

}  // namespace scree
