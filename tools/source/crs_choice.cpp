// The CRS of a build: point scale over a box, and what keeps it near 1.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/crs.h"
#include "tools/source/proj_handles.h"

namespace scree {
namespace {

using proj::Context;
using proj::Object;

constexpr double kGoodScale = 1.001;
/// Along each side of a box. Scale is smooth: between 33 points the least and greatest of a box 30 degrees wide are
/// missed by some 1e-5.
constexpr int kScaleSteps = 32;

/// What is stretched more is beside a point without an image (the pole of a Mercator): PROJ stops short of infinity.
constexpr double kGreatestScale = 1000;
/// Latitudes between which the last resort is measured: at the poles no cylinder has a scale.
constexpr double kCylinderLatitude = 89;

constexpr double kRadians = std::numbers::pi / 180;

Error refuse_box(const LonLatBox& box, const std::string& why) {
    return {ErrorCode::input,
            fmt::format("longitudes {} to {}, latitudes {} to {}: {}", box.west, box.east, box.south, box.north, why)};
}

/// The box with west in +-180 and east at most a turn further.
Result<LonLatBox> unrolled(const LonLatBox& box) {
    const bool finite = std::isfinite(box.west) && std::isfinite(box.east);
    if (!finite || !(box.south >= -90) || !(box.north <= 90) || !(box.south <= box.north)) {
        return refuse_box(box, "no part of the Earth");
    }
    double width = box.east - box.west;
    if (width < 0) width += 360 * std::ceil(-width / 360);
    LonLatBox out = box;
    out.west = std::remainder(box.west, 360.0);
    out.east = out.west + std::min(width, 360.0);
    return out;
}

double wrapped(double longitude) { return std::remainder(longitude, 360.0); }

/// From longitude and latitude in radians on the CRS's ellipsoid to metres, in one step without a change of axes, units
/// or meridian: what proj_factors wants. It can make this itself, at each call anew and 20 ms each.
Object metric_projection(PJ_CONTEXT* context, const PJ* crs) {
    const Object ellipsoid(proj_get_ellipsoid(context, crs));
    const Object conversion(proj_crs_get_coordoperation(context, crs));
    double axis_m = 0, inverse_flattening = 0;
    if (!ellipsoid || !conversion ||
        proj_ellipsoid_get_parameters(context, ellipsoid.get(), &axis_m, nullptr, nullptr, &inverse_flattening) == 0) {
        return nullptr;
    }
    const auto geographic = [&](const char* unit, double unit_radians) -> Object {
        const Object system(proj_create_ellipsoidal_2D_cs(context, PJ_ELLPS2D_LONGITUDE_LATITUDE, unit, unit_radians));
        return Object(system
                          ? proj_create_geographic_crs(context, "plain", "plain", "plain", axis_m, inverse_flattening,
                                                       "Greenwich", 0, "Degree", kRadians, system.get())
                          : nullptr);
    };
    // A base in degrees: between radians and radians PROJ puts a step that converts them.
    const Object from = geographic("Radian", 1), base = geographic("Degree", kRadians);
    const Object metres(proj_create_cartesian_2D_cs(context, PJ_CART2D_EASTING_NORTHING, "metre", 1.0));
    if (!from || !base || !metres) return nullptr;
    const Object to(proj_create_projected_crs(context, "in metres", base.get(), conversion.get(), metres.get()));
    return to ? Object(proj_create_crs_to_crs_from_pj(context, from.get(), to.get(), nullptr, nullptr)) : nullptr;
}

/// Radians east of Greenwich.
double prime_meridian(PJ_CONTEXT* context, const PJ* crs) {
    const Object meridian(proj_get_prime_meridian(context, crs));
    double longitude = 0, unit = 0;
    if (!meridian || proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, &unit, nullptr) == 0) {
        return 0;
    }
    return longitude * unit;
}

/// False where the point has no image.
bool widen(ScaleRange& range, PJ* projection, double longitude, double latitude) {
    proj_errno_reset(projection);
    const PJ_COORD place = proj_coord(longitude, latitude, 0, 0);
    const PJ_FACTORS factors = proj_factors(projection, place);
    const bool fits = proj_errno(projection) == 0 && factors.tissot_semiminor > 1 / kGreatestScale &&
                      factors.tissot_semimajor < kGreatestScale &&
                      std::isfinite(proj_trans(projection, PJ_FWD, place).xy.x);
    if (!fits) return false;
    range.least = std::min(range.least, factors.tissot_semiminor);
    range.greatest = std::max(range.greatest, factors.tissot_semimajor);
    return true;
}

}  // namespace

