// audit_against: drawn frames judged by the samples of a source instead of the store's own.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <vector>

#include "runtime/app/audit.h"
#include "tests/runtime/lod/drawn_frame.h"
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
    explicit Source(const SyntheticTerrain& t) {
        const Lattice& l = t.lattice();
        raster.columns = l.cells_x + 1;
        raster.rows = l.cells_y + 1;
        raster.x0 = l.x_m(0);
        raster.y0 = l.y_m(0);
        raster.dx = raster.dy = l.spacing_m;
        raster.sample_bytes = 8;
        for (std::int64_t j = 0; j < raster.rows; ++j)
            for (std::int64_t i = 0; i < raster.columns; ++i)
                heights.push_back(touches_present(t, i, j) ? t.height_m(i, j) : kNaN);
    }
    Source(const Source&) = delete;
    double& at(std::int64_t i, std::int64_t j) { return heights[static_cast<std::size_t>(j * raster.columns + i)]; }
    const SourceRaster& get() {
        raster.samples = std::as_bytes(std::span<const double>(heights));
        return raster;
    }
    SourceRaster raster;
    std::vector<double> heights;
};

struct Judged {
    ErrorHistogram errors;
    double excess_px = 0;
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
              double half_curvature = 0) {
        Judged judged;
        audit_against(terrain.dataset(), source.get(), {camera, draws, arena_, half_curvature}, stated_m, judged.errors,
                      judged.excess_px);
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

TEST(SourceAudit, ASourceOfAnotherSpacingIsJudgedOnceASample) {
    const SyntheticTerrain terrain({}, test::rough_heights(5, 400));
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    for (const double spacing : {2.5, 3.7, 10.0, 20.0, 33.0}) {
        Source source(terrain);
        SourceRaster& r = source.raster;
        r.dx = r.dy = spacing;
        r.columns = r.rows = static_cast<std::int64_t>(std::floor(64 * l.spacing_m / spacing + 1e-9)) + 1;
        source.heights.assign(static_cast<std::size_t>(r.columns * r.rows), 100);
        EXPECT_EQ(a.by(source, a.above(), a.finest()).errors.count(), r.columns * r.rows) << spacing;
    }
}

TEST(SourceAudit, SamplesBesideTheTerrainAreNotJudged) {
    for (const std::int64_t cells : {64, 61, 57}) {  // tiles that end with it, tiles that reach beyond
        test::TerrainShape shape;
        shape.cells_x = shape.cells_y = cells;
        const SyntheticTerrain terrain(shape, test::rough_heights(5, 400));
        Audited a(terrain);
        for (const double spacing : {10.0, 2.5}) {
            Source source(terrain);
            SourceRaster& r = source.raster;
            r.dx = r.dy = spacing;
            r.x0 -= 3 * r.dx;
            r.y0 += 3 * r.dy;
            const auto across = static_cast<std::int64_t>(static_cast<double>(cells) * 10 / spacing) + 1;
            r.columns = r.rows = across + 6;
            source.heights.assign(static_cast<std::size_t>(r.columns * r.rows), 100);
            EXPECT_EQ(a.by(source, a.above(), a.finest()).errors.count(), across * across) << cells << ", " << spacing;
        }
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
        (eastward ? source.raster.x0 : source.raster.y0) += 0.5 * l.spacing_m;
        const Judged judged = a.by(source, *camera, a.finest());
        if (eastward)
            EXPECT_NEAR(judged.errors.max(), camera->focal_px() * 5 / 2000, 0.01);
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
