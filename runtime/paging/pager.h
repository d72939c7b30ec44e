// Pager: tiles in and out of fixed slots. It keeps the tables that selection reads (Residency) and carries out its
// wishes. Loading a tile goes   absent -> reserved (slot taken, job queued) -> being read -> staged -> resident ->
// evicted, with the side ways: queued -> cancelled, read -> unavailable (damaged; said once, its parent stands in).
// What a frame costs goes by what it wishes for and what arrives, not by slots or by the store; a frame that asks for
// nothing new allocates nothing. Frame-loop thread only; the loader's threads are inside, and no call waits for them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/store/tile_store.h"
#include "runtime/paging/loader.h"
#include "runtime/paging/memory_plan.h"
#include "runtime/paging/residency.h"
#include "runtime/paging/tile_cache.h"
#include "runtime/paging/tile_request.h"
#include "runtime/paging/tile_sink.h"

namespace scree {

struct PagerOptions {
    MemoryPlan memory;
    int loader_threads = 2;
    int latency_ms = 0;    ///< every read is delayed by this: to try slow disks
    bool textures = true;  ///< false: heights alone (audit)
    /// Where there is one, the sink gets what it finds out about every height tile.
    std::shared_ptr<const TileMeasure> measure{};
    /// Residency keeps the level corrections of height tiles; each height slot takes corrections_cost() more.
    bool corrections = false;
};

struct PagerCounters {
    std::int64_t tiles_paged_in = 0;
    std::int64_t tiles_paged_out = 0;
    std::int64_t bytes_read = 0;
    std::int64_t damaged_tiles = 0;
    std::int64_t refused = 0;       ///< requests for which no slot could be had, anew in each frame that makes them
    std::int64_t upload_bytes = 0;  ///< handed to the sink, roots included
    std::int64_t prefetched = 0;    ///< of tiles_paged_in, those that came before they were asked for in earnest
};

/// A later state of the store, and what it is read with.
struct StoreState {
    std::shared_ptr<const TileStore> store;
    Loader::Readers readers;  ///< one for each thread of the loader
};

class Pager final {
public:
    /// Loads and pins the roots. Errors: those of the store; a damaged root cannot be stood in for.
    static Result<std::unique_ptr<Pager>> create(const TileStore& store, const PagerOptions& options, TileSink& sink) {
        return create(std::shared_ptr<const TileStore>(std::shared_ptr<void>(), &store), options, sink);
    }
    /// Errors besides: ErrorCode::io where the store was changed meanwhile.
    static Result<std::unique_ptr<Pager>> create(std::shared_ptr<const TileStore> store, const PagerOptions& options,
                                                 TileSink& sink);

    /// Bytes a height slot: tables of two states of the store.
    static constexpr std::int64_t corrections_cost() { return 2 * sizeof(LevelCorrections); }

    const Residency& residency() const { return shown_->residency; }
    /// What arrives from now on has come at `now_s`. Seconds from any start; never goes back.
    void advance_clock(double now_s) { shown_->residency.now_s = coming_->residency.now_s = now_s; }

    /// Hands arrived tiles to the sink, up to `upload_bytes`, prefetched ones last. `wait`: if nothing has arrived,
    /// blocks until something does. Returns the tiles taken.
    int take_arrivals(std::int64_t upload_bytes, bool wait);

    struct Wishes {
        /// Slots of resident tiles, parents before children. Planned ones are not evicted in this frame, standing ones
        /// after all others.
        std::span<const std::int32_t> planned_heights{}, planned_textures{};
        std::span<const std::int32_t> standing_heights{}, standing_textures{};
        std::span<const TileRequest>
            requests{};  ///< most urgent first; what is resident or on its way may be among them
    };
    /// Once a frame, after selection. Requests not begun and no longer wished for are cancelled. A request is begun
    /// only if its tile can be kept: it waits while there is no slot for it. Prefetches take a free slot or one that
    /// nobody touched for TileCache::kIdleFrames, and give it back to any other request until they are being read.
    void request(const Wishes& wishes);

    // A store that is updated while it is drawn. Every tile in a table is of one state of the store: what is read after
    // the store was rewritten is thrown away, and from then on nothing more is loaded of the state shown. The new one
    // is loaded into tables of its own, in slots that the old one gives up, its roots first.

    /// The store is no longer what is shown, and nothing can be loaded until a later state is taken over.
    bool stale() const { return stale_; }
    /// The last takeover was: a root of the new state is damaged.
    bool gave_up() const { return gave_up_; }
    /// Begins to load a later state; one begun before is given up. Its dataset has the lattice and the texture size of
    /// the one shown.
    void begin_takeover(StoreState state);
    bool taking_over() const { return taking_over_; }
    /// From here on a selection may be made of coming().
    bool roots_ready() const { return taking_over_ && roots_.size() == roots_done_; }
    const Residency& coming() const { return coming_->residency; }
    /// In place of request() meanwhile. `shown`: what is planned and drawn of it stays as there is room. `coming`
    /// counts once its roots are ready. Together they should plan with no more than all slots.
    void request(const Wishes& shown, const Wishes& coming);
    /// The state that was coming is the one shown; the other is gone. Needs roots_ready().
    void switch_over();

