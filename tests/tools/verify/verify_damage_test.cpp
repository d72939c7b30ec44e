// One thing damaged at a time, and verify says which.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/store/height_codec.h"
#include "common/store/seed_codec.h"
#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/tools/verify/small_store.h"
#include "tools/verify/verify.h"

namespace scree {
namespace {

using test::SmallStore;

constexpr test::SmallTerrain kTerrain{
    .cells_x = 30, .cells_y = 16, .texture_deepest_level = 2, .present_percent = 80, .seed = 5};

Result<VerifyReport> try_verify_after(const std::function<void(SmallStore&)>& damage, const std::string& sql,
                                      const test::SmallTerrain& terrain) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    SmallStore store = test::make_small_store(terrain);
    if (damage) damage(store);
    store.write(path);
    if (!sql.empty()) {
        sqlite3* db = nullptr;
        EXPECT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
        EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
        sqlite3_close(db);
    }
    return verify_store(path);
}

VerifyReport verify_after(const std::function<void(SmallStore&)>& damage, const std::string& sql = {},
                          const test::SmallTerrain& terrain = kTerrain) {
    const auto report = try_verify_after(damage, sql, terrain);
    EXPECT_TRUE(report.ok()) << report.error().message;
    return report.ok() ? *report : VerifyReport{};
}

testing::AssertionResult names(const VerifyReport& report, const std::string& text) {
    std::string all;
    for (const auto& problem : report.problems) {
        if (problem.find(text) != std::string::npos) return testing::AssertionSuccess();
        all += "\n" + problem;
    }
    return testing::AssertionFailure() << "no problem says '" << text << "' among:" << all;
}

TEST(VerifyDamage, AnUndamagedStoreHasNone) { EXPECT_TRUE(verify_after({}).sound()); }

TEST(VerifyDamage, AnOddSampleOnTheEdgeOfANeighbour) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        s.heights.at({2, 1, 1}).samples[1 * 5 + 4] += 1;  // east edge, row 1: no coarser tile has it
        s.recompute_ranges();
    });
    EXPECT_EQ(report.shared_samples_differing, 1);
    EXPECT_TRUE(names(report, "height tile 2/1/1: 1 of 5 samples differ from those of its neighbour 2/2/1"));
}

TEST(VerifyDamage, ASampleInsideThatTheParentAlsoHas) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        s.heights.at({2, 1, 1}).samples[2 * 5 + 2] += 1;
        s.recompute_ranges();
    });
    EXPECT_EQ(report.shared_samples_differing, 1);
    EXPECT_TRUE(names(report, "height tile 2/1/1: 1 samples differ from its parent's"));
}

TEST(VerifyDamage, ASampleOnTheEdgeBetweenTwoRoots) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        s.heights.at({0, 1, 0}).samples[2 * 5 + 0] += 1;
        s.recompute_ranges();
    });
    EXPECT_EQ(report.shared_samples_differing, 3);  // the other root and two children
}

TEST(VerifyDamage, EveryBoundOneFloatBelowItsTruth) {
    const SmallStore sound = test::make_small_store(kTerrain);
    int lowered = 0;
    for (const auto& [id, tile] : sound.heights)
        for (std::size_t g = 0; g < 2; ++g) {
            const auto own = tile.header.own.error_n;
            const float below = std::nextafter(own[g], -1.0f);
            if (below < 0 || (g == 1 && below < own[0])) continue;  // the codec refuses errors that fall
            const TileId place = id;
            const VerifyReport report = verify_after([&](SmallStore& s) {
                s.heights.at(place).header.own.error_n[g] = below;
                s.copy_bounds_to_parents();
            });
            // Saturation may hold a level above its own truth; the deepest and coarsest of each tile is the truth
            // itself here.
            const bool saturated_only = id.level < sound.dataset.lattice.deepest_level && g == 1 && own[1] == own[0];
            EXPECT_TRUE(report.bound_violations >= 1 || saturated_only)
                << id.level << "/" << id.x << "/" << id.y << " geomip " << g;
            EXPECT_EQ(report.shared_samples_differing, 0);
            ++lowered;
        }
    EXPECT_GT(lowered, 50);
}

