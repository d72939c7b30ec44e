// The deepest lattice that the format allows: 2^30 cells a side, 29 levels of tiles of 5 x 5 samples, refined towards
// one place alone. (Scree lod, section 7; docs/extremes.md)
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "common/mesh/tile_patterns.h"
#include "runtime/app/cpu_arena.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/lod/page_measure.h"
#include "runtime/lod/page_mesher.h"
#include "runtime/lod/selection.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

constexpr int kTileCellsLog2 = 2, kDeepest = 28;
constexpr std::int32_t kRelief = 400;  // quanta

std::int32_t height_n(std::int64_t i, std::int64_t j) {
    const std::uint64_t h =
        (static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15u) ^ (static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4Fu);
    return static_cast<std::int32_t>((h ^ (h >> 29)) * 0xBF58476D1CE4E5B9u >> 40) % kRelief;
}

// A pyramid that is refined about one place: at each level the tiles up to `reach` from the one over it. Where that
// lies is said level by level.
class Chain {
public:
    Chain(double spacing_m, int reach, const std::function<int(int level)>& quadrant) {
        const auto lattice = make_lattice(0, 0, spacing_m, kMaxCellsPerSide, kMaxCellsPerSide, kTileCellsLog2);
        EXPECT_TRUE(lattice.ok());
        dataset_.lattice = *lattice;
        EXPECT_EQ(dataset_.lattice.deepest_level, kDeepest);
        dataset_.height_quantum_m = spacing_m / 64;
        dataset_.min_height_m = -kRelief * dataset_.height_quantum_m;
        dataset_.max_height_m = kRelief * dataset_.height_quantum_m;
        dataset_.coarsest_leaf_level = 1;
        std::vector<TileId> refined{{0, 0, 0}};
        ids_ = refined;
        for (int level = 0; level < kDeepest; ++level) {
            place_ = child_of(place_, quadrant(level));
            std::vector<TileId> next;
            for (const TileId id : refined) {
                refined_.insert(id);
                for (int q = 0; q < 4; ++q) {
                    const TileId child = child_of(id, q);
                    ids_.push_back(child);
                    if (std::abs(child.x - place_.x) <= reach && std::abs(child.y - place_.y) <= reach)
                        next.push_back(child);
                }
            }
            refined = next;
        }
        dataset_.height_tiles = static_cast<std::int64_t>(ids_.size());
        dataset_.present_cells = 1;
        make_tables();
    }

    const Dataset& dataset() const { return dataset_; }
    const Residency& residency() const { return residency_; }
    std::size_t tiles() const { return ids_.size(); }
    TileId tile(std::size_t k) const { return ids_[k]; }
    glm::dvec3 deepest_place() const {
        const LatticePoint c = dataset_.lattice.corner(place_);
        return {dataset_.lattice.x_m(static_cast<double>(c.i + 1)), dataset_.lattice.y_m(static_cast<double>(c.j + 1)),
                dataset_.height_m(height_n(c.i + 1, c.j + 1))};
    }
    std::vector<std::int32_t> samples(TileId id) const {
        const LatticePoint corner = dataset_.lattice.corner(id);
        const std::int64_t step = dataset_.lattice.step(id.level);
        std::vector<std::int32_t> samples;
        for (int r = 0; r <= 4; ++r)
            for (int c = 0; c <= 4; ++c) samples.push_back(height_n(corner.i + c * step, corner.j + r * step));
        return samples;
    }

private:
    // No surface is further from another than twice the relief; by stride, so that a child's is its parent's.
    HeightBounds bounds(int level) const {
        HeightBounds b;
        b.min_n = -kRelief;
        b.max_n = kRelief;
        for (int g = 0; g < kTileCellsLog2; ++g)
            b.error_n[static_cast<std::size_t>(g)] =
                2 * kRelief * std::pow(kErrorGrowth, static_cast<float>(kDeepest - level + g));
        return b;
    }
    void make_tables() {
        std::map<TileId, std::int32_t> slots;
        for (std::size_t k = 0; k < ids_.size(); ++k) slots[ids_[k]] = static_cast<std::int32_t>(k);
        ResidentPages& pages = residency_.heights;
        pages.roots = {0};
        pages.arrived_s.assign(ids_.size(), -std::numeric_limits<double>::infinity());
        for (const TileId id : ids_) {
            HeightTileHeader header;
            header.own = bounds(id.level);
            std::array<std::int32_t, 4> children{kNotResident, kNotResident, kNotResident, kNotResident};
            for (int q = 0; q < 4; ++q) {
                const TileId child = child_of(id, q);
                if (id.level == kDeepest || !slots.contains(child)) continue;
                header.child_mask = static_cast<std::uint8_t>(header.child_mask | 1 << q);
                const bool leaf = !refined_.contains(child);
                if (leaf && child.level < kDeepest)
                    header.leaf_mask = static_cast<std::uint8_t>(header.leaf_mask | 1 << q);
                header.children[static_cast<std::size_t>(q)] = bounds(child.level);
                children[static_cast<std::size_t>(q)] = slots[child];
            }
            pages.headers.push_back(header);
            pages.children.push_back(children);
        }
        residency_.textures.roots = {kNotResident};
        residency_.has_textures = false;
    }

    Dataset dataset_;
    Residency residency_;
    TileId place_;  ///< the deepest tile
    std::set<TileId> refined_;
    std::vector<TileId> ids_;
};

