// The texture pyramid of a dataset, piece by piece (docs/resume-and-update.md): districts from the sources, the crown
// from the seeds.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/dataset.h"
#include "common/store/texture_codec.h"
#include "tools/pyramid/bc1_encoder.h"
#include "tools/pyramid/height_index.h"
#include "tools/pyramid/level_imagery.h"
#include "tools/pyramid/texel_ground.h"
#include "tools/pyramid/texture_depth.h"
#include "tools/pyramid/tile_writer.h"

namespace scree {

/// Level of the districts' roots, of which every tile has a seed; 0: one district, no crown and no seeds of it.
int seed_level(const Dataset& dataset);
struct TextureStageJob {
    Dataset dataset;  ///< heights known
    Lattice base;
    const HeightIndex* index = nullptr;
    HeightRowReader heights;
    const TextureDepth* depth = nullptr;
    const LevelImagery* imagery = nullptr;  ///< null: a tint
    std::int64_t deep_texels_wide = 0;      ///< BuildPlan::deep_texels_wide
    /// Which deep districts build_deep_row() makes. Null: all. Others have their seeds, if they show anything.
    std::function<bool(TileId id)> deep_wanted;
    TileWriter* writer = nullptr;  ///< takes textures and seeds
    TextureQuality quality = TextureQuality::normal;
    TextureCodec codec = TextureCodec::split;
    /// Finds seeds that the writer does not have (those of districts that are not built again). Null: none.
    std::function<Result<bool>(std::int64_t key, TileRow& row)> other_seeds;
    std::function<void(std::int64_t texels)> on_texels;
    const std::atomic<bool>* stop = nullptr;
};

class TextureStage {
public:
    explicit TextureStage(TextureStageJob job);

    /// Districts: tiles of seed_level over the data's extent.
    std::int64_t district_columns() const;
    std::int64_t district_rows() const;
    /// Deep districts are what lies under seeded tiles of the textures' coarsest level (TextureDepth::seeded): rows of
    /// such tiles, and whether one holds any. Before the district that they lie in.
    std::int64_t deep_rows() const;
    bool has_deep(std::int64_t row) const;
    Result<void> build_deep_row(std::int64_t row);
    /// Builds a rectangle of districts and hands their seeds on. Imagery is asked for from north to south.
    Result<void> build_districts(std::int64_t first_column, std::int64_t first_row, std::int64_t columns,
                                 std::int64_t rows);
    /// After all districts that change.
    Result<void> build_crown();

    /// Bytes held, imagery aside, for so many texels side by side.
    static std::int64_t bytes_needed(const Dataset& dataset, std::int64_t texels_wide);
    /// The least deep_texels_wide.
    static std::int64_t least_deep_texels(const Dataset& dataset);

private:
    struct Rectangle;
    class Piece;
    Result<std::unique_ptr<class TexturePyramid>> build_piece(const Rectangle& piece);
    Result<void> build_district_run(const TextureDepth::Run& run, std::int64_t y);
    Result<void> build_run(int level, std::int64_t row, TextureDepth::Run run,
                           const std::function<Result<void>(const TexturePyramid& pyramid, std::int64_t first_column,
                                                            std::int64_t columns)>& use);
    Result<void> put_seed(const TexturePyramid& pyramid, TileId id, std::int64_t column, std::int64_t row);
    bool has_heights(TileId id) const;
    TexelGround& ground(int level) { return *grounds_[static_cast<std::size_t>(level - coarsest_)]; }
    Result<bool> read_seed(TileId id, TileRow& row);
    Result<void> load_seeds(std::int64_t y, std::int64_t columns, std::vector<std::uint8_t>& band,
                            std::vector<std::uint8_t>& stored);
    Result<void> sink(TileId id, std::vector<std::uint8_t> payload);

    TextureStageJob job_;
    int coarsest_;                                       // level of the textures
    std::vector<std::unique_ptr<TexelGround>> grounds_;  // from the coarsest level on
};

}  // namespace scree
