#include "runtime/scene/frame_governor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/common/test_support.h"

namespace scree {
namespace {

/// A renderer: a frame takes load * (a + b / tau^p) ms, with noise, of the tau some frames ago.
struct Plant {
    double fixed_ms = 0, varied_ms = 0, power = 1, load = 1;
    int delay_frames = 0;
    double noise = 0;  ///< up to so much of the time, either way

    double ms(double tau_px) const { return load * (fixed_ms + varied_ms / std::pow(tau_px, power)); }
};

/// So that a frame takes the time allowed at tau_px, a share of it whatever tau is.
Plant plant_for(double frame_ms, double power, double fixed_share, double tau_px) {
    return {fixed_share * frame_ms, (1 - fixed_share) * frame_ms * std::pow(tau_px, power), power};
}

class Loop {
public:
    Loop(const GovernorLimits& limits, const Plant& p, test::Random& random)
        : plant(p), limits_(limits), governor_(limits), random_(random), drawn_at_{governor_.tau_px()} {}

    /// Frames for so many seconds of their own time.
    void run(double seconds) {
        least_ = most_ = governor_.tau_px();
        for (double passed_ms = 0; passed_ms < 1000 * seconds;) {
            const std::size_t now = drawn_at_.size() - 1, late = static_cast<std::size_t>(plant.delay_frames);
            const double noise = std::uniform_real_distribution<double>(-plant.noise, plant.noise)(random_);
            const double ms = plant.ms(drawn_at_[now < late ? 0 : now - late]) * (1 + noise);
            passed_ms += ms;
            const double next_px = governor_.next(ms);
            ASSERT_EQ(next_px, governor_.tau_px());
            drawn_at_.push_back(governor_.tau_px());
            least_ = std::min(least_, governor_.tau_px());
            most_ = std::max(most_, governor_.tau_px());
            ASSERT_GE(least_, limits_.tau_least_px);
            ASSERT_LE(most_, limits_.tau_most_px);
        }
    }
    double tau_px() const { return governor_.tau_px(); }
    double spread() const { return most_ / least_ - 1; }
    /// Within a share of the time allowed, or at the limit that keeps it from there.
    bool settled(double within) const {
        const double share = plant.ms(tau_px()) / limits_.frame_ms;
        if (share > 1 + within) return tau_px() >= 0.99 * limits_.tau_most_px;
        return share >= 1 - within || tau_px() <= 1.01 * limits_.tau_least_px;
    }

    Plant plant;

private:
    GovernorLimits limits_;
    FrameGovernor governor_;
    test::Random& random_;
    std::vector<double> drawn_at_;
    double least_ = 0, most_ = 0;
};

struct Sizes {
    double settled_within, spread;
};

void meet_jumps(double noise, const Sizes& allowed) {
    test::Random random(test::seed());
    for (const double fps : {30.0, 60.0})
        for (const double power : {0.5, 0.75, 1.0, 1.25, 1.5})
            for (const double fixed : {0.0, 0.2, 0.4})
                for (const double tau : {2.0, 4.0})
                    for (const double jump : {2.0, 0.5})
                        for (const int delay : {0, 1, 2, 3}) {
                            SCOPED_TRACE(testing::Message()
                                         << fps << " fps, power " << power << ", fixed share " << fixed << ", tau "
                                         << tau << ", load x " << jump << ", " << delay << " frames late");
                            Plant plant = plant_for(1000 / fps, power, fixed, tau);
                            plant.delay_frames = delay;
                            plant.noise = noise;
                            Loop loop({1000 / fps, 1, 16}, plant, random);
                            loop.run(10);
                            ASSERT_TRUE(loop.settled(allowed.settled_within)) << "tau " << loop.tau_px();
                            loop.plant.load = jump;
                            loop.run(1);
                            ASSERT_TRUE(loop.settled(allowed.settled_within)) << "tau " << loop.tau_px();
                            loop.run(5);
                            ASSERT_TRUE(loop.settled(allowed.settled_within)) << "tau " << loop.tau_px();
                            ASSERT_LT(loop.spread(), allowed.spread);
                        }
}

TEST(FrameGovernor, AJumpOfTheLoadIsMetWithinASecondWithoutSwinging) { meet_jumps(0, {0.1, 0.1}); }

TEST(FrameGovernor, NoiseOfFivePercentIsNotTakenForLoad) {
    SCREE_TRACE_SEED();
    meet_jumps(0.05, {0.125, 0.25});  // noise may hold it up for a frame or two
}

TEST(FrameGovernor, WhatCannotBeMetEndsAtTheCoarsestAndWhatIsEasyAtTheFinest) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const double noise : {0.0, 0.05})
        for (const int delay : {0, 3})
            for (const double power : {0.5, 1.0, 1.5}) {
                Plant plant = plant_for(100, power, 0.5, 16);
                plant.delay_frames = delay;
                plant.noise = noise;
                Loop loop({1000 / 30.0, 1, 16}, plant, random);
                EXPECT_EQ(loop.tau_px(), 1);
                loop.run(60);
                ASSERT_EQ(loop.tau_px(), 16);
                loop.plant.load = 0.001;
                loop.run(3);
                ASSERT_EQ(loop.tau_px(), 1);
                loop.run(3);
                ASSERT_EQ(loop.spread(), 0);
            }
}

TEST(FrameGovernor, AToleranceOfZeroIsLeftAndComeBackTo) {
    FrameGovernor governor({33, 0, 16});
    EXPECT_EQ(governor.next(10), 0);
    for (int k = 0; k < 30; ++k) governor.next(50);
    EXPECT_GT(governor.tau_px(), 0.2);
    for (int k = 0; k < 200; ++k) governor.next(5);
    EXPECT_EQ(governor.tau_px(), 0);
}

TEST(FrameGovernor, LimitsThatCrossGiveTheFiner) {
    FrameGovernor governor({33, 4, 2});
    for (int k = 0; k < 100; ++k) ASSERT_EQ(governor.next(500), 4);
}

TEST(FrameGovernor, WhatIsNoTimeIsPassedOver) {
    FrameGovernor governor({33, 1, 16}), other({33, 1, 16});
    for (int k = 0; k < 50; ++k) {
        const double ms = 45 + 20 * std::sin(k);
        for (const double bad : {0.0, -0.0, -5.0, std::numeric_limits<double>::quiet_NaN(),
                                 std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()})
            ASSERT_EQ(governor.next(bad), other.tau_px());
        const double next_px = governor.next(ms);
        ASSERT_EQ(next_px, other.next(ms));
    }
    EXPECT_GT(governor.tau_px(), 1);
}

TEST(FrameGovernor, AHitchHardlyMovesItAndIsForgotten) {
    test::Random random(1);
    Loop loop({1000 / 30.0, 1, 16}, plant_for(1000 / 30.0, 1, 0.3, 4), random);
    loop.run(10);
    const double before = loop.tau_px();
    loop.plant.load = 50;
    loop.run(0.1);  // one frame
    loop.plant.load = 1;
    loop.run(0.5);
    EXPECT_LT(loop.spread(), 0.2);
    loop.run(1);
    EXPECT_TRUE(loop.settled(0.1));
    EXPECT_NEAR(loop.tau_px(), before, 0.15 * before);
}

}  // namespace
}  // namespace scree
