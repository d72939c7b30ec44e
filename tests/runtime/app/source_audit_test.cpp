// audit_against: drawn frames judged by the samples of a source instead of the store's own.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <set>
#include <vector>

#include "runtime/app/audit.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/grid_mesh.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

using test::SyntheticTerrain;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool touches_present(const SyntheticTerrain& t, std::int64_t i, std::int64_t j) {
    return t.present(i, j) || t.present(i - 1, j) || t.present(i, j - 1) || t.present(i - 1, j - 1);
}

/// The DEM that a terrain was built from; may be bent before it is judged by.
struct Source {
    explicit Source(const SyntheticTerrain& t) : lattice(t.lattice()) {
        layer.names = {"a"};
        layer.sample_bytes = 8;
        place(
            [this](double c, double r) {
                return SourcePoint{lattice.x_m(c), lattice.y_m(r)};
            },
            lattice.cells_x + 1, lattice.cells_y + 1);
        heights.clear();
        for (std::int64_t j = 0; j < layer.rows; ++j)
            for (std::int64_t i = 0; i < layer.columns; ++i)
                heights.push_back(touches_present(t, i, j) ? t.height_m(i, j) : kNaN);
    }
    Source(const Source&) = delete;
    double& at(std::int64_t i, std::int64_t j) { return heights[static_cast<std::size_t>(j * layer.columns + i)]; }
    /// So many samples, all at 100 m, standing where `position` says, with control points every `step`.
    using Position = std::function<SourcePoint(double column, double row)>;
    void place(const Position& position, std::int64_t columns, std::int64_t rows, std::int64_t step = 1 << 20) {
        layer.columns = columns;
        layer.rows = rows;
        layer.step = step;
        controls.clear();
        for (std::int64_t r = 0; r < layer.control_rows(); ++r)
            for (std::int64_t c = 0; c < layer.control_columns(); ++c) {
                const SourcePoint p =
                    position(static_cast<double>(layer.control_column(c)), static_cast<double>(layer.control_row(r)));
                controls.push_back(p.x);
                controls.push_back(p.y);
            }
        heights.assign(static_cast<std::size_t>(columns * rows), 100);
    }
    /// Samples of a spacing, the first so many metres east and north of the terrain's.
    void place_every(double spacing, std::int64_t columns, std::int64_t rows, double east = 0, double north = 0) {
        place(
            [=, this](double c, double r) {
                return SourcePoint{lattice.x_m(0) + east + c * spacing, lattice.y_m(0) + north - r * spacing};
            },
            columns, rows);
    }
    const SourceLayer& get() {
        layer.samples = std::as_bytes(std::span<const double>(heights));
        layer.controls = std::as_bytes(std::span<const double>(controls));
        return layer;
    }
    Lattice lattice;
    SourceLayer layer;
    std::vector<double> heights, controls;
};

struct Judged {
    ErrorHistogram errors;
    double excess_px = 0;
    std::int64_t not_drawn = 0;
};

class Audited {
public:
    explicit Audited(const SyntheticTerrain& t)
        : terrain(t), store_(t), residency_(t), arena_(test::arena_of(t)), selector_(t.dataset()) {
        residency_.add_all();
        reader_ = std::move(*store_.open_reader());
    }
    const Selection& select(const Camera& camera, const SelectionSettings& settings) {
        return selector_.select({&camera, 1}, settings, residency_);
    }
    ErrorHistogram by_store(const Camera& camera, const DrawList& draws, double half_curvature = 0) {
        ErrorHistogram errors;
        EXPECT_TRUE(audit_frame(store_, *reader_, {camera, draws, arena_, half_curvature}, errors).ok());
        return errors;
    }
    Judged by(Source& source, const Camera& camera, const DrawList& draws, double stated_m = 0,
              double half_curvature = 0, const MeshPool* meshes = nullptr) {
        Judged judged;
        const auto judge = SourceJudge::make(terrain.dataset(), *reader_, source.get());
        EXPECT_TRUE(judge.ok());
        judged.not_drawn = judge->not_drawn();
        EXPECT_TRUE(audit_against(terrain.dataset(), *judge, {camera, draws, arena_, half_curvature, meshes}, stated_m,
                                  judged.errors, judged.excess_px)
                        .ok());
        return judged;
    }
    /// Every deepest tile that is stored.
    DrawList finest() const {
        DrawList draws;
        for (const TileId id : terrain.tiles())
            if (id.level == terrain.lattice().deepest_level) {
                DrawItem item;
                item.tile = id;
                item.height_slot = terrain.index(id);
                draws.push_back(item);
            }
        return draws;
    }
    /// Straight above the middle, with all of the terrain in view.
    Camera above() const {
        const Lattice& l = terrain.lattice();
        const double i = static_cast<double>(l.cells_x) / 2, j = static_cast<double>(l.cells_y) / 2;
        auto camera = look_at({l.x_m(i), l.y_m(j), 20000}, {l.x_m(i), l.y_m(j), 0}, 40, 800, 800);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }
    const SyntheticTerrain& terrain;

private:
    test::MemoryStore store_;
    test::FakeResidency residency_;
    CpuArena arena_;
    Selector selector_;
    std::unique_ptr<TileReader> reader_;
};

