// The files behind what a user typed: folders are searched (all levels, names in byte order), files are taken as they
// are.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

/// Sidecars (.prj, .hdr beside a raster, world files, .aux.xml, .ovr, .txt...) and hidden files in folders are passed
/// over; a file named by the user is never. Order: as typed, a folder's files sorted by path. Errors: ErrorCode::input
/// for a path that does not exist or a folder without any raster.
Result<std::vector<std::string>> list_sources(const std::vector<std::string>& paths);

}  // namespace scree
