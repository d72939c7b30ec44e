// --lod rsg --cracks dike, as its users meet it: pictures without holes, promises kept, refusals that say why.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <sstream>

#include "tests/common/test_support.h"
#include "tests/programs/ply_surface.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

struct Picture {
    std::size_t terrain = 0, magenta = 0, colours = 0;
};

Picture look_at_picture(const std::string& path) {
    Picture picture;
    const auto in = OIIO::ImageInput::open(path);
    EXPECT_TRUE(in) << path;
    if (!in) return picture;
    const auto pixels = static_cast<std::size_t>(in->spec().width) * static_cast<std::size_t>(in->spec().height);
    std::vector<std::uint8_t> rgb(3 * pixels);
    EXPECT_EQ(in->spec().nchannels, 3);
    EXPECT_TRUE(in->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, rgb.data()));
    std::set<std::uint32_t> colours;
    for (std::size_t k = 0; k < 3 * pixels; k += 3) {
        const std::uint32_t colour = std::uint32_t{rgb[k]} << 16 | std::uint32_t{rgb[k + 1]} << 8 | rgb[k + 2];
        colours.insert(colour);
        ++(colour == 0xff00ff ? picture.magenta : picture.terrain);
    }
    picture.colours = colours.size();
    return picture;
}

// 7 x 5 blocks of 33 samples, four columns and three rows over.
constexpr int kWidth = 235, kHeight = 168;

class Dikes : public ::testing::Test {
protected:
    void SetUp() override {
        write_heights_u16(folder_.file("d.tif"), grid_, &place_);
        build_store_from({folder_.file("d.tif"), "--tile-size", "33", "--texture-size", "32"}, store_);
    }
    ProgramRun run(std::vector<std::string> words, const std::vector<std::string>& more = {}) const {
        words.insert(words.begin() + 1, store_);
        words.insert(words.end(), {"--lod", "rsg", "--cracks", "dike", "--size", "300x200"});
        words.insert(words.end(), more.begin(), more.end());
        return scree_view(words);
    }
    // Straight down on the middle: nothing but blocks.
    std::vector<std::string> from_above() const {
        const std::string x = std::to_string(place_.x + 0.5 * kWidth * place_.step),
                          y = std::to_string(place_.y - 0.5 * kHeight * place_.step);
        return {"--eye", x + "," + y + ",2200", "--look", x + "," + y + ",0"};
    }

    TemporaryFolder folder_;
    Place place_{352000, 2778000, 10, 3826};
    HeightGrid grid_ = hills(kWidth, kHeight, 33, 250);
    std::string store_ = folder_.file("d.scree");
};

TEST_F(Dikes, ThePictureHasNoHoleBetweenBlocks) {
    for (const auto& settings :
         std::vector<std::vector<std::string>>{{"--tau", "0.5"}, {"--tau", "16"}, {"--tau", "4", "--metric", "uc"}}) {
        auto words = from_above();
        words.insert(words.end(), settings.begin(), settings.end());
        const auto report = report_of(run({"shot", "-o", folder_.file("a.png"), "--magenta", "--json", "-"}, words));
        const Picture picture = look_at_picture(folder_.file("a.png"));
        EXPECT_EQ(picture.magenta, 0u) << settings.back();
        EXPECT_GT(picture.colours, 500u);
        EXPECT_EQ(report["triangles"], report["block_triangles"].get<int>() + report["dike_triangles"].get<int>());
        EXPECT_GT(report["strips"], 20);
        EXPECT_EQ(report["dropped_columns"], 4);
        EXPECT_EQ(report["dropped_rows"], 3);
        EXPECT_EQ(report["guaranteed"], settings.size() == 2);
        EXPECT_EQ(report.contains("max_bound_px"), settings.size() == 2);
    }
}

