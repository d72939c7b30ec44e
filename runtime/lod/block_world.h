// BlockWorld: the layout of Ueng & Chuang. A raster as blocks of 33 x 33 vertices that share nothing (stride 33), each
// with its own selection and, with a cache, the eye that it was made for; strips and corner quads (dike.h) between
// them. What the paper leaves open or gets wrong is as in Scree lod, sections 1 and 2. Over a curved earth what flat
// triangles miss of it counts as an error as well.
//
// A frame: blocks in view by box; each is reused if the reuse test allows, else selected anew; a mesh is made again
// only where the selection changed, a strip only where one of its sides did. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "runtime/lod/bisection.h"
#include "runtime/lod/dike.h"
#include "runtime/lod/height_raster.h"
#include "runtime/lod/lod_method.h"
#include "runtime/lod/reuse.h"
#include "runtime/lod/triangle_walk.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"

namespace scree {

enum class BlockMetric {
    uc,          ///< local corrections, on the axis: no bound
    nested,      ///< N*: saturated exact errors, on the axis; K tau off it
    guaranteed,  ///< N*K: the surface is within tau
    by_block     ///< BSK: as guaranteed, by the distance to the block's box
};

/// How a frame is chosen.
struct BlockRules {
    BlockMetric metric = BlockMetric::guaranteed;
    double tau_px = 1;
    ReuseTest reuse = ReuseTest::off;
    double s_px = 0;
    bool each_corner = false;  ///< ReuseTest::paper: P2 instead of P1
    /// c of max(h, c r) (nested, guaranteed): larger reuses more under a steep eye, and draws more triangles.
    double floor = 0.3;
    Culling culling = Culling::box;
    double half_curvature = 0;  ///< 1 / (2 R), 1/m; uc chooses as if it were 0

    friend bool operator==(const BlockRules&, const BlockRules&) = default;
};
BlockRules block_rules(const LodSettings& settings, double tau_px);

struct BlockWorldOptions {
    int cells_log2 = 5;      ///< of a block, 1 to 5
    bool dike_aware = true;  ///< count what a strip can err (uc has no use for it); without, nothing bounds the strips
};

/// Valid until the next select().
struct BlockFrame {
    std::span<const std::int32_t> blocks, strips, quads;  ///< drawn
    int reused = 0;                                       ///< blocks that the reuse test spared a selection
    int regenerated = 0;                                  ///< blocks selected anew
    int meshes_made = 0;                                  ///< of these, those whose selection changed
    int strips_made = 0;
    std::int64_t block_triangles = 0, dike_triangles = 0;
    double lod_ms = 0;  ///< CPU time of the calling thread in select()

    std::int64_t triangles() const { return block_triangles + dike_triangles; }
};

class BlockWorld {
public:
    /// Memory for each sample of the raster: its height, four floats of the two metrics, a flag, and what the mesh
    /// takes where everything is drawn (6 indices of 4 bytes and a strip's share).
    static constexpr std::int64_t kBytesPerSample = 8 + 16 + 1 + 26;

    /// Crops to whole blocks from the north-west corner: dropped_columns() and dropped_rows() say by how much. Errors:
    /// ErrorCode::usage where not even one block fits, and for more than 2^31 samples; ErrorCode::input for a height
    /// that is no finite number.
    static Result<BlockWorld> make(const HeightRaster& raster, const BlockWorldOptions& options = {},
                                   const LoadProgress& progress = {});

    const BlockFrame& select(const Camera& camera, const BlockRules& rules);

    /// Every block is selected anew when next in view, as after a leap.
    void forget() { ++generation_; }

    int columns() const { return columns_; }
    int rows() const { return rows_; }
    int block_count() const { return columns_ * rows_; }
    int strip_count() const { return static_cast<int>(strips_.size()); }
    int quad_count() const { return static_cast<int>(quads_.size() / 6); }
    std::int64_t dropped_columns() const { return dropped_columns_; }
    std::int64_t dropped_rows() const { return dropped_rows_; }
    double spacing_m() const { return spacing_m_; }
    const Bisection& bisection() const { return *bisection_; }
    /// What full resolution draws: 2 (samples - 1)^2 for a square raster.
    std::int64_t complete_triangles() const;

    /// Vertices are numbered block by block; a block's as in its Bisection.
    std::uint32_t vertices_per_block() const { return static_cast<std::uint32_t>(bisection_->vertex_count()); }
    std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(z_.size()); }
    /// In the dataset's metres.
    glm::dvec3 position(std::uint32_t vertex) const;
    /// Metres, of the vertices of a block.
    std::span<const double> heights(int block) const;
    const Box& box(int block) const { return blocks_[static_cast<std::size_t>(block)].box; }

    /// Triangles, counter-clockwise from above, three vertices each; meaningful for what select() has drawn. The
    /// versions grow with every change.
    std::span<const std::uint32_t> mesh(int block) const { return blocks_[static_cast<std::size_t>(block)].mesh; }
    std::span<const std::uint32_t> strip_mesh(int strip) const { return strips_[static_cast<std::size_t>(strip)].mesh; }
    std::span<const std::uint32_t> quad_mesh(int quad) const {
        return std::span(quads_).subspan(static_cast<std::size_t>(quad) * 6, 6);
    }
    std::uint32_t mesh_version(int block) const { return blocks_[static_cast<std::size_t>(block)].version; }
    std::uint32_t strip_version(int strip) const { return strips_[static_cast<std::size_t>(strip)].version; }

