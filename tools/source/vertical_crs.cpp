#include "tools/source/vertical_crs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "tools/source/proj_handles.h"

namespace scree {
namespace {

using proj::Context;
using proj::Object;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSameHeight_m = 1e-6;
constexpr double kProbeHeight_m = 1000;
constexpr int kProbes = 5;  // along each side of the area

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }

/// The code under which an object was looked up; empty for what is spelled out.
std::string own_code(const PJ* object) {
    const char* authority = proj_get_id_auth_name(object, 0);
    const char* code = proj_get_id_code(object, 0);
    if (authority == nullptr || code == nullptr) return {};
    return fmt::format("{}:{}", authority, code);
}

/// The last axis is the vertical one.
bool read_axis(PJ_CONTEXT* context, const PJ* crs, VerticalCrs& out) {
    const Object system(proj_crs_get_coordinate_system(context, crs));
    const int axes = system ? proj_cs_get_axis_count(context, system.get()) : 0;
    const char* direction = nullptr;
    if (axes < 1 || proj_cs_get_axis_info(context, system.get(), axes - 1, nullptr, nullptr, &direction,
                                          &out.metres_per_unit, nullptr, nullptr, nullptr) == 0) {
        return false;
    }
    const std::string towards = direction != nullptr ? direction : "";
    out.up = towards == "up";
    return (out.up || towards == "down") && out.metres_per_unit > 0 && std::isfinite(out.metres_per_unit);
}

}  // namespace

Result<VerticalCrs> VerticalCrs::parse(const std::string& text) {
    const Error refused =
        input_error(fmt::format("\"{}\" is no vertical CRS on record; EPSG:n of a vertical CRS, or of a geographic one "
                                "of three dimensions, is needed",
                                text.substr(0, 80)));
    const Context context = proj::make_context();
    if (!context || text.rfind("EPSG:", 0) != 0) return refused;
    const Object crs = proj::create_crs(context.get(), text);
    if (!crs) return refused;
    const PJ_TYPE type = proj_get_type(crs.get());
    if (type != PJ_TYPE_VERTICAL_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS) return refused;
    VerticalCrs out;
    out.text = own_code(crs.get());
    out.ellipsoidal = type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
    const char* name = proj_get_name(crs.get());
    out.name = fmt::format("{}{}", name != nullptr ? name : out.text, out.ellipsoidal ? " (ellipsoid)" : "");
    if (out.text.empty() || !read_axis(context.get(), crs.get(), out)) return refused;
    return out;
}

struct VerticalShift::Impl {
    Context context;
    Object operation;  ///< null: nothing to do
    std::optional<CrsTransform> to_geographic;
    double from_unit = 1, to_unit = 1;
    double turn = 360;
    std::string name;
    double accuracy_m = 0;
};

namespace {

std::string one_line_wkt(PJ_CONTEXT* context, const PJ* object) {
    const std::array<const char*, 2> options = {"MULTILINE=NO", nullptr};
    const char* text = object != nullptr ? proj_as_wkt(context, object, PJ_WKT2_2019, options.data()) : nullptr;
    return text != nullptr ? text : std::string();
}

/// What the shift is looked up in: longitudes and latitudes on the datum of the ellipsoidal side if there is one, else
/// on the raster's own.
Result<Crs> geographic_side(PJ_CONTEXT* context, const Crs& horizontal, const VerticalCrs& from,
                            const VerticalCrs& to) {
    if (from.ellipsoidal) return Crs::parse(from.text);
    if (to.ellipsoidal) return Crs::parse(to.text);
    if (horizontal.geographic()) return horizontal;
    const Object whole = proj::create_crs(context, horizontal.text());
    const Object base = whole ? proj::unbound(context, whole.get()) : nullptr;
    const Object geographic(base ? proj_crs_get_geodetic_crs(context, base.get()) : nullptr);
    return Crs::parse(one_line_wkt(context, geographic.get()));
}

/// Longitude, latitude and height as PROJ knows them together.
Object three_dimensional(PJ_CONTEXT* context, const Crs& geographic, const VerticalCrs& vertical) {
    Object up = proj::create_crs(context, vertical.text);
    if (vertical.ellipsoidal || !up) return up;
    const Object whole = proj::create_crs(context, geographic.text());
    const Object plane = whole ? proj::horizontal_part(context, whole.get()) : nullptr;
    // A shift of the horizontal datum says nothing of heights, and a bound CRS cannot be part of a compound one.
    const Object base = plane ? proj::unbound(context, plane.get()) : nullptr;
    return base ? Object(proj_create_compound_crs(context, "heights", base.get(), up.get())) : nullptr;
}

proj::List operations(PJ_CONTEXT* context, const PJ* from, const PJ* to, const LonLatBox& area) {
    const proj::Factory factory(proj_create_operation_factory_context(context, nullptr));
    if (!factory) return nullptr;
    // Those that lack a grid are listed too: the refusal names it.
    proj_operation_factory_context_set_grid_availability_use(context, factory.get(), PROJ_GRID_AVAILABILITY_IGNORED);
    proj_operation_factory_context_set_allow_ballpark_transformations(context, factory.get(), 0);
    proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                         PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
    proj_operation_factory_context_set_area_of_interest(context, factory.get(), area.west, area.south, area.east,
                                                        area.north);
    return proj::List(proj_create_operations(context, from, to, factory.get()));
}

struct Grids {
    int used = 0;
    std::string missing;  ///< "a.tif (https://...), b.tif"
};
Grids grids_of(PJ_CONTEXT* context, const PJ* operation) {
    Grids grids{proj_coordoperation_get_grid_used_count(context, operation), {}};
    for (int i = 0; i < grids.used; ++i) {
        const char* name = nullptr;
        const char* url = nullptr;
        int available = 1;
        if (proj_coordoperation_get_grid_used(context, operation, i, &name, nullptr, nullptr, &url, nullptr, nullptr,
                                              &available) == 0 ||
            available != 0 || name == nullptr) {
            continue;
        }
        if (!grids.missing.empty()) grids.missing += ", ";
        grids.missing += name;
        if (url != nullptr && *url != '\0') grids.missing += fmt::format(" ({})", url);
    }
    return grids;
}

}  // namespace

