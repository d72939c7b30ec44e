#include "tools/mosaic/height_shift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/common/test_support.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/mosaic/mosaic_plan.h"
#include "tools/mosaic/stack.h"

namespace scree {
namespace {

// Heights 100 + column of the file's unit over degrees from (-105, 40).
std::string write_heights(const std::string& path, int vertical, int width = 300, int height = 150, double step = 0.002,
                          double north = 40) {
    auto t = test::layout_of<std::int16_t>(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
    t.scale = {step, step, 0};
    t.tie_points = {0, 0, 0, -105, north, 0};
    t.model_type = ModelTypeGeographic;
    t.geographic = 4326;
    t.raster_type = RasterPixelIsPoint;
    t.vertical = vertical;
    t.nodata = "-999";
    std::vector<std::int16_t> z;
    for (int r = 0; r < height; ++r)
        for (int c = 0; c < width; ++c) z.push_back(r == 1 && c == 1 ? -999 : static_cast<std::int16_t>(100 + c));
    EXPECT_TRUE(test::write_tiff(path, t, z.data()));
    return path;
}

MosaicRequest request_for(const std::vector<std::string>& paths, const std::string& datum) {
    MosaicRequest request;
    request.heights = paths;
    request.reading.vertical_crs = datum;
    return request;
}

std::vector<double> samples(const MosaicPlan& plan, const HeightReading& reading, const std::string& temporary) {
    StackOptions options;
    options.temporary = temporary;
    options.heights = reading;
    const auto stack = HeightStack::read(plan.heights, plan.height_layers, plan.same_units, options, {});
    EXPECT_TRUE(stack) << stack.error().message;
    if (!stack) return {};
    const Layer& layer = (*stack)->layer(0);
    std::vector<double> z(static_cast<std::size_t>(layer.columns * layer.rows));
    EXPECT_TRUE((*stack)->samples(0, 0, 0, layer.columns, layer.rows, z));
    return z;
}

bool has_egm96() {
    const auto from = VerticalCrs::parse("EPSG:5773"), to = VerticalCrs::parse("EPSG:4979");
    return VerticalShift::make(*Crs::parse("EPSG:4326"), *from, *to, {-106, 39, -104, 41}).ok();
}

TEST(HeightShift, StaysWithinItsBoundOfProjAtEverySampleAndLeavesVoids) {
    if (!has_egm96()) GTEST_SKIP() << "PROJ has no grid of EGM 96 here";
    const test::TemporaryFolder folder;
    // Half a degree across: corners of the geoid's grid lie within blocks.
    const std::string path = write_heights(folder.file("a.tif"), 5773);
    const MosaicRequest request = request_for({path}, "EPSG:4979");
    const auto plan = plan_mosaic(request);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(plan->vertical_datum, "EPSG:4979");
    EXPECT_FALSE(plan->same_units);
    ASSERT_EQ(plan->conversions.size(), 1u);
    EXPECT_NE(plan->conversions[0].find("EPSG:5773"), std::string::npos);
    const auto z = samples(*plan, request.reading, folder.file("t"));
    ASSERT_EQ(z.size(), 300u * 150);
    const auto exact = VerticalShift::make(*Crs::parse("EPSG:4326"), *VerticalCrs::parse("EPSG:5773"),
                                           *VerticalCrs::parse("EPSG:4979"), plan->box);
    double worst = 0, interpolated = 0;
    for (std::size_t k = 0; k < z.size(); ++k) {
        const double c = static_cast<double>(k % 300), r = static_cast<double>(k / 300);
        if (k == 301) {
            EXPECT_TRUE(std::isnan(z[k]));
            continue;
        }
        std::vector<double> height{100 + c};
        exact->apply(std::vector<double>{-105 + 0.002 * c}, std::vector<double>{40 - 0.002 * r}, height);
        worst = std::max(worst, std::abs(z[k] - height[0]));
        interpolated += z[k] != height[0] ? 1 : 0;
        EXPECT_LT(z[k], 100 + c - 15);
    }
    EXPECT_LE(worst, kHeightShiftBound_m);
    EXPECT_GT(interpolated, 1000) << "samples were taken one by one";
}

TEST(HeightShift, DoesNotDependOnTheRowsAskedFor) {
    if (!has_egm96()) GTEST_SKIP() << "PROJ has no grid of EGM 96 here";
    const test::TemporaryFolder folder;
    const auto plan = plan_mosaic(request_for({write_heights(folder.file("a.tif"), 5773)}, "EPSG:4979"));
    ASSERT_TRUE(plan);
    const auto shift = HeightShift::make(plan->heights[0]);
    ASSERT_TRUE(shift);
    std::vector<double> whole(300 * 150, 7);
    ASSERT_TRUE(shift->apply(0, 150, whole));
    for (std::int64_t begin = 0; begin < 150; begin += 41) {
        const std::int64_t end = std::min<std::int64_t>(begin + 41, 150);
        std::vector<double> part(static_cast<std::size_t>(300 * (end - begin)), 7);
        ASSERT_TRUE(shift->apply(begin, end, part));
        EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin() + 300 * begin)) << "from row " << begin;
    }
}

TEST(HeightShift, OfDepthsIsTheSign) {
    const test::TemporaryFolder folder;
    const MosaicRequest request = request_for({write_heights(folder.file("a.tif"), 5715)}, "EPSG:5714");
    const auto plan = plan_mosaic(request);
    ASSERT_TRUE(plan) << plan.error().message;
    const auto z = samples(*plan, request.reading, folder.file("t"));
    EXPECT_NEAR(z[0], -100, 1e-9);
    EXPECT_NEAR(z[299], -399, 1e-9);
}

TEST(HeightShift, OfFeetKeepsTheFilesIntegers) {
    const test::TemporaryFolder folder;
    const MosaicRequest request = request_for({write_heights(folder.file("a.tif"), 6360)}, "EPSG:5703");
    const auto plan = plan_mosaic(request);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_TRUE(plan->same_units);
    EXPECT_TRUE(plan->conversions.empty());
    EXPECT_EQ(plan->vertical_datum, "EPSG:5703");
    const HeightUnits units = units_of(plan->heights[0].info, plan->heights[0].where, request.reading);
    EXPECT_DOUBLE_EQ(units.scale, 1200.0 / 3937);
}

TEST(HeightShift, BringsFilesOfDifferentUnitsTogether) {
    const test::TemporaryFolder folder;
    // The second lies south of the first and counts in feet of mean sea level's depth.
    const MosaicRequest request = request_for(
        {write_heights(folder.file("a.tif"), 5714), write_heights(folder.file("b.tif"), 8051, 300, 150, 0.002, 39.7)},
        "EPSG:5714");
    const auto plan = plan_mosaic(request);
    ASSERT_TRUE(plan) << plan.error().message;
    ASSERT_EQ(plan->height_layers.size(), 1u);
    const auto z = samples(*plan, request.reading, folder.file("t"));
    ASSERT_EQ(z.size(), 300u * 300);
    EXPECT_EQ(z[10], 110);
    EXPECT_NEAR(z[150 * 300 + 10], -110 * 0.3048, 1e-9);
}

void expect_refused(const MosaicRequest& request, ErrorCode code, const std::vector<std::string>& words) {
    const auto plan = plan_mosaic(request);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, code) << plan.error().message;
    for (const std::string& word : words)
        EXPECT_NE(plan.error().message.find(word), std::string::npos) << word << ": " << plan.error().message;
}

