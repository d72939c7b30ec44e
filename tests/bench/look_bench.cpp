// What the looks of a picture cost, and what they do against shimmer: samples a pixel, anisotropy, and soft ends, on a
// store's overview and on a slow low flight. Every pose is drawn in all ways by turns; printed is the median CPU time
// of a frame, all threads, which a busy machine changes less than the time by the clock.
//     scree_look_bench STORE [FRAMES [edge]]
// edge: what soft ends cost alone, by turns with none.
//
// Shimmer: how much more the picture changes from frame to frame than it should. Both flights' differences from one
// frame to the next are taken, of the picture and of a reference with 16 samples a pixel in an even grid, anisotropy
// 16, averaged as light; shimmer is the mean of the absolute difference of the two, of 255, over pixels and channels.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/process_usage.h"
#include "common/store/sqlite_store.h"
#include "runtime/render/context.h"
#include "runtime/scene/scene.h"
#include "runtime/scene/scene_renderer.h"
#include "runtime/view/flight_path.h"

namespace scree {
namespace {

constexpr int kSide_px = 800, kShimmerSide_px = 300, kFiner = 4;
constexpr double kFov_deg = 40, kStep_m = 3;
constexpr std::int64_t kBudget_bytes = std::int64_t{128} << 20;

template <class T>
T must(Result<T> result) {
    if (result) return std::move(*result);
    fmt::print(stderr, "{}\n", result.error().message);
    std::exit(1);
}

double cpu_ms() { return 1e3 * process_usage().cpu_seconds; }

/// The same tiles for renderers of different anisotropy.
class Renderers final : public TileSink {
public:
    void add(const Scene& scene, double anisotropy) {
        made_.push_back({anisotropy, must(SceneRenderer::create(scene, {0, anisotropy}))});
    }
    SceneRenderer& of(double anisotropy) {
        for (auto& [each, renderer] : made_)
            if (each == anisotropy) return *renderer;
        std::abort();
    }
    Result<void> renew(const Dataset& dataset, const MemoryPlan& plan) override {
        for (auto& made : made_)
            if (auto ok = made.second->renew(dataset, plan); !ok) return ok;
        return {};
    }
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override {
        for (auto& made : made_) made.second->put_height(slot, vertices);
    }
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override {
        for (auto& made : made_) made.second->put_texture(slot, chain);
    }

private:
    std::vector<std::pair<double, std::unique_ptr<SceneRenderer>>> made_;
};

struct Way {
    std::string name;
    int samples = 0;
    double anisotropy = 1;
    bool soft = true;
    std::vector<double> frame_ms{};
    double shimmer = 0;
    std::vector<std::uint8_t> last{}, now{};
};

std::vector<Way> all_ways() {
    std::vector<Way> ways{{"none", 0, 1}, {"--edge hard", 0, 1, false}};
    for (const int samples : {2, 4, 8}) ways.push_back({fmt::format("--msaa {}", samples), samples, 1});
    for (const int most : {2, 4, 16}) ways.push_back({fmt::format("--anisotropy {}", most), 0, double(most)});
    ways.push_back({"--msaa 4 --anisotropy 4", 4, 4});
    return ways;
}

std::vector<Way> edge_ways() { return {{"soft", 0, 1}, {"hard", 0, 1, false}, {"soft", 0, 1}, {"hard", 0, 1, false}}; }

double light_of(std::uint8_t srgb) {
    const double c = srgb / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// The mean light of kFiner x kFiner pixels, as sRGB.
std::vector<double> averaged(const std::vector<std::uint8_t>& fine, int side_px) {
    std::array<double, 256> light{};
    for (int k = 0; k < 256; ++k) light[static_cast<std::size_t>(k)] = light_of(static_cast<std::uint8_t>(k));
    std::vector<double> out(static_cast<std::size_t>(3 * side_px * side_px));
    for (int y = 0; y < kFiner * side_px; ++y)
        for (int x = 0; x < kFiner * side_px; ++x)
            for (int c = 0; c < 3; ++c)
                out[static_cast<std::size_t>(3 * (y / kFiner * side_px + x / kFiner) + c)] +=
                    light[fine[static_cast<std::size_t>(3 * (y * kFiner * side_px + x) + c)]] / (kFiner * kFiner);
    for (double& v : out) v = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
    return out;
}

class Bench {
public:
    Bench(const std::string& file, int frames)
        : context_(must(create_headless_context())), store_(must(SqliteStore::open(file))), frames_(frames) {
        SceneOptions options;
        options.budget_bytes = kBudget_bytes;
        scene_ = must(Scene::open(*store_, options));
        for (const double anisotropy : {1.0, 2.0, 4.0, 16.0}) renderers_.add(*scene_, anisotropy);
        must_do(scene_->start(renderers_));
    }

    void cost(const std::string& view, const FlightPose& first, glm::dvec3 step, std::vector<Way> ways) {
        for (int frame = -1; frame < frames_; ++frame) {
            const Camera camera = camera_of(first, static_cast<double>(frame) * step, kSide_px);
            for (Way& way : ways) {
                const double ms = draw(way, camera, camera, target(kSide_px, way.samples));
                if (frame >= 0) way.frame_ms.push_back(ms);
            }
        }
        fmt::print("{}, {} frames of {} x {}:\n", view, frames_, kSide_px, kSide_px);
        const double plain = median(ways.front().frame_ms);
        for (const Way& way : ways)
            fmt::print("  {:<26} {:7.2f} ms CPU  {:5.3f}\n", way.name, median(way.frame_ms),
                       median(way.frame_ms) / plain);
    }

    void shimmer(const std::string& view, const FlightPose& first, glm::dvec3 step) {
        auto ways = all_ways();
        std::vector<double> reference_last;
        double changed = 0;
        for (int frame = 0; frame <= frames_; ++frame) {
            const Camera camera = camera_of(first, static_cast<double>(frame) * step, kShimmerSide_px);
            Camera fine = camera;
            fine.width_px = fine.height_px = kFiner * kShimmerSide_px;
            Way best{"", 0, 16};
            RenderTarget& fine_target = target(kFiner * kShimmerSide_px, 0);
            draw(best, camera, fine, fine_target);
            const auto reference = averaged(fine_target.read_pixels(), kShimmerSide_px);
            for (Way& way : ways) {
                RenderTarget& picture = target(kShimmerSide_px, way.samples);
                draw(way, camera, camera, picture);
                way.now = picture.read_pixels();
                if (frame > 0) way.shimmer += excess(way, reference, reference_last);
                way.last.swap(way.now);
            }
            if (frame > 0)
                for (std::size_t k = 0; k < reference.size(); ++k)
                    changed += std::abs(reference[k] - reference_last[k]) / static_cast<double>(reference.size());
            reference_last = reference;
        }
        fmt::print("{}, shimmer over {} frames of {} x {} (the reference changes by {:.2f} a frame):\n", view, frames_,
                   kShimmerSide_px, kShimmerSide_px, changed / frames_);
        for (const Way& way : ways)
            fmt::print("  {:<26} {:6.3f} of 255  {:5.3f}\n", way.name, way.shimmer / frames_,
                       way.shimmer / ways.front().shimmer);
    }

    FlightPose above() const { return overview(store_->dataset(), kFov_deg, 1); }
    FlightPose low() const { return must(default_flight(*store_, 16))[3]; }

private:
    static void must_do(const Result<void>& result) {
        if (result) return;
        fmt::print(stderr, "{}\n", result.error().message);
        std::exit(1);
    }
    static double median(std::vector<double> values) {
        std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
        return values[values.size() / 2];
    }
    static Camera camera_of(const FlightPose& pose, glm::dvec3 moved, int side_px) {
        return must(look_at(pose.eye + moved, pose.look + moved, kFov_deg, side_px, side_px));
    }
    static double excess(const Way& way, const std::vector<double>& reference, const std::vector<double>& last) {
        double sum = 0;
        for (std::size_t k = 0; k < reference.size(); ++k)
            sum += std::abs((way.now[k] - way.last[k]) - (reference[k] - last[k]));
        return sum / static_cast<double>(reference.size());
    }

    RenderTarget& target(int side_px, int samples) {
        for (auto& [size, count, made] : targets_)
            if (size == side_px && count == samples) return *made;
        targets_.push_back({side_px, samples,
                            std::make_unique<RenderTarget>(must(RenderTarget::create({side_px, side_px, samples})))});
        return *std::get<2>(targets_.back());
    }

    /// CPU time of drawing alone.
    double draw(const Way& way, const Camera& chosen_for, const Camera& camera, RenderTarget& picture) {
        const SceneFrame frame = must(scene_->complete({&chosen_for, 1}));
        SceneRenderer& renderer = renderers_.of(way.anisotropy);
        FrameSettings& settings = renderer.settings();
        settings = scenery(store_->dataset());
        settings.soft_edge = way.soft;
        settings.wait_until_drawn = true;
        const double before = cpu_ms();
        renderer.draw(camera, frame.selection->to_render(0), frame.half_curvature, picture);
        return cpu_ms() - before;
    }

    std::unique_ptr<GlContext> context_;  // goes last
    std::unique_ptr<SqliteStore> store_;
    std::unique_ptr<Scene> scene_;
    Renderers renderers_;
    std::vector<std::tuple<int, int, std::unique_ptr<RenderTarget>>> targets_;
    int frames_;
};

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    using namespace scree;
    if (argc < 2) {
        fmt::print(stderr, "scree_look_bench STORE [FRAMES [edge]]\n");
        return 2;
    }
    Bench bench(argv[1], argc > 2 ? std::atoi(argv[2]) : 20);
    const FlightPose low = bench.low(), above = bench.above();
    const glm::dvec3 ahead = glm::normalize(low.look - low.eye) * glm::dvec3(kStep_m, kStep_m, 0);
    const bool edge_alone = argc > 3 && std::string(argv[3]) == "edge";
    const std::vector<Way> ways = edge_alone ? edge_ways() : all_ways();
    bench.cost("low flight", low, ahead, ways);
    bench.cost("overview", above, ahead, ways);
    if (edge_alone) return 0;
    bench.shimmer("low flight", low, ahead);
    bench.shimmer("overview", above, 5.0 * ahead);
    return 0;
}
