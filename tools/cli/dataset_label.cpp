#include "tools/cli/dataset_label.h"

namespace scree {

std::optional<Crs> crs_of(const Dataset& d) {
    if (d.crs.empty()) return std::nullopt;
    auto crs = Crs::parse(d.crs);
    if (!crs) return std::nullopt;
    return *crs;
}

}  // namespace scree