/// Positions are floats, as on the GPU.
constexpr double kRoundingPx = 1e-3;

TEST(SourceAudit, AgainstTheSamplesOfTheStoreItIsTheAuditOfTheStore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t samples = 0;
    for (int world = 0; world < 25; ++world) {
        const auto terrain = test::random_terrain(random);
        Audited a(terrain);
        Source source(terrain);
        for (int k = 0; k < 6; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -2, 5)));
            if (k % 2 == 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            const Selection& s = a.select(camera, settings);
            const ErrorHistogram own = a.by_store(camera, s.draws[0], settings.half_curvature);
            const Judged judged = a.by(source, camera, s.draws[0], 0, settings.half_curvature);
            // A vertex on a line between tiles is looked at on one of them, and both draw it alike.
            ASSERT_NEAR(judged.errors.max(), own.max(), kRoundingPx);
            ASSERT_EQ(judged.excess_px, judged.errors.max());
            ASSERT_LE(judged.errors.count(), own.count());
            ASSERT_LE(judged.errors.max(), s.max_bound_px + kRoundingPx);
            samples += judged.errors.count();
        }
    }
    EXPECT_GT(samples, 50000);
}

TEST(SourceAudit, JudgesTheMeshThatATileIsDrawnBy) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    Source source(terrain);
    const Camera camera = a.above();
    const Judged exact = a.by(source, camera, a.finest());
    MeshPool pool(128 * a.finest().size(), 128);
    DrawList flat = a.finest();
    for (DrawItem& item : flat) item.mesh = pool.put(test::GridMesh(3).indices());
    const Judged coarse = a.by(source, camera, flat, 0, 0, &pool);
    DrawList patterns = a.finest();
    for (DrawItem& item : patterns) item.geomip = 2;
    EXPECT_EQ(coarse.errors.count(), exact.errors.count());
    EXPECT_GT(coarse.errors.mean(), a.by(source, camera, patterns).errors.mean());
    EXPECT_GT(a.by(source, camera, patterns).errors.mean(), exact.errors.mean());
}

TEST(SourceAudit, EverySampleOfAPresentCellIsJudgedOnceOnBordersAndRimsToo) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 25; ++world) {
        const auto terrain = test::random_terrain(random);
        Audited a(terrain);
        Source source(terrain);
        const Lattice& l = terrain.lattice();
        std::int64_t samples = 0;
        for (std::int64_t j = 0; j <= l.cells_y; ++j)
            for (std::int64_t i = 0; i <= l.cells_x; ++i) samples += touches_present(terrain, i, j) ? 1 : 0;
        ASSERT_EQ(a.by(source, a.above(), a.finest()).errors.count(), samples);
        const Camera camera = a.above();
        ASSERT_EQ(a.by(source, camera, a.select(camera, test::with_tau(2)).draws[0]).errors.count(), samples);
    }
}

// Neighbours that must have terrain: the lattice's spacing in samples, and half a sample.
std::int64_t rim(double spacing_m, double lattice_m) {
    return static_cast<std::int64_t>(std::ceil(0.5 + 1.01 * lattice_m / spacing_m));
}

TEST(SourceAudit, ASourceOfAnotherSpacingIsJudgedOnceASampleButForItsRim) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    for (const double spacing : {2.5, 3.7, 20.0, 33.0}) {
        Source source(terrain);
        const auto side = static_cast<std::int64_t>(std::floor(64 * l.spacing_m / spacing + 1e-9)) + 1;
        source.place_every(spacing, side, side);
        const std::int64_t judged = side - 2 * rim(spacing, l.spacing_m);
        const Judged j = a.by(source, a.above(), a.finest());
        EXPECT_EQ(j.errors.count(), judged * judged) << spacing;
        EXPECT_EQ(j.not_drawn, 0) << spacing;
    }
}

