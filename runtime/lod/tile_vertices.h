// TileVertices: the vertices of the tiles in height slots, as arrays that the tests of vertex selection run over, and
// the vertices that a tile selects for its own sake (docs/lod-methods.md). Frame-loop thread only.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "common/dataset.h"
#include "common/mesh/vertex_slot.h"
#include "runtime/lod/bisection.h"
#include "runtime/paging/tile_measure.h"

namespace scree {

/// Floor c of the metric max(h, c r) / r^2: reuse straight above a tile for a few triangles more (Scree lod, T3).
inline constexpr double kMetricFloor = 0.3;

/// A tile in a slot, and what the cut would draw it with.
struct TileShape {
    std::int32_t slot = 0;
    TileId tile;
    int geomip = 0;
    unsigned edge_mask = 0;
    float base_m = 0;  ///< greatest error of its own vertices: counts where curvature alone is missed. Flat: unused
};

/// An eye that sees a tile: f K of its camera, f where the metric is the paper's.
struct VertexEye {
    glm::dvec3 eye{0};
    double scale_px = 0;
};

class TileVertices {
public:
    /// `by_threshold`: choose() by a threshold is all that will be asked for.
    TileVertices(const Dataset& dataset, std::int64_t height_slots, bool by_threshold);

    void put(std::int32_t slot, std::span<const SlotVertex> vertices, std::span<const VertexCost> costs);
    double height_m(std::int32_t slot, std::int32_t vertex) const;

    std::size_t vertex_count() const { return vertices_; }
    const Bisection& bisection(TileId tile) const {
        return bisections_[static_cast<std::size_t>((tile.x + tile.y) & 1)];
    }

    // Each fills `active`, a byte a vertex: 1 for those selected and what they depend on, corners among them. Never
    // vertices below the shape's stride, nor those that its thinned edges lack.

    /// N*K for any of the eyes, or with `paper` the paper's test (flat earth).
    void choose(const TileShape& shape, std::span<const VertexEye> eyes, double tau_px, double half_curvature,
                bool paper, std::uint8_t* active);
    /// BSK: what costs more than `threshold_m`.
    void choose(const TileShape& shape, double threshold_m, double half_curvature, std::uint8_t* active);
    /// All vertices of a shape. True where the tile has most of them: then they are set.
    bool complete_if_dense(const TileShape& shape, std::uint8_t* active);

    static std::int64_t slot_cost(const Dataset& dataset, bool by_threshold);

private:
    /// Vertices that a tile of a stride with some edges thinned has, corners left out.
    const std::vector<std::uint8_t>& allowed(const TileShape& shape);
    const std::vector<float>& places(int level);
    void restrict_to(const TileShape& shape, std::uint8_t* active);
    void add_parents(const TileShape& shape, std::uint8_t* active) const;
    const float* errors(std::int32_t slot);
    /// Errors with what flat triangles miss of the earth's curvature, in errors_.
    const float* curved_errors(const TileShape& shape, double half_curvature);
    std::size_t at(std::int32_t slot) const { return static_cast<std::size_t>(slot) * vertices_; }
    double spacing_m(TileId tile) const;

    Lattice lattice_;
    double offset_m_, quantum_m_;
    int n_, m_;
    std::size_t vertices_;
    bool by_threshold_;
    std::array<Bisection, 2> bisections_;
    // By slot, an entry a vertex, in two bytes each: height over the slot's middle, in its steps, and costs, rounded up
    // (upper halves of floats). Where one threshold decides, neither places nor radii.
    std::vector<std::int16_t> z_;
    std::vector<std::uint16_t> error_, radius_;
    std::vector<double> middle_m_;                 ///< by slot
    std::vector<float> step_m_;                    ///< by slot
    std::vector<float> z_m_, error_m_, radius_m_;  ///< buffers: of one tile
    std::vector<float> bulge_;                     ///< by vertex: half of its hypotenuse, squared, samples
    std::vector<float> errors_;                    ///< a buffer: with curvature
    std::vector<std::uint8_t> fails_;
    std::vector<std::vector<float>> places_;  ///< by level: x of all vertices from the tile's middle, then y; metres
    std::map<std::pair<int, unsigned>, std::vector<std::uint8_t>> allowed_;
};

}  // namespace scree
