#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/display.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/app/stage_lines.h"
#include "runtime/app/view_options.h"
#include "runtime/render/line_renderer.h"
#include "runtime/render/png.h"

namespace scree {
namespace {

std::optional<glm::dvec3> parse_point(const std::string& text) {
    glm::dvec3 p;
    const char *at = text.data(), *end = at + text.size();
    for (int k = 0; k < 3; ++k) {
        const auto [next, error] = std::from_chars(at, end, p[k]);
        if (error != std::errc{} || (k < 2 ? next == end || *next != ',' : next != end)) return std::nullopt;
        at = next + 1;
    }
    return p;
}

// Leaves `pose` alone where neither is given.
Result<void> parse_pose(const std::string& eye, const std::string& look, const std::string& options,
                        std::optional<FlightPose>& pose) {
    if (eye.empty()) return {};
    const auto e = parse_point(eye), l = parse_point(look);
    if (!e || !l) return Error{ErrorCode::usage, fmt::format("{} both take X,Y,Z", options)};
    pose = FlightPose{*e, *l};
    return {};
}

struct ShotOptions {
    std::optional<FlightPose> pose;      ///< none: an overview
    std::optional<FlightPose> onlooker;  ///< who looks at what is drawn for that pose
    std::string out;                     ///< PNG
    std::string mesh_file;               ///< PLY; empty: none
    FrameSettings debug;
};

/// Of the longer side: how far the frustum that an onlooker sees is drawn.
constexpr double kFrustumShare = 0.5;
constexpr Rgba kFrustum{255, 214, 90, 255};
constexpr double kLine_px = 2, kHiddenShare = 0.35;

// What was selected for one camera, from where another stands, with the frustum of the first.
Result<void> draw_for_onlooker(const ViewOptions& o, const FlightPose& onlooker, const Camera& camera,
                               const SceneFrame& frame, const Dataset& dataset, Display& display) {
    auto from = camera_of(onlooker, o);
    if (!from) return from.error();
    auto lines = LineRenderer::create();
    if (!lines) return lines.error();
    display.draw(*from, frame.selection->to_render(0), frame.half_curvature);
    const Lattice& l = dataset.lattice;
    std::vector<LineSegment> edges;
    add_frustum(camera, kFrustumShare * static_cast<double>(std::max(l.cells_x, l.cells_y)) * l.spacing_m, kFrustum,
                edges);
    (*lines)->draw(*from, lowered(edges, from->eye, frame.half_curvature), kLine_px, kHiddenShare, display.target());
    return {};
}

Result<void> shoot(const ViewOptions& o, const ShotOptions& shot) {
    const auto& [asked, onlooker, out, mesh_file, debug] = shot;
    auto store = open_store(o);
    if (!store) return store.error();
    if (wants_blocks(o)) {
        if (auto ok = refuse_with_blocks(debug.highlight != Highlight::none, "--colour"); !ok) return ok;
        if (auto ok = refuse_with_blocks(onlooker.has_value(), "--seen-from"); !ok) return ok;
        return shoot_blocks(o, **store, {asked, out, mesh_file, debug});
    }
    SceneOptions options = scene_options(o);
    options.follow = true;  // a picture of one state, whatever happens meanwhile
    auto scene = Scene::open(std::move(*store), options);
    if (!scene) return scene.error();
    DisplayOptions shown = display_options(o);
    shown.keep_heights = !mesh_file.empty();
    auto display = Display::create(**scene, shown);
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    (*display)->frame_settings().wireframe = debug.wireframe;
    (*display)->frame_settings().highlight = debug.highlight;
    (*display)->frame_settings().highlight_full_px = o.tau_px > 0 ? o.tau_px : 1;
    (*display)->frame_settings().magenta_background = debug.magenta_background;
    if (auto ok = (*scene)->start(**display); !ok) return ok;
    const FlightPose pose =
        asked.value_or(overview((*scene)->dataset(), o.fov_deg, static_cast<double>(o.width_px) / o.height_px));
    auto camera = camera_of(pose, o);
    if (!camera) return camera.error();
    auto frame = (*scene)->complete({&*camera, 1}, [] { return interrupt_flag().load(); });
    if (!frame) return frame.error();
    const Selection& selection = *frame->selection;
    if (!onlooker) {
        (*display)->draw(*camera, selection.to_render(0), frame->half_curvature);
    } else if (auto ok = draw_for_onlooker(o, *onlooker, *camera, *frame, (*scene)->dataset(), **display); !ok) {
        return ok;
    }
    const auto pixels = (*display)->target().read_pixels();
    if (auto ok = write_png(out, o.width_px, o.height_px, pixels); !ok) return ok;
    if (!mesh_file.empty()) {
        const Dataset& d = (*scene)->dataset();
        const TilePatterns patterns(d.lattice.tile_cells_log2);
        const DrawnMesh mesh = drawn_mesh(d, patterns, selection.draws[0], *(*display)->arena(), (*scene)->meshes());
        if (auto ok = write_ply(mesh_file, d, mesh, camera->eye, frame->half_curvature); !ok) return ok;
    }
    if (o.json != "-")
        fmt::print("{}: {} triangles in {} tiles, at most {:.3g} px from the finest surface{}\n", out,
                   selection.triangles, selection.nodes, selection.max_bound_px,
                   selection.budget_limited ? " (limited by the budget)" : "");
    if (o.json.empty()) return {};
    const nlohmann::ordered_json report = {{"triangles", selection.triangles},
                                           {"tiles_drawn", selection.nodes},
                                           {"max_bound_px", selection.max_bound_px},
                                           {"budget_limited", selection.budget_limited},
                                           {"tau_effective_px", selection.tau_effective_px},
                                           {"curvature", frame->half_curvature > 0},
                                           {"eye", {pose.eye.x, pose.eye.y, pose.eye.z}},
                                           {"look", {pose.look.x, pose.look.y, pose.look.z}}};
    return write_text(o.json, report.dump(2) + "\n");
}

}  // namespace

int run_shot(int argc, char** argv) {
    CLI::App app{"Draws one picture, complete, without a window.", "scree-view shot"};
    ViewOptions o;
    ShotOptions shot;
    std::string eye, look, from, from_look, colour;
    FrameSettings& debug = shot.debug;
    add_view_options(app, o);
    app.add_option("-o,--output", shot.out, "The PNG to write")->required()->type_name("FILE");
    auto* eye_option =
        app.add_option("--eye", eye, "X,Y,Z of the camera, metres in the dataset's CRS; default: an overview");
    app.add_option("--look", look, "X,Y,Z that it looks at")->needs(eye_option);
    auto* from_option =
        app.add_option("--seen-from", from, "X,Y,Z of an onlooker: what is drawn for --eye, seen from there");
    app.add_option("--seen-look", from_look, "X,Y,Z that the onlooker looks at")->needs(from_option);
    app.add_option("--mesh", shot.mesh_file,
                   "Also write the drawn triangles as a binary PLY in the dataset's coordinates")
        ->type_name("FILE");
    app.add_flag("--wireframe", debug.wireframe, "Draw edges only");
    app.add_option("--colour", colour,
                   "Tint each tile by its level, its geomip level, or its error as a share of --tau")
        ->type_name("level|geomip|error")
        ->check(CLI::IsMember({"level", "geomip", "error"}));
    app.add_flag("--magenta", debug.magenta_background, "No sky: what is not terrain is pure magenta");
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view shot", ok.error());
    debug.highlight = highlight_from(colour).value_or(Highlight::none);
    if (auto ok = parse_pose(eye, look, "--eye and --look", shot.pose); !ok)
        return report_error("scree-view shot", ok.error());
    if (auto ok = parse_pose(from, from_look, "--seen-from and --seen-look", shot.onlooker); !ok)
        return report_error("scree-view shot", ok.error());
    install_interrupt_handler();
    if (auto ok = shoot(o, shot); !ok) return report_error("scree-view shot", ok.error());
    return 0;
}

}  // namespace scree
