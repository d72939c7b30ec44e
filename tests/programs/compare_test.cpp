// scree-view compare as its users meet it: the report, the table, the recommendation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "tests/programs/land_store.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3;

std::string text_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

std::vector<std::string> words_of(const std::string& line) {
    std::istringstream in(line);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

class Comparing : public ::testing::Test {
protected:
    static void SetUpTestSuite() { land_ = std::make_unique<LandStore>("land.scree"); }
    static void TearDownTestSuite() { land_.reset(); }
    void SetUp() override {
        if (!land_->can_draw()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    }
    static std::string store() { return land_->store(); }
    /// A comparison of few pixels, poses and rounds.
    static std::vector<std::string> small(const std::vector<std::string>& more) {
        return joined({"compare", store(), "--size", "200x160", "--frames", "3", "--rounds", "1"}, more);
    }

    static std::unique_ptr<LandStore> land_;
};
std::unique_ptr<LandStore> Comparing::land_;

TEST_F(Comparing, MeasuresEveryMethodAndSaysItThreeTimes) {
    const std::string report_folder = land_->file("report/");
    const std::string csv_file = land_->file("table.csv");
    // So short a step that `audit` looks from the same places.
    const auto run = scree_view(
        small({"--taus", "0.5,2,8", "--step", "1e-9", "--report", report_folder, "--csv", csv_file, "--json", "-"}));
    const auto report = report_of(run);
    expect_keys(report, {"store", "frames", "rounds", "cases", "pareto", "cheapest", "skipped", "reference",
                         "height_quantum", "kept"});
    EXPECT_EQ(report["kept"], true);
    EXPECT_NE(run.err.find(" s left"), std::string::npos) << "progress in plain lines\n" << run.err.substr(0, 300);

    std::map<std::string, std::map<double, nlohmann::json>> by_method;
    for (const auto& c : report["cases"]) {
        if (c["sweep"] == "tolerance") by_method[c["method"]][c["tau_px"]] = c;
        SCOPED_TRACE(c.dump());
        EXPECT_GT(c["triangles_mean"], 0);
        EXPECT_GT(c["samples"], 100);
        EXPECT_GE(c["frame_ms"], c["draw_ms"]);
        EXPECT_GE(c["frame_p99_ms"], c["frame_ms"]);
        EXPECT_GE(c["true_max_px"], c["true_p99_px"]);
        EXPECT_GE(c["true_p99_px"], c["true_mean_px"]);
        EXPECT_GT(c["ssim"], 0.1);
        EXPECT_LE(c["tile_bytes"], c["resident_bytes"]);
        if (c["guaranteed"] == false) continue;
        EXPECT_LE(c["true_max_px"], c["promised_px"].get<double>() + 1e-3);
        EXPECT_EQ(c["holes"], 0);
        EXPECT_EQ(c["open_edges"], 0);
    }
    std::set<std::string> known;
    for (const auto& [method, cases] : by_method) {
        EXPECT_EQ(cases.size(), 3u) << method;
        known.insert(method);
        EXPECT_GE(cases.at(0.5)["triangles_mean"], cases.at(8)["triangles_mean"]) << method;
        EXPECT_GE(cases.at(0.5)["psnr_db"], cases.at(8)["psnr_db"]) << method;
        EXPECT_LE(cases.at(0.5)["true_mean_px"], cases.at(8)["true_mean_px"]) << method;
    }
    EXPECT_TRUE(report["skipped"].empty()) << report["skipped"].dump();
    EXPECT_GE(known.size(), 12u);
    ASSERT_EQ(by_method.count("rsg, dikes"), 1u);
    EXPECT_GT(by_method["rsg, dikes"][8]["triangles_mean"], 0);
    EXPECT_LT(by_method["rsg, dikes"][8]["psnr_db"], 100) << "compared with what is the same";
    double last = 0;
    for (const auto& q : report["height_quantum"]["coarser"]) {
        EXPECT_GT(q["quantum_m"], last);
        EXPECT_GE(q["max_px"], q["p99_px"]);
        last = q["quantum_m"];
    }
    EXPECT_EQ(report["height_quantum"]["coarser"].size(), 6u);
    ASSERT_EQ(by_method.count("geomip"), 1u);

    // The same truth as `audit` has.
    const auto audited =
        report_of(scree_view({"audit", store(), "--size", "200x160", "--frames", "3", "--tau", "2", "--json", "-"}));
    EXPECT_NEAR(by_method["geomip"][2]["true_max_px"], audited["max_error_px"].get<double>(), 1e-6);
    EXPECT_NEAR(by_method["geomip"][2]["true_mean_px"], audited["mean_error_px"].get<double>(), 1e-6);

    // Coarser textures are further from the reference.
    double finest = 0, coarsest = 100;
    for (const auto& c : report["cases"]) {
        if (c["sweep"] != "texture") continue;
        if (c["texture_tau_px"] == 0.5) finest = c["psnr_db"];
        if (c["texture_tau_px"] == 4) coarsest = c["psnr_db"];
    }
    EXPECT_GT(finest, coarsest);

    expect_only(report_folder, {"index.html", "comparison.csv", "comparison.json"});
    EXPECT_EQ(text_of(report_folder + "comparison.csv"), text_of(csv_file));
    EXPECT_EQ(nlohmann::json::parse(text_of(report_folder + "comparison.json")), report);
    const std::string csv = text_of(csv_file);
    EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), report["cases"].size() + 1);
    const std::string page = text_of(report_folder + "index.html");
    for (const std::string& method : known) EXPECT_NE(page.find(method), std::string::npos) << method;
    EXPECT_EQ(page.find("http"), std::string::npos) << "the page needs nothing from elsewhere";
}

