// From what a user typed to one lattice: which files, in which CRS, on which points. Headers are read, pixels are not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/lattice.h"
#include "common/result.h"
#include "tools/mosaic/layer.h"
#include "tools/mosaic/stack.h"

namespace scree {

struct MosaicRequest {
    std::vector<std::string> heights;  ///< files and folders; later ones lie on top
    std::vector<std::string> imagery;
    std::optional<std::string> crs;         ///< the dataset's; none: chosen (choose_crs)
    std::optional<std::string> assume_crs;  ///< of files that name none
    HeightReading reading;
    bool assume_same_datum = false;
    OpenOptions open;
    int tile_cells_log2 = 5;
};

struct MosaicPlan {
    explicit MosaicPlan(Crs any) : crs(std::move(any)) {}

    std::vector<PlacedFile> heights, imagery;
    std::vector<Layer> height_layers, image_layers;
    Crs crs;
    bool crs_known = false;                ///< false: files without any CRS, metres of their own
    std::string crs_reason;                ///< one line for people; empty where there was nothing to choose
    std::string vertical_datum;            ///< "EPSG:n" or empty
    std::vector<std::string> conversions;  ///< of heights to that datum, one sentence each
    ScaleRange scale;                      ///< of the CRS over the heights
    LonLatBox box;                         ///< of the heights, where the CRS is known
    Lattice lattice;                       ///< of the finest layer
    /// Everything is built densely at every 2^base_shift-th point; finer layers deepen their own branches.
    int base_shift = 0;
    std::vector<int> layer_level;  ///< of each height layer: the coarsest level that loses nothing of it
    bool heights_copied = false;   ///< every height sample is a lattice point: nothing is resampled
    bool same_units = false;       ///< one scale and offset for all files and no conversion: raw values may be kept
    std::vector<double> pixel_m;   ///< of each image, at its middle: the smaller side
    std::vector<std::string> warnings;

    Lattice base_lattice() const;
    TargetGrid finest_grid() const { return {lattice.origin_x_m, lattice.origin_y_m, lattice.spacing_m}; }
};

/// Errors: ErrorCode::input for files that cannot be placed, do not meet, or contradict each other; ErrorCode::usage
/// for options that do.
Result<MosaicPlan> plan_mosaic(const MosaicRequest& request);

}  // namespace scree
