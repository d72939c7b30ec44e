// What GDAL writes beside a file of another format: FILE.aux.xml, its "persistent auxiliary metadata". Taken for what
// the file itself does not say. Source: GDAL documentation, "PAM" (pamdataset.xsd).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "common/result.h"
#include "tools/source/georeference.h"

namespace scree {

struct PamFile {
    /// x = t[0] + column * t[1] + row * t[2], y = t[3] + column * t[4] + row * t[5], from the outer corner of the first
    /// sample.
    std::optional<std::array<double, 6>> geotransform;
    std::string crs;  ///< WKT; empty: none, or one of no place on the Earth
    // Of the first band:
    std::optional<std::string> nodata;    ///< as written
    std::optional<double> scale, offset;  ///< z = value * scale + offset
    std::string unit;                     ///< of z
};

/// Elements that are not asked for are passed over, and so is text that is no XML. Errors: ErrorCode::input for a
/// GeoTransform that does not hold six numbers; they hold the bare reason.
Result<PamFile> parse_pam(std::string_view xml);

/// PATH.aux.xml; nothing of it where there is none. Errors: ErrorCode::input naming it; also for more than 16 MiB.
Result<PamFile> read_pam(const std::string& path);

/// Places the raster of PATH by pam.geotransform, which is there. Errors: check_place's.
Result<void> place_by(const PamFile& pam, const std::string& path, Georeference& place);

}  // namespace scree