Result<ScaleRange> measure_scale(const Crs& crs, const LonLatBox& given) {
    const Result<LonLatBox> box = unrolled(given);
    if (!box) return box.error();
    if (crs.geographic()) return refuse_box(given, fmt::format("CRS {} has degrees, not a scale", crs.name()));
    const Context context = proj::make_context();
    const Object whole = context ? proj::create_crs(context.get(), crs.text()) : nullptr;
    const Object bound = whole ? proj::horizontal_part(context.get(), whole.get()) : nullptr;
    const Object base = bound ? proj::unbound(context.get(), bound.get()) : nullptr;
    const Object projection = base ? metric_projection(context.get(), base.get()) : nullptr;
    if (!projection) return refuse_box(given, fmt::format("PROJ has no scale for CRS {}", crs.name()));

    const double zero = prime_meridian(context.get(), base.get());
    ScaleRange range{std::numeric_limits<double>::infinity(), 0};
    for (int row = 0; row <= kScaleSteps; ++row) {
        const double latitude = std::lerp(box->south, box->north, static_cast<double>(row) / kScaleSteps);
        for (int column = 0; column <= kScaleSteps; ++column) {
            const double longitude =
                wrapped(std::lerp(box->west, box->east, static_cast<double>(column) / kScaleSteps));
            if (!widen(range, projection.get(), longitude * kRadians - zero, latitude * kRadians)) {
                return refuse_box(given, fmt::format("CRS {} does not reach longitude {}, latitude {}", crs.name(),
                                                     longitude, latitude));
            }
        }
    }
    return range;
}

