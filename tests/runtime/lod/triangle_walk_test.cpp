// The flat walk writes what the recursive one does: same triangles, same order.
#include "runtime/lod/triangle_walk.h"

#include <gtest/gtest.h>

#include <random>

#include "common/height_tile.h"
#include "runtime/lod/block_selection.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

std::vector<std::uint8_t> with_sentinel(std::span<const std::uint8_t> active) {
    std::vector<std::uint8_t> bytes(active.begin(), active.end());
    bytes.push_back(0);
    return bytes;
}

// A few vertices, with what they depend on.
BlockSelection random_selection(const Bisection& b, test::Random& random) {
    BlockSelection selection(b);
    const auto order = b.coarse_to_fine();
    std::uniform_int_distribution<std::size_t> place(0, order.size() - 1);
    for (std::size_t k = std::uniform_int_distribution<std::size_t>(0, order.size() / 2)(random); k-- > 0;)
        selection.add(order[place(random)]);
    return selection;
}

TEST(TriangleWalk, WritesWhatTheRecursionWrites) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 1; n <= kMaxTileCellsLog2; ++n)
        for (const bool odd : {false, true})
            for (int round = 0; round < (n > 6 ? 2 : 8); ++round) {
                const Bisection b(n, odd);
                const TriangleWalk walk(b);
                BlockSelection selection(b);
                if (round > 1) selection = random_selection(b, random);
                if (round == 1)
                    for (const std::int32_t v : b.coarse_to_fine()) selection.add(v);
                std::vector<std::uint32_t> expected;
                selection.emit(expected);
                for (std::uint32_t& v : expected) v += 1000;
                std::vector<std::uint32_t> out(TriangleWalk::room(b));
                const auto active = with_sentinel(selection.active());
                const std::uint32_t* end = walk.emit(active.data(), 1000, out.data());
                out.resize(static_cast<std::size_t>(end - out.data()));
                ASSERT_EQ(out, expected) << "n " << n << ", odd " << odd << ", round " << round;
            }
}

TEST(TriangleWalk, WritesCellsOneBehindTheOther) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 1; n <= 6; ++n)
        for (int level = 1; level <= n; ++level) {
            const Bisection b(n, n % 2 != 0);
            const TriangleWalk walk(b);
            BlockSelection selection = random_selection(b, random);
            const int side = b.cells() >> level;
            for (int j = 0; j <= b.cells(); j += side)
                for (int i = 0; i <= b.cells(); i += side) selection.add(b.index(i, j));
            std::vector<std::uint32_t> expected, out(TriangleWalk::room(b));
            const auto active = with_sentinel(selection.active());
            std::uint32_t* end = out.data();
            for (int code = 0; code < 1 << (2 * level); ++code) {
                int x = 0, y = 0;
                for (int bit = 0; bit < level; ++bit) {
                    x |= (code >> (2 * bit) & 1) << bit;
                    y |= (code >> (2 * bit + 1) & 1) << bit;
                }
                selection.emit(n - level, x, y, expected);
                end = walk.emit_cell(active.data(), level, code, end);
            }
            out.resize(static_cast<std::size_t>(end - out.data()));
            ASSERT_EQ(out, expected) << "n " << n << ", level " << level;
        }
}

}  // namespace
}  // namespace scree
