// Proof of placement: planes and colour ramps of known slope, written through every path, come back from the store
// where they were, within a hundredth of a source sample. A plane that grows along a raster's columns and one along
// its rows tell the place of every stored sample from its height.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "common/query/ground.h"
#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"
#include "tools/source/crs.h"

namespace scree::test {
namespace {

constexpr double kSharedLimit = 1e-6;  // samples: of points so near a raster's limit either is right
constexpr double kBoundSamples = 0.01;
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

// Points of one CRS in another.
class Move {
public:
    Move(const std::string& from, const std::string& to) : transform_(make(from, to)) {}
    void operator()(std::vector<double>& x, std::vector<double>& y) const { transform_.apply(x, y); }
    std::pair<double, double> one(double x, double y) const {
        std::vector<double> xs{x}, ys{y};
        transform_.apply(xs, ys);
        return {xs[0], ys[0]};
    }

private:
    static CrsTransform make(const std::string& from, const std::string& to) {
        const auto a = Crs::parse(from), b = Crs::parse(to);
        auto made = CrsTransform::make(*a, *b);
        EXPECT_TRUE(made) << from << " to " << to;
        return std::move(*made);
    }
    CrsTransform transform_;
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

class StoreUnderTest {
public:
    explicit StoreUnderTest(const std::string& path) : store_(open(path)), dataset_(store_->dataset()) {}

    const Dataset& dataset() const { return dataset_; }
    const Lattice& lattice() const { return dataset_.lattice; }
    const SqliteStore& store() const { return *store_; }
    std::int64_t pitch() const { return lattice().cells_x + 1; }
    std::size_t index(std::int64_t i, std::int64_t j) const { return static_cast<std::size_t>(j * pitch() + i); }

    std::vector<std::pair<TileId, HeightTile>> height_tiles() const {
        std::vector<std::pair<TileId, HeightTile>> tiles;
        const auto ok = store_->for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
            const auto id = tile_from_key(lattice(), row.key);
            auto tile = decode_height_tile(row.payload, lattice().tile_cells_log2, row.codec);
            EXPECT_TRUE(id && tile);
            if (id && tile) tiles.emplace_back(*id, std::move(*tile));
            return true;
        });
        EXPECT_TRUE(ok);
        return tiles;
    }

