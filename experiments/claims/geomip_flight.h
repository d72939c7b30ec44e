// A GeoMip world flown over: what C12 to C14 compare.
#pragma once

#include <vector>

#include "experiments/claims/geomip_world.h"

namespace scree {

struct GeomipFlown {
    PixelErrors errors;
    double triangles = 0;  ///< a frame, blocks in view
};

inline GeomipFlown fly_geomip(const GeomipWorld& world, const std::vector<Camera>& cameras,
                              const GeomipMetric& metric) {
    GeomipFlown flown;
    for (const Camera& camera : cameras) {
        const Frustum frustum(camera);
        const auto drawn = world.select(camera, metric);
        for (std::size_t k = 0; k < drawn.size(); ++k) {
            if (!frustum.may_see(world.blocks()[k].box)) continue;
            world.judge(world.blocks()[k], drawn[k], camera, flown.errors);
            flown.triangles += static_cast<double>(world.triangles(drawn[k])) / static_cast<double>(cameras.size());
        }
    }
    return flown;
}

/// High along the loop, and low over the ground.
inline std::vector<Camera> high_and_low(const Terrain& terrain, int frames) {
    std::vector<Camera> cameras = loop_cameras(terrain, {}, frames);
    for (const Camera& low : loop_cameras(terrain, {0, 60, false, -8}, frames)) cameras.push_back(low);
    return cameras;
}

}  // namespace scree
