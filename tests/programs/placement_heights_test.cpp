// Proof of placement of heights: planes of known slope, written through every path, come back from the store where they
// were, within a hundredth of a source sample. A plane that grows along a raster's columns and one along
// its rows tell the place of every stored sample from its height.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "common/query/ground.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_support.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

constexpr double kSharedLimit = 1e-6;      // samples: of points so near a raster's limit either is right
constexpr double kRoundingSamples = 1e-3;  // of quanta, float32 and curvature within a sample

// A plane over a CRS: `along_columns` of heights per sample along the columns of `grid`, and so for rows.
struct Plane {
    SampleGrid grid;
    double along_columns = 0, along_rows = 0, offset = 0;

    double at(double x, double y) const {
        const auto [column, row] = grid.sample_of(x, y);
        return offset + along_columns * column + along_rows * row;
    }
};

// A raster that may be cut into several files; of those that overlap the later one lies on top.
struct Patch {
    SampleGrid grid;
    std::vector<std::array<int, 4>> parts;  ///< column, row, columns, rows of the files; none: one file
    HeightFormat format = HeightFormat::striped;
};

struct Sources {
    std::vector<Patch> patches;
    std::vector<std::string> arguments;
    int steps = 100;           ///< metres from sample to sample of the plane's grid
    std::size_t plane_of = 0;  ///< the patch whose samples are counted
    bool reversed = false;     ///< the files in the opposite order (where patches do not overlap)
    double bound_samples = kBoundSamples;
    bool between_samples = true;  ///< planes stay planes between lattice points
};

SampleValue heights_of(const SampleGrid& grid, const Plane& plane) {
    const Move move(grid.crs, plane.grid.crs);
    std::vector<double> x, y;
    for (int r = 0; r < grid.height; ++r)
        for (int c = 0; c < grid.width; ++c) {
            x.push_back(grid.x(c, r));
            y.push_back(grid.y(c, r));
        }
    move(x, y);
    std::vector<double> z(x.size());
    for (std::size_t k = 0; k < z.size(); ++k) z[k] = plane.at(x[k], y[k]);
    // Where integers are written the plane's slopes are integers.
    for (double& v : z)
        if (std::abs(v - std::round(v)) < 1e-4) v = std::round(v);
    return [z, width = grid.width](int c, int r) { return z[static_cast<std::size_t>(r * width + c)]; };
}

std::vector<std::string> write_patches(const std::string& folder, const Sources& sources, const Plane& plane) {
    std::vector<std::string> files;
    for (std::size_t p = 0; p < sources.patches.size(); ++p) {
        const Patch& patch = sources.patches[p];
        auto parts = patch.parts;
        if (parts.empty()) parts.push_back({0, 0, patch.grid.width, patch.grid.height});
        for (const auto& [c, r, columns, rows] : parts) {
            SampleGrid part = patch.grid.part(c, r, columns, rows);
            const SampleValue heights = heights_of(part, plane);
            if (part.crs == "EPSG:4326" && part.first_x >= 180) part.first_x -= 360;
            files.push_back(
                write_placed_heights(folder, "p" + std::to_string(files.size()), patch.format, part, heights));
        }
    }
    if (sources.reversed) std::reverse(files.begin(), files.end());
    return files;
}

// What stands at the points of a store's finest lattice.
struct Expected {
    enum Kind : std::uint8_t { nothing, height, either };
    std::vector<Kind> kind;
    std::vector<double> z, tolerance;
};

// Greatest difference of the plane over one sample of a raster.
double height_of_a_sample(const SampleGrid& grid, const Plane& plane) {
    const Move move(grid.crs, plane.grid.crs);
    const double c = grid.width / 2, r = grid.height / 2;
    const auto at = [&](double column, double row) {
        const auto [x, y] = move.one(grid.x(column, row), grid.y(column, row));
        return plane.at(x, y);
    };
    return std::max(std::abs(at(c + 1, r) - at(c, r)), std::abs(at(c, r + 1) - at(c, r)));
}