    /// Where the lattice's points are in a CRS.
    void points_in(const std::string& crs, std::vector<double>& x, std::vector<double>& y) const {
        const auto count = static_cast<std::size_t>(pitch() * (lattice().cells_y + 1));
        x.resize(count);
        y.resize(count);
        for (std::int64_t j = 0; j <= lattice().cells_y; ++j)
            for (std::int64_t i = 0; i <= lattice().cells_x; ++i) {
                x[index(i, j)] = lattice().x_m(static_cast<double>(i));
                y[index(i, j)] = lattice().y_m(static_cast<double>(j));
            }
        Move(dataset_.crs, crs)(x, y);
    }

private:
    static std::unique_ptr<SqliteStore> open(const std::string& path) {
        auto opened = SqliteStore::open(path);
        if (!opened) throw std::runtime_error(opened.error().message);
        return std::move(*opened);
    }
    std::unique_ptr<SqliteStore> store_;
    Dataset dataset_;
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

// Metres of the store between samples, the lesser of both ways.
double ground_step(const SampleGrid& g, const std::string& crs) {
    const Move move(g.crs, crs);
    const auto at = [&](int c, int r) { return move.one(g.x(c, r), g.y(c, r)); };
    const auto [x, y] = at(g.width / 2, g.height / 2);
    const auto [ex, ey] = at(g.width / 2 + 1, g.height / 2);
    const auto [sx, sy] = at(g.width / 2, g.height / 2 + 1);
    return std::min(std::hypot(ex - x, ey - y), std::hypot(sx - x, sy - y));
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
SampleGrid of_areas(SampleGrid grid) {
    grid.area = true;
    return grid;
}
SampleGrid south_up(const SampleGrid& g) {
    SampleGrid s = g;
    s.first_y = g.y(0, g.height - 1);
    s.row_y = -g.row_y;
    return s;
}

const SampleGrid kUtm = north_up("EPSG:32633", 452345.5, 5298765.25, 30, 75, 67);
const SampleGrid kDegrees = north_up("EPSG:4326", 13.7, 47.4, 1.0 / 1200, 61, 67);
SampleGrid mercator() { return north_up("EPSG:3857", 1500000, 8399737, 40, 61, 67); }  // at 60 degrees north

// Files of one patch: 2 x 2, whose inner borders share a sample or adjoin.
std::vector<std::array<int, 4>> quarters(const SampleGrid& g, int shared) {
    const int c = g.width / 2, r = g.height / 2;
    return {{0, 0, c + shared, r + shared},
            {c, 0, g.width - c, r + shared},
            {0, r, c + shared, g.height - r},
            {c, r, g.width - c, g.height - r}};
}

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
    SampleGrid oblong = kUtm;
    oblong.row_y = -41;
    for (const HeightFormat format : {HeightFormat::ascii_corner, HeightFormat::ascii_center,
                                      HeightFormat::float_corner, HeightFormat::float_center, HeightFormat::bil}) {
        SCOPED_TRACE(static_cast<int>(format));
        expect_in_place(one(of_areas(kUtm), format, utm));
        if (format == HeightFormat::ascii_corner || format == HeightFormat::ascii_center)
            expect_in_place(one(of_areas(oblong), format, utm));
    }
    expect_in_place(one(of_areas(kDegrees), HeightFormat::ascii_corner, degrees));
    expect_in_place(one(of_areas(kUtm), HeightFormat::png, utm));
    expect_in_place(one(of_areas(kUtm), HeightFormat::world_file_tiff, utm));
    expect_in_place(one(of_areas(kUtm).turned(30), HeightFormat::world_file_tiff, utm));
    expect_in_place(one(north_up("EPSG:4326", 14, 48, 1.0 / 120, 121, 121), HeightFormat::dted));
}

TEST(Placement, OfHgt) {
    Sources sources = one(north_up("EPSG:4326", -71, -30, 1.0 / 600, 601, 1201, 1.0 / 1200), HeightFormat::hgt);
    sources.steps = 27;
    expect_in_place(sources);
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

// Imagery. Levels rise and fall along a wave that is oblique to the raster; blue is red's complement, so
// that whatever rounding or compression prefer, they prefer it in both directions.
constexpr double kOblique = 0.31;

struct Wave {
    SampleGrid grid;
    double along_columns = 1, along_rows = kOblique;
    double rise = 3;  ///< levels a pixel

    // 0..255 and back.
    double phase(double x, double y) const {
        const auto [c, r] = grid.sample_of(x, y);
        return rise * (along_columns * c + along_rows * r) + 17000;
    }
    static double level(double phase) {
        const double at = std::fmod(phase, 510);
        return at <= 255 ? at : 510 - at;
    }
    double slope(double phase) const { return std::fmod(phase, 510) <= 255 ? rise : -rise; }
    /// Pixels to the next crest or trough.
    double to_turn(double phase) const {
        const double at = std::fmod(phase, 255);
        return std::min(at, 255 - at) / rise;
    }
};

struct Texel {
    double red = 0, blue = 0;
    bool opaque = false;
};

// BC1: two colours of 5, 6 and 5 bits and two between them, or one and none.
Texel bc1_texel(const std::uint8_t* block, int x, int y) {
    const int a = block[0] | block[1] << 8, b = block[2] | block[3] << 8, pick = block[4 + y] >> (2 * x) & 3;
    const auto five = [](int v) { return static_cast<double>((v & 31) << 3 | (v & 31) >> 2); };
    if (a <= b && pick == 3) return {};
    const double share = pick == 0 ? 0 : pick == 1 ? 1 : a > b ? (pick == 2 ? 1.0 / 3 : 2.0 / 3) : 0.5;
    const auto between = [&](int shift) { return five(a >> shift) * (1 - share) + five(b >> shift) * share; };
    return {between(11), between(0), true};
}

struct ImageCheck {
    double worst = 0;             ///< levels
    double sum = 0, squares = 0;  ///< of residual times slope, and of the slope
    double red = 0, blue = 0;     ///< sums of residuals
    std::int64_t texels = 0, bare = 0;
};

// Over the texels of the deepest level whose neighbourhood is within the image and away from the wave's turns.
ImageCheck compare_texels(const StoreUnderTest& store, const Wave& wave) {
    const Dataset& d = store.dataset();
    const int level = d.texture_deepest_level, size = d.texture_size();
    const double texel_m = d.texel_m(level);
    const Move move(d.crs, wave.grid.crs);
    ImageCheck check;
    const auto look = [&](const SqliteStore::RowView& row) {
        const auto id = tile_from_key(store.lattice(), row.key);
        if (!id || id->level != level) return true;
        const auto tile = decode_texture_tile(row.payload, d.texture_size_log2, row.codec);
        EXPECT_TRUE(tile);
        const std::uint8_t* blocks = tile->blocks.data() + bc1_mip_offset(d.texture_size_log2, 0);
        std::vector<double> x, y;
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < size; ++c) {
                x.push_back(d.lattice.origin_x_m + (static_cast<double>(id->x * size + c) + 0.5) * texel_m);
                y.push_back(d.lattice.origin_y_m - (static_cast<double>(id->y * size + r) + 0.5) * texel_m);
            }
        const std::vector<double> store_x = x, store_y = y;
        move(x, y);
        const double east = d.lattice.x_m(static_cast<double>(d.lattice.cells_x)),
                     south = d.lattice.y_m(static_cast<double>(d.lattice.cells_y));
        const double texel_px = texel_m / ground_step(wave.grid, d.crs), clear = 1.5 + texel_px;
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < size; ++c) {
                const auto k = static_cast<std::size_t>(r * size + c);
                if (store_x[k] > east || store_y[k] < south) continue;
                const auto [u, v] = wave.grid.sample_of(x[k], y[k]);
                if (!(std::min({u, v, wave.grid.width - 1 - u, wave.grid.height - 1 - v}) > clear)) continue;
                const double phase = wave.phase(x[k], y[k]);
                if (wave.to_turn(phase) < 2 * clear) continue;
                const Texel t = bc1_texel(blocks + 8 * (r / 4 * (size / 4) + c / 4), c % 4, r % 4);
                ++check.texels;
                check.bare += !t.opaque;
                const double off = (t.red + 255 - t.blue) / 2 - Wave::level(phase);
                check.worst = std::max(check.worst, std::abs(off));
                check.sum += off * wave.slope(phase);
                check.squares += wave.rise * wave.rise;
                check.red += t.red - Wave::level(phase);
                check.blue += t.blue - 255 + Wave::level(phase);
            }
        return true;
    };
    EXPECT_TRUE(store.store().for_each(TileKind::texture, look));
    return check;
}

struct ImageSetup {
    SampleGrid image;
    SampleGrid heights = north_up("EPSG:32633", 452345, 5298765, 30, 97, 97);
    bool matrix = false, png = false;
    std::vector<std::array<int, 4>> parts = {};
    std::vector<std::string> arguments = {};
    double rise = 3;
    int half_pixels = 0;  ///< of the nearest kernel
};

void expect_wave_in_place(const ImageSetup& in, const Wave& wave) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.file("in"));
    std::vector<std::string> arguments{write_placed_heights(folder.file("in"), "heights", HeightFormat::striped,
                                                            in.heights, [](int, int) { return 7; })};
    arguments.push_back("--imagery");
    auto parts = in.parts;
    if (parts.empty()) parts.push_back({0, 0, in.image.width, in.image.height});
    for (const auto& [c, r, columns, rows] : parts) {
        const SampleGrid part = in.image.part(c, r, columns, rows);
        const auto level = [&](int i, int j) { return Wave::level(wave.phase(part.x(i, j), part.y(i, j))); };
        const std::string name = "image" + std::to_string(arguments.size());
        arguments.push_back(in.png ? write_placed_png(folder.file("in"), name, part, level)
                                   : write_placed_image(folder.file("in"), name, part, in.matrix, level));
    }
    arguments.insert(arguments.end(), in.arguments.begin(), in.arguments.end());
    build_store_from(arguments, folder.file("s.scree"));
    const StoreUnderTest store(folder.file("s.scree"));
    const ImageCheck check = compare_texels(store, wave);
    const double moved_px = check.sum / check.squares;
    EXPECT_GT(check.texels, 20000);
    EXPECT_EQ(check.bare, 0);
    EXPECT_LT(std::abs(moved_px), kBoundSamples);
    // Half a level in the mean; a texel within a step of BC1's five bits besides what both roundings to bytes may take.
    const auto texels = static_cast<double>(check.texels);
    EXPECT_LT(std::abs(check.red) / texels, 0.5);
    EXPECT_LT(std::abs(check.blue) / texels, 0.5);
    EXPECT_LT(check.worst, 1 + 255.0 / 31 + in.half_pixels * wave.rise * (1 + kOblique) / 2) << "levels";
    if (std::getenv("SCREE_PLACEMENT_TELL") != nullptr)
        std::printf("    %lld texels, moved by %.5f pixels, worst %.3f levels, red %.3f blue %.3f\n",
                    static_cast<long long>(check.texels), moved_px, check.worst, check.red / texels,
                    check.blue / texels);
}

