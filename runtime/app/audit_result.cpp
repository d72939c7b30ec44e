#include "runtime/app/audit_result.h"

#include <fmt/format.h>

namespace scree {

nlohmann::ordered_json audit_json(const AuditResult& r, const AuditFacts& facts) {
    nlohmann::ordered_json report = {{"frames", r.frames.size()},
                                     {"tau_px", facts.tau_px},
                                     {"max_error_px", r.errors.max()},
                                     {"p99_error_px", r.errors.quantile(0.99)},
                                     {"mean_error_px", r.errors.mean()},
                                     {"max_bound_px", r.max_bound_px},
                                     {"worst_share_of_promise", r.worst_share},
                                     {"open_edges", r.cracks.open_edges},
                                     {"t_junctions", r.cracks.t_junctions},
                                     {"samples", r.errors.count()},
                                     {"holes", r.holes},
                                     {"budget_limited_frames", r.limited},
                                     {"frames_with_stand_ins", r.stand_ins},
                                     {"guaranteed", facts.guaranteed},
                                     {"lod", facts.lod},
                                     {"exaggeration", facts.exaggeration},
                                     {"kept", r.kept}};
    if (!facts.sources.empty())
        report["against"] = {{"sources", facts.sources.size()},
                             {"samples", r.source_errors.count()},
                             {"samples_not_drawn", r.samples_not_drawn},
                             {"max_error_px", r.source_errors.max()},
                             {"p99_error_px", r.source_errors.quantile(0.99)},
                             {"mean_error_px", r.source_errors.mean()},
                             {"max_error_less_stated_px", r.source_excess_px}};
    return report;
}

std::string audit_text(const AuditResult& r, const AuditFacts& facts) {
    std::string text =
        fmt::format("{} frames, {} samples: error max {:.4f} px, p99 {:.4f}, mean {:.5f}; promised {:.4f} at tau {}\n",
                    r.frames.size(), r.errors.count(), r.errors.max(), r.errors.quantile(0.99), r.errors.mean(),
                    r.max_bound_px, facts.tau_px);
    if (!facts.sources.empty())
        text += fmt::format(
            "against the sources, {} samples: error max {:.4f} px, p99 {:.4f}, mean {:.5f}; {:.4f} px beyond what the "
            "store states of its heights; {} samples over no terrain\n",
            r.source_errors.count(), r.source_errors.max(), r.source_errors.quantile(0.99), r.source_errors.mean(),
            r.source_excess_px, r.samples_not_drawn);
    return text + fmt::format("{} open edges, {} T-junctions, {} holes{}: {}\n", r.cracks.open_edges,
                              r.cracks.t_junctions, r.holes,
                              r.limited > 0 ? fmt::format(" ({} frames limited by the budget)", r.limited) : "",
                              !r.kept            ? "THE PROMISE IS BROKEN"
                              : facts.guaranteed ? "the promise holds"
                                                 : "no error is promised");
}

}  // namespace scree
