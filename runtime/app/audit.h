// Audit: the truth about drawn frames, from the finest data. For every finest vertex of a present cell in view, the
// distance in pixels between its projection and that of the drawn surface above or below it; occlusion is ignored, so
// it is an upper figure (Scree lod, test data).
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "common/store/tile_store.h"
#include "runtime/app/cpu_arena.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/app/source_judge.h"
#include "runtime/lod/draw_list.h"
#include "runtime/view/camera.h"

namespace scree {

/// Rounding of float positions and of their projections on screen (Scree lod, 5.2), at 800 px: what a promise that is
/// audited is not blamed for.
inline constexpr double kRoundingPx = 1e-3;

class ErrorHistogram {
public:
    void add(double px);
    void merge(const ErrorHistogram& other);
    std::int64_t count() const { return count_; }
    double max() const { return max_; }
    double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0; }
    /// Upper end of the bin that holds the quantile; bins are 0.4 % wide.
    double quantile(double q) const;
    /// Errors of at most so many pixels, as far as the bins tell: those of the bin that holds `px` are counted.
    std::int64_t count_within(double px) const;

private:
    static std::size_t bin_of(double px);
    static constexpr int kBins = 8192;
    std::array<std::int64_t, kBins> bins_{};
    std::int64_t count_ = 0;
    double max_ = 0, sum_ = 0;
};

/// One drawn frame: what was drawn, from where.
struct AuditedFrame {
    const Camera& camera;
    const DrawList& draws;
    const CpuArena& arena;
    double half_curvature = 0;         ///< the truth is lowered by it as well, exactly
    const MeshPool* meshes = nullptr;  ///< that the draws' meshes are held in; null where none has one
};

/// Adds the errors of one drawn frame against the store's finest tiles. Errors: those of the store;
/// ErrorCode::check_failed for a mesh that does not cover its tile once (DrawnTile::set).
Result<void> audit_frame(const TileStore& store, TileReader& reader, const AuditedFrame& frame, ErrorHistogram& errors);

/// Adds the errors of one drawn frame against the judged samples of a source that are in view. `stated_m`: what the
/// store states of its own heights (warp, quantum); the greatest error beyond what that is seen as goes to `excess_px`.
/// Errors: ErrorCode::check_failed, as audit_frame.
Result<void> audit_against(const Dataset& dataset, const SourceJudge& source, const AuditedFrame& frame,
                           double stated_m, ErrorHistogram& errors, double& excess_px);

}  // namespace scree