void expect_image_in_place(const ImageSetup& in) {
    {
        SCOPED_TRACE("along columns");
        expect_wave_in_place(in, {in.image, 1, kOblique, in.rise});
    }
    {
        SCOPED_TRACE("along rows");
        expect_wave_in_place(in, {in.image, kOblique, 1, in.rise});
    }
}

const SampleGrid kImage = of_areas(north_up("EPSG:32633", 452300, 5298810, 9.3, 330, 330));

TEST(PlacementOfImagery, OfAreasAndPoints) {
    expect_image_in_place(ImageSetup{kImage});
    SampleGrid points = kImage;
    points.area = false;
    expect_image_in_place(ImageSetup{points});
    ImageSetup png{kImage};
    png.png = true;
    png.arguments = {"--assume-crs", "EPSG:32633"};
    expect_image_in_place(png);
}

TEST(PlacementOfImagery, OfTurnedAndSouthUpImages) {
    for (SampleGrid image : {kImage.turned(30), south_up(kImage)}) {
        image.first_x += 400;
        ImageSetup in{image};
        in.matrix = true;
        expect_image_in_place(in);
    }
}

TEST(PlacementOfImagery, OfOtherCrs) {
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:4326", 14.366, 47.843, 1.0 / 9000, 340, 240))});
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:3857", 1599300, 6080800, 13.7, 330, 330))});
    expect_image_in_place(ImageSetup{of_areas(north_up("EPSG:32632", 900100, 5313500, 9, 400, 400))});
}

TEST(PlacementOfImagery, OfEveryKernelAndAnyScale) {
    for (const char* kernel : {"bilinear", "cubic", "nearest"})
        for (const double pixel : {4.1, 7.4, 29.0}) {
            if (std::string(kernel) == "cubic" && pixel < 20) continue;  // means, as bilinear gives
            SCOPED_TRACE(std::string(kernel) + ", " + std::to_string(pixel));
            ImageSetup in{of_areas(north_up("EPSG:32633", 452300, 5298810, pixel, 300, 300)).turned(-3)};
            in.matrix = true;
            in.arguments = {"--resampling", kernel};
            in.half_pixels = std::string(kernel) == "nearest";
            if (pixel > 20) in.rise = 7;
            expect_image_in_place(in);
        }
}

TEST(PlacementOfImagery, OfMosaicsAtTheirJoints) {
    ImageSetup in{kImage};
    in.parts = quarters(kImage, 0);
    expect_image_in_place(in);
    std::reverse(in.parts.begin(), in.parts.end());
    in.image = kImage.turned(-10);
    in.matrix = true;
    expect_image_in_place(in);
}

}  // namespace
}  // namespace scree::test