class DeepLevels : public testing::TestWithParam<LodMethod> {
protected:
    // From a millimetre to a million kilometres: no number that is none, and no crack. The finest level that was drawn.
    void fly(const Chain& chain, double spacing_m, bool must_reach_deepest) {
        const Dataset& d = chain.dataset();
        CpuArena arena(d, static_cast<std::int64_t>(chain.tiles()));
        LodSettings lod;
        lod.method = GetParam();
        const bool meshed = lod.method != LodMethod::geomip;
        PageMesher mesher(d, meshed ? lod : LodSettings{LodMethod::rsg},
                          32 * static_cast<std::int64_t>(chain.tiles()));  // room for all
        const PageMeasure measure(kTileCellsLog2, lod.metric);
        std::vector<SlotVertex> vertices(slot_vertex_count(kTileCellsLog2));
        std::vector<VertexCost> costs(vertices.size());
        for (std::size_t k = 0; k < chain.tiles(); ++k) {
            fill_vertex_slot(chain.samples(chain.tile(k)), kTileCellsLog2, vertices);
            arena.put_height(static_cast<std::int32_t>(k), vertices);
            measure.measure(d, chain.tile(k), chain.residency().heights.headers[k], vertices, costs);
            for (const VertexCost& cost : costs) ASSERT_TRUE(std::isfinite(cost.error_m + cost.radius_m));
            mesher.put(static_cast<std::int32_t>(k), vertices, costs);
        }
        Selector selector(d);
        const TilePatterns patterns(kTileCellsLog2);
        int deepest = 0;
        for (const double away : {1e-3, 1.0, 1e3, 1e6, 1e9, 1e14})
            for (const glm::dvec3 to : {glm::dvec3(0, 0, 1), glm::dvec3(0.6, -0.7, 0.2)})
                for (const double tau : {0.0, 1.0, 1e3}) {
                    const glm::dvec3 place = chain.deepest_place();
                    const auto camera = look_at(place + away * to, place + glm::dvec3(spacing_m, 0, 0), 60, 800, 600);
                    ASSERT_TRUE(camera.ok());
                    SelectionSettings settings = test::with_tau(meshed ? kCutShare * tau : tau);
                    settings.morph = !meshed;
                    settings.list_tiles = meshed;
                    Selection& s = selector.select({&*camera, 1}, settings, chain.residency());
                    if (meshed) mesher.mesh({&*camera, 1}, {tau, 0}, chain.residency(), s);
                    if (away > camera->near_m) {  // all that is nearer is cut off
                        ASSERT_FALSE(s.draws[0].empty());
                    }
                    ASSERT_FALSE(s.budget_limited);
                    ASSERT_TRUE(std::isfinite(s.max_bound_px) && std::isfinite(s.mean_bound_px));
                    for (const DrawItem& item : s.draws[0]) deepest = std::max(deepest, item.tile.level);
                    const DrawnMesh mesh =
                        drawn_mesh(d, patterns, s.draws[0], arena, meshed ? &mesher.pool() : nullptr);
                    const CrackReport cracks = count_cracks(d, s.draws[0], mesh);
                    ASSERT_EQ(cracks.open_edges, 0) << away << " m away, tau " << tau;
                    ASSERT_EQ(cracks.t_junctions, 0) << away << " m away, tau " << tau;
                    // At such distances nothing is seen, at any tolerance but none.
                    if (tau > 0 && away * 1e-3 > kRelief * d.height_quantum_m * 1e6) {
                        ASSERT_EQ(s.draws[0].size(), 1u);
                    }
                }
        if (must_reach_deepest)
            EXPECT_EQ(deepest, kDeepest);
        else
            EXPECT_LT(deepest, kDeepest);
    }
};

INSTANTIATE_TEST_SUITE_P(Methods, DeepLevels, testing::Values(LodMethod::geomip, LodMethod::rsg, LodMethod::block_rsg),
                         [](const testing::TestParamInfo<LodMethod>& method) {
                             return method.param == LodMethod::block_rsg ? std::string("block_rsg")
                                                                         : std::string(to_string(method.param));
                         });

// Towards a third of the way along both sides, with room about it for the strides to fall.
TEST_P(DeepLevels, AllTwentyNineAreReachedWithoutCracks) {
    for (const double spacing : {1e-3, 1.0, 1e5}) {
        const Chain chain(spacing, 2, [](int level) { return level % 2 == 0 ? 3 : 0; });
        fly(chain, spacing, true);
    }
}

// Towards the middle of the root, beside leaves of its first level all the way down: what is fine there cannot be drawn
// beside what is coarse, and is not.
TEST_P(DeepLevels, BesideTheCoarsestLeavesTheFinestAreLeftOut) {
    for (const double spacing : {1e-3, 1.0, 1e5}) {
        const Chain chain(spacing, 0, [](int level) { return level == 0 ? 3 : 0; });
        fly(chain, spacing, false);
    }
}

TEST(DeepestLattice, OneLevelMoreIsRefusedWithItsReason) {
    Lattice lattice{0, 0, 1, kMaxCellsPerSide, kMaxCellsPerSide, kDeepest + 1, kTileCellsLog2, 1, 1};
    const auto checked = lattice.check();
    ASSERT_FALSE(checked.ok());
    EXPECT_EQ(checked.error().code, ErrorCode::input);
    EXPECT_NE(checked.error().message.find("2^30"), std::string::npos);
    EXPECT_FALSE(make_lattice(0, 0, 1, kMaxCellsPerSide + 1, 4, kTileCellsLog2).ok());
    const auto tiny = make_lattice(0, 0, 1, 64, 64, 1);  // tiles of 3 x 3 samples
    ASSERT_FALSE(tiny.ok());
    EXPECT_NE(tiny.error().message.find("3 is not 5, 9"), std::string::npos);
}

}  // namespace
}  // namespace scree