namespace {

struct Middle {
    double longitude, latitude;
};

Middle middle_of(const LonLatBox& box) { return {wrapped((box.west + box.east) / 2), (box.south + box.north) / 2}; }

/// Parameters that people can read; a tenth of a degree beside the best place costs nothing of note in scale.
double rounded(double degrees) { return std::round(degrees * 10) / 10 + 0.0; }

std::string span_text(const LonLatBox& box) {
    return fmt::format("the sources span {:.1f} x {:.1f} degrees", box.east - box.west, box.north - box.south);
}

/// A CRS on WGS 84 from a PROJ string, under a name that says what it is.
Result<Crs> named_crs(const std::string& name, const std::string& parameters) {
    const Error failed{ErrorCode::input, fmt::format("PROJ does not make \"{}\"", parameters)};
    const Context context = proj::make_context();
    if (!context) return failed;
    PJ_CONTEXT* const c = context.get();
    const Object plain = proj::create_crs(c, parameters + " +datum=WGS84 +units=m +type=crs");
    const Object conversion(plain ? proj_crs_get_coordoperation(c, plain.get()) : nullptr);
    // The registry's own WGS 84, which datum shifts are on record for.
    const Object base = proj::create_crs(c, "EPSG:4326");
    const Object metres(proj_create_cartesian_2D_cs(c, PJ_CART2D_EASTING_NORTHING, "metre", 1.0));
    if (!conversion || !base || !metres) return failed;
    const Object named(proj_create_projected_crs(c, name.c_str(), base.get(), conversion.get(), metres.get()));
    const char* text = named ? proj_as_wkt(c, named.get(), PJ_WKT2_2019, nullptr) : nullptr;
    if (text == nullptr) return failed;
    return Crs::parse(text);
}

struct Candidate {
    std::string name;
    Result<Crs> crs;
};

std::optional<Candidate> utm(const LonLatBox& box) {
    const Middle middle = middle_of(box);
    if (middle.latitude < -80 || middle.latitude > 84) return std::nullopt;
    const int zone = std::clamp(static_cast<int>(std::floor((middle.longitude + 180) / 6)) + 1, 1, 60);
    const bool north = middle.latitude >= 0;
    return Candidate{fmt::format("UTM zone {} {}", zone, north ? "N" : "S"),
                     Crs::parse(fmt::format("EPSG:{}", (north ? 32600 : 32700) + zone))};
}

std::optional<Candidate> polar(const LonLatBox& box) {
    const Middle middle = middle_of(box);
    const bool has_pole = box.south == -90 || box.north == 90;
    if (std::abs(middle.latitude) < 60 && !has_pole) return std::nullopt;
    const double pole = middle.latitude < 0 ? -90 : 90;
    const double true_at = rounded(middle.latitude);
    // With a whole turn no meridian is the middle one: up is Greenwich.
    const double up = box.east - box.west < 360 ? rounded(middle.longitude) : 0;
    const std::string name = fmt::format("polar stereographic true at {}", true_at);
    return Candidate{name, named_crs("WGS 84 / " + name,
                                     fmt::format("+proj=stere +lat_0={} +lat_ts={} +lon_0={}", pole, true_at, up))};
}

std::optional<Candidate> cone(const LonLatBox& box) {
    const Middle middle = middle_of(box);
    // Nearer to the equator the apex of the cone is further away than 50 Earth radii, and it may as well be a cylinder.
    if (std::abs(middle.latitude) < 1 || std::abs(middle.latitude) > 89) return std::nullopt;
    const double sixth = (box.north - box.south) / 6;
    const double south = rounded(box.south + sixth), north = rounded(box.north - sixth);
    const std::string name = fmt::format("Lambert conformal conic {} {}", south, north);
    return Candidate{
        name, named_crs("WGS 84 / " + name, fmt::format("+proj=lcc +lat_1={} +lat_2={} +lat_0={} +lon_0={}", south,
                                                        north, rounded(middle.latitude), rounded(middle.longitude)))};
}

std::optional<Candidate> mercator(const LonLatBox& box) {
    if (box.south > 0 || box.north < 0) return std::nullopt;
    // True where a sixth of the wider half's height is left, as the cone's parallels are.
    const double true_at = rounded(std::min(80.0, std::max(-box.south, box.north) * 2 / 3));
    const std::string name = fmt::format("Mercator true at {}", true_at);
    return Candidate{name, named_crs("WGS 84 / " + name, fmt::format("+proj=merc +lat_ts={} +lon_0={}", true_at,
                                                                     rounded(middle_of(box).longitude)))};
}

Candidate cylindrical(const LonLatBox& box) {
    const std::string name = "equidistant cylindrical";
    return {name, named_crs("WGS 84 / " + name,
                            fmt::format("+proj=eqc +lat_ts=0 +lon_0={}", rounded(middle_of(box).longitude)))};
}

bool is_metric(const Crs& crs) {
    return !crs.geographic() && std::abs(crs.metres_per_unit() - 1) < 1e-12 && crs.east_north();
}

}  // namespace

Result<ChosenCrs> choose_crs(const Crs* own, const LonLatBox& given) {
    const Result<LonLatBox> box = unrolled(given);
    if (!box) return box.error();
    if (own != nullptr && is_metric(*own)) {
        const Result<ScaleRange> scale = measure_scale(*own, *box);
        if (scale && scale->worst() <= kGoodScale) {
            return ChosenCrs{*own, fmt::format("{}: the first DEM's own", own->name()), *scale};
        }
    }
    std::optional<ChosenCrs> best;
    for (std::optional<Candidate> (*candidate_for)(const LonLatBox&) : {utm, polar, cone, mercator}) {
        std::optional<Candidate> candidate = candidate_for(*box);
        if (!candidate || !candidate->crs) continue;
        const Result<ScaleRange> scale = measure_scale(*candidate->crs, *box);
        if (!scale || (best && best->scale.worst() <= scale->worst())) continue;
        best = ChosenCrs{*candidate->crs, fmt::format("{}: {}", candidate->name, span_text(*box)), *scale};
        if (scale->worst() <= kGoodScale) break;
    }
    if (best) return *best;

    const Candidate last = cylindrical(*box);
    if (!last.crs) return last.crs.error();
    LonLatBox cut = *box;
    cut.south = std::clamp(cut.south, -kCylinderLatitude, kCylinderLatitude);
    cut.north = std::clamp(cut.north, -kCylinderLatitude, kCylinderLatitude);
    const Result<ScaleRange> scale = measure_scale(*last.crs, cut);
    if (!scale) return scale.error();
    return ChosenCrs{*last.crs, fmt::format("{}: {}", last.name, span_text(*box)), *scale};
}

}  // namespace scree
