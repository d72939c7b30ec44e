#include "tools/verify/tile_walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

std::string name(const char* kind, TileId id) { return fmt::format("{} tile {}/{}/{}", kind, id.level, id.x, id.y); }

}  // namespace

TileWalk::TileWalk(const Dataset& dataset, TileReader& reader, VerifyReport& report, ProblemList& problems,
                   std::function<bool()> tick)
    : dataset_(dataset),
      lattice_(dataset.lattice),
      reader_(reader),
      report_(report),
      problems_(problems),
      tick_(std::move(tick)),
      heights_(reader, dataset) {}

Result<void> TileWalk::run() {
    visit_roots();
    if (!failure_) finish_dataset();
    if (failure_) return *failure_;
    return {};
}

void TileWalk::visit_roots() {
    bool any = false;
    for (std::int64_t y = 0; y < lattice_.root_rows; ++y) {
        for (std::int64_t x = 0; x < lattice_.root_columns && !failure_; ++x) {
            const TileId root{0, x, y};
            auto tile = heights_.get(root);  // a root without data is not stored
            if (tile && !*tile) continue;
            any = true;
            if (!visit(root)) all_read_ = false;
        }
    }
    if (!any) problems_.add("no root is stored");
}

// False: something under `id` could not be read, so that what depends on all of it cannot be judged.
bool TileWalk::visit(TileId id) {
    if (failure_) return false;
    auto tile = heights_.get(id);
    if (!tile) {
        ++height_rows_;
        take_error("height", id, tile.error());
        return false;
    }
    if (!*tile) {
        problems_.add(name("height", id) + " is missing: its parent says that it is stored");
        return false;
    }
    ++height_rows_;
    ++report_.tiles_checked;
    tick_row();

    const int n = lattice_.tile_cells_log2;
    const Frame* parent = frames_.empty() ? nullptr : frames_.back().get();
    frames_.push_back(std::make_unique<Frame>());
    Frame& frame = *frames_.back();
    frame.id = id;
    frame.tile = *tile;
    frame.block = coarsest_block(frame.tile->samples, n);
    frame.stride = lattice_.tile_extent(id.level) / 2;
    frame.textured = parent == nullptr || refined(*parent);
    if (frame.textured) frame.alpha = AlphaRaster(dataset_.texture_size());

    check_header(frame, parent);
    check_range(frame);
    if (parent != nullptr) compare_with_parent(frame, *parent);
    compare_with_neighbours(frame);
    // A deepest tile that says it has children is a leaf all the same: the walk goes no further down.
    if (is_leaf(frame)) {
        visit_leaf(frame);
    } else {
        check_grading(frame);
        for (int q = 0; q < 4 && !failure_; ++q)
            if ((frame.tile->header.child_mask >> q & 1) != 0 && !visit(child_of(id, q))) frame.complete = false;
        frame.texture_children = frame.tile->header.child_mask;
        check_coarsest_bound(frame);
    }
    if (frame.textured && !failure_) check_texture(frame);

    const bool complete = frame.complete && !failure_;
    if (frames_.size() > 1 && complete && frame.textured)
        halve_into_quadrant(frame.alpha, quadrant_of(id), frames_[frames_.size() - 2]->alpha);
    if (id.level == 0) {
        lowest_n_ = std::min(lowest_n_, frame.tile->header.own.min_n);
        highest_n_ = std::max(highest_n_, frame.tile->header.own.max_n);
    }
    frames_.pop_back();
    return complete;
}

bool TileWalk::is_leaf(const Frame& frame) const {
    return frame.tile->header.is_leaf() || frame.id.level >= lattice_.deepest_level;
}

