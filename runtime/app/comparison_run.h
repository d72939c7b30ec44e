// Runs the cases of a comparison over the poses of a path: without a window, settled, in rounds in which the cases take
// turns, so that what disturbs the machine for a while disturbs no case alone. OpenGL thread.
#pragma once

#include <memory>
#include <vector>

#include "common/store/sqlite_store.h"
#include "runtime/app/comparison.h"
#include "runtime/scene/scene.h"
#include "runtime/view/flight_path.h"

namespace scree {

struct ComparisonSetup {
    std::shared_ptr<const SqliteStore> store;
    SceneOptions scene;  ///< what no case varies
    FlightPath path;
    double fov_deg = 40;
    int width_px = 800, height_px = 800;
    /// Metres that the eye moves on from each pose, twice, so that methods that remember a near eye can show it.
    double step_m = 15;
    int rounds = 3;  ///< more: steadier medians, and time
    std::vector<ComparisonCase> cases;
    bool quiet = false;
};

/// Cases that are refused as usage (not built in, a budget that is too small) are among the skipped ones; where all
/// are, that is the error. Errors: those of Scene, Display and the store; ErrorCode::interrupted.
Result<Comparison> run_comparison(const ComparisonSetup& setup);

}  // namespace scree
