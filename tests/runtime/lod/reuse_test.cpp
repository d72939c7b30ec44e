// Whether a mesh may be drawn for another eye: the limits of Scree lod, section 7, and random motions. A test may
// refuse what it likes; what it accepts must keep (tau + s) / tau, C-numbers of section 1.
#include "runtime/lod/reuse.h"

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr ReuseAllowance kTenth{1, 0.1};

double between(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
double scale_between(test::Random& random, double low, double high) {
    return std::exp(between(random, std::log(low), std::log(high)));
}

EyeToBox level(double h) { return {h, h}; }

// 3
TEST(ReuseT1, AcceptsToItsLimitAndRefusesBeyond) {
    EXPECT_TRUE(reuse_t1(level(1000), level(1000), 95.34, kTenth));
    EXPECT_TRUE(reuse_t1(level(1000), level(1000), 95.346258, kTenth));
    EXPECT_FALSE(reuse_t1(level(1000), level(1000), 95.346260, kTenth));
    EXPECT_FALSE(reuse_t1(level(1000), level(1000), 95.35, kTenth));
}

// 3
TEST(ReuseT1, OverTheBlockOnlyStandingStillIsReuse) {
    for (const EyeToBox over : {EyeToBox{0, 0}, EyeToBox{0, 500}}) {
        EXPECT_FALSE(reuse_t1(over, level(1000), 1e-9, kTenth));
        EXPECT_FALSE(reuse_t1(level(1000), over, 1e-9, kTenth));
        EXPECT_TRUE(reuse_t1(over, over, 0, kTenth));
    }
}

// 4
TEST(ReuseT2, AcceptsToItsLimitAndRefusesBeyond) {
    EXPECT_TRUE(reuse_t2({0, 1000}, 100 - 1e-9, kTenth));
    EXPECT_FALSE(reuse_t2({0, 1000}, 100 + 1e-9, kTenth));
    EXPECT_FALSE(reuse_t2({0, 0}, 1e-9, kTenth));
    EXPECT_TRUE(reuse_t2({0, 0}, 0, kTenth));
}

// 4
TEST(ReuseT3, AcceptsToItsLimitAndRefusesBeyond) {
    EXPECT_TRUE(reuse_t3(level(1000), level(1000), 93.0748, 0.5, kTenth));
    EXPECT_FALSE(reuse_t3(level(1000), level(1000), 93.0749, 0.5, kTenth));
}

// 4
TEST(ReuseT3, HoldsStraightAboveTheBlockWhereT1Refuses) {
    const EyeToBox above{0, 1000};
    EXPECT_FALSE(reuse_t1(above, above, 46.5, kTenth));
    EXPECT_TRUE(reuse_t3(above, above, 46.5, 0.5, kTenth));
    EXPECT_FALSE(reuse_t3(above, above, 46.54, 0.5, kTenth));
    EXPECT_TRUE(reuse_exact(above, above, 46.5, 0.5, kTenth));
    EXPECT_FALSE(reuse_exact(above, above, 46.5, 0, kTenth));
}

// 5, 20
TEST(ReuseTests, WithoutAnAllowanceOnlyStandingStillIsReuse) {
    const EyeToBox far{1e6, 1e6};
    for (const double tau : {0.0, 1e-3, 1.0, 1e3}) {
        const ReuseAllowance none{tau, 0};
        EXPECT_FALSE(reuse_t1(far, far, 1e-9, none));
        EXPECT_FALSE(reuse_t2(far, 1e-9, none));
        EXPECT_FALSE(reuse_t3(far, far, 1e-9, 0.3, none));
        EXPECT_FALSE(reuse_exact(far, far, 1e-9, 0.3, none));
        EXPECT_TRUE(reuse_t1(far, far, 0, none));
        EXPECT_TRUE(reuse_t2(far, 0, none));
        EXPECT_TRUE(reuse_t3(far, far, 0, 0.3, none));
        EXPECT_TRUE(reuse_exact(far, far, 0, 0.3, none));
    }
}

// 5: at a tolerance of nothing what was dropped has no error, and goes on to have none.
TEST(ReuseTests, AtAToleranceOfZeroAnyAllowanceCarriesAnywhereBesideTheBlock) {
    const ReuseAllowance exact{0, 0.1};
    EXPECT_TRUE(std::isinf(exact.q()));
    for (const double moved : {1e-3, 1.0, 1e6, 1e9}) {
        EXPECT_TRUE(reuse_t1(level(1), level(1e6), moved, exact));
        EXPECT_TRUE(reuse_t2(level(1), moved, exact));
    }
    EXPECT_FALSE(reuse_t1(level(0), level(1e6), 1, exact));
    EXPECT_TRUE(reuse_t3({0, 1000}, {0, 1000}, 599, 0.3, exact));
    EXPECT_FALSE(reuse_t3({0, 1000}, {0, 1000}, 601, 0.3, exact));
}

TEST(ReuseTests, MotionsAndPlacesThatAreNoNumbersRegenerate) {
    const Box box{{0, 0, 0}, {100, 100, 10}};
    const EyeToBox far{1e6, 1e6};
    for (const double bad : {kNan, kInfinity}) {
        EXPECT_FALSE(reuse_t1(far, far, bad, kTenth));
        EXPECT_FALSE(reuse_t2(far, bad, kTenth));
        EXPECT_FALSE(reuse_t3(far, far, bad, 0.3, kTenth));
        EXPECT_FALSE(reuse_exact(far, far, bad, 0.3, kTenth));
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 eye{-50, -50, 50};
            eye[axis] = bad;
            const EyeToBox seen = eye_to_box(eye, box), sound = eye_to_box({-50, -50, 50}, box);
            EXPECT_FALSE(reuse_exact(seen, sound, 1e-9, 0.3, kTenth));
            EXPECT_FALSE(reuse_exact(sound, seen, 1e-9, 0.3, kTenth));
            EXPECT_FALSE(reuse_t2(seen, 1e-9, kTenth));
        }
    }
    EXPECT_FALSE(reuse_t1(level(kNan), far, 1, kTenth));
    EXPECT_FALSE(reuse_t3(far, level(kNan), 1, 0.3, kTenth));
    EXPECT_FALSE(reuse_exact(far, far, 1, 0.3, {kNan, 0.1}));
    EXPECT_FALSE(reuse_exact(far, far, 1, 0.3, {1, kNan}));
}