TEST_F(Comparing, RecommendsACommandLineThatCanBeTyped) {
    const auto run = scree_view(
        small({"--taus", "4", "--recommend", "--fps", "0.01", "--max-error", "1.5", "--fov", "50", "--quiet"}));
    ASSERT_EQ(run.exit_code, 0) << describe(run);
    ASSERT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1) << "one line and nothing else\n" << describe(run);
    ASSERT_EQ(run.out.rfind("scree-view view ", 0), 0u) << run.out;
    EXPECT_NE(run.out.find(" --fov 50"), std::string::npos) << run.out;
    const auto words = words_of(run.out);
    const auto tau = std::find(words.begin(), words.end(), "--tau");
    ASSERT_NE(tau, words.end()) << run.out;
    EXPECT_LE(std::stod(*(tau + 1)), 1.5) << "tau 4 promises too little";
    // The folder's name has a space: a shell must take the line as it is.
    std::string line = run.out.substr(std::string("scree-view view").size());
    line.pop_back();
    const auto shot = run_program(
        "/bin/sh", {"-c", "'" SCREE_VIEW_PROGRAM "' shot" + line + " -o '" + land_->file("typed.png") + "'"});
    EXPECT_EQ(shot.exit_code, 0) << describe(shot);
}

TEST_F(Comparing, SaysWhatComesClosestWhereNothingFits) {
    for (const auto& wish : {std::vector<std::string>{"--max-error", "8", "--fps", "1000000"},
                             std::vector<std::string>{"--max-error", "0.00001", "--fps", "0.01"}}) {
        const auto run = scree_view(joined(small({"--taus", "8", "--recommend", "--quiet"}), wish));
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_NE(run.err.find("closest: "), std::string::npos) << describe(run);
        EXPECT_EQ(run.out.rfind("scree-view view ", 0), 0u) << describe(run);
    }
}

TEST_F(Comparing, ReplacesNothingButAnEarlierReport) {
    const std::string mine = land_->file("mine");
    std::filesystem::create_directory(mine);
    write_bytes(mine + "/letter.txt", {'x'});
    for (const bool forced : {false, true}) {
        const auto run = scree_view(joined(small({"--report", mine}),
                                           forced ? std::vector<std::string>{"--force"} : std::vector<std::string>{}));
        EXPECT_EQ(run.exit_code, kUsage) << describe(run);
        EXPECT_NE(run.err.find("letter.txt"), std::string::npos) << run.err;
        EXPECT_EQ(run.err.find("100 %"), std::string::npos) << "said before anything is measured";
        expect_only(mine, {"letter.txt"});
    }
    EXPECT_EQ(scree_view(small({"--report", mine + "/letter.txt", "--quiet"})).exit_code, kUsage);

    const std::string old = land_->file("old");
    std::filesystem::create_directory(old);
    write_bytes(old + "/index.html", {'x'});
    const std::vector<std::string> quick = small({"--taus", "8", "--report", old, "--quiet"});
    const auto refused = scree_view(quick);
    EXPECT_EQ(refused.exit_code, kUsage) << describe(refused);
    EXPECT_NE(refused.err.find("--force"), std::string::npos);
    EXPECT_EQ(text_of(old + "/index.html"), "x");
    const auto replaced = scree_view(joined(quick, {"--force"}));
    EXPECT_EQ(replaced.exit_code, 0) << describe(replaced);
    EXPECT_EQ(replaced.err, "") << "--quiet";
    expect_only(old, {"index.html", "comparison.csv", "comparison.json"});
    EXPECT_GT(text_of(old + "/index.html").size(), 1000u);
    for (const auto& file : std::filesystem::directory_iterator(land_->file("")))
        EXPECT_EQ(file.path().string().find(".partial"), std::string::npos) << file.path();
}

TEST_F(Comparing, WrongUseIsToldBeforeAnythingIsMeasured) {
    const std::vector<std::vector<std::string>> wrong = {{"--taus", "0"},
                                                         {"--taus", "1,nan"},
                                                         {"--taus", "-1"},
                                                         {"--frames", "0"},
                                                         {"--rounds", "0"},
                                                         {"--step", "0"},
                                                         {"--fps", "60"},
                                                         {"--recommend", "--fps", "0"},
                                                         {"--recommend", "--max-error", "nan"},
                                                         {"--json", "-", "--csv", "-"},
                                                         {"--budget", "1K"}};
    for (const auto& options : wrong) {
        const auto run = scree_view(joined({"compare", store()}, options));
        EXPECT_EQ(run.exit_code, kUsage) << describe(run);
        EXPECT_EQ(run.out, "");
        EXPECT_EQ(run.err.find(" %"), std::string::npos) << "no progress\n" << run.err;
    }
    EXPECT_EQ(scree_view({"compare"}).exit_code, kUsage);
    EXPECT_EQ(scree_view({"compare", land_->file("missing.scree")}).exit_code, kInput);
}

}  // namespace
}  // namespace scree::test
