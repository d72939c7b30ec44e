// The pager under a tiny budget, slow and damaged reads: architecture.md 1.6, 1.7 and 1.10.
#include "runtime/paging/pager.h"

#include <gtest/gtest.h>

#include <set>

#include "runtime/app/coverage.h"
#include "runtime/lod/selection.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

using test::Damage;
using test::MemoryStore;
using test::SyntheticTerrain;

// Remembers whose content lies in which slot.
class SlotRecorder final : public TileSink {
public:
    SlotRecorder(const SyntheticTerrain& terrain, const MemoryPlan& memory)
        : n_(terrain.lattice().tile_cells_log2),
          heights(static_cast<std::size_t>(memory.height_slots)),
          textures(static_cast<std::size_t>(memory.texture_slots), -1) {}
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override {
        auto& samples = heights.at(static_cast<std::size_t>(slot));
        samples.clear();
        const std::size_t pitch = (std::size_t{1} << n_) + 1;
        for (std::size_t k = 0; k < pitch * pitch; ++k)
            samples.push_back(static_cast<std::int32_t>(vertices[k].height_n));
    }
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override {
        std::int32_t index = 0;
        for (std::size_t k = 0; k < 4; ++k) index |= chain[k] << (8 * k);
        textures.at(static_cast<std::size_t>(slot)) = index;
    }

private:
    int n_;

public:
    std::vector<std::vector<std::int32_t>> heights;
    std::vector<std::int32_t> textures;  ///< index of the tile
};

// The frame loop, with every rule checked at every step.
class Flight {
public:
    Flight(const SyntheticTerrain& terrain, const MemoryStore& store, const MemoryPlan& memory, double tau_px,
           int threads = 3)
        : terrain_(terrain), store_(store), memory_(memory), sink_(terrain, memory), selector_(terrain.dataset()) {
        settings_ = {tau_px, 1.5, memory.height_slots, memory.texture_slots};
        auto created = Pager::create(store, {memory, threads, 0, true}, sink_);
        EXPECT_TRUE(created.ok());
        pager_ = std::move(*created);
        taken_ = store.reads_begun();  // the roots
        pager_->on_damage = [this](const std::string& what) { damage_.push_back(what); };
    }

    void frame(const Camera& camera, std::int64_t upload_bytes, bool wait) {
        const int arrivals = pager_->take_arrivals(upload_bytes, wait);
        taken_ += arrivals;
        for (const TileId id : kept_) ASSERT_TRUE(resident(TileKind::height, id)) << "a planned tile went";
        for (const TileId id : kept_textures_) ASSERT_GE(pager_->texture(id), 0) << "a planned texture went";
        check_slots();
        const Selection& s = selector_.select({&camera, 1}, settings_, *pager_);
        draws_ = s.to_render(0);
        complete_ = s.complete;
        for (const DrawItem& item : draws_) {
            ASSERT_TRUE(resident(TileKind::height, item.tile));
            ASSERT_GE(item.texture_slot, 0);
        }
        ASSERT_EQ(count_holes(terrain_.dataset(), *pager_, camera, s.draws[0]), 0);
        kept_.clear();
        kept_textures_.clear();
        for (const TileId id : s.planned_heights)
            if (resident(TileKind::height, id)) kept_.push_back(id);
        for (const TileId id : s.planned_textures)
            if (pager_->texture(id) >= 0) kept_textures_.push_back(id);
        pager_->request({s.planned_heights, s.planned_textures, s.standing_in, s.standing_in_textures, s.requests});
        requests_ = s.requests.size();
        for (const DrawItem& item : s.draws[0])
            if (item.tile.level > 0 && resident(TileKind::height, item.tile) &&
                !resident(TileKind::height, parent_of(item.tile)))
                ++orphans_;
        // Draws are made after this: what they show must still be in its slot.
        for (const DrawItem& item : draws_)
            ASSERT_EQ(sink_.heights[static_cast<std::size_t>(item.height_slot)], terrain_.tile(item.tile)->samples);
        ASSERT_FALSE(store_.read_twice_at_once());
    }

