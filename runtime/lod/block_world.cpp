#include "runtime/lod/block_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/process_usage.h"
#include "runtime/lod/block_kernels.h"
#include "runtime/lod/cut.h"
#include "runtime/lod/vertex_errors.h"

namespace scree {
namespace {

constexpr int kMaxBlockCellsLog2 = 5;
constexpr std::size_t kMaxBlockRow = (std::size_t{1} << kMaxBlockCellsLog2) + 1;
constexpr std::size_t kMaxBlockVertices = kMaxBlockRow * kMaxBlockRow;
constexpr int kGroup = 4;  ///< blocks a side that are culled at once

enum Side { kWest, kEast, kNorth, kSouth };

float rounded_up(double value) {
    const auto f = static_cast<float>(value);
    return static_cast<double>(f) < value ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

float rounded_down(double value) { return -rounded_up(-value); }

void extend(Box& box, const Box& other) {
    box.low = glm::min(box.low, other.low);
    box.high = glm::max(box.high, other.high);
}

// Samples from -1 to m + 1 around a block's own, as far as there are any.
Box box_of_samples(const HeightRaster& raster, std::int64_t i0, std::int64_t j0, std::int64_t i1, std::int64_t j1) {
    i0 = std::max<std::int64_t>(i0, 0), j0 = std::max<std::int64_t>(j0, 0);
    i1 = std::min(i1, raster.columns - 1), j1 = std::min(j1, raster.rows - 1);
    Box box{{raster.x_m(static_cast<double>(i0)), raster.y_m(static_cast<double>(j1)), raster.at(i0, j0)},
            {raster.x_m(static_cast<double>(i1)), raster.y_m(static_cast<double>(j0)), raster.at(i0, j0)}};
    for (std::int64_t j = j0; j <= j1; ++j)
        for (std::int64_t i = i0; i <= i1; ++i) {
            box.low.z = std::min(box.low.z, raster.at(i, j));
            box.high.z = std::max(box.high.z, raster.at(i, j));
        }
    return box;
}

// Parameters of a side, from its bits.
std::span<const std::int32_t> parameters(std::uint64_t side, std::array<std::int32_t, 33>& room) {
    std::size_t count = 0;
    for (; side != 0; side &= side - 1) room[count++] = std::countr_zero(side);
    return std::span(room).first(count);
}

bool sees_a_corner(const Frustum& frustum, const std::array<glm::dvec3, 4>& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](const glm::dvec3& c) { return frustum.contains(c); });
}

}  // namespace

BlockRules block_rules(const LodSettings& settings, double tau_px) {
    BlockRules rules;
    rules.metric = settings.metric == ErrorMetric::uc        ? BlockMetric::uc
                   : settings.method == LodMethod::block_rsg ? BlockMetric::by_block
                                                             : BlockMetric::guaranteed;
    rules.tau_px = tau_px;
    rules.reuse = settings.reuse;
    rules.s_px = settings.s_px;
    rules.culling = settings.culling;
    return rules;
}

// ---- making ----