TEST(VerifyDamage, ABoundAboveTheTruthIsAllowedWhenParentsKnowIt) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        for (auto& [id, tile] : s.heights)
            for (std::size_t g = 0; g < 2; ++g) tile.header.own.error_n[g] += 100;
        s.copy_bounds_to_parents();
    });
    EXPECT_TRUE(report.sound());
}

TEST(VerifyDamage, AParentsBoundBelowItsChildsAtTheSameStride) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        s.heights.at({2, 0, 0}).header.own.error_n[1] += 1e6f;
        s.copy_bounds_to_parents();
    });
    EXPECT_EQ(report.bound_violations, 1);
    EXPECT_TRUE(names(report, "height tile 1/0/0: error"));
}

TEST(VerifyDamage, AParentThatHoldsOtherBoundsThanItsChild) {
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.heights.at({1, 0, 0}).header.children[3].error_n[0] = 0;
                      }),
                      "height tile 2/1/1: its bounds differ"));
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.heights.at({0, 0, 0}).header.children[0].max_n += 1;
                      }),
                      "height tile 1/0/0: its bounds differ"));
}

TEST(VerifyDamage, ARangeThatIsTooNarrowOrTooWide) {
    for (const int change : {-1, 1})
        for (const TileId id : {TileId{0, 0, 0}, TileId{1, 1, 0}, TileId{2, 2, 2}}) {
            const VerifyReport report = verify_after([&](SmallStore& s) {
                s.heights.at(id).header.own.max_n += change;
                s.copy_bounds_to_parents();
            });
            EXPECT_TRUE(names(report, "height tile " + std::to_string(id.level) + "/" + std::to_string(id.x) + "/" +
                                          std::to_string(id.y) + ": height range"));
        }
}

TEST(VerifyDamage, AChildBitWithoutItsRowAndARowWithoutItsBit) {
    const VerifyReport missing = verify_after([](SmallStore& s) {
        s.heights.erase({2, 1, 1});
        s.dataset.height_tiles -= 1;
    });
    EXPECT_TRUE(names(missing, "height tile 2/1/1 is missing"));
    const VerifyReport orphan = verify_after([](SmallStore& s) {
        HeightTileHeader& header = s.heights.at({1, 0, 0}).header;
        header.child_mask = static_cast<std::uint8_t>(header.child_mask & ~8u);
        header.children[3] = {};
    });
    EXPECT_TRUE(names(orphan, "height tile 2/1/1 is an orphan: its parent does not know it"));
}

TEST(VerifyDamage, AMissingInnerTileLeavesOrphans) {
    const VerifyReport report = verify_after([](SmallStore& s) { s.heights.erase({1, 1, 1}); });
    EXPECT_TRUE(names(report, "height tile 1/1/1 is missing"));
    EXPECT_TRUE(names(report, "height tile 2/2/2 is an orphan: its parent is not stored"));
    EXPECT_TRUE(names(report, "dataset: "));
}

TEST(VerifyDamage, AMissingRoot) {
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.heights.erase({0, 1, 0});
                      }),
                      "texture tile 0/1/0 has no height tile"));
}

TEST(VerifyDamage, PresenceBits) {
    // A cell taken away: its texels should be transparent, the count is wrong.
    const VerifyReport away = verify_after([](SmallStore& s) {
        auto tile = std::find_if(s.heights.begin(), s.heights.end(), [](const auto& t) { return t.first.level == 2; });
        if (tile->second.presence.empty()) tile->second.presence.assign(16, 1);
        *std::find(tile->second.presence.begin(), tile->second.presence.end(), 1) = 0;
    });
    EXPECT_TRUE(names(away, "texels are transparent where there are heights"));
    EXPECT_TRUE(names(away, "dataset: "));
    // A cell outside the data, east of column 30.
    const VerifyReport outside = verify_after([](SmallStore& s) {
        for (auto& [id, tile] : s.heights)
            if (id.level == 2 && id.x == 7 && !tile.presence.empty()) tile.presence[3] = 1;
    });
    EXPECT_TRUE(names(outside, "cells outside the data's extent are present"));
    const VerifyReport none = verify_after([](SmallStore& s) { s.heights.at({2, 1, 1}).presence.assign(16, 0); });
    EXPECT_TRUE(names(none, "height tile 2/1/1 is stored without a present cell"));
    const VerifyReport inner = verify_after([](SmallStore& s) { s.heights.at({1, 0, 0}).presence.assign(16, 1); });
    EXPECT_TRUE(names(inner, "height tile 1/0/0 holds presence bits"));
}

