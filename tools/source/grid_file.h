// The DEM formats that are read by our own code rather than by an image library, in the program itself;
// raster_formats.h lists them. Every reader checks what a header claims against the size of the file before anything is
// allocated. One thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/result.h"
#include "tools/source/byte_file.h"
#include "tools/source/georeference.h"
#include "tools/source/pixel_decoder.h"

namespace scree {

struct GridFile {
    std::unique_ptr<PixelDecoder> decoder;
    std::int64_t rows_per_unit = 1;     ///< rows that are decoded together
    std::optional<std::string> nodata;  ///< as the file writes it; nodata_as makes it a sample
    std::optional<Georeference> georeference;
};

/// nullopt for a file of none of these kinds.
/// Errors: ErrorCode::input, naming file, value and consequence.
Result<std::optional<GridFile>> open_grid_file(const std::string& path);

// One reader each; errors as above.

/// SRTM: NxxWyyy in the name is the south-west corner; big-endian int16, void -32768, heights above EGM96.
/// Source: SRTM documentation, "SRTM_Topo" (NASA/USGS), sections 2 and 3.
Result<GridFile> open_hgt(ByteFile file);

/// Source: ArcGIS documentation, "Esri ASCII raster format". Samples are int32 where the whole file holds integers of
/// at most nine digits (one pass over the bytes, which ends at the first fraction), else float64.
Result<GridFile> open_ascii_grid(ByteFile file);
bool looks_like_ascii_grid(std::string_view start);

/// Sources: ArcGIS documentation, "BIL, BIP, and BSQ raster files", "Float to Raster"; ENVI documentation, "ENVI header
/// files". The header is the text that stands beside the file.
Result<GridFile> open_raw_grid(ByteFile file);

/// Source: MIL-PRF-89020B, section 3.
Result<GridFile> open_dted(ByteFile file);
bool looks_like_dted(std::string_view start);

/// Source: USGS, "Standards for Digital Elevation Models", part 2 (1998), data elements of records A and B. The grid is
/// the box of all profiles; its samples are int32 where heights are whole units, else float.
Result<GridFile> open_usgs_dem(ByteFile file);
bool looks_like_usgs_dem(std::string_view start);

/// Source: Golden Software, Surfer's help, "Surfer 6 Grid File Format". Samples are points, float32; 1.70141e38 is a
/// void. The other kinds of Surfer grids (DSAA, DSRB) are refused by name.
Result<GridFile> open_surfer(ByteFile file);
bool looks_like_surfer(std::string_view start);

// What they share.

constexpr std::int64_t kMaxGridSide = std::int64_t{1} << 30;  ///< the lattice has no more cells a side

Error unusable_grid(const std::string& path, const std::string& what);
/// A whole number from low to high; nullopt otherwise.
std::optional<std::int64_t> whole_number(std::string_view text, std::int64_t low, std::int64_t high);
std::string lower_case(std::string_view text);
std::string upper_case(std::string_view text);
/// Without white space at either end.
std::string_view trimmed(std::string_view text);
/// The next word of `rest` (white space parts them), which it is cut off from; empty at the end.
std::string_view next_word(std::string_view& rest);

}  // namespace scree