Result<BlockWorld> BlockWorld::make(const HeightRaster& raster, const BlockWorldOptions& options,
                                    const LoadProgress& progress) {
    assert(options.cells_log2 >= 1 && options.cells_log2 <= kMaxBlockCellsLog2);
    const std::int64_t stride = (1 << options.cells_log2) + 1;
    if (raster.columns < stride || raster.rows < stride)
        return Error{ErrorCode::usage,
                     fmt::format("{} x {} samples are less than one block of {} x {}: nothing to show", raster.columns,
                                 raster.rows, stride, stride)};
    // Vertices are numbered in 32 bits. Of at most 2^30 cells a side: the product fits.
    if ((raster.columns / stride) * (raster.rows / stride) * stride * stride > std::int64_t{1} << 31)
        return Error{ErrorCode::usage, fmt::format("{} x {} samples are more than 2^31: too many for separate blocks",
                                                   raster.columns, raster.rows)};
    assert(raster.z.size() == static_cast<std::size_t>(raster.columns * raster.rows));
    for (std::size_t k = 0; k < raster.z.size(); ++k)
        if (!std::isfinite(raster.z[k]))
            return Error{ErrorCode::input,
                         fmt::format("the height of sample {} is {}: no error could be bounded", k, raster.z[k])};
    BlockWorld world;
    world.bisection_ = std::make_unique<Bisection>(options.cells_log2, false);
    world.columns_ = static_cast<int>(raster.columns / stride);
    world.rows_ = static_cast<int>(raster.rows / stride);
    world.dropped_columns_ = raster.columns % stride;
    world.dropped_rows_ = raster.rows % stride;
    world.west_m_ = raster.west_m;
    world.north_m_ = raster.north_m;
    world.spacing_m_ = raster.spacing_m;
    world.dike_aware_ = options.dike_aware;
    world.make_tables();
    const auto blocks = static_cast<std::size_t>(world.block_count()), vertices = world.bisection_->vertex_count();
    world.blocks_.resize(blocks);
    world.z_.resize(blocks * vertices);
    for (auto* array : {&world.local_z_, &world.delta_, &world.error_, &world.radius_})
        array->resize(blocks * world.order_size_);
    world.maxima_.resize(blocks * static_cast<std::size_t>(world.bisection_->levels() + 1));
    world.active_.resize(blocks * (vertices + 1));
    const auto goes_on = [&](int half, int block) {
        return !progress || block % world.columns_ != 0 ||
               progress(0.5 * (half + static_cast<double>(block) / static_cast<double>(blocks)));
    };
    for (int block = 0; block < world.block_count(); ++block) {
        if (!goes_on(0, block)) return Error{ErrorCode::interrupted, "stopped"};
        world.make_block(raster, block);
    }
    for (int block = 0; block < world.block_count(); ++block) {
        if (!goes_on(1, block)) return Error{ErrorCode::interrupted, "stopped"};
        world.bound_errors(block);
    }
    world.make_groups();
    world.make_dikes();
    return world;
}

void BlockWorld::make_tables() {
    const Bisection& b = *bisection_;
    const auto order = b.coarse_to_fine();
    order_size_ = order.size();
    order_of_.assign(b.vertex_count(), static_cast<std::uint16_t>(order_size_));
    for (std::size_t k = 0; k < order.size(); ++k)
        order_of_[static_cast<std::size_t>(order[k])] = static_cast<std::uint16_t>(k);
    first_of_level_.assign(1, 0);
    for (int level = 1; level <= b.levels(); ++level)
        first_of_level_.push_back(static_cast<std::size_t>(b.of_level(level).data() - order.data()));
    first_of_level_.push_back(order_size_);
    // The circle round a triangle: half a hypotenuse, m / sqrt(2) of the block's own; round a strip's piece between the
    // same ends half a cell's side as well, squared.
    for (int level = 0; level <= b.levels(); ++level)
        bulge_m2_.push_back(spacing_m_ * spacing_m_ *
                            (0.5 * b.cells() * b.cells() / std::exp2(level - 1) + (dike_aware_ ? 0.25 : 0)));
    const double half = 0.5 * b.cells();
    for (const std::int32_t v : order) {
        const std::int32_t i = v % b.row(), j = v / b.row();
        x_.push_back(static_cast<float>((i - half) * spacing_m_));
        y_.push_back(static_cast<float>((half - j) * spacing_m_));
        vertex_of_.push_back(static_cast<std::uint16_t>(v));
        const auto place = [&](std::int32_t p) {
            return p < 0 ? static_cast<std::uint16_t>(order_size_) : order_of_[static_cast<std::size_t>(p)];
        };
        parent_0_.push_back(place(b.vertex(v).parents[0]));
        parent_1_.push_back(place(b.vertex(v).parents[1]));
    }
    walk_ = std::make_unique<TriangleWalk>(b);
    scratch_.resize(TriangleWalk::room(b));
}

