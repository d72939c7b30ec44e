#include "runtime/app/flight_log.h"

#include <fmt/format.h>

#include <algorithm>

namespace scree {
namespace {

nlohmann::ordered_json loader_report(const LoaderCounters& c) {
    const double tiles = static_cast<double>(std::max<std::int64_t>(c.tiles, 1));
    return {{"tiles", c.tiles},
            {"cpu_us_per_tile", 1e6 * c.cpu_seconds / tiles},
            {"latency_ms_mean", 1e3 * c.latency_seconds / tiles}};
}

const LoaderCounters& loads_of(const FlightFacts& facts, TileKind kind) {
    return facts.loads[static_cast<std::size_t>(kind)];
}

}  // namespace

std::int64_t FlightLog::most_resident_bytes() const {
    std::int64_t most = 0;
    for (const FlightFrame& frame : frames)
        most = std::max(most, frame.resident_heights_bytes + frame.resident_textures_bytes);
    return most;
}

double FlightLog::least_triangle_share() const {
    double least = 1;
    for (std::size_t k = 2; k < std::min(settled_triangles.values.size(), frames.size()); ++k)
        if (settled_triangles.values[k] > 0)
            least = std::min(least, static_cast<double>(frames[k].triangles) / settled_triangles.values[k]);
    return least;
}

std::string flight_csv(const FlightLog& log) {
    std::string csv =
        "frame,frame_ms,select_ms,triangles,tiles_drawn,uploads,upload_bytes,requests,queue,stand_ins,holes,"
        "max_bound_px,mean_bound_px,tau_effective,resident_heights_bytes,resident_textures_bytes,rss_bytes,"
        "bytes_read\n";
    for (std::size_t k = 0; k < log.frames.size(); ++k) {
        const FlightFrame& f = log.frames[k];
        csv += fmt::format("{},{:.3f},{:.4f},{},{},{},{},{},{},{},{},{:.4f},{:.4f},{:.4f},{},{},{},{}\n", k, f.frame_ms,
                           f.select_ms, f.triangles, f.tiles_drawn, f.uploads, f.upload_bytes, f.requests, f.queue,
                           f.stand_ins, f.holes, f.max_bound_px, f.mean_bound_px, f.tau_effective_px,
                           f.resident_heights_bytes, f.resident_textures_bytes, f.rss_bytes, f.bytes_read);
    }
    return csv;
}

nlohmann::ordered_json flight_json(const FlightLog& log, const FlightFacts& facts) {
    const PagerCounters& c = facts.paging;
    const Series mean_bound = log.of(&FlightFrame::mean_bound_px);
    nlohmann::ordered_json report = {
        {"frames", log.frames.size()},
        {"frame_ms", log.of(&FlightFrame::frame_ms).spread()},
        {"select_ms", log.of(&FlightFrame::select_ms).spread()},
        {"triangles", log.of(&FlightFrame::triangles).mean_max()},
        {"tiles_drawn", log.of(&FlightFrame::tiles_drawn).mean_max()},
        {"budget_bytes", facts.budget_bytes},
        {"peak_resident_bytes", facts.peak_resident_bytes},
        {"most_tile_bytes", log.most_resident_bytes()},
        {"peak_rss_bytes", facts.peak_rss_bytes},
        {"fixed_rss_bytes", log.fixed_rss_bytes},
        {"tile_rss_bytes", facts.peak_rss_bytes - log.fixed_rss_bytes},
        {"tiles_paged_in", c.tiles_paged_in},
        {"tiles_paged_out", c.tiles_paged_out},
        {"tiles_prefetched", c.prefetched},
        {"requests_refused", c.refused},
        {"bytes_read", c.bytes_read},
        {"upload_bytes", c.upload_bytes},
        {"heights_loaded", loader_report(loads_of(facts, TileKind::height))},
        {"textures_loaded", loader_report(loads_of(facts, TileKind::texture))},
        {"frames_with_stand_ins", log.total(&FlightFrame::incomplete)},
        {"selections_reused", log.total(&FlightFrame::reused)},
        {"lod", facts.lod},
        {"exaggeration", facts.exaggeration},
        {"guaranteed", facts.guaranteed},
        {"tiles_reused_share", log.tiles_reused.mean()},
        {"budget_limited_frames", log.total(&FlightFrame::limited)},
        {"holes", log.total(&FlightFrame::holes)},
        {"max_bound_px", log.of(&FlightFrame::max_bound_px).max()},
        {"error_integral_px", mean_bound.mean()},
        {"tau_effective_px", log.of(&FlightFrame::tau_effective_px).mean_max()},
        {"cold_start_ms", {{"within_8_px", log.coarse_after_ms}, {"within_tau", log.true_after_ms}}},
        {"damaged_tiles", c.damaged_tiles},
        {"store_updates", facts.store_updates},
        {"tau_px", facts.tau_px},
        {"size_px", {facts.width_px, facts.height_px}},
        {"renderer", facts.renderer}};
    if (facts.settled) {
        const double settled = log.settled_mean_bound.mean();
        report["settled"] = {{"error_integral_px", settled},
                             {"error_integral_ratio", settled > 0 ? mean_bound.mean() / settled : 1},
                             {"triangles", log.settled_triangles.mean_max()},
                             {"least_triangle_share", log.least_triangle_share()}};
    }
    if (facts.see_through) {
        report["see_through_pixels"] = log.see_through;
        report["frames_looked_through"] = log.looked_through;
    }
    return report;
}

std::string flight_text(const FlightLog& log, const FlightFacts& facts) {
    const PagerCounters& c = facts.paging;
    const Series frame_ms = log.of(&FlightFrame::frame_ms), tau = log.of(&FlightFrame::tau_effective_px);
    std::string text = fmt::format(
        "{} frames on {}: median {:.1f} ms, p99 {:.1f} ms; selection median {:.3f} ms; {:.0f} triangles in {:.0f} "
        "tiles (mean)\n"
        "promised within {:.3g} px; {} frames with stand-ins, {} holes; {:.1f} of {:.1f} MB for tiles, {} tiles in, {} "
        "out{}{}\n",
        log.frames.size(), facts.renderer, frame_ms.quantile(0.5), frame_ms.quantile(0.99),
        log.of(&FlightFrame::select_ms).quantile(0.5), log.of(&FlightFrame::triangles).mean(),
        log.of(&FlightFrame::tiles_drawn).mean(), log.of(&FlightFrame::max_bound_px).max(),
        log.total(&FlightFrame::incomplete), log.total(&FlightFrame::holes),
        static_cast<double>(facts.peak_resident_bytes) / 1e6, static_cast<double>(facts.budget_bytes) / 1e6,
        c.tiles_paged_in, c.tiles_paged_out, c.damaged_tiles > 0 ? fmt::format(", {} damaged", c.damaged_tiles) : "",
        facts.store_updates > 0 ? fmt::format("; the store was updated {} times", facts.store_updates) : "");
    if (const std::int64_t limited = log.total(&FlightFrame::limited); limited > 0)
        text += fmt::format("the budget bound in {} frames: tau {:.2f} px at most\n", limited, tau.max());
    if (facts.settled)
        text += fmt::format(
            "error over the flight {:.4f} px (mean promise), settled {:.4f}; at least {:.0f} % of the triangles\n",
            log.of(&FlightFrame::mean_bound_px).mean(), log.settled_mean_bound.mean(),
            100 * log.least_triangle_share());
    if (facts.see_through)
        text += fmt::format("{} see-through pixels in {} frames that promise something\n", log.see_through,
                            log.looked_through);
    return text;
}

}  // namespace scree
