#include "runtime/scene/scene.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"
#include "runtime/app/cpu_arena.h"
#include "tests/runtime/lod/probed_surface.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree {
namespace {

using test::SyntheticTerrain;

// Ten kilometres across: what one eye wants is a small part of it.
SyntheticTerrain hills() {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 4;
    shape.cells_x = shape.cells_y = 1024;
    shape.texture_depth = 4;
    return SyntheticTerrain(shape, test::rough_heights(3, 900));
}

/// A SyntheticTerrain in a file.
class StoredTerrain {
public:
    explicit StoredTerrain(SyntheticTerrain terrain) : terrain_(std::move(terrain)) {
        const Dataset& d = terrain_.dataset();
        auto writer = SqliteStoreWriter::create(path());
        EXPECT_TRUE(writer.ok());
        for (const TileId id : terrain_.tiles())
            put(**writer, TileKind::height, id,
                encode_height_tile(*terrain_.tile(id), d.lattice.tile_cells_log2, HeightCodec::raw));
        for (const TileId id : terrain_.textures())
            put(**writer, TileKind::texture, id,
                encode_texture_tile(terrain_.texture(id), d.texture_size_log2, TextureCodec::raw));
        EXPECT_TRUE((*writer)->finish(d).ok());
        auto store = SqliteStore::open(path());
        EXPECT_TRUE(store.ok()) << store.error().message;
        store_ = std::move(*store);
    }
    const SqliteStore& store() const { return *store_; }
    const SyntheticTerrain& terrain() const { return terrain_; }
    /// Level, at a place in finest cells.
    Camera camera(double i, double j, double above_m = 40) const {
        const Lattice& l = terrain_.lattice();
        const glm::dvec3 eye{l.x_m(i), l.y_m(j), terrain_.dataset().max_height_m + above_m};
        auto camera = look_at(eye, eye + glm::dvec3(1, 0.2, -0.3), 40, 400, 300);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }

private:
    std::string path() const { return folder_.file("t.scree"); }
    void put(SqliteStoreWriter& writer, TileKind kind, TileId id, const std::vector<std::uint8_t>& payload) const {
        EXPECT_TRUE(writer.put(kind, *tile_key(terrain_.lattice(), id), 0, payload).ok());
    }

    test::TemporaryFolder folder_;
    SyntheticTerrain terrain_;
    std::unique_ptr<SqliteStore> store_;
};

/// A scene whose tiles go to ordinary memory.
struct Staged {
    Staged(const StoredTerrain& stored, const SceneOptions& options) {
        auto opened = Scene::open(stored.store(), options);
        EXPECT_TRUE(opened.ok()) << opened.error().message;
        scene = std::move(*opened);
        arena = std::make_unique<CpuArena>(stored.store().dataset(), scene->memory().height_slots);
        EXPECT_TRUE(scene->start(*arena).ok());
    }
    // In this order: the scene's threads end before what they fill.
    std::unique_ptr<CpuArena> arena;
    std::unique_ptr<Scene> scene;
};

SceneOptions small_options() {
    SceneOptions options;
    options.budget_bytes = std::int64_t{64} << 20;
    options.tau_px = 2;
    return options;
}

class SceneOfHills : public testing::Test {
protected:
    static void SetUpTestSuite() { stored_ = std::make_unique<StoredTerrain>(hills()); }
    static void TearDownTestSuite() { stored_.reset(); }
    static std::unique_ptr<StoredTerrain> stored_;
};
std::unique_ptr<StoredTerrain> SceneOfHills::stored_;

TEST_F(SceneOfHills, CompleteEndsWithNothingMissingAndNothingGrowing) {
    Staged staged(*stored_, small_options());
    const Camera camera = stored_->camera(200, 512);
    const auto frame = staged.scene->complete({&camera, 1});
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_FALSE(frame->stand_ins);
    EXPECT_TRUE(frame->selection->complete);
    EXPECT_FALSE(frame->selection->growing);
    EXPECT_TRUE(frame->selection->requests.empty());
    EXPECT_LE(frame->selection->max_bound_px, staged.scene->options().tau_px);
    EXPECT_GT(frame->uploads, 10);
    EXPECT_GE(frame->select_ms, 0);
    // Again at the same place there is nothing to do.
    const auto again = staged.scene->complete({&camera, 1});
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->uploads, 0);
    EXPECT_EQ(again->selection->triangles, frame->selection->triangles);
}

