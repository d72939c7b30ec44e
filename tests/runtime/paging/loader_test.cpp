#include "runtime/paging/loader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <thread>
#include <tuple>

#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

using test::Damage;
using test::MemoryStore;

test::SyntheticTerrain small_terrain() {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 2;
    shape.cells_x = shape.cells_y = 64;
    shape.texture_depth = 4;
    return test::SyntheticTerrain(shape, test::rough_heights(7, 500));
}

std::unique_ptr<Loader> start(const MemoryStore& store, int threads) {
    auto loader = Loader::start(store, threads, 0);
    EXPECT_TRUE(loader.ok());
    return std::move(*loader);
}

void queue_jobs(Loader& loader, const std::vector<LoadJob>& jobs) {
    Loader::QueueEdit queue(loader);
    queue.jobs().insert(queue.jobs().end(), jobs.begin(), jobs.end());
}

TEST(Loader, HandsOverWhatTheStoreHolds) {
    const auto terrain = small_terrain();
    const MemoryStore store(terrain, 100);
    const auto loader = start(store, 3);
    std::vector<LoadJob> jobs;
    for (const TileId id : terrain.tiles()) {
        jobs.push_back({TileKind::height, id, 1000 + terrain.index(id), 1});
        jobs.push_back({TileKind::texture, id, terrain.texture_index(id), 1});
    }
    queue_jobs(*loader, jobs);
    std::vector<SlotVertex> expected(slot_vertex_count(2));
    std::int64_t bytes = 0;
    std::size_t taken = 0;
    for (; LoadedTile* staged = loader->take(true); ++taken) {
        const LoadedTile& tile = *staged;
        ASSERT_EQ(tile.error, "");
        const TileId id = tile.job.id;
        if (tile.job.kind == TileKind::height) {
            ASSERT_EQ(tile.job.slot, 1000 + terrain.index(id));
            ASSERT_EQ(tile.header, terrain.tile(id)->header);
            fill_vertex_slot(terrain.tile(id)->samples, 2, expected);
            ASSERT_EQ(tile.vertices.size(), expected.size());
            for (std::size_t k = 0; k < expected.size(); ++k) {
                ASSERT_EQ(tile.vertices[k].height_n, expected[k].height_n);
                ASSERT_EQ(tile.vertices[k].next_n, expected[k].next_n);
            }
        } else {
            ASSERT_EQ(tile.job.slot, terrain.texture_index(id));
            ASSERT_EQ(tile.blocks, terrain.texture(id).blocks);
        }
        ASSERT_EQ(tile.bytes_read, store.payload_size(tile.job.kind, id));
        bytes += tile.bytes_read;
        loader->recycle(staged);
    }
    EXPECT_EQ(taken, jobs.size());
    EXPECT_EQ(bytes, store.payload_bytes());
    EXPECT_EQ(loader->under_way(), 0);
    EXPECT_FALSE(store.read_twice_at_once());
}

TEST(Loader, ReadsTheMostUrgentFirstWheneverThePrioritiesWereSet) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = small_terrain();
    for (int round = 0; round < 20; ++round) {
        const MemoryStore store(terrain);
        store.hold();
        const auto loader = start(store, 1);
        queue_jobs(*loader, {{TileKind::height, terrain.tiles()[0], 0, 0}});
        store.wait_for_reads(1);  // begun: it cannot be overtaken
        std::vector<LoadJob> jobs;
        for (int k = 1; k < 40; ++k)
            jobs.push_back({TileKind::height, terrain.tiles()[static_cast<std::size_t>(k)], k,
                            double(test::uniform(random, 0, 9))});
        queue_jobs(*loader, jobs);
        std::map<TileId, std::tuple<bool, double, std::int64_t>> rank;  // the smallest goes first
        {
            Loader::QueueEdit queue(*loader);
            EXPECT_EQ(queue.jobs().size(), jobs.size());
            for (LoadJob& job : queue.jobs()) {
                job.priority = test::uniform(random, 0, 9);
                job.prefetch = test::uniform(random, 0, 2) == 0;
                job.order = test::uniform(random, 0, 9);
                rank[job.id] = {job.prefetch, -job.priority, job.order};
            }
        }
        store.release();
        for (int k = 0; k < 40; ++k) ASSERT_NE(loader->take(true), nullptr);
        ASSERT_EQ(loader->take(true), nullptr);
        const auto order = store.order();
        ASSERT_EQ(order.size(), 40u);
        for (std::size_t k = 2; k < order.size(); ++k)
            ASSERT_LE(rank.at(order[k - 1].second), rank.at(order[k].second));
    }
}

