#include "runtime/lod/mesh_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "tests/common/counted_new.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

using Indices = std::vector<std::uint32_t>;

Indices random_indices(test::Random& random, std::size_t count) {
    Indices indices(count);
    for (std::uint32_t& index : indices) index = static_cast<std::uint32_t>(random());
    return indices;
}

Indices copy(std::span<const std::uint32_t> indices) { return {indices.begin(), indices.end()}; }

struct Put {
    MeshRange range;
    Indices indices;
};

/// A pool, and all that was ever put into it.
class Log {
public:
    Log(test::Random& random, std::size_t capacity, std::size_t largest) : pool(capacity, largest), random_(random) {}
    void put(std::size_t count) {
        Indices indices = random_indices(random_, count);
        puts.push_back({pool.put(indices), std::move(indices)});
    }
    void put_any() { put(any_size()); }
    /// Meshes of any sizes, `count` indices in all.
    void put_many(std::size_t count) {
        while (count > 0) {
            const std::size_t size = std::min(any_size(), count);
            put(size);
            count -= size;
        }
    }
    /// Indices in the newest meshes that are held, back to the first that is not.
    std::size_t newest_held() const {
        std::size_t held = 0;
        for (auto it = puts.rbegin(); it != puts.rend() && pool.holds(it->range); ++it) held += it->indices.size();
        return held;
    }

    MeshPool pool;
    std::vector<Put> puts;

private:
    std::size_t any_size() {
        return static_cast<std::size_t>(test::uniform(random_, 1, static_cast<int>(pool.largest_mesh())));
    }
    test::Random& random_;
};

TEST(MeshPool, WhatIsHeldIsWhatWasPutAndOnlyTheOldestGo) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const auto& [capacity, largest] : {std::pair{100, 30}, {64, 64}, {1000, 9}, {7, 1}}) {
        Log log(random, static_cast<std::size_t>(capacity), static_cast<std::size_t>(largest));
        for (int step = 0; step < 400; ++step) {
            log.put_any();
            bool held = false;
            for (const Put& put : log.puts) {
                ASSERT_LE(put.range.first + put.range.count, log.pool.capacity());
                if (!log.pool.holds(put.range)) {
                    ASSERT_FALSE(held) << "a newer mesh is gone";
                    continue;
                }
                held = true;
                ASSERT_EQ(copy(log.pool.indices(put.range)), put.indices);
            }
            ASSERT_TRUE(log.pool.holds(log.puts.back().range));
            // All that fits, less the end that was skipped and the mesh that is overwritten in part.
            const auto total = std::accumulate(log.puts.begin(), log.puts.end(), std::size_t{0},
                                               [](std::size_t sum, const Put& put) { return sum + put.range.count; });
            ASSERT_GT(log.newest_held() + 2 * log.pool.largest_mesh(), std::min(total, log.pool.capacity()));
        }
        EXPECT_FALSE(log.pool.holds(log.puts.front().range));
    }
}

TEST(MeshPool, WhatOutlastsIsStillHeldAfterAnyMeshesOfSoMany) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int outlasted = 0, refused = 0;
    for (int round = 0; round < 600; ++round) {
        Log log(random, 200, static_cast<std::size_t>(test::uniform(random, 1, 90)));
        for (int k = test::uniform(random, 1, 40); k > 0; --k) log.put_any();
        const Put kept =
            log.puts[static_cast<std::size_t>(test::uniform(random, 0, static_cast<int>(log.puts.size()) - 1))];
        const auto count = static_cast<std::size_t>(test::uniform(random, 0, 200));
        const bool outlasts = log.pool.outlasts(kept.range, count);
        log.put_many(count);
        if (outlasts) {
            ASSERT_TRUE(log.pool.holds(kept.range));
            ASSERT_EQ(copy(log.pool.indices(kept.range)), kept.indices);
            ++outlasted;
        } else if (!log.pool.holds(kept.range)) {
            ++refused;
        }
    }
    EXPECT_GT(outlasted, 30);
    EXPECT_GT(refused, 30);
}

TEST(MeshPool, WhereThereIsRoomAllOfAFrameIsHeldAtItsEnd) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int fitted = 0, too_much = 0;
    for (int round = 0; round < 600; ++round) {
        Log log(random, 200, static_cast<std::size_t>(test::uniform(random, 1, 90)));
        for (int k = test::uniform(random, 0, 20); k > 0; --k) log.put_any();
        const std::size_t before = log.puts.size();
        const auto count = static_cast<std::size_t>(test::uniform(random, 1, 230));
        const bool room = log.pool.room_for(count);
        log.put_many(count);
        const bool all = std::all_of(log.puts.begin() + static_cast<std::ptrdiff_t>(before), log.puts.end(),
                                     [&](const Put& put) { return log.pool.holds(put.range); });
        if (room) {
            ASSERT_TRUE(all);
        }
        fitted += room ? 1 : 0;
        too_much += all ? 0 : 1;
    }
    EXPECT_GT(fitted, 200);
    EXPECT_GT(too_much, 30);
}

