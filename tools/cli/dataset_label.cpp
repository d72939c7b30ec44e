#include "tools/cli/dataset_label.h"

namespace scree {

std::string crs_label(const Dataset& d) {
    if (d.crs.empty()) return "none";
    if (d.crs.rfind("EPSG:", 0) == 0) return d.crs_name.empty() ? d.crs : d.crs + " (" + d.crs_name + ")";
    return d.crs_name.empty() ? "without code or name" : d.crs_name;
}

std::optional<Crs> crs_of(const Dataset& d) {
    if (d.crs.empty()) return std::nullopt;
    auto crs = Crs::parse(d.crs);
    if (!crs) return std::nullopt;
    return *crs;
}

}  // namespace scree
