// The files beside a raster that say what it does not say itself: a raw grid's header, .prj, .aux.xml, world file,
// mask. They bear on a store as the raster does, so resuming and updates look at them, too.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace scree {

/// Those of PATH that are there and may be read with it.
std::vector<std::string> sidecars_of(const std::string& path);

/// fingerprint_of each, by its name without folders. Empty text: it cannot be read.
using SidecarPrints = std::map<std::string, std::string>;
SidecarPrints sidecar_prints(const std::string& path);

/// What became of them since, in words ("NAME has changed"); empty where they are the same.
std::string sidecar_difference(const SidecarPrints& then, const SidecarPrints& now);

}  // namespace scree
