#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/display.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/app/view_options.h"
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

Result<void> shoot(const ViewOptions& o, const std::optional<FlightPose>& asked, const std::string& out,
                   const std::string& mesh_file, const FrameSettings& debug) {
    auto store = open_store(o);
    if (!store) return store.error();
    if (wants_blocks(o)) {
        if (auto ok = refuse_with_blocks(debug.highlight != Highlight::none, "--colour"); !ok) return ok;
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
    (*display)->draw(*camera, selection.to_render(0), frame->half_curvature);
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
    std::string out, mesh, eye, look, colour;
    FrameSettings debug;
    add_view_options(app, o);
    app.add_option("-o,--output", out, "The PNG to write")->required()->type_name("FILE");
    auto* eye_option =
        app.add_option("--eye", eye, "X,Y,Z of the camera, metres in the dataset's CRS; default: an overview");
    app.add_option("--look", look, "X,Y,Z that it looks at")->needs(eye_option);
    app.add_option("--mesh", mesh, "Also write the drawn triangles as a binary PLY in the dataset's coordinates")
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
    std::optional<FlightPose> pose;
    if (!eye.empty()) {
        const auto e = parse_point(eye), l = parse_point(look);
        if (!e || !l) return report_error("scree-view shot", {ErrorCode::usage, "--eye and --look both take X,Y,Z"});
        pose = FlightPose{*e, *l};
    }
    install_interrupt_handler();
    if (auto ok = shoot(o, pose, out, mesh, debug); !ok) return report_error("scree-view shot", ok.error());
    return 0;
}

}  // namespace scree