// Products of distances leave the range of a double long before the distances do.
TEST(ReuseTests, DistancesWhoseSquaresOverflowOrVanishAreJudgedByTheSameRule) {
    for (const double scale : {1e-160, 1e-100, 1.0, 1e100, 1e160, 1e300}) {
        EXPECT_TRUE(reuse_t1(level(1000 * scale), level(1000 * scale), 95.34 * scale, kTenth)) << scale;
        EXPECT_FALSE(reuse_t1(level(1000 * scale), level(1000 * scale), 95.35 * scale, kTenth)) << scale;
        EXPECT_TRUE(reuse_t3(level(1000 * scale), level(1000 * scale), 93.07 * scale, 0.3, kTenth)) << scale;
        EXPECT_FALSE(reuse_t3(level(1000 * scale), level(1000 * scale), 93.08 * scale, 0.3, kTenth)) << scale;
        EXPECT_TRUE(reuse_t2(level(1000 * scale), 99.9 * scale, kTenth)) << scale;
        EXPECT_FALSE(reuse_t2(level(1000 * scale), 100.1 * scale, kTenth)) << scale;
    }
    // From one end of what an eye's numbers can say to the other.
    const Box box{{0, 0, 0}, {100, 100, 10}};
    const glm::dvec3 west{-1e200, 50, 5}, east{1e200, 50, 5};
    EXPECT_FALSE(reuse_exact(eye_to_box(west, box), eye_to_box(east, box), glm::length(east - west), 0.3, kTenth));
}

// 7: C5. The side is 960 m, the eye ten metres before its middle and goes nine of them.
TEST(ReuseP1, AcceptsTheMotionThatMultipliesAnErrorByTenAndT1DoesNot) {
    const Box box{{0, 0, 0}, {960, 960, 0}};
    const std::array<glm::dvec3, 4> corners{{{0, 0, 0}, {960, 0, 0}, {0, 960, 0}, {960, 960, 0}}};
    const glm::dvec3 then{480, -10, 0}, now{480, -1, 0};
    EXPECT_TRUE(reuse_p1(then, now, corners, box, 1099, 0.1, 1));
    EXPECT_TRUE(reuse_p2(then, now, corners, box, 1099, 0.1, 1));
    EXPECT_FALSE(reuse_t1(eye_to_box(then, box), eye_to_box(now, box), 9, kTenth));
    EXPECT_FALSE(reuse_exact(eye_to_box(then, box), eye_to_box(now, box), 9, 0.3, kTenth));
}