TEST(VerifyDamage, EveryTransparentTexelOfEveryMip) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 60; ++k) {
        std::string tile_name;
        const VerifyReport report = verify_after([&](SmallStore& s) {
            auto tile =
                std::next(s.textures.begin(), test::uniform(random, 0, static_cast<int>(s.textures.size()) - 1));
            tile_name = "texture tile " + std::to_string(tile->first.level) + "/" + std::to_string(tile->first.x) +
                        "/" + std::to_string(tile->first.y);
            auto& blocks = tile->second.blocks;
            const int block = test::uniform(random, 0, static_cast<int>(blocks.size()) / 8 - 1);
            const int texel = test::uniform(random, 0, 15);
            std::uint8_t& selectors = blocks[static_cast<std::size_t>(8 * block + 4 + texel / 4)];
            selectors = static_cast<std::uint8_t>(selectors ^ 3 << (2 * (texel % 4)));  // 0 and 3 change places
        });
        ASSERT_TRUE(names(report, tile_name + ": 1 texels are transparent"));
        EXPECT_EQ(report.problems.size(), 1u);
    }
}

TEST(VerifyDamage, FourColourBlocksCannotHoldTransparency) {
    const VerifyReport report = verify_after([](SmallStore& s) {
        for (auto& [id, tile] : s.textures)
            for (std::size_t b = 0; b < tile.blocks.size(); b += 8)
                if (tile.blocks[b + 4] == 0xFF) {
                    std::swap(tile.blocks[b], tile.blocks[b + 2]);
                    std::swap(tile.blocks[b + 1], tile.blocks[b + 3]);
                    return;
                }
    });
    EXPECT_TRUE(names(report, "texels are transparent where there are heights or opaque"));
}

TEST(VerifyDamage, TextureRows) {
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.textures.erase({2, 1, 1});
                      }),
                      "texture tile 2/1/1 is missing"));
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.textures.at({1, 0, 0}).child_mask ^= 1;
                      }),
                      "texture tile 1/0/0: child bits"));
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.textures.at({2, 0, 0}).child_mask = 1;
                      }),
                      "texture tile 2/0/0: child bits 0001 should be 0000"));
    EXPECT_TRUE(names(verify_after([](SmallStore& s) {
                          s.textures[{3, 0, 0}] = s.textures.begin()->second;
                      }),
                      "texture tile 3/0/0 lies below the deepest level 2"));
}

TEST(VerifyDamage, TextureRowsBelowTheHeights) {
    test::SmallTerrain deep = kTerrain;
    deep.texture_deepest_level = 4;
    EXPECT_TRUE(verify_after({}, {}, deep).sound());
    EXPECT_TRUE(names(verify_after(
                          [](SmallStore& s) {
                              s.textures.erase({4, 3, 3});
                          },
                          {}, deep),
                      "texture tile 4/3/3 is missing"));
    EXPECT_TRUE(names(verify_after(
                          [](SmallStore& s) {
                              s.textures.erase({3, 1, 1});
                          },
                          {}, deep),
                      "texture tile 4/2/2 is an orphan: its parent is not stored"));
    const VerifyReport extra = verify_after(
        [](SmallStore& s) {
            const TextureTile some = s.textures.at({4, 3, 3});
            for (std::int64_t k = 0; k < 32 * 16; ++k) s.textures.insert({{4, k % 32, k / 32}, some});
        },
        {}, deep);
    EXPECT_TRUE(names(extra, "is an orphan: its parent does not know it"));
}

TEST(VerifyDamage, DatasetCountsAndRanges) {
    EXPECT_TRUE(
        names(verify_after([](SmallStore& s) { s.dataset.height_tiles += 1; }), "height tiles, the table holds"));
    EXPECT_TRUE(
        names(verify_after([](SmallStore& s) { s.dataset.texture_tiles += 1; }), "texture tiles, the table holds"));
    EXPECT_TRUE(
        names(verify_after([](SmallStore& s) { s.dataset.present_cells += 1; }), "present cells, the tiles hold"));
    EXPECT_TRUE(names(verify_after([](SmallStore& s) { s.dataset.max_height_m = 1e6; }), "dataset: heights"));
}

