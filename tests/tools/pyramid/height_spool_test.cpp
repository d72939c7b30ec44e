#include "tools/pyramid/height_spool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();
using Rows = std::vector<std::vector<double>>;

// The fill rule as its words say it, one sample at a time.
Rows filled(const Rows& rows) {
    Rows out = rows;
    const auto valid = [](double v) { return !std::isnan(v); };
    std::ptrdiff_t last = -1;
    for (std::size_t j = 0; j < rows.size(); ++j) {
        const auto& row = rows[j];
        bool any = false;
        for (std::size_t i = 0; i < row.size(); ++i) {
            if (valid(row[i])) {
                any = true;
                continue;
            }
            std::ptrdiff_t west = static_cast<std::ptrdiff_t>(i), east = west;
            while (west >= 0 && !valid(row[static_cast<std::size_t>(west)])) --west;
            while (east < static_cast<std::ptrdiff_t>(row.size()) && !valid(row[static_cast<std::size_t>(east)]))
                ++east;
            const bool has_west = west >= 0, has_east = east < static_cast<std::ptrdiff_t>(row.size());
            if (has_west && has_east) {
                const double a = row[static_cast<std::size_t>(west)], b = row[static_cast<std::size_t>(east)];
                out[j][i] = a + (b - a) * (static_cast<double>(static_cast<std::ptrdiff_t>(i) - west) /
                                           static_cast<double>(east - west));
            } else if (has_west || has_east) {
                out[j][i] = row[static_cast<std::size_t>(has_west ? west : east)];
            }
        }
        if (any) {
            if (last < 0)
                for (std::size_t above = 0; above < j; ++above) out[above] = out[j];
            last = static_cast<std::ptrdiff_t>(j);
        } else if (last >= 0) {
            out[j] = out[static_cast<std::size_t>(last)];
        }
    }
    return out;
}

void expect_spooled(const Rows& rows, bool wide) {
    const test::TemporaryFolder folder;
    const auto width = static_cast<std::int64_t>(rows[0].size()), height = static_cast<std::int64_t>(rows.size());
    auto spool = HeightSpool::create(folder.file("heights"), width, height, wide);
    ASSERT_TRUE(spool) << spool.error().message;
    EXPECT_TRUE(std::filesystem::is_empty(folder.file(""))) << "the file must vanish with the process";
    double low = INFINITY, high = -INFINITY;
    std::int64_t count = 0;
    for (const auto& row : rows) {
        ASSERT_TRUE((*spool)->append(row));
        for (const double v : row)
            if (!std::isnan(v)) low = std::min(low, v), high = std::max(high, v), ++count;
    }
    auto summary = (*spool)->finish();
    ASSERT_TRUE(summary);
    EXPECT_EQ(summary->valid_samples, count);
    EXPECT_EQ(summary->min_raw, low);
    EXPECT_EQ(summary->max_raw, high);
    const Rows expected = filled(rows);
    std::vector<double> values(rows[0].size());
    std::vector<std::uint8_t> valid(rows[0].size()), valid_alone(rows[0].size());
    for (std::int64_t pass = 0; pass < 2 * height; ++pass) {  // forward, then backward
        const std::int64_t j = pass < height ? pass : 2 * height - 1 - pass;
        ASSERT_TRUE((*spool)->read_row(j, values, valid));
        ASSERT_TRUE((*spool)->read_valid(j, valid_alone));
        ASSERT_EQ(valid, valid_alone);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double want = expected[static_cast<std::size_t>(j)][i];
            ASSERT_EQ(values[i], wide ? want : static_cast<double>(static_cast<float>(want)))
                << "sample " << i << ", " << j;
            ASSERT_EQ(valid[i] != 0, !std::isnan(rows[static_cast<std::size_t>(j)][i])) << "sample " << i << ", " << j;
        }
    }
}

