// Loader: threads that read and decode tiles in order of urgency. Bounded: at most `staging_slots` tiles of each kind
// exist between disk and GPU. All functions are called by the frame-loop thread; the threads are inside.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/vertex_slot.h"
#include "common/store/tile_store.h"

namespace scree {

struct LoadJob {
    TileKind kind = TileKind::height;
    TileId id;
    std::int32_t slot = -1;
    double priority = 0;
};

struct LoadedTile {
    LoadJob job;
    std::string error;  ///< empty: loaded
    HeightTileHeader header;
    std::vector<SlotVertex> vertices;  ///< height tiles
    std::vector<std::uint8_t> blocks;  ///< texture tiles, mip chain coarsest first
    std::int64_t bytes_read = 0;       ///< payload as stored
};

class Loader {
public:
    /// Errors: those of TileStore::open_reader. `latency_ms` delays every read (to test slow disks).
    static Result<std::unique_ptr<Loader>> start(const TileStore& store, int threads, int latency_ms);
    ~Loader();
    Loader(const Loader&) = delete;
    Loader& operator=(const Loader&) = delete;

    /// Changes the list of jobs not begun: `edit` may remove, add and re-prioritise while no thread can begin one.
    void edit_queue(const std::function<void(std::vector<LoadJob>&)>& edit);
    /// Takes one finished tile; false when none is ready. `wait`: blocks until one is, if anything is under way.
    bool take(LoadedTile& out, bool wait);
    /// Gives a taken tile's buffers back for reuse.
    void recycle(LoadedTile&& tile);
    /// Jobs queued, being read or waiting to be taken.
    std::int64_t under_way() const;

private:
    struct Impl;
    explicit Loader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
