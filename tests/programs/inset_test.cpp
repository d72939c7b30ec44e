// Builds whose depth varies by place: fine files in coarse ones, wherever they lie.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "common/mesh/geometric_error.h"
#include "common/query/ground.h"
#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

// Ridges of kilometres with `rough` metres of what only fine samples know.
double land(double x, double y, double rough) {
    const double u = (x - 450000) / 1000, v = (y - 5298000) / 1000;
    return 900 + 300 * std::sin(1.7 * u + 0.4) * std::cos(1.3 * v) + 80 * std::sin(5.1 * u - 2.3 * v) +
           rough * std::sin(90 * u + 31 * v) * std::cos(77 * v);
}

constexpr double kVoid = -9999;

class Insets : public ::testing::Test {
protected:
    std::string write(const std::string& name, const SampleGrid& grid, double rough, double raised = 0) {
        return write_placed_heights(folder_.file(""), name, HeightFormat::striped, grid,
                                    [&](int c, int r) { return land(grid.x(c, r), grid.y(c, r), rough) + raised; });
    }
    std::string base(double raised = 0) { return write("base", base_, 0, raised); }

    nlohmann::json build(std::vector<std::string> files, const std::string& store,
                         const std::vector<std::string>& more = {}) {
        files.insert(files.end(), more.begin(), more.end());
        files.insert(files.end(), {"--texture-size", "64", "--force"});
        return build_store_from(files, store);
    }

    // `steps`: where the finest tile of one side meets a coarser leaf, vertices of its border are left out; a step that
    // runs along there is drawn as well as the bound that the frame states, not as tau asks.
    void expect_sound(const std::string& store, const std::vector<std::string>& against,
                      const std::vector<std::string>& more = {}, bool steps = false) {
        const auto verified = report_of(scree({"verify", store, "--quiet", "--json", "-"}));
        EXPECT_EQ(verified.value("bound_violations", -1), 0);
        EXPECT_EQ(verified.value("shared_samples_differing", -1), 0);
        std::vector<std::string> arguments{"audit", store,    "--tau",   "1",      "--path", path_,      "--frames",
                                           "5",     "--size", "640x480", "--json", "-",      "--against"};
        arguments.insert(arguments.end(), against.begin(), against.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        ProgramOptions options;
        options.environment = {"PATH=" + std::filesystem::path(SCREE_PROGRAM).parent_path().string()};
        const auto audit = report_of(scree_view(arguments, options));
        EXPECT_EQ(audit.value("open_edges", -1), 0);
        EXPECT_EQ(audit.value("t_junctions", -1), 0);
        EXPECT_EQ(audit.value("kept", false), true);
        EXPECT_LE(audit.value("max_error_px", 1e9), (steps ? audit.value("max_bound_px", 0.0) : 1) + 1e-3);
        ASSERT_TRUE(audit.contains("against"));
        EXPECT_EQ(audit["against"].value("samples_not_drawn", -1), 0);
        EXPECT_LE(audit["against"].value("max_error_less_stated_px", 1e9), 1 + 1e-3);
        const auto flight = report_of(scree_view({"fly", store, "--headless", "--path", path_, "--frames", "5",
                                                  "--size", "160x120", "--budget", "8M", "--json", "-"}));
        EXPECT_EQ(flight.value("holes", -1), 0);
    }

    // Near the corner of an inset, along its border and over it, low and high.
    void look_at(double x, double y, double z) {
        std::ofstream out(path_);
        out.precision(12);
        out << "eye_x,eye_y,eye_z,look_x,look_y,look_z\n";
        for (const auto& [dx, dy, dz] : {std::array{-150.0, 30.0, 60.0},
                                         {20.0, -200.0, 40.0},
                                         {60.0, 60.0, 300.0},
                                         {-900.0, 700.0, 500.0},
                                         {400.0, -300.0, 15.0}})
            out << x + dx << ',' << y + dy << ',' << z + dz << ',' << x << ',' << y << ',' << z << '\n';
    }

    // Of the tiles alone: the dataset names its sources in the order given.
    std::string tiles_of(const std::string& store) {
        std::string all;
        const auto opened = SqliteStore::open(store);
        for (const TileKind kind : {TileKind::height, TileKind::texture}) {
            const auto ok = (*opened)->for_each(kind, [&](const SqliteStore::RowView& row) {
                all += std::to_string(row.key) + ' ';
                all.append(row.payload.begin(), row.payload.end());
                return true;
            });
            EXPECT_TRUE(ok);
        }
        return all;
    }

    double height_in(const std::string& store, double x, double y) {
        auto opened = SqliteStore::open(store);
        auto ground = Ground::open(**opened);
        const auto height = (*ground)->height(x, y);
        return height && *height ? (*height)->height_m : std::nan("");
    }

    TemporaryFolder folder_;
    const std::string path_ = folder_.file("path.csv"), store_ = folder_.file("s.scree");
    const SampleGrid base_ = north_up("EPSG:32633", 450000, 5298000, 30, 129, 129);
    const SampleGrid inset_ = north_up("EPSG:32633", 451207.3, 5296519.8, 1, 321, 257);
};

TEST_F(Insets, OfThirtyTimesTheResolutionAreSoundAtTheirBorders) {
    const std::vector<std::string> files{base(), write("inset", inset_, 3)};
    const auto built = build(files, store_);
    EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("spacing_m", 0.0), 30.0 / 32);
    look_at(inset_.first_x, inset_.first_y, land(inset_.first_x, inset_.first_y, 0));
    expect_sound(store_, files);
    for (const auto& [c, r] : {std::pair{3, 3}, {160, 128}, {317, 253}}) {
        const double x = inset_.x(c, r), y = inset_.y(c, r);
        EXPECT_NEAR(height_in(store_, x, y), land(x, y, 3), 0.1);
    }
    EXPECT_NEAR(height_in(store_, base_.x(9, 9), base_.y(9, 9)), land(base_.x(9, 9), base_.y(9, 9), 0), 1.0 / 64);
}

