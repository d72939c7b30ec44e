#include "experiments/claims/claims.h"

namespace scree {

const std::vector<NamedClaim>& all_claims() {
    static const std::vector<NamedClaim> claims{
        {"C2", claim_c02_off_axis},        {"C3", claim_c03_reuse_bound},       {"C4", claim_c04_corner_minimum},
        {"C5", claim_c05_corner_test},     {"C7", claim_c07_local_corrections}, {"C10", claim_c10_dikes},
        {"C12", claim_c12_level_to_level}, {"C13", claim_c13_centre_distance},  {"C14", claim_c14_connectivity},
        {"C16", claim_c16_own_weights},    {"C17", claim_c17_restitching},      {"C18", claim_c18_corner_culling}};
    return claims;
}

}  // namespace scree