void BlockWorld::make_block(const HeightRaster& raster, int index) {
    const Bisection& b = *bisection_;
    const int m = b.cells(), row = b.row();
    const std::int64_t i0 = std::int64_t{index % columns_} * row, j0 = std::int64_t{index / columns_} * row;
    double* z = z_.data() + static_cast<std::size_t>(index) * b.vertex_count();
    for (int j = 0; j < row; ++j)
        for (int i = 0; i < row; ++i) z[b.index(i, j)] = raster.at(i0 + i, j0 + j);
    Block& block = blocks_[static_cast<std::size_t>(index)];
    block.box = box_of_samples(raster, i0, j0, i0 + m, j0 + m);
    block.reach_box = box_of_samples(raster, i0 - 1, j0 - 1, i0 + m + 1, j0 + m + 1);
    block.middle = 0.5 * (block.box.low + block.box.high);
    for (const int corner : {b.index(0, 0), b.index(m, 0), b.index(0, m), b.index(m, m)})
        active_[static_cast<std::size_t>(index) * (b.vertex_count() + 1) + static_cast<std::size_t>(corner)] = 1;
}

void BlockWorld::bound_errors(int index) {
    const Bisection& b = *bisection_;
    const auto z = heights(index);
    std::vector<float> delta(z.size()), error(z.size()), radius(z.size());
    local_corrections(b, z, delta);
    dropped_errors(b, z, error);
    diamond_radii(b, z, spacing_m_, 0, radius);
    if (dike_aware_) {
        const int x = index % columns_, y = index / columns_;
        if (x > 0) count_dike(DikeLie::between_west_and_east, index - 1, index, true, error, radius);
        if (x + 1 < columns_) count_dike(DikeLie::between_west_and_east, index, index + 1, false, error, radius);
        if (y > 0) count_dike(DikeLie::between_north_and_south, index - columns_, index, true, error, radius);
        if (y + 1 < rows_) count_dike(DikeLie::between_north_and_south, index, index + columns_, false, error, radius);
    }
    saturate(b, z, spacing_m_, error, radius);
    // How far places relative to the middle may be from it.
    const Block& block = blocks_[static_cast<std::size_t>(index)];
    const double reach_m = 0.5 * glm::length(block.box.high - block.box.low);
    LevelMaxima* maxima = maxima_.data() + static_cast<std::size_t>(index) * static_cast<std::size_t>(b.levels() + 1);
    for (std::size_t k = 0; k < order_size_; ++k) {
        const std::size_t at = order_index(index) + k, v = vertex_of_[k];
        local_z_[at] = static_cast<float>(z[v] - block.middle.z);
        delta_[at] = delta[v];
        error_[at] = error[v];
        radius_[at] = rounded_up(static_cast<double>(radius[v]) + kBallPad * reach_m);
        LevelMaxima& most = maxima[b.vertex(static_cast<std::int32_t>(v)).level];
        most.delta = std::max(most.delta, delta_[at]);
        most.error = std::max(most.error, error_[at]);
        most.radius = std::max(most.radius, radius_[at]);
    }
}

