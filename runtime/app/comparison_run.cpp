#include "runtime/app/comparison_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "common/progress.h"
#include "common/report.h"
#include "runtime/app/audit.h"
#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "runtime/app/image_difference.h"
#include "runtime/report/statistics.h"
#include "runtime/view/camera.h"

namespace scree {
namespace {

// Rounding of float positions and of their projections on screen (Scree lod, 5.2), at 800 px.
constexpr double kRoundingPx = 1e-3;
/// Frames from each pose on: after a leap, and two of an eye that moves on.
constexpr int kGlide = 3;
/// Poses whose pictures are compared: each is kept, 1.9 MB at 800 x 800.
constexpr std::size_t kMostPictures = 16;
/// At tau 0 all that is in view is drawn at its finest, where this holds it.
constexpr std::int64_t kReferenceBudget_bytes = std::int64_t{1} << 30;
constexpr double kReferenceTexture_px = 0.25;
/// About how much longer a frame takes that is judged: for the time left.
constexpr double kJudging = 3;
constexpr int kPictureWidth = 480, kPictureHeight = 320;

using Picture = std::vector<std::uint8_t>;

bool interrupted() { return interrupt_flag().load(); }

/// What needs a scene of its own.
bool same_scene(const ComparisonCase& a, const ComparisonCase& b) {
    return a.lod == b.lod && a.morph == b.morph && a.budget_bytes == b.budget_bytes;
}

/// A scene and what it is drawn with. One at a time: each takes the whole budget.
struct Rig {
    std::unique_ptr<Display> display;
    std::unique_ptr<Scene> scene;  // its threads end first

    static Result<Rig> open(const ComparisonSetup& setup, const ComparisonCase& c) {
        SceneOptions options = setup.scene;
        options.lod = c.lod;
        options.morph = c.morph;
        options.budget_bytes = c.budget_bytes;
        auto scene = Scene::open(setup.store, options);
        if (!scene) return scene.error();
        DisplayOptions display_options{setup.width_px, setup.height_px};
        display_options.keep_heights = true;
        auto display = Display::create(**scene, display_options);
        if (!display) return display.error();
        (*display)->frame_settings().wait_until_drawn = true;
        if (auto ok = (*scene)->start(**display); !ok) return ok.error();
        return Rig{std::move(*display), std::move(*scene)};
    }
    void use(const ComparisonCase& c) {
        scene->options().tau_px = c.tau_px;
        scene->options().texture_tau_px = c.texture_tau_px;
    }
    Result<SceneFrame> settle(const Camera& camera) { return scene->complete({&camera, 1}, interrupted); }
    double draw_ms(const Camera& camera, const SceneFrame& frame) {
        return display->draw(camera, frame.selection->to_render(0), frame.half_curvature).finished_ms;
    }
    Picture picture(const Camera& camera, const SceneFrame& frame) {
        draw_ms(camera, frame);
        return display->target().read_pixels();
    }
};

/// Times of one frame in all rounds. Those of frames in which tiles came in count only where there are no others.
struct FrameTime {
    Series settled, paging;
    void add(double ms, bool paged_in) { (paged_in ? paging : settled).add(ms); }
    double median() const { return (settled.values.empty() ? paging : settled).quantile(0.5); }
};

/// What is known of a case so far.
struct CaseLog {
    std::vector<FrameTime> cold, lod, draw;  // a pose; each frame after the leap; the last of them
    Series triangles;
    ErrorHistogram errors;
    double squared_difference = 0, ssim = 0;
    int pictures = 0;
    std::int64_t timed = 0, paged_in = 0;
    CaseFigures figures;  // what needs no statistics
};

class Run {
public:
    explicit Run(const ComparisonSetup& setup)
        : setup_(setup),
          patterns_(setup.store->dataset().lattice.tile_cells_log2),
          logs_(setup.cases.size()),
          progress_("compare", "frames", setup.quiet) {}