double allowed_m(const glm::dvec3& eye, const glm::dvec3& vertex) {  // times tau / f
    const double h = std::hypot(vertex.x - eye.x, vertex.y - eye.y), dz = vertex.z - eye.z;
    return h + dz * dz / h;
}

// 7: C4.
TEST(ReuseP1, TheCornersDoNotBoundTheBlock) {
    const glm::dvec3 eye{480, -600, 1000};
    double corners = kInfinity, block = kInfinity;
    for (int y = 0; y <= 960; ++y)
        for (int x = 0; x <= 960; ++x) {
            const double g = allowed_m(eye, {x, y, 0});
            block = std::min(block, g);
            if (x % 960 == 0 && y % 960 == 0) corners = std::min(corners, g);
        }
    EXPECT_NEAR(corners, 2069.82, 5e-3);
    EXPECT_NEAR(block, 2000, 1e-2);
}

// 6: C3, with a block that is one vertex.
TEST(ReuseP1, LetsAnErrorPassTauPlusSAndTheExactTestDoesNot) {
    const Box vertex{{0, 0, 0}, {0, 0, 0}};
    const std::array<glm::dvec3, 4> corners{};
    const glm::dvec3 then{-1000, 0, 0}, now{-510, 0, 0};
    EXPECT_TRUE(reuse_p1(then, now, corners, vertex, 1099, 0.5, 1));
    EXPECT_GT(allowed_m(then, {}) / allowed_m(now, {}), 1.9);  // times tau, where 1.5 is promised
    EXPECT_FALSE(reuse_t1(eye_to_box(then, vertex), eye_to_box(now, vertex), 490, {1, 0.5}));
}

TEST(ReuseP1, StandingStillIsReuseAndNoNumberAndAnEyeOverTheBlockAreNot) {
    const Box box{{0, 0, 0}, {960, 960, 100}};
    const std::array<glm::dvec3, 4> corners{{{0, 0, 0}, {960, 0, 0}, {0, 960, 0}, {960, 960, 0}}};
    const glm::dvec3 beside{-100, 480, 50}, over{480, 480, 500};
    const auto both = [&](const glm::dvec3& then, const glm::dvec3& now, double s) {
        const bool p1 = reuse_p1(then, now, corners, box, 1099, s, 1);
        EXPECT_EQ(p1, reuse_p2(then, now, corners, box, 1099, s, 1));
        return p1;
    };
    EXPECT_TRUE(both(beside, beside, 0));
    EXPECT_TRUE(both(beside, beside, 0.1));
    EXPECT_FALSE(both(beside, beside - glm::dvec3(1, 0, 0), 0));
    EXPECT_FALSE(both(over, over, 0.1));
    EXPECT_FALSE(both(beside, over, 0.1));
    for (int axis = 0; axis < 3; ++axis)
        for (const double bad : {kNan, kInfinity, -kInfinity}) {
            glm::dvec3 broken = beside;
            broken[axis] = bad;
            EXPECT_FALSE(both(broken, beside, 0.1));
            EXPECT_FALSE(both(beside, broken, 0.1));
            EXPECT_FALSE(both(broken, broken, 0.1));
        }
}

// A block, two eyes and the points of its column where magnifications grow most, or may.
struct Motion {
    Box box;
    glm::dvec3 then{0}, now{0};
    double moved_m() const { return glm::length(now - then); }
};

double nearest(double at, double low, double high) { return std::min(std::max(at, low), high); }

// Eyes from inside the rectangle to 1000 km away, motions from a millimetre to as far as that.
Motion random_motion(test::Random& random) {
    Motion m;
    const double side = scale_between(random, 0.1, 1e5);
    m.box.high = {side, side * between(random, 0.5, 1), side * between(random, 0, 1)};
    const double away = scale_between(random, 1e-3, 1e6), turn = between(random, 0, 6.3);
    m.then = m.box.high * glm::dvec3(between(random, 0, 1), between(random, 0, 1), between(random, -1, 2));
    if (test::uniform(random, 0, 4) > 0) m.then += away * glm::dvec3(std::cos(turn), std::sin(turn), 0);
    if (test::uniform(random, 0, 1) > 0) m.then.z += away * between(random, -1, 2);
    const glm::dvec3 at{nearest(m.then.x, 0, m.box.high.x), nearest(m.then.y, 0, m.box.high.y),
                        nearest(m.then.z, 0, m.box.high.z)};
    const double distance = glm::length(m.then - at) + 1e-6;
    glm::dvec3 to{between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)};
    if (test::uniform(random, 0, 2) == 0) to = at - m.then + 1e-9;
    m.now = m.then + glm::normalize(to) * distance * scale_between(random, 1e-4, 3);
    return m;
}