void lay_over(const StoreUnderTest& store, const SampleGrid& grid, const Plane& plane, double bound_samples,
              Expected& expected) {
    std::vector<double> x, y;
    store.points_in(grid.crs, x, y);
    const double rim = grid.area ? 0.5 : 0, last_c = grid.width - 1, last_r = grid.height - 1;
    const double tolerance = bound_samples * height_of_a_sample(grid, plane) +
                             kRoundingSamples * std::max(std::abs(plane.along_columns), std::abs(plane.along_rows));
    std::vector<std::size_t> held;
    std::vector<double> at_x, at_y;
    for (std::size_t k = 0; k < x.size(); ++k) {
        if (grid.crs == "EPSG:4326" && x[k] < grid.first_x - 180) x[k] += 360;
        const auto [c, r] = grid.sample_of(x[k], y[k]);
        // How far inside, in samples; at a rim values go on as they are.
        const double inside = std::min({c + rim, last_c + rim - c, r + rim, last_r + rim - r});
        const double unsure = grid.crs == store.dataset().crs ? kSharedLimit : kBoundSamples;
        if (!(inside > -unsure)) continue;
        if (inside < unsure) {
            if (expected.kind[k] == Expected::nothing) expected.kind[k] = Expected::either;
        } else {
            expected.kind[k] = Expected::height;
        }
        const double cc = std::clamp(c, 0.0, last_c), rr = std::clamp(r, 0.0, last_r);
        held.push_back(k);
        at_x.push_back(grid.x(cc, rr));
        at_y.push_back(grid.y(cc, rr));
    }
    Move(grid.crs, plane.grid.crs)(at_x, at_y);
    for (std::size_t n = 0; n < held.size(); ++n) {
        expected.z[held[n]] = plane.at(at_x[n], at_y[n]);
        expected.tolerance[held[n]] = tolerance;
    }
}

Expected expectation(const StoreUnderTest& store, const Sources& sources, const Plane& plane) {
    const auto count = static_cast<std::size_t>(store.pitch() * (store.lattice().cells_y + 1));
    Expected expected{std::vector<Expected::Kind>(count, Expected::nothing), std::vector<double>(count),
                      std::vector<double>(count)};
    for (const Patch& patch : sources.patches) lay_over(store, patch.grid, plane, sources.bound_samples, expected);
    return expected;
}

// Every sample of every tile (of an edge both) that lies where there are heights.
void expect_samples(const StoreUnderTest& store, const Expected& expected) {
    const Lattice& l = store.lattice();
    double worst = 0;
    std::int64_t compared = 0;
    for (const auto& [id, tile] : store.height_tiles()) {
        const LatticePoint corner = l.corner(id);
        for (int r = 0; r < l.tile_samples(); ++r)
            for (int c = 0; c < l.tile_samples(); ++c) {
                const std::int64_t i = corner.i + c * l.step(id.level), j = corner.j + r * l.step(id.level);
                if (i > l.cells_x || j > l.cells_y) continue;
                const std::size_t k = store.index(i, j);
                if (expected.kind[k] != Expected::height) continue;
                const double z =
                    store.dataset().height_m(tile.samples[static_cast<std::size_t>(r * l.tile_samples() + c)]);
                const double off = std::abs(z - expected.z[k]);
                ++compared;
                if (off / expected.tolerance[k] > worst) worst = off / expected.tolerance[k];
                if (off > expected.tolerance[k]) {
                    ADD_FAILURE() << "level " << id.level << ", tile " << id.x << ", " << id.y << ", sample " << c
                                  << ", " << r << " (lattice " << i << ", " << j << "): " << z << " m instead of "
                                  << expected.z[k] << " +- " << expected.tolerance[k];
                    return;
                }
            }
    }
    EXPECT_GT(compared, 100);
    ::testing::Test::RecordProperty("worst_share_of_tolerance", std::to_string(worst));
    if (std::getenv("SCREE_PLACEMENT_TELL") != nullptr)
        std::printf("    %lld samples, worst %.4f of the tolerance\n", static_cast<long long>(compared), worst);
}

// A cell of the dense part is present where its four corners have heights; what deepens it keeps that.
void expect_cells(const StoreUnderTest& store, const Expected& expected) {
    const Lattice& l = store.lattice();
    const std::int64_t base = l.step(store.dataset().least_leaf_level());
    std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> found;  // base cell -> finest cells
    for (const auto& [id, tile] : store.height_tiles()) {
        if (!tile.header.is_leaf()) continue;
        const LatticePoint corner = l.corner(id);
        for (int r = 0; r < l.tile_cells(); ++r)
            for (int c = 0; c < l.tile_cells(); ++c) {
                if (!tile.presence.empty() && tile.presence[static_cast<std::size_t>(r * l.tile_cells() + c)] == 0)
                    continue;
                const std::int64_t step = l.step(id.level);
                found[{(corner.i + c * step) / base, (corner.j + r * step) / base}] += step * step;
            }
    }
    std::int64_t missing = 0, outside = 0, present = 0;
    for (std::int64_t j = 0; j + base <= l.cells_y; j += base)
        for (std::int64_t i = 0; i + base <= l.cells_x; i += base) {
            int nothing = 0, sure = 0;
            for (const auto& [u, v] : {std::pair{i, j}, {i + base, j}, {i, j + base}, {i + base, j + base}}) {
                nothing += expected.kind[store.index(u, v)] == Expected::nothing;
                sure += expected.kind[store.index(u, v)] == Expected::height;
            }
            const auto at = found.find({i / base, j / base});
            const std::int64_t covered = at == found.end() ? 0 : at->second;
            if (at != found.end()) found.erase(at);
            EXPECT_TRUE(covered == 0 || covered == base * base) << i << ", " << j;
            missing += sure == 4 && covered == 0;
            outside += nothing > 0 && covered > 0;
            present += covered > 0;
        }
    EXPECT_EQ(missing, 0);
    EXPECT_EQ(outside, 0);
    EXPECT_GT(present, 0);
    EXPECT_TRUE(found.empty()) << "beyond the extent";
}

