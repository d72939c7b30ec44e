#include "runtime/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <thread>

#include "common/process_usage.h"
#include "common/report.h"
#include "runtime/lod/page_measure.h"
#include "runtime/view/frustum.h"

namespace scree {
namespace {

constexpr std::uint64_t kForesightFrames = 4;
constexpr std::chrono::milliseconds kLook{1};  // between looks for arrivals

// All that a tile may fill, as the eye sees it, whether it is in memory or not.
Box box_of(const Dataset& d, TileId id, glm::dvec3 eye, double half_curvature) {
    const Lattice& l = d.lattice;
    const LatticePoint corner = l.corner(id);
    const auto west = static_cast<double>(corner.i), north = static_cast<double>(corner.j),
               extent = static_cast<double>(l.tile_extent(id.level));
    Box box{{l.x_m(west), l.y_m(north + extent), d.min_height_m}, {l.x_m(west + extent), l.y_m(north), d.max_height_m}};
    const double x = std::max(std::abs(box.low.x - eye.x), std::abs(box.high.x - eye.x)),
                 y = std::max(std::abs(box.low.y - eye.y), std::abs(box.high.y - eye.y));
    box.low.z -= (x * x + y * y) * half_curvature;
    return box;
}

constexpr int kOpenings = 10;             // of a store that is updated again and again
constexpr double kLongestTakeover_s = 2;  // with its roots there

// Options may be changed between frames: what is no length stands for the least.
double length_px(double px) { return px > 0 ? px : 0; }
double texel_px(double px) { return px > 0 ? px : 1.0 / 1024; }

constexpr double kMotionFades_s = 0.4;
constexpr double kStill_m = 1e-3;

/// Grows whenever a tile comes, goes or turns out to be damaged.
std::int64_t changes(const PagerCounters& c) { return c.tiles_paged_in + c.tiles_paged_out + c.damaged_tiles; }

// No more of the budget than a sixteenth goes to soft ends: coarser ones leave room for tiles.
constexpr std::int64_t kEdgeShare = 16;

// 0: none.
std::int64_t edge_cells(const SceneOptions& options) {
    if (!options.soft_edge || !options.textures) return 0;
    return EdgeField::cells_in(options.budget_bytes / kEdgeShare, options.follow);
}

bool same_view(const Camera& a, const Camera& b) {
    return a.eye == b.eye && a.forward == b.forward && a.up == b.up && a.fov_deg == b.fov_deg &&
           a.width_px == b.width_px && a.height_px == b.height_px && a.near_m == b.near_m;
}

}  // namespace

class Scene::Sink final : public TileSink {
public:
    Sink(TileSink& next, Scene& scene) : next_(next), scene_(scene) {}
    Result<void> renew(const Dataset& dataset, const MemoryPlan& plan) override { return next_.renew(dataset, plan); }
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override {
        next_.put_height(slot, vertices);
    }
    void put_costs(std::int32_t slot, std::span<const SlotVertex> vertices,
                   std::span<const VertexCost> costs) override {
        scene_.mesher_->put(slot, vertices, costs);
    }
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override {
        next_.put_texture(slot, chain);
    }

private:
    TileSink& next_;
    Scene& scene_;
};

Scene::Scene(std::shared_ptr<const SqliteStore> store, const SceneOptions& options, const MemoryPlan& memory)
    : store_(std::move(store)), options_(options), memory_(memory), peak_resident_bytes_(memory.resident_bytes) {
    make_selectors();
    make_mesher();
    make_edge_field();
}

Scene::~Scene() = default;

Result<std::unique_ptr<Scene>> Scene::open(std::shared_ptr<const SqliteStore> store, const SceneOptions& options) {
    if (auto ok = expect_built_in(options.lod); !ok) return ok.error();
    if (options.lod.cracks == CrackFix::dike)
        return Error{ErrorCode::usage, fmt::format("{} draws no tiles: shot, fly, audit and the window show it",
                                                   command_line_of(options.lod))};
    for (const auto& [px, name] :
         {std::pair(options.tau_px, "tau_px"), std::pair(options.texture_tau_px, "texture_tau_px")})
        if (!(px >= 0))
            return Error{ErrorCode::usage,
                         fmt::format("{} = {}: is no length, so nothing could be promised", name, px)};
    auto memory = plan_of(store->dataset(), options);
    if (!memory) return memory.error();
    return std::unique_ptr<Scene>(new Scene(std::move(store), options, *memory));
}

void Scene::make_selectors() {
    forget_selections();
    selector_ = std::make_unique<Selector>(dataset());
    ahead_ = std::make_unique<Selector>(dataset());
}

MoreMemory Scene::more_memory(const Dataset& dataset, const SceneOptions& options) {
    MoreMemory more;
    if (options.lod.method != LodMethod::geomip)
        more = {PageMesher::slot_cost(dataset, options.lod), PageMesher::fixed_cost(dataset)};
    if (options.lod.metric == ErrorMetric::deboer) more.per_height_slot = Pager::corrections_cost();
    if (const std::int64_t cells = edge_cells(options); cells > 0)
        more.fixed += EdgeField::bytes(EdgeField::shape_of(dataset, cells), options.follow);
    return more;
}

Result<MemoryPlan> Scene::plan_of(const Dataset& dataset, const SceneOptions& options) {
    return plan_memory(dataset, options.budget_bytes, 2, more_memory(dataset, options));
}

std::int64_t Scene::tile_bytes(TileKind kind) const {
    if (!pager_) return 0;
    const std::int64_t each = kind == TileKind::height
                                  ? height_slot_cost(dataset()) + more_memory(dataset(), options_).per_height_slot
                                  : texture_slot_cost(dataset());
    return pager_->slots_in_use(kind) * each;
}

void Scene::make_mesher() {
    if (options_.lod.method == LodMethod::geomip) return;
    if (mesher_)
        mesher_->renew(dataset(), memory_.height_slots);
    else
        mesher_ = std::make_unique<PageMesher>(dataset(), options_.lod, memory_.height_slots);
}

void Scene::make_edge_field() {
    if (const std::int64_t cells = edge_cells(options_); cells > 0)
        edge_field_ = EdgeField::read(*store_, edge_band_m(dataset().lattice), cells);
}

// Thins what was selected, where the method does.
void Scene::mesh(std::span<const Camera> views, double half_curvature, const Residency& residency,
                 Selection& selection) {
    if (mesher_) mesher_->mesh(views, {length_px(options_.tau_px), half_curvature}, residency, selection);
}

void Scene::forget_selections() {
    last_ = {};
    foreseen_ = nullptr;
    foreseen_requests_.clear();
}

Result<void> Scene::start(TileSink& sink) {
    sink_ = &sink;
    if (mesher_) {
        mesher_sink_ = std::make_unique<Sink>(sink, *this);
        sink_ = mesher_sink_.get();
    }
    if (auto ok = make_pager(); !ok) return ok;
    begin_watch();
    return {};
}

void Scene::begin_watch() {
    if (options_.follow)
        watch_ = std::make_unique<StoreWatch>(store_,
                                              StoreReading{std::max(options_.loader_threads, 1), edge_cells(options_)});
}

void Scene::tell(const std::string& message) const {
    if (options_.on_trouble)
        options_.on_trouble(message);
    else
        note("{}\n", message);
}

// A store is drawn as it was at one moment: where an update comes in between, it is opened once more.
Result<void> Scene::make_pager() {
    for (int tries = 1;; ++tries) {
        PagerOptions pager_options{memory_, options_.loader_threads, options_.latency_ms, options_.textures, {}};
        pager_options.corrections = options_.lod.metric == ErrorMetric::deboer;
        if (mesher_)
            pager_options.measure =
                std::make_shared<PageMeasure>(dataset().lattice.tile_cells_log2, options_.lod.metric);
        auto pager = Pager::create(store_, pager_options, *sink_);
        if (pager) {
            pager_ = std::move(*pager);
            pager_->on_damage = [this, path = store_->path()](const std::string& what) {
                tell(fmt::format("{}: {}", path, what));
            };
            return {};
        }
        if (!options_.follow || tries == kOpenings || !store_->has_changed()) return pager.error();
        auto opened = SqliteStore::open(store_->path(), store_->open_options());
        if (!opened) return opened.error();
        if (auto ok = use_store(std::move(*opened)); !ok) return ok;
    }
}

// Divides memory anew. No tile is resident.
Result<void> Scene::use_store(std::shared_ptr<const SqliteStore> store) {
    if (auto ok = expect_same_place(*store); !ok) return ok;
    auto plan = plan_of(store->dataset(), options_);
    if (!plan) return plan.error();
    store_ = std::move(store);
    memory_ = *plan;
    peak_resident_bytes_ = std::max(peak_resident_bytes_, memory_.resident_bytes);
    make_selectors();
    make_mesher();
    make_edge_field();
    return sink_ != nullptr ? sink_->renew(dataset(), memory_) : Result<void>{};
}

// Eye and path are in the coordinates of the store that was opened first.
Result<void> Scene::expect_same_place(const SqliteStore& next) const {
    const Dataset &a = dataset(), &b = next.dataset();
    if (a.lattice == b.lattice && a.crs == b.crs && a.vertical_datum == b.vertical_datum) return {};
    return Error{ErrorCode::store,
                 fmt::format("{}: another store has taken its place, with another {}; start again to see it",
                             store_->path(), a.lattice == b.lattice ? "coordinate system" : "lattice")};
}

// Slots hold integers of the one quantum, and a fresh start would divide memory as it is divided, or has room for all
// tiles, as there is here: then the settled picture is that of a fresh start.
bool Scene::fits_in_place(const Dataset& next) const {
    const Dataset& now = dataset();
    if (next.height_offset_m != now.height_offset_m || next.height_quantum_m != now.height_quantum_m ||
        next.texture_size_log2 != now.texture_size_log2)
        return false;
    const auto plan = plan_of(next, options_);
    if (!plan) return false;
    if (plan->height_slots == memory_.height_slots && plan->texture_slots == memory_.texture_slots) return true;
    const auto holds_all = [&](const MemoryPlan& m) {
        return m.height_slots >= next.height_tiles && m.texture_slots >= next.texture_tiles;
    };
    return holds_all(*plan) && holds_all(memory_);
}

Result<void> Scene::follow() {
    if (!watch_) return {};
    if (auto trouble = watch_->take_trouble()) {
        trouble_ = std::move(*trouble);
        tell(fmt::format("{}; drawing what was there before", trouble_));
    }
    auto opened = watch_->take();
    if (!opened) return {};
    trouble_.clear();
    return take_up(std::move(*opened));
}

Result<void> Scene::take_up(OpenedStore opened) {
    if (auto ok = expect_same_place(*opened.store); !ok) return ok;
    forget_selections();
    if (!fits_in_place(opened.store->dataset())) return start_over(std::move(opened.store));
    coming_ = opened.store;
    coming_edge_field_ = std::move(opened.edge_field);
    coming_selector_ = std::make_unique<Selector>(coming_->dataset());
    roots_since_s_.reset();
    pager_->begin_takeover({coming_, std::move(opened.readers)});
    return {};
}

Result<void> Scene::start_over(std::shared_ptr<const SqliteStore> store) {
    earlier_ = counters();
    for (const TileKind kind : {TileKind::height, TileKind::texture})
        earlier_loads_[static_cast<std::size_t>(kind)] = loader_counters(kind);
    pager_.reset();  // never the memory of two
    coming_.reset();
    coming_edge_field_.reset();
    coming_selector_.reset();
    if (auto ok = use_store(std::move(store)); !ok) return ok;
    if (auto ok = make_pager(); !ok) return ok;
    ++updates_;
    return {};
}

Result<void> Scene::set_exaggeration(double exaggeration) {
    if (exaggeration == dataset().exaggeration) return {};
    auto opened = SqliteStore::open(store_->path(), {exaggeration});
    if (!opened) return opened.error();
    if (auto ok = expect_same_place(**opened); !ok) return ok;
    if (!pager_) return use_store(std::move(*opened));
    watch_.reset();  // what it may have opened is of the old heights
    if (auto ok = start_over(std::move(*opened)); !ok) return ok;
    begin_watch();
    return {};
}

void Scene::switch_over() {
    pager_->switch_over();
    store_ = std::move(coming_);
    edge_field_ = std::move(coming_edge_field_);
    selector_ = std::move(coming_selector_);
    ahead_ = std::make_unique<Selector>(dataset());
    forget_selections();
    ++updates_;
    // Nothing to divide anew, so nothing that could fail.
    [[maybe_unused]] const auto ok = sink_->renew(dataset(), memory_);
    assert(ok);
}

PagerCounters Scene::counters() const {
    PagerCounters c = earlier_;
    if (!pager_) return c;
    const PagerCounters& now = pager_->counters();
    c.tiles_paged_in += now.tiles_paged_in;
    c.tiles_paged_out += now.tiles_paged_out;
    c.bytes_read += now.bytes_read;
    c.damaged_tiles += now.damaged_tiles;
    c.refused += now.refused;
    c.upload_bytes += now.upload_bytes;
    c.prefetched += now.prefetched;
    return c;
}

LoaderCounters Scene::loader_counters(TileKind kind) const {
    LoaderCounters c = earlier_loads_[static_cast<std::size_t>(kind)];
    if (!pager_) return c;
    const LoaderCounters now = pager_->loader_counters(kind);
    c.tiles += now.tiles;
    c.cpu_seconds += now.cpu_seconds;
    c.latency_seconds += now.latency_seconds;
    return c;
}

SelectionSettings Scene::selection_settings(double half_curvature, double growth_s) const {
    const bool meshed = mesher_ != nullptr;
    const double tau_px = length_px(options_.tau_px);
    return {meshed ? tau_px * kCutShare : tau_px,
            texel_px(options_.texture_tau_px),
            memory_.height_slots,
            memory_.texture_slots,
            half_curvature,
            options_.morph && !meshed,
            growth_s,
            moved_m_,
            options_.lod.metric,
            options_.lod.culling,
            meshed};
}

void Scene::note_motion(std::span<const Camera> views, double now_s) {
    if (views.empty()) return;
    const double moved_m = last_views_.empty() ? 0 : glm::length(views[0].eye - last_eye_);
    moved_m_ = std::max(moved_m, moved_m_ * std::exp(-(now_s - last_now_s_) / kMotionFades_s));
    if (moved_m_ < kStill_m) moved_m_ = 0;
    last_eye_ = views[0].eye;
    last_now_s_ = now_s;
}

// What the eye will want if it goes on as it does. Chosen every few frames, because the answer hardly changes; asked
// for in all of them, because what is not is forgotten. True when it was chosen now.
bool Scene::look_ahead(std::span<const Camera> views, SelectionSettings settings) {
    foresight_.see(views[0], pager_->residency().now_s);
    if (frame_ % kForesightFrames != 0) return false;
    foreseen_ = nullptr;
    const Camera wide = foresight_.ahead(views[0], options_.foresight_s);
    Camera ahead = wide;
    ahead.fov_deg = views[0].fov_deg;
    // The wider view has the same pixels for more of the world; wanted is what will be wanted of the present view.
    const double zoom = wide.focal_px() / ahead.focal_px();
    settings.tau_px *= zoom * wide.off_axis_factor() / ahead.off_axis_factor();
    settings.texture_tau_px *= zoom;
    settings.plan_only = true;
    const Selection& future = ahead_->select({&wide, 1}, settings, pager_->residency());
    // A future that does not fit is no help to the present.
    if (future.budget_limited) return false;
    foreseen_ = &future;
    const Frustum view(ahead);
    foreseen_requests_.assign(future.requests.begin(), future.requests.end());
    for (TileRequest& request : foreseen_requests_) {
        request.prefetch = true;
        // What only a turn of the head would show is wanted after all else. Nothing of it is there yet, so by its error
        // it would always come first.
        if (!view.may_see(box_of(dataset(), request.id, ahead.eye, settings.half_curvature)))
            request.priority /= 1 + request.priority;
    }
    std::stable_sort(foreseen_requests_.begin(), foreseen_requests_.end(),
                     [](const TileRequest& a, const TileRequest& b) { return a.priority > b.priority; });
    return true;
}

// The wishes of this frame with those of the last look ahead behind them. Its slots are those of `fresh` tables alone.
Pager::Wishes Scene::with_foreseen(const Pager::Wishes& now, bool fresh) {
    Pager::Wishes wishes = now;
    requests_.assign(now.requests.begin(), now.requests.end());
    requests_.insert(requests_.end(), foreseen_requests_.begin(), foreseen_requests_.end());
    wishes.requests = requests_;
    if (!fresh) return wishes;
    standing_heights_.assign(foreseen_->planned_heights.begin(), foreseen_->planned_heights.end());
    standing_heights_.insert(standing_heights_.end(), now.standing_heights.begin(), now.standing_heights.end());
    standing_textures_.assign(foreseen_->planned_textures.begin(), foreseen_->planned_textures.end());
    standing_textures_.insert(standing_textures_.end(), now.standing_textures.begin(), now.standing_textures.end());
    wishes.standing_heights = standing_heights_;
    wishes.standing_textures = standing_textures_;
    return wishes;
}

// Selection is a pure function: from the same it chooses the same. Only where nothing grows and nothing is on its way:
// else the clock and the requests count as well.
bool Scene::nothing_changed(std::span<const Camera> views, const SelectionSettings& settings) const {
    if (last_.selection == nullptr || last_.stand_ins || last_.selection->growing || !pager_->idle()) return false;
    if (!foreseen_requests_.empty() || changes(pager_->counters()) != last_changes_) return false;
    return settings == last_settings_ &&
           std::equal(views.begin(), views.end(), last_views_.begin(), last_views_.end(), same_view);
}

double Scene::curvature_of(const Dataset& dataset, std::span<const Camera> views) const {
    double most = 0;
    for (const Camera& view : views) most = std::max(most, half_curvature(options_.curvature, dataset, view));
    return most;
}

// Both states of the store plan with half of the slots: what does not fit is somewhat coarser for a moment, and neither
// is left without. True: the new one is as good as the old, and has taken its place.
bool Scene::think_of_both(std::span<const Camera> views, double growth_s, SceneFrame& frame) {
    frame.half_curvature = curvature_of(dataset(), views);
    SelectionSettings settings = selection_settings(frame.half_curvature, growth_s);
    settings.height_slots /= 2;
    settings.texture_slots /= 2;
    Selection& shown = selector_->select(views, settings, pager_->residency());
    const double shown_bound_px = shown.max_bound_px;  // of tiles: the other's meshes are not made yet
    mesh(views, settings.half_curvature, pager_->residency(), shown);
    Pager::Wishes coming_wishes;
    if (pager_->roots_ready()) {
        if (!roots_since_s_) roots_since_s_ = pager_->residency().now_s;
        settings.growth_s = 0;
        settings.half_curvature = curvature_of(coming_->dataset(), views);
        const Selection& coming = coming_selector_->select(views, settings, pager_->coming());
        const bool as_good = coming.max_bound_px <= shown_bound_px && coming.requests.size() <= shown.requests.size();
        // An eye that moves fast may never see all of it.
        const bool late = !pager_->stale() && pager_->residency().now_s > *roots_since_s_ + kLongestTakeover_s;
        if (coming.complete || as_good || late) {
            switch_over();
            return true;
        }
        coming_wishes = {coming.planned_heights, coming.planned_textures, coming.standing_heights,
                         coming.standing_textures, coming.requests};
    }
    pager_->request(
        {shown.planned_heights, shown.planned_textures, shown.standing_heights, shown.standing_textures, {}},
        coming_wishes);
    frame.selection = &shown;
    frame.stand_ins = !shown.complete;
    frame.taking_over = true;
    return false;
}

SceneFrame Scene::think(std::span<const Camera> views, double growth_s) {
    const double start_s = thread_cpu_seconds();
    SceneFrame frame;
    if (pager_->taking_over() && !think_of_both(views, growth_s, frame)) {
        frame.select_ms = 1e3 * (thread_cpu_seconds() - start_s);
        return frame;
    }
    frame.half_curvature = curvature_of(dataset(), views);
    SelectionSettings settings = selection_settings(frame.half_curvature, growth_s);
    if (nothing_changed(views, settings)) {
        frame = last_;
        frame.uploads = 0;
        frame.reused = true;
        frame.select_ms = 1e3 * (thread_cpu_seconds() - start_s);
        return frame;
    }
    last_settings_ = settings;
    Selection& now = selector_->select(views, settings, pager_->residency());
    mesh(views, settings.half_curvature, pager_->residency(), now);
    settings.growth_s = 0;
    bool fresh = false;
    if (growth_s > 0 && options_.foresight_s > 0 && !views.empty() && !now.budget_limited)
        fresh = look_ahead(views, settings);
    else
        foreseen_ = nullptr;
    ++frame_;
    const Pager::Wishes wishes{now.planned_heights, now.planned_textures, now.standing_heights, now.standing_textures,
                               now.requests};
    pager_->request(foreseen_ != nullptr ? with_foreseen(wishes, fresh) : wishes);
    frame.selection = &now;
    frame.select_ms = 1e3 * (thread_cpu_seconds() - start_s);
    frame.stand_ins = !now.complete;
    last_ = frame;
    last_views_.assign(views.begin(), views.end());
    last_changes_ = changes(pager_->counters());
    return frame;
}

// Takes what arrives and chooses anew, until nothing is missing or so much time has passed.
SceneFrame Scene::think_again(std::span<const Camera> views, double growth_s, SceneFrame frame, double seconds) {
    const auto start = std::chrono::steady_clock::now();
    // A frame that looks again takes as much again at most, so that none hitches; the first pictures take all.
    std::int64_t left_bytes = growth_s > 0 ? options_.upload_bytes_per_frame : std::numeric_limits<std::int64_t>::max();
    while (frame.stand_ins && !frame.taking_over && !pager_->idle() && left_bytes > 0 &&
           std::chrono::steady_clock::now() - start < std::chrono::duration<double>(seconds)) {
        // To wait for an arrival would be to wait as long as a slow disk likes.
        std::this_thread::sleep_for(kLook);
        const std::int64_t before_bytes = pager_->counters().upload_bytes;
        const int taken = pager_->take_arrivals(std::min(left_bytes, options_.upload_bytes_per_frame), false);
        if (taken == 0) continue;
        left_bytes -= pager_->counters().upload_bytes - before_bytes;
        const std::int64_t uploads = frame.uploads + taken;
        const double before_ms = frame.select_ms;
        frame = think(views, growth_s);
        frame.uploads = uploads;
        frame.select_ms += before_ms;
    }
    return frame;
}

SceneFrame Scene::advance(std::span<const Camera> views, double now_s, double patience_s) {
    pager_->advance_clock(now_s);
    note_motion(views, now_s);
    const int uploads = pager_->take_arrivals(options_.upload_bytes_per_frame, false);
    SceneFrame frame = think(views, options_.growth_s);
    frame.uploads = uploads;
    return think_again(views, options_.growth_s, frame, patience_s);
}

SceneFrame Scene::catch_up(std::span<const Camera> views, double now_s, double seconds) {
    // It came so long ago that even the deepest page, which waits for all above it, has grown.
    pager_->advance_clock(now_s - (kMaxLevel + 2) * options_.growth_s);
    const SceneFrame first = think_again(views, 0, think(views, 0), seconds);
    SceneFrame frame = advance(views, now_s);
    frame.uploads += first.uploads;
    return frame;
}

// A step towards what an update has made of the store, while nothing is drawn. True: it has been taken up.
Result<bool> Scene::step_to_update() {
    if (!watch_) return Error{ErrorCode::io, fmt::format("{}: was changed while it was drawn", store_->path())};
    const std::int64_t before = updates_;
    if (auto ok = follow(); !ok) return ok.error();
    if (updates_ != before) return true;
    if (pager_->stale()) {
        if (!trouble_.empty()) return Error{ErrorCode::store, trouble_};
        if (pager_->gave_up())
            return Error{ErrorCode::store, fmt::format("{}: an update left a damaged root tile", store_->path())};
        pager_->take_arrivals(std::numeric_limits<std::int64_t>::max(), false);
        std::this_thread::sleep_for(kLook);
        return false;
    }
    pager_->request({}, {});
    pager_->take_arrivals(std::numeric_limits<std::int64_t>::max(), true);
    if (!pager_->roots_ready()) return false;
    switch_over();
    return true;
}

Result<SceneFrame> Scene::complete(std::span<const Camera> views, const std::function<bool()>& stop) {
    // A tile that has just been evicted for another is refused for so many frames (TileCache::kWantedBack).
    constexpr int kMostIdleRounds = static_cast<int>(TileCache::kIdleFrames) + 3;
    std::int64_t uploads = 0;
    for (int idle_rounds = 0; idle_rounds < kMostIdleRounds;) {
        while (pager_->taking_over() || pager_->stale()) {
            if (stop && stop()) return Error{ErrorCode::interrupted, "stopped"};
            auto taken_up = step_to_update();
            if (!taken_up) return taken_up.error();
            if (*taken_up) idle_rounds = 0;
        }
        SceneFrame frame = think(views, 0);
        frame.uploads = uploads;
        if (!frame.stand_ins) return frame;
        if (stop && stop()) return Error{ErrorCode::interrupted, "stopped"};
        const int taken = pager_->take_arrivals(std::numeric_limits<std::int64_t>::max(), true);
        uploads += taken;
        idle_rounds = taken == 0 ? idle_rounds + 1 : 0;
    }
    return Error{ErrorCode::store, fmt::format("{}: tiles that are needed never became resident", store_->path())};
}

}  // namespace scree