TEST_F(Insets, OnTheLatticeAreKeptToTheLastSample) {
    // Its border runs within tiles: along the edge of a coarser leaf that leaf's own would count.
    const SampleGrid inset = north_up("EPSG:32633", base_.x(41, 0), base_.y(0, 51), 3.75, 113, 113);
    const std::vector<std::string> files{base(), write("inset", inset, 3)};
    const auto built = build(files, store_);
    EXPECT_LT(built.value("warp_error_m", 1e9), 1.0 / 64) << "but for rounding nothing is lost";
    for (int r = 4; r < 112; r += 4)
        for (int c = 4; c < 112; c += 4)
            ASSERT_NEAR(height_in(store_, inset.x(c, r), inset.y(c, r)), land(inset.x(c, r), inset.y(c, r), 3), 0.01)
                << c << ", " << r;
}

TEST_F(Insets, TakeNoMoreTilesThanTheirFilesApart) {
    const SampleGrid inset = north_up("EPSG:32633", 451000, 5297000, 1, 2049, 2049);
    const std::string below = base(), above = write("inset", inset, 3);
    const auto both = build({below, above}, store_);
    const auto alone = build({below}, folder_.file("below.scree")),
               fine = build({above}, folder_.file("above.scree"), {"--spacing", "0.9375"});
    // A tenth more at most, and a few: the inset's border falls within tiles, and grading adds tiles along it.
    EXPECT_LE(both["height_tiles"].get<double>(),
              20 + 1.1 * (alone["height_tiles"].get<double>() + fine["height_tiles"].get<double>()));
    EXPECT_GT(both["height_tiles"].get<double>(), fine["height_tiles"].get<double>());
}

TEST_F(Insets, DoNotDependOnThreadsMemoryOrOrder) {
    const std::vector<std::string> files{base(), write("inset", inset_, 3)};
    build(files, store_, {"--threads", "1", "--memory", "192M"});
    const std::string digest = digest_of(store_);
    build(files, store_, {"--threads", "2", "--memory", "512M"});
    EXPECT_EQ(digest_of(store_), digest);

    // Beside one another: two that share a border's samples, and a finer one a step beyond.
    std::vector<std::string> apart{write("west", base_.part(0, 0, 65, 129), 0),
                                   write("east", base_.part(64, 0, 65, 129), 0)};
    SampleGrid beyond = north_up("EPSG:32633", base_.x(128, 0) + 3.75, base_.y(0, 20), 3.75, 200, 150);
    apart.push_back(write("beyond", beyond, 1));
    std::sort(apart.begin(), apart.end());
    std::string first;
    do {
        build(apart, store_);
        if (first.empty()) first = tiles_of(store_);
        EXPECT_TRUE(tiles_of(store_) == first) << apart[0] << ", " << apart[1];
    } while (std::next_permutation(apart.begin(), apart.end()));
}

TEST_F(Insets, ReachBeyondTheirBase) {
    SampleGrid inset = inset_;
    inset.first_x = base_.x(128, 0) - 150;
    const std::vector<std::string> files{base(), write("inset", inset, 3)};
    build(files, store_);
    look_at(base_.x(128, 0), inset.y(0, 100), land(base_.x(128, 0), inset.y(0, 100), 0));
    // Of a base cell that the inset covers in part there is nothing: up to a base sample's distance of its border.
    const auto verified = report_of(scree({"verify", store_, "--quiet", "--json", "-"}));
    EXPECT_EQ(verified.value("bound_violations", -1), 0);
    const double y = inset.y(0, 128);
    for (const double beyond : {-100.0, 0.5, 60.0, 135.0})
        EXPECT_NEAR(height_in(store_, base_.x(128, 0) + beyond, y), land(base_.x(128, 0) + beyond, y, 3), 0.2)
            << beyond;
    EXPECT_TRUE(std::isnan(height_in(store_, inset.x(320, 0) + 31, y)));
}