TEST_F(SceneOfHills, WhereNothingHasChangedTheSelectionIsNotMadeAgain) {
    Staged staged(*stored_, small_options());
    Camera camera = stored_->camera(200, 512);
    double now_s = 0;
    const auto next = [&] { return staged.scene->advance({&camera, 1}, now_s += 0.05); };
    SceneFrame frame = next();
    for (int k = 0; k < 4000 && !frame.reused; ++k) {
        ASSERT_FALSE(frame.reused);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        frame = next();
    }
    ASSERT_TRUE(frame.reused);
    EXPECT_FALSE(frame.stand_ins);
    EXPECT_FALSE(frame.selection->growing);
    const std::int64_t triangles = frame.selection->triangles;
    EXPECT_TRUE(next().reused);
    const auto settled = staged.scene->complete({&camera, 1});
    ASSERT_TRUE(settled.ok());
    EXPECT_EQ(settled->selection->triangles, triangles);
    camera.eye.x += 1e-6;
    EXPECT_FALSE(next().reused);
    camera.fov_deg += 1e-6;
    EXPECT_FALSE(next().reused);
    staged.scene->options().tau_px *= 1 + 1e-12;
    EXPECT_FALSE(next().reused);
    const std::vector<Camera> two{camera, camera};
    EXPECT_FALSE(staged.scene->advance(two, now_s).reused);
}

TEST_F(SceneOfHills, CompleteStopsWhenAsked) {
    Staged staged(*stored_, small_options());
    const Camera camera = stored_->camera(200, 512);
    const auto frame = staged.scene->complete({&camera, 1}, [] { return true; });
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, ErrorCode::interrupted);
}

TEST_F(SceneOfHills, WhatCatchingUpFetchedStandsAtOnceAndWhatComesLaterGrows) {
    for (const double now_s : {0.0, 0.1, 0.7, 1e3 / 3, 1e6 / 7}) {
        Staged staged(*stored_, small_options());
        const Camera camera = stored_->camera(200, 512), elsewhere = stored_->camera(900, 800);
        SceneFrame frame = staged.scene->catch_up({&camera, 1}, now_s, 1000);
        EXPECT_FALSE(frame.stand_ins);
        EXPECT_GT(frame.uploads, 10);
        EXPECT_FALSE(frame.selection->growing) << now_s;
        EXPECT_LE(frame.selection->max_bound_px, 2);
        EXPECT_FALSE(staged.scene->advance({&camera, 1}, now_s).selection->growing);
        bool grew = false;
        for (double later_s = now_s; !staged.scene->pager().idle() || later_s == now_s; later_s += 0.01) {
            frame = staged.scene->advance({&elsewhere, 1}, later_s);
            grew = grew || frame.selection->growing;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        EXPECT_TRUE(grew);
    }
}

TEST_F(SceneOfHills, AMethodThatIsNotBuiltInIsRefusedBeforeAnythingIsTaken) {
    SceneOptions options = small_options();
    options.lod.metric = ErrorMetric::uc;  // with geomip: nothing will ever draw so
    options.budget_bytes = 1;
    const auto scene = Scene::open(stored_->store(), options);
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().code, ErrorCode::usage);
    EXPECT_NE(scene.error().message.find("not built in"), std::string::npos) << scene.error().message;
}

