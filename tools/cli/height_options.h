// The command line's words for how heights are read, alike in every command that reads a DEM.
#pragma once

#include <CLI/CLI.hpp>

#include "tools/source/height_source.h"

namespace scree {

void add_height_options(CLI::App& app, HeightReading& reading);

}  // namespace scree
