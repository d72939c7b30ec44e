#include "tools/pyramid/height_quantizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

HeightQuantizer chosen(const QuantizerInput& in) {
    auto q = choose_quantizer(in);
    EXPECT_TRUE(q) << (q ? "" : q.error().message);
    return q ? *q : HeightQuantizer{};
}

QuantizerInput floats(double low, double high) {
    QuantizerInput in;
    in.min_raw = low;
    in.max_raw = high;
    return in;
}

// Metres as a reader of the store computes them (Dataset::height_m).
double decoded(const HeightQuantizer& q, double raw) { return q.height_offset_m + q.quantize(raw) * q.quantum_m; }

TEST(HeightQuantizer, IntegerSourcesAreLossless) {
    for (const double scale : {1.0, 0.1, 0.3048, 0.01}) {
        QuantizerInput in{true, scale, -12.5, std::nullopt, 0, 65535};
        const HeightQuantizer q = chosen(in);
        EXPECT_EQ(q.quantum_m, scale);
        for (int raw = 0; raw <= 65535; raw += 13) {
            ASSERT_EQ(q.quantize(raw), raw);
            ASSERT_NEAR(decoded(q, raw), raw * scale - 12.5, 1e-9);
        }
    }
}

TEST(HeightQuantizer, FloatSourcesTakeASixtyFourthOfAMetre) {
    const HeightQuantizer q = chosen(floats(-430.5, 8848.86));
    EXPECT_EQ(q.quantum_m, 1.0 / 64);
    EXPECT_EQ(q.height_offset_m, 0);
    test::Random random(test::seed());
    for (int k = 0; k < 10000; ++k) {
        const double z = std::uniform_real_distribution<double>(-430.5, 8848.86)(random);
        ASSERT_LE(q.error_m(z), 1.0 / 128);
        ASSERT_LE(std::abs(decoded(q, z) - z), 1.0 / 128);
    }
}

TEST(HeightQuantizer, AWideRangeTakesACoarserQuantumThatFits) {
    const HeightQuantizer q = chosen(floats(-1e6, 1e6));
    EXPECT_EQ(q.quantum_m, 1.0 / 8);  // 2e6 m in 2^24 steps
    for (const double z : {-1e6, -999999.9, 0.1, 1e6}) {
        EXPECT_LE(std::abs(decoded(q, z) - z), q.quantum_m / 2);
        EXPECT_LE(std::abs(q.quantize(z)), kMaxHeightUnits);
    }
}

TEST(HeightQuantizer, ADistantNarrowRangeMovesTheOffsetAndKeepsTheQuantum) {
    const HeightQuantizer q = chosen(floats(900000, 901000));
    EXPECT_EQ(q.quantum_m, 1.0 / 64);
    EXPECT_NEAR(q.height_offset_m, 900500, 1);
    EXPECT_EQ(decoded(q, 900123.015625), 900123.015625);

    QuantizerInput in{true, 1, 0, std::nullopt, 9000000, 9000500};
    const HeightQuantizer integers = chosen(in);
    EXPECT_EQ(integers.quantum_m, 1);
    for (int raw = 9000000; raw <= 9000500; ++raw) ASSERT_EQ(decoded(integers, raw), raw);
}

TEST(HeightQuantizer, HeightsBeyondTenThousandKilometresAreRefusedAsANodataValue) {
    for (const auto& in :
         {floats(-3.4e38, 500), floats(0, 1.7e38), floats(0, 1.0001e7), floats(-INFINITY, 0), floats(0, NAN)}) {
        auto q = choose_quantizer(in);
        ASSERT_FALSE(q);
        EXPECT_EQ(q.error().code, ErrorCode::input);
        EXPECT_NE(q.error().message.find("nodata"), std::string::npos) << q.error().message;
    }
    EXPECT_TRUE(choose_quantizer(floats(-1e7, 1e7)));
}

TEST(HeightQuantizer, AnAskedQuantumIsKeptOrRefused) {
    QuantizerInput in = floats(0, 4000);
    in.quantum_m = 0.5;
    EXPECT_EQ(chosen(in).quantum_m, 0.5);
    in.quantum_m = 1e-5;
    auto q = choose_quantizer(in);
    ASSERT_FALSE(q);
    EXPECT_EQ(q.error().code, ErrorCode::usage);
    EXPECT_NE(q.error().message.find("--height-quantum"), std::string::npos);

    in = floats(100000, 100050);
    in.quantum_m = 1e-5;  // fits once the offset is in the middle
    const HeightQuantizer moved = chosen(in);
    for (const double z : {100000.0, 100025.12345, 100050.0}) EXPECT_LE(std::abs(decoded(moved, z) - z), 0.6e-5);
}