    // Until nothing is missing; returns the frames it took.
    int settle(const Camera& camera) {
        for (int frames = 1; frames < 400; ++frames) {
            frame(camera, std::int64_t{1} << 40, true);
            if (testing::Test::HasFatalFailure()) return frames;
            if (complete_) return frames;
        }
        ADD_FAILURE() << "requests never end at rest";
        return -1;
    }

    // The drawn frame by tiles rather than slots.
    std::vector<std::tuple<TileId, int, unsigned, int, int, int, std::int32_t>> drawn() const {
        std::vector<std::tuple<TileId, int, unsigned, int, int, int, std::int32_t>> list;
        for (const DrawItem& d : draws_)
            list.emplace_back(d.tile, d.geomip, d.edge_mask, d.part.level, d.part.x, d.part.y,
                              sink_.textures[static_cast<std::size_t>(d.texture_slot)]);
        std::sort(list.begin(), list.end());
        return list;
    }
    Pager& pager() { return *pager_; }
    std::size_t requests() const { return requests_; }
    const std::vector<std::string>& damage() const { return damage_; }
    /// Drawn tiles whose parent was evicted before they were: they cannot be reached any more and draw nothing.
    std::int64_t orphans() const { return orphans_; }

private:
    bool resident(TileKind kind, TileId id) const {
        return kind == TileKind::height ? pager_->height(id).header != nullptr : pager_->texture(id) >= 0;
    }

    void check_slots() {
        std::set<std::int32_t> slots, texture_slots;
        for (const TileId id : terrain_.tiles()) {
            const ResidentHeight h = pager_->height(id);
            ASSERT_TRUE(h.header != nullptr || id.level > 0) << "a root went";
            if (h.header == nullptr) continue;
            ASSERT_TRUE(slots.insert(h.slot).second) << "two tiles in one slot";
            ASSERT_EQ(*h.header, terrain_.tile(id)->header);
            ASSERT_EQ(sink_.heights.at(static_cast<std::size_t>(h.slot)), terrain_.tile(id)->samples)
                << "another tile's heights";
        }
        for (const TileId id : terrain_.textures()) {
            const std::int32_t slot = pager_->texture(id);
            ASSERT_TRUE(slot >= 0 || id.level > 0) << "a root's texture went";
            if (slot < 0) continue;
            ASSERT_TRUE(texture_slots.insert(slot).second);
            ASSERT_EQ(sink_.textures.at(static_cast<std::size_t>(slot)), terrain_.texture_index(id))
                << "another tile's texture";
        }
        // Begun and not taken yet: each holds a slot besides the resident ones, and a place in staging.
        const std::int64_t under_way = store_.reads_begun() - taken_;
        ASSERT_LE(under_way, 2 * memory_.staging_slots);
        ASSERT_LE(static_cast<std::int64_t>(slots.size() + texture_slots.size()) + under_way,
                  memory_.height_slots + memory_.texture_slots);
    }

    const SyntheticTerrain& terrain_;
    const MemoryStore& store_;
    const MemoryPlan memory_;
    SlotRecorder sink_;
    Selector selector_;
    SelectionSettings settings_;
    std::unique_ptr<Pager> pager_;
    std::int64_t taken_ = 0;
    DrawList draws_;
    bool complete_ = false;
    std::size_t requests_ = 0;
    std::int64_t orphans_ = 0;
    std::vector<TileId> kept_, kept_textures_;
    std::vector<std::string> damage_;
};

SyntheticTerrain paging_terrain(std::uint64_t seed, int texture_depth) {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 2;
    shape.cells_x = 64;
    shape.cells_y = seed % 3 == 0 ? 64 : seed % 3 == 1 ? 40 : 16;  // one root, or four in a row
    shape.texture_depth = texture_depth;
    return SyntheticTerrain(shape, test::rough_heights(seed, 800));
}

void fly(Flight& flight, test::Random& random, const SyntheticTerrain& terrain, int frames) {
    Camera camera = test::random_camera(random, terrain);
    for (int k = 0; k < frames; ++k) {
        if (test::uniform(random, 0, 9) == 0)
            camera = test::random_camera(random, terrain);
        else
            camera.eye +=
                glm::dvec3(test::uniform(random, -9, 9), test::uniform(random, -9, 9), test::uniform(random, -3, 3));
        const std::int64_t upload = test::uniform(random, 0, 3) == 0 ? 1 : test::uniform(random, 0, 20000);
        flight.frame(camera, upload, test::uniform(random, 0, 30) == 0);
        if (testing::Test::HasFatalFailure()) return;
    }
}

