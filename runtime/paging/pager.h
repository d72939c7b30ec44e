// Pager: tiles in and out of fixed slots. It answers selection's questions (Residency) and carries out its wishes.
// Loading a tile goes   absent -> reserved (slot taken, job queued) -> being read -> staged -> resident -> evicted,
// with the side ways: queued -> cancelled, read -> unavailable (damaged; said once, its parent stands in).
// Frame-loop thread only; the loader's threads are inside.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
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
};

struct PagerCounters {
    std::int64_t tiles_paged_in = 0;
    std::int64_t tiles_paged_out = 0;
    std::int64_t bytes_read = 0;
    std::int64_t damaged_tiles = 0;
};

class Pager final : public Residency {
public:
    /// Loads and pins the roots. Errors: those of the store; a damaged root cannot be stood in for.
    static Result<std::unique_ptr<Pager>> create(const TileStore& store, const PagerOptions& options, TileSink& sink);

    ResidentHeight height(TileId id) const override;
    std::int32_t texture(TileId id) const override;
    std::uint8_t texture_children(TileId id) const override;
    bool unavailable_height(TileId id) const override;
    bool unavailable_texture(TileId id) const override;

    /// Hands arrived tiles to the sink, up to `upload_bytes`. `wait`: if nothing has arrived, blocks until something
    /// does. Returns the tiles taken.
    int take_arrivals(std::int64_t upload_bytes, bool wait);

    struct Wishes {
        std::span<const TileId> planned_heights, planned_textures;    ///< never evicted
        std::span<const TileId> standing_heights, standing_textures;  ///< evicted last
        std::span<const TileRequest> requests;                        ///< most urgent first
    };
    /// Once a frame, after selection. Requests not begun and no longer wished for are cancelled.
    void request(const Wishes& wishes);

    bool idle() const { return loader_->under_way() == 0; }
    const PagerCounters& counters() const { return counters_; }
    std::int64_t height_slots() const { return heights_.capacity(); }
    std::int64_t texture_slots() const { return textures_.capacity(); }
    /// Called once for each damaged tile.
    std::function<void(const std::string&)> on_damage;

private:
    Pager(const TileStore& store, const PagerOptions& options, TileSink& sink);
    Result<void> load_roots();
    TileCache& cache(TileKind kind) { return kind == TileKind::height ? heights_ : textures_; }
    void accept(LoadedTile&& tile);
    void update_queue(std::span<const TileRequest> requests, std::vector<LoadJob>& queue);

    const TileStore& store_;
    PagerOptions options_;
    TileSink& sink_;
    TileCache heights_, textures_;
    std::unique_ptr<Loader> loader_;
    std::int64_t loading_[2] = {0, 0};  ///< slots reserved but not resident, by kind
    std::uint64_t frame_ = 1;
    PagerCounters counters_;
};

}  // namespace scree
