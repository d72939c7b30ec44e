// What an audit found, frame by frame and in all, and what is said of it: lines for people, JSON. Pure; no OpenGL.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/app/audit.h"
#include "runtime/app/drawn_mesh.h"

namespace scree {

struct AuditFrame {
    std::int64_t triangles = 0, samples = 0;
    double promised_px = 0;  ///< tau, or the stated bound where that is greater
    double max_px = 0, p99_px = 0, mean_px = 0;
    double source_max_px = 0;  ///< against the sources; 0 without
    std::int64_t open_edges = 0, t_junctions = 0, holes = 0;
    bool limited = false, incomplete = false;
};

struct AuditResult {
    std::vector<AuditFrame> frames;
    ErrorHistogram errors;
    CrackReport cracks;
    double max_bound_px = 0;
    double worst_share = 0;  ///< greatest true error of a frame over what the frame promised
    bool kept = true;
    std::int64_t holes = 0, limited = 0, stand_ins = 0;
    ErrorHistogram source_errors;
    double source_excess_px = 0;
    std::int64_t samples_not_drawn = 0;
};

/// What holds for all of an audit.
struct AuditFacts {
    std::string store;    ///< name, without folders
    std::string command;  ///< as it can be typed
    std::string machine;
    std::string lod;  ///< options of the method
    bool guaranteed = true, moving = false;
    double tau_px = 1, fov_deg = 40;
    int width_px = 0, height_px = 0;
    std::int64_t budget_bytes = 0;
    double height_quantum_error_m = 0, warp_error_m = 0, exaggeration = 1;
    std::vector<std::string> sources;  ///< judged by as well: names, without folders
};

/// docs/measuring.md has the keys.
nlohmann::ordered_json audit_json(const AuditResult& result, const AuditFacts& facts);
std::string audit_text(const AuditResult& result, const AuditFacts& facts);

}  // namespace scree
