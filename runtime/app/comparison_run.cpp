#include "runtime/app/comparison_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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
#include "runtime/app/block_display.h"
#include "runtime/app/block_scene.h"
#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "runtime/app/image_difference.h"
#include "runtime/lod/block_truth.h"
#include "runtime/report/statistics.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"

namespace scree {
namespace {

/// Frames from each pose on: after a leap, and two of an eye that moves on.
constexpr int kGlide = 3;
/// Poses whose pictures are compared: each is kept, 1.9 MB at 800 x 800.
constexpr std::size_t kMostPictures = 16;
/// At tau 0 all that is in view is drawn at its finest, where this holds it.
constexpr std::int64_t kReferenceBudget_bytes = std::int64_t{1} << 30;
constexpr double kReferenceTexture_px = 0.25;
/// About how much longer a frame takes that is judged: for the time left.
constexpr double kJudging = 3;
constexpr int kQuanta = 6;
constexpr int kPictureWidth = 480, kPictureHeight = 320;

using Picture = std::vector<std::uint8_t>;

bool interrupted() { return interrupt_flag().load(); }

/// What needs a scene of its own.
bool same_scene(const ComparisonCase& a, const ComparisonCase& b) {
    return a.lod == b.lod && a.morph == b.morph && a.budget_bytes == b.budget_bytes;
}

/// A frame that is settled: of a scene, or of blocks.
struct Settled {
    SceneFrame frame;
    double select_ms = 0;
    bool paged_in = false;  ///< or not chosen at all: its time says nothing
};

bool has_blocks(const ComparisonCase& c) { return c.lod.cracks == CrackFix::dike; }

/// A scene, or blocks, and what it is drawn with. One at a time: each takes the whole budget.
struct Rig {
    std::unique_ptr<Display> display;
    std::unique_ptr<Scene> scene;  // its threads end first
    std::unique_ptr<BlockScene> blocks;
    std::unique_ptr<BlockDisplay> block_display;

    static Result<Rig> open_blocks(const ComparisonSetup& setup, const SceneOptions& options) {
        Rig rig;
        auto blocks = BlockScene::open(*setup.store, options);
        if (!blocks) return blocks.error();
        rig.blocks = std::move(*blocks);
        auto display = BlockDisplay::create(*rig.blocks, DisplayOptions{setup.width_px, setup.height_px});
        if (!display) return display.error();
        rig.block_display = std::move(*display);
        rig.block_display->frame_settings().wait_until_drawn = true;
        return rig;
    }

    static Result<Rig> open(const ComparisonSetup& setup, const ComparisonCase& c) {
        SceneOptions options = setup.scene;
        options.lod = c.lod;
        options.morph = c.morph;
        options.budget_bytes = c.budget_bytes;
        if (has_blocks(c)) return open_blocks(setup, options);
        auto scene = Scene::open(setup.store, options);
        if (!scene) return scene.error();
        DisplayOptions display_options{setup.width_px, setup.height_px};
        display_options.keep_heights = true;
        auto display = Display::create(**scene, display_options);
        if (!display) return display.error();
        (*display)->frame_settings().wait_until_drawn = true;
        if (auto ok = (*scene)->start(**display); !ok) return ok.error();
        return Rig{std::move(*display), std::move(*scene), {}, {}};
    }
    void use(const ComparisonCase& c) {
        if (blocks) return blocks->set_tau_px(c.tau_px);
        scene->options().tau_px = c.tau_px;
        scene->options().texture_tau_px = c.texture_tau_px;
    }
    Result<Settled> settle(const Camera& camera) {
        if (blocks) return Settled{{}, blocks->select(camera).lod_ms, false};
        auto frame = scene->complete({&camera, 1}, interrupted);
        if (!frame) return frame.error();
        return Settled{*frame, frame->select_ms, frame->uploads > 0 || frame->reused};
    }
    double draw_ms(const Camera& camera, const SceneFrame& frame) {
        if (blocks) return block_display->draw(camera).finished_ms;
        return display->draw(camera, frame.selection->to_render(0), frame.half_curvature).finished_ms;
    }
    Picture picture(const Camera& camera, const SceneFrame& frame) {
        draw_ms(camera, frame);
        return (blocks ? block_display->target() : display->target()).read_pixels();
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
    BlockTruth block_errors;  // of blocks, in place of those
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

    /// What pictures are compared with: those of blocks, or of tiles whose texels cover so many pixels.
    using Look = std::pair<bool, double>;
    static Look look_of(const ComparisonCase& c) {
        return has_blocks(c) ? Look{true, 0} : Look{false, reference_texture_px(c)};
    }

    // Full-resolution pictures, one set for each look.
    Result<void> draw_references() {
        ComparisonCase finest;
        finest.tau_px = 0;
        for (const ComparisonCase& c : setup_.cases)
            finest.budget_bytes = std::max({finest.budget_bytes, c.budget_bytes, kReferenceBudget_bytes});
        for (const bool blocks : {false, true}) {
            finest.lod = LodSettings{};
            if (blocks)
                finest.lod = LodSettings{LodMethod::rsg, ErrorMetric::guaranteed, ReuseTest::off, 0,
                                         Culling::box,   CrackFix::dike};
            if (std::none_of(setup_.cases.begin(), setup_.cases.end(),
                             [&](const ComparisonCase& c) { return has_blocks(c) == blocks; }) &&
                blocks)
                continue;
            auto rig = Rig::open(setup_, finest);
            // Where blocks cannot be had none of their cases is measured either.
            if (!rig && blocks && rig.error().code == ErrorCode::usage) continue;
            if (!rig) return rig.error();
            if (!blocks) result_.renderer = rig->display->context().renderer();
            for (const ComparisonCase& c : setup_.cases)
                if (has_blocks(c) == blocks)
                    if (auto ok = draw_reference(*rig, finest, look_of(c)); !ok) return ok;
        }
        return {};
    }

    Result<void> draw_reference(Rig& rig, ComparisonCase& finest, const Look& look) {
        if (references_.count(look) != 0) return {};
        finest.texture_tau_px = look.second;
        rig.use(finest);
        std::vector<Picture>& pictures = references_[look];
        for (const std::size_t pose : pictured_) {
            auto settled = rig.settle(judged_camera(pose));
            if (!settled) return settled.error();
            pictures.push_back(rig.picture(judged_camera(pose), settled->frame));
            if (rig.blocks) continue;
            if (references_.size() == 1) note_quanta(rig, judged_camera(pose), settled->frame);
            result_.reference_bound_px = std::max(result_.reference_bound_px, settled->frame.selection->max_bound_px);
        }
        return {};
    }

    // What coarser quanta would be seen as: the finest heights in view, rounded as they are read out.
    void note_quanta(Rig& rig, const Camera& eye, const SceneFrame& frame) {
        const Dataset& d = setup_.store->dataset();
        const DrawnMesh mesh = drawn_mesh(d, patterns_, frame.selection->draws[0], *rig.display->arena(), nullptr);
        const Frustum frustum(eye);
        const double scale_px = eye.focal_px() * eye.off_axis_factor();
        for (const LatticeVertex& v : mesh.corners) {
            const double n = static_cast<double>(v.n);
            glm::dvec3 point{d.lattice.x_m(v.i), d.lattice.y_m(v.j), d.height_offset_m + d.height_quantum_m * n};
            const glm::dvec3 to = point - eye.eye;
            const double h2 = to.x * to.x + to.y * to.y;
            point.z -= h2 * frame.half_curvature;
            if (!frustum.contains(point)) continue;
            const double px_per_m = scale_px * std::sqrt(h2) / (h2 + (point.z - eye.eye.z) * (point.z - eye.eye.z));
            for (int k = 0; k < kQuanta; ++k) {
                const double step_n = std::ldexp(1, k + 1);
                const double error_m = std::abs(std::nearbyint(n / step_n) * step_n - n) * d.height_quantum_m;
                quanta_[static_cast<std::size_t>(k)].add(error_m * px_per_m);
            }
        }
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
                    if (auto ok = judge(rig, at, pose, frame->frame); !ok) return ok;
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
                const bool paged_in = frame->paged_in;
                progress_.add(1);
                if (j == 0) {
                    log.cold[pose].add(frame->select_ms, paged_in);
                    continue;
                }
                log.lod[pose * (kGlide - 1) + static_cast<std::size_t>(j - 1)].add(frame->select_ms, paged_in);
                if (j + 1 < kGlide) continue;
                log.draw[pose].add(rig.draw_ms(camera(pose, j), frame->frame), paged_in);
                ++log.timed;
                log.paged_in += frame->frame.uploads > 0 ? 1 : 0;
            }
        return {};
    }