    Result<Comparison> run() {
        const auto start = std::chrono::steady_clock::now();
        auto reader = setup_.store->open_reader();
        if (!reader) return reader.error();
        reader_ = std::move(*reader);
        if (auto ok = find_cameras(); !ok) return ok.error();
        find_rigs();
        double frames = 0;
        for (const RigCases& rig : rigs_)
            if (rig.refused.empty()) frames += static_cast<double>(rig.cases.size() * cameras_.size());
        progress_.set_total(frames * (kJudging + 1 + 2 * (setup_.rounds - 1)));
        if (auto ok = draw_references(); !ok) return ok.error();
        for (int round = 0; round < setup_.rounds; ++round)
            if (auto ok = play(round); !ok) return ok.error();
        progress_.finish();
        conclude();
        result_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return std::move(result_);
    }

private:
    struct RigCases {
        std::vector<std::size_t> cases;
        std::string refused;
    };

    // Forward along the path: its clearance over the ground goes on.
    glm::dvec3 heading(std::size_t pose) const {
        const FlightPath& p = setup_.path;
        glm::dvec3 way{0};
        if (pose + 1 < p.size())
            way = p[pose + 1].eye - p[pose].eye;
        else if (pose > 0)
            way = p[pose].eye - p[pose - 1].eye;
        if (glm::length(way) <= 0) way = p[pose].look - p[pose].eye;
        const double length = glm::length(way);
        return length > 0 ? way / length : glm::dvec3{0};
    }

    Result<void> find_cameras() {
        for (std::size_t k = 0; k < setup_.path.size(); ++k)
            for (int j = 0; j < kGlide; ++j) {
                const glm::dvec3 on = heading(k) * (j * setup_.step_m);
                auto camera = look_at(setup_.path[k].eye + on, setup_.path[k].look + on, setup_.fov_deg,
                                      setup_.width_px, setup_.height_px);
                if (!camera) return camera.error();
                cameras_.push_back(*camera);
            }
        const std::size_t every = (setup_.path.size() + kMostPictures - 1) / kMostPictures;
        for (std::size_t k = 0; k < setup_.path.size(); k += every) pictured_.push_back(k);
        shown_ = pictured_.size() / 2;
        return {};
    }
    const Camera& camera(std::size_t pose, int j) const {
        return cameras_[pose * kGlide + static_cast<std::size_t>(j)];
    }
    const Camera& judged_camera(std::size_t pose) const { return camera(pose, kGlide - 1); }

    void find_rigs() {
        for (std::size_t k = 0; k < setup_.cases.size(); ++k) {
            const auto rig = std::find_if(rigs_.begin(), rigs_.end(), [&](const RigCases& r) {
                return same_scene(setup_.cases[r.cases.front()], setup_.cases[k]);
            });
            const auto built_in = expect_built_in(setup_.cases[k].lod);
            if (rig == rigs_.end())
                rigs_.push_back({{k}, built_in ? std::string() : built_in.error().message});
            else
                rig->cases.push_back(k);
        }
    }

    // Full-resolution pictures, one set for each size of texels that is compared with.
    Result<void> draw_references() {
        ComparisonCase finest;
        finest.tau_px = 0;
        for (const ComparisonCase& c : setup_.cases)
            finest.budget_bytes = std::max({finest.budget_bytes, c.budget_bytes, kReferenceBudget_bytes});
        auto rig = Rig::open(setup_, finest);
        if (!rig) return rig.error();
        result_.renderer = rig->display->context().renderer();
        for (const ComparisonCase& c : setup_.cases) {
            finest.texture_tau_px = reference_texture_px(c);
            if (references_.count(finest.texture_tau_px) != 0) continue;
            rig->use(finest);
            std::vector<Picture>& pictures = references_[finest.texture_tau_px];
            for (const std::size_t pose : pictured_) {
                auto frame = rig->settle(judged_camera(pose));
                if (!frame) return frame.error();
                pictures.push_back(rig->picture(judged_camera(pose), *frame));
                result_.reference_bound_px = std::max(result_.reference_bound_px, frame->selection->max_bound_px);
            }
        }
        return {};
    }
    static double reference_texture_px(const ComparisonCase& c) {
        return c.sweep == Sweep::texture ? std::min(kReferenceTexture_px, c.texture_tau_px) : c.texture_tau_px;
    }

