// `scree samples`: a DEM's own samples, decoded and placed, for whatever judges a store by them. Format:
// docs/measuring.md, "Judging a store by its sources".
#pragma once

namespace scree {

int run_samples(int argc, char** argv);

}  // namespace scree
