// What holds for every format of grid_formats(), by the examples that placement is proved with.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"
#include "tools/source/raster_formats.h"

namespace scree::test {
namespace {

constexpr int kInput = 3;

class EveryFormat : public ::testing::Test {
protected:
    std::string write(const PlacedExample& example) {
        const auto value = [&](int column, int row) { return (column + row) % 100 * 7 + 1; };
        std::filesystem::create_directories(folder_.file("in"));
        return write_placed_heights(folder_.file("in"), "a", example.format, example.grid, value);
    }
    ProgramRun build(const std::string& source, const PlacedExample& example) const {
        std::vector<std::string> words{"build", source, "-o", store_, "--quiet", "--force", "--texture-size", "32"};
        words.insert(words.end(), example.arguments.begin(), example.arguments.end());
        return scree(words);
    }
    void clear() const { std::filesystem::remove_all(folder_.file("in")); }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree");
};

TEST_F(EveryFormat, HasAnExampleWhosePlaceIsProved) {
    std::set<std::string_view> proved;
    for (const PlacedExample& example : placed_grid_examples()) {
        const std::string path = write(example);
        const GridFormat* format = grid_format_of(path);
        ASSERT_NE(format, nullptr) << path;
        proved.insert(format->name);
        clear();
    }
    for (const GridFormat& format : grid_formats())
        EXPECT_TRUE(proved.contains(format.name)) << format.name << " is not among placed_grid_examples()";
}

TEST_F(EveryFormat, IsFoundInAFolder) {
    for (const PlacedExample& example : placed_grid_examples()) {
        SCOPED_TRACE(write(example));
        const ProgramRun run = build(folder_.file("in"), example);
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        clear();
    }
}

TEST_F(EveryFormat, CutOffIsRefusedNamingTheFile) {
    for (const PlacedExample& example : placed_grid_examples()) {
        const std::string path = write(example);
        const auto bytes = static_cast<double>(std::filesystem::file_size(path));
        for (const double share : {0.0, 0.001, 0.01, 0.3, 0.9}) {
            SCOPED_TRACE(path + " cut to " + std::to_string(share));
            std::filesystem::resize_file(path, static_cast<std::uintmax_t>(bytes * share));
            std::filesystem::remove(store_);
            const ProgramRun run = build(path, example);
            EXPECT_EQ(run.exit_code, kInput) << describe(run);
            // Or the header beside it.
            const std::string stem = std::filesystem::path(path).replace_extension();
            EXPECT_NE(run.err.find(stem + "."), std::string::npos) << run.err;
            EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
            EXPECT_FALSE(std::filesystem::exists(store_));
        }
        clear();
    }
}

}  // namespace
}  // namespace scree::test