TEST(HeightSpool, FillsRandomVoidsAsTheRuleSays) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 60; ++round) {
        const int width = test::uniform(random, 1, 40), height = test::uniform(random, 1, 30),
                  percent = test::uniform(random, 0, 99);
        Rows rows(static_cast<std::size_t>(height), std::vector<double>(static_cast<std::size_t>(width), kVoid));
        for (auto& row : rows) {
            if (test::uniform(random, 0, 3) == 0) continue;
            for (auto& v : row)
                if (test::uniform(random, 0, 99) >= percent) v = test::uniform(random, -1000000, 1000000) / 8.0;
        }
        rows[static_cast<std::size_t>(test::uniform(random, 0, height - 1))]
            [static_cast<std::size_t>(test::uniform(random, 0, width - 1))] = 7;
        expect_spooled(rows, round % 2 == 0);
    }
}

TEST(HeightSpool, LeadingVoidRowsRepeatTheFirstRowThatHasOne) {
    expect_spooled(
        {{kVoid, kVoid, kVoid}, {kVoid, kVoid, kVoid}, {kVoid, 5, kVoid}, {kVoid, kVoid, kVoid}, {1, kVoid, 3}}, false);
}

TEST(HeightSpool, RowsLongerThanAReadAheadCome) {
    Rows rows(3, std::vector<double>(300000, 1.5));  // a row of 1.2 MB
    rows[1][299999] = kVoid;
    rows[2][0] = 9;
    expect_spooled(rows, false);
}

TEST(HeightSpool, WideValuesKeepEveryBit) { expect_spooled({{16777217, -123456789.125}, {0.1, 2147483647}}, true); }

TEST(HeightSpool, VoidAndUncoveredSamplesStayApart) {
    const test::TemporaryFolder folder;
    for (const bool wide : {false, true}) {
        auto spool = HeightSpool::create(folder.file("heights"), 6, 2, wide);
        ASSERT_TRUE(spool);
        ASSERT_TRUE((*spool)->append(std::vector<double>{2, kUncoveredSample, kVoid, INFINITY, 7, kVoid}));
        ASSERT_TRUE((*spool)->append(std::vector<double>{1, 2, 3, 4, 5, 6}));
        auto summary = (*spool)->finish();
        ASSERT_TRUE(summary);
        EXPECT_EQ(summary->valid_samples, 8);
        EXPECT_EQ(summary->min_raw, 1);
        EXPECT_EQ(summary->max_raw, 7);
        std::vector<double> samples(5);
        ASSERT_TRUE((*spool)->read_samples(1, 0, samples));
        EXPECT_EQ(samples[0], kUncoveredSample);
        for (const std::size_t i : {1u, 2u, 4u}) EXPECT_TRUE(std::isnan(samples[i])) << i;
        EXPECT_EQ(samples[3], 7);
        EXPECT_TRUE((*spool)->may_lack_samples(0));
        EXPECT_FALSE((*spool)->may_lack_samples(1));
        std::vector<double> values(6);
        std::vector<std::uint8_t> valid(6);
        ASSERT_TRUE((*spool)->read_row(0, values, valid));
        EXPECT_EQ(values, (std::vector<double>{2, 3.25, 4.5, 5.75, 7, 7}));
        EXPECT_EQ(valid, (std::vector<std::uint8_t>{1, 0, 0, 0, 1, 0}));

        const std::vector<double> late{-4, 12};
        ASSERT_TRUE((*spool)->write_samples(2, 0, late));
        ASSERT_TRUE((*spool)->read_row(0, values, valid));
        EXPECT_EQ(values, (std::vector<double>{2, -1, -4, 12, 7, 7}));
        EXPECT_EQ(valid, (std::vector<std::uint8_t>{1, 0, 1, 1, 1, 0}));
        ASSERT_TRUE((*spool)->read_valid(0, valid));
        EXPECT_EQ(valid, (std::vector<std::uint8_t>{1, 0, 1, 1, 1, 0}));
    }
}