// What a strip between blocks `a` and `b` can err belongs to the middle of each interval of its sides, and what that
// middle's ball must hold is the strip over the interval (Scree lod, C10's fix).
void BlockWorld::count_dike(DikeLie lie, int a, int b, bool on_b, std::span<float> error,
                            std::span<float> radius) const {
    const std::int32_t m = bisection_->cells();
    std::array<double, 33> za{}, zb{};
    for (std::int32_t y = 0; y <= m; ++y) {
        za[static_cast<std::size_t>(y)] = heights(a)[static_cast<std::size_t>(side_vertex(lie, false, y))];
        zb[static_cast<std::size_t>(y)] = heights(b)[static_cast<std::size_t>(side_vertex(lie, true, y))];
    }
    const auto samples = static_cast<std::size_t>(m) + 1;
    std::array<float, 33> between{};
    dike_errors(std::span(za).first(samples), std::span(zb).first(samples), std::span(between).first(samples));
    const auto &own = on_b ? zb : za, &other = on_b ? za : zb;
    for (std::int32_t mid = 1; mid < m; ++mid) {
        const double z = own[static_cast<std::size_t>(mid)];
        double reach2 = 0;
        for (std::int32_t y = mid - dyadic_half(mid); y <= mid + dyadic_half(mid); ++y) {
            const double along = (y - mid) * spacing_m_, dz = other[static_cast<std::size_t>(y)] - z,
                         own_dz = own[static_cast<std::size_t>(y)] - z;
            reach2 =
                std::max({reach2, along * along + spacing_m_ * spacing_m_ + dz * dz, along * along + own_dz * own_dz});
        }
        const auto v = static_cast<std::size_t>(side_vertex(lie, on_b, mid));
        error[v] = std::max(error[v], between[static_cast<std::size_t>(mid)]);
        radius[v] = std::max(radius[v], rounded_up(std::sqrt(reach2)));
    }
}

void BlockWorld::make_groups() {
    group_columns_ = (columns_ + kGroup - 1) / kGroup;
    const int group_rows = (rows_ + kGroup - 1) / kGroup;
    group_boxes_.resize(static_cast<std::size_t>(group_columns_ * group_rows));
    for (int block = 0; block < block_count(); ++block) {
        const int x = block % columns_, y = block / columns_;
        Box& group = group_boxes_[static_cast<std::size_t>(y / kGroup * group_columns_ + x / kGroup)];
        const Box& box = blocks_[static_cast<std::size_t>(block)].reach_box;
        if (x % kGroup == 0 && y % kGroup == 0) group = box;
        extend(group, box);
    }
}

void BlockWorld::make_dikes() {
    strips_.resize(static_cast<std::size_t>((columns_ - 1) * rows_ + columns_ * (rows_ - 1)));
    const int m = bisection_->cells();
    const auto vertex = [&](int block, int i, int j) {
        return static_cast<std::uint32_t>(block) * vertices_per_block() +
               static_cast<std::uint32_t>(bisection_->index(i, j));
    };
    for (int y = 0; y + 1 < rows_; ++y)
        for (int x = 0; x + 1 < columns_; ++x) {
            const int nw = y * columns_ + x, sw = nw + columns_;
            for (const auto& t :
                 corner_quad(vertex(nw, m, m), vertex(nw + 1, 0, m), vertex(sw, m, 0), vertex(sw + 1, 0, 0)))
                quads_.insert(quads_.end(), t.begin(), t.end());
        }
}

// ---- places ----

std::int64_t BlockWorld::complete_triangles() const {
    const std::int64_t m = bisection_->cells(), strips = static_cast<std::int64_t>(strips_.size()),
                       quads = static_cast<std::int64_t>(quads_.size()) / 6;
    return std::int64_t{block_count()} * 2 * m * m + strips * 2 * m + quads * 2;
}

glm::dvec3 BlockWorld::position(std::uint32_t vertex) const {
    const auto in_block = static_cast<int>(vertex % vertices_per_block()),
               block = static_cast<int>(vertex / vertices_per_block());
    const int row = bisection_->row();
    const int i = block % columns_ * row + in_block % row, j = block / columns_ * row + in_block / row;
    return {west_m_ + i * spacing_m_, north_m_ - j * spacing_m_, z_[vertex]};
}

std::span<const double> BlockWorld::heights(int block) const {
    return std::span(z_).subspan(static_cast<std::size_t>(block) * vertices_per_block(), vertices_per_block());
}

std::array<glm::dvec3, 4> BlockWorld::corners(int block) const {
    const int m = bisection_->cells();
    const auto at = [&](int i, int j) {
        return position(static_cast<std::uint32_t>(block) * vertices_per_block() +
                        static_cast<std::uint32_t>(bisection_->index(i, j)));
    };
    return {at(0, 0), at(m, 0), at(0, m), at(m, m)};
}

