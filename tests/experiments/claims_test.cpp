// Every claim by a twentieth of its samples, on made-up ground: the verdicts, and the numbers that theory gives
// exactly.
#include "experiments/claims/claims.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"

namespace scree {
namespace {

/// One ground for all, made at its first use.
const Terrain& ground() {
    static const Terrain terrain = ridged_terrain(397, 1);
    return terrain;
}
ClaimBench bench() { return {ground(), 1, true}; }

const FigureTable& table(const Figure& figure, const std::string& name = "") {
    for (const FigureTable& t : figure.tables)
        if (t.name == name) return t;
    ADD_FAILURE() << figure.id << " has no table " << name;
    return figure.tables.front();
}

double number(const FigureTable& t, std::size_t row, const std::string& column) {
    for (std::size_t k = 0; k < t.columns.size(); ++k)
        if (t.columns[k] == column) return std::get<double>(t.rows.at(row).at(k));
    ADD_FAILURE() << "no column " << column;
    return 0;
}

double measured(const Figure& figure, const std::string& what) {
    for (const FigureCheck& check : figure.checks)
        if (check.what == what) return check.measured;
    ADD_FAILURE() << figure.id << " does not check " << what;
    return 0;
}

class Claims : public testing::TestWithParam<std::size_t> {};

TEST_P(Claims, AreConfirmedByTheNumbersAndWhollyWritten) {
    const NamedClaim& claim = all_claims()[GetParam()];
    const Figure figure = claim.make(bench());
    EXPECT_EQ(figure.id, claim.id);
    for (const FigureCheck& check : figure.checks)
        EXPECT_TRUE(check.holds()) << check.what << ": " << check.measured << ", limit " << check.limit;
    EXPECT_TRUE(figure.confirmed());
    for (const std::string* text : {&figure.title, &figure.source, &figure.statement, &figure.setting})
        EXPECT_FALSE(text->empty());
    ASSERT_FALSE(figure.tables.empty());
    for (const FigureTable& t : figure.tables) {
        ASSERT_FALSE(t.rows.empty());
        for (const auto& row : t.rows) EXPECT_EQ(row.size(), t.columns.size());
    }
    EXPECT_NE(figure.svg.find("</svg>"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(All, Claims, testing::Range<std::size_t>(0, all_claims().size()),
                         [](const auto& tested) { return std::string(all_claims()[tested.param].id); });

TEST(ClaimFigures, AreTheSameForTheSameSeedAndOthersForAnother) {
    const std::string once = to_json({claim_c05_corner_test(bench())});
    EXPECT_EQ(once, to_json({claim_c05_corner_test(bench())}));
    ClaimBench other = bench();
    other.seed = 2;
    EXPECT_NE(once, to_json({claim_c05_corner_test(other)}));
}

TEST(ClaimFigures, OffAxisErrorsComeNearKAndNeverPassIt) {
    const FigureTable t = table(claim_c02_off_axis(bench()));
    for (std::size_t row = 0; row < t.rows.size(); ++row) {
        EXPECT_GT(number(t, row, "greatest / K"), 0.97);
        EXPECT_LE(number(t, row, "greatest / K"), 1 + 1e-9);
    }
    EXPECT_NEAR(number(t, 0, "K"), 1.26495, 1e-5);
    EXPECT_NEAR(number(t, 2, "K"), 3, 1e-12);
    EXPECT_NEAR(number(t, 3, "K"), 5.16049, 1e-5);
}

TEST(ClaimFigures, ReuseFollowsTheFormulaToAMillionth) {
    const FigureTable t = table(claim_c03_reuse_bound(bench()));
    const double shares[] = {0.05, 0.1, 0.2, 0.5, 0.9}, expected[] = {1.0526316, 1.1111111, 1.25, 2, 10};
    for (std::size_t row = 0; row < 5; ++row) {
        EXPECT_EQ(number(t, row, "s / tau"), shares[row]);
        EXPECT_NEAR(number(t, row, "straight at it (tau)"), expected[row], 1e-6 * expected[row]);
        EXPECT_NEAR(number(t, row, "allowance at the new eye (tau)"), 1 + shares[row], 1e-6);
    }
}

TEST(ClaimFigures, TheTwistedStripErrsByAHundredAndSixtyMetres) {
    EXPECT_EQ(number(table(claim_c10_dikes(bench()), "twisted"), 0, "error (m)"), 160);
}

TEST(ClaimFigures, TheBoxTestLosesNothingAtAnyTileSize) {
    const FigureTable t = table(claim_c18_corner_culling(bench()));
    ASSERT_EQ(t.rows.size(), 3u);
    for (std::size_t row = 0; row < 3; ++row) {
        EXPECT_EQ(number(t, row, "lost by box against planes (%)"), 0);
        EXPECT_GT(number(t, row, "lost by four ground corners (%)"), 0);
    }
}

// A verdict must be able to fail: on level ground there is nothing to refute.
TEST(ClaimFigures, OnLevelGroundTheVerdictsAboutReliefFail) {
    Terrain level = ground();
    std::fill(level.heights_n.begin(), level.heights_n.end(), 1000);
    const ClaimBench flat{level, 1, true};
    for (const auto claim : {claim_c07_local_corrections, claim_c10_dikes, claim_c12_level_to_level,
                             claim_c14_connectivity, claim_c17_restitching})
        EXPECT_FALSE(claim(flat).confirmed()) << claim(flat).id;
}

TEST(ClaimGround, IsTheSameOnEveryMachine) {
    const Terrain t = ridged_terrain(133, 7);
    EXPECT_NEAR(t.lowest_m(), 2, 0.02);
    EXPECT_NEAR(t.highest_m(), 1102, 0.02);
    // Relief at every wavelength: neighbours differ, by metres.
    double steps = 0;
    for (int i = 0; i + 1 < t.columns; ++i) steps += std::abs(t.z_m(i, 60) - t.z_m(i + 1, 60));
    EXPECT_GT(steps / (t.columns - 1), 3);
    EXPECT_NE(t.heights_n, ridged_terrain(133, 8).heights_n);
}

// The paper's own region: what Scree lod, sections 1 to 4, has of it.
TEST(ClaimFigures, OfTheTaipeiWindowAreThoseOfTheMathematics) {
    const char* data = std::getenv("SCREE_DATA");
    const std::string dem = data == nullptr ? "" : std::string(data) + "/taipei/window_660_30m.tif";
    if (!std::filesystem::exists(dem))
        GTEST_SKIP() << "needs taipei/window_660_30m.tif in the folder that $SCREE_DATA names";
    const test::TemporaryFolder folder;
    const test::ProgramRun built = test::scree({"build", dem, "-o", folder.file("s.scree")});
    ASSERT_EQ(built.exit_code, 0) << test::describe(built);
    const auto terrain = terrain_of_store(folder.file("s.scree"), kLeastTerrainSide);
    ASSERT_TRUE(terrain.ok()) << terrain.error().message;
    ASSERT_EQ(terrain->columns, 660);
    const ClaimBench taipei{*terrain, 1, true};
    const FigureTable steps = table(claim_c12_level_to_level(taipei));
    EXPECT_NEAR(number(steps, 3, "greatest error over step"), 9.05, 0.05);
    const FigureTable bands = table(claim_c14_connectivity(taipei));
    EXPECT_NEAR(number(bands, 4, "greatest (m)"), 15.5, 0.1);
    const FigureTable jumps = table(claim_c17_restitching(taipei));
    const double expected[] = {3.8, 6.6, 10.9, 15.1, 18.5};
    for (std::size_t level = 0; level < 5; ++level)
        EXPECT_NEAR(number(jumps, level, "mean jump, band zipped anew (m)"), expected[level], 0.05 * expected[level]);
    EXPECT_GT(measured(claim_c07_local_corrections(taipei), "own correction: greatest error over tau, at any tau"),
              1.5);
}

TEST(ClaimsProgram, WritesWhatItIsAskedFor) {
    const test::TemporaryFolder folder;
    const std::string out = folder.file("figures");
    const auto run = test::run_program(SCREE_CLAIMS_PROGRAM, {"--quick", "--claim", "C3", "--out", out});
    EXPECT_EQ(run.exit_code, 0) << test::describe(run);
    EXPECT_NE(run.out.find("C3   confirmed"), std::string::npos) << run.out;
    for (const char* name : {"/c03.csv", "/c03.svg", "/claims.json"}) EXPECT_TRUE(std::filesystem::exists(out + name));
    EXPECT_FALSE(std::filesystem::exists(out + "/c02.csv"));
}

TEST(ClaimsProgram, SaysWhatItCannotUse) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(test::run_program(SCREE_CLAIMS_PROGRAM, {"--claim", "C1"}).exit_code, 2);
    EXPECT_EQ(test::run_program(SCREE_CLAIMS_PROGRAM, {"--nonsense"}).exit_code, 2);
    EXPECT_EQ(test::run_program(SCREE_CLAIMS_PROGRAM, {"--store", folder.file("none.scree")}).exit_code, 3);
    test::write_bytes(folder.file("file"), {1});
    const auto run =
        test::run_program(SCREE_CLAIMS_PROGRAM, {"--claim", "C3", "--quick", "--out", folder.file("file")});
    EXPECT_EQ(run.exit_code, 5) << test::describe(run);
}

}  // namespace
}  // namespace scree
