// What the commands do with --cracks dike: as with tiles, and reported by the same keys where they mean the same.
#pragma once

#include <optional>
#include <string>

#include "common/store/sqlite_store.h"
#include "runtime/app/view_options.h"
#include "runtime/render/renderer.h"
#include "runtime/view/flight_path.h"

namespace scree {

inline bool wants_blocks(const ViewOptions& options) { return options.lod.cracks == CrackFix::dike; }

/// Errors: ErrorCode::usage if `given`: the option says nothing of blocks that are never paged.
Result<void> refuse_with_blocks(bool given, const std::string& option);

struct BlockShot {
    std::optional<FlightPose> pose;  ///< none: an overview
    std::string out;                 ///< PNG
    std::string mesh_file;           ///< PLY; empty: none
    FrameSettings debug;
};
Result<void> shoot_blocks(const ViewOptions& options, const TileStore& store, const BlockShot& shot);

/// A folder with a page, that prepare() of ReportFolder has found good.
struct BlockReport {
    std::string folder;  ///< empty: none
    bool force = false;
    std::string command;  ///< as it was typed
};

struct BlockFlight {
    bool headless = false;
    double fps = 0, tau_most_px = 16;  ///< 0: tau is kept
    bool settled = false;              ///< afterwards the same poses anew, at the tolerance asked for
    std::string csv, last_frame;       ///< files; empty: none
    BlockReport report;
};
Result<void> fly_blocks(const ViewOptions& options, const TileStore& store, const FlightPath& path,
                        const BlockFlight& flight);

/// Was every promise kept? Nothing is judged where none is made.
Result<bool> audit_blocks(const ViewOptions& options, const TileStore& store, const FlightPath& path,
                          const BlockReport& report);

}  // namespace scree
