#include "tools/source/crs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "tools/source/proj_handles.h"

namespace scree {
namespace proj {
namespace {

void say_nothing(void*, int, const char*) {}

}  // namespace

Context make_context() {
    Context context(proj_context_create());
    if (!context) return context;
    proj_log_func(context.get(), nullptr, say_nothing);
    proj_context_set_enable_network(context.get(), 0);
    return context;
}

Object create_crs(PJ_CONTEXT* context, const std::string& text) {
    Object object(proj_create(context, text.c_str()));
    if (object && proj_is_crs(object.get()) == 0) object.reset();
    return object;
}

Object unbound(PJ_CONTEXT* context, const PJ* crs) {
    if (proj_get_type(crs) == PJ_TYPE_BOUND_CRS) return Object(proj_get_source_crs(context, crs));
    return Object(proj_clone(context, crs));
}

Object horizontal_part(PJ_CONTEXT* context, const PJ* crs) {
    switch (proj_get_type(crs)) {
        case PJ_TYPE_COMPOUND_CRS: {
            const Object part(proj_crs_get_sub_crs(context, crs, 0));
            return part ? horizontal_part(context, part.get()) : nullptr;
        }
        case PJ_TYPE_BOUND_CRS: {
            const Object base = unbound(context, crs);
            if (!base) return nullptr;
            // A shift of datum says something of two dimensions only where its base has two.
            if (proj_get_type(base.get()) == PJ_TYPE_GEOGRAPHIC_2D_CRS ||
                proj_get_type(base.get()) == PJ_TYPE_PROJECTED_CRS) {
                return Object(proj_clone(context, crs));
            }
            return horizontal_part(context, base.get());
        }
        case PJ_TYPE_GEOGRAPHIC_2D_CRS:
            return Object(proj_clone(context, crs));
        case PJ_TYPE_GEOGRAPHIC_3D_CRS:
        case PJ_TYPE_PROJECTED_CRS:
            return Object(proj_crs_demote_to_2D(context, nullptr, crs));
        default:
            return nullptr;
    }
}

bool equivalent(PJ_CONTEXT* context, const PJ* a, const PJ* b) {
    const Object first(proj_normalize_for_visualization(context, a));
    const Object second(proj_normalize_for_visualization(context, b));
    if (!first || !second) return false;
    return proj_is_equivalent_to_with_ctx(context, first.get(), second.get(),
                                          PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) != 0;
}

}  // namespace proj

struct Crs::Impl {
    std::string text, name, vertical;
    double turn = 0;  ///< 0: projected
    double metres_per_unit = 1;
    bool east_north = true;
};

namespace {

using proj::Context;
using proj::Object;

/// No honest definition is longer, and PROJ's parsers are not asked to read more.
constexpr std::size_t kLongestText = 1 << 20;

std::string quoted(const std::string& text) {
    std::string cut = text.substr(0, 80);
    for (char& c : cut) {
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    }
    return text.size() > cut.size() ? cut + "..." : cut;
}

Error refuse(const std::string& text, const std::string& why) {
    return {ErrorCode::input, fmt::format("CRS \"{}\": {}", quoted(text), why)};
}

/// Names are not taken: PROJ guesses at them, and a wrong guess puts a raster elsewhere.
bool is_definition(const std::string& text) {
    if (text.find('[') != std::string::npos || text.find('{') != std::string::npos) return true;
    if (text.find("proj=") != std::string::npos || text.find("init=") != std::string::npos) return true;
    const std::size_t colon = text.find(':');
    return colon != std::string::npos && colon > 0 && colon + 1 < text.size() &&
           text.find_first_of(" \t\r\n") == std::string::npos;
}

/// A PROJ string stands for a CRS only when it says so.
std::string as_crs_text(const std::string& text) {
    const bool proj_string = text.find('[') == std::string::npos && text.find('{') == std::string::npos &&
                             (text.find("proj=") != std::string::npos || text.find("init=") != std::string::npos);
    return proj_string && text.find("type=crs") == std::string::npos ? text + " +type=crs" : text;
}

std::string trimmed(const std::string& text) {
    const char* space = " \t\r\n";
    const std::size_t first = text.find_first_not_of(space);
    if (first == std::string::npos) return {};
    return text.substr(first, text.find_last_not_of(space) - first + 1);
}

std::string epsg_text(const PJ* object) {
    const char* authority = proj_get_id_auth_name(object, 0);
    const char* code = proj_get_id_code(object, 0);
    if (authority == nullptr || code == nullptr || std::string(authority) != "EPSG") return {};
    return fmt::format("EPSG:{}", code);
}

/// "EPSG:n" where the registry's definition is the same, not only the name or number.
std::string registered(PJ_CONTEXT* context, const PJ* object) {
    const auto is_same = [&](const std::string& text) {
        const Object known = text.empty() ? nullptr : proj::create_crs(context, text);
        return known && proj::equivalent(context, known.get(), object);
    };
    if (std::string own = epsg_text(object); is_same(own)) return own;
    const proj::List list(proj_identify(context, object, "EPSG", nullptr, nullptr));
    const int count = list ? proj_list_get_count(list.get()) : 0;
    for (int i = 0; i < count; ++i) {
        const Object candidate(proj_list_get(context, list.get(), i));
        if (!candidate) continue;
        if (std::string text = epsg_text(candidate.get()); is_same(text)) return text;
    }
    return {};
}

std::string plain_wkt(PJ_CONTEXT* context, const PJ* object) {
    const std::array<const char*, 2> options = {"MULTILINE=NO", nullptr};
    const char* text = proj_as_wkt(context, object, PJ_WKT2_2019, options.data());
    return text != nullptr ? text : std::string();
}

/// One-line WKT2; empty where PROJ has none that says the same. Read and written once more: PROJ fills in names then,
/// and the text of a text should be itself.
std::string wkt(PJ_CONTEXT* context, const PJ* object) {
    const Object again = proj::create_crs(context, plain_wkt(context, object));
    return again && proj::equivalent(context, again.get(), object) ? plain_wkt(context, again.get()) : std::string();
}

/// The number of a compound CRS's vertical part, or of the three-dimensional geographic CRS that heights above an
/// ellipsoid are of.
std::string vertical_text(PJ_CONTEXT* context, const PJ* crs) {
    if (proj_get_type(crs) == PJ_TYPE_GEOGRAPHIC_3D_CRS) return registered(context, crs);
    if (proj_get_type(crs) == PJ_TYPE_PROJECTED_CRS) {
        const Object base(proj_crs_get_geodetic_crs(context, crs));
        const bool solid = base && proj_get_type(base.get()) == PJ_TYPE_GEOGRAPHIC_3D_CRS;
        return solid ? registered(context, base.get()) : std::string();
    }
    if (proj_get_type(crs) != PJ_TYPE_COMPOUND_CRS) return {};
    const Object part(proj_crs_get_sub_crs(context, crs, 1));
    const Object vertical = part ? proj::unbound(context, part.get()) : nullptr;
    return vertical ? registered(context, vertical.get()) : std::string();
}

struct Axes {
    std::array<std::string, 2> direction;
    std::array<double, 2> unit{};  ///< metres or radians
};

/// Of a CRS with x before y; false where it has not two axes.
bool read_axes(PJ_CONTEXT* context, const PJ* crs, Axes& axes) {
    const Object normal(proj_normalize_for_visualization(context, crs));
    const Object system(normal ? proj_crs_get_coordinate_system(context, normal.get()) : nullptr);
    if (!system || proj_cs_get_axis_count(context, system.get()) != 2) return false;
    for (std::size_t i = 0; i < 2; ++i) {
        const char* direction = nullptr;
        if (proj_cs_get_axis_info(context, system.get(), static_cast<int>(i), nullptr, nullptr, &direction,
                                  &axes.unit[i], nullptr, nullptr, nullptr) == 0) {
            return false;
        }
        axes.direction[i] = direction;
    }
    return true;
}

/// The CRS's own name, the registry's, or what was typed.
std::string readable_name(PJ_CONTEXT* context, const PJ* crs, const std::string& registered_text,
                          const std::string& typed) {
    const Object known = registered_text.empty() ? nullptr : proj::create_crs(context, registered_text);
    for (const PJ* object : {crs, static_cast<const PJ*>(known.get())}) {
        const char* name = object != nullptr ? proj_get_name(object) : nullptr;
        if (name != nullptr && *name != '\0' && std::string(name) != "unknown") return quoted(name);
    }
    return quoted(typed);
}

/// What texts said before: a mosaic's thousand files name one CRS, and looking through the registry for what fits a WKT
/// takes a tenth of a second.
class Known {
public:
    std::shared_ptr<const Crs::Impl> find(const std::string& text) {
        const std::lock_guard lock(mutex_);
        const auto found = crs_.find(text);
        return found != crs_.end() ? found->second : nullptr;
    }
    void add(const std::string& text, std::shared_ptr<const Crs::Impl> crs) {
        const std::lock_guard lock(mutex_);
        if (crs_.size() < kMost) crs_.emplace(text, std::move(crs));
    }

private:
    static constexpr std::size_t kMost = 64;
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<const Crs::Impl>> crs_;
};

Known& known_crs() {
    static Known known;
    return known;
}

}  // namespace

Result<Crs> Crs::parse(const std::string& given) {
    const std::string text = trimmed(given);
    if (auto known = known_crs().find(text)) return Crs(std::move(known));
    if (text.size() > kLongestText || text.find('\0') != std::string::npos || !is_definition(text)) {
        return refuse(given, "not a definition; \"EPSG:n\", WKT, PROJJSON or a PROJ string is needed");
    }
    const Context context = proj::make_context();
    if (!context) return refuse(given, "PROJ cannot be started");
    PJ_CONTEXT* const c = context.get();
    const std::string definition = as_crs_text(text);
    const Object whole = proj::create_crs(c, definition);
    if (!whole) return refuse(given, "PROJ does not know it, so nothing can be placed by it");
    const Object crs = proj::horizontal_part(c, whole.get());
    if (!crs) return refuse(given, "it is neither geographic nor projected, so no raster lies in it");
    const Object base = proj::unbound(c, crs.get());
    Axes axes;
    if (!base || !read_axes(c, base.get(), axes)) return refuse(given, "it has not two horizontal axes");
    if (!(axes.unit[0] > 0) || !std::isfinite(axes.unit[0]) || axes.unit[0] != axes.unit[1]) {
        return refuse(given, "its axes have different units or none");
    }

    auto impl = std::make_shared<Impl>();
    const bool geographic = proj_get_type(base.get()) == PJ_TYPE_GEOGRAPHIC_2D_CRS;
    // 2 pi over the unit in radians is 360.00000000000006 or so: the round number is meant.
    if (geographic) impl->turn = std::round(2 * std::numbers::pi / axes.unit[0] * 1e6) / 1e6;
    if (!geographic) impl->metres_per_unit = axes.unit[0];
    impl->east_north = axes.direction[0] != "west" && axes.direction[1] != "west";
    impl->text = registered(c, crs.get());
    impl->name = readable_name(c, base.get(), impl->text, text);
    if (impl->text.empty()) impl->text = wkt(c, crs.get());
    if (impl->text.empty()) impl->text = definition;
    impl->vertical = vertical_text(c, whole.get());
    known_crs().add(text, impl);
    return Crs(std::move(impl));
}

Crs Crs::unnamed_metres() {
    auto impl = std::make_shared<Impl>();
    impl->name = "metres of the files";
    return Crs(std::move(impl));
}

Crs::Crs(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
Crs::Crs(const Crs&) = default;
Crs::Crs(Crs&&) noexcept = default;
Crs& Crs::operator=(const Crs&) = default;
Crs& Crs::operator=(Crs&&) noexcept = default;
Crs::~Crs() = default;

const std::string& Crs::text() const { return impl_->text; }
const std::string& Crs::name() const { return impl_->name; }
const std::string& Crs::vertical() const { return impl_->vertical; }
bool Crs::geographic() const { return impl_->turn > 0; }
double Crs::turn() const { return impl_->turn; }
double Crs::metres_per_unit() const { return impl_->metres_per_unit; }
bool Crs::east_north() const { return impl_->east_north; }

namespace {

/// What Crs::text() says, as an object: the text was read once, but the registry may have gone since.
Object reopen(PJ_CONTEXT* context, const Crs& crs) {
    const Object whole = proj::create_crs(context, crs.text());
    return whole ? proj::horizontal_part(context, whole.get()) : nullptr;
}

}  // namespace

std::string Crs::esri_wkt() const {
    const Context context = proj::make_context();
    const Object crs = context ? reopen(context.get(), *this) : nullptr;
    if (!crs) return {};
    const std::array<const char*, 2> options = {"MULTILINE=NO", nullptr};
    const char* text = proj_as_wkt(context.get(), crs.get(), PJ_WKT1_ESRI, options.data());
    if (text == nullptr) return {};
    const std::string wkt = text;
    const Object again = proj::create_crs(context.get(), wkt);
    return again && proj::equivalent(context.get(), again.get(), crs.get()) ? wkt : std::string();
}

bool Crs::same_as(const Crs& other) const {
    if (impl_ == other.impl_ || text() == other.text()) return true;
    const Context context = proj::make_context();
    if (!context) return false;
    const Object a = reopen(context.get(), *this);
    const Object b = reopen(context.get(), other);
    return a && b && proj::equivalent(context.get(), a.get(), b.get());
}

struct CrsTransform::Impl {
    Context context;
    Object operation;      ///< null: identity
    double from_turn = 0;  ///< of geographic CRS; 0: projected
    double to_turn = 0;
    double accuracy_m = 0;
};

namespace {

/// The first operation that can be carried out with the grids at hand. PROJ sorts by the area that they cover, then by
/// accuracy, those that merely neglect the datum last.
Object best_operation(PJ_CONTEXT* context, const PJ* from, const PJ* to, const LonLatBox* area) {
    const proj::Factory factory(proj_create_operation_factory_context(context, nullptr));
    if (!factory) return nullptr;
    proj_operation_factory_context_set_grid_availability_use(context, factory.get(),
                                                             PROJ_GRID_AVAILABILITY_DISCARD_OPERATION_IF_MISSING_GRID);
    proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                         PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
    if (area != nullptr) {
        proj_operation_factory_context_set_area_of_interest(context, factory.get(), area->west, area->south, area->east,
                                                            area->north);
    }
    const proj::List list(proj_create_operations(context, from, to, factory.get()));
    const int count = list ? proj_list_get_count(list.get()) : 0;
    for (int i = 0; i < count; ++i) {
        Object operation(proj_list_get(context, list.get(), i));
        if (operation && proj_coordoperation_is_instantiable(context, operation.get()) != 0) return operation;
    }
    return nullptr;
}

/// A change of projection alone has no accuracy on record, because it loses none.
double accuracy_of(PJ_CONTEXT* context, const PJ* operation) {
    if (proj_get_type(operation) == PJ_TYPE_CONVERSION) return 0;
    if (proj_coordoperation_has_ballpark_transformation(context, operation) != 0) return -1;
    return proj_coordoperation_get_accuracy(context, operation);
}

}  // namespace

Result<CrsTransform> CrsTransform::make(const Crs& from, const Crs& to, const LonLatBox* area) {
    auto impl = std::make_unique<Impl>();
    if (from.same_as(to)) return CrsTransform(std::move(impl));
    const Error no_way{ErrorCode::input,
                       fmt::format("no way is known from CRS {} to CRS {}", quoted(from.name()), quoted(to.name()))};
    impl->context = proj::make_context();
    if (!impl->context) return no_way;
    PJ_CONTEXT* const context = impl->context.get();
    const Object a = reopen(context, from);
    const Object b = reopen(context, to);
    const Object best = a && b ? best_operation(context, a.get(), b.get(), area) : nullptr;
    if (!best) return no_way;
    impl->accuracy_m = accuracy_of(context, best.get());
    impl->operation.reset(proj_normalize_for_visualization(context, best.get()));
    if (!impl->operation) return no_way;
    impl->from_turn = from.turn();
    impl->to_turn = to.turn();
    return CrsTransform(std::move(impl));
}

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Longitude to within half a turn, latitude to within a quarter (beyond which there is none; rounding aside).
void bring_into_range(double& longitude, double& latitude, double turn) {
    const double pole = turn / 4;
    if (!(std::abs(latitude) <= pole * (1 + 1e-11)) || !std::isfinite(longitude)) {
        longitude = latitude = kNaN;
        return;
    }
    latitude = std::clamp(latitude, -pole, pole);
    if (std::abs(longitude) > turn / 2) longitude = std::remainder(longitude, turn);
}

}  // namespace

void CrsTransform::apply(std::span<double> x, std::span<double> y) const {
    const std::size_t n = std::min(x.size(), y.size());
    if (identity() || n == 0) return;
    if (impl_->from_turn > 0) {
        for (std::size_t i = 0; i < n; ++i) bring_into_range(x[i], y[i], impl_->from_turn);
    }
    proj_trans_generic(impl_->operation.get(), PJ_FWD, x.data(), sizeof(double), n, y.data(), sizeof(double), n,
                       nullptr, 0, 0, nullptr, 0, 0);
    for (std::size_t i = 0; i < n; ++i) {
        if (!std::isfinite(x[i]) || !std::isfinite(y[i])) {
            x[i] = y[i] = kNaN;
        } else if (impl_->to_turn > 0) {
            bring_into_range(x[i], y[i], impl_->to_turn);
        }
    }
}

bool CrsTransform::identity() const { return impl_->operation == nullptr; }
double CrsTransform::accuracy_m() const { return impl_->accuracy_m; }

CrsTransform::CrsTransform(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CrsTransform::CrsTransform(CrsTransform&&) noexcept = default;
CrsTransform& CrsTransform::operator=(CrsTransform&&) noexcept = default;
CrsTransform::~CrsTransform() = default;

}  // namespace scree