    Result<void> judge(Rig& rig, std::size_t at, std::size_t pose, const SceneFrame& frame) {
        CaseLog& log = logs_[at];
        const Camera& eye = judged_camera(pose);
        if (rig.blocks) {
            note_blocks(rig, at, eye);
        } else {
            note_selection(log, *frame.selection, rig.scene->memory());
            if (auto ok = note_surface(rig, at, eye, frame); !ok) return ok;
        }
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

    void note_blocks(Rig& rig, std::size_t at, const Camera& eye) {
        BlockScene& blocks = *rig.blocks;
        CaseLog& log = logs_[at];
        CaseFigures& f = log.figures;
        const BlockFrame& frame = blocks.select(eye);
        log.triangles.add(static_cast<double>(frame.triangles()));
        f.resident_bytes = f.tile_bytes = blocks.resident_bytes();
        const double promised_px = blocks.promise_px().value_or(0);
        f.bound_px = std::max(f.bound_px, promised_px);
        judge_frame(blocks.world(), eye, frame, promised_px + kRoundingPx, log.block_errors, blocks.half_curvature());
        const CrackReport cracks = blocks.count_cracks();
        f.open_edges += cracks.open_edges;
        f.t_junctions += cracks.t_junctions;
        f.holes += blocks.count_holes(eye);
        if (blocks.promise_px())
            f.kept = std::max(log.block_errors.blocks.max_px(), log.block_errors.dikes.max_px()) <=
                         promised_px + kRoundingPx &&
                     f.holes == 0 && f.open_edges == 0 && f.t_junctions == 0;
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
        const Picture& reference = references_[look_of(setup_.cases[at])][number];
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
        if (const BlockTruth& t = log.block_errors; t.blocks.count() > 0) {
            f.samples = t.blocks.count();
            f.true_max_px = std::max(t.blocks.max_px(), t.dikes.max_px());
            f.true_p99_px = t.blocks.quantile_px(0.99);
            f.true_mean_px = t.blocks.mean_px();
        }
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
        for (const auto& [look, pictures] : references_)
            if (!look.first && (look.second != kReferenceTexture_px || r.reference_picture.empty()))
                r.reference_picture = middle_of(pictures[shown_]);
        for (int k = 0; k < kQuanta; ++k) {
            const ErrorHistogram& seen = quanta_[static_cast<std::size_t>(k)];
            if (seen.count() > 0)
                r.coarser_quanta.push_back(
                    {std::ldexp(d.height_quantum_m, k + 1), seen.max(), seen.quantile(0.99), seen.mean()});
        }
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
    std::map<Look, std::vector<Picture>> references_;
    std::array<ErrorHistogram, kQuanta> quanta_;  // twice the store's, four times ..
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