TEST_F(Insets, FillVoidsOfTheirBase) {
    const std::string below =
        write_placed_heights(folder_.file(""), "base", HeightFormat::striped, base_, [&](int c, int r) {
            const bool hidden = c > 38 && c < 55 && r > 45 && r < 62;
            return hidden ? kVoid : land(base_.x(c, r), base_.y(c, r), 0);
        });
    const std::vector<std::string> files{below, write("inset", inset_, 3)};
    build(files, store_, {"--nodata", "-9999", "--fill", "none"});
    look_at(inset_.first_x, inset_.first_y, land(inset_.first_x, inset_.first_y, 0));
    // Where the inset ends over the void its rim meets support that no file has a say in: a step.
    expect_sound(store_, files, {"--nodata", "-9999"}, true);
    EXPECT_NEAR(height_in(store_, inset_.x(160, 128), inset_.y(160, 128)),
                land(inset_.x(160, 128), inset_.y(160, 128), 3), 0.1);
    EXPECT_TRUE(std::isnan(height_in(store_, base_.x(47, 0), base_.y(0, 60)))) << "void, and no inset";
}

// The greatest step, in metres, from a vertex of present cells to one beside it that has none, in leaves that lack
// cells.
double greatest_step_at_rims(const std::string& store) {
    const auto opened = SqliteStore::open(store);
    const Dataset& d = (*opened)->dataset();
    const auto m = static_cast<std::size_t>(d.lattice.tile_cells());
    std::int32_t greatest = 0;
    const auto ok = (*opened)->for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
        const auto tile = decode_height_tile(row.payload, d.lattice.tile_cells_log2, row.codec);
        if (!tile || tile->header.child_mask != 0 || tile->presence.empty()) return true;
        const auto vertices = present_vertices(tile->presence, d.lattice.tile_cells_log2);
        const auto look = [&](std::size_t a, std::size_t b) {
            if (vertices[a] != vertices[b])
                greatest = std::max(greatest, std::abs(tile->samples[a] - tile->samples[b]));
        };
        for (std::size_t r = 0; r <= m; ++r)
            for (std::size_t c = 0; c <= m; ++c) {
                if (c < m) look(r * (m + 1) + c, r * (m + 1) + c + 1);
                if (r < m) look(r * (m + 1) + c, (r + 1) * (m + 1) + c);
            }
        return true;
    });
    EXPECT_TRUE(ok);
    return greatest * d.height_quantum_m;
}

TEST_F(Insets, EndOverVoidsWithoutASpike) {
    // Far above the base, whose rows would put its own heights beside them. The void reaches the border: it stays.
    const auto with_void = [&](const std::string& name, int last_column) {
        return write_placed_heights(
            folder_.file(""), name, HeightFormat::striped, base_, [&, last_column](int c, int r) {
                return c <= last_column && r > 36 && r < 75 ? kVoid : land(base_.x(c, r), base_.y(c, r), 0);
            });
    };
    const std::string inset = write("inset", inset_, 3, 800);
    look_at(inset_.first_x, inset_.first_y, land(inset_.first_x, inset_.first_y, 0) + 800);
    for (const int last_column : {60, 45}) {  // all of its rim lies over the void; half of it
        const std::vector<std::string> files{with_void("base" + std::to_string(last_column), last_column), inset};
        build(files, store_, {"--nodata", "-9999"});
        // With half of it over the base, base and inset end 800 m apart beside one another, and what is between is
        // steep.
        if (last_column == 60) {
            EXPECT_LT(greatest_step_at_rims(store_), 6);
        }
        expect_sound(store_, files, {"--nodata", "-9999"}, true);
        EXPECT_TRUE(std::isnan(height_in(store_, inset_.first_x - 40, inset_.y(0, 100))));
    }
}

TEST_F(Insets, OfSeveralResolutionsLieOverOneAnother) {
    const SampleGrid middle = north_up("EPSG:32633", 450905.2, 5296811, 7.5, 120, 100);
    const std::vector<std::string> files{base(), write("middle", middle, 1, 5), write("inset", inset_, 3, 10)};
    build(files, store_);
    look_at(inset_.first_x, inset_.first_y, land(inset_.first_x, inset_.first_y, 0) + 10);
    expect_sound(store_, files, {}, true);
    const auto raised = [&](double x, double y, double rough) { return height_in(store_, x, y) - land(x, y, rough); };
    EXPECT_NEAR(raised(inset_.x(100, 100), inset_.y(100, 100), 3), 10, 0.1);
    EXPECT_NEAR(raised(middle.x(10, 10), middle.y(10, 10), 1), 5, 0.1);
    EXPECT_NEAR(raised(base_.x(3, 3), base_.y(3, 3), 0), 0, 0.1);
}

TEST_F(Insets, AreHiddenByWhatIsListedAfterThem) {
    const std::vector<std::string> files{write("inset", inset_, 3, 10), base()};
    build(files, store_);
    look_at(inset_.first_x, inset_.first_y, land(inset_.first_x, inset_.first_y, 0));
    expect_sound(store_, files);
    const double x = base_.x(44, 0), y = base_.y(0, 52);
    EXPECT_NEAR(height_in(store_, x, y), land(x, y, 0), 0.1);
}

}  // namespace
}  // namespace scree::test
