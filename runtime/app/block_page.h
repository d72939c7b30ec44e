// A flight over and an audit of blocks (--cracks dike) as pages of HTML: as the pages of tiles, without what only tiles
// that are paged have. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/app/page_parts.h"
#include "runtime/report/statistics.h"

namespace scree {

/// What holds for all of it.
struct BlockFacts {
    std::string store;     ///< name, without folders
    std::string command;   ///< as it can be typed
    std::string renderer;  ///< as OpenGL names it; empty: nothing was drawn
    std::string machine;
    std::string lod;                   ///< options of the method
    std::optional<double> promise_px;  ///< how far off the finest data at most; none: not promised
    double tau_px = 1, fov_deg = 40, exaggeration = 1;
    double fps = 0;  ///< the tolerance was raised to keep so many; 0: it was not
    int width_px = 0, height_px = 0;
    std::int64_t budget_bytes = 0, resident_bytes = 0;
    std::int64_t dropped_columns = 0, dropped_rows = 0;  ///< samples that are no whole block, not shown
    double height_quantum_error_m = 0;
};

/// By frame.
struct BlockFlightFigures {
    Series frame_ms, select_ms, triangles, blocks, strips, reused, meshes_made, tau_px, promised_px, rss_bytes;
    std::int64_t holes = 0;
};
std::string block_flight_verdict(const BlockFlightFigures& figures, const BlockFacts& facts);
/// Errors: ErrorCode::io (no memory for a picture).
Result<std::string> block_flight_page(const BlockFlightFigures& figures, const BlockFacts& facts,
                                      const std::vector<PosePicture>& pictures);

struct BlockAuditFigures {
    Series triangles, samples, blocks_max_px, strips_max_px, mean_px, open_edges, t_junctions, holes;  ///< by frame
    bool kept = true;
};
std::string block_audit_verdict(const BlockAuditFigures& figures, const BlockFacts& facts);
/// `no_pictures`: why there are none; else empty. Errors: those of block_flight_page().
Result<std::string> block_audit_page(const BlockAuditFigures& figures, const BlockFacts& facts,
                                     const std::vector<PosePicture>& pictures, const std::string& no_pictures);

}  // namespace scree