    bool idle() const { return queue() == 0; }
    /// Tiles asked for and not there yet: waiting, being read or staged.
    std::int64_t queue() const { return loader_->under_way(); }
    /// Slots that a tile holds or is being loaded into, of all states of the store.
    std::int64_t slots_in_use(TileKind kind) const { return shown_->of(kind).in_use() + coming_->of(kind).in_use(); }
    const PagerCounters& counters() const { return counters_; }
    LoaderCounters loader_counters(TileKind kind) const { return loader_->counters(kind); }
    /// Tiles of the state that is shown.
    struct Occupancy {
        std::int64_t resident = 0, loading = 0;
    };
    Occupancy occupancy(TileKind kind) const {
        const TileCache& tiles = shown_->of(kind);
        return {tiles.resident(), tiles.loading()};
    }
    std::int64_t height_slots() const { return shown_->heights.capacity(); }
    std::int64_t texture_slots() const { return shown_->textures.capacity(); }
    /// Called once for each damaged tile.
    std::function<void(const std::string&)> on_damage;

private:
    /// Slots reserved but not resident, of one kind.
    struct Loading {
        std::int64_t requested = 0, prefetched = 0;
        std::int64_t& of(bool prefetch) { return prefetch ? prefetched : requested; }
        std::int64_t total() const { return requested + prefetched; }
    };
    /// The tiles of one state of the store.
    struct Tables {
        Tables(const PagerOptions& options, const Lattice& lattice, TileCache::Slots slots);
        TileCache& of(TileKind kind) { return kind == TileKind::height ? heights : textures; }
        bool adds_up() const;
        std::int64_t evictions() const { return heights.evictions() + textures.evictions(); }
        Residency residency;
        TileCache heights, textures;
    };
    Pager(std::shared_ptr<const TileStore> store, const PagerOptions& options, TileSink& sink);
    std::vector<TileId> root_ids() const;
    Result<void> load_roots();
    Result<std::vector<TileId>> load_roots(TileKind kind, std::span<const TileId> ids);
    /// Into which tiles are loaded.
    Tables& loaded() { return taking_over_ ? *coming_ : *shown_; }
    TileCache& cache(TileKind kind) { return loaded().of(kind); }
    Loading& loading(TileKind kind) { return loading_[static_cast<std::size_t>(kind)]; }
    void put(const LoadedTile& tile, double arrived_s);
    void accept(LoadedTile* tile);
    void accept_root(const LoadedTile& tile);
    void drop_stale(const LoadJob& job);
    void forget_loads();
    void give_up_takeover();
    void request_roots();
    void use(Tables& tables, const Wishes& wishes);
    void make_room(TileCache& tiles, TileKind kind);
    void report_damage(const LoadedTile& tile);
    void note_wishes(std::span<const TileRequest> requests);
    void update_queue(Loader::QueueEdit& queue);
    bool may_begin(const TileRequest& wish);
    void begin(const TileRequest& wish, std::vector<LoadJob>& jobs);
    bool cancel_a_prefetch(TileKind kind, std::vector<LoadJob>& jobs);
    std::int64_t prefetch_places() const { return options_.memory.staging_slots / 8; }
    bool adds_up() const;

    std::shared_ptr<const TileStore> store_;  ///< whose state is loaded
    PagerOptions options_;
    TileSink& sink_;
    std::unique_ptr<Tables> shown_, coming_;  ///< of `coming_`, without a takeover, only the memory counts
    bool taking_over_ = false, stale_ = false, gave_up_ = false;
    std::vector<TileRequest> roots_;                ///< of the state that comes; those of textures follow heights'
    std::size_t roots_begun_ = 0, roots_done_ = 0;  ///< of `roots_`
    std::int64_t generation_ = 0;                   ///< of the jobs that count
    std::array<std::int64_t, 2> orphans_{};         ///< jobs of earlier ones, staged or being read, by kind
    std::unique_ptr<Loader> loader_;
    std::array<Loading, 2> loading_;                           ///< by kind
    std::array<bool, 2> full_{};                               ///< no slot is left in this frame for a request, by kind
    std::array<bool, 2> no_idle_{};                            ///< nor for a prefetch
    std::vector<const TileRequest*> missing_;                  ///< of this frame's requests; a buffer
    std::vector<std::pair<TileKind, std::int32_t>> promoted_;  ///< likewise
    std::int64_t order_ = 0;
    PagerCounters counters_;
};

}  // namespace scree