TEST_F(SceneOfHills, AToleranceThatIsNoLengthIsRefusedAndLaterStandsForTheLeast) {
    for (const double px : {std::nan(""), -1.0}) {
        for (double SceneOptions::*which : {&SceneOptions::tau_px, &SceneOptions::texture_tau_px}) {
            SceneOptions options = small_options();
            options.*which = px;
            const auto refused = Scene::open(stored_->store(), options);
            ASSERT_FALSE(refused.ok());
            EXPECT_EQ(refused.error().code, ErrorCode::usage);
        }
    }
    for (const LodMethod method : {LodMethod::geomip, LodMethod::block_rsg}) {
        SceneOptions options = small_options();
        options.lod.method = method;
        auto scene = Scene::open(stored_->store(), options);
        ASSERT_TRUE(scene.ok()) << scene.error().message;
        CpuArena arena(stored_->terrain().dataset(), (*scene)->memory().height_slots);
        ASSERT_TRUE((*scene)->start(arena).ok());
        const Camera camera = stored_->camera(512, 512);
        const auto triangles_at = [&](double px) {
            (*scene)->options().tau_px = px;
            const auto frame = (*scene)->complete({&camera, 1});
            EXPECT_TRUE(frame.ok());
            return frame->selection->triangles;
        };
        const std::int64_t least = triangles_at(0), some = triangles_at(8);
        EXPECT_GT(least, some);
        EXPECT_EQ(triangles_at(std::nan("")), least);
        EXPECT_EQ(triangles_at(-1), least);
    }
}

TEST_F(SceneOfHills, ThePapersMetricGoesByWhatItsTilesCorrect) {
    const Camera camera = stored_->camera(200, 512);
    Staged own(*stored_, small_options());
    SceneOptions options = small_options();
    options.lod.metric = ErrorMetric::deboer;
    Staged paper(*stored_, options);
    const auto guaranteed = own.scene->complete({&camera, 1}), deboer = paper.scene->complete({&camera, 1});
    ASSERT_TRUE(guaranteed.ok() && deboer.ok());
    EXPECT_LE(guaranteed->selection->max_bound_px, 2);
    EXPECT_GT(deboer->selection->max_bound_px, 2);
    EXPECT_LT(deboer->selection->triangles, guaranteed->selection->triangles);
    EXPECT_TRUE(own.scene->pager().residency().heights.corrections.empty());
    const ResidentPages& pages = paper.scene->pager().residency().heights;
    EXPECT_EQ(pages.corrections.at(static_cast<std::size_t>(pages.roots[0])),
              test::corrections_of(stored_->terrain(), {0, 0, 0}));
    EXPECT_LE(paper.scene->memory().resident_bytes, options.budget_bytes);
}

TEST_F(SceneOfHills, TileBytesAreThoseOfTheSlotsInUseAndAPartOfThePlan) {
    SceneOptions options = small_options();
    for (const LodMethod method : {LodMethod::geomip, LodMethod::rsg}) {
        options.lod.method = method;
        Staged staged(*stored_, options);
        const std::int64_t roots = staged.scene->tile_bytes(TileKind::height);
        const Camera camera = stored_->camera(200, 512);
        ASSERT_TRUE(staged.scene->complete({&camera, 1}).ok());
        const std::int64_t heights = staged.scene->tile_bytes(TileKind::height),
                           textures = staged.scene->tile_bytes(TileKind::texture);
        EXPECT_GT(heights, roots);
        EXPECT_GE(heights,
                  staged.scene->pager().slots_in_use(TileKind::height) * height_slot_cost(staged.scene->dataset()));
        EXPECT_LE(heights + textures, staged.scene->memory().resident_bytes);
    }
}

TEST_F(SceneOfHills, CullingByCornersLeavesTilesOut) {
    const Camera camera = stored_->camera(200, 512);
    SceneOptions options = small_options();
    options.lod.culling = Culling::corners;
    Staged staged(*stored_, options);
    const auto frame = staged.scene->complete({&camera, 1});
    ASSERT_TRUE(frame.ok());
    EXPECT_GT(frame->selection->culled, 0);
}

TEST_F(SceneOfHills, CatchingUpDoesNotWaitForASlowDisk) {
    SceneOptions options = small_options();
    options.latency_ms = 1000;
    const Camera camera = stored_->camera(200, 512);
    Staged slow(*stored_, options);
    const SceneFrame frame = slow.scene->catch_up({&camera, 1}, 0, 0.02);
    EXPECT_EQ(frame.uploads, 0);
    EXPECT_TRUE(frame.stand_ins);
    EXPECT_FALSE(frame.selection->draws[0].empty());
    EXPECT_FALSE(slow.scene->pager().idle());
}