TEST(Loader, EveryJobIsEitherRemovedFromTheQueueOrTakenOnceWhileTheQueueIsEdited) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = small_terrain();
    const MemoryStore store(terrain, 60);
    const auto loader = start(store, 4);
    std::map<std::int32_t, int> ended;  // by slot, which serves as the job's number here
    std::int32_t next = 0;
    const auto end = [&](LoadedTile* tile) {
        ++ended[tile->job.slot];
        loader->recycle(tile);
    };
    const auto take_some = [&](bool wait) {
        while (LoadedTile* tile = loader->take(wait)) end(tile);
    };
    int removed = 0;
    for (int step = 0; step < 600; ++step) {
        {
            Loader::QueueEdit queue(*loader);
            std::erase_if(queue.jobs(), [&](LoadJob& job) {
                job.priority = test::uniform(random, 0, 100);
                if (test::uniform(random, 0, 3) != 0) return false;
                ++ended[job.slot];
                ++removed;
                return true;
            });
            for (int k = test::uniform(random, 0, 6); k > 0; --k) {
                const auto id = terrain.tiles()[static_cast<std::size_t>(next) % terrain.tiles().size()];
                queue.jobs().push_back({next % 2 == 0 ? TileKind::height : TileKind::texture, id, next,
                                        double(test::uniform(random, 0, 100))});
                ++next;
            }
        }
        // At least every third frame something is read to its end; how much besides is up to the threads.
        if (step % 3 != 0) continue;
        if (LoadedTile* tile = loader->take(true)) end(tile);
        take_some(false);
    }
    take_some(true);
    EXPECT_EQ(loader->under_way(), 0);
    EXPECT_EQ(ended.size(), static_cast<std::size_t>(next));
    for (const auto& [job, times] : ended) ASSERT_EQ(times, 1) << job;
    EXPECT_GT(removed, 50);
    EXPECT_LT(removed, next - 50);
}

TEST(Loader, EndsWhileJobsAreUnderWayWithoutReadingTheRest) {
    const auto terrain = small_terrain();
    for (int round = 0; round < 5; ++round) {
        const MemoryStore store(terrain);
        {
            auto loader = Loader::start(store, 2, 20);  // reading them all would take seconds
            ASSERT_TRUE(loader.ok());
            std::vector<LoadJob> jobs;
            for (const TileId id : terrain.tiles()) jobs.push_back({TileKind::height, id, 0, 1});
            queue_jobs(**loader, jobs);
            store.wait_for_reads(1);
        }
        EXPECT_LT(store.reads_begun(), static_cast<std::int64_t>(terrain.tiles().size()) / 2);
    }
}

TEST(Loader, SaysWhyATileDidNotArriveAndGoesOn) {
    const auto terrain = small_terrain();
    MemoryStore store(terrain);
    const TileId lost = terrain.tiles()[5], cut = terrain.tiles()[6], gone = terrain.tiles()[7];
    store.damage(TileKind::height, lost, Damage::checksum);
    store.damage(TileKind::height, cut, Damage::truncated);
    store.damage(TileKind::texture, gone, Damage::missing);
    const auto loader = start(store, 1);
    queue_jobs(*loader, {{TileKind::height, lost, 0, 9},
                         {TileKind::height, cut, 1, 8},
                         {TileKind::texture, gone, 2, 7},
                         {TileKind::height, gone, 3, 6}});
    for (const std::string reason : {"checksum", "", "missing"}) {
        LoadedTile* tile = loader->take(true);
        ASSERT_NE(tile, nullptr);
        EXPECT_FALSE(tile->error.empty());
        EXPECT_NE(tile->error.find(reason), std::string::npos) << tile->error;
        EXPECT_EQ(tile->missing, reason == "missing");
        loader->recycle(tile);
    }
    LoadedTile* tile = loader->take(true);
    ASSERT_NE(tile, nullptr);
    EXPECT_EQ(tile->error, "");
    EXPECT_FALSE(tile->missing);
}

TEST(Loader, AFailedReadCountsNoBytesOfAnEarlierTile) {
    const auto terrain = small_terrain();
    MemoryStore store(terrain);
    const TileId lost = terrain.tiles()[5];
    store.damage(TileKind::height, lost, Damage::checksum);
    const auto loader = start(store, 1);
    queue_jobs(*loader, {{TileKind::height, terrain.tiles()[1], 0, 1}});
    LoadedTile* tile = loader->take(true);
    ASSERT_NE(tile, nullptr);
    EXPECT_GT(tile->bytes_read, 0);
    loader->recycle(tile);
    queue_jobs(*loader, {{TileKind::height, lost, 0, 1}});
    tile = loader->take(true);
    ASSERT_NE(tile, nullptr);
    EXPECT_FALSE(tile->error.empty());
    EXPECT_EQ(tile->bytes_read, 0);
}

