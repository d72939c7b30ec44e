#include "tools/pyramid/spool_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

// Heights by formula; fails at a row.
class FormulaSource final : public ImageSource {
public:
    FormulaSource(std::int64_t width, std::int64_t height, SampleType type, std::int64_t failing_row)
        : failing_row_(failing_row) {
        info_.width = width;
        info_.height = height;
        info_.channels = 1;
        info_.type = type;
        info_.nodata = -9999;
    }
    double value(std::int64_t i, std::int64_t j) const {
        return (i + j) % 11 == 0 ? -9999 : static_cast<double>(i * 3 - j) / 4;
    }

    const ImageInfo& info() const override { return info_; }
    const std::optional<Georeference>& georeference() const override { return where_; }
    Result<void> read_channel(std::int64_t begin, std::int64_t end, std::span<float> out) override {
        return read(begin, end, out);
    }
    Result<void> read_channel(std::int64_t begin, std::int64_t end, std::span<double> out) override {
        return read(begin, end, out);
    }
    Result<void> read_rgba8(std::int64_t, std::int64_t, std::span<std::uint8_t>) override {
        return Error{ErrorCode::input, "no colours"};
    }

private:
    template <class T>
    Result<void> read(std::int64_t begin, std::int64_t end, std::span<T> out) {
        EXPECT_EQ(begin, next_row_) << "rows must be asked for in order, once each";
        EXPECT_EQ(static_cast<std::int64_t>(out.size()), (end - begin) * info_.width);
        next_row_ = end;
        if (failing_row_ >= begin && failing_row_ < end) return Error{ErrorCode::input, "a damaged row"};
        for (std::int64_t j = begin; j < end; ++j)
            for (std::int64_t i = 0; i < info_.width; ++i)
                out[static_cast<std::size_t>((j - begin) * info_.width + i)] = static_cast<T>(value(i, j));
        return {};
    }

    ImageInfo info_;
    std::optional<Georeference> where_;
    std::int64_t failing_row_, next_row_ = 0;
};

struct Spooled {
    Result<void> outcome;
    std::unique_ptr<HeightSpool> spool;
    std::int64_t rows_told = 0;
};

Spooled spooled(FormulaSource& source, bool wide, std::int64_t stop_after) {
    const test::TemporaryFolder folder;
    Spooled result;
    auto spool = HeightSpool::create(folder.file("heights"), source.info().width, source.info().height, wide);
    result.spool = std::move(*spool);
    SuspectValues suspects(source.info(), {});
    result.outcome = spool_rows(source, VoidRule(source.info(), {}), suspects, *result.spool, [&](std::int64_t rows) {
        result.rows_told += rows;
        return result.rows_told < stop_after;
    });
    return result;
}

TEST(SpoolRows, EveryRowComesOnceWithItsVoids) {
    for (const std::int64_t height : {1, 15, 16, 17, 32, 50})
        for (const bool wide : {false, true}) {
            FormulaSource source(37, height, wide ? SampleType::f64 : SampleType::i16, -1);
            Spooled s = spooled(source, wide, 1000);
            ASSERT_TRUE(s.outcome) << s.outcome.error().message;
            EXPECT_EQ(s.rows_told, height);
            ASSERT_TRUE(s.spool->finish());
            std::vector<double> row(37);
            for (std::int64_t j = 0; j < height; ++j) {
                ASSERT_TRUE(s.spool->read_samples(0, j, row));
                for (std::int64_t i = 0; i < 37; ++i) {
                    const double v = row[static_cast<std::size_t>(i)], want = source.value(i, j);
                    ASSERT_TRUE(want == -9999 ? std::isnan(v) : v == want) << "sample " << i << ", " << j;
                }
            }
        }
}

TEST(SpoolRows, ADamagedRowIsTheOutcomeWhereverItStands) {
    for (const std::int64_t row : {0, 15, 16, 33, 49}) {
        FormulaSource source(5, 50, SampleType::i16, row);
        const Spooled s = spooled(source, false, 1000);
        ASSERT_FALSE(s.outcome) << row;
        EXPECT_EQ(s.outcome.error().message, "a damaged row");
        EXPECT_LE(s.rows_told, row);
    }
}

TEST(SpoolRows, StopsWhenAsked) {
    FormulaSource source(5, 50, SampleType::i16, -1);
    const Spooled s = spooled(source, false, 20);
    ASSERT_FALSE(s.outcome);
    EXPECT_EQ(s.outcome.error().code, ErrorCode::interrupted);
    EXPECT_EQ(s.rows_told, 32);
}

}  // namespace
}  // namespace scree