TEST_F(Dikes, SkyAndWireframeAreThoseOfEveryPicture) {
    report_of(run({"shot", "-o", folder_.file("m.png"), "--magenta", "--json", "-"}));
    report_of(run({"shot", "-o", folder_.file("s.png"), "--json", "-"}));
    report_of(run({"shot", "-o", folder_.file("w.png"), "--magenta", "--wireframe", "--tau", "16", "--json", "-"}));
    const Picture magenta = look_at_picture(folder_.file("m.png")), sky = look_at_picture(folder_.file("s.png")),
                  wires = look_at_picture(folder_.file("w.png"));
    EXPECT_GT(magenta.magenta, 1000u) << "an overview sees beyond the terrain";
    EXPECT_GT(magenta.terrain, 5000u);
    EXPECT_EQ(sky.magenta, 0u);
    EXPECT_GT(wires.magenta, magenta.magenta);
    EXPECT_GT(wires.terrain, 500u);
}

TEST_F(Dikes, TheMeshIsWholeAndOfTheSourcesSamples) {
    const auto report = report_of(run({"shot", "-o", folder_.file("a.png"), "--mesh", folder_.file("a.ply"), "--tau",
                                       "3", "--curvature", "off", "--json", "-"}));
    PlyMesh mesh = read_ply(folder_.file("a.ply"));
    EXPECT_EQ(report["triangles"], mesh.triangles.size());
    for (const auto& [x, y, z] : mesh.vertices) {
        const auto i = static_cast<int>(std::lround((x - place_.x) / place_.step)),
                   j = static_cast<int>(std::lround((place_.y - y) / place_.step));
        ASSERT_TRUE(i >= 0 && j >= 0 && i < kWidth - 4 && j < kHeight - 3) << i << ", " << j;
        ASSERT_NEAR(z, static_cast<double>(grid_.at(i, j)), 1e-6) << i << ", " << j;
    }
    const auto seams = PlySurface(std::move(mesh)).seams();
    EXPECT_EQ(seams.cracks, 0);
    EXPECT_EQ(seams.t_junctions, 0);
    EXPECT_EQ(seams.upside_down, 0);
}

TEST_F(Dikes, AuditsKeepWhatIsPromised) {
    for (const char* tau : {"1", "6"})
        for (const std::vector<std::string>& cache :
             {std::vector<std::string>{}, {"--cache", "exact", "--s", "0.25"}}) {
            auto words = cache;
            words.insert(words.end(), {"--tau", tau});
            const auto report = report_of(run({"audit", "--frames", "40", "--json", "-"}, words));
            EXPECT_EQ(report["kept"], true) << report.dump(2);
            EXPECT_EQ(report["guaranteed"], true);
            EXPECT_DOUBLE_EQ(report["max_bound_px"], std::stod(tau) + (cache.empty() ? 0 : 0.25));
            EXPECT_LE(report["max_error_px"], report["max_bound_px"].get<double>() + 1e-3);
            EXPECT_GT(report["dikes"]["max_error_px"], 0) << "nothing is thinned";
            EXPECT_EQ(report["open_edges"], 0);
            EXPECT_EQ(report["t_junctions"], 0);
            EXPECT_EQ(report["holes"], 0);
            EXPECT_EQ(report["dikes"]["strips_above"], 0);
            EXPECT_GT(report["samples"], 10000);
        }
}

TEST_F(Dikes, WhatPromisesNothingIsMeasuredAndNotJudged) {
    const auto uc = report_of(run({"audit", "--metric", "uc", "--tau", "0.5", "--json", "-"}));
    EXPECT_EQ(uc["guaranteed"], false);
    EXPECT_FALSE(uc.contains("kept"));
    EXPECT_FALSE(uc.contains("max_bound_px"));
    EXPECT_GT(uc["max_error_px"], 0.5) << "the paper's metric knows nothing of strips";
    EXPECT_EQ(uc["open_edges"], 0);
    const auto corners = report_of(run({"audit", "--cull", "corners", "--json", "-"}));
    EXPECT_EQ(corners["guaranteed"], false);
    EXPECT_GT(corners["holes"], 0) << "four corners miss blocks under a low eye";
}