TEST(VerifyDamage, RowsThatSqliteStillReads) {
    EXPECT_TRUE(names(verify_after({}, "UPDATE height SET payload = zeroblob(length(payload)) WHERE key = 9"),
                      "checksum does not match"));
    EXPECT_TRUE(names(verify_after({}, "UPDATE texture SET codec = 9 WHERE key = 9"), "checksum does not match"));
    EXPECT_TRUE(
        names(verify_after({}, "UPDATE height SET payload = CAST(payload AS TEXT) WHERE key = 9"), "other types"));
    EXPECT_TRUE(names(verify_after({}, "INSERT INTO height VALUES(-4, 0, 0, x'00')"), "-4 is no key of this lattice"));
    EXPECT_TRUE(names(verify_after({}, "DELETE FROM height WHERE key >= 0"), "no root is stored"));
}

TEST(VerifyDamage, TheSchema) {
    EXPECT_TRUE(names(verify_after({}, "CREATE TABLE more(x)"), "unexpected table 'more'"));
    EXPECT_TRUE(names(verify_after({}, "CREATE TRIGGER t AFTER INSERT ON height BEGIN SELECT 1; END"),
                      "unexpected trigger 't'"));
    EXPECT_TRUE(names(verify_after({}, "ALTER TABLE height ADD COLUMN more"), "other columns"));
    EXPECT_TRUE(names(verify_after({}, "CREATE VIEW more AS SELECT * FROM height"), "unexpected view"));
    EXPECT_TRUE(names(verify_after({}, "INSERT INTO dataset SELECT 2, codec, checksum, payload FROM dataset"),
                      "table 'dataset' has 2 rows"));
    EXPECT_TRUE(names(verify_after({}, "CREATE TABLE more(x)"), "is damaged")) << "written without page checksums";
}

TEST(VerifyDamage, AStoreWithoutATableOfSeedsIsOne) {
    const VerifyReport report = verify_after({}, "DROP TABLE seed");
    EXPECT_FALSE(names(report, "schema"));
    EXPECT_FALSE(names(report, "SQLite"));
    EXPECT_TRUE(names(verify_after({}, "DROP TABLE seed; CREATE TABLE seed(key INTEGER PRIMARY KEY, codec)"),
                      "table 'seed' has other columns"));
}

TEST(VerifyDamage, Seeds) {
    test::SmallTerrain terrain = kTerrain;
    terrain.texture_deepest_level = 5;
    const int size = 1 << terrain.texture_size_log2;
    const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(size * size) * 4, 200);
    const auto good = encode_seed(pixels.data(), static_cast<std::size_t>(size) * 4, size);
    const auto row = [&](std::int64_t key, const std::vector<std::uint8_t>& payload) {
        std::string bytes;
        for (const std::uint8_t b : payload) bytes += fmt::format("{:02x}", b);
        return fmt::format("INSERT INTO seed VALUES({}, 1, {}, x'{}')", key,
                           static_cast<std::int64_t>(row_checksum(static_cast<int>(TileKind::seed), key, 1, payload)),
                           bytes);
    };
    const VerifyReport one = verify_after({}, row(8, good), terrain);
    for (const char* text : {"seed 1/0/0", "seed level", "checksum", "key"}) EXPECT_FALSE(names(one, text));
    EXPECT_TRUE(names(one, "table 'seed': 1 rows for "));
    EXPECT_TRUE(
        names(verify_after({}, row(8, good) + "; UPDATE seed SET payload = x'02'", terrain), "seed 1/0/0: checksum"));
    EXPECT_TRUE(names(verify_after({}, row(8, {3, 1, 2}), terrain), "seed 1/0/0: seed: compressed part"));
    EXPECT_TRUE(names(verify_after({}, row(32, good), terrain), "seed 2/0/0 is not of the seed level 1"));
    EXPECT_TRUE(names(verify_after({}, row(0, good), terrain), "table 'seed': 0 is no key of this lattice"));
}

