// What a comparison of methods of level of detail is made of: the cases, what was measured of each, and what follows
// from that: the Pareto front, the cheapest case for an error, the recommendation. Pure; no store, no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/lod/lod_method.h"

namespace scree {

/// What a case varies against the case that the command's own options describe.
enum class Sweep {
    tolerance,  ///< method and tau
    texture,    ///< pixels a texel may cover
    budget      ///< ceiling of tile memory
};
std::string_view to_string(Sweep sweep);

struct ComparisonCase {
    Sweep sweep = Sweep::tolerance;
    std::string method;  ///< the name of its curve: "rsg, cache exact, s = 0.1 tau"
    LodSettings lod;
    bool morph = true;
    double tau_px = 1, texture_tau_px = 1;
    std::int64_t budget_bytes = 0;
};

/// Over settled frames of one path. Times are medians over rounds, then over frames.
struct CaseFigures {
    double triangles_mean = 0, triangles_max = 0;
    double lod_ms = 0, lod_p99_ms = 0;  ///< selection, CPU time of the thread; the eye moves on by a step a frame
    double lod_cold_ms = 0;             ///< the same where the eye has leapt: caches that remember a near eye are cold
    double draw_ms = 0;                 ///< until drawn
    double frame_ms = 0, frame_p99_ms = 0;                      ///< selection and drawing; no paging
    double frames_paged_in = 0;                                 ///< share of timed frames in which tiles still came in
    std::int64_t tile_bytes = 0;                                ///< of the tiles that the worst frame keeps
    std::int64_t resident_bytes = 0;                            ///< what the memory plan takes of the budget
    double bound_px = 0;                                        ///< greatest bound that a frame stated
    double true_max_px = 0, true_p99_px = 0, true_mean_px = 0;  ///< against every finest vertex in view
    std::int64_t samples = 0, holes = 0, open_edges = 0, t_junctions = 0;
    std::int64_t budget_limited_frames = 0;
    double psnr_db = 0, ssim = 0;  ///< against the full-resolution picture; mean error of all pictures, mean SSIM
    bool kept = true;              ///< no frame erred by more than it promised; of what promises nothing: always
};

struct ComparedCase {
    ComparisonCase what;
    CaseFigures figures;

    /// What may be relied on elsewhere too: the tolerance, or what the slots allowed.
    double promised_px() const;
};

/// A case that could not be measured, and why.
struct SkippedCase {
    ComparisonCase what;
    std::string reason;
};

/// A pose as a case drew it, 1:1 out of the middle of the picture.
struct CasePicture {
    std::size_t at = 0;                    ///< place of the case; not of the reference
    std::vector<std::uint8_t> rgb;         ///< sRGB RGB8, top row first
    std::vector<std::uint8_t> difference;  ///< grey: kDifferenceGain times how far the pixel is from the reference
    double psnr_db = 0, ssim = 0;          ///< of this pose's whole picture
};
inline constexpr int kDifferenceGain = 8;

/// What the rounding of stored heights is seen as at most: at the nearest drawn vertex of the path.
struct HeightQuantum {
    double error_m = 0, nearest_m = 0, error_px = 0;
};

/// A coarser quantum, as finest heights rounded to it would be seen at the pictured poses: an upper figure of any view
/// direction. The store itself is not built anew.
struct CoarserQuantum {
    double quantum_m = 0, max_px = 0, p99_px = 0, mean_px = 0;
};

struct Comparison {
    std::string store, renderer;
    int frames = 0, rounds = 0, width_px = 0, height_px = 0;
    double step_m = 0;
    double seconds = 0;
    std::vector<ComparedCase> cases;
    std::vector<SkippedCase> skipped;
    HeightQuantum quantum;
    std::vector<CoarserQuantum> coarser_quanta;
    double reference_bound_px = 0;    ///< 0: the finest data was drawn everywhere
    double reference_texture_px = 0;  ///< pixels a texel covers in the reference of the texture sweep
    int picture_width_px = 0, picture_height_px = 0;
    std::vector<std::uint8_t> reference_picture;
    std::vector<CasePicture> pictures;

    bool kept() const;
};

struct CaseList {
    std::vector<double> tau_px = {0.25, 0.5, 1, 2, 4, 8, 16};
    ComparisonCase base;  ///< of the texture and budget sweeps; its budget and texture tau hold for all
    /// Also the tolerances at which methods that promise more than tau promise just this; 0: none.
    double just_px = 0;
    bool promises_only = false;  ///< neither what promises nothing nor the other sweeps
};

/// How to see a case: "--lod rsg --tau 2", with what else is not the default of scree-view.
std::string options_of(const ComparisonCase& c);

/// Whether the report shows a picture of it.
bool is_pictured(const ComparisonCase& c);
/// Without budgets of the sweep beyond the first that holds all tiles of a store, of so many bytes.
std::vector<ComparisonCase> without_idle_budgets(std::vector<ComparisonCase> cases, std::int64_t all_tiles_bytes);

/// Every method at every tolerance, then the sweeps. What is not built in is among them.
std::vector<ComparisonCase> comparison_cases(const CaseList& list);

/// Of the skipped cases the first of each method.
std::vector<SkippedCase> skipped_methods(const Comparison& comparison);

/// Costs that cases are compared by.
enum class Cost { triangles, lod_ms, frame_ms };
double cost_of(const ComparedCase& c, Cost cost);

/// Places in `cases` of those that keep a promise and that no other such case of the tolerance sweep beats in both true
/// error and cost, in the order of their error.
std::vector<std::size_t> pareto_front(const std::vector<ComparedCase>& cases, Cost cost);

/// The place of the cheapest case of the tolerance sweep whose true error was within `error_px`; among those with a
/// promise, or those without.
std::optional<std::size_t> cheapest_within(const std::vector<ComparedCase>& cases, double error_px, Cost cost,
                                           bool guaranteed);

struct Wish {
    double fps = 60;
    double most_error_px = 1;
};

struct Recommendation {
    std::optional<std::size_t> best;  ///< the cheapest of those that fit; else what comes closest
    bool fits = false;
    std::string reason;  ///< one sentence for people
    /// A cheaper one that promises less but was within the error on this path.
    std::optional<std::size_t> cheaper_here;
};

/// Only what is guaranteed is recommended: the least median frame time among cases that promise at most the error and
/// whose 99th percentile makes the frame rate.
Recommendation recommend(const std::vector<ComparedCase>& cases, const Wish& wish);

}  // namespace scree
