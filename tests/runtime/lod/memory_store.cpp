#include "tests/runtime/lod/memory_store.h"

#include <chrono>
#include <thread>

#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"

namespace scree::test {

class MemoryReader final : public TileReader {
public:
    MemoryReader(const MemoryStore& store, std::uint64_t seed) : store_(store), random_(seed) {}
    Result<bool> read(TileKind kind, TileId id, TileRow& row) override {
        return store_.read(kind, id, uniform(random_, 0, store_.max_latency_us_), row);
    }

private:
    const MemoryStore& store_;
    Random random_;
};

MemoryStore::MemoryStore(const SyntheticTerrain& terrain, int max_latency_us)
    : terrain_(terrain), max_latency_us_(max_latency_us) {}

Result<std::unique_ptr<TileReader>> MemoryStore::open_reader() const {
    const std::lock_guard lock(mutex_);
    return std::unique_ptr<TileReader>(new MemoryReader(*this, seed() + ++readers_));
}

std::vector<std::uint8_t> MemoryStore::row(TileKind kind, TileId id) const {
    if (kind == TileKind::height)
        return encode_height_tile(*terrain_.tile(id), terrain_.lattice().tile_cells_log2, HeightCodec::raw);
    return encode_texture_tile(terrain_.texture(id), terrain_.dataset().texture_size_log2, TextureCodec::raw);
}

Result<bool> MemoryStore::read(TileKind kind, TileId id, int latency_us, TileRow& out) const {
    const Key key{kind, id};
    {
        std::unique_lock lock(mutex_);
        order_.push_back(key);
        twice_ |= !being_read_.insert(key).second;
        changed_.notify_all();
        changed_.wait(lock, [&] { return !held_; });
    }
    if (latency_us > 0) std::this_thread::sleep_for(std::chrono::microseconds(latency_us));
    const auto damaged = damaged_.find(key);
    const std::lock_guard lock(mutex_);
    being_read_.erase(key);
    if (damaged != damaged_.end() && damaged->second == Damage::checksum)
        return Error{ErrorCode::store, "the checksum does not match"};
    const bool stored = kind == TileKind::height ? terrain_.tile(id) != nullptr : terrain_.has_texture(id);
    if (!stored || (damaged != damaged_.end() && damaged->second == Damage::missing)) return false;
    out.codec = 0;
    out.payload = row(kind, id);
    if (damaged != damaged_.end()) out.payload.resize(out.payload.size() / 2);
    bytes_ += static_cast<std::int64_t>(out.payload.size());
    return true;
}

void MemoryStore::hold() const {
    const std::lock_guard lock(mutex_);
    held_ = true;
}

void MemoryStore::release() const {
    const std::lock_guard lock(mutex_);
    held_ = false;
    changed_.notify_all();
}

void MemoryStore::wait_for_reads(std::int64_t count) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return static_cast<std::int64_t>(order_.size()) >= count; });
}

std::int64_t MemoryStore::reads_begun() const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::int64_t>(order_.size());
}

std::int64_t MemoryStore::payload_bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
}

std::vector<MemoryStore::Key> MemoryStore::order() const {
    const std::lock_guard lock(mutex_);
    return order_;
}

bool MemoryStore::read_twice_at_once() const {
    const std::lock_guard lock(mutex_);
    return twice_;
}

}  // namespace scree::test