std::span<const std::uint8_t> BlockWorld::active(int block) const {
    return std::span(active_).subspan(static_cast<std::size_t>(block) * (vertices_per_block() + 1),
                                      vertices_per_block());
}

float BlockWorld::local_correction_m(int block, std::int32_t vertex) const {
    const std::size_t k = order_of_[static_cast<std::size_t>(vertex)];
    return k == order_size_ ? 0 : delta_[order_index(block) + k];
}

float BlockWorld::saturated_error_m(int block, std::int32_t vertex) const {
    const std::size_t k = order_of_[static_cast<std::size_t>(vertex)];
    return k == order_size_ ? 0 : error_[order_index(block) + k];
}

BlockWorld::StripSides BlockWorld::sides(int strip) const {
    const int across = (columns_ - 1) * rows_;
    if (strip < across) {
        const int west = strip / (columns_ - 1) * columns_ + strip % (columns_ - 1);
        return {DikeLie::between_west_and_east, west, west + 1};
    }
    return {DikeLie::between_north_and_south, strip - across, strip - across + columns_};
}

std::int32_t BlockWorld::side_vertex(DikeLie lie, bool on_b, std::int32_t y) const {
    const int m = bisection_->cells();
    if (lie == DikeLie::between_west_and_east) return bisection_->index(on_b ? 0 : m, y);
    return bisection_->index(y, on_b ? 0 : m);
}

// ---- selecting ----

BlockWorld::Sighting::Sighting(const Camera& camera, const BlockRules& block_rules)
    : eye(camera.eye), focal_px(camera.focal_px()), off_axis(camera.off_axis_factor()), rules(block_rules) {}

// Which vertices of a level fail their own test. False: none can, and `fails` is as it was.
bool BlockWorld::test_level(int index, int level, const Sighting& s, double distance_m, std::uint8_t* fails) const {
    const std::size_t first = first_of_level_[static_cast<std::size_t>(level)],
                      count = first_of_level_[static_cast<std::size_t>(level) + 1] - first,
                      at = order_index(index) + first;
    const LevelMaxima& most =
        maxima_[static_cast<std::size_t>(index) * static_cast<std::size_t>(bisection_->levels() + 1) +
                static_cast<std::size_t>(level)];
    const double tau_px = s.rules.tau_px,
                 curving_m = s.rules.half_curvature * bulge_m2_[static_cast<std::size_t>(level)];
    const double error_m = static_cast<double>(most.error) + curving_m;
    std::array<float, kMaxBlockVertices> curved;
    const float* error = error_.data() + at;
    if (curving_m > 0) {
        for (std::size_t k = 0; k < count; ++k) curved[k] = rounded_up(static_cast<double>(error[k]) + curving_m);
        error = curved.data();
    }
    const Block& block = blocks_[static_cast<std::size_t>(index)];
    const glm::vec3 relative(s.eye - block.middle);
    const LocalEye eye{relative.x, relative.y, relative.z};
    const VertexArrays vertices{x_.data() + first, y_.data() + first, local_z_.data() + at, count};
    // Nothing looks larger than from the nearest point of the box: m <= 1 / r, and over a ball 1 / (r - rho). The
    // thousandth part is more than any rounding.
    const double tolerance = tau_px * 0.999;
    if (s.rules.metric == BlockMetric::uc) {
        if (s.focal_px * static_cast<double>(most.delta) < tolerance * distance_m) return false;
        fails_uc(vertices, delta_.data() + at, eye, static_cast<float>(s.focal_px), static_cast<float>(tau_px),
                 fails + first);
    } else if (s.rules.metric == BlockMetric::by_block) {
        const double scale = s.focal_px * s.off_axis;
        const Box box = lowered_by_curvature(bound_box(block), s.eye, s.rules.half_curvature);
        const double threshold_m = tau_px * distance_to_box(s.eye, box) / scale;
        if (error_m < 0.999 * threshold_m) return false;
        fails_threshold(error, count, rounded_down(threshold_m * (1 - 1e-12)), fails + first);
    } else {
        const double scale = s.rules.metric == BlockMetric::nested ? s.focal_px : s.focal_px * s.off_axis;
        if (curving_m > 0) {
            // The widest that a ball becomes, at the block's far end.
            const double radius_m = static_cast<double>(most.radius),
                         far_m = distance_m + glm::length(block.box.high - block.box.low),
                         reach_m = radius_m * (1 + (2 * far_m + radius_m) * s.rules.half_curvature);
            if (scale * error_m < tolerance * (distance_m - reach_m)) return false;
            fails_ball_curved(vertices, error, radius_.data() + at, eye, rounded_up(scale),
                              static_cast<float>(s.rules.floor), rounded_down(tau_px),
                              rounded_up(s.rules.half_curvature), fails + first);
            return true;
        }
        if (scale * error_m < tolerance * (distance_m - static_cast<double>(most.radius))) return false;
        fails_ball(vertices, error, radius_.data() + at, eye, rounded_up(scale), static_cast<float>(s.rules.floor),
                   rounded_down(tau_px), fails + first);
    }
    return true;
}