// Within a sample outside of a raster of areas that lies above: there it goes on with its border's value, and the
// surface has a step.
bool at_a_rim_above(const Sources& sources, const Patch& patch, double x, double y) {
    for (const Patch* above = &patch + 1; above < sources.patches.data() + sources.patches.size(); ++above) {
        if (!above->grid.area || above->grid.crs != patch.grid.crs) continue;
        const auto [c, r] = above->grid.sample_of(x, y);
        const double inside = std::min({c, above->grid.width - 1 - c, r, above->grid.height - 1 - r});
        if (inside < 0 && inside > -2) return true;
    }
    return false;
}

// At the places of the files' own samples, where the surface interpolates.
void expect_at_source_samples(const StoreUnderTest& store, const Sources& sources, const Plane& plane) {
    auto ground = Ground::open(store.store());
    ASSERT_TRUE(ground);
    std::int64_t compared = 0;
    for (const Patch& patch : sources.patches) {
        const SampleGrid& g = patch.grid;
        const Move to_store(g.crs, store.dataset().crs), to_plane(g.crs, plane.grid.crs);
        const double tolerance = sources.bound_samples * height_of_a_sample(g, plane) +
                                 kRoundingSamples * std::max(std::abs(plane.along_columns), std::abs(plane.along_rows));
        std::vector<double> x, y, px, py;
        const int every = std::max(1, std::max(g.width, g.height) / 40);
        // Cells at the border may lack a corner.
        const Lattice& l = store.lattice();
        const double cell_m = l.spacing_m * static_cast<double>(l.step(store.dataset().least_leaf_level()));
        const int margin = 2 + static_cast<int>(std::ceil(cell_m / ground_step(g, store.dataset().crs)));
        for (int r = margin; r < g.height - margin; r += every)
            for (int c = margin; c < g.width - margin; c += every) {
                if (at_a_rim_above(sources, patch, g.x(c, r), g.y(c, r))) continue;
                x.push_back(g.x(c, r));
                y.push_back(g.y(c, r));
            }
        px = x;
        py = y;
        to_store(x, y);
        to_plane(px, py);
        for (std::size_t k = 0; k < x.size(); ++k) {
            const auto height = (*ground)->height(x[k], y[k]);
            ASSERT_TRUE(height);
            ASSERT_TRUE(*height) << x[k] << ", " << y[k];
            ASSERT_NEAR((*height)->height_m, plane.at(px[k], py[k]), tolerance) << x[k] << ", " << y[k];
            ++compared;
        }
    }
    EXPECT_GT(compared, 100);
}

std::string built(const Sources& sources, const std::string& folder, const Plane& plane) {
    std::vector<std::string> arguments = write_patches(folder, sources, plane);
    arguments.insert(arguments.end(), sources.arguments.begin(), sources.arguments.end());
    arguments.insert(arguments.end(), {"--height-quantum", "0.01", "--fill", "none", "--texture-size", "32"});
    const std::string store = folder + "/s.scree";
    build_store_from(arguments, store);
    return store;
}

void expect_plane_in_place(const Sources& sources, const Plane& plane) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.file("in"));
    const StoreUnderTest store(built(sources, folder.file("in"), plane));
    const Expected expected = expectation(store, sources, plane);
    expect_samples(store, expected);
    expect_cells(store, expected);
    if (sources.between_samples) expect_at_source_samples(store, sources, plane);
}

void expect_in_place(const Sources& sources) {
    const SampleGrid& grid = sources.patches[sources.plane_of].grid;
    {
        SCOPED_TRACE("along columns");
        expect_plane_in_place(sources, {grid, static_cast<double>(sources.steps), 0, 100});
    }
    {
        SCOPED_TRACE("along rows");
        expect_plane_in_place(sources, {grid, 0, static_cast<double>(sources.steps), 100});
    }
}