    // Every second round backwards: what slowly changes about the machine falls on all alike.
    Result<void> play(int round) {
        std::vector<std::size_t> order(rigs_.size());
        for (std::size_t k = 0; k < order.size(); ++k) order[k] = round % 2 == 0 ? k : order.size() - 1 - k;
        for (const std::size_t k : order) {
            if (!rigs_[k].refused.empty()) continue;
            if (auto ok = play(rigs_[k], round); !ok) return ok;
        }
        return {};
    }

    Result<void> play(RigCases& cases, int round) {
        auto rig = Rig::open(setup_, setup_.cases[cases.cases.front()]);
        if (!rig && rig.error().code == ErrorCode::usage) {
            cases.refused = rig.error().message;
            return {};
        }
        if (!rig) return rig.error();
        for (const std::size_t at : cases.cases) {
            rig->use(setup_.cases[at]);
            if (auto ok = load(*rig, at, round == 0); !ok) return ok;
            if (auto ok = measure(*rig, at); !ok) return ok;
        }
        return {};
    }

    // Brings in what the path wants, and once judges what is drawn.
    Result<void> load(Rig& rig, std::size_t at, bool judged) {
        for (std::size_t pose = 0; pose < setup_.path.size(); ++pose)
            for (int j = 0; j < kGlide; ++j) {
                auto frame = rig.settle(camera(pose, j));
                if (!frame) return frame.error();
                if (judged && j == kGlide - 1)
                    if (auto ok = judge(rig, at, pose, *frame); !ok) return ok;
                progress_.add(judged ? kJudging : 1);
            }
        return {};
    }

    Result<void> measure(Rig& rig, std::size_t at) {
        CaseLog& log = logs_[at];
        const std::size_t poses = setup_.path.size();
        log.cold.resize(poses);
        log.lod.resize(poses * (kGlide - 1));
        log.draw.resize(poses);
        for (std::size_t pose = 0; pose < poses; ++pose)
            for (int j = 0; j < kGlide; ++j) {
                auto frame = rig.settle(camera(pose, j));
                if (!frame) return frame.error();
                const bool paged_in = frame->uploads > 0 || frame->reused;
                progress_.add(1);
                if (j == 0) {
                    log.cold[pose].add(frame->select_ms, paged_in);
                    continue;
                }
                log.lod[pose * (kGlide - 1) + static_cast<std::size_t>(j - 1)].add(frame->select_ms, paged_in);
                if (j + 1 < kGlide) continue;
                log.draw[pose].add(rig.draw_ms(camera(pose, j), *frame), paged_in);
                ++log.timed;
                log.paged_in += frame->uploads > 0 ? 1 : 0;
            }
        return {};
    }

    Result<void> judge(Rig& rig, std::size_t at, std::size_t pose, const SceneFrame& frame) {
        CaseLog& log = logs_[at];
        const Camera& eye = judged_camera(pose);
        const Selection& s = *frame.selection;
        note_selection(log, s, rig.scene->memory());
        if (auto ok = note_surface(rig, at, eye, frame); !ok) return ok;
        if (const auto found = std::find(pictured_.begin(), pictured_.end(), pose); found != pictured_.end())
            note_picture(at, static_cast<std::size_t>(found - pictured_.begin()), rig.picture(eye, frame));
        return {};
    }

    void note_selection(CaseLog& log, const Selection& s, const MemoryPlan& memory) const {
        const Dataset& d = setup_.store->dataset();
        CaseFigures& f = log.figures;
        log.triangles.add(static_cast<double>(s.triangles));
        f.bound_px = std::max(f.bound_px, s.max_bound_px);
        f.budget_limited_frames += s.budget_limited ? 1 : 0;
        f.resident_bytes = memory.resident_bytes;
        f.tile_bytes =
            std::max(f.tile_bytes, static_cast<std::int64_t>(s.planned_heights.size()) * height_slot_cost(d) +
                                       static_cast<std::int64_t>(s.planned_textures.size()) * texture_slot_cost(d));
    }