// The parent-closure of the vertices that fail their tests, whatever was selected before: what active and lock counts
// come to (Scree lod, C6), made in one pass from the finest level. It is taken for the monotone metrics as well, lest a
// rounding leave a vertex without its parents.
void BlockWorld::choose(int index, const Sighting& sighting, std::uint8_t* active) const {
    std::array<std::uint8_t, kMaxBlockVertices> fails{};
    const double distance_m =
        distance_to_box(sighting.eye, lowered_by_curvature(blocks_[static_cast<std::size_t>(index)].box, sighting.eye,
                                                           sighting.rules.half_curvature));
    const int levels = bisection_->levels();
    int finest = 0;
    for (int level = 1; level <= levels; ++level)
        if (test_level(index, level, sighting, distance_m, fails.data())) finest = level;
    std::memset(active, 0, bisection_->vertex_count());
    const int m = bisection_->cells();
    for (const std::int32_t corner : {0, m, bisection_->index(0, m), bisection_->index(m, m)}) active[corner] = 1;
    for (std::size_t k = first_of_level_[static_cast<std::size_t>(finest) + 1]; k-- > 0;) {
        const std::uint8_t fail = fails[k];
        fails[parent_0_[k]] |= fail;
        fails[parent_1_[k]] |= fail;
        active[vertex_of_[k]] = fail;
    }
}

void BlockWorld::select_anew(int block, const Camera& camera, const BlockRules& rules,
                             std::span<std::uint8_t> active) const {
    assert(active.size() == bisection_->vertex_count());
    choose(block, Sighting(camera, rules), active.data());
}

// The column over the block: of a box that is lowered as the eye sees it.
EyeToBox BlockWorld::eye_to(int block, const glm::dvec3& eye) const {
    const Box& box = bound_box(blocks_[static_cast<std::size_t>(block)]);
    if (!(rules_.half_curvature > 0)) return eye_to_box(eye, box);
    return eye_to_box(eye, lowered_by_curvature(box, eye, rules_.half_curvature));
}

bool BlockWorld::may_reuse(int index, const EyeToBox& now, const glm::dvec3& eye) const {
    const Block& block = blocks_[static_cast<std::size_t>(index)];
    if (rules_.reuse == ReuseTest::off || block.chosen.generation != generation_) return false;
    const glm::dvec3& then = block.chosen.eye;
    if (rules_.reuse == ReuseTest::paper)
        return (rules_.each_corner ? reuse_p2 : reuse_p1)(then, eye, corners(index), block.box, focal_px_, rules_.s_px,
                                                          rules_.tau_px);
    const ReuseAllowance allowance{rules_.tau_px, rules_.s_px};
    double moved_m = glm::length(eye - then);
    // Relative to the eye, a point over a curved earth moves by more than the eye does.
    if (rules_.half_curvature > 0) {
        const Box& box = bound_box(block);
        const double furthest_m = std::max(block.chosen.to_box.level_m, now.level_m) +
                                  std::hypot(box.high.x - box.low.x, box.high.y - box.low.y);
        moved_m *= 1 + (2 * furthest_m + moved_m) * rules_.half_curvature;
    }
    switch (rules_.metric) {
        case BlockMetric::by_block:
            return reuse_t2(now, moved_m, allowance);
        case BlockMetric::uc:
            return reuse_t1(block.chosen.to_box, now, moved_m, allowance);
        default:
            return reuse_exact(block.chosen.to_box, now, moved_m, rules_.floor, allowance);
    }
}

