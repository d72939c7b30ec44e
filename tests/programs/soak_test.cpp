// scripts/soak.sh in short: a restless flight holds, and what does not hold is told.
#include <gtest/gtest.h>

#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

class Soak : public testing::Test {
protected:
    void SetUp() override {
        write_heights(folder_.file("dem.tif"), hills(513, 513, 3));
        const ProgramRun built = scree({"build", folder_.file("dem.tif"), "-o", store_, "--quiet"});
        ASSERT_EQ(built.exit_code, 0) << describe(built);
    }
    ProgramRun soak(const std::vector<std::string>& more) const {
        std::vector<std::string> words{"--build", SCREE_BUILD_FOLDER, "--frames", "60", "--size", "64x48"};
        words.insert(words.end(), more.begin(), more.end());
        return run_program(SCREE_SOAK_SCRIPT, words, within(250));
    }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree");
};

TEST_F(Soak, ARestlessFlightHoldsUnderSmallBudgets) {
    if (kSanitized) GTEST_SKIP() << "resident memory says nothing";
    const ProgramRun run = soak({"--budgets", "16M,32M", "--out", folder_.file("reports"), store_, "0"});
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    EXPECT_NE(run.out.find("2 runs, 0 failed"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("looked through"), std::string::npos) << run.out;
    for (const char* report : {"16M-1.json", "16M-1.csv", "32M-2.json"})
        EXPECT_TRUE(std::filesystem::exists(folder_.file("reports") + "/" + report)) << report;
}

TEST_F(Soak, AStoreThatIsDamagedFails) {
    std::vector<std::uint8_t> bytes = read_bytes(store_);
    // Within the rows: the head of the file holds what is needed to open it.
    for (std::size_t k = bytes.size() / 2; k < bytes.size(); k += 2000) bytes[k] ^= 0x55;
    write_bytes(store_, bytes);
    const ProgramRun run = soak({"--budgets", "32M", store_, "0"});
    EXPECT_EQ(run.exit_code, 1) << describe(run);
    EXPECT_NE(run.out.find("FAILED seed 1, 32M"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("1 runs, 1 failed"), std::string::npos) << run.out;
}

TEST_F(Soak, RefusesWhatItDoesNotUnderstand) {
    EXPECT_EQ(soak({}).exit_code, 2);
    EXPECT_EQ(soak({"--nonsense", store_}).exit_code, 2);
    EXPECT_EQ(soak({store_, "soon"}).exit_code, 2);
    EXPECT_EQ(soak({"--cut-off", "soon"}).exit_code, 2);
    EXPECT_EQ(soak({"--cut-off", "1", "2"}).exit_code, 2);
}

}  // namespace
}  // namespace scree::test
