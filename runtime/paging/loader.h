// Loader: threads that read and decode tiles in order of urgency, prefetched ones last. It keeps as many staged tiles
// as its caller lets be under way at once, and reuses them. All functions are called by the frame-loop thread and hold
// no lock that a thread keeps while it reads; the threads are inside.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/mesh/vertex_slot.h"
#include "common/store/tile_store.h"
#include "runtime/paging/tile_measure.h"

namespace scree {

struct LoadJob {
    TileKind kind = TileKind::height;
    TileId id;
    std::int32_t slot = -1;
    double priority = 0;
    bool prefetch = false;
    std::int64_t order = 0;                             ///< among jobs of one priority, the smallest goes first
    std::int64_t generation = 0;                        ///< of the store's states, set by the loader
    std::chrono::steady_clock::time_point queued_at{};  ///< set by the loader
};

struct LoadedTile {
    LoadJob job;
    std::string error;     ///< empty: loaded
    bool missing = false;  ///< there is no such tile: an error too
    bool stale = false;    ///< the store was rewritten meanwhile: neither the tile nor its error means anything
    HeightTileHeader header;
    std::vector<SlotVertex> vertices;  ///< height tiles
    std::vector<VertexCost> costs;     ///< height tiles, where there is a measure
    std::vector<std::uint8_t> blocks;  ///< texture tiles, mip chain coarsest first
    std::int64_t bytes_read = 0;       ///< payload as stored
};

/// Of tiles that were staged, damaged ones included.
struct LoaderCounters {
    std::int64_t tiles = 0;
    double cpu_seconds = 0;      ///< of the loader's threads, from a job taken up to its tile staged
    double latency_seconds = 0;  ///< from a job queued to its tile staged, summed
};

class Loader {
public:
    /// Errors: those of TileStore::open_reader. `latency_ms` delays every read (to test slow disks).
    /// `measure`, where there is one, is asked about every height tile.
    static Result<std::unique_ptr<Loader>> start(std::shared_ptr<const TileStore> store, int threads, int latency_ms,
                                                 std::shared_ptr<const TileMeasure> measure = {});
    /// `store` outlives the loader.
    static Result<std::unique_ptr<Loader>> start(const TileStore& store, int threads, int latency_ms) {
        return start(std::shared_ptr<const TileStore>(std::shared_ptr<void>(), &store), threads, latency_ms);
    }
    /// Waits for the reads in progress, not for their delays.
    ~Loader();
    Loader(const Loader&) = delete;
    Loader& operator=(const Loader&) = delete;

    /// The jobs not begun, while it lives: they may be removed, added and changed, and no thread can begin one.
    class QueueEdit {
    public:
        explicit QueueEdit(Loader& loader);
        ~QueueEdit();
        QueueEdit(const QueueEdit&) = delete;
        QueueEdit& operator=(const QueueEdit&) = delete;
        std::vector<LoadJob>& jobs();
        /// A job begun as a prefetch is one no longer: its tile, if it waits to be taken, is taken before prefetches.
        void promote(TileKind kind, std::int32_t slot);

    private:
        Loader& loader_;
        std::unique_lock<std::mutex> lock_;
    };

    using Readers = std::vector<std::unique_ptr<TileReader>>;
    /// From here on jobs are read from `store`, by a reader a thread; those not begun are forgotten. Waits for nothing:
    /// what is being read still arrives, with the generation of its job.
    void renew(std::shared_ptr<const TileStore> store, Readers readers);
    /// How often the store was renewed.
    std::int64_t generation() const;

    /// A finished tile, prefetches last; null when none is ready. `wait`: blocks until one is, if anything is under
    /// way. Give it back to recycle().
    LoadedTile* take(bool wait);
    void recycle(LoadedTile* tile);
    /// Jobs queued, being read or waiting to be taken.
    std::int64_t under_way() const;
    LoaderCounters counters(TileKind kind) const;

private:
    struct Impl;
    explicit Loader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Bytes that a thread of the loader keeps besides the tiles that it stages: reader, payload, codec and stack.
std::int64_t loader_thread_bytes(const Dataset& dataset);

}  // namespace scree