TEST(Loader, AStagedTileHoldsBuffersOfItsOwnKindOnly) {
    // A budget counts one buffer a staged tile: a recycled tile that keeps the other kind's too would pass it.
    const auto terrain = small_terrain();
    const MemoryStore store(terrain);
    const auto loader = start(store, 1);
    std::set<const void*> buffers;
    for (int k = 0; k < 6; ++k) {
        const TileKind kind = k % 2 == 0 ? TileKind::height : TileKind::texture;
        queue_jobs(*loader, {{kind, terrain.tiles()[1], 0, 1}});
        LoadedTile* tile = loader->take(true);
        ASSERT_NE(tile, nullptr);
        EXPECT_EQ(kind == TileKind::height ? tile->blocks.capacity() : tile->vertices.capacity(), 0u);
        buffers.insert(kind == TileKind::height ? static_cast<const void*>(tile->vertices.data())
                                                : static_cast<const void*>(tile->blocks.data()));
        loader->recycle(tile);
    }
    EXPECT_EQ(buffers.size(), 2u) << "buffers are reused";
}

TEST(Loader, APrefetchedTileIsTakenAfterTheOthersUnlessItIsPromoted) {
    const auto terrain = small_terrain();
    for (const bool promote : {false, true}) {
        const MemoryStore store(terrain);
        const auto loader = start(store, 1);
        store.hold();
        queue_jobs(*loader, {{TileKind::height, terrain.tiles()[1], 1, 9, true}});
        store.wait_for_reads(1);
        queue_jobs(*loader, {{TileKind::height, terrain.tiles()[2], 2, 1, false}});
        if (promote) Loader::QueueEdit(*loader).promote(TileKind::height, 1);
        store.release();
        store.wait_for_reads(2);
        while (loader->counters(TileKind::height).tiles < 2) std::this_thread::yield();
        EXPECT_EQ(loader->take(false)->job.slot, promote ? 1 : 2);
        EXPECT_EQ(loader->take(false)->job.slot, promote ? 2 : 1);
    }
}

TEST(Loader, CountsTilesTheirProcessorTimeAndTheirWayFromTheQueue) {
    const auto terrain = small_terrain();
    const MemoryStore store(terrain);
    auto loader = Loader::start(store, 1, 30);
    ASSERT_TRUE(loader.ok());
    queue_jobs(**loader, {{TileKind::height, terrain.tiles()[1], 0, 2}, {TileKind::height, terrain.tiles()[2], 1, 1}});
    for (int k = 0; k < 2; ++k) ASSERT_NE((*loader)->take(true), nullptr);
    const LoaderCounters heights = (*loader)->counters(TileKind::height);
    EXPECT_EQ(heights.tiles, 2);
    EXPECT_GT(heights.cpu_seconds, 0);
    EXPECT_LT(heights.cpu_seconds, heights.latency_seconds) << "a delay is no processor time";
    EXPECT_GE(heights.latency_seconds, 0.030 + 0.060) << "the second waited for the first";
    EXPECT_EQ((*loader)->counters(TileKind::texture).tiles, 0);
}

TEST(Loader, EndsWithoutWaitingForTheDelayOfASlowDisk) {
    const auto terrain = small_terrain();
    const MemoryStore store(terrain);
    {
        auto loader = Loader::start(store, 2, 1 << 30);  // twelve days
        ASSERT_TRUE(loader.ok());
        queue_jobs(**loader,
                   {{TileKind::height, terrain.tiles()[1], 0, 1}, {TileKind::height, terrain.tiles()[2], 1, 1}});
        EXPECT_EQ((*loader)->under_way(), 2);
        EXPECT_EQ((*loader)->take(false), nullptr);
    }
    EXPECT_EQ(store.reads_begun(), 0);
}

TEST(Loader, EndsAfterTheReadInProgressAndReadsNoOther) {
    const auto terrain = small_terrain();
    const MemoryStore store(terrain);
    store.hold();
    std::thread releases;
    {
        const auto loader = start(store, 1);
        queue_jobs(*loader,
                   {{TileKind::height, terrain.tiles()[1], 0, 1}, {TileKind::height, terrain.tiles()[2], 1, 1}});
        store.wait_for_reads(1);
        releases = std::thread([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(30));
            store.release();
        });
    }
    EXPECT_EQ(store.reads_begun(), 1);
    releases.join();
}

}  // namespace
}  // namespace scree