    // The drawn surface against the finest data; whether it is whole.
    Result<void> note_surface(Rig& rig, std::size_t at, const Camera& eye, const SceneFrame& frame) {
        const Dataset& d = setup_.store->dataset();
        const DrawList& draws = frame.selection->draws[0];
        const CpuArena& arena = *rig.display->arena();
        const MeshPool* meshes = rig.scene->meshes();
        CaseLog& log = logs_[at];
        CaseFigures& f = log.figures;
        ErrorHistogram errors;
        if (auto ok = audit_frame(*setup_.store, *reader_, {eye, draws, arena, frame.half_curvature, meshes}, errors);
            !ok)
            return ok;
        log.errors.merge(errors);
        const DrawnMesh mesh = drawn_mesh(d, patterns_, draws, arena, meshes);
        note_nearest(mesh, eye);
        const CrackReport cracks = count_cracks(d, draws, mesh);
        const std::int64_t holes = count_holes(d, rig.scene->pager().residency(), eye, draws, frame.half_curvature);
        f.open_edges += cracks.open_edges;
        f.t_junctions += cracks.t_junctions;
        f.holes += holes;
        const ComparisonCase& c = setup_.cases[at];
        const double promised_px = std::max(c.lod.promise_px(c.tau_px), frame.selection->max_bound_px) + kRoundingPx;
        if (c.lod.is_guaranteed())
            f.kept = f.kept && errors.max() <= promised_px && holes == 0 && cracks.open_edges == 0 &&
                     cracks.t_junctions == 0;
        return {};
    }

    void note_nearest(const DrawnMesh& mesh, const Camera& eye) {
        const Dataset& d = setup_.store->dataset();
        double nearest2 = std::numeric_limits<double>::infinity();
        for (const LatticeVertex& v : mesh.corners) {
            const glm::dvec3 to = glm::dvec3{d.lattice.x_m(v.i), d.lattice.y_m(v.j),
                                             d.height_offset_m + d.height_quantum_m * static_cast<double>(v.n)} -
                                  eye.eye;
            nearest2 = std::min(nearest2, glm::dot(to, to));
        }
        nearest_m_ = std::min(nearest_m_, std::sqrt(nearest2));
    }

    void note_picture(std::size_t at, std::size_t number, const Picture& picture) {
        CaseLog& log = logs_[at];
        const Picture& reference = references_[reference_texture_px(setup_.cases[at])][number];
        const double squared = mean_squared_difference(picture, reference);
        const double similar = ssim(setup_.width_px, setup_.height_px, picture, reference);
        log.squared_difference += squared;
        log.ssim += similar;
        ++log.pictures;
        if (number != shown_ || !is_pictured(setup_.cases[at])) return;
        CasePicture shown{at, middle_of(picture), middle_of(reference), psnr_db(squared), similar};
        for (std::size_t k = 0; k < shown.rgb.size(); k += 3) {
            int far = 0;
            for (std::size_t c = 0; c < 3; ++c)
                far = std::max(far, std::abs(int{shown.rgb[k + c]} - int{shown.difference[k + c]}));
            const auto grey = static_cast<std::uint8_t>(std::min(255, kDifferenceGain * far));
            for (std::size_t c = 0; c < 3; ++c) shown.difference[k + c] = grey;
        }
        result_.pictures.push_back(std::move(shown));
    }

    Picture middle_of(const Picture& picture) const {
        const int width = std::min(setup_.width_px, kPictureWidth), height = std::min(setup_.height_px, kPictureHeight);
        const int left = (setup_.width_px - width) / 2, top = (setup_.height_px - height) / 2;
        Picture part;
        part.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        for (int y = 0; y < height; ++y) {
            const auto row = picture.begin() + 3 * ((std::ptrdiff_t{top} + y) * setup_.width_px + left);
            part.insert(part.end(), row, row + 3 * std::ptrdiff_t{width});
        }
        return part;
    }

