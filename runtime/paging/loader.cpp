#include "runtime/paging/loader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"

namespace scree {

struct Loader::Impl {
    const TileStore& store;
    int latency_ms = 0;
    mutable std::mutex mutex;
    std::condition_variable work_ready, tile_ready;
    std::vector<LoadJob> queue;  // least urgent first: jobs leave at the back
    std::deque<LoadedTile> finished;
    std::array<std::vector<LoadedTile>, 2> spare;  // by kind: a buffer serves tiles of its own kind only
    std::int64_t being_read = 0;
    bool stopping = false;
    std::vector<std::thread> threads;

    explicit Impl(const TileStore& s) : store(s) {}

    void load(TileReader& reader, TileRow& row, LoadedTile& tile) const {
        const Dataset& dataset = store.dataset();
        const int n = dataset.lattice.tile_cells_log2;
        tile.error.clear();
        tile.bytes_read = 0;
        auto found = reader.read(tile.job.kind, tile.job.id, row);
        if (!found || !*found) {
            tile.error = found ? "is missing from the store" : found.error().message;
            return;
        }
        tile.bytes_read = static_cast<std::int64_t>(row.payload.size());
        if (tile.job.kind == TileKind::height) {
            auto decoded = decode_height_tile(row.payload, n, row.codec);
            if (!decoded) {
                tile.error = decoded.error().message;
                return;
            }
            tile.header = decoded->header;
            tile.vertices.resize(slot_vertex_count(n));
            fill_vertex_slot(decoded->samples, n, tile.vertices);
        } else {
            auto decoded = decode_texture_tile(row.payload, dataset.texture_size_log2, row.codec);
            if (!decoded) {
                tile.error = decoded.error().message;
                return;
            }
            tile.header.child_mask = decoded->child_mask;
            tile.blocks = std::move(decoded->blocks);
        }
    }

    void run(std::unique_ptr<TileReader> reader) {
        TileRow row;
        std::unique_lock lock(mutex);
        for (;;) {
            work_ready.wait(lock, [&] { return stopping || !queue.empty(); });
            if (stopping) return;
            LoadedTile tile;
            auto& buffers = spare[static_cast<std::size_t>(queue.back().kind)];
            if (!buffers.empty()) {
                tile = std::move(buffers.back());
                buffers.pop_back();
            }
            tile.job = queue.back();
            queue.pop_back();
            ++being_read;
            lock.unlock();
            if (latency_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(latency_ms));
            load(*reader, row, tile);
            lock.lock();
            --being_read;
            finished.push_back(std::move(tile));
            tile_ready.notify_one();
        }
    }
};

Loader::Loader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Loader>> Loader::start(const TileStore& store, int threads, int latency_ms) {
    auto impl = std::make_unique<Impl>(store);
    impl->latency_ms = latency_ms;
    std::unique_ptr<Loader> loader(new Loader(std::move(impl)));
    for (int t = 0; t < std::max(threads, 1); ++t) {
        auto reader = store.open_reader();
        if (!reader) return reader.error();
        loader->impl_->threads.emplace_back(
            [state = loader->impl_.get(), r = std::move(*reader)]() mutable { state->run(std::move(r)); });
    }
    return loader;
}

Loader::~Loader() {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->stopping = true;
    }
    impl_->work_ready.notify_all();
    for (std::thread& thread : impl_->threads) thread.join();
}

void Loader::edit_queue(const std::function<void(std::vector<LoadJob>&)>& edit) {
    {
        const std::lock_guard lock(impl_->mutex);
        edit(impl_->queue);
        std::stable_sort(impl_->queue.begin(), impl_->queue.end(),
                         [](const LoadJob& a, const LoadJob& b) { return a.priority < b.priority; });
    }
    impl_->work_ready.notify_all();
}

bool Loader::take(LoadedTile& out, bool wait) {
    std::unique_lock lock(impl_->mutex);
    if (wait)
        impl_->tile_ready.wait(
            lock, [&] { return !impl_->finished.empty() || (impl_->queue.empty() && impl_->being_read == 0); });
    if (impl_->finished.empty()) return false;
    out = std::move(impl_->finished.front());
    impl_->finished.pop_front();
    return true;
}

void Loader::recycle(LoadedTile&& tile) {
    const std::lock_guard lock(impl_->mutex);
    impl_->spare[static_cast<std::size_t>(tile.job.kind)].push_back(std::move(tile));
}

std::int64_t Loader::under_way() const {
    const std::lock_guard lock(impl_->mutex);
    return static_cast<std::int64_t>(impl_->queue.size() + impl_->finished.size()) + impl_->being_read;
}

}  // namespace scree