Sources one(const SampleGrid& grid, HeightFormat format = HeightFormat::striped,
            std::vector<std::string> arguments = {}) {
    return {{{grid, {}, format}}, std::move(arguments)};
}
const SampleGrid kUtm = north_up("EPSG:32633", 452345.5, 5298765.25, 30, 75, 67);
const SampleGrid kDegrees = north_up("EPSG:4326", 13.7, 47.4, 1.0 / 1200, 61, 67);
SampleGrid mercator() { return north_up("EPSG:3857", 1500000, 8399737, 40, 61, 67); }  // at 60 degrees north

TEST(Placement, OfEveryGeoTiffThatNeedsNoResampling) {
    for (const HeightFormat format : {HeightFormat::striped, HeightFormat::tiled, HeightFormat::matrix})
        for (const bool area : {false, true}) {
            SCOPED_TRACE(area ? "areas" : "points");
            SampleGrid grid = kUtm;
            grid.area = area;
            expect_in_place(one(grid, format));
        }
}

TEST(Placement, OfSouthUpRasters) {
    expect_in_place(one(south_up(kUtm), HeightFormat::matrix));
    expect_in_place(one(of_areas(south_up(kUtm)), HeightFormat::matrix_tiled));
}

TEST(Placement, OfTurnedRasters) {
    expect_in_place(one(kUtm.turned(30), HeightFormat::matrix));
    expect_in_place(one(of_areas(kUtm).turned(30), HeightFormat::matrix_tiled));
    expect_in_place(one(south_up(kUtm).turned(-77), HeightFormat::matrix));
    expect_in_place(one(kUtm.turned(90), HeightFormat::matrix));
}

TEST(Placement, OfCellsThatAreNotSquare) {
    SampleGrid grid = kUtm;
    grid.row_y = -41;
    expect_in_place(one(grid));
    expect_in_place(one(of_areas(grid), HeightFormat::matrix));
    expect_in_place(one(of_areas(grid).turned(12), HeightFormat::matrix));
}

TEST(Placement, OfEveryFormat) {
    const std::vector<std::string> utm{"--assume-crs", "EPSG:32633"}, degrees{"--assume-crs", "EPSG:4326"};
    for (const PlacedExample& example : placed_grid_examples()) {
        SCOPED_TRACE(static_cast<int>(example.format));
        Sources sources = one(example.grid, example.format, example.arguments);
        sources.steps = example.steps;
        expect_in_place(sources);
    }
    expect_in_place(one(of_areas(kDegrees), HeightFormat::ascii_corner, degrees));
    expect_in_place(one(of_areas(kUtm), HeightFormat::png, utm));
    expect_in_place(one(of_areas(kUtm), HeightFormat::world_file_tiff, utm));
    expect_in_place(one(of_areas(kUtm).turned(30), HeightFormat::world_file_tiff, utm));
}

TEST(Placement, OfEveryCrs) {
    expect_in_place(one(kDegrees));
    expect_in_place(one(of_areas(kDegrees)));
    expect_in_place(one(kDegrees.turned(20), HeightFormat::matrix));
    expect_in_place(one(mercator()));
    expect_in_place(one(of_areas(mercator()), HeightFormat::striped, {"--crs", "EPSG:32633"}));
    expect_in_place(one(of_areas(mercator()), HeightFormat::striped, {"--crs", "EPSG:3857"}));
    expect_in_place(one(north_up("EPSG:3413", -200000, -2100000, 30, 61, 67)));
    expect_in_place(one(of_areas(north_up("EPSG:3413", -200000, -2100000, 30, 61, 67)), HeightFormat::striped,
                        {"--crs", "EPSG:32624"}));
    expect_in_place(one(north_up("EPSG:2154", 652000, 6862000, 5, 61, 67)));
    expect_in_place(
        one(of_areas(north_up("EPSG:2154", 652000, 6862000, 5, 61, 67)), HeightFormat::tiled, {"--crs", "EPSG:32631"}));
    expect_in_place(one(north_up("EPSG:2229", 6480000, 1840000, 10, 61, 67)));
    expect_in_place(one(of_areas(north_up("EPSG:2229", 6480000, 1840000, 10, 61, 67))));
}

TEST(Placement, OfRastersSoWideThatTheirProjectionIsCurved) {
    // 12 degrees: positions are interpolated over chunks of the lattice, and the bound on that is what is proved.
    expect_in_place(one(north_up("EPSG:4326", 9, 52, 1.0 / 20, 241, 161)));
    expect_in_place(one(of_areas(north_up("EPSG:4326", -179.5, 84, 0.05, 200, 61))));
}