// The same motion as far as the test goes along with it, or nothing where it does not go at all.
template <class Accepts>
Motion to_the_limit(Motion m, const Accepts& accepts) {
    const glm::dvec3 step = m.now - m.then;
    double low = 0, high = 1;
    if (accepts(m)) return m;
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        m.now = m.then + middle * step;
        (accepts(m) ? low : high) = middle;
    }
    m.now = m.then + low * step;
    return m;
}

template <class Visit>
void for_points(test::Random& random, const Motion& m, bool column, const Visit& visit) {
    const double reach = m.moved_m() + glm::length(m.box.high);
    for (int k = 0; k < 24; ++k) {
        glm::dvec3 p = m.box.high * glm::dvec3(between(random, 0, 1), between(random, 0, 1), between(random, 0, 1));
        if (k < 8) p = {k & 1 ? m.box.high.x : 0, k & 2 ? m.box.high.y : 0, k & 4 ? m.box.high.z : 0};
        if (k >= 8 && k < 16) {  // nearest to where the eye was, is, and to places between
            const glm::dvec3 e = m.then + (m.now - m.then) * ((k - 8) / 7.0);
            p = {nearest(e.x, 0, m.box.high.x), nearest(e.y, 0, m.box.high.y), nearest(e.z, 0, m.box.high.z)};
        }
        visit(p);
        if (!column) continue;
        for (const double z : {m.then.z, m.now.z, m.then.z + reach * between(random, -1, 1)}) visit({p.x, p.y, z});
    }
}

double magnification(const glm::dvec3& eye, const glm::dvec3& p, double floor) {
    const double h = std::hypot(p.x - eye.x, p.y - eye.y), r = glm::length(p - eye);
    return std::max(h, floor * r) / (r * r);
}

constexpr int kMotions = 100'000;

// 3: no point of the block's column, at any height, looks larger by more than promised.
TEST(ReuseT1, NeverLetsAPointOfTheColumnGrowByMoreThanPromised) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    double worst = 0;
    int moved = 0;
    for (int k = 0; k < kMotions; ++k) {
        const ReuseAllowance allowance{scale_between(random, 1e-3, 1e3), 0};
        ReuseAllowance a = allowance;
        a.s_px = a.tau_px * scale_between(random, 1e-3, 10);  // up to far above tau
        const Motion m = to_the_limit(random_motion(random), [&](const Motion& motion) {
            return reuse_t1(eye_to_box(motion.then, motion.box), eye_to_box(motion.now, motion.box), motion.moved_m(),
                            a);
        });
        if (m.moved_m() == 0) continue;
        ++moved;
        for_points(random, m, true, [&](const glm::dvec3& p) {
            const double before = magnification(m.then, p, 0), after = magnification(m.now, p, 0);
            ASSERT_LE(after, a.q() * before * (1 + 1e-9));
            worst = std::max(worst, (after / before - 1) / (a.q() - 1));
        });
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(moved, kMotions / 4);
    EXPECT_GT(worst, 0.99);  // the limit is tight
}

// 4
TEST(ReuseT2, NeverLetsAPointOfTheBoxComeNearerThanPromised) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    double worst = 0;
    int moved = 0;
    for (int k = 0; k < kMotions; ++k) {
        ReuseAllowance a{scale_between(random, 1e-3, 1e3), 0};
        a.s_px = a.tau_px * scale_between(random, 1e-3, 10);
        const Motion m = to_the_limit(random_motion(random), [&](const Motion& motion) {
            return reuse_t2(eye_to_box(motion.now, motion.box), motion.moved_m(), a);
        });
        if (m.moved_m() == 0) continue;
        ++moved;
        for_points(random, m, false, [&](const glm::dvec3& p) {
            const double before = glm::length(p - m.then), after = glm::length(p - m.now);
            ASSERT_LE(before, a.q() * after * (1 + 1e-9));
            worst = std::max(worst, (before / after - 1) / (a.q() - 1));
        });
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(moved, kMotions / 4);
    EXPECT_GT(worst, 0.99);
}

