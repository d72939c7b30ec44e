// MemoryStore: a SyntheticTerrain behind the TileStore interface, with slow, damaged and held-up reads, and a record of
// who read what. Thread-safe, as a store must be.
#pragma once

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>

#include "common/store/tile_store.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree::test {

enum class Damage { checksum, truncated, missing };

class MemoryStore final : public TileStore {
public:
    using Key = std::pair<TileKind, TileId>;

    /// Every read takes 0..max_latency_us, at random.
    explicit MemoryStore(const SyntheticTerrain& terrain, int max_latency_us = 0);
    /// Before any reader is at work.
    void damage(TileKind kind, TileId id, Damage how) { damaged_[{kind, id}] = how; }

    const Dataset& dataset() const override { return terrain_.dataset(); }
    Result<std::unique_ptr<TileReader>> open_reader() const override;
    /// As if another program had updated it in place.
    void rewrite() { rewritten_ = true; }
    bool is_rewritten() const override { return rewritten_; }

    /// While held, reads begin but do not end.
    void hold() const;
    void release() const;
    /// Blocks until so many reads have begun since the store was made.
    void wait_for_reads(std::int64_t count) const;

    std::int64_t reads_begun() const;
    std::int64_t payload_bytes() const;  ///< of all rows handed out
    std::vector<Key> order() const;      ///< in which reads began
    bool read_twice_at_once() const;
    std::int64_t payload_size(TileKind kind, TileId id) const {
        return static_cast<std::int64_t>(row(kind, id).size());
    }

private:
    friend class MemoryReader;
    std::vector<std::uint8_t> row(TileKind kind, TileId id) const;
    Result<bool> read(TileKind kind, TileId id, int latency_us, TileRow& row) const;

    const SyntheticTerrain& terrain_;
    const int max_latency_us_;
    std::atomic<bool> rewritten_ = false;
    std::map<Key, Damage> damaged_;
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    mutable bool held_ = false;
    mutable bool twice_ = false;
    mutable std::int64_t bytes_ = 0;
    mutable std::vector<Key> order_;
    mutable std::set<Key> being_read_;
    mutable std::uint64_t readers_ = 0;
};

}  // namespace scree::test
