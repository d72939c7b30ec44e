// The pages of fly and audit as their readers meet them: written whole, true to the other reports, and shown by a
// browser without a complaint.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/programs/land_store.h"
#include "tests/programs/reports.h"
#include "tests/runtime/report/html_support.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2;

std::string text_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string browser() {
    for (const char* name : {"/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"})
        if (std::filesystem::exists(name)) return name;
    return {};
}

class Reporting : public ::testing::Test {
protected:
    static void SetUpTestSuite() { land_ = std::make_unique<LandStore>("land & sea.scree"); }
    static void TearDownTestSuite() { land_.reset(); }
    static std::string store() { return land_->store(); }
    static ProgramRun fly(const std::string& report, const std::vector<std::string>& more = {}) {
        std::vector<std::string> words{"fly",    store(),   "--headless", "--frames",         "12",
                                       "--size", "200x160", "--report",   land_->file(report)};
        words.insert(words.end(), more.begin(), more.end());
        return scree_view(words);
    }
    static ProgramRun audit(const std::string& report, const std::vector<std::string>& more = {}) {
        std::vector<std::string> words{"audit",  store(),   "--frames", "4",
                                       "--size", "200x160", "--report", land_->file(report)};
        words.insert(words.end(), more.begin(), more.end());
        return scree_view(words);
    }
    static std::string page_of(const std::string& report) { return text_of(land_->file(report + "/index.html")); }

    static std::unique_ptr<LandStore> land_;
};
std::unique_ptr<LandStore> Reporting::land_;

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

