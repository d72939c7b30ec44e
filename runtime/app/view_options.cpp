#include "runtime/app/view_options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "common/cli/arguments.h"
#include "common/report.h"

namespace scree {

namespace {

/// Unit length, towards the sun.
std::optional<glm::vec3> sun_direction_from(const std::string& text) {
    double azimuth_deg = 0, altitude_deg = 0;
    const char* end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, azimuth_deg);
    if (first.ec != std::errc{} || first.ptr == end || *first.ptr != ',') return std::nullopt;
    const auto second = std::from_chars(first.ptr + 1, end, altitude_deg);
    if (second.ec != std::errc{} || second.ptr != end) return std::nullopt;
    if (!(std::abs(azimuth_deg) <= 360 && std::abs(altitude_deg) <= 90)) return std::nullopt;
    const double azimuth = glm::radians(azimuth_deg), altitude = glm::radians(altitude_deg);
    return glm::vec3(std::sin(azimuth) * std::cos(altitude), std::cos(azimuth) * std::cos(altitude),
                     std::sin(altitude));
}

}  // namespace

void add_view_options(CLI::App& app, ViewOptions& o) {
    app.add_option("STORE", o.store, "A .scree file")->required();
    app.add_option("--size", o.size, "Picture in pixels, WIDTHxHEIGHT")->capture_default_str();
    app.add_option("--fov", o.fov_deg, "Vertical field of view, degrees")->capture_default_str();
    app.add_option("--tau", o.tau_px, "Allowed screen-space error, pixels: smaller is truer and costs triangles")
        ->capture_default_str();
    app.add_option("--texture-tau", o.texture_tau_px,
                   "Screen pixels a texel may cover: smaller is sharper and costs memory")
        ->capture_default_str();
    app.add_option("--exaggeration", o.exaggeration, "Heights this many times as high, and their errors with them")
        ->capture_default_str();
    app.add_option("--budget", o.budget, "Ceiling of tile memory, such as 256M")->capture_default_str();
    app.add_option("--curvature", o.curvature_text,
                   "Lower what is far away as the earth does: auto (where it shows), on, off")
        ->type_name("auto|on|off")
        ->capture_default_str();
    app.add_flag("--no-morph", o.no_morph, "Draw discrete levels: nothing moves, changes pop");
    app.add_option("--msaa", o.samples, "Samples a pixel: smooth outlines; costs on software OpenGL")
        ->check(CLI::IsMember({0, 2, 4, 8}))
        ->capture_default_str();
    app.add_option("--anisotropy", o.anisotropy, "Up to 16: sharper imagery at grazing angles; costs as well")
        ->check(CLI::Range(1.0, 16.0))
        ->capture_default_str();
    app.add_option("--sun", o.sun, "AZIMUTH,ALTITUDE of the sun in degrees, from north by east; lights sky and haze")
        ->type_name("AZIMUTH,ALTITUDE");
    app.add_option("--edge", o.edge, "The end of the data: soft (it dissolves) or hard (it is cut)")
        ->check(CLI::IsMember({"soft", "hard"}))
        ->capture_default_str();
    add_lod_options(app, o.lod_options);
    add_json_option(app, o.json);
}

void add_lod_options(CLI::App& app, LodOptions& o) {
    app.add_option("--lod", o.lod, "What decides density: geomip (a stride a tile), rsg (vertex by vertex), block-rsg")
        ->type_name("geomip|rsg|block-rsg")
        ->capture_default_str();
    app.add_option(
           "--metric", o.metric,
           "guaranteed (nothing errs by more than tau), or as the papers have it and without a bound: uc, deboer")
        ->type_name("guaranteed|uc|deboer")
        ->capture_default_str();
    app.add_option(
           "--cache", o.cache,
           "With --lod rsg, keep meshes while the eye moves: off, exact (errs by up to tau + s), paper (no bound)")
        ->type_name("off|exact|paper")
        ->capture_default_str();
    app.add_option("--s", o.s_px, "With --cache, pixels beyond tau: larger keeps meshes longer, and errs by more")
        ->capture_default_str();
    app.add_option("--cull", o.cull, "box, or corners (as published: loses tiles)")
        ->type_name("box|corners")
        ->capture_default_str();
    app.add_option("--cracks", o.cracks, "stitch, or with --lod rsg dike (as published: strips between blocks)")
        ->type_name("stitch|dike")
        ->capture_default_str();
}