TEST_F(Dikes, AFlightReusesBlocksOnlyWithACache) {
    const auto anew = report_of(run({"fly", "--headless", "--frames", "60", "--json", "-"}));
    const auto kept =
        report_of(run({"fly", "--headless", "--frames", "60", "--csv", folder_.file("f.csv"), "--json", "-"},
                      {"--cache", "exact", "--s", "0.5"}));
    expect_keys(kept, {"frames", "frame_ms", "select_ms", "triangles", "blocks", "strips", "peak_resident_bytes",
                       "peak_rss_bytes", "tau_effective_px", "renderer"});
    EXPECT_EQ(anew["reused_share"], 0);
    EXPECT_GT(kept["reused_share"], 0.1);
    EXPECT_EQ(anew["max_bound_px"], 1);
    EXPECT_EQ(kept["max_bound_px"], 1.5);
    EXPECT_EQ(kept["holes"], 0);
    EXPECT_GT(kept["triangles"]["mean"], 100);
    EXPECT_LT(kept["triangles"]["max"], kept["complete_triangles"].get<double>());
    const auto csv = read_bytes(folder_.file("f.csv"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 61);
}

// upload_bytes, by frame, of a flight's CSV.
std::vector<double> uploads_of(const std::string& csv) {
    std::vector<double> uploads;
    std::istringstream lines(csv);
    std::string line, cell;
    std::size_t column = 0;
    while (std::getline(lines, line)) {
        std::istringstream cells(line);
        std::vector<std::string> words;
        while (std::getline(cells, cell, ',')) words.push_back(cell);
        if (column == 0)
            column = static_cast<std::size_t>(std::find(words.begin(), words.end(), "upload_bytes") - words.begin());
        else
            uploads.push_back(std::stod(words.at(column)));
    }
    return uploads;
}

TEST_F(Dikes, MeshesStayOnTheGpuWhileNothingChanges) {
    const double x = place_.x + 0.5 * kWidth * place_.step, y = place_.y - 0.5 * kHeight * place_.step;
    std::string path = "eye_x,eye_y,eye_z,look_x,look_y,look_z\n";
    for (const double ahead : {0.0, 0.0, 0.0, 300.0, 0.0}) {
        for (const double v : {x - 900 + ahead, y, 700.0, x + ahead, y, 0.0}) path += std::to_string(v) + ",";
        path.back() = '\n';
    }
    write_bytes(folder_.file("p.csv"), {path.begin(), path.end()});
    const auto report = report_of(run({"fly", "--headless", "--path", folder_.file("p.csv"), "--frames", "5", "--csv",
                                       folder_.file("f.csv"), "--json", "-"},
                                      {"--cache", "exact", "--s", "0.5"}));
    const auto csv = read_bytes(folder_.file("f.csv"));
    const std::vector<double> sent = uploads_of({csv.begin(), csv.end()});
    ASSERT_EQ(sent.size(), 5u);
    const double whole = 12 * report["triangles"]["mean"].get<double>();
    EXPECT_GT(sent[0], 0.5 * whole);
    EXPECT_EQ(sent[1], 0);
    EXPECT_EQ(sent[2], 0);
    EXPECT_GT(sent[3], 0) << "blocks are chosen anew for another eye";
    EXPECT_EQ(report["upload_bytes"], std::accumulate(sent.begin(), sent.end(), 0.0));
}

TEST_F(Dikes, OverACurvedEarthTheyKeepWhatIsPromised) {
    // From 30 km off and low, where 70 m are lost behind the earth and half of them over the terrain.
    const double x = place_.x + 0.5 * kWidth * place_.step, y = place_.y - 0.5 * kHeight * place_.step;
    std::string path = "eye_x,eye_y,eye_z,look_x,look_y,look_z\n";
    for (const double behind : {30000.0, 29900.0, 9000.0}) {
        for (const double v : {x - behind, y, 400.0, x, y, 0.0}) path += std::to_string(v) + ",";
        path.back() = '\n';
    }
    write_bytes(folder_.file("p.csv"), {path.begin(), path.end()});
    for (const auto& [curvature, tau] : {std::pair("on", "0.01"), std::pair("on", "1"), std::pair("off", "0.01")}) {
        const auto report =
            report_of(run({"audit", "--frames", "3", "--path", folder_.file("p.csv"), "--json", "-"},
                          {"--curvature", curvature, "--tau", tau, "--fov", "5", "--cache", "exact", "--s", "0.01"}));
        EXPECT_EQ(report["kept"], true) << report.dump(2);
        EXPECT_EQ(report["holes"], 0);
        EXPECT_GT(report["samples"], 1000);
    }
    const auto z_of = [&](const char* curvature) {
        report_of(run({"shot", "-o", folder_.file("a.png"), "--mesh", folder_.file("a.ply"), "--json", "-", "--eye",
                       std::to_string(x - 30000) + "," + std::to_string(y) + ",400", "--look",
                       std::to_string(x) + "," + std::to_string(y) + ",0"},
                      {"--curvature", curvature}));
        double lowest = 1e9;
        for (const auto& vertex : read_ply(folder_.file("a.ply")).vertices) lowest = std::min(lowest, vertex[2]);
        return lowest;
    };
    EXPECT_NEAR(z_of("off") - z_of("on"), 30000.0 * 30000 / (2 * 6371008.8), 10);
}

TEST_F(Dikes, AFlightIsComparedWithItsPosesChosenAnew) {
    const auto report =
        report_of(run({"fly", "--headless", "--frames", "20", "--step", "5", "--settled", "--json", "-"},
                      {"--cache", "exact", "--s", "0.5"}));
    EXPECT_DOUBLE_EQ(report["settled"]["error_integral_px"], 1);
    EXPECT_DOUBLE_EQ(report["settled"]["error_integral_ratio"], 1.5);
    EXPECT_GE(report["settled"]["triangles"]["mean"], report["triangles"]["mean"]);
    EXPECT_LE(report["settled"]["least_triangle_share"], 1);
    const auto still = report_of(run({"audit", "--frames", "4", "--json", "-"})),
               moving = report_of(run({"audit", "--frames", "4", "--moving", "--json", "-"}));
    EXPECT_EQ(still, moving) << "all of it is in memory";
}

TEST_F(Dikes, WhatTheyCannotShowIsRefused) {
    const auto expect_refused = [](const ProgramRun& run, const std::vector<std::string>& words) {
        EXPECT_EQ(run.exit_code, 2) << describe(run);
        for (const std::string& word : words)
            EXPECT_NE(run.err.find(word), std::string::npos) << "'" << word << "' is missing\n" << describe(run);
    };
    const std::string png = folder_.file("a.png");
    for (const std::vector<std::string>& command :
         std::vector<std::vector<std::string>>{{"shot", "-o", png}, {"fly", "--headless"}, {"audit"}}) {
        expect_refused(run(command, {"--budget", "1M"}), {"235 x 168", "--budget", "1 MiB"});
    }
    expect_refused(run({"shot", "-o", png, "--colour", "level"}), {"--colour", "--cracks dike"});
    expect_refused(run({"fly", "--headless", "--see-through"}), {"--see-through", "--cracks dike"});
    for (int j = 40; j < 70; ++j)
        for (int i = 40; i < 70; ++i) grid_.at(i, j) = 0;
    write_heights_u16(folder_.file("void.tif"), grid_, &place_, "0");
    build_store_from({folder_.file("void.tif"), "--fill", "none"}, folder_.file("void.scree"));
    store_ = folder_.file("void.scree");
    expect_refused(run({"audit"}), {"absent", "--cracks dike"});
}

}  // namespace
}  // namespace scree::test