    // For judging frames.
    std::span<const std::uint8_t> active(int block) const;
    /// In the last frame that it was drawn in.
    bool was_reused(int block) const { return blocks_[static_cast<std::size_t>(block)].reused; }
    /// What a block would select for this eye with no cache: parents of selected vertices included.
    void select_anew(int block, const Camera& camera, const BlockRules& rules, std::span<std::uint8_t> active) const;
    /// Of a vertex of the block: the paper's local correction; the saturated error. Metres.
    float local_correction_m(int block, std::int32_t vertex) const;
    float saturated_error_m(int block, std::int32_t vertex) const;
    /// The sides of a strip: A, its block and B. Parameter y of A is vertex side_vertex(lie, false, y) of its block.
    struct StripSides {
        DikeLie lie;
        int a, b;
    };
    StripSides sides(int strip) const;
    std::int32_t side_vertex(DikeLie lie, bool on_b, std::int32_t y) const;

private:
    struct Chosen {
        glm::dvec3 eye{0};
        EyeToBox to_box;
        std::uint64_t generation = 0;  ///< of the rules; 0: never
    };
    struct Block {
        Box box;        ///< of its vertices
        Box reach_box;  ///< and a cell around it: its dikes as well
        glm::dvec3 middle{0};
        Chosen chosen;
        std::array<std::uint64_t, 4> sides{};  ///< active vertices: west, east, north, south
        std::uint32_t version = 0;
        std::uint32_t seen_in_frame = 0;
        bool reused = false;
        std::vector<std::uint32_t> mesh;
    };
    struct Strip {
        std::uint64_t a_side = 0, b_side = 0;  ///< what it was made from
        std::uint32_t version = 0;
        std::vector<std::uint32_t> mesh;
    };
    struct LevelMaxima {
        float delta = 0, error = 0, radius = 0;
    };

    BlockWorld() = default;
    void make_tables();
    void make_block(const HeightRaster& raster, int block);
    void bound_errors(int block);
    void count_dike(DikeLie lie, int a, int b, bool on_b, std::span<float> error, std::span<float> radius) const;
    void make_groups();
    void make_dikes();

    std::size_t order_index(int block) const { return static_cast<std::size_t>(block) * order_size_; }
    const Box& bound_box(const Block& block) const { return dike_aware_ ? block.reach_box : block.box; }
    std::array<glm::dvec3, 4> corners(int block) const;

    /// What the tests need of a camera and rules.
    struct Sighting {
        Sighting(const Camera& camera, const BlockRules& block_rules);
        glm::dvec3 eye;
        double focal_px, off_axis;
        BlockRules rules;
    };
    bool test_level(int block, int level, const Sighting& s, double distance_m, std::uint8_t* fails) const;
    void choose(int block, const Sighting& sighting, std::uint8_t* active) const;
    bool may_reuse(int block, const EyeToBox& now, const glm::dvec3& eye) const;
    EyeToBox eye_to(int block, const glm::dvec3& eye) const;
    void regenerate(int block, const Sighting& sighting);
    void make_mesh(int block);
    void take_sides(int block);
    bool is_visible(const Frustum& frustum, const glm::dvec3& eye, int block) const;
    void find_visible(const Camera& camera);
    void gather_dikes();
    void draw_strip(int strip);
    void make_strip(Strip& strip, DikeLie lie, int a, int b) const;

    std::unique_ptr<Bisection> bisection_;
    int columns_ = 0, rows_ = 0;
    std::int64_t dropped_columns_ = 0, dropped_rows_ = 0;
    double west_m_ = 0, north_m_ = 0, spacing_m_ = 1;
    bool dike_aware_ = true;

    // Tables of a block, in coarse_to_fine() order: place relative to the block's middle, vertex, parents (order_size_
    // stands for a corner or none).
    std::size_t order_size_ = 0;
    std::vector<float> x_, y_;
    std::vector<std::uint16_t> vertex_of_, parent_0_, parent_1_, order_of_;
    std::vector<std::size_t> first_of_level_;
    std::vector<double> bulge_m2_;  ///< by level: what curvature bends by within a triangle split there, over 1 / (2 R)
    std::unique_ptr<TriangleWalk> walk_;

    std::vector<double> z_;                                ///< by vertex
    std::vector<float> local_z_, delta_, error_, radius_;  ///< by block and order
    std::vector<LevelMaxima> maxima_;                      ///< by block and level
    std::vector<std::uint8_t> active_;                     ///< by block; a vertex more, never active
    std::vector<Block> blocks_;
    std::vector<Box> group_boxes_;  ///< of kGroup x kGroup blocks
    int group_columns_ = 0;
    std::vector<Strip> strips_;
    std::vector<std::uint32_t> quads_;

    BlockRules rules_;
    double focal_px_ = 0, off_axis_ = 0;
    std::uint64_t generation_ = 0;
    std::uint32_t frame_number_ = 0;
    BlockFrame frame_;
    std::vector<std::int32_t> seen_blocks_, seen_strips_, seen_quads_;
    std::vector<std::uint32_t> scratch_;
};

}  // namespace scree