TEST(VerifyDamage, AViewInPlaceOfATableIsNotQueriedAtAll) {
    const auto report =
        try_verify_after({}, "DROP TABLE texture; CREATE VIEW texture AS SELECT * FROM height", kTerrain);
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::store);
    EXPECT_NE(report.error().message.find("tables of a store are missing"), std::string::npos)
        << report.error().message;
}

TEST(VerifyDamage, ThousandsOfProblemsAreCountedNotListed) {
    test::SmallTerrain large = kTerrain;
    large.cells_x = 120;
    large.cells_y = 64;
    const VerifyReport report = verify_after(
        [](SmallStore& s) {
            for (auto& [id, tile] : s.heights) tile.header.own.max_n = kMaxHeightUnits;
            s.copy_bounds_to_parents();
        },
        {}, large);
    ASSERT_EQ(report.problems.size(), 101u);
    EXPECT_NE(report.problems.back().find("more problems"), std::string::npos);
}

TEST(VerifyDamage, AnyFlippedBitIsAProblemOrAnErrorNeverACrash) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    test::make_small_store({.cells_x = 8, .cells_y = 8, .texture_deepest_level = 2}).write(path);
    const auto bytes = test::read_bytes(path);
    for (int k = 0; k < 1500; ++k) {
        auto copy = bytes;
        const std::size_t bit = k < 800 ? static_cast<std::size_t>(k) : random() % (bytes.size() * 8);
        copy[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
        test::write_bytes(path, copy);
        const auto report = verify_store(path);
        ASSERT_TRUE(!report.ok() || !report->problems.empty()) << "bit " << bit;
    }
}

TEST(VerifyDamage, RandomBytesOverAPageAreAProblemOrAnErrorNeverACrash) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    test::make_small_store({.cells_x = 16, .cells_y = 16}).write(path);
    const auto bytes = test::read_bytes(path);
    for (int k = 0; k < 400; ++k) {
        auto copy = bytes;
        const std::size_t from = k % 2 == 0 ? random() % copy.size() : random() % (copy.size() / 16384) * 16384;
        const std::size_t to = std::min(copy.size(), from + random() % 200 + 1);
        for (std::size_t b = from; b < to; ++b) copy[b] = static_cast<std::uint8_t>(random());
        test::write_bytes(path, copy);
        const auto report = verify_store(path);
        ASSERT_TRUE(!report.ok() || !report->problems.empty() || copy == bytes) << from << " to " << to;
    }
    for (int k = 0; k < 100; ++k) {
        auto copy = bytes;
        copy.resize(random() % bytes.size());
        test::write_bytes(path, copy);
        const auto report = verify_store(path);
        ASSERT_TRUE(!report.ok() || !report->problems.empty()) << "cut to " << copy.size();
    }
}

constexpr test::SmallTerrain kVarying{
    .cells_x = 62, .cells_y = 64, .texture_deepest_level = 4, .present_percent = 90, .seed = 11, .varying = true};

VerifyReport verify_varying_after(const std::function<void(SmallStore&)>& damage) {
    return verify_after(damage, {}, kVarying);
}

// Extents that share an edge or a part of one.
bool share_an_edge(const Lattice& l, TileId a, TileId b) {
    const LatticePoint p = l.corner(a), q = l.corner(b);
    const std::int64_t u = l.tile_extent(a.level), v = l.tile_extent(b.level);
    const std::int64_t wide = std::min(p.i + u, q.i + v) - std::max(p.i, q.i);
    const std::int64_t high = std::min(p.j + u, q.j + v) - std::max(p.j, q.j);
    return (wide == 0 && high > 0) || (high == 0 && wide > 0);
}

