// Scene: a store with everything needed to choose and hold what is drawn of it: memory plan, pager, selector. No
// OpenGL: the sink decides where tiles go. Frame-loop thread only.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/store/sqlite_store.h"
#include "runtime/lod/lod_method.h"
#include "runtime/lod/page_mesher.h"
#include "runtime/lod/selection.h"
#include "runtime/paging/pager.h"
#include "runtime/scene/store_watch.h"
#include "runtime/view/curvature.h"
#include "runtime/view/edge_field.h"
#include "runtime/view/foresight.h"

namespace scree {

struct SceneOptions {
    std::int64_t budget_bytes = std::int64_t{256} << 20;  ///< ceiling of tile memory, staging included
    double tau_px = 1;
    double texture_tau_px = 1;
    Curvature curvature = Curvature::automatic;
    LodSettings lod;         ///< fixed from open() on
    bool morph = true;       ///< false: discrete levels
    double growth_s = 0.08;  ///< a level, in which a tile that came late grows out of what stood in for it
    double foresight_s = 1;  ///< how far ahead of the eye tiles are fetched; 0: not at all
    int loader_threads = 2;
    int latency_ms = 0;
    bool textures = true;
    /// Keep an EdgeField, for ends that dissolve: A sixteenth of the budget at most, and no more than 1.5 MB, 5 with
    /// `follow`; open() reads some textures. Not without textures.
    bool soft_edge = true;
    bool follow = false;  ///< take up what updates make of the store; else a changed store is an error of complete()
    std::int64_t upload_bytes_per_frame = 4 << 20;  ///< about 90 textures; larger arrives sooner and may hitch
    /// Told what is wrong and is borne: a damaged tile, an update that cannot be opened. Empty: to standard error.
    std::function<void(const std::string& message)> on_trouble{};
};

/// Times and counts of one frame's thinking, before anything is drawn.
struct SceneFrame {
    const Selection* selection = nullptr;
    double half_curvature = 0;
    double select_ms = 0;  ///< selection and requests, CPU time of the thread
    std::int64_t uploads = 0;
    bool stand_ins = false;    ///< drawn coarser than full residency would
    bool taking_over = false;  ///< an update of the store is being loaded; what is drawn is still what was before
    bool reused = false;       ///< nothing had changed: the last frame's selection, not chosen again
};

class Scene {
public:
    /// Errors: ErrorCode::usage where the budget is too small or `options.lod` is not built in; for CrackFix::dike,
    /// which is a BlockScene.
    static Result<std::unique_ptr<Scene>> open(std::shared_ptr<const SqliteStore> store, const SceneOptions& options);
    /// `store` outlives the scene.
    static Result<std::unique_ptr<Scene>> open(const SqliteStore& store, const SceneOptions& options) {
        return open(std::shared_ptr<const SqliteStore>(std::shared_ptr<void>(), &store), options);
    }
    ~Scene();
    /// Makes the pager with its sink (the sink's slots are sized by memory()).
    Result<void> start(TileSink& sink);

    /// Of the state of the store that is drawn. An update may replace it in any of the calls below.
    const Dataset& dataset() const { return store_->dataset(); }
    const TileStore& store() const { return *store_; }
    std::shared_ptr<const SqliteStore> shared_store() const { return store_; }
    /// Updates taken up: of which what is drawn is the last.
    std::int64_t updates() const { return updates_; }
    const MemoryPlan& memory() const { return memory_; }
    /// What thins the tiles drawn; null where they are drawn by patterns (geomip).
    const PageMesher* mesher() const { return mesher_.get(); }
    /// The meshes that the tiles drawn are drawn with; stays where it is. Null likewise.
    const MeshPool* meshes() const { return mesher_ ? &mesher_->pool() : nullptr; }
    /// Where the ground ends, of dataset(). Null without options.soft_edge.
    const std::shared_ptr<const EdgeField>& edge_field() const { return edge_field_; }
    /// Greatest of memory().resident_bytes so far.
    std::int64_t peak_resident_bytes() const { return peak_resident_bytes_; }
    /// Of all the flight, whatever was taken up.
    PagerCounters counters() const;
    LoaderCounters loader_counters(TileKind kind) const;
    const Pager& pager() const { return *pager_; }
    /// Of the slots that tiles of a kind hold or are being loaded into, with their bookkeeping: a part of
    /// memory().resident_bytes.
    std::int64_t tile_bytes(TileKind kind) const;
    SceneOptions& options() { return options_; }
    const SceneOptions& options() const { return options_; }

