#include "runtime/app/scene.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <limits>

#include "common/report.h"

namespace scree {

Scene::Scene(const SqliteStore& store, const SceneOptions& options, const MemoryPlan& memory)
    : store_(store), options_(options), memory_(memory), selector_(store.dataset()) {}

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

SceneFrame Scene::think(std::span<const Camera> views) {
    const auto start = std::chrono::steady_clock::now();
    const Selection& selection = selector_.select(
        views, {options_.tau_px, options_.texture_tau_px, memory_.height_slots, memory_.texture_slots}, *pager_);
    pager_->request({selection.planned_heights, selection.planned_textures, selection.standing_in,
                     selection.standing_in_textures, selection.requests});
    SceneFrame frame;
    frame.selection = &selection;
    frame.select_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    frame.stand_ins = !selection.complete;
    return frame;
}

SceneFrame Scene::advance(std::span<const Camera> views) {
    const int uploads = pager_->take_arrivals(options_.upload_bytes_per_frame, false);
    SceneFrame frame = think(views);
    frame.uploads = uploads;
    return frame;
}

Result<SceneFrame> Scene::complete(std::span<const Camera> views, const std::function<bool()>& stop) {
    std::int64_t uploads = 0;
    for (int idle_rounds = 0; idle_rounds < 3;) {
        SceneFrame frame = think(views);
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
