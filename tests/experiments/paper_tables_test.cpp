// The paper's tables over a small made-up landscape: what scree_paper_tables says, and that it says the same as ever.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"

namespace scree {
namespace {

using test::describe;

class PaperTables : public testing::Test {
protected:
    // One run serves all tests of a process.
    static void SetUpTestSuite() {
        folder = new test::TemporaryFolder;
        const std::string store = folder->file("small.scree");
        const auto made = test::scree({"synth", "-o", folder->file("land"), "--size", "330", "--spacing", "40",
                                       "--imagery-scale", "0", "--quiet"});
        ASSERT_EQ(made.exit_code, 0) << describe(made);
        const auto built = test::scree({"build", folder->file("land") + "/dem.tif", "-o", store, "--quiet"});
        ASSERT_EQ(built.exit_code, 0) << describe(built);
        const auto run = test::run_program(
            SCREE_PAPER_TABLES, {"--store", store, "--out", folder->file("out"), "--name", "small", "--quick"});
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        const auto bytes = test::read_bytes(file("paper_small.json"));
        report = nlohmann::json::parse(bytes.begin(), bytes.end(), nullptr, false);
        ASSERT_FALSE(report.is_discarded());
    }
    static void TearDownTestSuite() {
        delete folder;
        folder = nullptr;
    }
    static std::string file(const std::string& name) { return folder->file("out") + "/" + name; }
    static double value(const nlohmann::json& run, const char* key) { return run.at(key).get<double>(); }

    // Runs of a table by metric and cache; fails where there is none.
    static std::vector<nlohmann::json> runs(const std::string& table, const std::string& metric,
                                            const std::string& reuse) {
        std::vector<nlohmann::json> found;
        for (const auto& run : report.at("runs"))
            if (run.at("table") == table && run.at("metric") == metric && run.at("reuse") == reuse)
                found.push_back(run);
        EXPECT_FALSE(found.empty()) << table << ", " << metric << ", " << reuse;
        return found;
    }

    static test::TemporaryFolder* folder;
    static nlohmann::json report;
};
test::TemporaryFolder* PaperTables::folder = nullptr;
nlohmann::json PaperTables::report;

TEST_F(PaperTables, DrawAsManyTrianglesAsEver) {
    EXPECT_EQ(report.at("complete_triangles"), 2 * 329 * 329);
    EXPECT_EQ(report.at("dropped_columns"), 0);
    const std::vector<std::tuple<const char*, const char*, const char*, const char*, double>> expected{
        {"caching", "UC", "off", "blind", 1895},  {"caching", "UC", "P1", "blind", 1796},
        {"caching", "N*K", "off", "aware", 2831}, {"caching", "N*K", "exact", "aware", 2746},
        {"truth", "N*", "off", "blind", 2085},    {"truth", "N*K", "off", "blind", 2780},
        {"truth", "BSK", "off", "aware", 3601},
    };
    for (const auto& [table, metric, reuse, dikes, triangles] : expected) {
        const auto found = runs(table, metric, reuse);
        const auto run = std::find_if(found.begin(), found.end(), [&, d = dikes](const auto& r) {
            return r.at("dikes") == d && (r.at("reuse") == "off" || r.at("s_px") == 0.1);
        });
        ASSERT_NE(run, found.end());
        // The landscape's sines may differ in the last digit from machine to machine.
        EXPECT_NEAR(value(*run, "triangles"), triangles, 0.02 * triangles) << table << ", " << metric << ", " << reuse;
    }
}

TEST_F(PaperTables, TheExactCacheNeverExceedsTauPlusSAndP1Does) {
    double worst_p1 = 0;
    for (const char* table : {"caching", "views", "speed"}) {
        for (const auto& run : runs(table, "UC", "exact"))
            EXPECT_LE(value(run, "worst_local_over_tau") * value(run, "tau_px"),
                      (value(run, "tau_px") + value(run, "s_px")) * 1.0001);
        for (const auto& run : runs(table, "UC", "P1"))
            worst_p1 = std::max(worst_p1, value(run, "worst_local_over_tau"));
    }
    EXPECT_GT(worst_p1, 1.2) << "s is a tenth of tau";
}

TEST_F(PaperTables, WhatIsPromisedIsKeptAndWhatIsNotIsBroken) {
    int promises = 0;
    for (const auto& run : report.at("runs")) {
        EXPECT_TRUE(run.at("keeps_promise")) << run.dump();
        if (!run.at("promise_px").is_number()) continue;
        ++promises;
        EXPECT_LE(std::max(value(run, "max_px"), value(run, "dike_max_px")), value(run, "promise_px"));
    }
    EXPECT_GT(promises, 5);
    EXPECT_GT(value(runs("truth", "UC", "off")[0], "max_px"), 1);
    for (const auto& run : runs("truth", "N*K", "off"))
        EXPECT_EQ(value(run, "dike_max_px") > 1, run.at("dikes") == "blind");
}

TEST_F(PaperTables, ACacheWithoutAnAllowanceDrawsWhatNoneDraws) {
    for (const char* metric : {"UC", "N*K"}) {
        const auto off = runs("caching", metric, "off")[0];
        int compared = 0;
        for (const auto& run : runs("caching", metric, "exact"))
            if (value(run, "s_px") == 0) {
                ++compared;
                for (const char* key : {"triangles", "dike_triangles", "max_px", "mean_px", "dike_max_px"})
                    EXPECT_EQ(run.at(key), off.at(key)) << metric << ", " << key;
                EXPECT_EQ(value(run, "reused_share"), 0);
            } else {
                EXPECT_GT(value(run, "reused_share"), 0.5);
                EXPECT_LT(value(run, "triangles"), value(off, "triangles"));
            }
        EXPECT_EQ(compared, 1);
    }
}

TEST_F(PaperTables, LeaveTablesChartsAndAPage) {
    for (const char* name : {"caching.csv", "truth.csv", "views.csv", "speed.csv", "rigour.csv", "missing.svg",
                             "time.svg", "truth.svg", "dikes.svg", "speed.svg"}) {
        const std::string path = file(std::string("paper_small_") + name);
        EXPECT_GT(test::read_bytes(path).size(), 200u) << path;
    }
    const auto page = test::read_bytes(file("paper_small.md"));
    const std::string text(page.begin(), page.end());
    EXPECT_NE(text.find("330 x 330 samples at 40 m"), std::string::npos);
    EXPECT_EQ(text.find("BROKEN"), std::string::npos);
    EXPECT_EQ(text.find("nan"), std::string::npos);
}

TEST_F(PaperTables, RefuseAStoreThatDoesNotFitTheBudget) {
    const auto run = test::run_program(
        SCREE_PAPER_TABLES, {"--store", folder->file("small.scree"), "--out", folder->file("none"), "--budget", "1M"});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("--budget"), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder->file("none")));
}

}  // namespace
}  // namespace scree
