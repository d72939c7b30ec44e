// Which published method decides density, and how its promises are read: the settings behind --lod, --metric, --cache,
// --s, --cull and --cracks (docs/lod-methods.md). Defaults keep every promise; the others show what their choice costs.
#pragma once

#include <string>
#include <string_view>

#include "common/result.h"

namespace scree {

enum class LodMethod {
    geomip,    ///< one stride a tile, morphed (de Boer; runtime/lod/cut.h)
    rsg,       ///< vertex by vertex in each tile by the restricted square grid (Ueng & Chuang)
    block_rsg  ///< the restricted square grid by one threshold a tile, from a ladder of thresholds
};
enum class ErrorMetric {
    guaranteed,  ///< G2 of geomip, N*K of rsg, BSK of block-rsg: nothing drawn is further than tau from the finest data
    uc,     ///< rsg: each vertex by its own level's correction, as if on the optical axis (Ueng & Chuang). No bound
    deboer  ///< geomip: distance to the tile's centre, correction from level to level (de Boer). No bound
};
enum class ReuseTest {
    off,    ///< every frame from scratch
    paper,  ///< P1: the block's corners stand for the block (Ueng & Chuang). No bound
    exact   ///< T1 or T3: error <= tau + s
};
enum class Culling {
    box,     ///< the tile's box against the frustum: nothing visible is lost
    corners  ///< visible if one of its four corners is (Ke et al.). Loses tiles
};
enum class CrackFix {
    stitch,  ///< tiles share their edges' vertices
    dike     ///< rsg: the paper's own layout: blocks of 33 x 33 that share nothing, strips and quads between them
};

struct LodSettings {
    LodMethod method = LodMethod::geomip;
    ErrorMetric metric = ErrorMetric::guaranteed;
    ReuseTest reuse = ReuseTest::off;
    double s_px = 0;  ///< reuse allowance: larger reuses meshes longer, and errs by up to tau + s
    Culling culling = Culling::box;
    CrackFix cracks = CrackFix::stitch;

    bool is_guaranteed() const {
        return metric == ErrorMetric::guaranteed && reuse != ReuseTest::paper && culling == Culling::box;
    }
    /// What is promised at a tolerance.
    double promise_px(double tau_px) const { return reuse == ReuseTest::off ? tau_px : tau_px + s_px; }

    friend bool operator==(const LodSettings&, const LodSettings&) = default;
};

/// As on the command line.
struct LodOptions {
    std::string lod = "geomip", metric = "guaranteed", cache = "off", cull = "box", cracks = "stitch";
    double s_px = 0;
};

/// Errors: ErrorCode::usage, naming the option, for unknown words and for what does not go together.
Result<LodSettings> lod_settings_from(const LodOptions& options);
std::string_view to_string(LodMethod method);
std::string_view to_string(ErrorMetric metric);
std::string_view to_string(ReuseTest reuse);
std::string_view to_string(Culling culling);
std::string_view to_string(CrackFix cracks);
/// The options that are not the defaults, as on the command line: "--lod rsg --cache exact --s 0.1"; geomip: "--lod
/// geomip".
std::string command_line_of(const LodSettings& settings);

/// Whether this build can draw so.
bool is_built_in(const LodSettings& settings);
/// Errors: ErrorCode::usage naming the options, where it cannot.
Result<void> expect_built_in(const LodSettings& settings);

}  // namespace scree
