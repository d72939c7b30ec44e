#include "tools/verify/verify_command.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/common/test_support.h"
#include "tests/tools/verify/small_store.h"

namespace scree {
namespace {

struct Output {
    int code = -1;
    std::string out, err;
};

Output run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "verify");
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Output output;
    output.code = run_verify(static_cast<int>(argv.size()), argv.data());
    output.out = testing::internal::GetCapturedStdout();
    output.err = testing::internal::GetCapturedStderr();
    return output;
}

class VerifyCommand : public testing::Test {
protected:
    void SetUp() override {
        test::SmallStore store = test::make_small_store({});
        store.write(sound_);
        store.heights.begin()->second.header.own.max_n += 1;
        store.write(damaged_);
    }
    test::TemporaryFolder folder_;
    std::string sound_ = folder_.file("sound.scree"), damaged_ = folder_.file("damaged.scree");
};

TEST_F(VerifyCommand, ASoundStoreGivesZeroAndASummary) {
    const Output output = run({sound_, "--quiet"});
    EXPECT_EQ(output.code, 0);
    EXPECT_NE(output.out.find("sound"), std::string::npos);
    EXPECT_EQ(output.err, "");
}

TEST_F(VerifyCommand, ProgressGoesToStandardErrorInPlainLines) {
    const Output output = run({sound_});
    EXPECT_NE(output.err.find("100 %\n"), std::string::npos);
    EXPECT_EQ(output.err.find('\r'), std::string::npos);
}

TEST_F(VerifyCommand, ABrokenPromiseGivesOneAndNamesTheTile) {
    const Output output = run({damaged_, "--quiet"});
    EXPECT_EQ(output.code, 1);
    EXPECT_NE(output.out.find("height tile 0/0/0"), std::string::npos) << output.out;
}

TEST_F(VerifyCommand, JsonOnStandardOutputStandsAlone) {
    const Output output = run({damaged_, "--quiet", "--json", "-"});
    EXPECT_EQ(output.code, 1);
    const auto json = nlohmann::ordered_json::parse(output.out);
    std::vector<std::string> keys;
    for (const auto& item : json.items()) keys.push_back(item.key());
    EXPECT_EQ(keys, (std::vector<std::string>{"tiles_checked", "shared_samples_compared", "shared_samples_differing",
                                              "bounds_checked", "bound_violations", "lon_lat_note", "problems"}));
    EXPECT_NE(json["lon_lat_note"], "");
    EXPECT_EQ(json["problems"].size(), 1u);
    EXPECT_NE(output.err.find("problem: "), std::string::npos);
}

TEST_F(VerifyCommand, JsonGoesToAFile) {
    const std::string file = folder_.file("report.json");
    EXPECT_EQ(run({sound_, "--quiet", "--json", file}).code, 0);
    std::ifstream in(file);
    EXPECT_TRUE(nlohmann::json::parse(in)["problems"].empty());
    EXPECT_EQ(run({sound_, "--quiet", "--json", folder_.file("no/such/folder.json")}).code, 5);
}

TEST_F(VerifyCommand, ExitCodesFollowTheContract) {
    EXPECT_EQ(run({"--help"}).code, 0);
    EXPECT_EQ(run({}).code, 2);
    EXPECT_EQ(run({sound_, "--unknown"}).code, 2);
    EXPECT_EQ(run({folder_.file("missing.scree")}).code, 3);
    test::write_bytes(folder_.file("text.scree"), std::vector<std::uint8_t>(5000, 'x'));
    EXPECT_EQ(run({folder_.file("text.scree")}).code, 4);
}

}  // namespace
}  // namespace scree
