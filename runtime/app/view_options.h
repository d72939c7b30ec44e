// Options that scree-view's commands share, and how they are checked.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "common/store/sqlite_store.h"
#include "runtime/app/display.h"
#include "runtime/scene/scene.h"
#include "runtime/view/camera.h"
#include "runtime/view/flight_path.h"

namespace scree {

struct ViewOptions {
    std::string store;
    std::string size = "800x800";
    double fov_deg = 40;
    double tau_px = 1;
    double texture_tau_px = 1;
    double exaggeration = 1;
    std::string budget = "256M";
    std::string curvature_text = "auto";
    bool no_morph = false;
    int samples = 0;
    double anisotropy = 1;
    std::string sun;
    std::string edge = "soft";
    LodOptions lod_options;
    std::optional<std::string> path;
    std::string json;

    int width_px = 800, height_px = 800;
    std::int64_t budget_bytes = 0;
    Curvature curvature = Curvature::automatic;
    LodSettings lod;
    std::optional<glm::vec3> sun_direction;
};

void add_view_options(CLI::App& app, ViewOptions& options);
/// --lod, --metric, --cache, --s, --cull, --cracks: part of the above.
void add_lod_options(CLI::App& app, LodOptions& options);
/// Parses sizes; checks ranges. Errors: ErrorCode::usage.
Result<void> check_view_options(ViewOptions& options);
/// The store, its heights as high as the options want them. Errors: those of SqliteStore.
Result<std::unique_ptr<SqliteStore>> open_store(const ViewOptions& options);
/// What the options say of the picture: its size, --msaa, --anisotropy.
/// "Scree - alps", of the store's name.
std::string window_title(const ViewOptions& options);
DisplayOptions display_options(const ViewOptions& options);
/// The same of every frame: --sun, --edge.
void set_look(const ViewOptions& options, FrameSettings& settings);
/// The scene as the options want it.
SceneOptions scene_options(const ViewOptions& options);
Result<Camera> camera_of(const FlightPose& pose, const ViewOptions& options);
/// --path, or the default flight, with `frames` poses.
Result<FlightPath> flight_of(const TileStore& store, const ViewOptions& options, int frames);

}  // namespace scree