TEST(VerifyDamage, EveryTileMoreThanALevelBelowALeafBesideItIsNamed) {
    SCREE_TRACE_SEED();
    int ungraded = 0, graded = 0;
    for (std::uint64_t k = 0; k < 30; ++k) {
        test::SmallTerrain terrain = kVarying;
        terrain.seed = test::seed() + k;
        terrain.graded = false;
        terrain.texture_deepest_level = 1;
        SCOPED_TRACE("seed " + std::to_string(terrain.seed));
        const SmallStore store = test::make_small_store(terrain);
        const VerifyReport report = verify_after({}, {}, terrain);
        int pairs = 0;
        for (const auto& [id, tile] : store.heights)
            for (const auto& [leaf, other] : store.heights) {
                if (!other.header.is_leaf() || leaf.level >= id.level - 1) continue;
                if (!share_an_edge(store.dataset.lattice, id, leaf)) continue;
                ++pairs;
                // A parent's side is named once, by one of the two tiles along it.
                const std::string beside = " lies beside the leaf " + std::to_string(leaf.level) + "/" +
                                           std::to_string(leaf.x) + "/" + std::to_string(leaf.y);
                bool named = false;
                for (int q = 0; q < 4; ++q) {
                    const TileId sibling = child_of(parent_of(id), q);
                    const std::string name = "height tile " + std::to_string(sibling.level) + "/" +
                                             std::to_string(sibling.x) + "/" + std::to_string(sibling.y) + beside;
                    for (const std::string& problem : report.problems) named = named || problem.starts_with(name);
                }
                EXPECT_TRUE(named) << id.level << "/" << id.x << "/" << id.y << beside;
            }
        EXPECT_EQ(report.sound(), pairs == 0);
        ++(pairs > 0 ? ungraded : graded);
    }
    EXPECT_GT(ungraded, 5);
    EXPECT_GT(graded, 1);
}

TEST(VerifyDamage, EveryAncestorsBoundOverLeavesOfVariousDepths) {
    const SmallStore sound = test::make_small_store(kVarying);
    const int deepest = sound.dataset.lattice.deepest_level;
    int over_mixed = 0;
    for (const auto& [id, tile] : sound.heights) {
        if (tile.header.is_leaf()) continue;
        const auto own = tile.header.own.error_n;
        const float below = std::nextafter(own[1], -1.0f);
        if (below < own[0]) continue;  // the codec refuses errors that fall
        const TileId place = id;
        const VerifyReport report = verify_varying_after([&](SmallStore& s) {
            s.heights.at(place).header.own.error_n[1] = below;
            s.copy_bounds_to_parents();
        });
        EXPECT_GE(report.bound_violations, 1) << id.level << "/" << id.x << "/" << id.y;
        over_mixed += id.level + 1 < deepest ? 1 : 0;
    }
    EXPECT_GT(over_mixed, 1);
}

TEST(VerifyDamage, PresenceOfALeafAboveTheDeepestLevel) {
    const auto coarse_leaf = [](SmallStore& s) -> std::pair<const TileId, HeightTile>& {
        const int deepest = s.dataset.lattice.deepest_level;
        return *std::find_if(s.heights.begin(), s.heights.end(), [&](const auto& tile) {
            return tile.second.header.is_leaf() && tile.first.level < deepest && tile.second.presence.empty();
        });
    };
    const VerifyReport fewer = verify_varying_after([&](SmallStore& s) {
        auto& presence = coarse_leaf(s).second.presence;
        presence.assign(16, 1);
        presence[5] = 0;
    });
    EXPECT_TRUE(names(fewer, "texels are transparent where there are heights"));
    EXPECT_TRUE(names(fewer, "present cells, the tiles hold"));
    const VerifyReport none =
        verify_varying_after([&](SmallStore& s) { coarse_leaf(s).second.presence.assign(16, 0); });
    EXPECT_TRUE(names(none, "is stored without a present cell"));
}

TEST(VerifyDamage, ACellOfALeafThatReachesHalfBeyondTheData) {
    std::vector<std::string> at_the_edge;
    for (const auto& [id, tile] : test::make_small_store(kVarying).heights)
        if (id.level == 3 && id.x == 7 && tile.header.is_leaf() && !tile.presence.empty() && tile.presence[2] != 0)
            at_the_edge.push_back("height tile 3/7/" + std::to_string(id.y) + ": ");
    ASSERT_FALSE(at_the_edge.empty());
    // Its third column of cells, of two finest cells each, lies over columns 60 and 61.
    const VerifyReport report = verify_varying_after([](SmallStore& s) { s.dataset.lattice.cells_x = 61; });
    int named = 0;
    for (const std::string& tile : at_the_edge)
        for (const std::string& problem : report.problems)
            named += problem.starts_with(tile) && problem.ends_with("cells outside the data's extent are present");
    EXPECT_EQ(named, static_cast<int>(at_the_edge.size()));
}

