#include "experiments/claims/rsg_world.h"

#include <limits>

#include "runtime/lod/vertex_errors.h"
#include "runtime/lod/vertex_metric.h"

namespace scree {
namespace {

constexpr double kFloor = 0.3;  // c of the floored metric: costs 0.6 % triangles at a steep view

VertexSight<double> sight_of(const glm::dvec3& eye, const glm::dvec3& vertex) {
    const glm::dvec3 d = vertex - eye;
    return {d.x * d.x + d.y * d.y, d.z * d.z};
}

}  // namespace

RsgWorld::RsgWorld(const Terrain& terrain)
    : terrain_(terrain),
      bisection_(kRsgBlock_log2, false),
      columns_(terrain.columns / (kRsgBlock + 1)),
      rows_(terrain.rows / (kRsgBlock + 1)) {
    for (int y = 0; y < rows_; ++y)
        for (int x = 0; x < columns_; ++x) {
            RsgBlock block;
            block.i = x * (kRsgBlock + 1);
            block.j = y * (kRsgBlock + 1);
            for (const std::int32_t n : block_heights(terrain, block.i, block.j, kRsgBlock_log2))
                block.z.push_back(terrain.quantum_m * n);
            const auto [low, high] = std::minmax_element(block.z.begin(), block.z.end());
            const glm::dvec3 corner = terrain.place(block.i, block.j);
            const double side = terrain.spacing_m * kRsgBlock;
            block.box = {{corner.x, corner.y - side, *low}, {corner.x + side, corner.y, *high}};
            block.delta.resize(block.z.size());
            block.error = block.radius = block.delta;
            local_corrections(bisection_, block.z, block.delta);
            dropped_errors(bisection_, block.z, block.error);
            diamond_radii(bisection_, block.z, terrain.spacing_m, 0, block.radius);
            saturate(bisection_, block.z, terrain.spacing_m, block.error, block.radius);
            blocks_.push_back(std::move(block));
        }
}

glm::dvec3 RsgWorld::place(const RsgBlock& block, std::int32_t vertex) const {
    const int i = vertex % bisection_.row(), j = vertex / bisection_.row();
    return {terrain_.spacing_m * (block.i + i), -terrain_.spacing_m * (block.j + j),
            block.z[static_cast<std::size_t>(vertex)]};
}

bool RsgWorld::test_fails(const RsgBlock& block, std::int32_t vertex, const Camera& camera, RsgMetric metric,
                          double tau_px) const {
    const auto v = static_cast<std::size_t>(vertex);
    const VertexSight<double> sight = sight_of(camera.eye, place(block, vertex));
    if (metric == RsgMetric::local)
        return uc_selects(camera.focal_px() * static_cast<double>(block.delta[v]), tau_px, sight);
    const double error_px = camera.focal_px() * camera.off_axis_factor() * static_cast<double>(block.error[v]);
    return guaranteed_selects(error_px, static_cast<double>(block.radius[v]), kFloor, tau_px, sight);
}

void RsgWorld::select(const RsgBlock& block, const Camera& camera, RsgMetric metric, double tau_px,
                      BlockSelection& selection) const {
    selection.clear();
    const auto fails = [&](std::int32_t v) { return test_fails(block, v, camera, metric, tau_px); };
    if (metric == RsgMetric::local)
        selection.update(fails);
    else
        selection.refine(fails);
}

void RsgWorld::judge(const RsgBlock& block, const Camera& camera, const BlockSelection& selection,
                     PixelErrors& errors) const {
    const Frustum frustum(camera);
    std::vector<double> drawn(block.z.size());
    surface_heights(bisection_, selection.active(), block.z, drawn);
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(drawn.size()); ++v) {
        const glm::dvec3 truth = place(block, v);
        glm::dvec3 shown = truth;
        shown.z = drawn[static_cast<std::size_t>(v)];
        if (frustum.contains(truth) && frustum.contains(shown)) errors.add(screen_distance_px(camera, truth, shown));
    }
}

}  // namespace scree
