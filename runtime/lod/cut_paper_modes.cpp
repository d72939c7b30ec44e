// The cut by the papers' own choices: de Boer's metric and Ke et al.'s culling (docs/lod-methods.md).
#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/lod/cut.h"

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// By how much the certified error grows from the stride before to this one, geomip >= 1. A leaf's own samples are the
/// finest surface, and its error before that is 0.
float growth_n(const HeightBounds& bounds, std::size_t geomip, bool leaf) {
    const float finer_n = leaf && geomip == 1 ? 0 : bounds.error_n[geomip - 1];
    return std::max(0.0f, bounds.error_n[geomip] - finer_n);
}

}  // namespace

// De Boer: the last level whose distance is passed, whatever the levels before it are like; then the linear morph
// towards the next. Steps need not grow from level to level: where they do not, levels hand over in a jump.
void Cut::judge_by_corrections(CutNode& node) const {
    const int finest = minimum_exponent(node);
    const double allowed_m = settings_.tau_px * node.metres_per_px;
    node.finest_error_m = correction_m(node, 0);
    double coarser_m = kInfinity;
    for (int geomip = lattice_.tile_cells_log2 - 1; geomip >= 0; --geomip) {
        const double step_m = geomip > 0 ? correction_m(node, geomip) : node.finest_error_m;
        if (step_m <= allowed_m) {
            // The coarsest stride has none to morph to.
            const double share = std::isinf(coarser_m) ? 0 : (allowed_m - step_m) / (coarser_m - step_m);
            node.level = level_of(finest + geomip) + std::min(level_of_share(share), kOneLevel - 1);
            return;
        }
        coarser_m = step_m;
    }
    node.level = level_of(finest);
    node.wants_geometry = !node.leaf;
}

// What a stride misses of the next finer one. Of a resident tile, but for its densest mesh, its samples say. What its
// children will add to that, and what a tile that is to come is like, headers tell by how much certified errors grow.
double Cut::correction_m(const CutNode& node, int geomip) const {
    const auto g = static_cast<std::size_t>(geomip);
    const std::vector<LevelCorrections>& known = residency_->heights.corrections;
    double error_n = 0;
    if (geomip == 0)
        error_n = correction_below_n(node);
    else if (node.slot >= 0 && !known.empty())
        error_n = static_cast<double>(known[static_cast<std::size_t>(node.slot)][g]);
    else
        error_n = static_cast<double>(growth_n(*node.bounds, g, node.leaf));
    return error_n * dataset_.height_quantum_m + curving_m_[static_cast<std::size_t>(minimum_exponent(node) + geomip)];
}

double Cut::correction_below_n(const CutNode& node) const {
    if (node.leaf) return 0;
    if (node.slot < 0) return static_cast<double>(std::min(node.bounds->error_n[0], growth_n(*node.bounds, 1, false)));
    const HeightTileHeader& header = residency_->heights.headers[static_cast<std::size_t>(node.slot)];
    float greatest = 0;
    for (std::size_t q = 0; q < 4; ++q)
        if ((header.child_mask >> q & 1) != 0)
            greatest = std::max(greatest, growth_n(header.children[q], 1, known_child(node, q).leaf));
    return static_cast<double>(greatest);
}

double Cut::certain_metres_per_px(const CutNode& node) const {
    if (settings_.metric != ErrorMetric::deboer) return node.metres_per_px;
    double least = kInfinity;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        if ((node.seen_by >> v & 1) == 0) continue;
        const LodView& view = views_[v];
        const Box box = lowered_by_curvature(box_of(node), view.eye, settings_.half_curvature);
        least = std::min(least, std::max(distance_to_box(view.eye, box), view.near_m) / view.error_px);
    }
    return least;
}

bool Cut::corner_in_view(const CutNode& node, const LodView& view) const {
    const Box box = box_of(node);
    for (int k = 0; k < 4; ++k) {
        glm::dvec3 corner{k % 2 == 0 ? box.low.x : box.high.x, k / 2 == 0 ? box.low.y : box.high.y,
                          0.5 * (box.low.z + box.high.z)};
        const double x = corner.x - view.eye.x, y = corner.y - view.eye.y;
        corner.z -= (x * x + y * y) * settings_.half_curvature;
        if (view.frustum.contains(corner)) return true;
    }
    return false;
}

}  // namespace scree