TEST(Placement, OfEveryKernel) {
    for (const char* kernel : {"bilinear", "cubic"}) {
        SCOPED_TRACE(kernel);
        const std::vector<std::string> arguments{"--resampling", kernel};
        expect_in_place(one(kUtm.turned(30), HeightFormat::matrix, arguments));
        expect_in_place(one(of_areas(kDegrees), HeightFormat::striped, arguments));
    }
    for (const SampleGrid& grid : {kUtm.turned(30), of_areas(kUtm).turned(30), of_areas(kDegrees)}) {
        Sources nearest = one(grid, HeightFormat::matrix, {"--resampling", "nearest"});
        nearest.bound_samples = 0.5 + kBoundSamples;
        nearest.between_samples = false;
        expect_in_place(nearest);
    }
}

TEST(Placement, OfLatticesFinerAndCoarserThanTheirFiles) {
    for (const char* spacing : {"11", "47", "75", "210"}) {
        SCOPED_TRACE(spacing);
        const SampleGrid wide = north_up("EPSG:32633", 452345.5, 5298765.25, 30, 201, 187);
        expect_in_place(one(wide, HeightFormat::striped, {"--spacing", spacing}));
        expect_in_place(one(of_areas(wide).turned(30), HeightFormat::matrix, {"--spacing", spacing}));
    }
}

TEST(Placement, OfMosaicsAtTheirJoints) {
    for (const bool reversed : {false, true})
        for (const bool area : {false, true})
            for (const SampleGrid& whole : {kUtm, kDegrees, south_up(kUtm).turned(30)}) {
                if (reversed && whole.crs == kUtm.crs && area) continue;
                SCOPED_TRACE(whole.crs + (area ? ", areas" : ", points") + (reversed ? ", reversed" : ""));
                SampleGrid grid = whole;
                grid.area = area;
                Sources sources = one(grid, HeightFormat::matrix);
                sources.patches[0].parts = quarters(grid, area ? 0 : 1);
                sources.reversed = reversed;
                expect_in_place(sources);
            }
}

TEST(Placement, OfMosaicsAcrossTheAntimeridian) {
    for (const bool reversed : {false, true}) {
        Sources sources = one(north_up("EPSG:4326", 179.5, -16, 0.01, 101, 61));
        sources.patches[0].parts = {{0, 0, 51, 61}, {50, 0, 51, 61}};
        sources.reversed = reversed;
        expect_in_place(sources);
    }
}

TEST(Placement, OfFilesOfOtherFormatsAndCrsBesideOneAnother) {
    // A UTM raster, one of the next zone and one in degrees, each over the one before.
    Sources sources = one(north_up("EPSG:32632", 760000, 5300000, 30, 90, 80));
    const Move to_next("EPSG:32632", "EPSG:32633"), to_degrees("EPSG:32632", "EPSG:4326");
    const auto [nx, ny] = to_next.one(761000, 5299500);
    sources.patches.push_back({north_up("EPSG:32633", nx, ny, 30, 90, 80), {}, HeightFormat::tiled});
    const auto [lon, lat] = to_degrees.one(759500, 5298700);
    sources.patches.push_back({north_up("EPSG:4326", lon, lat, 1.0 / 2700, 80, 50), {}, HeightFormat::striped});
    sources.between_samples = false;  // over steps of nothing, the planes are one
    expect_in_place(sources);
}

TEST(Placement, OfFineInsetsInACoarseBase) {
    const SampleGrid base = north_up("EPSG:32633", 452345.5, 5298765.25, 32, 129, 97);
    for (const bool area : {false, true}) {
        SCOPED_TRACE(area ? "areas" : "points");
        for (const double turn : {0.0, 30.0}) {
            SCOPED_TRACE(turn);
            SampleGrid inset = north_up("EPSG:32633", base.x(40, 0) + 1.5, base.y(0, 40) - 2.25, 4, 129, 129);
            inset.area = area;
            Sources sources = one(base);
            sources.patches[0].grid.area = area;
            sources.patches.push_back({inset.turned(turn), {}, HeightFormat::matrix});
            sources.plane_of = 1;
            expect_in_place(sources);
        }
    }
    // In step with the base, and in four files.
    SampleGrid inset = north_up("EPSG:32633", base.x(40, 0), base.y(0, 40), 4, 129, 129);
    Sources sources = one(base);
    sources.patches.push_back({inset, quarters(inset, 1), HeightFormat::striped});
    sources.plane_of = 1;
    expect_in_place(sources);
}

}  // namespace
}  // namespace scree::test
