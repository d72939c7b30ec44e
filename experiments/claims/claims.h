// The claims of the papers that fail, each a figure (docs/claims.md). Sources: UC = Ueng & Chuang, Terrain Rendering
// With View-Dependent LOD Caching; DB = de Boer, Fast Terrain Rendering Using Geometrical MipMapping; KE = Ke et al.,
// Pyramid Management and Real-Time Visualization of Massive 3-Dimensional Terrain Data; Lindstrom et al. 1996.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "experiments/claims/figure.h"
#include "experiments/claims/terrain.h"

namespace scree {

/// What a claim is tried on. The same bench gives the same figure.
struct ClaimBench {
    const Terrain& terrain;
    std::uint64_t seed = 1;
    bool quick = false;  ///< about a twentieth of the samples: for tests

    int amount(int full, int few) const { return quick ? few : full; }
};

/// Samples that a terrain must have a side.
inline constexpr int kLeastTerrainSide = 133;

Figure claim_c02_off_axis(const ClaimBench& bench);
Figure claim_c03_reuse_bound(const ClaimBench& bench);
Figure claim_c04_corner_minimum(const ClaimBench& bench);
Figure claim_c05_corner_test(const ClaimBench& bench);
Figure claim_c07_local_corrections(const ClaimBench& bench);
Figure claim_c10_dikes(const ClaimBench& bench);
Figure claim_c12_level_to_level(const ClaimBench& bench);
Figure claim_c13_centre_distance(const ClaimBench& bench);
Figure claim_c14_connectivity(const ClaimBench& bench);
Figure claim_c16_own_weights(const ClaimBench& bench);
Figure claim_c17_restitching(const ClaimBench& bench);
Figure claim_c18_corner_culling(const ClaimBench& bench);

struct NamedClaim {
    std::string_view id;
    Figure (*make)(const ClaimBench&);
};
const std::vector<NamedClaim>& all_claims();

}  // namespace scree
