// What a build that was cut off left behind besides its rows (docs/resume-and-update.md, "Checkpoints").
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/dataset.h"
#include "common/result.h"

namespace scree {

struct BuildState {
    std::string identity;  ///< identity_of the planned dataset
    bool heights_done = false;
    Dataset dataset;  ///< once heights are done
    double warp_rms_m = 0;
    std::int64_t filled_samples = 0;
    std::int64_t district_rows = 0;  ///< complete, from the north
    std::int64_t deep_rows = 0;      ///< of deep districts: all north of it are complete

    std::string text() const;
    /// Errors: ErrorCode::store.
    static Result<BuildState> from_text(const std::string& text);
};

/// Everything that bears on the bytes of a store: lattice, CRS, sources, options. The same of a planned dataset and of
/// the finished one.
std::string identity_of(const Dataset& dataset);
/// Names what differs, for people; nullopt: nothing.
std::optional<std::string> identity_difference(const std::string& begun, const std::string& now);

}  // namespace scree
