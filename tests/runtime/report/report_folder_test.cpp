// A report appears whole, and nothing but an earlier one goes.
#include "runtime/report/report_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "tests/common/test_support.h"

namespace scree::test {
namespace {

const std::vector<std::string> kFiles{"index.html", "table.csv"};

std::set<std::string> names_in(const std::string& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

std::string text_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ReportFolders, AppearWithAllTheirFilesAndLeaveNothingBeside) {
    const TemporaryFolder folder;
    auto report = ReportFolder::prepare(folder.file("new/"), kFiles, false);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(names_in(folder.file("")), std::set<std::string>{}) << "asking makes nothing";
    ASSERT_TRUE(report->write({{"index.html", "page"}, {"table.csv", "1,2"}}));
    EXPECT_EQ(names_in(folder.file("")), std::set<std::string>{"new"});
    EXPECT_EQ(text_of(folder.file("new/index.html")), "page");
    EXPECT_EQ(text_of(folder.file("new/table.csv")), "1,2");
}

TEST(ReportFolders, AreReplacedByForceAlone) {
    const TemporaryFolder folder;
    ASSERT_TRUE(
        ReportFolder::prepare(folder.file("r"), kFiles, false)->write({{"index.html", "old"}, {"table.csv", ""}}));
    const auto refused = ReportFolder::prepare(folder.file("r"), kFiles, false);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    auto forced = ReportFolder::prepare(folder.file("r"), kFiles, true);
    ASSERT_TRUE(forced) << forced.error().message;
    ASSERT_TRUE(forced->write({{"index.html", "new"}}));
    EXPECT_EQ(names_in(folder.file("r")), std::set<std::string>{"index.html"}) << "nothing of the old one stays";
    EXPECT_EQ(text_of(folder.file("r/index.html")), "new");
    EXPECT_EQ(names_in(folder.file("")), std::set<std::string>{"r"});
}

TEST(ReportFolders, OfSomebodyElseAreLeftAlone) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder.file("mine"));
    std::ofstream(folder.file("mine/letter.txt")) << "x";
    for (const bool force : {false, true}) {
        const auto report = ReportFolder::prepare(folder.file("mine"), kFiles, force);
        ASSERT_FALSE(report);
        EXPECT_EQ(report.error().code, ErrorCode::usage);
        EXPECT_NE(report.error().message.find("letter.txt"), std::string::npos) << report.error().message;
    }
    EXPECT_FALSE(ReportFolder::prepare(folder.file("mine/letter.txt"), kFiles, true)) << "no folder";
}

TEST(ReportFolders, ThatCannotBeWrittenLeaveNothing) {
    const TemporaryFolder folder;
    auto report = ReportFolder::prepare(folder.file("none/there"), kFiles, false);
    ASSERT_TRUE(report);
    const auto written = report->write({{"index.html", "page"}});
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_EQ(names_in(folder.file("")), std::set<std::string>{});
}

}  // namespace
}  // namespace scree::test
