#include "runtime/paging/loader.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <condition_variable>
#include <optional>
#include <thread>

#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"
#include "common/texture_tile.h"

namespace scree {
namespace {

// SQLite's page cache (128 KB) and connection, a Zstandard context (160 KB) and the thread's stack.
constexpr std::int64_t kReaderBytes = 512 * 1024;

using Clock = std::chrono::steady_clock;

double thread_cpu_seconds() {
    timespec t{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::size_t index_of(TileKind kind) { return static_cast<std::size_t>(kind); }

bool more_urgent(const LoadJob& a, const LoadJob& b) {
    if (a.prefetch != b.prefetch) return b.prefetch;
    return a.priority != b.priority ? a.priority > b.priority : a.order < b.order;
}

// What one thread reads and decodes with.
class TileLoading {
public:
    TileLoading(std::shared_ptr<const TileStore> store, std::unique_ptr<TileReader> reader,
                std::shared_ptr<const TileMeasure> measure)
        : store_(std::move(store)), reader_(std::move(reader)), measure_(std::move(measure)) {}

    void load(LoadedTile& tile) {
        tile.error.clear();
        tile.missing = false;
        tile.bytes_read = 0;
        read(tile);
        // Asked afterwards: a writer cannot have begun before the read ended without being seen now.
        tile.stale = store_->is_rewritten();
    }

private:
    const Dataset& dataset() const { return store_->dataset(); }

    void read(LoadedTile& tile) {
        auto found = reader_->read(tile.job.kind, tile.job.id, row_);
        if (!found) {
            tile.error = found.error().message;
            return;
        }
        if (!*found) {
            tile.missing = true;
            tile.error = "is missing from the store";
            return;
        }
        tile.bytes_read = static_cast<std::int64_t>(row_.payload.size());
        auto ok = tile.job.kind == TileKind::height ? decode_height(tile) : decode_texture(tile);
        if (!ok) tile.error = ok.error().message;
    }

    Result<void> decode_height(LoadedTile& tile) {
        const int n = dataset().lattice.tile_cells_log2;
        if (auto ok = decode_height_tile(row_.payload, n, row_.codec, height_); !ok) return ok;
        tile.header = height_.header;
        tile.vertices.resize(slot_vertex_count(n));
        fill_vertex_slot(height_.samples, n, tile.vertices);
        if (measure_ != nullptr) {
            tile.costs.resize(tile.vertices.size());
            measure_->measure(dataset(), tile.job.id, tile.header, tile.vertices, tile.costs);
        }
        return {};
    }

    // Straight into the staged tile's buffer, which the texture borrows meanwhile.
    Result<void> decode_texture(LoadedTile& tile) {
        texture_.blocks.swap(tile.blocks);
        auto ok = decode_texture_tile(row_.payload, dataset().texture_size_log2, row_.codec, texture_);
        texture_.blocks.swap(tile.blocks);
        tile.header.child_mask = texture_.child_mask;
        return ok;
    }

    std::shared_ptr<const TileStore> store_;
    std::unique_ptr<TileReader> reader_;
    std::shared_ptr<const TileMeasure> measure_;
    TileRow row_;
    HeightTile height_;
    TextureTile texture_;
};

}  // namespace

struct Loader::Impl {
    int latency_ms = 0;
    std::shared_ptr<const TileMeasure> measure;
    mutable std::mutex mutex;
    std::condition_variable work_ready, tile_ready, stop;
    std::vector<LoadJob> queue;  // least urgent first: jobs leave at the back
    std::vector<std::unique_ptr<LoadedTile>> tiles;
    std::array<std::vector<LoadedTile*>, 2> spare;  // by kind: a buffer serves tiles of its own kind only
    std::vector<LoadedTile*> being_read, finished;
    std::array<LoaderCounters, 2> counters;
    bool stopping = false;
    std::int64_t generation = 0;
    std::vector<TileLoading> fresh;  // of this generation, one for each thread that has not taken its own yet
    std::vector<std::thread> threads;

    LoadedTile* begin_job() {
        auto& buffers = spare[index_of(queue.back().kind)];
        if (buffers.empty()) {
            tiles.push_back(std::make_unique<LoadedTile>());
            buffers.push_back(tiles.back().get());
            for (auto& list : spare) list.reserve(tiles.size());
            being_read.reserve(tiles.size());
            finished.reserve(tiles.size());
        }
        LoadedTile* tile = buffers.back();
        buffers.pop_back();
        tile->job = queue.back();
        tile->job.generation = generation;
        queue.pop_back();
        being_read.push_back(tile);
        return tile;
    }

    void end_job(LoadedTile* tile, double cpu_seconds) {
        LoaderCounters& count = counters[index_of(tile->job.kind)];
        ++count.tiles;
        count.cpu_seconds += cpu_seconds;
        count.latency_seconds += std::chrono::duration<double>(Clock::now() - tile->job.queued_at).count();
        std::erase(being_read, tile);
        finished.push_back(tile);
    }

    void run(TileLoading loading) {
        std::unique_lock lock(mutex);
        std::int64_t reads_from = 0;
        for (;;) {
            work_ready.wait(lock, [&] { return stopping || !queue.empty(); });
            if (stopping) return;
            const double start = thread_cpu_seconds();
            LoadedTile* tile = begin_job();
            if (latency_ms > 0 && stop.wait_for(lock, std::chrono::milliseconds(latency_ms), [&] { return stopping; }))
                return;
            std::optional<TileLoading> next;
            if (reads_from != tile->job.generation && tile->job.generation == generation) {
                next.emplace(std::move(fresh.back()));
                fresh.pop_back();
                reads_from = generation;
            }
            // A second renewal during the delay: this thread's reader was never taken, and the job is nobody's.
            const bool too_late = reads_from != tile->job.generation;
            lock.unlock();
            if (next) loading = std::move(*next);
            if (too_late)
                tile->stale = true;
            else
                loading.load(*tile);
            lock.lock();
            end_job(tile, thread_cpu_seconds() - start);
            tile_ready.notify_one();
        }
    }
};

Loader::Loader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Loader>> Loader::start(std::shared_ptr<const TileStore> store, int threads, int latency_ms,
                                              std::shared_ptr<const TileMeasure> measure) {
    auto impl = std::make_unique<Impl>();
    impl->latency_ms = latency_ms;
    impl->measure = measure;
    std::unique_ptr<Loader> loader(new Loader(std::move(impl)));
    for (int t = 0; t < std::max(threads, 1); ++t) {
        auto reader = store->open_reader();
        if (!reader) return reader.error();
        loader->impl_->threads.emplace_back(
            [state = loader->impl_.get(), loading = TileLoading(store, std::move(*reader), measure)]() mutable {
                state->run(std::move(loading));
            });
    }
    return loader;
}

Loader::~Loader() {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->stopping = true;
    }
    impl_->work_ready.notify_all();
    impl_->stop.notify_all();
    for (std::thread& thread : impl_->threads) thread.join();
}

void Loader::renew(std::shared_ptr<const TileStore> store, Readers readers) {
    std::vector<TileLoading> fresh, unused;
    for (auto& reader : readers) fresh.emplace_back(store, std::move(reader), impl_->measure);
    const std::lock_guard lock(impl_->mutex);
    assert(fresh.size() >= impl_->threads.size());
    impl_->queue.clear();
    ++impl_->generation;
    unused.swap(impl_->fresh);
    impl_->fresh.swap(fresh);
}

std::int64_t Loader::generation() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->generation;
}

Loader::QueueEdit::QueueEdit(Loader& loader) : loader_(loader), lock_(loader.impl_->mutex) {}

Loader::QueueEdit::~QueueEdit() {
    std::vector<LoadJob>& queue = loader_.impl_->queue;
    const auto less_urgent = [](const LoadJob& a, const LoadJob& b) { return more_urgent(b, a); };
    std::sort(queue.begin(), queue.end(), less_urgent);
    for (LoadJob& job : queue)
        if (job.queued_at == Clock::time_point{}) job.queued_at = Clock::now();
    const bool work = !queue.empty();
    lock_.unlock();
    if (work) loader_.impl_->work_ready.notify_all();
}

std::vector<LoadJob>& Loader::QueueEdit::jobs() { return loader_.impl_->queue; }

void Loader::QueueEdit::promote(TileKind kind, std::int32_t slot) {
    for (std::vector<LoadedTile*>* list : {&loader_.impl_->being_read, &loader_.impl_->finished})
        for (LoadedTile* tile : *list)
            if (tile->job.kind == kind && tile->job.slot == slot) tile->job.prefetch = false;
}

LoadedTile* Loader::take(bool wait) {
    std::unique_lock lock(impl_->mutex);
    std::vector<LoadedTile*>& finished = impl_->finished;
    if (wait)
        impl_->tile_ready.wait(
            lock, [&] { return !finished.empty() || (impl_->queue.empty() && impl_->being_read.empty()); });
    if (finished.empty()) return nullptr;
    auto first = std::find_if(finished.begin(), finished.end(), [](const LoadedTile* t) { return !t->job.prefetch; });
    if (first == finished.end()) first = finished.begin();
    LoadedTile* tile = *first;
    finished.erase(first);
    return tile;
}

void Loader::recycle(LoadedTile* tile) {
    const std::lock_guard lock(impl_->mutex);
    impl_->spare[index_of(tile->job.kind)].push_back(tile);
}

std::int64_t Loader::under_way() const {
    const std::lock_guard lock(impl_->mutex);
    return static_cast<std::int64_t>(impl_->queue.size() + impl_->finished.size() + impl_->being_read.size());
}

LoaderCounters Loader::counters(TileKind kind) const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->counters[index_of(kind)];
}

std::int64_t loader_thread_bytes(const Dataset& d) {
    const auto samples = static_cast<std::int64_t>(slot_vertex_count(d.lattice.tile_cells_log2));
    const auto chain = static_cast<std::int64_t>(bc1_chain_bytes(d.texture_size_log2));
    // A payload three times (row, SQLite's copy of it, unpacked planes) and, of heights, samples and residuals.
    return 3 * std::max(chain, 4 * samples) + 8 * samples + kReaderBytes;
}

}  // namespace scree
