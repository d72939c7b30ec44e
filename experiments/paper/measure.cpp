#include "experiments/paper/measure.h"

#include <algorithm>
#include <limits>

namespace scree::paper {
namespace {

double timed(BlockWorld& world, const std::vector<Camera>& flight, const BlockRules& rules) {
    world.forget();
    world.select(flight.front(), rules);
    double ms = 0;
    for (std::size_t k = 1; k < flight.size(); ++k) ms += world.select(flight[k], rules).lod_ms;
    return ms / static_cast<double>(flight.size() - 1);
}

}  // namespace

Figures measure(BlockWorld& world, const std::vector<Camera>& flight, const BlockRules& rules,
                const MeasureOptions& options) {
    Figures f;
    f.frames = static_cast<int>(flight.size());
    world.forget();
    double in_view = 0, reused = 0;
    for (std::size_t k = 0; k < flight.size(); ++k) {
        const BlockFrame frame = world.select(flight[k], rules);
        if (k % static_cast<std::size_t>(options.judge_every) == 0) {
            judge_frame(world, flight[k], frame, rules.tau_px + rules.s_px, f.truth);
            if (rules.metric == BlockMetric::uc) judge_selection(world, flight[k], frame, rules, f.selection);
            f.judged_reused += frame.reused;
        }
        if (k == 0) continue;
        in_view += static_cast<double>(frame.blocks.size());
        reused += frame.reused;
        f.triangles += static_cast<double>(frame.triangles());
        f.dike_triangles += static_cast<double>(frame.dike_triangles);
        f.regenerated += frame.regenerated;
        f.meshes_made += frame.meshes_made;
        f.strips_made += frame.strips_made;
    }
    const auto n = static_cast<double>(flight.size() - 1);
    for (double* sum : {&f.triangles, &f.dike_triangles, &f.regenerated, &f.meshes_made, &f.strips_made}) *sum /= n;
    f.blocks_in_view = in_view / n;
    f.reused_share = in_view > 0 ? reused / in_view : 0;
    f.lod_ms = std::numeric_limits<double>::infinity();
    for (int repeat = 0; repeat < options.repeats; ++repeat) f.lod_ms = std::min(f.lod_ms, timed(world, flight, rules));
    return f;
}

}  // namespace scree::paper