void TileWalk::check_header(const Frame& frame, const Frame* parent) {
    const HeightTileHeader& header = frame.tile->header;
    const bool deepest = frame.id.level == lattice_.deepest_level;
    if (deepest && !header.is_leaf())
        problems_.add(name("height", frame.id) + " is of the deepest level and says that it has children");
    if (!header.is_leaf() && !frame.tile->presence.empty())
        problems_.add(name("height", frame.id) + " holds presence bits, which belong to leaves");
    check_texture_end(frame);
    if (parent == nullptr) return;
    const HeightTileHeader& above = parent->tile->header;
    const int q = quadrant_of(frame.id);
    if ((above.leaf_mask >> q & 1) != (header.is_leaf() && !deepest ? 1 : 0))
        problems_.add(fmt::format("{} is {} leaf above the deepest level; its parent says otherwise",
                                  name("height", frame.id), header.is_leaf() && !deepest ? "a" : "no"));
    if ((above.texture_end_mask >> q & 1) != (header.texture_ends ? 1 : 0))
        problems_.add(
            fmt::format("{}: its parent says otherwise of whether its textures end here", name("height", frame.id)));
}

void TileWalk::check_range(const Frame& frame) {
    const HeightTileHeader& header = frame.tile->header;
    auto [low, high] = std::minmax_element(frame.tile->samples.begin(), frame.tile->samples.end());
    std::int32_t min_n = *low, max_n = *high;
    for (std::size_t q = 0; q < 4; ++q) {
        if ((header.child_mask >> q & 1) == 0) continue;
        min_n = std::min(min_n, header.children[q].min_n);
        max_n = std::max(max_n, header.children[q].max_n);
    }
    if (header.own.min_n != min_n || header.own.max_n != max_n)
        problems_.add(fmt::format("{}: height range {}..{} should be {}..{}", name("height", frame.id),
                                  header.own.min_n, header.own.max_n, min_n, max_n));
}

void TileWalk::compare_with_parent(const Frame& frame, const Frame& parent) {
    const int n = lattice_.tile_cells_log2, m = 1 << n, pitch = m + 1;
    const auto quadrant = static_cast<std::size_t>(quadrant_of(frame.id));
    const HeightBounds& known = parent.tile->header.children[quadrant];
    const HeightBounds& own = frame.tile->header.own;
    if (!(known == own))
        problems_.add(name("height", frame.id) + ": its bounds differ from those that its parent holds for it");

    const int left = (quadrant & 1) != 0 ? m / 2 : 0, top = (quadrant & 2) != 0 ? m / 2 : 0;
    std::int64_t differing = 0;
    for (int j = 0; j <= m / 2; ++j)
        for (int i = 0; i <= m / 2; ++i)
            differing += frame.tile->samples[static_cast<std::size_t>(2 * j * pitch + 2 * i)] !=
                                 parent.tile->samples[static_cast<std::size_t>((top + j) * pitch + left + i)]
                             ? 1
                             : 0;
    report_.shared_samples_compared += std::int64_t{m / 2 + 1} * (m / 2 + 1);
    report_.shared_samples_differing += differing;
    if (differing != 0)
        problems_.add(fmt::format("{}: {} samples differ from its parent's", name("height", frame.id), differing));

    // Where both can draw a stride, the parent's surface is the child's: the child's bound covers it.
    for (int g = 0; g + 1 < n; ++g) {
        ++report_.bounds_checked;
        const float upper = parent.tile->header.own.error_n[static_cast<std::size_t>(g)];
        const float lower = own.error_n[static_cast<std::size_t>(g) + 1];
        if (upper >= lower) continue;
        ++report_.bound_violations;
        problems_.add(
            fmt::format("{}: error {} at geomip level {} is below {} of its child {}/{}/{} at the same stride",
                        name("height", parent.id), upper, g, lower, frame.id.level, frame.id.x, frame.id.y));
    }
}

void TileWalk::compare_with_neighbours(const Frame& frame) {
    const int m = lattice_.tile_cells();
    const TileId id = frame.id;
    compare_border(frame, {id.level, id.x + 1, id.y}, m, 0, 0, 1, m + 1, -m, 0);
    compare_border(frame, {id.level, id.x, id.y + 1}, 0, m, 1, 0, m + 1, 0, -m);
    if (id.level > 0) return;  // below, tiles that only touch share an ancestor's sample, and are compared with it
    compare_border(frame, {0, id.x + 1, id.y + 1}, m, m, 0, 0, 1, -m, -m);
    compare_border(frame, {0, id.x - 1, id.y + 1}, 0, m, 0, 0, 1, m, -m);
}