Result<VerticalShift> VerticalShift::make(const Crs& horizontal, const VerticalCrs& from, const VerticalCrs& to,
                                          const LonLatBox& area) {
    auto impl = std::make_unique<Impl>();
    if (from.text == to.text) return VerticalShift(std::move(impl));
    const std::string what = fmt::format("heights above {} ({}) cannot be made heights above {} ({})", from.text,
                                         from.name, to.text, to.name);
    impl->context = proj::make_context();
    if (!impl->context) return input_error(what + ": PROJ cannot be started");
    PJ_CONTEXT* const context = impl->context.get();
    const Result<Crs> geographic = geographic_side(context, horizontal, from, to);
    if (!geographic) return input_error(fmt::format("{}: {}", what, geographic.error().message));
    const Object source = three_dimensional(context, *geographic, from);
    const Object target = three_dimensional(context, *geographic, to);
    const proj::List list = source && target ? operations(context, source.get(), target.get(), area) : nullptr;
    const int count = list ? proj_list_get_count(list.get()) : 0;
    std::string missing;
    Object best;
    for (int i = 0; i < count && !best; ++i) {
        Object candidate(proj_list_get(context, list.get(), i));
        if (!candidate || proj_coordoperation_has_ballpark_transformation(context, candidate.get()) != 0) continue;
        if (proj_coordoperation_is_instantiable(context, candidate.get()) != 0)
            best = std::move(candidate);
        else if (missing.empty())
            missing = grids_of(context, candidate.get()).missing;
    }
    if (!best) {
        if (missing.empty())
            return input_error(
                fmt::format("{}: PROJ knows no way at longitudes {:.4g} to {:.4g}, latitudes {:.4g} to "
                            "{:.4g}",
                            what, area.west, area.east, area.south, area.north));
        return input_error(fmt::format("{}: PROJ needs a grid that is not installed: {}", what, missing));
    }
    auto way = CrsTransform::make(horizontal, *geographic);
    if (!way) return input_error(fmt::format("{}: {}", what, way.error().message));
    impl->to_geographic = std::move(*way);
    impl->from_unit = from.metres_per_unit;
    impl->to_unit = to.metres_per_unit;
    impl->turn = geographic->turn();
    const char* name = proj_get_name(best.get());
    impl->name = name != nullptr ? name : "unnamed";
    impl->accuracy_m =
        proj_get_type(best.get()) == PJ_TYPE_CONVERSION ? 0 : proj_coordoperation_get_accuracy(context, best.get());
    const bool gridless = grids_of(context, best.get()).used == 0;
    impl->operation.reset(proj_normalize_for_visualization(context, best.get()));
    if (!impl->operation) return input_error(what + ": PROJ cannot carry it out");
    VerticalShift shift(std::move(impl));
    // Without a grid it is a formula, the same everywhere or nearly so: a few places tell.
    if (gridless && shift.keeps_metres(horizontal, area)) shift.impl_->operation.reset();
    return shift;
}

bool VerticalShift::keeps_metres(const Crs& horizontal, const LonLatBox& area) const {
    auto degrees = Crs::parse("EPSG:4326");
    auto into = degrees ? CrsTransform::make(*degrees, horizontal) : Result<CrsTransform>(degrees.error());
    if (!into) return false;
    std::vector<double> x, y, z;
    for (int i = 0; i < kProbes * kProbes; ++i) {
        x.push_back(std::lerp(area.west, area.east, static_cast<double>(i % kProbes) / (kProbes - 1)));
        y.push_back(std::lerp(area.south, area.north, static_cast<double>(i / kProbes) / (kProbes - 1)));
        z.push_back(i % 2 == 0 ? kProbeHeight_m : -kProbeHeight_m);
    }
    const std::vector<double> before = z;
    into->apply(x, y);
    apply(x, y, z);
    for (std::size_t i = 0; i < z.size(); ++i)
        if (!(std::abs(z[i] - before[i]) <= kSameHeight_m)) return false;
    return true;
}

void VerticalShift::apply(std::span<const double> x, std::span<const double> y, std::span<double> z) const {
    if (identity()) return;
    std::vector<double> lon(x.begin(), x.end()), lat(y.begin(), y.end());
    impl_->to_geographic->apply(lon, lat);
    for (std::size_t i = 0; i < z.size(); ++i) {
        if (std::abs(lon[i]) > impl_->turn / 2) lon[i] = std::remainder(lon[i], impl_->turn);
        z[i] /= impl_->from_unit;
    }
    proj_trans_generic(impl_->operation.get(), PJ_FWD, lon.data(), sizeof(double), lon.size(), lat.data(),
                       sizeof(double), lat.size(), z.data(), sizeof(double), z.size(), nullptr, 0, 0);
    for (double& height : z) height = std::isfinite(height) ? height * impl_->to_unit : kNaN;
}

bool VerticalShift::identity() const { return impl_->operation == nullptr; }
const std::string& VerticalShift::operation() const { return impl_->name; }
double VerticalShift::accuracy_m() const { return impl_->accuracy_m; }

VerticalShift::VerticalShift(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VerticalShift::VerticalShift(VerticalShift&&) noexcept = default;
VerticalShift& VerticalShift::operator=(VerticalShift&&) noexcept = default;
VerticalShift::~VerticalShift() = default;

}  // namespace scree
