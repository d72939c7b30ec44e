#include "tools/mosaic/sample_positions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

Layer layer(const std::string& crs, double x, double y, double step, std::int64_t columns, std::int64_t rows) {
    Georeference where;
    where.first_x = x;
    where.first_y = y;
    where.column_x = step;
    where.row_y = -step;
    return {where, *Crs::parse(crs), columns, rows, false, {}};
}

// Greatest distance from PROJ's own places, over random samples, in metres.
double worst_m(const Layer& l, const Crs& to, const SamplePositions& positions, test::Random& random) {
    auto transform = CrsTransform::make(l.crs, to);
    EXPECT_TRUE(transform.ok());
    double worst = 0;
    for (int k = 0; k < 2000; ++k) {
        const auto c = std::uniform_int_distribution<std::int64_t>(0, l.columns - 1)(random),
                   r = std::uniform_int_distribution<std::int64_t>(0, l.rows - 1)(random);
        const auto column = static_cast<double>(c), row = static_cast<double>(r);
        std::vector<double> x{l.where.x(column, row)}, y{l.where.y(column, row)};
        transform->apply(x, y);
        auto window = positions.window(c, r, 1, 1);
        EXPECT_TRUE(window.ok());
        const PlanePoint p = window->position(column, row);
        worst = std::max(worst, std::hypot(p.x - x[0], p.y - y[0]));
    }
    return worst;
}

TEST(SamplePositions, AreWithinAThousandthOfASampleOfProj) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    struct Case {
        const char *from, *to;
        double x, y, step, sample_m;
        std::int64_t columns, rows;
    };
    for (const Case& c : {Case{"EPSG:4326", "EPSG:32633", 14, 48, 1.0 / 3600, 20, 3601, 3601},
                          Case{"EPSG:4326", "EPSG:32633", 14, 48, 1.0 / 1200, 60, 1201, 700},
                          Case{"EPSG:4326", "EPSG:3857", -40, 60, 0.01, 1110, 800, 1200},
                          Case{"EPSG:32632", "EPSG:32633", 600000, 5300000, 30, 29, 5000, 3000},
                          Case{"EPSG:3035", "EPSG:32633", 4500000, 2900000, 100, 99, 700, 900}}) {
        SCOPED_TRACE(std::string(c.from) + " to " + c.to);
        const Layer l = layer(c.from, c.x, c.y, c.step, c.columns, c.rows);
        const Crs to = *Crs::parse(c.to);
        auto positions = SamplePositions::make(l, to);
        ASSERT_TRUE(positions.ok());
        EXPECT_LT(worst_m(l, to, *positions, random), kPositionBoundSamples * c.sample_m * 1.05);
        EXPECT_GE(positions->columns().step, 2) << "a control point for every sample is no grid";
    }
}

TEST(SamplePositions, OfALayerInTheSameCrsAreItsCornersHoweverLarge) {
    Layer l = layer("EPSG:32633", 400000, 5300000, 10, std::int64_t{1} << 40, std::int64_t{1} << 40);
    l.where.column_y = 1;
    l.where.row_x = 2;
    auto positions = SamplePositions::make(l, *Crs::parse("EPSG:32633"));
    ASSERT_TRUE(positions.ok());
    EXPECT_EQ(positions->columns().points(), 2);
    EXPECT_EQ(positions->rows().points(), 2);
    auto window = positions->window(0, 0, 64, 64);
    ASSERT_TRUE(window.ok());
    EXPECT_NEAR(window->position(10, 20).x, 400000 + 100 + 40, 1e-3);
    EXPECT_NEAR(window->position(10, 20).y, 5300000 + 10 - 200, 1e-3);
}

TEST(SamplePositions, DoNotDependOnTheWindowAndAreThoseOfTheControlPoints) {
    const Layer l = layer("EPSG:4326", 14, 48, 1.0 / 1200, 333, 217);
    auto positions = SamplePositions::make(l, *Crs::parse("EPSG:32633"));
    ASSERT_TRUE(positions.ok());
    auto all = positions->window(0, 0, l.columns, l.rows);
    ASSERT_TRUE(all.ok());
    for (const std::int64_t r : {0, 31, 32, 200, 216})
        for (const std::int64_t c : {0, 15, 16, 300, 332}) {
            auto one = positions->window(c, r, 1, 1);
            ASSERT_TRUE(one.ok());
            const auto column = static_cast<double>(c), row = static_cast<double>(r);
            EXPECT_EQ(one->position(column, row).x, all->position(column, row).x);
            EXPECT_EQ(one->position(column, row).y, all->position(column, row).y);
        }
    const ControlAxis columns = positions->columns(), rows = positions->rows();
    EXPECT_EQ(columns.at(0), 0);
    EXPECT_EQ(columns.at(columns.points() - 1), 332);
    std::vector<PlanePoint> last(1);
    ASSERT_TRUE(positions->control(columns.points() - 1, rows.points() - 1, 1, 1, last).ok());
    EXPECT_EQ(last[0].x, all->position(332, 216).x);
}

TEST(ControlAxis, EndsWithTheLastSample) {
    for (const std::int64_t count : {2, 3, 16, 17, 18, 100})
        for (const std::int64_t step : {1, 2, 16, 128}) {
            const ControlAxis axis{count, step};
            EXPECT_EQ(axis.at(0), 0);
            EXPECT_EQ(axis.at(axis.points() - 1), count - 1);
            for (std::int64_t k = 0; k + 1 < axis.points(); ++k) {
                EXPECT_LT(axis.at(k), axis.at(k + 1));
                EXPECT_LE(axis.at(k + 1) - axis.at(k), step);
            }
            for (std::int64_t s = 0; s < count; ++s) {
                const std::int64_t cell = axis.cell(static_cast<double>(s));
                EXPECT_LE(axis.at(cell), s);
                EXPECT_GE(axis.at(cell + 1), s);
            }
        }
}

}  // namespace
}  // namespace scree