TEST(VerifyDamage, WhatParentsSayOfTheDepthBelowThem) {
    const auto change_first = [](SmallStore& s, const auto& fits, const auto& change) {
        for (auto& [id, tile] : s.heights)
            if (fits(id, tile.header)) return change(tile.header);
        FAIL() << "no such tile";
    };
    const VerifyReport leaf = verify_varying_after([&](SmallStore& s) {
        change_first(
            s, [](TileId, const HeightTileHeader& h) { return h.leaf_mask != 0; },
            [](HeightTileHeader& h) { h.leaf_mask = 0; });
    });
    EXPECT_TRUE(names(leaf, "is a leaf above the deepest level; its parent says otherwise"));
    const VerifyReport inner = verify_varying_after([&](SmallStore& s) {
        change_first(
            s, [](TileId id, const HeightTileHeader& h) { return id.level == 0 && h.leaf_mask != h.child_mask; },
            [](HeightTileHeader& h) { h.leaf_mask = h.child_mask; });
    });
    EXPECT_TRUE(names(inner, "is no leaf above the deepest level; its parent says otherwise"));
    const VerifyReport copied = verify_varying_after([&](SmallStore& s) {
        change_first(
            s, [](TileId, const HeightTileHeader& h) { return h.child_mask != 0; },
            [](HeightTileHeader& h) {
                h.texture_end_mask = static_cast<std::uint8_t>(h.texture_end_mask ^ h.child_mask);
            });
    });
    EXPECT_TRUE(names(copied, "its parent says otherwise of whether its textures end here"));
    const VerifyReport coarsest =
        verify_varying_after([](SmallStore& s) { s.dataset.coarsest_leaf_level = std::nullopt; });
    EXPECT_TRUE(names(coarsest, "dataset: the coarsest leaf is of level"));
}

TEST(VerifyDamage, WhereTexturesEnd) {
    int too_early = 0, too_late = 0, leaves = 0;
    const SmallStore sound = test::make_small_store(kVarying);
    for (const auto& [id, tile] : sound.heights) {
        if (id.level >= sound.dataset.texture_deepest_level) continue;
        const TileId place = id;
        const bool ends = tile.header.texture_ends;
        const VerifyReport report = verify_varying_after([&](SmallStore& s) {
            s.heights.at(place).header.texture_ends = !ends;
            if (place.level == 0) return;
            std::uint8_t& mask = s.heights.at(parent_of(place)).header.texture_end_mask;
            mask = static_cast<std::uint8_t>(mask ^ 1 << quadrant_of(place));
        });
        EXPECT_FALSE(report.sound()) << id.level << "/" << id.x << "/" << id.y;
        if (ends && sound.textures.count(id) == 0) {
            EXPECT_TRUE(names(report, "does not say that textures end here"));
        } else {
            EXPECT_TRUE(names(report, ends ? "is missing" : "should be 0000"));
        }
        ++(ends ? too_late : too_early);
        leaves += tile.header.is_leaf() ? 1 : 0;
    }
    EXPECT_GT(too_early, 3);
    EXPECT_GT(too_late, 10);
    EXPECT_GT(leaves, 3);
}

TEST(VerifyDamage, TheCoarsestLevelAtWhichTexturesEnd) {
    const SmallStore sound = test::make_small_store(kVarying);
    ASSERT_TRUE(sound.dataset.coarsest_texture_level);
    const int truth = *sound.dataset.coarsest_texture_level;
    ASSERT_LT(truth + 1, sound.dataset.texture_deepest_level);
    EXPECT_TRUE(verify_varying_after({}).sound());
    for (const std::optional<int> level : {std::optional<int>(truth + 1), std::optional<int>()}) {
        const VerifyReport report =
            verify_varying_after([&](SmallStore& s) { s.dataset.coarsest_texture_level = level; });
        EXPECT_TRUE(names(report, "a tile's at level " + std::to_string(truth)));
    }
}

TEST(VerifyDamage, ATextureMissingBelowOneWithOthers) {
    const VerifyReport report = verify_varying_after([](SmallStore& s) {
        auto last = std::prev(s.textures.end());
        ASSERT_GT(last->first.level, 1);
        s.textures.erase(last);
        --s.dataset.texture_tiles;
    });
    EXPECT_TRUE(names(report, "is missing"));
}

}  // namespace
}  // namespace scree