// Across each side that a child touches there is a tile of this level, or nothing: no coarser leaf. So leaves that
// share an edge are a level apart at most.
void TileWalk::check_grading(const Frame& frame) {
    static constexpr std::array<std::array<int, 4>, 4> kSides{
        {{0, -1, 0, 1}, {1, 0, 1, 3}, {0, 1, 2, 3}, {-1, 0, 0, 2}}};  // step x, y; the quadrants that touch
    const std::uint8_t children = frame.tile->header.child_mask;
    for (const auto& [dx, dy, q, r] : kSides) {
        const bool first = (children >> q & 1) != 0;
        if (!first && (children >> r & 1) == 0) continue;
        const auto leaf = leaf_over({frame.id.level, frame.id.x + dx, frame.id.y + dy});
        if (!leaf || leaf->level >= frame.id.level) continue;
        const TileId child = child_of(frame.id, first ? q : r);
        problems_.add(fmt::format("{} lies beside the leaf {}/{}/{}: more than a level apart", name("height", child),
                                  leaf->level, leaf->x, leaf->y));
    }
}

// The leaf that covers all of `id`, if there is one.
std::optional<TileId> TileWalk::leaf_over(TileId id) {
    if (!lattice_.contains(id)) return std::nullopt;
    for (;; id = parent_of(id)) {
        const auto tile = heights_.get(id);
        if (!tile && tile.error().code != ErrorCode::store) failure_ = tile.error();
        if (!tile) return std::nullopt;  // damaged: named when the walk comes to it
        if (*tile) return (*tile)->header.is_leaf() ? std::optional(id) : std::nullopt;
        if (id.level == 0) return std::nullopt;
    }
}

// `count` samples of the frame's tile from (from_i, from_j) on, against the neighbour's, whose indices differ by
// `across`.
void TileWalk::compare_border(const Frame& frame, TileId neighbour, int from_i, int from_j, int step_i, int step_j,
                              int count, int across_i, int across_j) {
    if (!lattice_.contains(neighbour)) return;
    auto other = heights_.get(neighbour);
    if (!other) {
        if (other.error().code != ErrorCode::store) failure_ = other.error();
        return;  // a damaged neighbour is named when the walk comes to it
    }
    if (!*other) return;
    const int pitch = lattice_.tile_samples();
    std::int64_t differing = 0;
    for (int k = 0; k < count; ++k) {
        const int i = from_i + k * step_i, j = from_j + k * step_j;
        if (frame.tile->samples[static_cast<std::size_t>(j * pitch + i)] !=
            (*other)->samples[static_cast<std::size_t>((j + across_j) * pitch + i + across_i)])
            ++differing;
    }
    report_.shared_samples_compared += count;
    report_.shared_samples_differing += differing;
    if (differing != 0)
        problems_.add(fmt::format("{}: {} of {} samples differ from those of its neighbour {}/{}/{}",
                                  name("height", frame.id), differing, count, neighbour.level, neighbour.x,
                                  neighbour.y));
}

