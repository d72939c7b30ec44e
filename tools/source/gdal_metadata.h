// What GDAL writes about a band into the tag GDAL_METADATA (42112): a short XML text of items.
// Source: GDAL documentation, "GTiff -- GeoTIFF File Format", section "Metadata".
#pragma once

#include <string>
#include <string_view>

namespace scree {

struct GdalBandMetadata {
    double scale = 1, offset = 0;  ///< value * scale + offset; finite, scale not 0
    std::string unit;              ///< as written, such as "m" or "ft"
};

/// Of the first band. Items that hold no usable number are passed over. Never fails: other text has no items.
GdalBandMetadata parse_gdal_metadata(std::string_view xml);

}  // namespace scree
