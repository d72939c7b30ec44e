// Eyes round blocks of 33 x 33 vertices, by horizontal distance in block sides: what C4 and C5 are tabled by.
#pragma once

#include <array>
#include <string>

#include "experiments/claims/rsg_world.h"

namespace scree {

struct EyeRing {
    double from = 0, to = 0;  ///< block sides, from < h <= to
    std::string name;
};
inline const std::array<EyeRing, 5> kEyeRings{
    {{0, 0.1, "(0, .1]"}, {0.1, 0.5, "(.1, .5]"}, {0.5, 1, "(.5, 1]"}, {1, 3, "(1, 3]"}, {3, 10, "(3, 10]"}}};

/// Horizontal distance to a box' rectangle; 0 over it.
inline double distance_in_plan(const glm::dvec3& eye, const Box& box) {
    const double x = std::max({box.low.x - eye.x, 0.0, eye.x - box.high.x});
    const double y = std::max({box.low.y - eye.y, 0.0, eye.y - box.high.y});
    return std::hypot(x, y);
}

/// Evenly over the ring in plan.
inline glm::dvec3 eye_in_ring(Sampler& random, const Box& box, const EyeRing& ring, double z) {
    const double side = box.high.x - box.low.x, reach = ring.to * side;
    for (;;) {
        const glm::dvec3 eye{random.uniform(box.low.x - reach, box.high.x + reach),
                             random.uniform(box.low.y - reach, box.high.y + reach), z};
        const double h = distance_in_plan(eye, box);
        if (h > ring.from * side && h <= ring.to * side) return eye;
    }
}

inline const RsgBlock& random_block(Sampler& random, const RsgWorld& world) {
    return world.blocks()[static_cast<std::size_t>(random.whole(0, static_cast<int>(world.blocks().size()) - 1))];
}

/// g = h + dz^2 / h of a vertex: the correction that it is allowed, over tau / f.
inline double allowance(const glm::dvec3& eye, const glm::dvec3& vertex) {
    const glm::dvec3 d = vertex - eye;
    const double h = std::hypot(d.x, d.y);
    return h + d.z * d.z / h;
}

inline std::array<glm::dvec3, 4> corners_of(const RsgWorld& world, const RsgBlock& block) {
    const Bisection& b = world.bisection();
    return {world.place(block, b.index(0, 0)), world.place(block, b.index(kRsgBlock, 0)),
            world.place(block, b.index(0, kRsgBlock)), world.place(block, b.index(kRsgBlock, kRsgBlock))};
}

}  // namespace scree
