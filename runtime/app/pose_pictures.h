// Pictures of poses for a page: each drawn without a window, complete. OpenGL thread.
#pragma once

#include <vector>

#include "common/store/sqlite_store.h"
#include "runtime/app/page_parts.h"
#include "runtime/app/view_options.h"
#include "runtime/view/flight_path.h"

namespace scree {

/// Of the poses that pictured_frames() names. Errors: ErrorCode::display where there is no OpenGL 4.5; those of Scene
/// and the store.
Result<std::vector<PosePicture>> draw_poses(const SqliteStore& store, const ViewOptions& options,
                                            const FlightPath& path);

}  // namespace scree