TEST(SourceAudit, SamplesBesideTheTerrainAreMissed) {
    for (const std::int64_t cells : {64, 61, 57}) {  // tiles that end with it, tiles that reach beyond
        test::TerrainShape shape;
        shape.cells_x = shape.cells_y = cells;
        const SyntheticTerrain terrain(shape, test::rough_heights(5, 400));
        Audited a(terrain);
        for (const double spacing : {10.0, 2.5}) {
            const std::int64_t beside = spacing == 10 ? 3 : 3 + rim(spacing, 10);
            const auto over = static_cast<std::int64_t>(static_cast<double>(cells) * 10 / spacing) + 1;
            Source source(terrain);
            const double away = static_cast<double>(beside) * spacing;
            source.place_every(spacing, over + 2 * beside, over + 2 * beside, -away, away);
            const Judged j = a.by(source, a.above(), a.finest());
            EXPECT_EQ(j.errors.count(), over * over) << cells << ", " << spacing;
            // What is judged and lies beside it: a frame three samples wide.
            EXPECT_EQ(j.not_drawn, (over + 6) * (over + 6) - over * over) << cells << ", " << spacing;
        }
    }
}

// Turned, sheared and bent a little: no line of samples is a line of the lattice.
Source::Position warped(const Lattice& l, double spacing) {
    return [&l, spacing](double c, double r) {
        const double u = c * spacing, v = r * spacing;
        return SourcePoint{l.x_m(5) + 0.9 * u + 0.25 * v + 1e-4 * u * v / 10,
                           l.y_m(12) + 0.2 * u - 0.85 * v + 1e-4 * u * u};
    };
}

TEST(SourceAudit, SamplesInAnyAttitudeAreJudgedOnceEach) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    for (const double spacing : {3.0, 8.0, 15.0})
        for (const std::int64_t step : {1, 3, 8}) {
            const auto side = static_cast<std::int64_t>(400 / spacing);
            Source source(terrain);
            source.place(warped(l, spacing), side, side, step);
            for (double& height : source.heights) height = 1;
            const Judged all = a.by(source, a.above(), a.finest());
            EXPECT_EQ(all.not_drawn, 0);
            // Every judged sample once: moving any one by a metre is seen once; counted are those within the rim.
            const Camera camera = a.above();
            EXPECT_EQ(a.by(source, camera, a.select(camera, test::with_tau(2)).draws[0]).errors.count(),
                      all.errors.count());
            EXPECT_GT(all.errors.count(), (side - 14) * (side - 14));
            EXPECT_LT(all.errors.count(), (side - 2) * (side - 2));
        }
}

TEST(SourceAudit, SamplesTakenFromTheSurfaceAgreeWithItAndMisplacedOnesDoNot) {
    // On a plane every interpolation agrees; the control grid's curve does not lie in the plane's way.
    const SyntheticTerrain terrain(
        {}, [](std::int64_t i, std::int64_t j) { return static_cast<std::int32_t>(8 * i + 4 * j); });
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(32), l.y_m(64) - 2000, 300}, {l.x_m(32), l.y_m(32), 60}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    for (const double off_m : {0.0, 3.0}) {
        Source source(terrain);
        source.place(warped(l, 7), 60, 60, 5);
        source.get();
        for (std::int64_t r = 0; r < 60; ++r)
            for (std::int64_t c = 0; c < 60; ++c) {
                const SourcePoint p = source.layer.position(static_cast<double>(c), static_cast<double>(r));
                source.at(c, r) = terrain.dataset().height_m(8 * l.i_of(p.x + off_m) + 4 * l.j_of(p.y));
            }
        const Judged judged = a.by(source, *camera, a.finest());
        EXPECT_GT(judged.errors.count(), 2000);
        EXPECT_EQ(judged.not_drawn, 0);
        if (off_m == 0)
            EXPECT_LT(judged.errors.max(), kRoundingPx);
        else
            EXPECT_NEAR(judged.errors.max(), camera->focal_px() * 0.6 / 2200, 0.05);  // 3 m along a slope of 2 in 10
    }
}

