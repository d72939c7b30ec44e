#include "tools/cli/height_options.h"

namespace scree {

void add_height_options(CLI::App& app, HeightReading& reading) {
    app.add_option("--spacing", reading.spacing_m, "Metres between samples of a file without georeference");
    app.add_option("--height-scale", reading.height_scale, "z = value * scale + offset, in metres")
        ->capture_default_str();
    app.add_option("--height-offset", reading.height_offset_m, "z = value * scale + offset, in metres")
        ->capture_default_str();
    app.add_option("--vertical-crs", reading.vertical_crs,
                   "Vertical CRS of the heights, EPSG:n; heights of files that name another are converted to it");
    app.add_option("--source-vertical-crs", reading.source_vertical_crs,
                   "NAME=EPSG:n: vertical CRS of the heights of one file, whatever it says itself")
        ->type_name("NAME=CRS")
        ->allow_extra_args(false);
    static const std::map<std::string, HeightEncoding> kEncodings{{"terrarium", HeightEncoding::terrarium},
                                                                  {"mapbox", HeightEncoding::mapbox}};
    app.add_option("--height-encoding", reading.height_encoding, "Heights in the colours of web tiles")
        ->transform(CLI::CheckedTransformer(kEncodings, CLI::ignore_case).description(""))
        ->type_name("terrarium|mapbox");
    app.add_option("--nodata", reading.nodata, "A height value that means void, besides the file's own");
}

}  // namespace scree