Result<void> check_view_options(ViewOptions& o) {
    const auto size = parse_size(o.size);
    if (!size || size->first > 16384 || size->second > 16384)
        return Error{ErrorCode::usage, fmt::format("--size {} is not WIDTHxHEIGHT within 16384", o.size)};
    o.width_px = size->first;
    o.height_px = size->second;
    const auto budget = parse_bytes(o.budget);
    if (!budget) return Error{ErrorCode::usage, fmt::format("--budget {} is not a size such as 256M", o.budget)};
    o.budget_bytes = *budget;
    if (!(std::isfinite(o.tau_px) && o.tau_px >= 0))
        return Error{ErrorCode::usage, fmt::format("--tau {} is not a length in pixels", o.tau_px)};
    if (!(std::isfinite(o.texture_tau_px) && o.texture_tau_px > 0))
        return Error{ErrorCode::usage, fmt::format("--texture-tau {} is not above 0", o.texture_tau_px)};
    if (!(o.exaggeration >= 0.01 && o.exaggeration <= 100))
        return Error{ErrorCode::usage, fmt::format("--exaggeration {} is outside 0.01..100", o.exaggeration)};
    const auto curvature = curvature_from(o.curvature_text);
    if (!curvature)
        return Error{ErrorCode::usage, fmt::format("--curvature {} is not auto, on or off", o.curvature_text)};
    o.curvature = *curvature;
    const auto lod = lod_settings_from(o.lod_options);
    if (!lod) return lod.error();
    o.lod = *lod;
    if (!o.sun.empty()) {
        o.sun_direction = sun_direction_from(o.sun);
        if (!o.sun_direction)
            return Error{ErrorCode::usage,
                         fmt::format("--sun {} is not AZIMUTH,ALTITUDE within -360..360 and -90..90 degrees", o.sun)};
    }
    if (!(o.fov_deg >= 0.001 && o.fov_deg <= 179))
        return Error{ErrorCode::usage, fmt::format("--fov {} is outside 0.001..179 degrees", o.fov_deg)};
    return {};
}

Result<std::unique_ptr<SqliteStore>> open_store(const ViewOptions& o) {
    return SqliteStore::open(o.store, {o.exaggeration});
}

std::string window_title(const ViewOptions& o) {
    return fmt::format("Scree - {}", std::filesystem::path(o.store).stem().string());
}

DisplayOptions display_options(const ViewOptions& o) {
    DisplayOptions d{o.width_px, o.height_px};
    d.samples = o.samples;
    d.anisotropy = o.anisotropy;
    return d;
}

void set_look(const ViewOptions& o, FrameSettings& s) {
    if (o.sun_direction) s.sun_direction = *o.sun_direction;
    s.soft_edge = o.edge == "soft";
}

SceneOptions scene_options(const ViewOptions& o) {
    SceneOptions s;
    s.budget_bytes = o.budget_bytes;
    s.tau_px = o.tau_px;
    s.texture_tau_px = o.texture_tau_px;
    s.curvature = o.curvature;
    s.lod = o.lod;
    s.morph = !o.no_morph;
    s.soft_edge = o.edge == "soft";
    return s;
}

Result<Camera> camera_of(const FlightPose& pose, const ViewOptions& o) {
    return look_at(pose.eye, pose.look, o.fov_deg, o.width_px, o.height_px);
}

Result<FlightPath> flight_of(const TileStore& store, const ViewOptions& o, int frames) {
    if (!o.path) return default_flight(store, frames);
    auto path = read_flight_path(*o.path);
    if (!path) return path;
    return resample(*path, frames);
}

}  // namespace scree