MemoryPlan tiny_plan(test::Random& random, const SyntheticTerrain& terrain) {
    const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
    return {roots + test::uniform(random, 4, 40), roots + test::uniform(random, 0, 40), test::uniform(random, 1, 6), 0};
}

TEST(Pager, RandomFlightsUnderATinyBudgetKeepEveryRuleAndSettleLikeAFreshStart) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t evicted = 0;
    for (int round = 0; round < 48; ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        const auto terrain = paging_terrain(random(), round % 4 == 3 ? test::kDeepTextures : 4);
        const MemoryStore store(terrain, round % 2 == 0 ? 0 : 200), fresh_store(terrain);
        const MemoryPlan memory = tiny_plan(random, terrain);
        const double tau = std::exp(test::uniform_real(random, -1, 3));
        Flight flight(terrain, store, memory, tau);
        for (int leg = 0; leg < 3; ++leg) {
            fly(flight, random, terrain, 100);
            if (HasFatalFailure()) return;
            const Camera camera = test::random_camera(random, terrain);
            flight.settle(camera);
            if (HasFailure()) return;
            Flight fresh(terrain, fresh_store, memory, tau);
            fresh.settle(camera);
            if (HasFailure()) return;
            ASSERT_EQ(flight.drawn(), fresh.drawn());
        }
        evicted += flight.pager().counters().tiles_paged_out;
    }
    EXPECT_GT(evicted, 1000);
}

TEST(Pager, AtRestNothingIsReadOrEvictedAnyMore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 20; ++round) {
        const auto terrain = paging_terrain(random(), round % 4 == 3 ? test::kDeepTextures : 4);
        const MemoryStore store(terrain);
        Flight flight(terrain, store, tiny_plan(random, terrain), std::exp(test::uniform_real(random, -2, 3)));
        fly(flight, random, terrain, 20);
        const Camera camera = test::random_camera(random, terrain);
        flight.settle(camera);
        if (HasFailure()) return;
        while (!flight.pager().idle()) flight.frame(camera, std::int64_t{1} << 40, true);
        const std::int64_t reads = store.reads_begun(), out = flight.pager().counters().tiles_paged_out;
        const auto drawn = flight.drawn();
        for (int k = 0; k < 30; ++k) {
            flight.frame(camera, std::int64_t{1} << 40, false);
            ASSERT_EQ(flight.requests(), 0u);
        }
        EXPECT_EQ(store.reads_begun(), reads);
        EXPECT_EQ(flight.pager().counters().tiles_paged_out, out);
        EXPECT_EQ(flight.drawn(), drawn);
    }
}

// Architecture 1.7: parents of what is drawn go no sooner than what is drawn.
TEST(Pager, AParentIsNeverEvictedBeforeADrawnChild) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 16; ++round) {
        const auto terrain = paging_terrain(random(), 4);
        const MemoryStore store(terrain, 100);
        Flight flight(terrain, store, tiny_plan(random, terrain), std::exp(test::uniform_real(random, -1, 3)));
        fly(flight, random, terrain, 200);
        if (HasFatalFailure()) return;
        EXPECT_EQ(flight.orphans(), 0) << "round " << round;
    }
}

TEST(Pager, DamagedTilesAreSaidOnceAndTheirParentsStandIn) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::size_t said = 0;
    for (int round = 0; round < 12; ++round) {
        const auto terrain = paging_terrain(random(), round % 3 == 2 ? test::kDeepTextures : 4);
        MemoryStore store(terrain, 100);
        for (const TileId id : terrain.tiles())
            if (id.level > 0 && test::uniform(random, 0, 9) == 0)
                store.damage(TileKind::height, id, static_cast<Damage>(test::uniform(random, 0, 2)));
        for (const TileId id : terrain.textures())
            if (id.level > 0 && test::uniform(random, 0, 9) == 0)
                store.damage(TileKind::texture, id, static_cast<Damage>(test::uniform(random, 0, 2)));
        Flight flight(terrain, store, tiny_plan(random, terrain), 1);
        for (int leg = 0; leg < 3; ++leg) {
            fly(flight, random, terrain, 60);
            if (HasFatalFailure()) return;
            flight.settle(test::random_camera(random, terrain));
            if (HasFailure()) return;
        }
        const std::set<std::string> once(flight.damage().begin(), flight.damage().end());
        EXPECT_EQ(once.size(), flight.damage().size());
        EXPECT_EQ(static_cast<std::int64_t>(once.size()), flight.pager().counters().damaged_tiles);
        said += once.size();
    }
    EXPECT_GT(said, 50u);
}

