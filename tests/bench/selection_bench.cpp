// What a frame's thinking costs, without drawing: selection, culling, stitching and requests, flown over a store with
// all that is wanted resident, then the same poses as a flight meets them.
//     scree_selection_bench STORE [TAU] [FRAMES] [METRES A FRAME]
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "runtime/scene/scene.h"
#include "runtime/app/statistics.h"
#include "runtime/view/flight_path.h"

namespace scree {
namespace {

class NoSink final : public TileSink {
public:
    void put_height(std::int32_t, std::span<const SlotVertex>) override {}
    void put_texture(std::int32_t, std::span<const std::uint8_t>) override {}
};

int run(const std::string& file, double tau_px, int frames, double step_m) {
    auto store = SqliteStore::open(file);
    if (!store) return 1;
    SceneOptions options;
    options.tau_px = tau_px;
    auto key_poses = default_flight(**store, 0);
    if (!key_poses) return 1;
    const FlightPath path = paced(*key_poses, step_m, frames);
    for (const bool settled : {true, false}) {
        options.growth_s = settled ? 0 : SceneOptions{}.growth_s;
        options.foresight_s = settled ? 0 : SceneOptions{}.foresight_s;
        auto scene = Scene::open(**store, options);
        NoSink sink;
        if (!scene || !(*scene)->start(sink)) return 1;
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
                      argc > 4 ? std::atof(argv[4]) : 120);
}
