#include "tools/source/grid_file.h"

namespace scree {

bool looks_like_usgs_dem(std::string_view) { return false; }

Result<GridFile> open_usgs_dem(ByteFile file) {
    return unusable_grid(file.path(),
                         "USGS ASCII DEMs are not read; convert it to GeoTIFF first (gdal_translate in.dem out.tif)");
}

}  // namespace scree