// A spool that rows were appended to one by one as doubles, and one that got some at a time as floats.
TEST(HeightSpool, FloatsAndSeveralRowsAtOnceAreTheSame) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 40; ++round) {
        const test::TemporaryFolder folder;
        const int width = test::uniform(random, 1, 60), height = test::uniform(random, 1, 20);
        auto single = HeightSpool::create(folder.file("a"), width, height, false);
        auto grouped = HeightSpool::create(folder.file("b"), width, height, false);
        ASSERT_TRUE(single && grouped);
        std::vector<float> rows(static_cast<std::size_t>(width * height));
        const int percent = round % 3 == 0 ? 0 : test::uniform(random, 1, 99);
        for (float& v : rows) {
            v = static_cast<float>(test::uniform(random, -100000, 100000)) / 16;
            if (test::uniform(random, 0, 99) < percent) {
                const int kind = test::uniform(random, 0, 2);
                v = kind == 0 ? NAN : kind == 1 ? INFINITY : -INFINITY;
            }
        }
        rows[static_cast<std::size_t>(test::uniform(random, 0, width * height - 1))] = 7;
        for (int j = 0; j < height; ++j) {
            const auto row = rows.begin() + j * width;
            ASSERT_TRUE((*single)->append(std::vector<double>(row, row + width)));
        }
        for (int j = 0; j < height;) {
            const int count = std::min(test::uniform(random, 1, 7), height - j);
            const auto row = rows.begin() + j * width;
            ASSERT_TRUE((*grouped)->append(std::vector<float>(row, row + count * width)));
            j += count;
        }
        auto one = (*single)->finish(), other = (*grouped)->finish();
        ASSERT_TRUE(one && other);
        EXPECT_EQ(one->valid_samples, other->valid_samples);
        EXPECT_EQ(one->min_raw, other->min_raw);
        EXPECT_EQ(one->max_raw, other->max_raw);
        const auto columns = static_cast<std::size_t>(width);
        std::vector<double> values(columns), stored(columns), stored_too(columns);
        std::vector<float> narrow(columns);
        std::vector<std::uint8_t> valid(columns), valid_too(columns);
        for (int j = 0; j < height; ++j) {
            ASSERT_TRUE((*single)->read_row(j, values, valid));
            ASSERT_TRUE((*grouped)->read_row(j, narrow, valid_too));
            EXPECT_EQ(values, std::vector<double>(narrow.begin(), narrow.end())) << "row " << j;
            EXPECT_EQ(valid, valid_too);
            EXPECT_EQ((*single)->may_lack_samples(j), (*grouped)->may_lack_samples(j));
            ASSERT_TRUE((*single)->read_samples(0, j, stored));
            ASSERT_TRUE((*grouped)->read_samples(0, j, stored_too));
            for (std::size_t i = 0; i < columns; ++i)
                ASSERT_TRUE(stored[i] == stored_too[i] || (std::isnan(stored[i]) && std::isnan(stored_too[i])));
        }
    }
}

TEST(HeightSpool, NothingButVoidsIsRefused) {
    const test::TemporaryFolder folder;
    auto spool = HeightSpool::create(folder.file("heights"), 3, 2, false);
    ASSERT_TRUE(spool);
    const std::vector<double> row(3, kVoid);
    ASSERT_TRUE((*spool)->append(row));
    ASSERT_TRUE((*spool)->append(row));
    auto summary = (*spool)->finish();
    ASSERT_FALSE(summary);
    EXPECT_EQ(summary.error().code, ErrorCode::input);
}

TEST(HeightSpool, NoPlaceToWriteIsAnIoErrorThatNamesIt) {
    auto spool = HeightSpool::create("/no such folder/heights", 3, 2, false);
    ASSERT_FALSE(spool);
    EXPECT_EQ(spool.error().code, ErrorCode::io);
    EXPECT_NE(spool.error().message.find("/no such folder/heights"), std::string::npos);
}

}  // namespace
}  // namespace scree
