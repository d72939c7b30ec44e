// BuildPlan: everything decided before the first pixel is read: lattice, levels, memory and disk.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/dataset.h"
#include "common/result.h"
#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"
#include "tools/mosaic/mosaic_plan.h"
#include "tools/pyramid/bc1_encoder.h"
#include "tools/pyramid/coverage.h"
#include "tools/pyramid/texture_depth.h"
#include "tools/pyramid/void_fill.h"

namespace scree {

inline constexpr std::int64_t kMinMemoryBytes = std::int64_t{192} << 20;

/// What bears on the bytes of a store must stand in the table of build_record.cpp, too: resuming and updates go by it.
struct BuildOptions : HeightReading {
    std::vector<std::string> dems;    ///< files and folders; later ones lie on top
    std::vector<std::string> images;  ///< the same; none: a tint made from the heights
    std::string out;
    std::optional<std::string> crs;         ///< the dataset's; none: chosen
    std::optional<std::string> assume_crs;  ///< of files that name none
    bool assume_same_datum = false;
    Kernel kernel = Kernel::bilinear;  ///< where samples are not lattice points
    ColourReading colours;
    FillRule fill;  ///< of interior voids; a value in metres
    std::optional<double> height_quantum_m;
    HeightCodec height_codec = HeightCodec::plane;
    int tile_size = 33;
    int texture_size = 256;
    TextureCodec texture_codec = TextureCodec::split;
    TextureQuality texture_quality = TextureQuality::normal;  ///< high: DXT1 takes ten to twenty times as long
    int threads = 0;                                          ///< 0: all cores
    std::int64_t memory_bytes = std::int64_t{256} << 20;      ///< ceiling of the process's resident memory
    std::string attribution;
    bool force = false;
    bool quiet = false;
};

/// The last two hexadecimal digits of SourceRecord::layer: which sides of a file are sides of its layer, and whether
/// they run north and east in the dataset's CRS.
inline constexpr unsigned kWestSide = 1, kNorthSide = 2, kEastSide = 4, kSouthSide = 8, kStraight = 16;

struct BuildPlan {
    explicit BuildPlan(MosaicPlan m) : mosaic(std::move(m)) {}

    MosaicPlan mosaic;
    OpenOptions open;  ///< how files are opened
    /// One DEM whose rows are the lattice's rows: it is read straight through, without a copy on disk.
    bool heights_in_place = false;
    bool integer_heights = false;           ///< every height is an integer of the file's, nothing is resampled
    bool wide_heights = false;              ///< values do not fit float32
    Dataset dataset;                        ///< lattice, CRS, texture depth; heights still unknown
    Coverage coverage;                      ///< of the dense part by the files with heights
    TextureDepth textures;                  ///< which of their tiles are refined
    std::vector<int> image_level;           ///< of each image: the texture level that it asks for
    std::int64_t deep_texels_wide = 0;      ///< where textures go deeper, so many are made side by side
    std::int64_t memory_bytes = 0;          ///< estimate of the peak
    std::int64_t temporary_bytes = 0;       ///< disk, during the build
    std::int64_t store_bytes_estimate = 0;  ///< an upper figure
};

/// Errors: those of plan_mosaic; ErrorCode::usage for options that make no sense together or a memory ceiling below
/// what the widths need.
Result<BuildPlan> plan_build(const BuildOptions& options);

}  // namespace scree
