// Dataset: what a store says of itself. Stored as one JSON row (docs/store-format.md); everything read from it is
// checked.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/geo_grid.h"
#include "common/lattice.h"
#include "common/result.h"

namespace scree {

inline constexpr int kFormatVersion = 1;

struct SourceRecord {
    std::string name;  ///< file name without folders
    std::string role;  ///< "heights" or "imagery"
    std::int64_t bytes = 0;
    std::int64_t width = 0;
    std::int64_t height = 0;
    /// 16 hexadecimal digits (docs/store-format.md, "Dataset"); empty in stores that were made without.
    std::string fingerprint{};
    /// West, south, east, north of its samples in the dataset's CRS, and what tells the grid that its samples are
    /// counted in from another one. For updates; stores that were made without have neither.
    std::optional<std::array<double, 4>> box_m{};
    std::string layer{};
    /// Of the files beside it that say what it does not: names, and fingerprints.
    std::map<std::string, std::string> sidecars{};
};

struct Dataset {
    Lattice lattice;
    std::string crs;             ///< "EPSG:n" or empty
    std::string crs_name;        ///< for people
    std::string vertical_datum;  ///< "EPSG:n" or empty

    double height_offset_m = 0;  ///< z = offset + n * quantum
    double height_quantum_m = 1;
    double height_quantum_error_m = 0;  ///< 0 when every source height is a multiple of the quantum
    double warp_error_m = 0;            ///< stated apart: a store cannot see it
    double min_height_m = 0;            ///< over valid source samples
    double max_height_m = 0;

    /// Level of the coarsest leaf where it is not the lattice's deepest: the heights' depth varies by place.
    std::optional<int> coarsest_leaf_level;

    int texture_size_log2 = 8;
    int texture_deepest_level = 0;
    /// Level of the coarsest textures that are not refined, where that is not the deepest one: their depth varies by
    /// place.
    std::optional<int> coarsest_texture_level;
    bool has_imagery = false;  ///< false: a tint made from the heights

    std::int64_t height_tiles = 0;
    std::int64_t texture_tiles = 0;
    std::int64_t present_cells = 0;  ///< cells of leaves, each of its own size, whose four samples were valid

    std::vector<SourceRecord> sources;  ///< bottom to top where they overlap
    std::string attribution;
    /// The options that it was built with, by their names on the command line: an update goes on with them.
    std::map<std::string, std::string> options;

    /// Longitude and latitude; none in stores without a CRS, or made before there was one.
    std::optional<GeoGrid> geo_grid{};

    /// How many times as high as they are the heights above are given (SqliteStore's StoreOptions): what is in metres
    /// of height here, divided by it, is what the ground has. Not of the store, and not written.
    double exaggeration = 1;

    int texture_size() const { return 1 << texture_size_log2; }
    /// Metres along the side of a texel of texture level `level`.
    double texel_m(int level) const;
    /// Largest of height and texture depth.
    int deepest_level() const;
    /// Level of the coarsest leaf of the heights.
    int least_leaf_level() const { return coarsest_leaf_level.value_or(lattice.deepest_level); }
    /// Level down to which every texture is refined.
    int least_texture_level() const { return coarsest_texture_level.value_or(texture_deepest_level); }
    double height_m(double n) const { return height_offset_m + n * height_quantum_m; }

    /// Heights, their quantum and their errors times `factor`: all that is in metres of height. Errors:
    /// ErrorCode::usage where it is not 0.01..100, or the heights would not be usable.
    Result<void> exaggerate(double factor);

    Result<void> check() const;
};

/// Deterministic JSON text (keys in fixed order, shortest round-trip numbers).
std::string dataset_to_json(const Dataset& dataset);
/// Errors: ErrorCode::store; the message names the field.
Result<Dataset> dataset_from_json(const std::string& text);

}  // namespace scree
