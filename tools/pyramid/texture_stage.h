// The texture pyramid of a dataset, piece by piece (docs/resume-and-update.md): districts from the sources, the crown
// from the seeds.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "common/dataset.h"
#include "tools/mosaic/stack.h"
#include "tools/pyramid/bc1_encoder.h"
#include "tools/pyramid/height_index.h"
#include "tools/pyramid/texel_ground.h"
#include "tools/pyramid/tile_writer.h"

namespace scree {

/// Level of the seeds, which is that of the districts' roots; 0: one district, no crown and no seeds.
int seed_level(const Dataset& dataset);
/// The grid of the texel centres of the deepest level.
TargetGrid texel_grid(const Dataset& dataset);

struct TextureStageJob {
    Dataset dataset;  ///< heights known
    Lattice base;
    const HeightIndex* index = nullptr;
    HeightRowReader heights;
    ImageStack* imagery = nullptr;  ///< on texel_grid; null: a tint
    TileWriter* writer = nullptr;   ///< takes textures and seeds
    TextureQuality quality = TextureQuality::normal;
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
    /// Builds a rectangle of them and hands their seeds on. Imagery is asked for from north to south.
    Result<void> build_districts(std::int64_t first_column, std::int64_t first_row, std::int64_t columns,
                                 std::int64_t rows);
    /// After all districts that change.
    Result<void> build_crown();

    /// Bytes held, imagery aside, for so many texels side by side.
    static std::int64_t bytes_needed(const Dataset& dataset, std::int64_t texels_wide);

private:
    class Piece;
    Result<void> put_seeds(const class TexturePyramid& pyramid, std::int64_t first_column, std::int64_t first_row);
    Result<bool> read_seed(TileId id, TileRow& row);
    Result<void> load_seeds(std::int64_t y, std::int64_t columns, std::vector<std::uint8_t>& band,
                            std::vector<std::uint8_t>& stored);
    Result<void> sink(TileId id, std::vector<std::uint8_t> payload);

    TextureStageJob job_;
    TexelGround ground_;
};

}  // namespace scree
