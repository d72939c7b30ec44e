#include "runtime/app/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>

#include "common/process_usage.h"
#include "common/report.h"

namespace scree {
namespace {

constexpr std::uint64_t kForesightFrames = 4;

}  // namespace

Scene::Scene(const SqliteStore& store, const SceneOptions& options, const MemoryPlan& memory)
    : store_(store), options_(options), memory_(memory), selector_(store.dataset()), ahead_(store.dataset()) {}

Result<std::unique_ptr<Scene>> Scene::open(const SqliteStore& store, const SceneOptions& options) {
    auto memory = plan_memory(store.dataset(), options.budget_bytes);
    if (!memory) return memory.error();
    return std::unique_ptr<Scene>(new Scene(store, options, *memory));
}

Result<void> Scene::start(TileSink& sink) {
    auto pager =
        Pager::create(store_, {memory_, options_.loader_threads, options_.latency_ms, options_.textures}, sink);
    if (!pager) return pager.error();
    pager_ = std::move(*pager);
    pager_->on_damage = [path = store_.path()](const std::string& what) { note("{}: {}\n", path, what); };
    return {};
}

SelectionSettings Scene::selection_settings(double half_curvature, double growth_s) const {
    return {options_.tau_px,
            options_.texture_tau_px,
            memory_.height_slots,
            memory_.texture_slots,
            half_curvature,
            options_.morph,
            growth_s};
}

// What the eye will want if it goes on as it does. Every few frames: the answer hardly changes, and what is asked for
// comes after all that is wanted now.
void Scene::look_ahead(std::span<const Camera> views, const SelectionSettings& settings) {
    if (!(options_.foresight_s > 0) || views.empty()) return;
    foresight_.see(views[0], pager_->residency().now_s);
    if (frame_ % kForesightFrames != 0) return;
    const Camera camera = foresight_.ahead(views[0], options_.foresight_s);
    foreseen_ = &ahead_.select({&camera, 1}, settings, pager_->residency());
    // A future that does not fit is no help to the present.
    if (foreseen_->budget_limited) foreseen_ = nullptr;
}

SceneFrame Scene::think(std::span<const Camera> views, double growth_s) {
    const double start_s = thread_cpu_seconds();
    SceneFrame frame;
    for (const Camera& view : views)
        frame.half_curvature = std::max(frame.half_curvature, half_curvature(options_.curvature, dataset(), view));
    SelectionSettings settings = selection_settings(frame.half_curvature, growth_s);
    const Selection& now = selector_.select(views, settings, pager_->residency());
    settings.growth_s = 0;
    foreseen_ = nullptr;
    if (growth_s > 0 && !now.budget_limited) look_ahead(views, settings);
    ++frame_;
    Pager::Wishes wishes{now.planned_heights, now.planned_textures, now.standing_heights, now.standing_textures,
                         now.requests};
    if (foreseen_ != nullptr) {
        standing_heights_.assign(foreseen_->planned_heights.begin(), foreseen_->planned_heights.end());
        standing_heights_.insert(standing_heights_.end(), now.standing_heights.begin(), now.standing_heights.end());
        standing_textures_.assign(foreseen_->planned_textures.begin(), foreseen_->planned_textures.end());
        standing_textures_.insert(standing_textures_.end(), now.standing_textures.begin(), now.standing_textures.end());
        requests_.assign(now.requests.begin(), now.requests.end());
        for (TileRequest request : foreseen_->requests) {
            request.prefetch = true;
            requests_.push_back(request);
        }
        wishes.standing_heights = standing_heights_;
        wishes.standing_textures = standing_textures_;
        wishes.requests = requests_;
    }
    pager_->request(wishes);
    frame.selection = &now;
    frame.select_ms = 1e3 * (thread_cpu_seconds() - start_s);
    frame.stand_ins = !now.complete;
    return frame;
}

SceneFrame Scene::advance(std::span<const Camera> views, double now_s) {
    pager_->advance_clock(now_s);
    const int uploads = pager_->take_arrivals(options_.upload_bytes_per_frame, false);
    SceneFrame frame = think(views, options_.growth_s);
    frame.uploads = uploads;
    return frame;
}

SceneFrame Scene::catch_up(std::span<const Camera> views, double now_s, double seconds) {
    // What comes before the first picture has nothing to grow out of: it came before time began.
    pager_->advance_clock(now_s - options_.growth_s);
    const auto start = std::chrono::steady_clock::now();
    std::int64_t uploads = 0;
    for (;;) {
        think(views, 0);
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
        if (pager_->idle() || passed.count() > seconds) break;
        uploads += pager_->take_arrivals(options_.upload_bytes_per_frame, true);
    }
    SceneFrame frame = advance(views, now_s);
    frame.uploads += uploads;
    return frame;
}

Result<SceneFrame> Scene::complete(std::span<const Camera> views, const std::function<bool()>& stop) {
    std::int64_t uploads = 0;
    for (int idle_rounds = 0; idle_rounds < 3;) {
        SceneFrame frame = think(views, 0);
        frame.uploads = uploads;
        if (!frame.stand_ins) return frame;
        if (stop && stop()) return Error{ErrorCode::interrupted, "stopped"};
        const int taken = pager_->take_arrivals(std::numeric_limits<std::int64_t>::max(), true);
        uploads += taken;
        idle_rounds = taken == 0 ? idle_rounds + 1 : 0;
    }
    return Error{ErrorCode::store, fmt::format("{}: tiles that are needed never became resident", store_.path())};
}

}  // namespace scree
