#include "tools/source/height_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Which of the values a rule leaves, as doubles and, where they are floats, as floats.
std::vector<double> left_by(const VoidRule& rule, const std::vector<double>& values, bool as_floats) {
    std::vector<double> doubles = values;
    rule.apply(std::span<double>(doubles));
    if (as_floats) {
        std::vector<float> floats(values.begin(), values.end());
        rule.apply(std::span<float>(floats));
        for (std::size_t k = 0; k < values.size(); ++k)
            EXPECT_TRUE(static_cast<double>(floats[k]) == doubles[k] ||
                        (std::isnan(floats[k]) && std::isnan(doubles[k])))
                << values[k];
    }
    std::vector<double> left;
    for (const double v : doubles)
        if (!std::isnan(v)) left.push_back(v);
    return left;
}

VoidRule rule_of(SampleType type, std::optional<double> tag, std::optional<double> user) {
    ImageInfo info;
    info.type = type;
    info.nodata = tag;
    HeightReading reading;
    reading.nodata = user;
    return {info, reading};
}

TEST(VoidRule, TakesTagsAndWhatIsNotFinite) {
    const std::vector<double> values{1, -9999, 2, -32768, kNaN, INFINITY, -INFINITY, 3, 0, -9998};
    EXPECT_EQ(left_by(rule_of(SampleType::i16, -9999, {}), values, true),
              (std::vector<double>{1, 2, -32768, 3, 0, -9998}));
    EXPECT_EQ(left_by(rule_of(SampleType::i16, -9999, -32768), values, true), (std::vector<double>{1, 2, 3, 0, -9998}));
    EXPECT_EQ(left_by(rule_of(SampleType::i16, {}, {}), values, true),
              (std::vector<double>{1, -9999, 2, -32768, 3, 0, -9998}));
    EXPECT_EQ(left_by(rule_of(SampleType::i16, 0, {}), {0.0, -0.0, 1}, true), (std::vector<double>{1}));
}

// A value between two floats is none of them; of a float file the user's value is meant as a float.
TEST(VoidRule, AValueThatTheTypeLacksTakesNothing) {
    const double float_tenth = static_cast<double>(0.1F);
    EXPECT_EQ(left_by(rule_of(SampleType::i16, {}, 0.1), {float_tenth, 1}, true),
              (std::vector<double>{float_tenth, 1}));
    EXPECT_EQ(left_by(rule_of(SampleType::f32, {}, 0.1), {float_tenth, 1}, true), (std::vector<double>{1}));
    EXPECT_EQ(left_by(rule_of(SampleType::i16, 1e300, {}), {1, 2}, true), (std::vector<double>{1, 2}));
    EXPECT_EQ(left_by(rule_of(SampleType::f64, 1e300, {}), {1, 1e300}, false), (std::vector<double>{1}));
    EXPECT_EQ(left_by(rule_of(SampleType::f32, kNaN, {}), {1, 2}, true), (std::vector<double>{1, 2}));
}

}  // namespace
}  // namespace scree