TEST_F(SceneOfHills, AdvancingTakesNoMoreThanItsShareOfArrivals) {
    SceneOptions options = small_options();
    options.upload_bytes_per_frame = 1;
    options.foresight_s = 0;
    Staged staged(*stored_, options);
    const Camera camera = stored_->camera(200, 512);
    SceneFrame frame = staged.scene->advance({&camera, 1}, 0);
    std::int64_t uploads = 0;
    for (double now_s = 0; frame.stand_ins; now_s += 0.01) {
        frame = staged.scene->advance({&camera, 1}, now_s);
        ASSERT_LE(frame.uploads, 1);
        ASSERT_GE(frame.select_ms, 0);
        uploads += frame.uploads;
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    EXPECT_GT(uploads, 10);
}

TEST_F(SceneOfHills, AFrameThatLooksAgainTakesAsMuchAgainAtMost) {
    SceneOptions options = small_options();
    options.upload_bytes_per_frame = 1;
    options.foresight_s = 0;
    Staged staged(*stored_, options);
    const Camera camera = stored_->camera(200, 512);
    SceneFrame frame = staged.scene->advance({&camera, 1}, 0);
    std::int64_t uploads = 0, twice = 0;
    for (double now_s = 0; frame.stand_ins; now_s += 0.01) {
        frame = staged.scene->advance({&camera, 1}, now_s, 10);
        ASSERT_LE(frame.uploads, 2);
        uploads += frame.uploads;
        twice += frame.uploads == 2 ? 1 : 0;
    }
    EXPECT_GT(uploads, 10);
    EXPECT_GT(twice, 1);
}

// How far, at most, a point of the ground moves across the screen from one frame to the next, 2 ms apart, while all
// that one eye wants arrives from a slow disk.
double greatest_step_px(const StoredTerrain& stored, double growth_s) {
    SceneOptions options = small_options();
    options.latency_ms = 10;
    options.foresight_s = 0;
    options.growth_s = growth_s;
    Staged staged(stored, options);
    const Camera camera = stored.camera(200, 512);
    const test::ProbedSurface surface(stored.terrain(), *staged.arena);
    std::vector<glm::dvec2> places;
    for (int k = 0; k < 400; ++k) places.push_back({205.3 + 6.1 * (k % 20), 452.7 + 6.1 * (k / 20)});
    std::vector<double> before;
    double greatest = 0, now_s = 0;
    for (int calm = 0; calm < 3; now_s += 0.002) {
        const SceneFrame frame = staged.scene->advance({&camera, 1}, now_s);
        std::vector<double> heights = surface.heights_m(frame.selection->draws[0], places, camera.eye, 0);
        for (std::size_t k = 0; k < before.size(); ++k) {
            if (std::isnan(heights[k]) || std::isnan(before[k])) continue;
            const Lattice& l = stored.terrain().lattice();
            const glm::dvec3 place{l.x_m(places[k].x), l.y_m(places[k].y), heights[k]};
            greatest = std::max(
                greatest, std::abs(heights[k] - before[k]) * camera.focal_px() / glm::distance(place, camera.eye));
        }
        before = std::move(heights);
        calm = frame.stand_ins || frame.selection->growing ? 0 : calm + 1;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return greatest;
}

TEST_F(SceneOfHills, WhatASlowDiskBringsGrowsOutOfTheGroundAndDoesNotJump) {
    const double at_once_px = greatest_step_px(*stored_, 0), grown_px = greatest_step_px(*stored_, 0.08);
    EXPECT_GT(at_once_px, 20);
    EXPECT_LT(grown_px, at_once_px / 4) << at_once_px;
    RecordProperty("at_once_px", std::to_string(at_once_px));
    RecordProperty("grown_px", std::to_string(grown_px));
}

SceneFrame advance_until(Scene& scene, const Camera& camera, const std::function<bool()>& done) {
    SceneFrame frame;
    for (int k = 0; k < 20000 && !done(); ++k) {
        EXPECT_TRUE(scene.follow().ok());
        frame = scene.advance({&camera, 1}, k * 0.01);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return frame;
}

TEST_F(SceneOfHills, ExaggeratedHeightsAreTheSameTerrainHigherWithTheSamePromise) {
    Staged staged(*stored_, small_options());
    Scene& scene = *staged.scene;
    const Dataset plain = scene.dataset();
    Camera camera = stored_->camera(200, 512);
    const auto before = scene.complete({&camera, 1});
    ASSERT_TRUE(before.ok());
    const std::int64_t triangles = before->selection->triangles;
    ASSERT_TRUE(scene.set_exaggeration(4).ok());
    const Dataset& d = scene.dataset();
    EXPECT_EQ(d.exaggeration, 4);
    EXPECT_EQ(d.height_offset_m, 4 * plain.height_offset_m);
    EXPECT_EQ(d.height_quantum_m, 4 * plain.height_quantum_m);
    EXPECT_EQ(d.height_quantum_error_m, 4 * plain.height_quantum_error_m);
    EXPECT_EQ(d.warp_error_m, 4 * plain.warp_error_m);
    EXPECT_EQ(d.min_height_m, 4 * plain.min_height_m);
    EXPECT_EQ(d.max_height_m, 4 * plain.max_height_m);
    EXPECT_EQ(dataset_to_json(d).find("exaggeration"), std::string::npos);
    EXPECT_EQ(scene.updates(), 1);
    // There is a picture at once: roots, if nothing else.
    EXPECT_FALSE(scene.advance({&camera, 1}, 0).selection->draws[0].empty());
    camera.eye.z += d.max_height_m - plain.max_height_m;
    const auto after = scene.complete({&camera, 1});
    ASSERT_TRUE(after.ok()) << after.error().message;
    EXPECT_LE(after->selection->max_bound_px, scene.options().tau_px);
    EXPECT_GT(after->selection->triangles, triangles);
    // And back.
    ASSERT_TRUE(scene.set_exaggeration(1).ok());
    camera.eye.z = stored_->camera(200, 512).eye.z;
    const auto again = scene.complete({&camera, 1});
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->selection->triangles, triangles);
    EXPECT_EQ(scene.dataset().max_height_m, plain.max_height_m);
    ASSERT_TRUE(scene.set_exaggeration(1).ok());
    EXPECT_EQ(scene.updates(), 2) << "the same again changes nothing";
}

TEST_F(SceneOfHills, AnExaggerationOutOfRangeChangesNothing) {
    Staged staged(*stored_, small_options());
    const Camera camera = stored_->camera(200, 512);
    for (const double exaggeration : {0.0, -1.0, 0.0099, 100.1, std::nan(""), 1e300}) {
        const auto ok = staged.scene->set_exaggeration(exaggeration);
        ASSERT_FALSE(ok.ok()) << exaggeration;
        EXPECT_EQ(ok.error().code, ErrorCode::usage);
    }
    EXPECT_EQ(staged.scene->dataset().exaggeration, 1);
    EXPECT_EQ(staged.scene->updates(), 0);
    EXPECT_TRUE(staged.scene->complete({&camera, 1}).ok());
}

TEST(SceneThatFollows, KeepsItsExaggerationThroughUpdates) {
    const StoredTerrain stored(hills());
    SceneOptions options = small_options();
    options.follow = true;
    Staged staged(stored, options);
    Scene& scene = *staged.scene;
    ASSERT_TRUE(scene.set_exaggeration(3).ok());
    const Camera camera = stored.camera(200, 512);
    // The same tiles, then another quantum, for which memory is divided anew.
    for (const double factor : {1.0, 0.5}) {
        Dataset next = stored.store().dataset();
        next.height_quantum_m *= factor;
        next.attribution = std::string(5, 'a') + std::to_string(factor);
        auto writer = SqliteStoreWriter::amend(stored.store().path());
        ASSERT_TRUE(writer.ok());
        ASSERT_TRUE((*writer)->finish(next).ok());
        advance_until(scene, camera, [&] { return scene.dataset().attribution == next.attribution; });
        ASSERT_EQ(scene.dataset().attribution, next.attribution);
        EXPECT_EQ(scene.dataset().exaggeration, 3);
        EXPECT_EQ(scene.dataset().height_quantum_m, 3 * next.height_quantum_m);
    }
    EXPECT_EQ(scene.updates(), 3);
    EXPECT_TRUE(scene.complete({&camera, 1}).ok());
}

/// A texture with nothing in it.
TextureTile empty_texture(int size_log2) {
    TextureTile tile;
    tile.blocks.assign(bc1_chain_bytes(size_log2), 0xff);
    return tile;
}

// In place, and with memory divided anew.
TEST(SceneThatFollows, SeesWhereTheGroundEndsAfterAnUpdate) {
    const StoredTerrain stored(hills());
    SceneOptions options = small_options();
    options.follow = true;
    Staged staged(stored, options);
    Scene& scene = *staged.scene;
    const Camera camera = stored.camera(200, 512);
    const TileId lost{1, 1, 1};
    const auto in_lost = [&] {
        const EdgeField& field = *scene.edge_field();
        const EdgeField::Shape& shape = field.shape();
        return field.values()[static_cast<std::size_t>(shape.rows * 3 / 4 * shape.columns + shape.columns * 3 / 4)];
    };
    EXPECT_EQ(in_lost(), EdgeField::kFar);
    Dataset next = stored.store().dataset();
    for (const double factor : {1.0, 0.5}) {
        next.height_quantum_m *= factor;
        next.attribution += "a";
        auto writer = SqliteStoreWriter::amend(stored.store().path());
        ASSERT_TRUE(writer.ok());
        for (const TileId id : stored.terrain().textures()) {
            if (id.level < 1 || ancestor_at(id, 1) != lost) continue;
            TextureTile texture = factor == 1 ? empty_texture(next.texture_size_log2) : stored.terrain().texture(id);
            texture.child_mask = stored.terrain().texture(id).child_mask;
            ASSERT_TRUE((*writer)
                            ->put(TileKind::texture, *tile_key(next.lattice, id), static_cast<int>(TextureCodec::raw),
                                  encode_texture_tile(texture, next.texture_size_log2, TextureCodec::raw))
                            .ok());
        }
        ASSERT_TRUE((*writer)->finish(next).ok());
        advance_until(scene, camera, [&] { return scene.dataset().attribution == next.attribution; });
        EXPECT_EQ(in_lost(), factor == 1 ? 0 : EdgeField::kFar);
    }
    EXPECT_EQ(scene.updates(), 2);
}

TEST_F(SceneOfHills, KeepsNoEdgeFieldThatNobodyWants) {
    SceneOptions options = small_options();
    options.budget_bytes *= 8;  // room for every tile, so that the plans differ by the field alone
    const Staged soft(*stored_, options);
    options.soft_edge = false;
    const Staged hard(*stored_, options);
    EXPECT_NE(soft.scene->edge_field(), nullptr);
    EXPECT_EQ(hard.scene->edge_field(), nullptr);
    EXPECT_EQ(soft.scene->memory().resident_bytes - hard.scene->memory().resident_bytes,
              EdgeField::bytes(soft.scene->edge_field()->shape(), false));
}

struct Flown {
    int stand_ins = 0;
    std::int64_t prefetched = 0;
};

// A straight flight at an even speed, with a store that gives at most one tile a frame: what counts is when it was
// asked for.
Flown fly_straight(const StoredTerrain& stored, double foresight_s) {
    SceneOptions options = small_options();
    options.foresight_s = foresight_s;
    options.upload_bytes_per_frame = 1;
    Staged staged(stored, options);
    Camera camera = stored.camera(10, 512);
    EXPECT_TRUE(staged.scene->complete({&camera, 1}).ok());
    Flown flown;
    for (int k = 0; k < 300; ++k) {
        camera = stored.camera(10 + 0.15 * k, 512);
        const SceneFrame frame = staged.scene->advance({&camera, 1}, k / 30.0);
        flown.stand_ins += frame.stand_ins ? 1 : 0;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    flown.prefetched = staged.scene->pager().counters().prefetched;
    return flown;
}

TEST_F(SceneOfHills, ForesightLeavesFewerStandInsOnAStraightFlight) {
    const Flown without = fly_straight(*stored_, 0), with = fly_straight(*stored_, 1);
    EXPECT_EQ(without.prefetched, 0);
    EXPECT_GT(with.prefetched, 20);
    EXPECT_GT(without.stand_ins, 20);
    EXPECT_LT(with.stand_ins, without.stand_ins / 2);
}

}  // namespace
}  // namespace scree
