#include "common/lon_lat_text.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scree {
namespace {

TEST(LonLatText, NamesTheSidesLongitudeFirst) {
    EXPECT_EQ(lon_lat_text({121.56541, 25.03299}, 12), "121.5654 E 25.0330 N");
    EXPECT_EQ(lon_lat_text({-121.56541, -25.03299}, 12), "121.5654 W 25.0330 S");
}

TEST(LonLatText, HasAsManyDigitsAsAreCertain) {
    const LonLat at{121.123456789, -25.987654321};
    EXPECT_EQ(lon_lat_text(at, 1e6), "121 E 26 S");
    EXPECT_EQ(lon_lat_text(at, 111319), "121.1 E 26.0 S");
    EXPECT_EQ(lon_lat_text(at, 1200), "121.12 E 25.99 S");
    EXPECT_EQ(lon_lat_text(at, 30), "121.1235 E 25.9877 S");
    EXPECT_EQ(lon_lat_text(at, 1), "121.123457 E 25.987654 S");
    EXPECT_EQ(lon_lat_text(at, 0.011), "121.1234568 E 25.9876543 S");
    for (const double certain_m : {0.0, -1.0, 1e-300, std::nan("")})
        EXPECT_EQ(lon_lat_text(at, certain_m), "121.1234568 E 25.9876543 S") << certain_m;
}

TEST(LonLatText, NoSideWhereThereIsNone) {
    EXPECT_EQ(lon_lat_text({0, 0}, 1000), "0.000 0.000");
    EXPECT_EQ(lon_lat_text({-0.0001, -0.004}, 1200), "0.00 0.00");
    EXPECT_EQ(lon_lat_text({179.9999, 90}, 1200), "180.00 90.00 N");
    EXPECT_EQ(lon_lat_text({-180, -90}, 1200), "180.00 90.00 S");
    EXPECT_EQ(lon_lat_text({-179.99, 0.01}, 1200), "179.99 W 0.01 N");
}

}  // namespace
}  // namespace scree
