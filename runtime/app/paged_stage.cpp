#include "runtime/app/paged_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/report.h"
#include "runtime/app/hud_text.h"
#include "runtime/app/stage_lines.h"

namespace scree {
namespace {

/// Longest that the first picture is waited for.
constexpr double kCatchUp_s = 0.08;

/// The order in which a key goes through them.
LodMethod after(LodMethod method) {
    switch (method) {
        case LodMethod::geomip:
            return LodMethod::block_rsg;
        case LodMethod::block_rsg:
            return LodMethod::rsg;
        case LodMethod::rsg:
            return LodMethod::geomip;
    }
    return LodMethod::geomip;
}

Box box_of(const Dataset& d, TileId id, const HeightBounds& heights) {
    const Lattice& l = d.lattice;
    const LatticePoint corner = l.corner(id);
    const auto west = static_cast<double>(corner.i), north = static_cast<double>(corner.j),
               extent = static_cast<double>(l.tile_extent(id.level));
    return {{l.x_m(west), l.y_m(north + extent), d.height_m(heights.min_n)},
            {l.x_m(west + extent), l.y_m(north), d.height_m(heights.max_n)}};
}

}  // namespace

Result<std::unique_ptr<Stage>> PagedStage::create(const ViewOptions& o, std::shared_ptr<const SqliteStore> store) {
    std::unique_ptr<PagedStage> stage(new PagedStage(o));
    auto scene = stage->open_scene(std::move(store), o.lod);
    if (!scene) return scene.error();
    stage->scene_ = std::move(*scene);
    DisplayOptions shown = display_options(o);
    shown.window = true;
    shown.wait_for_refresh = true;
    auto display = Display::create(*stage->scene_, shown);
    if (!display) return display.error();
    stage->display_ = std::move(*display);
    set_look(o, stage->display_->frame_settings());
    if (auto ok = stage->scene_->start(*stage->display_); !ok) return ok.error();
    return std::unique_ptr<Stage>(std::move(stage));
}

Result<std::unique_ptr<Scene>> PagedStage::open_scene(std::shared_ptr<const SqliteStore> store,
                                                      const LodSettings& lod) {
    SceneOptions options = scene_options(options_);
    if (scene_) options.tau_px = scene_->options().tau_px;
    options.lod = lod;
    options.follow = true;
    options.on_trouble = [this](const std::string& message) {
        note("{}\n", message);
        troubles_.push_back(message);
    };
    return Scene::open(std::move(store), options);
}

StageFrame PagedStage::choose(std::span<const Camera> views, double now_s, double patience_s) {
    const bool was_complete = frame_.selection != nullptr && !frame_.stand_ins;
    frame_ = first_ ? scene_->catch_up(views, now_s, kCatchUp_s) : scene_->advance(views, now_s, patience_s);
    StageFrame chosen;
    chosen.changed = first_ || frame_.uploads > 0 || scene_->updates() != updates_ || was_complete == frame_.stand_ins;
    chosen.goes_on = frame_.selection->growing;
    chosen.expects = frame_.stand_ins || frame_.taking_over;
    chosen.half_curvature = frame_.half_curvature;
    first_ = false;
    updates_ = scene_->updates();
    loading_ = loading_ && frame_.stand_ins;
    return chosen;
}

Result<void> PagedStage::draw(const Camera& camera) {
    settings().highlight_full_px = std::max(frame_.selection->tau_effective_px, 1e-3);
    display_->draw(camera, frame_.selection->to_render(0), frame_.half_curvature);
    return {};
}

Result<RenderTarget*> PagedStage::draw_second(const Camera& camera) {
    if (!display_->has_inset() || display_->inset().width_px() != camera.width_px ||
        display_->inset().height_px() != camera.height_px)
        if (auto ok = display_->resize_inset(camera.width_px, camera.height_px); !ok) return ok.error();
    display_->draw_inset(camera, frame_.selection->to_render(1), frame_.half_curvature);
    return &display_->inset();
}

std::vector<LineSegment> PagedStage::boxes() const {
    std::vector<LineSegment> lines;
    std::set<TileId> done;  // a tile may be drawn in parts
    const Residency& residency = scene_->pager().residency();
    for (const DrawItem& item : frame_.selection->draws[0]) {
        if (!done.insert(item.tile).second) continue;
        const HeightTileHeader& header = residency.heights.headers[static_cast<std::size_t>(item.height_slot)];
        add_box(box_of(dataset(), item.tile, header.own), highlight_colour(Highlight::level, item.tile.level), lines);
    }
    return lines;
}

namespace {

// A tile counts in each view that it is drawn in, as its triangles do, and once where it is drawn in parts.
std::size_t tiles_drawn(const Selection& s) {
    if (s.draws.size() == 1) return static_cast<std::size_t>(s.nodes);
    std::size_t tiles = 0;
    for (const DrawList& view : s.draws) {
        std::set<TileId> ids;
        for (const DrawItem& item : view) ids.insert(item.tile);
        tiles += ids.size();
    }
    return tiles;
}

}  // namespace

void PagedStage::describe(HudModel& model) const {
    const Selection& s = *frame_.selection;
    model.picture.push_back({"drawn", fmt::format("{} triangles in {} tiles{}", grouped(s.triangles), tiles_drawn(s),
                                                  s.draws.size() > 1 ? ", both views" : "")});
    describe_error(model);
    std::string method(to_string(scene_->options().lod.method));
    if (scene_->mesher() != nullptr)
        method = fmt::format("{}, {:.0f} % of meshes reused", command_line_of(scene_->options().lod).substr(6),
                             100 * scene_->mesher()->counters().reused_share());
    model.picture.push_back({"method", method});
    describe_tiles(model);
    if (loading_) describe_progress(model);
    describe_legend(model);
}

void PagedStage::describe_error(HudModel& model) const {
    const Selection& s = *frame_.selection;
    const bool promised = scene_->options().lod.is_guaranteed();
    std::string error = promised ? fmt::format("within {:.2f} px", s.max_bound_px) : std::string("not promised");
    if (s.budget_limited)
        error += fmt::format(", tau {:.2f}: the budget allows {:.1f}", scene_->options().tau_px, s.tau_effective_px);
    else
        error += fmt::format(", tau {:.2f}", scene_->options().tau_px);
    model.picture.push_back({"error", error});
}

void PagedStage::describe_tiles(HudModel& model) const {
    const Pager& pager = scene_->pager();
    const Pager::Occupancy heights = pager.occupancy(TileKind::height), textures = pager.occupancy(TileKind::texture);
    const Selection& s = *frame_.selection;
    std::string tiles =
        fmt::format("{} planned, {} wanted, {} on their way", s.planned_heights.size() + s.planned_textures.size(),
                    s.requests.size(), heights.loading + textures.loading);
    if (facts().updates > 0) tiles += fmt::format(", update {}", facts().updates);
    model.picture.push_back({"tiles", tiles});
    const MemoryPlan& memory = scene_->memory();
    model.memory.push_back(slots_bar("heights", heights.resident, memory.height_slots, height_slot_cost(dataset())));
    model.memory.push_back(
        slots_bar("textures", textures.resident, memory.texture_slots, texture_slot_cost(dataset())));
}

void PagedStage::describe_progress(HudModel& model) const {
    const std::int64_t arrived = scene_->counters().tiles_paged_in - before_;
    const auto missing = static_cast<std::int64_t>(frame_.selection->requests.size());
    if (missing == 0) return;
    model.progress = {static_cast<double>(arrived) / static_cast<double>(arrived + missing),
                      fmt::format("loading tiles: {} of {}", arrived, arrived + missing)};
}

void PagedStage::describe_legend(HudModel& model) const {
    const Highlight highlight = display_->frame_settings().highlight;
    const auto add = [&](double value, std::string text) {
        model.legend.push_back({highlight_colour(highlight, value), std::move(text)});
    };
    if (highlight == Highlight::level) {
        model.legend_title = "level of the tile";
        std::set<int> levels;
        for (const DrawItem& item : frame_.selection->draws[0]) levels.insert(item.tile.level);
        for (const int level : levels) {
            const double cell_m = dataset().lattice.spacing_m * static_cast<double>(dataset().lattice.step(level));
            add(level, fmt::format("{}: {} cells", level, length_text(cell_m)));
        }
    } else if (highlight == Highlight::geomip) {
        model.legend_title = "drawn sparser than stored";
        std::set<int> strides;
        for (const DrawItem& item : frame_.selection->draws[0]) strides.insert(item.geomip);
        for (const int stride : strides)
            add(stride, stride == 0 ? "every sample" : fmt::format("1 in {}", 1 << stride));
    } else if (highlight == Highlight::error) {
        model.legend_title = "off the finest data by up to";
        for (const int quarter : {0, 1, 2, 3, 4})
            add(quarter / 4.0, fmt::format("{:.2f} px", quarter / 4.0 * display_->frame_settings().highlight_full_px));
    }
}

StageFacts PagedStage::facts() const {
    StageFacts facts{std::string(to_string(scene_->options().lod.method)), dataset().exaggeration, 0, 0,
                     updates_ - exaggerated_};
    if (frame_.selection == nullptr) return facts;
    facts.tau_effective_px = frame_.selection->tau_effective_px;
    facts.triangles = frame_.selection->triangles;
    return facts;
}

// As asked for on the command line, where the method is the one that was asked for; else its defaults.
LodSettings PagedStage::settings_of(LodMethod method) const {
    LodSettings settings = options_.lod;
    if (settings.method == method) return settings;
    settings = {};
    settings.method = method;
    return settings;
}

Result<std::string> PagedStage::next_method() {
    const LodSettings lod = settings_of(after(scene_->options().lod.method));
    auto next = open_scene(scene_->shared_store(), lod);
    if (!next) return fmt::format("{} stays: {}", to_string(scene_->options().lod.method), next.error().message);
    if (auto ok = change_to(std::move(*next)); !ok) return ok.error();
    return fmt::format("Method: {}", command_line_of(lod).substr(6));
}

Result<void> PagedStage::change_to(std::unique_ptr<Scene> scene) {
    frame_ = {};
    std::swap(scene_, scene);
    const Result<void> changed = display_->change_to(*scene_);
    scene.reset();
    if (!changed) return changed;
    first_ = true;
    exaggerated_ = 0;
    begin_loading();
    return scene_->start(*display_);
}

void PagedStage::begin_loading() {
    loading_ = true;
    before_ = scene_->counters().tiles_paged_in;
    updates_ = scene_->updates();
}

Result<std::string> PagedStage::exaggerate(double factor) {
    const double before = dataset().exaggeration;
    if (auto ok = scene_->set_exaggeration(factor); !ok) {
        if (dataset().exaggeration != before) return ok.error();
        return fmt::format("Heights stay as they are: {}", ok.error().message);
    }
    ++exaggerated_;
    first_ = true;
    begin_loading();
    return fmt::format("Heights x {:g}", factor);
}

}  // namespace scree
