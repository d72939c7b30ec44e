// What a measured flight notes frame by frame, and what is said of it: lines for people, CSV, JSON. Pure; no OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "runtime/paging/loader.h"
#include "runtime/paging/pager.h"
#include "runtime/report/statistics.h"

namespace scree {

/// One frame, as drawn.
struct FlightFrame {
    double frame_ms = 0;   ///< thinking and drawing, finished
    double select_ms = 0;  ///< selection, look-ahead and requests, CPU time of the thread
    std::int64_t triangles = 0, tiles_drawn = 0;
    std::int64_t uploads = 0, upload_bytes = 0;  ///< tiles that came in this frame; what was handed to the renderer
    std::int64_t requests = 0;                   ///< of the selection
    std::int64_t queue = 0;                      ///< tiles asked for and not there yet, foreseen ones too
    std::int64_t stand_ins = 0;                  ///< tiles drawn in place of what is missing
    std::int64_t holes = 0;                      ///< finest cells in view under no tile, or two
    double max_bound_px = 0, mean_bound_px = 0;  ///< the promise: greatest, and over the screen
    double tau_effective_px = 0;
    std::int64_t resident_heights_bytes = 0, resident_textures_bytes = 0, rss_bytes = 0;
    std::int64_t bytes_read = 0;  ///< since the store was opened
    bool incomplete = false;      ///< something planned was missing
    bool growing = false;         ///< what came late had not yet grown to its shape
    bool reused = false;          ///< nothing had changed: the last selection once more
    bool limited = false;         ///< slots bound before tau did
};

struct FlightLog {
    std::vector<FlightFrame> frames;
    Series tiles_reused;
    Series settled_triangles, settled_mean_bound;  ///< of the same poses, when nothing is missing
    std::int64_t see_through = 0, looked_through = 0;
    double coarse_after_ms = 0, true_after_ms = 0;  ///< from the context on; 0: never
    std::int64_t fixed_rss_bytes = 0;

    /// One figure over all frames.
    template <class Value>
    Series of(Value FlightFrame::*figure) const {
        Series series;
        for (const FlightFrame& frame : frames) series.add(static_cast<double>(frame.*figure));
        return series;
    }
    /// A figure's sum over frames: of a condition, in how many.
    template <class Value>
    std::int64_t total(Value FlightFrame::*figure) const {
        std::int64_t sum = 0;
        for (const FlightFrame& frame : frames) sum += static_cast<std::int64_t>(frame.*figure);
        return sum;
    }
    /// Heights and textures.
    std::int64_t most_resident_bytes() const;
    /// Least share of the settled triangles that was drawn while flying, after the coarse and the true first picture; 1
    /// without a settled flight.
    double least_triangle_share() const;
};

/// What holds for all of a flight.
struct FlightFacts {
    std::string store;     ///< name, without folders
    std::string command;   ///< as it can be typed
    std::string renderer;  ///< as OpenGL names it
    std::string machine;   ///< processor and cores
    std::string lod;       ///< options of the method
    bool guaranteed = true;
    bool settled = false, see_through = false;  ///< were asked for
    double fps = 0;                             ///< the tolerance was raised to keep so many; 0: it was not
    double tau_px = 1, texture_tau_px = 1, fov_deg = 40;
    int width_px = 0, height_px = 0;
    std::int64_t budget_bytes = 0, peak_resident_bytes = 0, peak_rss_bytes = 0, store_updates = 0;
    double height_quantum_error_m = 0, exaggeration = 1;
    PagerCounters paging;
    std::array<LoaderCounters, 2> loads;  ///< by TileKind
};

/// docs/measuring.md has the keys and columns.
std::string flight_csv(const FlightLog& log);
nlohmann::ordered_json flight_json(const FlightLog& log, const FlightFacts& facts);
std::string flight_text(const FlightLog& log, const FlightFacts& facts);

}  // namespace scree
