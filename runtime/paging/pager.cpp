#include "runtime/paging/pager.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>

#include "common/mesh/vertex_slot.h"

namespace scree {
namespace {

constexpr double kFromTheStart = -std::numeric_limits<double>::infinity();

constexpr std::int64_t kNobodys = -1;  // generation: no job counts

constexpr std::size_t kUsualRequests = 1024;  // of a frame; more are taken, too

const char* name_of(TileKind kind) { return kind == TileKind::height ? "height" : "texture"; }

std::string with_tile(const LoadedTile& tile) {
    const TileId id = tile.job.id;
    return fmt::format("{} tile {}/{}/{}: {}", name_of(tile.job.kind), id.level, id.x, id.y, tile.error);
}

std::int64_t sink_bytes(const LoadedTile& tile) {
    return static_cast<std::int64_t>(tile.job.kind == TileKind::height ? tile.vertices.size() * sizeof(SlotVertex)
                                                                       : tile.blocks.size());
}

}  // namespace

Pager::Tables::Tables(const PagerOptions& options, const Lattice& lattice, TileCache::Slots slots)
    : heights(options.memory.height_slots, lattice, residency.heights, slots),
      textures(options.textures ? options.memory.texture_slots : 0, lattice, residency.textures, slots) {
    residency.has_textures = options.textures;
    if (options.corrections) residency.heights.corrections.resize(static_cast<std::size_t>(heights.capacity()));
}

bool Pager::Tables::adds_up() const {
    return heights.in_use() == heights.resident() + heights.loading() &&
           textures.in_use() == textures.resident() + textures.loading();
}

Pager::Pager(std::shared_ptr<const TileStore> store, const PagerOptions& options, TileSink& sink)
    : store_(std::move(store)),
      options_(options),
      sink_(sink),
      shown_(std::make_unique<Tables>(options, store_->dataset().lattice, TileCache::Slots::all)),
      coming_(std::make_unique<Tables>(options, store_->dataset().lattice, TileCache::Slots::none)) {
    const Lattice& l = store_->dataset().lattice;
    roots_.reserve(2 * static_cast<std::size_t>(l.root_rows * l.root_columns));
    missing_.reserve(kUsualRequests);
    promoted_.reserve(2 * static_cast<std::size_t>(options.memory.staging_slots));
}

Result<std::unique_ptr<Pager>> Pager::create(std::shared_ptr<const TileStore> store, const PagerOptions& options,
                                             TileSink& sink) {
    std::unique_ptr<Pager> pager(new Pager(store, options, sink));
    auto loader = Loader::start(store, options.loader_threads, options.latency_ms, options.measure);
    if (!loader) return loader.error();
    pager->loader_ = std::move(*loader);
    Loader::QueueEdit(*pager->loader_).jobs().reserve(2 * static_cast<std::size_t>(options.memory.staging_slots));
    if (auto ok = pager->load_roots(); !ok) return ok.error();
    return pager;
}

std::vector<TileId> Pager::root_ids() const {
    const Lattice& l = store_->dataset().lattice;
    std::vector<TileId> ids;
    for (std::int64_t y = 0; y < l.root_rows; ++y)
        for (std::int64_t x = 0; x < l.root_columns; ++x) ids.push_back({0, x, y});
    return ids;
}

Result<void> Pager::load_roots() {
    const std::vector<TileId> ids = root_ids();
    auto stored = load_roots(TileKind::height, ids);
    if (!stored) return stored.error();
    if (!options_.textures) return {};
    auto textured = load_roots(TileKind::texture, *stored);
    if (!textured) return textured.error();
    return {};
}

// Returns those that are stored: there may be no heights under a root, but where there are heights there is a texture.
Result<std::vector<TileId>> Pager::load_roots(TileKind kind, std::span<const TileId> ids) {
    TileCache& tiles = cache(kind);
    std::vector<TileId> stored;
    std::size_t queued = 0, taken = 0;
    while (taken < ids.size()) {
        for (; queued < ids.size() && static_cast<std::int64_t>(queued - taken) < options_.memory.staging_slots;
             ++queued) {
            const auto slot = tiles.reserve(ids[queued], 0);
            if (!slot) return Error{ErrorCode::usage, fmt::format("more roots than {} slots", name_of(kind))};
            Loader::QueueEdit queue(*loader_);
            queue.jobs().push_back({kind, ids[queued], *slot, 0, false, order_++, {}});
        }
        LoadedTile* tile = loader_->take(true);
        ++taken;
        if (tile->stale) return Error{ErrorCode::io, "the store was changed while it was opened"};
        if (tile->missing && kind == TileKind::height) {
            tiles.cancel(tile->job.slot);
        } else if (!tile->error.empty()) {
            return Error{ErrorCode::store, with_tile(*tile)};
        } else {
            put(*tile, kFromTheStart);
            tiles.pin(tile->job.slot);
            stored.push_back(tile->job.id);
        }
        loader_->recycle(tile);
    }
    return stored;
}

void Pager::put(const LoadedTile& tile, double arrived_s) {
    counters_.upload_bytes += sink_bytes(tile);
    if (tile.job.kind == TileKind::height) {
        sink_.put_height(tile.job.slot, tile.vertices);
        if (options_.measure) sink_.put_costs(tile.job.slot, tile.vertices, tile.costs);
    } else {
        sink_.put_texture(tile.job.slot, tile.blocks);
    }
    Tables& tables = loaded();
    tables.of(tile.job.kind).complete(tile.job.slot, tile.header, arrived_s);
    if (tile.job.kind == TileKind::height && options_.corrections)
        tables.residency.heights.corrections[static_cast<std::size_t>(tile.job.slot)] =
            level_corrections(tile.vertices, store_->dataset().lattice.tile_cells_log2);
}

void Pager::report_damage(const LoadedTile& tile) {
    ++counters_.damaged_tiles;
    if (on_damage) on_damage(with_tile(tile) + "; its parent stands in");
}

// The store has gone on: what else is asked for of this state would come to nothing as well.
void Pager::drop_stale(const LoadJob& job) {
    TileCache& tiles = cache(job.kind);
    --loading(job.kind).of(tiles.prefetch(job.slot));
    tiles.cancel(job.slot);
    stale_ = true;
}

void Pager::accept_root(const LoadedTile& tile) {
    const LoadJob& job = tile.job;
    TileCache& tiles = cache(job.kind);
    --loading(job.kind).requested;
    ++roots_done_;
    if (tile.error.empty()) {
        put(tile, kFromTheStart);
        tiles.pin(job.slot);
        if (job.kind == TileKind::height && options_.textures) roots_.push_back({TileKind::texture, job.id, 0});
        return;
    }
    tiles.cancel(job.slot);
    if (tile.missing && job.kind == TileKind::height) return;
    // Nothing stands in for a root: what is shown stays.
    ++counters_.damaged_tiles;
    if (on_damage) on_damage(with_tile(tile) + "; an update of the store is not shown");
    give_up_takeover();
    gave_up_ = true;
}

void Pager::accept(LoadedTile* tile) {
    const LoadJob& job = tile->job;
    if (job.generation != generation_) {
        --orphans_[static_cast<std::size_t>(job.kind)];
        return loader_->recycle(tile);
    }
    if (tile->stale) {
        drop_stale(job);
        return loader_->recycle(tile);
    }
    if (taking_over_ && job.id.level == 0) {
        accept_root(*tile);
        return loader_->recycle(tile);
    }
    TileCache& tiles = cache(job.kind);
    const bool prefetch = tiles.prefetch(job.slot);
    --loading(job.kind).of(prefetch);
    counters_.bytes_read += tile->bytes_read;
    if (tile->error.empty()) {
        put(*tile, taking_over_ ? kFromTheStart : shown_->residency.now_s);
        ++counters_.tiles_paged_in;
        if (prefetch) ++counters_.prefetched;
    } else {
        tiles.fail(job.slot);
        report_damage(*tile);
    }
    loader_->recycle(tile);
}

int Pager::take_arrivals(std::int64_t upload_bytes, bool wait) {
    int taken = 0;
    while (upload_bytes > 0) {
        LoadedTile* tile = loader_->take(wait && taken == 0);
        if (tile == nullptr) break;
        upload_bytes -= sink_bytes(*tile);
        accept(tile);
        ++taken;
    }
    assert(adds_up());
    return taken;
}

void Pager::use(Tables& tables, const Wishes& wishes) {
    tables.heights.begin_frame();
    tables.textures.begin_frame();
    tables.heights.touch(wishes.standing_heights);
    tables.textures.touch(wishes.standing_textures);
    tables.heights.touch_planned(wishes.planned_heights);
    tables.textures.touch_planned(wishes.planned_textures);
}

void Pager::request(const Wishes& wishes) {
    assert(!taking_over_);
    use(*shown_, wishes);
    note_wishes(stale_ ? std::span<const TileRequest>{} : wishes.requests);
    if (!missing_.empty() || shown_->heights.loading() + shown_->textures.loading() > 0) {
        Loader::QueueEdit queue(*loader_);
        update_queue(queue);
    }
    counters_.tiles_paged_out = shown_->evictions() + coming_->evictions();
    assert(adds_up());
}

void Pager::request(const Wishes& shown, const Wishes& coming) {
    assert(taking_over_);
    use(*shown_, shown);
    if (!roots_ready()) {
        use(*coming_, {});
        if (!stale_) request_roots();
    } else {
        use(*coming_, coming);
        note_wishes(stale_ ? std::span<const TileRequest>{} : coming.requests);
        if (!missing_.empty() || coming_->heights.loading() + coming_->textures.loading() > 0) {
            Loader::QueueEdit queue(*loader_);
            update_queue(queue);
        }
    }
    counters_.tiles_paged_out = shown_->evictions() + coming_->evictions();
    assert(adds_up());
}

void Pager::begin_takeover(StoreState state) {
    if (taking_over_) give_up_takeover();
    forget_loads();
    store_ = std::move(state.store);
    loader_->renew(store_, std::move(state.readers));
    generation_ = loader_->generation();
    taking_over_ = true;
    stale_ = gave_up_ = false;
    roots_.clear();
    roots_begun_ = roots_done_ = 0;
    for (const TileId id : root_ids()) roots_.push_back({TileKind::height, id, 0});
}

// What was asked for is no longer waited for. What is being read or staged arrives all the same, and keeps its place
// among the staged tiles until then.
void Pager::forget_loads() {
    Loader::QueueEdit queue(*loader_);
    for (Loading& under_way : loading_)
        orphans_[static_cast<std::size_t>(&under_way - loading_.data())] += under_way.total();
    for (const LoadJob& job : queue.jobs()) --orphans_[static_cast<std::size_t>(job.kind)];
    queue.jobs().clear();
    loading_ = {};
    for (const TileKind kind : {TileKind::height, TileKind::texture}) cache(kind).cancel_all();
    generation_ = kNobodys;
}

void Pager::give_up_takeover() {
    forget_loads();
    for (const TileKind kind : {TileKind::height, TileKind::texture}) coming_->of(kind).hand_over(shown_->of(kind));
    taking_over_ = false;
    stale_ = true;  // what is shown is no longer what the store holds
}

void Pager::switch_over() {
    assert(roots_ready());
    for (const TileKind kind : {TileKind::height, TileKind::texture}) shown_->of(kind).hand_over(coming_->of(kind));
    std::swap(shown_, coming_);
    taking_over_ = false;
    counters_.tiles_paged_out = shown_->evictions() + coming_->evictions();
    assert(adds_up());
}

void Pager::request_roots() {
    Loader::QueueEdit queue(*loader_);
    full_ = {};
    for (; roots_begun_ < roots_.size(); ++roots_begun_) {
        const TileRequest& root = roots_[roots_begun_];
        if (!may_begin(root)) return;
        const std::int64_t before = loading(root.kind).total();
        begin(root, queue.jobs());
        if (loading(root.kind).total() == before) return;
    }
}

// The state shown gives up what it draws with last.
void Pager::make_room(TileCache& tiles, TileKind kind) {
    if (!taking_over_ || tiles.has_free_slot()) return;
    if (const auto slot = shown_->of(kind).give_away()) tiles.receive(*slot);
}

// Tells what is on its way already from what is missing.
void Pager::note_wishes(std::span<const TileRequest> requests) {
    missing_.clear();
    promoted_.clear();
    for (const TileRequest& wish : requests) {
        if (wish.kind == TileKind::texture && !options_.textures) continue;
        if (!store_->dataset().lattice.contains(wish.id)) continue;
        TileCache& tiles = cache(wish.kind);
        const std::int32_t slot = tiles.find(wish.id);
        if (slot == kNotResident) missing_.push_back(&wish);
        if (slot < 0 || tiles.state(slot) != TileCache::State::loading) continue;
        if (tiles.prefetch(slot) && !wish.prefetch) {
            tiles.promote(slot);
            --loading(wish.kind).prefetched;
            ++loading(wish.kind).requested;
            promoted_.emplace_back(wish.kind, slot);
        }
        // What was asked for in earnest and is now wanted soon makes room for others, unless it is being read.
        if (tiles.prefetch(slot) == wish.prefetch)
            tiles.wish(slot, wish.priority);
        else
            missing_.push_back(&wish);
    }
}

void Pager::update_queue(Loader::QueueEdit& queue) {
    for (const auto& [kind, slot] : promoted_) queue.promote(kind, slot);
    std::vector<LoadJob>& jobs = queue.jobs();
    // Jobs not begun keep their slots while they are wished for; the others are forgotten.
    std::erase_if(jobs, [&](LoadJob& job) {
        TileCache& tiles = cache(job.kind);
        job.prefetch = tiles.prefetch(job.slot);
        job.priority = tiles.need(job.slot);
        if (tiles.wished(job.slot)) return false;
        --loading(job.kind).of(job.prefetch);
        tiles.cancel(job.slot);
        return true;
    });
    full_ = no_idle_ = {};
    for (const bool prefetch : {false, true})
        for (const TileRequest* wish : missing_)
            if (wish->prefetch == prefetch && may_begin(*wish)) begin(*wish, jobs);
}

// Prefetches have places of their own among the staged tiles, so that they never keep another request out of one.
bool Pager::may_begin(const TileRequest& wish) {
    const auto kind = static_cast<std::size_t>(wish.kind);
    const Loading& under_way = loading_[kind];
    const std::int64_t all = options_.memory.staging_slots - orphans_[kind], ahead = prefetch_places();
    if (wish.prefetch) return !no_idle_[kind] && under_way.prefetched < ahead && under_way.total() < all;
    if (full_[kind] && under_way.requested < all - ahead) ++counters_.refused;
    return !full_[kind] && under_way.requested < all - ahead;
}

void Pager::begin(const TileRequest& wish, std::vector<LoadJob>& jobs) {
    TileCache& tiles = cache(wish.kind);
    if (tiles.find(wish.id) != kNotResident) return;  // listed twice
    make_room(tiles, wish.kind);
    const auto claim = wish.prefetch ? TileCache::Claim::idle : TileCache::Claim::any;
    auto slot = tiles.reserve(wish.id, wish.priority, claim);
    if (!slot && !wish.prefetch && cancel_a_prefetch(wish.kind, jobs)) slot = tiles.reserve(wish.id, wish.priority);
    const auto kind = static_cast<std::size_t>(wish.kind);
    if (!slot) {
        if (wish.prefetch)
            no_idle_[kind] = true;
        else
            ++counters_.refused;
        full_[kind] = full_[kind] || tiles.exhausted();
        return;
    }
    ++loading(wish.kind).of(wish.prefetch);
    jobs.push_back({wish.kind, wish.id, *slot, wish.priority, wish.prefetch, order_++, {}});
}

bool Pager::cancel_a_prefetch(TileKind kind, std::vector<LoadJob>& jobs) {
    const auto job =
        std::find_if(jobs.begin(), jobs.end(), [&](const LoadJob& j) { return j.kind == kind && j.prefetch; });
    if (job == jobs.end()) return false;
    cache(kind).cancel(job->slot);
    --loading(kind).prefetched;
    jobs.erase(job);
    return true;
}

bool Pager::adds_up() const {
    const Tables& into = taking_over_ ? *coming_ : *shown_;
    return loading_[0].total() == into.heights.loading() && loading_[1].total() == into.textures.loading() &&
           shown_->adds_up() && coming_->adds_up();
}

}  // namespace scree
