// Depth first over both pyramids with the ancestors of the current tile on a stack: what a tile promises is compared
// with its neighbours, its parent and the finest data under it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/store/tile_store.h"
#include "common/texture_tile.h"
#include "tools/verify/alpha_pyramid.h"
#include "tools/verify/height_cache.h"
#include "tools/verify/problem_list.h"
#include "tools/verify/surface_error.h"
#include "tools/verify/verify.h"

namespace scree {

/// One thread, one use. Memory: per level one height tile and one alpha raster, and the height cache.
class TileWalk {
public:
    /// `tick` is called once a row; false stops the walk.
    TileWalk(const Dataset& dataset, TileReader& reader, VerifyReport& report, ProblemList& problems,
             std::function<bool()> tick);

    /// Errors: ErrorCode::io, ErrorCode::interrupted.
    Result<void> run();

    std::int64_t height_rows() const { return height_rows_; }  ///< rows that parents lead to and that exist
    std::int64_t texture_rows() const { return texture_rows_; }

private:
    struct TextureRow {
        bool exists = false;
        std::optional<TextureTile> tile;  // nothing: missing or damaged
    };

    struct Frame {
        TileId id;
        std::shared_ptr<const HeightTile> tile;
        std::array<std::int32_t, 9> block{};  // the coarsest surface
        std::int64_t stride = 1;              // of that block, finest cells
        std::int64_t worst = 0;               // its true error, times 2 * stride
        bool complete = true;                 // every tile below could be read
        bool textured = false;                // textures do not end above it
        AlphaRaster alpha{0};                 // if so
        std::uint8_t texture_children = 0;
    };

    void visit_roots();
    bool visit(TileId id);
    bool is_leaf(const Frame& frame) const;
    void check_header(const Frame& frame, const Frame* parent);
    void check_texture_end(const Frame& frame);
    void check_range(const Frame& frame);
    void compare_with_parent(const Frame& frame, const Frame& parent);
    void compare_with_neighbours(const Frame& frame);
    void check_grading(const Frame& frame);
    std::optional<TileId> leaf_over(TileId id);
    void compare_border(const Frame& frame, TileId neighbour, int from_i, int from_j, int step_i, int step_j, int count,
                        int across_i, int across_j);
    void visit_leaf(Frame& frame);
    void mark_leaf(Frame& frame, const CellPresence& presence);
    void check_coarsest_bound(const Frame& frame);
    void count_bound(TileId id, int geomip, const ExactError& truth, float stored);
    void finish_dataset();

    void check_texture(const Frame& frame);
    TextureRow read_texture(TileId id);
    /// The texture of a frame has children: the heights say so.
    bool refined(const Frame& frame) const {
        return frame.textured && frame.id.level < dataset_.texture_deepest_level && !frame.tile->header.texture_ends;
    }
    void judge_texture(TileId id, const TextureRow& row, std::uint8_t child_mask, const AlphaRaster* alpha);
    std::uint8_t visit_texture_children(TileId id, const CellPresence& presence, AlphaRaster& alpha, bool& complete);
    bool visit_texture_below(TileId id, const CellPresence& presence, AlphaRaster& alpha);
    bool any_opaque(TileId id, const CellPresence& presence) const;

    /// A damaged row becomes a problem, any other error stops the walk.
    void take_error(const char* kind, TileId id, const Error& error);
    void tick_row();

    const Dataset& dataset_;
    const Lattice& lattice_;
    TileReader& reader_;
    VerifyReport& report_;
    ProblemList& problems_;
    std::function<bool()> tick_;
    HeightCache heights_;
    TileRow texture_row_;
    std::vector<std::unique_ptr<Frame>> frames_;
    std::optional<Error> failure_;
    std::int64_t height_rows_ = 0, texture_rows_ = 0;
    std::int64_t present_cells_ = 0;
    int coarsest_leaf_ = kMaxLevel + 1;
    int coarsest_texture_end_ = kMaxLevel + 1;
    std::int32_t lowest_n_ = kMaxHeightUnits, highest_n_ = -kMaxHeightUnits;
    bool all_read_ = true;
};

}  // namespace scree
