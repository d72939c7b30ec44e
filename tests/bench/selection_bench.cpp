// What a frame's thinking costs, without drawing: selection, culling, stitching and requests, flown over a store with
// all that is wanted resident, then the same poses as a flight meets them.
//     scree_selection_bench STORE [TAU] [FRAMES] [METRES A FRAME] [METHOD [S]]
// METHOD: geomip, rsg, rsg-exact, rsg-paper, rsg-uc, block-rsg
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "runtime/report/statistics.h"
#include "runtime/scene/scene.h"
#include "runtime/view/flight_path.h"

namespace scree {
namespace {

class NoSink final : public TileSink {
public:
    void put_height(std::int32_t, std::span<const SlotVertex>) override {}
    void put_texture(std::int32_t, std::span<const std::uint8_t>) override {}
};

LodSettings method_of(const std::string& name, double s_px) {
    LodSettings lod;
    if (name.starts_with("rsg")) lod.method = LodMethod::rsg;
    if (name == "block-rsg") lod.method = LodMethod::block_rsg;
    if (name == "rsg-exact") lod.reuse = ReuseTest::exact;
    if (name == "rsg-paper") lod.reuse = ReuseTest::paper;
    if (name == "rsg-uc") lod.metric = ErrorMetric::uc;
    lod.s_px = lod.reuse == ReuseTest::off ? 0 : s_px;
    return lod;
}

// The path again, with all of it resident: a frame is a choice and nothing else.
void fly_resident(Scene& scene, const FlightPath& path) {
    Series select_us, nodes, triangles, chosen, remade;
    for (int round = 0; round < 2; ++round)
        for (const FlightPose& pose : path) {
            auto camera = look_at(pose.eye, pose.look, 40, 800, 800);
            if (!camera) return;
            const auto frame = scene.complete({&*camera, 1});
            if (!frame || round == 0) continue;
            select_us.add(1e3 * frame->select_ms);
            nodes.add(static_cast<double>(frame->selection->nodes));
            triangles.add(static_cast<double>(frame->selection->triangles));
            if (scene.mesher() == nullptr) continue;
            chosen.add(static_cast<double>(scene.mesher()->counters().chosen));
            remade.add(static_cast<double>(scene.mesher()->counters().remade));
        }
    fmt::print(
        "resident: median {:.1f} us, p99 {:.1f} us; {:.0f} tiles, {:.0f} triangles; {:.1f} chosen, {:.1f} made\n",
        select_us.quantile(0.5), select_us.quantile(0.99), nodes.mean(), triangles.mean(),
        chosen.values.empty() ? 0 : chosen.mean(), remade.values.empty() ? 0 : remade.mean());
}

int run(const std::string& file, double tau_px, int frames, double step_m, const LodSettings& lod) {
    auto store = SqliteStore::open(file);
    if (!store) return 1;
    SceneOptions options;
    options.tau_px = tau_px;
    options.lod = lod;
    options.budget_bytes = std::int64_t{1} << 30;
    auto key_poses = default_flight(**store, 0);
    if (!key_poses) return 1;
    const FlightPath path = paced(*key_poses, step_m, frames);
    for (const bool settled : {true, false}) {
        options.growth_s = settled ? 0 : SceneOptions{}.growth_s;
        options.foresight_s = settled ? 0 : SceneOptions{}.foresight_s;
        auto scene = Scene::open(**store, options);
        NoSink sink;
        if (!scene || !(*scene)->start(sink)) return 1;
        if (settled) fly_resident(**scene, path);
        Series select_us, nodes, triangles;
        double now_s = 0;
        for (const FlightPose& pose : path) {
            auto camera = look_at(pose.eye, pose.look, 40, 800, 800);
            if (!camera) return 1;
            now_s += 1.0 / 30;
            if (!settled) std::this_thread::sleep_for(std::chrono::milliseconds(10));
            if (settled && !(*scene)->complete({&*camera, 1})) return 1;
            const SceneFrame frame = (*scene)->advance({&*camera, 1}, settled ? now_s + 1e6 : now_s);
            select_us.add(1e3 * frame.select_ms);
            nodes.add(static_cast<double>(frame.selection->nodes));
            triangles.add(static_cast<double>(frame.selection->triangles));
        }
        fmt::print("{}: median {:.1f} us, p99 {:.1f} us, max {:.1f} us; {:.0f} tiles, {:.0f} triangles (mean)\n",
                   settled ? "settled" : "flown", select_us.quantile(0.5), select_us.quantile(0.99), select_us.max(),
                   nodes.mean(), triangles.mean());
    }
    return 0;
}

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    return scree::run(argv[1], argc > 2 ? std::atof(argv[2]) : 1, argc > 3 ? std::atoi(argv[3]) : 300,
                      argc > 4 ? std::atof(argv[4]) : 120,
                      scree::method_of(argc > 5 ? argv[5] : "geomip", argc > 6 ? std::atof(argv[6]) : 0.1));
}
