// GeoMip blocks over a terrain, sharing their edges: 2^n cells a side, levels 0 .. n - 1, neighbours kept within one
// level of each other, the finer side's edges thinned (DB; Scree lod, section 3).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "experiments/claims/sampling.h"
#include "experiments/claims/terrain.h"

namespace scree {

inline constexpr std::size_t kGeomipLevels = 6;

struct GeomipBlock {
    int i = 0, j = 0;  ///< of its north-west vertex
    Box box;
    std::vector<std::int32_t> heights_n;
    /// By level, metres. [n] is one cell, which is measured but not drawn.
    std::array<double, kGeomipLevels> error{};  ///< against level 0, edges whole
    std::array<double, kGeomipLevels> step{};   ///< against the level before
    std::array<double, kGeomipLevels> bands{};  ///< against level 0, any edges thinned
};

/// What decides a block's level.
struct GeomipMetric {
    enum class Delta { error, step, bands } delta = Delta::bands;
    bool to_box = true;    ///< false: distance to the block's centre
    bool off_axis = true;  ///< with K
    double tau_px = 1;
};

struct GeomipDrawn {
    int level = 0;
    unsigned thinned = 0;  ///< EdgeMask
    double distance_m = 0;
};

class GeomipWorld {
public:
    GeomipWorld(const Terrain& terrain, int cells_log2);

    const Terrain& terrain() const { return terrain_; }
    int cells_log2() const { return n_; }
    int columns() const { return columns_; }
    int rows() const { return rows_; }
    const std::vector<GeomipBlock>& blocks() const { return blocks_; }
    const GeomipBlock& block(int x, int y) const { return blocks_[index(x, y)]; }
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
    }

    /// f delta / tau for each level; never falling but by `step`.
    std::vector<double> distances(const GeomipBlock& block, const Camera& camera, const GeomipMetric& metric) const;
    /// By index: the last level whose distance is passed, then neighbours within one level.
    std::vector<GeomipDrawn> select(const Camera& camera, const GeomipMetric& metric) const;
    /// Adds, of every vertex in view, the pixels between it and the block as drawn.
    void judge(const GeomipBlock& block, const GeomipDrawn& drawn, const Camera& camera, PixelErrors& errors) const;
    /// Greatest error of a block as drawn, each vertex looked at straight: no off-axis share in it.
    double error_on_axis_px(const GeomipBlock& block, const GeomipDrawn& drawn, const glm::dvec3& eye,
                            double focal_px) const;
    std::int64_t triangles(const GeomipDrawn& drawn) const;

private:
    glm::dvec3 place(const GeomipBlock& block, int u, int v) const;
    void measure(GeomipBlock& block) const;

    const Terrain& terrain_;
    int n_, columns_, rows_;
    std::vector<GeomipBlock> blocks_;
};

}  // namespace scree
