#include "runtime/app/hud_text.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scree {
namespace {

TEST(HudText, HeadingsGoClockwiseFromNorth) {
    EXPECT_EQ(direction_text({0, 1, 0}), "0° N, level");
    EXPECT_EQ(direction_text({1, 1, 0}), "45° NE, level");
    EXPECT_EQ(direction_text({1, 0, 0}), "90° E, level");
    EXPECT_EQ(direction_text({0, -1, 0}), "180° S, level");
    EXPECT_EQ(direction_text({-1, 0, 0}), "270° W, level");
}

TEST(HudText, JustWestOfNorthIsNotThreeHundredAndSixty) {
    EXPECT_EQ(direction_text({-0.001, 1, 0}), "0° N, level");
    EXPECT_EQ(direction_text({-0.02, 1, 0}), "359° N, level");
}

TEST(HudText, APointOfTheCompassReachesHalfWayToTheNext) {
    EXPECT_EQ(direction_text({std::sin(glm::radians(22.0)), std::cos(glm::radians(22.0)), 0}), "22° N, level");
    EXPECT_EQ(direction_text({std::sin(glm::radians(23.0)), std::cos(glm::radians(23.0)), 0}), "23° NE, level");
}

TEST(HudText, PitchDoesNotDependOnLength) {
    EXPECT_EQ(direction_text({0, 1, 1}), "0° N, 45° up");
    EXPECT_EQ(direction_text({0, 1000, -1000}), "0° N, 45° down");
}

TEST(HudText, StraightDownHasNoHeading) {
    EXPECT_EQ(direction_text({0, 0, -1}), "straight down");
    EXPECT_EQ(direction_text({1e-9, 0, 1000}), "straight up");
}

TEST(HudText, AnHourIsOfTwoDigitsOfMinutes) {
    EXPECT_EQ(hour_text(14), "14:00");
    EXPECT_EQ(hour_text(23.999), "0:00");
}

}  // namespace
}  // namespace scree
