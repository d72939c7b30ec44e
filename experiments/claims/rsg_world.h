// The paper's own layout for the restricted square grid: blocks of 33 x 33 vertices that share nothing, strips one cell
// wide between them (Scree lod, sections 1 and 2).
#pragma once

#include <cstdint>
#include <vector>

#include "experiments/claims/sampling.h"
#include "experiments/claims/terrain.h"
#include "runtime/lod/block_selection.h"

namespace scree {

inline constexpr int kRsgBlock_log2 = 5;
inline constexpr int kRsgBlock = 1 << kRsgBlock_log2;

enum class RsgMetric {
    local,     ///< UC: a vertex by its own correction, as if on the optical axis
    saturated  ///< N*K: by the saturated exact error, off-axis factor and ball
};

struct RsgBlock {
    int i = 0, j = 0;  ///< of its north-west vertex
    Box box;
    std::vector<double> z;
    std::vector<float> delta, error, radius;
};

class RsgWorld {
public:
    explicit RsgWorld(const Terrain& terrain);

    const Terrain& terrain() const { return terrain_; }
    const Bisection& bisection() const { return bisection_; }
    int columns() const { return columns_; }
    int rows() const { return rows_; }
    const RsgBlock& block(int x, int y) const { return blocks_[static_cast<std::size_t>(y * columns_ + x)]; }
    const std::vector<RsgBlock>& blocks() const { return blocks_; }
    glm::dvec3 place(const RsgBlock& block, std::int32_t vertex) const;

    bool test_fails(const RsgBlock& block, std::int32_t vertex, const Camera& camera, RsgMetric metric,
                    double tau_px) const;
    void select(const RsgBlock& block, const Camera& camera, RsgMetric metric, double tau_px,
                BlockSelection& selection) const;
    /// Adds, of every vertex in view, the pixels between it and the surface that the selection makes.
    void judge(const RsgBlock& block, const Camera& camera, const BlockSelection& selection, PixelErrors& errors) const;

private:
    const Terrain& terrain_;
    Bisection bisection_;
    int columns_, rows_;
    std::vector<RsgBlock> blocks_;
};

}  // namespace scree