TEST(Pager, ComesToRestOverTheEdgeOfTheDataWhateverTheSlots) {
    // The last column of pages holds one column of cells; the eye stands over the padding beyond it.
    test::TerrainShape shape;
    shape.tile_cells_log2 = 4;
    shape.cells_x = 33;
    shape.cells_y = 64;
    shape.texture_depth = test::kDeepTextures;
    const SyntheticTerrain terrain(shape, test::rough_heights(2, 100));
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(37), l.y_m(20), 45}, {l.x_m(20), l.y_m(20), 40}, 60, 800, 800);
    ASSERT_TRUE(camera.ok());
    const MemoryStore store(terrain);
    for (int slots = 1; slots < 40; ++slots) {
        Flight flight(terrain, store, {40, slots, 4, 0}, 100);
        flight.settle(*camera);
        ASSERT_FALSE(HasFailure()) << slots << " texture slots";
    }
}

TEST(Pager, CountsTheBytesThatWereReadAndNoOthers) {
    const auto terrain = paging_terrain(6, 4);
    MemoryStore store(terrain);
    for (const TileId id : terrain.tiles())
        if (id.level > 0 && id.x % 3 == 0) store.damage(TileKind::height, id, Damage::checksum);
    Flight flight(terrain, store, {60, 60, 4, 0}, 1, 1);
    const std::int64_t roots = store.payload_bytes();
    const Lattice& l = terrain.lattice();
    flight.settle(*look_at({l.x_m(32), l.y_m(32), 700}, {l.x_m(32), l.y_m(32), 0}, 60, 800, 800));
    while (!flight.pager().idle()) flight.pager().take_arrivals(std::int64_t{1} << 40, true);
    EXPECT_GT(flight.pager().counters().damaged_tiles, 0);
    EXPECT_EQ(flight.pager().counters().bytes_read, store.payload_bytes() - roots);
}

TEST(Pager, ADamagedRootIsAnError) {
    const auto terrain = paging_terrain(4, 4);
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        MemoryStore store(terrain);
        store.damage(kind, {0, 0, 0}, Damage::checksum);
        SlotRecorder sink(terrain, {20, 20, 2, 0});
        const auto pager = Pager::create(store, {{20, 20, 2, 0}, 1, 0, true}, sink);
        ASSERT_FALSE(pager.ok());
        EXPECT_EQ(pager.error().code, ErrorCode::store);
    }
}

TEST(Pager, EndsCleanlyInTheMiddleOfAFlight) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = paging_terrain(6, 4);
    const MemoryStore store(terrain, 300);
    for (int round = 0; round < 20; ++round) {
        Flight flight(terrain, store, tiny_plan(random, terrain), 0.1, 4);
        const Camera camera = test::random_camera(random, terrain);
        for (int k = 0; k < 3; ++k) flight.frame(camera, 1 << 20, false);
    }
}

TEST(Pager, StopsTakingArrivalsOnceTheByteBudgetOfAFrameIsSpent) {
    const auto terrain = paging_terrain(6, 4);
    const MemoryStore store(terrain);
    Flight flight(terrain, store, {80, 80, 40, 0}, 0.01);
    const Lattice& l = terrain.lattice();
    const Camera camera = *look_at({l.x_m(32), l.y_m(32), 700}, {l.x_m(32), l.y_m(32), 0}, 60, 800, 800);
    flight.frame(camera, 0, false);
    int taken = 0;
    for (int one = flight.pager().take_arrivals(1, true); one > 0; one = flight.pager().take_arrivals(1, true)) {
        EXPECT_EQ(one, 1);
        ++taken;
    }
    EXPECT_GE(taken, 2);
    EXPECT_EQ(flight.pager().take_arrivals(0, false), 0);
}

}  // namespace
}  // namespace scree
