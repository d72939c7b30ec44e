// Pager and selection together, as the frame loop runs them, under a tiny budget.
#include <gtest/gtest.h>

#include <set>

#include "runtime/app/coverage.h"
#include "runtime/lod/selection.h"
#include "runtime/paging/pager.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/paging/tile_planner.h"

namespace scree {
namespace {

using test::MemoryStore;
using test::SyntheticTerrain;

// Remembers whose content lies in which slot.
class SlotRecorder final : public TileSink {
public:
    explicit SlotRecorder(const MemoryPlan& memory)
        : heights(static_cast<std::size_t>(memory.height_slots)),
          textures(static_cast<std::size_t>(memory.texture_slots), -1) {}
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override {
        auto& samples = heights.at(static_cast<std::size_t>(slot));
        samples.clear();
        for (const SlotVertex& v : vertices) samples.push_back(static_cast<std::int32_t>(v.height_n));
    }
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override {
        std::int32_t index = 0;
        for (std::size_t k = 0; k < 4; ++k) index |= chain[k] << (8 * k);
        textures.at(static_cast<std::size_t>(slot)) = index;
    }
    std::vector<std::vector<std::int32_t>> heights;
    std::vector<std::int32_t> textures;  ///< index of the tile
};

class Flight {
public:
    Flight(const SyntheticTerrain& terrain, const MemoryStore& store, const MemoryPlan& memory, double tau_px)
        : terrain_(terrain), sink_(memory), selector_(terrain.dataset()) {
        settings_.tau_px = tau_px;
        settings_.texture_tau_px = 1.5;
        settings_.height_slots = memory.height_slots;
        settings_.texture_slots = memory.texture_slots;
        auto created = Pager::create(store, {memory, 3, 0, true}, sink_);
        EXPECT_TRUE(created.ok());
        pager_ = std::move(*created);
    }

    void frame(const Camera& camera, std::int64_t upload_bytes, bool wait) {
        pager_->take_arrivals(upload_bytes, wait);
        const Selection& s = selector_.select({&camera, 1}, settings_, pager_->residency());
        ASSERT_EQ(count_holes(terrain_.dataset(), pager_->residency(), camera, s.draws[0]), 0);
        draws_ = s.to_render(0);
        complete_ = s.complete;
        pager_->request({s.planned_heights, s.planned_textures, s.standing_heights, s.standing_textures, s.requests});
        requests_ = s.requests.size();
        // Draws are made after this: what they show must still be in its slot.
        for (const DrawItem& item : draws_) {
            ASSERT_EQ(sink_.heights.at(static_cast<std::size_t>(item.height_slot)), terrain_.tile(item.tile)->samples);
            ASSERT_GE(sink_.textures.at(static_cast<std::size_t>(item.texture.slot)), 0);
        }
    }

    // Until nothing is missing.
    void settle(const Camera& camera) {
        for (int frames = 1; frames < 400; ++frames) {
            frame(camera, std::int64_t{1} << 40, true);
            if (testing::Test::HasFatalFailure() || complete_) return;
        }
        ADD_FAILURE() << "requests never end at rest";
    }

    // The drawn frame by tiles rather than slots.
    auto drawn() const {
        std::vector<std::tuple<TileId, int, unsigned, int, int, int, std::int32_t>> list;
        for (const DrawItem& d : draws_)
            list.emplace_back(d.tile, d.geomip, d.edge_mask, d.part.level, d.part.x, d.part.y,
                              sink_.textures[static_cast<std::size_t>(d.texture.slot)]);
        std::sort(list.begin(), list.end());
        return list;
    }
    const PagerCounters& counters() const { return pager_->counters(); }
    bool idle() const { return pager_->idle(); }
    std::size_t requests() const { return requests_; }

private:
    const SyntheticTerrain& terrain_;
    SlotRecorder sink_;
    Selector selector_;
    SelectionSettings settings_;
    std::unique_ptr<Pager> pager_;
    DrawList draws_;
    bool complete_ = false;
    std::size_t requests_ = 0;
};

SyntheticTerrain flight_terrain(std::uint64_t seed, int texture_depth) {
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

TEST(SelectedFlight, UnderATinyBudgetHasNoHolesAndSettlesLikeAFreshStart) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t evicted = 0;
    for (int round = 0; round < 32; ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        const auto terrain = flight_terrain(random(), round % 4 == 3 ? test::kDeepTextures : 4);
        const MemoryStore store(terrain, round % 2 == 0 ? 0 : 200), fresh_store(terrain);
        const MemoryPlan memory = test::tiny_plan(random, terrain);
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
        evicted += flight.counters().tiles_paged_out;
    }
    EXPECT_GT(evicted, 500);
}

TEST(SelectedFlight, AtRestNothingIsReadOrEvictedAnyMore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 16; ++round) {
        const auto terrain = flight_terrain(random(), round % 4 == 3 ? test::kDeepTextures : 4);
        const MemoryStore store(terrain);
        Flight flight(terrain, store, test::tiny_plan(random, terrain), std::exp(test::uniform_real(random, -2, 3)));
        fly(flight, random, terrain, 20);
        const Camera camera = test::random_camera(random, terrain);
        flight.settle(camera);
        if (HasFailure()) return;
        while (!flight.idle()) flight.frame(camera, std::int64_t{1} << 40, true);
        const std::int64_t reads = store.reads_begun(), out = flight.counters().tiles_paged_out;
        const auto drawn = flight.drawn();
        for (int k = 0; k < 30; ++k) {
            flight.frame(camera, std::int64_t{1} << 40, false);
            ASSERT_EQ(flight.requests(), 0u);
        }
        EXPECT_EQ(store.reads_begun(), reads);
        EXPECT_EQ(flight.counters().tiles_paged_out, out);
        EXPECT_EQ(flight.drawn(), drawn);
    }
}

TEST(SelectedFlight, ComesToRestOverTheEdgeOfTheDataWhateverTheSlots) {
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

}  // namespace
}  // namespace scree
