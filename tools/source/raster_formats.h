// The formats that are read, each told once: what its files are called, how they begin, and who reads them. How a
// file's format is found, what a folder is searched for, the words of refusals, and the tests that ask whether every
// format is documented, fuzzed and placed go by these tables (docs/inputs.md, "Adding an input format").
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "tools/source/byte_file.h"
#include "tools/source/grid_file.h"
#include "tools/source/image_header.h"

namespace scree {

/// Extensions are in lower case, with their dot.
using Extensions = std::vector<std::string_view>;

/// DEMs that are read by our own code (grid_file.h).
struct GridFormat {
    std::string_view name = {};           ///< as messages and docs/building-pyramids.md say it; several parted by ", "
    Extensions extensions = {};           ///< what is called so is of this format, unless it begins as another
    Extensions headered_extensions = {};  ///< so is what is called so where a text header stands beside it
    Extensions shared_extensions =
        {};  ///< formats that are not read are called so, too: only what begins so is of this one
    bool (*begins_so)(std::string_view start) = nullptr;  ///< nullptr: no signature
    Result<GridFile> (*open)(ByteFile file) = nullptr;
};

/// In the order in which a file is asked whether it is one of them.
std::span<const GridFormat> grid_formats();

/// nullptr for a file of none of them; `start` is its beginning, kSniffBytes of it or all.
const GridFormat* grid_format_of(const std::string& path, std::string_view start);
/// The same of a file as it lies there; nullptr for one that cannot be read, too.
const GridFormat* grid_format_of(const std::string& path);

/// Images, which are decoded apart: TIFFs by libtiff, all others by OpenImageIO.
struct ImageFormat {
    ImageKind kind = ImageKind::tiff;
    std::string_view name = {};                           ///< as messages and docs/building-pyramids.md say it
    const char* reader = nullptr;                         ///< OpenImageIO's name of its reader
    Extensions extensions = {};                           ///< what its files are called in folders
    bool (*begins_so)(std::string_view start) = nullptr;  ///< nullptr: only its extension tells it
};

std::span<const ImageFormat> image_formats();
/// nullptr for a file of none of them.
const ImageFormat* image_format_of(const std::string& path, std::string_view start);
const ImageFormat& image_format(ImageKind kind);

constexpr std::size_t kSniffBytes = 1024;

/// Whether a file that was found in a folder is taken for a raster. What else lies there (reports, archives, sidecars)
/// is not the user's word.
bool is_raster_in_folder(const std::string& path);

/// The text header that stands beside a raw grid, when there is one.
std::optional<std::string> header_beside(const std::string& path);

/// The names of both tables, for refusals.
std::string image_format_names();
std::string grid_format_names();

}  // namespace scree