    void conclude() {
        std::vector<std::size_t> place(setup_.cases.size());
        for (const RigCases& rig : rigs_)
            for (const std::size_t at : rig.cases)
                if (!rig.refused.empty()) refusals_[at] = rig.refused;
        for (std::size_t at = 0; at < setup_.cases.size(); ++at) {
            if (const auto refused = refusals_.find(at); refused != refusals_.end()) {
                result_.skipped.push_back({setup_.cases[at], refused->second});
                continue;
            }
            place[at] = result_.cases.size();
            result_.cases.push_back({setup_.cases[at], figures_of(logs_[at])});
        }
        for (CasePicture& picture : result_.pictures) picture.at = place[picture.at];
        std::sort(result_.pictures.begin(), result_.pictures.end(),
                  [](const CasePicture& a, const CasePicture& b) { return a.at < b.at; });
        describe_setup();
    }

    static CaseFigures figures_of(const CaseLog& log) {
        CaseFigures f = log.figures;
        Series cold, lod, draw, frame;
        for (const FrameTime& t : log.cold) cold.add(t.median());
        for (const FrameTime& t : log.lod) lod.add(t.median());
        for (std::size_t pose = 0; pose < log.draw.size(); ++pose) {
            draw.add(log.draw[pose].median());
            frame.add(lod.values[(pose + 1) * (kGlide - 1) - 1] + draw.values.back());
        }
        f.triangles_mean = log.triangles.mean();
        f.triangles_max = log.triangles.max();
        f.lod_cold_ms = cold.quantile(0.5);
        f.lod_ms = lod.quantile(0.5);
        f.lod_p99_ms = lod.quantile(0.99);
        f.draw_ms = draw.quantile(0.5);
        f.frame_ms = frame.quantile(0.5);
        f.frame_p99_ms = frame.quantile(0.99);
        f.frames_paged_in =
            static_cast<double>(log.paged_in) / static_cast<double>(std::max<std::int64_t>(log.timed, 1));
        f.samples = log.errors.count();
        f.true_max_px = log.errors.max();
        f.true_p99_px = log.errors.quantile(0.99);
        f.true_mean_px = log.errors.mean();
        f.psnr_db = psnr_db(log.squared_difference / std::max(log.pictures, 1));
        f.ssim = log.ssim / std::max(log.pictures, 1);
        return f;
    }

    void describe_setup() {
        const Dataset& d = setup_.store->dataset();
        Comparison& r = result_;
        r.store = std::filesystem::path(setup_.store->path()).filename().string();
        r.frames = static_cast<int>(setup_.path.size());
        r.rounds = setup_.rounds;
        r.width_px = setup_.width_px;
        r.height_px = setup_.height_px;
        r.step_m = setup_.step_m;
        r.reference_texture_px = kReferenceTexture_px;
        r.picture_width_px = std::min(setup_.width_px, kPictureWidth);
        r.picture_height_px = std::min(setup_.height_px, kPictureHeight);
        for (const auto& [texture_px, pictures] : references_)
            if (texture_px != kReferenceTexture_px || references_.size() == 1)
                r.reference_picture = middle_of(pictures[shown_]);
        const Camera& any = cameras_.front();
        const double nearest_m = std::max(nearest_m_, any.near_m);
        r.quantum = {d.height_quantum_error_m, nearest_m,
                     d.height_quantum_error_m * any.focal_px() * any.off_axis_factor() / nearest_m};
    }

    const ComparisonSetup& setup_;
    TilePatterns patterns_;
    std::unique_ptr<TileReader> reader_;
    std::vector<Camera> cameras_;        // kGlide a pose
    std::vector<std::size_t> pictured_;  // poses
    std::size_t shown_ = 0;              // of them
    std::vector<RigCases> rigs_;
    std::vector<CaseLog> logs_;
    std::map<std::size_t, std::string> refusals_;
    std::map<double, std::vector<Picture>> references_;  // by pixels a texel may cover
    double nearest_m_ = std::numeric_limits<double>::infinity();
    Progress progress_;
    Comparison result_;
};

}  // namespace

Result<Comparison> run_comparison(const ComparisonSetup& setup) {
    auto result = Run(setup).run();
    if (!result) return result;
    if (result->cases.empty() && !result->skipped.empty())
        return Error{ErrorCode::usage, result->skipped.front().reason};
    return result;
}

}  // namespace scree
