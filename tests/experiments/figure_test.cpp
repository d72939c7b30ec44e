#include "experiments/claims/figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/common/test_support.h"

namespace scree {
namespace {

Figure small_figure() {
    Figure figure;
    figure.id = "C3";
    figure.title = "It grows";
    figure.tables.push_back(
        {"", {"s / tau", "who, and \"what\""}, {{0.1, std::string("a, b")}, {1e-7, std::string("c")}}});
    figure.tables.push_back({"flown", {"px"}, {{std::nan("")}}});
    figure.checks = {at_least("growth", 2, 1)};
    figure.svg = "<svg></svg>\n";
    return figure;
}

TEST(Figure, IsConfirmedByAllItsChecksAndNotByNone) {
    Figure figure = small_figure();
    EXPECT_TRUE(figure.confirmed());
    figure.checks.push_back(at_most("growth", 2, 2));
    EXPECT_TRUE(figure.confirmed());
    figure.checks.push_back(at_most("growth", 2, 1.9));
    EXPECT_FALSE(figure.confirmed());
    figure.checks = {at_least("no number", std::nan(""), 0)};
    EXPECT_FALSE(figure.confirmed());
    figure.checks.clear();
    EXPECT_FALSE(figure.confirmed());
}

TEST(Figure, CsvQuotesWhatNeedsItAndKeepsEveryDigit) {
    EXPECT_EQ(to_csv(small_figure().tables[0]), "s / tau,\"who, and \"\"what\"\"\"\r\n0.1,\"a, b\"\r\n1e-07,c\r\n");
}

TEST(Figure, JsonHoldsTheVerdictAndEveryRow) {
    const auto json = nlohmann::json::parse(to_json({small_figure()}));
    const auto& claim = json.at("claims").at(0);
    EXPECT_EQ(claim.at("confirmed"), true);
    EXPECT_EQ(claim.at("tables").at(0).at("rows").at(0).at("s / tau"), 0.1);
    EXPECT_TRUE(claim.at("tables").at(1).at("rows").at(0).at("px").is_null());
    EXPECT_EQ(claim.at("checks").at(0).at("is"), "at least");
}

TEST(Figure, FilesAreNamedByTheClaim) {
    const test::TemporaryFolder folder;
    const std::string out = folder.file("new/figures");
    ASSERT_TRUE(write_figures({small_figure()}, out).ok());
    for (const char* name : {"c03.csv", "c03_flown.csv", "c03.svg", "claims.json"})
        EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / name)) << name;
    test::write_bytes(folder.file("file"), {1});
    const auto failed = write_figures({small_figure()}, folder.file("file"));
    ASSERT_FALSE(failed.ok());
    EXPECT_EQ(failed.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scree