// 4: the floored metric, over points of the box.
TEST(ReuseT3, NeverLetsAPointOfTheBoxGrowByMoreThanPromised) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    double worst = 0;
    int moved = 0;
    for (int k = 0; k < kMotions; ++k) {
        ReuseAllowance a{scale_between(random, 1e-3, 1e3), 0};
        a.s_px = a.tau_px * scale_between(random, 1e-3, 10);
        const double floor = between(random, 0.05, 1);
        const Motion m = to_the_limit(random_motion(random), [&](const Motion& motion) {
            return reuse_t3(eye_to_box(motion.then, motion.box), eye_to_box(motion.now, motion.box), motion.moved_m(),
                            floor, a);
        });
        if (m.moved_m() == 0) continue;
        ++moved;
        for_points(random, m, false, [&](const glm::dvec3& p) {
            const double before = magnification(m.then, p, floor), after = magnification(m.now, p, floor);
            ASSERT_LE(after, a.q() * before * (1 + 1e-9));
            worst = std::max(worst, (after / before - 1) / (a.q() - 1));
        });
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(moved, kMotions / 4);
    EXPECT_GT(worst, 0.99);
}

// What passed the floored test is held to the plain one, whichever of T1 and T3 let it by.
TEST(ReuseExact, NeverLetsAnErrorOfThisFloorPassTauPlusS) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int by_t1 = 0, by_t3 = 0;
    for (int k = 0; k < kMotions; ++k) {
        ReuseAllowance a{1, scale_between(random, 1e-3, 10)};
        const Motion m = to_the_limit(random_motion(random), [&](const Motion& motion) {
            return reuse_exact(eye_to_box(motion.then, motion.box), eye_to_box(motion.now, motion.box),
                               motion.moved_m(), 0.3, a);
        });
        if (m.moved_m() == 0) continue;
        const EyeToBox then = eye_to_box(m.then, m.box), now = eye_to_box(m.now, m.box);
        const bool t1 = reuse_t1(then, now, m.moved_m(), a);
        ++(t1 ? by_t1 : by_t3);
        ASSERT_EQ(reuse_exact(then, now, m.moved_m(), 0, a), t1);
        for_points(random, m, false, [&](const glm::dvec3& p) {
            ASSERT_LE(magnification(m.now, p, 0), a.q() * magnification(m.then, p, 0.3) * (1 + 1e-9));
        });
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(by_t1, kMotions / 10);
    EXPECT_GT(by_t3, kMotions / 10);
}

// T1 implies T2.
TEST(ReuseT1, AcceptsNothingThatT2Refuses) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int accepted = 0;
    for (int k = 0; k < kMotions; ++k) {
        const Motion m = random_motion(random);
        const EyeToBox then = eye_to_box(m.then, m.box), now = eye_to_box(m.now, m.box);
        const ReuseAllowance a{1, scale_between(random, 1e-3, 10)};
        if (!reuse_t1(then, now, m.moved_m() * (1 + 1e-9), a)) continue;
        ++accepted;
        ASSERT_TRUE(reuse_t2(now, m.moved_m(), a));
    }
    EXPECT_GT(accepted, kMotions / 20);
}

// Eyes at 10^7 m that move by a millimetre: nothing of it is lost.
TEST(EyeToBox, SeesAMillimetreAtTenThousandKilometresAndAnEyeAMillimetreFromAWall) {
    const glm::dvec3 origin{1e7, 1e7, 1e6};
    const Box box{origin, origin + glm::dvec3(1000, 1000, 10)};
    for (int k = 1; k <= 1000; ++k) {
        const EyeToBox e = eye_to_box(origin + glm::dvec3(-1e-3 * k, 500, 5), box);
        ASSERT_NEAR(e.level_m, 1e-3 * k, 4e-9);
        ASSERT_EQ(e.level_m, e.distance_m);
        const EyeToBox over = eye_to_box(origin + glm::dvec3(500, 500, 10 + 1e-3 * k), box);
        ASSERT_EQ(over.level_m, 0);
        ASSERT_NEAR(over.distance_m, 1e-3 * k, 4e-10);
    }
}

}  // namespace
}  // namespace scree