    /// Once a frame, where options.follow is set: takes up what an update has made of the store. It is loaded beside
    /// what is drawn, and drawn once it is as complete. Waits for nothing, unless memory must be divided anew, which
    /// costs a frame. Errors: ErrorCode::store where another store has taken the place of this one; those of start().
    Result<void> follow();
    /// Heights so many times as high as they are, 0.01..100, from now on: the store is opened again, and drawing starts
    /// over as it does after an update for which memory is divided anew: roots at once, what is finer as it comes.
    /// Counts among updates(). The eye stays where it is. Errors: ErrorCode::usage out of range, those of SqliteStore
    /// (then nothing has changed), those of start().
    Result<void> set_exaggeration(double exaggeration);
    /// One frame's arrivals, selection and requests at `now_s`, a clock that only has to move forward. While tiles are
    /// missing it may look again for `patience_s`: what is a small part of a long frame fills the gaps of the picture.
    /// The selection is valid until the next call.
    SceneFrame advance(std::span<const Camera> views, double now_s, double patience_s = 0);
    /// The first pictures: looks again until nothing is missing or `seconds` have passed, and what comes meanwhile has
    /// nothing to grow out of.
    SceneFrame catch_up(std::span<const Camera> views, double now_s, double seconds);
    /// The same until nothing is missing, and nothing grows. An update that is under way is waited for. Errors:
    /// ErrorCode::store if what is missing never comes, those of follow(); ErrorCode::io where the store was changed
    /// and is not followed.
    Result<SceneFrame> complete(std::span<const Camera> views, const std::function<bool()>& stop = {});

private:
    /// Passes tiles on, and their vertices' costs to the mesher.
    class Sink;
    Scene(std::shared_ptr<const SqliteStore> store, const SceneOptions& options, const MemoryPlan& memory);
    void make_selectors();
    void make_mesher();
    void make_edge_field();
    void mesh(std::span<const Camera> views, double half_curvature, const Residency& residency, Selection& selection);
    static MoreMemory more_memory(const Dataset& dataset, const SceneOptions& options);
    static Result<MemoryPlan> plan_of(const Dataset& dataset, const SceneOptions& options);
    void forget_selections();
    void tell(const std::string& message) const;
    void begin_watch();
    Result<void> make_pager();
    Result<void> use_store(std::shared_ptr<const SqliteStore> store);
    Result<void> expect_same_place(const SqliteStore& next) const;
    bool fits_in_place(const Dataset& next) const;
    Result<void> take_up(OpenedStore opened);
    Result<void> start_over(std::shared_ptr<const SqliteStore> store);
    void switch_over();
    Result<bool> step_to_update();
    bool think_of_both(std::span<const Camera> views, double growth_s, SceneFrame& frame);
    double curvature_of(const Dataset& dataset, std::span<const Camera> views) const;
    void note_motion(std::span<const Camera> views, double now_s);
    SceneFrame think(std::span<const Camera> views, double growth_s);
    bool nothing_changed(std::span<const Camera> views, const SelectionSettings& settings) const;
    SceneFrame think_again(std::span<const Camera> views, double growth_s, SceneFrame frame, double seconds);
    SelectionSettings selection_settings(double half_curvature, double growth_s) const;
    bool look_ahead(std::span<const Camera> views, SelectionSettings settings);
    Pager::Wishes with_foreseen(const Pager::Wishes& now, bool fresh);

    std::shared_ptr<const SqliteStore> store_;
    SceneOptions options_;
    MemoryPlan memory_;
    std::shared_ptr<const EdgeField> edge_field_, coming_edge_field_;
    TileSink* sink_ = nullptr;
    std::unique_ptr<PageMesher> mesher_;
    std::unique_ptr<Sink> mesher_sink_;
    std::unique_ptr<Pager> pager_;
    std::unique_ptr<Selector> selector_, ahead_;
    std::unique_ptr<StoreWatch> watch_;
    /// What is being taken up.
    std::shared_ptr<const SqliteStore> coming_;
    std::unique_ptr<Selector> coming_selector_;
    std::optional<double> roots_since_s_;  ///< when its roots had come
    std::string trouble_;                  ///< why the store cannot be opened
    std::int64_t updates_ = 0;
    // Of pagers that are gone.
    PagerCounters earlier_;
    std::array<LoaderCounters, 2> earlier_loads_;
    std::int64_t peak_resident_bytes_;
    Foresight foresight_;
    const Selection* foreseen_ = nullptr;  ///< of the last look ahead; null: none
    std::vector<std::int32_t> standing_heights_, standing_textures_;
    std::vector<TileRequest> requests_, foreseen_requests_;
    std::uint64_t frame_ = 0;
    // What the last selection was chosen from, to know when it need not be chosen again.
    SceneFrame last_;
    glm::dvec3 last_eye_{0};
    double last_now_s_ = 0;
    double moved_m_ = 0;  ///< by the eye in a frame; falls slowly, lest what has come without growing shrinks back
    std::vector<Camera> last_views_;
    SelectionSettings last_settings_;
    std::int64_t last_changes_ = -1;
};

}  // namespace scree