// Scree lod, test 18.
TEST(HeightQuantizer, EighthsDecodeBitEqualFromAnyBaseAndOverflowIsReported) {
    for (const double base : {0.0, -500.0, 8000.0, 123456.0}) {
        QuantizerInput in = floats(base, base + 8191.875);
        in.quantum_m = 0.125;
        const HeightQuantizer q = chosen(in);
        for (int k = 0; k <= 65535; ++k) ASSERT_EQ(decoded(q, base + k / 8.0), base + k / 8.0);
    }
    QuantizerInput in = floats(0, 2.0 * (kMaxHeightUnits - 1) / 8);  // the last range of this quantum
    in.quantum_m = 0.125;
    EXPECT_TRUE(choose_quantizer(in));
    in.max_raw += 1;
    EXPECT_FALSE(choose_quantizer(in)) << "overflow must be reported, not wrapped";
}

TEST(HeightQuantizer, EveryRangeThatIsAcceptedFits) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 5000; ++k) {
        QuantizerInput in;
        const double a = std::uniform_real_distribution<double>(-1e7, 1e7)(random);
        const double width = std::exp2(std::uniform_real_distribution<double>(-10, 24)(random));
        in.integer_source = k % 2 == 0;
        in.scale = std::exp2(std::uniform_real_distribution<double>(-12, 4)(random));
        in.offset_m = k % 3 == 0 ? 0 : a / 7;
        in.min_raw = std::floor(a / in.scale);
        in.max_raw = std::floor(std::min(a + width, 1e7) / in.scale);
        if (in.max_raw < in.min_raw) continue;
        auto q = choose_quantizer(in);
        if (!q) continue;
        for (const double raw : {in.min_raw, std::floor((in.min_raw + in.max_raw) / 2), in.max_raw}) {
            ASSERT_LE(q->error_m(raw), q->quantum_m * 0.5000001 + 1e-8) << "raw " << raw << " quantum " << q->quantum_m;
            ASSERT_LE(std::abs(q->quantize(raw)), kMaxHeightUnits);
        }
    }
}

// As the header says it.
std::int32_t plain_quantize(const HeightQuantizer& q, double raw) {
    const double n = std::nearbyint((raw * q.scale + q.offset_m - q.height_offset_m) / q.quantum_m);
    return static_cast<std::int32_t>(std::clamp<double>(n, -kMaxHeightUnits, kMaxHeightUnits));
}

template <class T>
void expect_rows_like_values(const HeightQuantizer& q, const std::vector<T>& raw,
                             const std::vector<std::uint8_t>& valid) {
    std::vector<std::int32_t> out(raw.size());
    const QuantizedRange range = q.quantize(std::span<const T>(raw), valid, out);
    QuantizedRange want;
    for (std::size_t i = 0; i < raw.size(); ++i) {
        const auto value = static_cast<double>(raw[i]);
        ASSERT_EQ(out[i], plain_quantize(q, value)) << value << " in steps of " << q.quantum_m;
        ASSERT_EQ(out[i], q.quantize(value));
        if (valid.empty() || valid[i] != 0) want.include({out[i], out[i], q.error_m(value)});
    }
    EXPECT_EQ(range.min_n, want.min_n);
    EXPECT_EQ(range.max_n, want.max_n);
    EXPECT_EQ(range.worst_error_m, want.worst_error_m);
}

TEST(HeightQuantizer, RowsAreQuantisedAsValuesAre) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 600 && !::testing::Test::HasFailure(); ++k) {
        const double quantum = k % 3 == 0 ? 1.0 / 64 : k % 3 == 1 ? 0.1 : std::ldexp(3.0, test::uniform(random, -8, 3));
        const HeightQuantizer q{k % 2 == 0 ? 1 : 0.3048, k % 5 == 0 ? -12.5 : 0, k % 7 == 0 ? 1000.0 : 0.0, quantum};
        const auto count = static_cast<std::size_t>(test::uniform(random, 1, 70));
        std::vector<double> raw(count);
        for (double& v : raw) {
            v = std::uniform_real_distribution<double>(-20000, 20000)(random);
            if (k % 4 == 0) v = (test::uniform(random, -2000000, 2000000) + 0.5) * quantum;  // halves go to even
            if (k % 4 == 1) v *= 1e4;  // beyond what a quantum holds
        }
        std::vector<std::uint8_t> valid;
        if (k % 3 != 0)
            for (std::size_t i = 0; i < count; ++i)
                valid.push_back(static_cast<std::uint8_t>(test::uniform(random, 0, 1)));
        expect_rows_like_values(q, raw, valid);
        expect_rows_like_values(q, std::vector<float>(raw.begin(), raw.end()), valid);
    }
}

}  // namespace
}  // namespace scree
