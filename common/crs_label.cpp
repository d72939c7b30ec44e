#include "common/crs_label.h"

namespace scree {
namespace {

bool has_code(const Dataset& d) { return d.crs.starts_with("EPSG:"); }

}  // namespace

std::string crs_label(const Dataset& d) {
    if (d.crs.empty()) return "none";
    if (has_code(d)) return d.crs_name.empty() ? d.crs : d.crs + " (" + d.crs_name + ")";
    return d.crs_name.empty() ? "without code or name" : d.crs_name;
}

std::string crs_code_or_name(const Dataset& d) { return has_code(d) ? d.crs : d.crs_name; }

}  // namespace scree