TEST(HeightShift, RefusesWhatItCannotDo) {
    const test::TemporaryFolder folder;
    const std::string navd88 = write_heights(folder.file("a.tif"), 5703);
    const std::string egm96 = write_heights(folder.file("b.tif"), 5773);
    const std::string datum = write_heights(folder.file("c.tif"), 5129);
    // Without the option different datums are refused as ever, and the refusal tells of it.
    MosaicRequest both = request_for({navd88, egm96}, "");
    both.reading.vertical_crs.reset();
    expect_refused(both, ErrorCode::input, {"EPSG:5773", "EPSG:5703", "--vertical-crs", "--assume-same-datum"});
    // A grid that is on no Debian.
    expect_refused(request_for({navd88}, "EPSG:3855"), ErrorCode::input, {"a.tif", "EPSG:5703", "EPSG:3855", "grid"});
    expect_refused(request_for({datum}, "EPSG:5703"), ErrorCode::input, {"c.tif", "EPSG:5129"});
    expect_refused(request_for({navd88}, "EPSG:6360"), ErrorCode::usage, {"EPSG:6360", "metres upwards"});
    expect_refused(request_for({navd88}, "EPSG:5715"), ErrorCode::usage, {"EPSG:5715"});
    expect_refused(request_for({navd88}, "EPSG:4326"), ErrorCode::usage, {"--vertical-crs", "EPSG:4326"});
    MosaicRequest both_ways = request_for({navd88}, "EPSG:5714");
    both_ways.assume_same_datum = true;
    expect_refused(both_ways, ErrorCode::usage, {"--vertical-crs", "--assume-same-datum"});
}

// A store of such files names it, and is judged by it.
TEST(HeightShift, LeavesAloneWhatFilesSayThatNoRegistryKnows) {
    const test::TemporaryFolder folder;
    const std::string odd = write_heights(folder.file("a.tif"), 5129);
    const auto plan = plan_mosaic(request_for({odd, write_heights(folder.file("b.tif"), 0)}, "EPSG:5129"));
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(plan->vertical_datum, "EPSG:5129");
    EXPECT_TRUE(plan->same_units);
}

TEST(HeightShift, TakesFilesThatNameNoDatumAsTheyAreAndSaysSo) {
    const test::TemporaryFolder folder;
    const auto plan = plan_mosaic(request_for({write_heights(folder.file("a.tif"), 0)}, "EPSG:5773"));
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(plan->vertical_datum, "EPSG:5773");
    EXPECT_TRUE(plan->same_units);
    ASSERT_EQ(plan->warnings.size(), 1u);
    EXPECT_NE(plan->warnings[0].find("a.tif names no vertical datum"), std::string::npos) << plan->warnings[0];
}

}  // namespace
}  // namespace scree
