// Which vertices are drawn does not depend on the machine: sums are never contracted (-ffp-contract=off), roots and
// divisions are exact to the last bit everywhere.
#include <bit>
#include <cmath>
#include <vector>

#include "common/lattice.h"
#include "runtime/lod/block_selection.h"
#include "runtime/lod/reuse.h"
#include "runtime/lod/vertex_errors.h"
#include "runtime/lod/vertex_metric.h"
#include "runtime/view/relative_frame.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

// FNV-1a over bits.
class Digest {
public:
    void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }
    void add(std::uint32_t value) {
        for (int k = 0; k < 4; ++k) digest_ = (digest_ ^ (value >> (8 * k) & 0xFF)) * 0x100000001B3u;
    }
    std::uint64_t value() const { return digest_; }

private:
    std::uint64_t digest_ = 0xCBF29CE484222325u;
};

// Of a generator whose every step is the standard's: no distribution, no function of a mathematical library.
class Numbers {
public:
    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
    }

private:
    test::Random random_{4242};
};

TEST(SameBits, VertexErrorsSelectionsReuseAndPositionsAreTheSameOnEveryMachine) {
    Numbers numbers;
    Digest digest;
    for (int round = 0; round < 12; ++round) {
        const Bisection b(5, round % 2 != 0);
        std::vector<double> z(b.vertex_count());
        for (double& value : z) value = numbers.between(-700, 1900);
        std::vector<float> error(z.size()), radius(z.size());
        dropped_errors(b, z, error);
        diamond_radii(b, z, 29.7, 0.3, radius);
        saturate(b, z, 29.7, error, radius);
        for (const auto* list : {&error, &radius})
            for (const float value : *list) digest.add(value);
        const double ex = numbers.between(-2000, 3000), ey = numbers.between(-2000, 3000),
                     ez = numbers.between(0, 4000), tau = numbers.between(1, 400);
        const auto sight = [&](std::int32_t v) {
            const double dx = 29.7 * (v % b.row()) - ex, dy = 29.7 * (v / b.row()) - ey,
                         dz = z[static_cast<std::size_t>(v)] - ez;
            return VertexSight<double>{dx * dx + dy * dy, dz * dz};
        };
        BlockSelection guaranteed(b), uc(b);
        guaranteed.refine([&](std::int32_t v) {
            return guaranteed_selects(1390.3 * static_cast<double>(error[static_cast<std::size_t>(v)]),
                                      static_cast<double>(radius[static_cast<std::size_t>(v)]), 0.3, tau, sight(v));
        });
        local_corrections(b, z, error);
        uc.update([&](std::int32_t v) {
            return uc_selects(1099.0 * static_cast<double>(error[static_cast<std::size_t>(v)]), tau, sight(v));
        });
        for (const BlockSelection* s : {&guaranteed, &uc})
            for (const std::uint8_t active : s->active()) digest.add(std::uint32_t{active});
    }
    const Box box{{0, 0, 0}, {960, 960, 300}};
    std::uint32_t reused = 0;
    for (int k = 0; k < 4000; ++k) {
        const glm::dvec3 then{numbers.between(-2000, 3000), numbers.between(-2000, 3000), numbers.between(0, 900)};
        const glm::dvec3 now =
            then + glm::dvec3{numbers.between(-90, 90), numbers.between(-90, 90), numbers.between(-90, 90)};
        const ReuseAllowance allowance{1, numbers.between(0, 0.4)};
        const bool reuse =
            reuse_exact(eye_to_box(then, box), eye_to_box(now, box), glm::length(now - then), 0.3, allowance);
        reused += reuse ? 1 : 0;
        digest.add(reused);
    }
    EXPECT_GT(reused, 400u);
    EXPECT_LT(reused, 3600u);
    const auto lattice = make_lattice(299987.3, 2700012.9, 29.7, 4096, 4096, 5);
    ASSERT_TRUE(lattice.ok());
    for (int k = 0; k < 4000; ++k) {
        const glm::dvec3 eye{299987.3 + numbers.between(0, 1e5), 2700012.9 - numbers.between(0, 1e5),
                             numbers.between(0, 4000)};
        const auto i = static_cast<std::int32_t>(numbers.between(0, 4096));
        const auto j = static_cast<std::int32_t>(numbers.between(0, 4096));
        const glm::vec3 p = make_relative_frame(*lattice, 50, 0.25, eye, 7.8e-8).position(i, j, 77);
        for (int axis = 0; axis < 3; ++axis) digest.add(p[axis]);
    }
    EXPECT_EQ(digest.value(), 1347925867039086074u);
}

}  // namespace
}  // namespace scree