void BlockWorld::regenerate(int index, const Sighting& sighting) {
    Block& block = blocks_[static_cast<std::size_t>(index)];
    const std::size_t vertices = bisection_->vertex_count();
    std::array<std::uint8_t, kMaxBlockVertices> chosen;
    choose(index, sighting, chosen.data());
    std::uint8_t* active = active_.data() + static_cast<std::size_t>(index) * (vertices + 1);
    ++frame_.regenerated;
    if (block.version != 0 && std::memcmp(active, chosen.data(), vertices) == 0) return;
    std::memcpy(active, chosen.data(), vertices);
    make_mesh(index);
    take_sides(index);
    ++frame_.meshes_made;
}

// Down the triangle tree: no second pass over the vertices.
void BlockWorld::make_mesh(int index) {
    const std::uint8_t* active = active_.data() + static_cast<std::size_t>(index) * (bisection_->vertex_count() + 1);
    const std::uint32_t base = static_cast<std::uint32_t>(index) * vertices_per_block();
    const std::uint32_t* out = walk_->emit(active, base, scratch_.data());
    Block& block = blocks_[static_cast<std::size_t>(index)];
    block.mesh.assign(static_cast<const std::uint32_t*>(scratch_.data()), out);
    ++block.version;
}

void BlockWorld::take_sides(int index) {
    const std::uint8_t* active = active_.data() + static_cast<std::size_t>(index) * (bisection_->vertex_count() + 1);
    const int m = bisection_->cells();
    std::array<std::uint64_t, 4> sides{};
    const auto bit = [&](int i, int j) { return std::uint64_t{active[bisection_->index(i, j)]}; };
    for (int y = 0; y <= m; ++y) {
        sides[kWest] |= bit(0, y) << y;
        sides[kEast] |= bit(m, y) << y;
        sides[kNorth] |= bit(y, 0) << y;
        sides[kSouth] |= bit(y, m) << y;
    }
    blocks_[static_cast<std::size_t>(index)].sides = sides;
}

bool BlockWorld::is_visible(const Frustum& frustum, const glm::dvec3& eye, int index) const {
    if (rules_.culling == Culling::corners) return sees_a_corner(frustum, corners(index));
    return frustum.may_see(
        lowered_by_curvature(blocks_[static_cast<std::size_t>(index)].reach_box, eye, rules_.half_curvature));
}

void BlockWorld::find_visible(const Camera& camera) {
    const Frustum frustum(camera);
    for (std::size_t g = 0; g < group_boxes_.size(); ++g) {
        const Sight sight = frustum.sight(lowered_by_curvature(group_boxes_[g], camera.eye, rules_.half_curvature));
        if (sight == Sight::none) continue;
        const int x0 = static_cast<int>(g) % group_columns_ * kGroup,
                  y0 = static_cast<int>(g) / group_columns_ * kGroup;
        for (int y = y0; y < std::min(y0 + kGroup, rows_); ++y)
            for (int x = x0; x < std::min(x0 + kGroup, columns_); ++x)
                if (sight == Sight::all || is_visible(frustum, camera.eye, y * columns_ + x))
                    seen_blocks_.push_back(y * columns_ + x);
    }
}