void TileWalk::visit_leaf(Frame& frame) {
    const HeightTile& tile = *frame.tile;
    const int n = lattice_.tile_cells_log2, step_log2 = lattice_.deepest_level - frame.id.level;
    const std::int64_t m = lattice_.tile_cells(), step = lattice_.step(frame.id.level);
    const LatticePoint corner = lattice_.corner(frame.id);
    const CellPresence presence{corner.i, corner.j, m, step_log2, tile.presence};
    coarsest_leaf_ = std::min(coarsest_leaf_, frame.id.level);

    std::int64_t present = 0, outside = 0;
    for (std::int64_t j = corner.j; j < corner.j + presence.extent(); j += step) {
        for (std::int64_t i = corner.i; i < corner.i + presence.extent(); i += step) {
            if (!presence.at(i, j)) continue;
            ++present;
            if (i + step > lattice_.cells_x || j + step > lattice_.cells_y) ++outside;
        }
    }
    present_cells_ += present;
    if (present == 0) problems_.add(name("height", frame.id) + " is stored without a present cell");
    if (outside != 0)
        problems_.add(
            fmt::format("{}: {} cells outside the data's extent are present", name("height", frame.id), outside));

    const FinestTile finest = make_finest_tile(tile.samples, tile.presence, n);
    const std::vector<ExactError> own = own_errors(finest);
    for (int g = 0; g < n; ++g)
        count_bound(frame.id, g, own[static_cast<std::size_t>(g)],
                    tile.header.own.error_n[static_cast<std::size_t>(g)]);
    // In the leaf's own cells; over twice the stride in finest cells the numerator is as many times larger.
    for (std::size_t above = 0; above + 1 < frames_.size(); ++above) {
        Frame& ancestor = *frames_[above];
        const LatticePoint from = lattice_.corner(ancestor.id);
        const std::int64_t error =
            ancestor_error(ancestor.block, ancestor.stride >> step_log2, (corner.i - from.i) >> step_log2,
                           (corner.j - from.j) >> step_log2, finest);
        ancestor.worst = std::max(ancestor.worst, error << step_log2);
    }
    mark_leaf(frame, presence);
}

void TileWalk::check_coarsest_bound(const Frame& frame) {
    // Over what could be read: a bound below that is wrong whatever the rest holds.
    const int g = lattice_.tile_cells_log2 - 1;
    count_bound(frame.id, g, {frame.worst, frame.stride}, frame.tile->header.own.error_n[static_cast<std::size_t>(g)]);
}

void TileWalk::count_bound(TileId id, int geomip, const ExactError& truth, float stored) {
    ++report_.bounds_checked;
    if (truth.within(stored)) return;
    ++report_.bound_violations;
    problems_.add(fmt::format("{}: error {} at geomip level {} is below the true {}", name("height", id), stored,
                              geomip, truth.quanta()));
}

void TileWalk::finish_dataset() {
    if (!all_read_) return;
    if (present_cells_ != dataset_.present_cells)
        problems_.add(
            fmt::format("dataset: {} present cells, the tiles hold {}", dataset_.present_cells, present_cells_));
    if (coarsest_leaf_ != dataset_.least_leaf_level())
        problems_.add(fmt::format("dataset: the coarsest leaf is of level {}, the tiles' of level {}",
                                  dataset_.least_leaf_level(), coarsest_leaf_));
    // Districts stand on that level. Over absent ground textures may end at one that no tile here has.
    if (coarsest_texture_end_ < dataset_.least_texture_level())
        problems_.add(fmt::format("dataset: textures end at level {} or deeper, a tile's at level {}",
                                  dataset_.least_texture_level(), coarsest_texture_end_));
    // The dataset speaks of source heights, before they were resampled and rounded.
    const double low = dataset_.height_m(lowest_n_), high = dataset_.height_m(highest_n_);
    const double slack =
        dataset_.height_quantum_error_m + dataset_.warp_error_m + 1e-9 * (1 + std::max(std::abs(low), std::abs(high)));
    if (dataset_.min_height_m < low - slack || dataset_.max_height_m > high + slack)
        problems_.add(fmt::format("dataset: heights {}..{} m pass the tiles' range {}..{} m", dataset_.min_height_m,
                                  dataset_.max_height_m, low, high));
}

void TileWalk::take_error(const char* kind, TileId id, const Error& error) {
    if (error.code == ErrorCode::store)
        problems_.add(name(kind, id) + ": " + error.message);
    else if (!failure_)
        failure_ = error;
}

void TileWalk::tick_row() {
    if (!tick_() && !failure_) failure_ = Error{ErrorCode::interrupted, "stopped"};
}

}  // namespace scree