TEST(SourceAudit, AHoleInTheStoreIsFoundUnderSamplesInAnyAttitude) {
    for (const std::int64_t hole : {1, 2, 5}) {
        const SyntheticTerrain terrain({}, test::rough_heights(5, 400), [&](std::int64_t i, std::int64_t j) {
            return i < 30 || i >= 30 + hole || j < 30 || j >= 30 + hole;
        });
        Audited a(terrain);
        for (const double spacing : {3.0, 8.0}) {
            Source source(terrain);
            source.place(warped(terrain.lattice(), spacing), static_cast<std::int64_t>(400 / spacing),
                         static_cast<std::int64_t>(400 / spacing), 4);
            EXPECT_GT(a.by(source, a.above(), a.finest()).not_drawn, 0) << hole << ", " << spacing;
            // Hidden samples are no truth, but terrain is drawn over them.
            for (double& height : source.heights) height = std::numeric_limits<double>::infinity();
            const Judged hidden = a.by(source, a.above(), a.finest());
            EXPECT_GT(hidden.not_drawn, 0) << hole << ", " << spacing;
            EXPECT_EQ(hidden.errors.count(), 0);
        }
        Source own(terrain);
        EXPECT_EQ(a.by(own, a.above(), a.finest()).not_drawn, 0) << "voids of the source are no holes";
        for (std::int64_t j = 0; j < own.layer.rows; ++j)
            for (std::int64_t i = 0; i < own.layer.columns; ++i) own.at(i, j) = terrain.height_m(i, j);
        EXPECT_EQ(a.by(own, a.above(), a.finest()).not_drawn, (hole - 1) * (hole - 1)) << "samples inside the hole";
    }
}

TEST(SourceAudit, ASourceThatIsHigherByAMetreIsSeenAndWhatIsStatedIsTakenOff) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    // Level, from 2 km off: a metre stands upright.
    auto camera = look_at({l.x_m(32), l.y_m(64) - 2000, 100}, {l.x_m(32), l.y_m(32), 100}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    Source source(terrain);
    ASSERT_LT(a.by(source, *camera, a.finest()).errors.max(), kRoundingPx);
    for (double& height : source.heights) height += 1;
    const Judged judged = a.by(source, *camera, a.finest());
    EXPECT_NEAR(judged.errors.max(), camera->focal_px() / 2000, kRoundingPx);
    EXPECT_NEAR(judged.errors.quantile(0.01), camera->focal_px() / 2640, 0.02);
    EXPECT_EQ(judged.excess_px, judged.errors.max());
    const Judged half = a.by(source, *camera, a.finest(), 0.5), all = a.by(source, *camera, a.finest(), 1.01);
    EXPECT_EQ(half.errors.max(), judged.errors.max());
    EXPECT_LT(half.excess_px, judged.excess_px);
    EXPECT_GT(half.excess_px, 0);
    EXPECT_LE(all.excess_px, kRoundingPx);
}

TEST(SourceAudit, ASourceThatIsMisplacedByHalfACellIsSeen) {
    const SyntheticTerrain terrain({}, [](std::int64_t i, std::int64_t) { return static_cast<std::int32_t>(40 * i); });
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(32), l.y_m(64) - 2000, 300}, {l.x_m(32), l.y_m(32), 300}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    // A slope of one in one: half a cell east is half a cell too low.
    for (const bool eastward : {true, false}) {
        Source source(terrain);
        ASSERT_LT(a.by(source, *camera, a.finest()).errors.max(), kRoundingPx);
        source.get();
        for (std::size_t k = eastward ? 0 : 1; k < source.controls.size(); k += 2)
            source.controls[k] += 0.5 * l.spacing_m;
        const Judged judged = a.by(source, *camera, a.finest());
        if (eastward)
            EXPECT_NEAR(judged.errors.max(), camera->focal_px() * 5 / 2020, 0.01);  // two rows are rim
        else
            EXPECT_LT(judged.errors.max(), kRoundingPx);  // along the slope nothing can be seen
    }
}

TEST(SourceAudit, VoidsAndWhatHasNoCellOfFourAreSkipped) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    Source source(terrain);
    source.at(20, 20) = kNaN;
    EXPECT_EQ(a.by(source, a.above(), a.finest()).errors.count(), 65 * 65 - 1);
    // A sample alone among voids, a hundred metres wrong.
    for (std::int64_t j = 39; j <= 41; ++j)
        for (std::int64_t i = 39; i <= 41; ++i) source.at(i, j) = i == 40 && j == 40 ? 1000 : kNaN;
    const Judged judged = a.by(source, a.above(), a.finest());
    EXPECT_EQ(judged.errors.count(), 65 * 65 - 10);
    EXPECT_LT(judged.errors.max(), kRoundingPx);
    for (double& height : source.heights) height = kNaN;
    EXPECT_EQ(a.by(source, a.above(), a.finest()).errors.count(), 0);
}

}  // namespace
}  // namespace scree