const BlockFrame& BlockWorld::select(const Camera& camera, const BlockRules& rules) {
    const double start = thread_cpu_seconds();
    const Sighting sighting(camera, rules);
    if (rules != rules_ || sighting.focal_px != focal_px_ || sighting.off_axis != off_axis_) {
        rules_ = rules;
        focal_px_ = sighting.focal_px;
        off_axis_ = sighting.off_axis;
        ++generation_;
    }
    ++frame_number_;
    frame_ = {};
    for (auto* seen : {&seen_blocks_, &seen_strips_, &seen_quads_}) seen->clear();
    find_visible(camera);
    for (const std::int32_t index : seen_blocks_) {
        Block& block = blocks_[static_cast<std::size_t>(index)];
        block.seen_in_frame = frame_number_;
        const EyeToBox now = eye_to(index, camera.eye);
        block.reused = may_reuse(index, now, camera.eye);
        if (block.reused) {
            ++frame_.reused;
        } else {
            regenerate(index, sighting);
            block.chosen = {camera.eye, now, generation_};
        }
        frame_.block_triangles += static_cast<std::int64_t>(block.mesh.size() / 3);
    }
    gather_dikes();
    frame_.blocks = seen_blocks_;
    frame_.strips = seen_strips_;
    frame_.quads = seen_quads_;
    frame_.lod_ms = 1000 * (thread_cpu_seconds() - start);
    return frame_;
}

// A strip or quad is drawn where all that it joins is: what can be seen of it lies within their boxes.
void BlockWorld::gather_dikes() {
    const auto seen = [&](int block) {
        return blocks_[static_cast<std::size_t>(block)].seen_in_frame == frame_number_;
    };
    const int across = (columns_ - 1) * rows_;
    for (const std::int32_t block : seen_blocks_) {
        const int x = block % columns_, y = block / columns_;
        const bool east = x + 1 < columns_ && seen(block + 1), south = y + 1 < rows_ && seen(block + columns_);
        if (east) draw_strip(y * (columns_ - 1) + x);
        if (south) draw_strip(across + block);
        if (east && south && seen(block + columns_ + 1)) {
            seen_quads_.push_back(y * (columns_ - 1) + x);
            frame_.dike_triangles += 2;
        }
    }
}

void BlockWorld::draw_strip(int index) {
    Strip& strip = strips_[static_cast<std::size_t>(index)];
    const auto [lie, a, b] = sides(index);
    const bool upright = lie == DikeLie::between_west_and_east;
    const std::uint64_t a_side = blocks_[static_cast<std::size_t>(a)].sides[upright ? kEast : kSouth],
                        b_side = blocks_[static_cast<std::size_t>(b)].sides[upright ? kWest : kNorth];
    if (a_side != strip.a_side || b_side != strip.b_side) {
        strip.a_side = a_side;
        strip.b_side = b_side;
        make_strip(strip, lie, a, b);
        ++frame_.strips_made;
    }
    seen_strips_.push_back(index);
    frame_.dike_triangles += static_cast<std::int64_t>(strip.mesh.size() / 3);
}

void BlockWorld::make_strip(Strip& strip, DikeLie lie, int a, int b) const {
    std::array<std::int32_t, 33> a_room, b_room;
    const auto ya = parameters(strip.a_side, a_room), yb = parameters(strip.b_side, b_room);
    const std::uint32_t per_block = vertices_per_block();
    const auto vertex = [&](bool on_b, std::int32_t k) {
        const std::int32_t y = (on_b ? yb : ya)[static_cast<std::size_t>(k)];
        return static_cast<std::uint32_t>(on_b ? b : a) * per_block +
               static_cast<std::uint32_t>(side_vertex(lie, on_b, y));
    };
    strip.mesh.clear();
    walk_zipper(ya, yb, [&](bool on_b, std::int32_t base, std::int32_t apex) {
        const auto t = counter_clockwise(lie, on_b, vertex(on_b, base), vertex(on_b, base + 1), vertex(!on_b, apex));
        strip.mesh.insert(strip.mesh.end(), t.begin(), t.end());
    });
    ++strip.version;
}

}  // namespace scree