TEST_F(Reporting, AFlightIsAPageACsvAndAJsonThatSayTheSame) {
    if (!land_->can_draw()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    const auto report = report_of(fly("flight", {"--json", "-", "--csv", land_->file("own.csv")}));
    expect_only(land_->file("flight"), {"index.html", "flight.csv", "flight.json"});
    EXPECT_EQ(nlohmann::json::parse(text_of(land_->file("flight/flight.json"))), report);
    EXPECT_EQ(text_of(land_->file("flight/flight.csv")), text_of(land_->file("own.csv")));

    std::istringstream csv(text_of(land_->file("own.csv")));
    std::string heads, line;
    std::getline(csv, heads);
    for (const char* column : {"rss_bytes", "resident_heights_bytes", "resident_textures_bytes", "queue",
                               "upload_bytes", "stand_ins", "tau_effective", "bytes_read"})
        EXPECT_NE(("," + heads + ",").find(std::string(",") + column + ","), std::string::npos) << column;
    std::int64_t lines = 0;
    for (; std::getline(csv, line); ++lines) EXPECT_EQ(count(line, ","), count(heads, ","));
    EXPECT_EQ(lines, 12);
    EXPECT_LE(report["most_tile_bytes"], report["peak_resident_bytes"]);
    EXPECT_GT(report["most_tile_bytes"], 0);
    EXPECT_GT(report["upload_bytes"], report["bytes_read"]) << "tiles are stored smaller than they are drawn";

    const std::string page = page_of("flight");
    expect_well_formed(page);
    expect_self_contained(page);
    EXPECT_EQ(count(page, "src=\"data:image/png;base64,"), 8u);
    EXPECT_NE(page.find("A flight over land &amp; sea.scree"), std::string::npos);
    EXPECT_NE(page.find("12 frames, median "), std::string::npos);
    EXPECT_NE(page.find("Frame 11: "), std::string::npos);
    EXPECT_NE(page.find("scree-view fly "), std::string::npos);
    EXPECT_LT(page.size(), 3'000'000u);
}

TEST_F(Reporting, AnAuditIsAPageWithPicturesWhereTheyCanBeDrawn) {
    const auto report = report_of(audit("audit", {"--json", "-"}));
    expect_only(land_->file("audit"), {"index.html", "audit.json"});
    EXPECT_EQ(nlohmann::json::parse(text_of(land_->file("audit/audit.json"))), report);
    const std::string page = page_of("audit");
    expect_well_formed(page);
    expect_self_contained(page);
    EXPECT_NE(page.find("The promise holds."), std::string::npos);
    EXPECT_EQ(count(page, "src=\"data:image/png;base64,"), land_->can_draw() ? 4u : 0u);
    EXPECT_EQ(count(page, "No pictures: "), land_->can_draw() ? 0u : 1u);
    // The audit itself is the same with and without a report.
    EXPECT_EQ(report, report_of(scree_view({"audit", store(), "--frames", "4", "--size", "200x160", "--json", "-"})));
}

TEST_F(Reporting, NothingButAnEarlierReportIsReplaced) {
    std::filesystem::create_directory(land_->file("mine"));
    std::ofstream(land_->file("mine/letter.txt")) << "x";
    for (const auto& run : {fly("mine"), fly("mine", {"--force"}), audit("mine"), audit("mine", {"--force"})}) {
        EXPECT_EQ(run.exit_code, kUsage) << describe(run);
        EXPECT_NE(run.err.find("letter.txt"), std::string::npos) << run.err;
    }
    expect_only(land_->file("mine"), {"letter.txt"});
    ASSERT_EQ(audit("twice").exit_code, 0);
    EXPECT_EQ(audit("twice").exit_code, kUsage) << "without --force";
    EXPECT_EQ(audit("twice", {"--force"}).exit_code, 0);
    expect_only(land_->file("twice"), {"index.html", "audit.json"});
    EXPECT_EQ(scree_view({"audit", store(), "--force"}).exit_code, kUsage) << "--force of nothing";
}

TEST_F(Reporting, BlocksAreReportedWithoutWhatOnlyTilesHave) {
    const std::vector<std::string> blocks{"--lod", "rsg", "--cracks", "dike", "--exaggeration", "2", "--json", "-"};
    const auto audited = report_of(audit("blocks audit", blocks));
    expect_only(land_->file("blocks audit"), {"index.html", "audit.json"});
    EXPECT_EQ(nlohmann::json::parse(text_of(land_->file("blocks audit/audit.json"))), audited);
    EXPECT_EQ(audited["exaggeration"], 2);
    std::string page = page_of("blocks audit");
    expect_well_formed(page);
    expect_self_contained(page);
    EXPECT_NE(page.find("The promise holds."), std::string::npos);
    EXPECT_EQ(count(page, "src=\"data:image/png;base64,"), land_->can_draw() ? 4u : 0u);
    EXPECT_NE(page.find("strips max, px"), std::string::npos);
    EXPECT_EQ(audit("blocks audit", blocks).exit_code, kUsage) << "without --force";
    if (!land_->can_draw()) GTEST_SKIP() << "the rest needs OpenGL 4.5 by surfaceless EGL";

    const auto flown = report_of(fly("blocks", blocks));
    expect_only(land_->file("blocks"), {"index.html", "flight.csv", "flight.json"});
    EXPECT_EQ(nlohmann::json::parse(text_of(land_->file("blocks/flight.json"))), flown);
    EXPECT_EQ(flown["exaggeration"], 2);
    page = page_of("blocks");
    expect_well_formed(page);
    expect_self_contained(page);
    EXPECT_EQ(count(page, "src=\"data:image/png;base64,"), 8u);
    EXPECT_NE(page.find("12 frames, median "), std::string::npos);
    EXPECT_NE(page.find("Blocks kept and made"), std::string::npos);
    for (const char* of_tiles : {"texture", "stand-in", "tiles"})
        EXPECT_EQ(page.find(of_tiles), std::string::npos) << of_tiles;
    std::istringstream csv(text_of(land_->file("blocks/flight.csv")));
    std::string line;
    std::getline(csv, line);
    for (const char* column : {"queue", "stand_ins", "resident_textures_bytes", "uploads"})
        EXPECT_EQ(line.find(column), std::string::npos) << column;
    EXPECT_EQ(fly("blocks", blocks).exit_code, kUsage) << "without --force";
}

TEST_F(Reporting, ABrowserShowsThePagesWithoutAComplaint) {
    if (!land_->can_draw()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    if (browser().empty()) GTEST_SKIP() << "needs chromium";
    ASSERT_EQ(fly("shown_flight").exit_code, 0);
    ASSERT_EQ(audit("shown_audit").exit_code, 0);
    for (const std::string name : {"shown_flight", "shown_audit"}) {
        const std::string address = "file://" + std::filesystem::path(land_->file(name + "/index.html")).string();
        const auto run = run_program(browser(), {"--headless", "--no-sandbox", "--disable-gpu",
                                                 "--enable-logging=stderr", "--user-data-dir=" + land_->file("browser"),
                                                 "--virtual-time-budget=2000", "--dump-dom", address});
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_EQ(run.err.find("CONSOLE"), std::string::npos) << run.err;
        EXPECT_EQ(count(run.out, "<img"), name == "shown_flight" ? 8u : 4u);
        EXPECT_EQ(count(run.out, "<svg"), name == "shown_flight" ? 8u : 3u);
        EXPECT_NE(run.out.find("The same again"), std::string::npos) << "to its end";
    }
}

}  // namespace
}  // namespace scree::test
