// What a tile costs the loader's threads: scree_loader_bench STORE [THREADS [TILES]]. Loads up to TILES (20,000) tiles
// of each kind, coarse before fine, and prints CPU time a tile by kind.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

#include "common/store/sqlite_store.h"
#include "runtime/paging/loader.h"

namespace scree {
namespace {

std::vector<TileId> tiles_of(const SqliteStore& store, TileKind kind, std::size_t limit) {
    std::vector<TileId> ids;
    (void)store.for_each(kind, [&](const SqliteStore::RowView& row) {
        if (const auto id = tile_from_key(store.dataset().lattice, row.key)) ids.push_back(*id);
        return ids.size() < limit;
    });
    return ids;
}

void measure(const SqliteStore& store, TileKind kind, int threads, std::size_t limit) {
    constexpr std::size_t kUnderWay = 64;
    const std::vector<TileId> ids = tiles_of(store, kind, limit);
    auto loader = Loader::start(store, threads, 0);
    if (!loader) {
        fmt::print(stderr, "{}\n", loader.error().message);
        return;
    }
    const auto start = std::chrono::steady_clock::now();
    std::size_t queued = 0, taken = 0, failed = 0;
    std::int64_t bytes = 0;
    while (taken < ids.size()) {
        {
            Loader::QueueEdit queue(**loader);
            for (; queued < ids.size() && queued - taken < kUnderWay; ++queued)
                queue.jobs().push_back({kind, ids[queued], 0, 0, false, static_cast<std::int64_t>(queued), {}});
        }
        for (bool wait = true; LoadedTile* tile = (*loader)->take(wait); wait = false) {
            ++taken;
            failed += tile->error.empty() ? 0 : 1;
            bytes += tile->bytes_read;
            (*loader)->recycle(tile);
        }
    }
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const LoaderCounters counters = (*loader)->counters(kind);
    const double tiles = static_cast<double>(counters.tiles);
    fmt::print("{}: {} tiles, {} failed, {:.0f} bytes a tile, {:.1f} us CPU a tile, {:.1f} us wall a tile\n",
               kind == TileKind::height ? "heights" : "textures", counters.tiles, failed,
               static_cast<double>(bytes) / tiles, 1e6 * counters.cpu_seconds / tiles, 1e6 * wall / tiles);
}

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    if (argc < 2) {
        fmt::print(stderr, "usage: scree_loader_bench STORE [THREADS [TILES]]\n");
        return 2;
    }
    auto store = scree::SqliteStore::open(argv[1]);
    if (!store) {
        fmt::print(stderr, "{}\n", store.error().message);
        return static_cast<int>(store.error().code);
    }
    const int threads = argc > 2 ? std::atoi(argv[2]) : 2;
    const std::size_t limit = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 20000;
    for (const scree::TileKind kind : {scree::TileKind::height, scree::TileKind::texture})
        scree::measure(**store, kind, threads, limit);
}
