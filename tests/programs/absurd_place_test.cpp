// Places that cannot be, or hardly: each is refused with a reason or built soundly.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>

#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3;

class AbsurdPlaces : public ::testing::Test {
protected:
    // An .asc whose header says so; `value` stands at every sample, or at every other one its negative.
    std::string grid(const std::string& name, const std::string& x, const std::string& y, const std::string& step,
                     const std::string& value = "7", int columns = 9, int rows = 9, bool negative = false) {
        std::ofstream out(folder_.file(name));
        out << "ncols " << columns << "\nnrows " << rows << "\nxllcenter " << x << "\nyllcenter " << y << "\ncellsize "
            << step << "\nNODATA_value -9999\n";
        for (int k = 0; k < columns * rows; ++k) out << (negative && k % 2 == 1 ? "-" : "") << value << '\n';
        return folder_.file(name);
    }
    // A Surfer 6 grid of 9 x 9 samples whose header says so.
    std::string surfer(int columns, int rows, double west, double east, float value = 7) {
        std::ofstream out(folder_.file("a.grd"), std::ios::binary | std::ios::trunc);
        const auto put = [&](auto number) {
            std::array<char, sizeof(number)> bytes{};
            std::memcpy(bytes.data(), &number, sizeof(number));
            out.write(bytes.data(), bytes.size());
        };
        out << "DSBB";
        for (const int side : {columns, rows}) put(static_cast<std::int16_t>(side));
        for (const double limit : {west, east, 5300000.0, 5300080.0, 0.0, 1.0}) put(limit);
        for (int k = 0; k < 81; ++k) put(k % 27 == 10 ? 1.70141e38F : value);
        out.close();
        return folder_.file("a.grd");
    }
    ProgramRun build(std::vector<std::string> files, const std::string& crs) {
        files.insert(files.begin(), "build");
        files.insert(files.end(), {"-o", store_, "--quiet", "--texture-size", "32"});
        if (!crs.empty()) files.insert(files.end(), {"--assume-crs", crs});
        return scree(files);
    }
    void expect_refused(const ProgramRun& run, int code, const std::string& words) {
        EXPECT_EQ(run.exit_code, code) << describe(run);
        EXPECT_NE(run.err.find(words), std::string::npos) << describe(run);
        EXPECT_FALSE(std::filesystem::exists(store_));
    }
    void expect_built(const ProgramRun& run) {
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_EQ(scree({"verify", store_, "--quiet"}).exit_code, 0);
        std::filesystem::remove(store_);
    }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree");
    const std::string utm_ = "EPSG:32633", degrees_ = "EPSG:4326";
};

TEST_F(AbsurdPlaces, OfOneFileAreRefusedWithTheReason) {
    expect_refused(build({grid("a.asc", "nan", "0", "10")}, utm_), kInput, "'nan'");
    expect_refused(build({grid("a.asc", "0", "inf", "10")}, utm_), kInput, "'inf'");
    expect_refused(build({grid("a.asc", "1e300", "0", "10")}, utm_), kInput, "nowhere");
    expect_refused(build({grid("a.asc", "0", "0", "0")}, utm_), kInput, "cellsize is 0");
    expect_refused(build({grid("a.asc", "0", "0", "-5")}, utm_), kInput, "cellsize is -5");
    expect_refused(build({grid("a.asc", "0", "0", "1e14")}, ""), kInput, "1e9 m");
    expect_refused(build({grid("a.asc", "1e9", "-1e9", "1e8")}, ""), kInput, "1e-6..1e6");
    expect_refused(build({grid("a.asc", "0", "95", "1")}, degrees_), kInput, "no part of the Earth");
}

TEST_F(AbsurdPlaces, OfHeightsAreRefusedWithTheReason) {
    expect_refused(build({grid("a.asc", "0", "0", "10", "-9999")}, utm_), kInput, "every height is a void");
    expect_refused(build({grid("a.asc", "0", "0", "10", "1e30")}, utm_), kInput, "nodata");
    expect_refused(build({grid("a.asc", "0", "0", "10", "1e6", 9, 9, true), "--height-quantum", "0.01"}, utm_), kUsage,
                   "cannot hold");
    expect_built(build({grid("a.asc", "0", "0", "10", "1e6", 9, 9, true)}, utm_));
}

TEST_F(AbsurdPlaces, OfSurferGridsAreRefusedWithTheReason) {
    const double west = 500000, east = 500080;
    expect_refused(build({surfer(-9, 9, west, east)}, utm_), kInput, "a.grd: its header says -9 x 9 samples");
    expect_refused(build({surfer(1, 81, west, east)}, utm_), kInput, "cannot be placed");
    expect_refused(build({surfer(32767, 32767, west, east)}, utm_), kInput, "4294705212 bytes");
    expect_refused(build({surfer(9, 8, west, east)}, utm_), kInput, "the file has 380");
    expect_refused(build({surfer(9, 9, east, west)}, utm_), kInput, "x goes from 500080 to 500000");
    expect_refused(build({surfer(9, 9, west, 1e300)}, utm_), kInput, "nowhere");
    expect_refused(build({surfer(9, 9, std::nan(""), east)}, utm_), kInput, "nan");
    expect_refused(build({surfer(9, 9, west, east, 1.70141e38F)}, utm_), kInput, "every height is a void");
    expect_built(build({surfer(9, 9, west, east)}, utm_));
}

TEST_F(AbsurdPlaces, OfFilesThatDoNotMeet) {
    const std::string here = grid("a.asc", "500000", "5300000", "10");
    expect_built(build({here, grid("b.asc", "600000", "5300000", "10")}, utm_));
    expect_refused(build({here, grid("b.asc", "1e9", "5300000", "10")}, utm_), kInput, "b.asc");
    expect_refused(build({here, grid("b.asc", "1e9", "5300000", "10")}, ""), kUsage, "--memory");
    // A metre in a hundred kilometres: depth is what varies, not time.
    expect_built(build({grid("c.asc", "500000", "5300000", "100000"), grid("d.asc", "600000", "5300000", "1")}, utm_));
}

TEST_F(AbsurdPlaces, AtThePoleAndAroundTheWorld) {
    expect_built(build({grid("a.asc", "-180", "86", "1", "7", 361, 5)}, degrees_));
    expect_built(build({grid("a.asc", "-180", "-90", "2", "7", 181, 91)}, degrees_));
}

TEST_F(AbsurdPlaces, OfThreeHundredFilesTakeTheMemoryOfOne) {
    std::vector<std::string> files;
    for (int k = 0; k < 300; ++k)
        files.push_back(grid("f" + std::to_string(k) + ".asc", std::to_string(400000 + k % 20 * 150),
                             std::to_string(5300000 + k / 20 * 150), "10", std::to_string(k), 16, 16));
    const auto one = build({files.front()}, utm_);
    expect_built(one);
    files.insert(files.end(), {"--memory", "192M"});
    const auto all = build(files, utm_);
    expect_built(all);
    if (kSanitized) return;
    EXPECT_LT(all.peak_rss_bytes, one.peak_rss_bytes + (std::int64_t{32} << 20));
}

}  // namespace
}  // namespace scree::test