TEST(MeshPool, ClearedItHoldsNothingAndHasRoomForAllThatItCanHold) {
    test::Random random(test::seed());
    Log log(random, 100, 60);
    for (int k = 0; k < 5; ++k) log.put(37);
    EXPECT_FALSE(log.pool.room_for(100));
    log.pool.clear();
    for (const Put& put : log.puts) EXPECT_FALSE(log.pool.holds(put.range));
    EXPECT_TRUE(log.pool.room_for(100));
    EXPECT_FALSE(log.pool.room_for(101));
    log.puts.clear();
    log.put(60);
    log.put(40);
    EXPECT_EQ(log.newest_held(), 100u);
    log.put(1);
    EXPECT_EQ(log.newest_held(), 41u);
}

TEST(MeshPool, AMeshOfItsOwnIsPutAgainUnchangedEvenOverItself) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 300; ++round) {
        Log log(random, 100, 70);
        for (int k = test::uniform(random, 1, 12); k > 0; --k) log.put_any();
        for (const Put& put : std::vector<Put>(log.puts)) {
            if (!log.pool.holds(put.range)) continue;
            const MeshRange again = log.pool.put(log.pool.indices(put.range));
            ASSERT_EQ(copy(log.pool.indices(again)), put.indices);
        }
    }
}

TEST(MeshPool, SectionsAreRangesToo) {
    test::Random random(test::seed());
    Log log(random, 50, 20);
    for (int k = 0; k < 4; ++k) log.put(17);
    const Put& last = log.puts.back();
    const MeshRange section = last.range.section(5, 9);
    ASSERT_TRUE(log.pool.holds(section));
    EXPECT_EQ(copy(log.pool.indices(section)), Indices(last.indices.begin() + 5, last.indices.begin() + 14));
    EXPECT_FALSE(log.pool.holds(last.range.section(17, 0)));
    EXPECT_FALSE(log.pool.holds(last.range.section(9, 9))) << "past what was written";
    EXPECT_FALSE(log.pool.holds(MeshRange{}));
}

TEST(MeshPool, PiecesWrittenSinceKeepACopyUpToDateAndAreNoMoreThanThat) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 100; ++round) {
        Log log(random, 120, static_cast<std::size_t>(test::uniform(random, 1, 70)));
        Indices mirror(log.pool.capacity(), 0);
        std::uint64_t seen = 0;
        for (int frame = 0; frame < 40; ++frame) {
            for (int k = test::uniform(random, 0, 6); k > 0; --k) log.put_any();
            if (test::uniform(random, 0, 9) == 0) log.pool.clear();
            if (test::uniform(random, 0, 19) == 0) seen = 0;  // a new copy
            std::size_t written = 0;
            const auto pieces = log.pool.written_since(seen);
            for (const MeshPool::Piece& piece : pieces) {
                ASSERT_LE(piece.first + piece.indices.size(), mirror.size());
                std::copy(piece.indices.begin(), piece.indices.end(), mirror.begin() + piece.first);
                written += piece.indices.size();
            }
            ASSERT_LE(written, log.pool.written() - seen);
            ASSERT_TRUE(!pieces[0].indices.empty() || pieces[1].indices.empty());
            seen = log.pool.written();
            for (const Put& put : log.puts)
                if (log.pool.holds(put.range)) {
                    const auto first = mirror.begin() + put.range.first;
                    ASSERT_EQ(Indices(first, first + put.range.count), put.indices);
                }
        }
    }
}

TEST(MeshPool, AllocatesNothingAfterItIsMade) {
    MeshPool pool(1000, 300);
    const Indices mesh(300, 7);
    const std::int64_t before = test::allocations();
    std::uint64_t seen = 0;
    for (int k = 0; k < 20; ++k) {
        const MeshRange range = pool.put(mesh);
        EXPECT_TRUE(pool.holds(range) && pool.indices(range)[299] == 7);
        EXPECT_FALSE(pool.written_since(seen)[0].indices.empty());
        seen = pool.written();
        if (k == 10) pool.clear();
    }
    EXPECT_EQ(test::allocations(), before);
    EXPECT_EQ(pool.bytes(), 4000u);
}

}  // namespace
}  // namespace scree
