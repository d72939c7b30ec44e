#include "runtime/lod/tile_vertices.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>

#include "common/mesh/tile_patterns.h"
#include "runtime/lod/block_kernels.h"

namespace scree {
namespace {

/// A tile with more of its vertices than this has all of them: it is drawn by its pattern, which takes no memory.
constexpr double kWholeShare = 0.6;

// The upper half of a float: 8 bits of its mantissa. Up, so that no error is taken for less than it is; what would pass
// the greatest float is infinite.
std::uint16_t rounded_up_half(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return static_cast<std::uint16_t>((bits >> 16) + ((bits & 0xffff) != 0 ? 1 : 0));
}

void widen(const std::uint16_t* halves, std::size_t count, float* out) {
    for (std::size_t k = 0; k < count; ++k) out[k] = std::bit_cast<float>(std::uint32_t{halves[k]} << 16);
}

}  // namespace

TileVertices::TileVertices(const Dataset& dataset, std::int64_t height_slots, bool by_threshold)
    : lattice_(dataset.lattice),
      offset_m_(dataset.height_offset_m),
      quantum_m_(dataset.height_quantum_m),
      n_(lattice_.tile_cells_log2),
      m_(1 << n_),
      vertices_(slot_vertex_count(n_)),
      by_threshold_(by_threshold),
      bisections_{Bisection(n_, false), Bisection(n_, true)},
      middle_m_(static_cast<std::size_t>(height_slots)),
      step_m_(middle_m_.size()),
      z_m_(vertices_),
      error_m_(vertices_),
      radius_m_(vertices_),
      bulge_(vertices_),
      errors_(vertices_),
      fails_(vertices_),
      places_(static_cast<std::size_t>(lattice_.deepest_level) + 1) {
    const std::size_t all = middle_m_.size() * vertices_;
    error_.resize(all);
    if (!by_threshold) {
        z_.resize(all);
        radius_.resize(all);
    }
    // Half a hypotenuse of level k, squared: m^2 / 2 of the tile's own, half of that a level.
    for (const std::int32_t v : bisections_[0].coarse_to_fine())
        bulge_[static_cast<std::size_t>(v)] =
            static_cast<float>(0.5 * m_ * m_ / std::exp2(bisections_[0].vertex(v).level - 1));
}

void TileVertices::put(std::int32_t slot, std::span<const SlotVertex> from, std::span<const VertexCost> costs) {
    assert(from.size() == vertices_ && costs.size() == vertices_);
    const auto [low, high] = std::minmax_element(
        from.begin(), from.end(), [](const SlotVertex& a, const SlotVertex& b) { return a.height_n < b.height_n; });
    const double middle_n = std::floor((static_cast<double>(low->height_n) + static_cast<double>(high->height_n)) / 2);
    middle_m_[static_cast<std::size_t>(slot)] = offset_m_ + middle_n * quantum_m_;
    for (std::size_t k = 0; k < vertices_; ++k) error_[at(slot) + k] = rounded_up_half(costs[k].error_m);
    if (by_threshold_) return;
    // Whole quanta but where a tile spans more than 65,535 of them; then the balls hold what the rounding moves.
    const double reach_n = static_cast<double>(high->height_n) - middle_n;
    const double step_n = std::max(1.0, std::ceil((reach_n + 1) / 32767));
    const auto moved_m = step_n > 1 ? static_cast<float>(step_n * quantum_m_) : 0.0f;
    step_m_[static_cast<std::size_t>(slot)] = static_cast<float>(step_n * quantum_m_);
    for (std::size_t k = 0; k < vertices_; ++k) {
        z_[at(slot) + k] =
            static_cast<std::int16_t>(std::lround((static_cast<double>(from[k].height_n) - middle_n) / step_n));
        radius_[at(slot) + k] = rounded_up_half(costs[k].radius_m + moved_m);
    }
}

const float* TileVertices::errors(std::int32_t slot) {
    widen(error_.data() + at(slot), vertices_, error_m_.data());
    return error_m_.data();
}

double TileVertices::height_m(std::int32_t slot, std::int32_t vertex) const {
    return middle_m_[static_cast<std::size_t>(slot)] + static_cast<double>(step_m_[static_cast<std::size_t>(slot)]) *
                                                           z_[at(slot) + static_cast<std::size_t>(vertex)];
}

double TileVertices::spacing_m(TileId tile) const {
    return lattice_.spacing_m * static_cast<double>(lattice_.step(tile.level));
}

const std::vector<float>& TileVertices::places(int level) {
    std::vector<float>& table = places_[static_cast<std::size_t>(level)];
    if (!table.empty()) return table;
    const double spacing = lattice_.spacing_m * static_cast<double>(lattice_.step(level));
    table.resize(2 * vertices_);
    for (int j = 0; j <= m_; ++j)
        for (int i = 0; i <= m_; ++i) {
            const auto v = static_cast<std::size_t>(j * (m_ + 1) + i);
            table[v] = static_cast<float>(spacing * (i - m_ / 2));
            table[vertices_ + v] = static_cast<float>(spacing * (m_ / 2 - j));
        }
    return table;
}

const std::vector<std::uint8_t>& TileVertices::allowed(const TileShape& shape) {
    std::vector<std::uint8_t>& table = allowed_[{shape.geomip, shape.edge_mask}];
    if (!table.empty()) return table;
    table.assign(vertices_, 0);
    const int finest = 2 * (n_ - shape.geomip);
    const Bisection& b = bisections_[0];
    for (const std::int32_t v : b.coarse_to_fine()) {
        const int level = b.vertex(v).level, i = v % (m_ + 1), j = v / (m_ + 1);
        const bool lacking =
            level == finest &&
            (((shape.edge_mask & kEdgeNorth) != 0 && j == 0) || ((shape.edge_mask & kEdgeEast) != 0 && i == m_) ||
             ((shape.edge_mask & kEdgeSouth) != 0 && j == m_) || ((shape.edge_mask & kEdgeWest) != 0 && i == 0));
        table[static_cast<std::size_t>(v)] = level <= finest && !lacking ? 1 : 0;
    }
    return table;
}

void TileVertices::restrict_to(const TileShape& shape, std::uint8_t* active) {
    const std::vector<std::uint8_t>& may = allowed(shape);
    for (std::size_t v = 0; v < vertices_; ++v) active[v] &= may[v];
    const Bisection& b = bisection(shape.tile);
    for (const int j : {0, m_})
        for (const int i : {0, m_}) active[b.index(i, j)] = 1;
}

void TileVertices::add_parents(const TileShape& shape, std::uint8_t* active) const {
    const Bisection& b = bisection(shape.tile);
    const auto order = b.coarse_to_fine();
    for (std::size_t k = order.size(); k-- > 0;) {
        if (active[order[k]] == 0) continue;
        const auto& parents = b.vertex(order[k]).parents;
        active[parents[0]] = 1;
        if (parents[1] >= 0) active[parents[1]] = 1;
    }
}

// At the middle of a hypotenuse 2 l long l^2 / 2R are missed. A vertex that costs nothing leaves the surface as the
// tile's own vertices have it: off by as much as they are. Taken for all, that costs next to nothing, for it is within
// the cut's share of the tolerance, and the errors stay monotone up the hierarchy.
const float* TileVertices::curved_errors(const TileShape& shape, double half_curvature) {
    const float* error = errors(shape.slot);
    const auto factor = static_cast<float>(spacing_m(shape.tile) * spacing_m(shape.tile) * half_curvature);
    for (std::size_t v = 0; v < vertices_; ++v) errors_[v] = std::max(error[v], shape.base_m) + factor * bulge_[v];
    return errors_.data();
}

void TileVertices::choose(const TileShape& shape, std::span<const VertexEye> eyes, double tau_px, double half_curvature,
                          bool paper, std::uint8_t* active) {
    const std::vector<float>& place = places(shape.tile.level);
    const std::size_t first = at(shape.slot);
    const float step_m = step_m_[static_cast<std::size_t>(shape.slot)];
    for (std::size_t v = 0; v < vertices_; ++v) z_m_[v] = static_cast<float>(z_[first + v]) * step_m;
    widen(radius_.data() + first, vertices_, radius_m_.data());
    const VertexArrays arrays{place.data(), place.data() + vertices_, z_m_.data(), vertices_};
    const LatticePoint corner = lattice_.corner(shape.tile);
    const double half = 0.5 * static_cast<double>(lattice_.tile_extent(shape.tile.level));
    const glm::dvec3 middle{lattice_.x_m(static_cast<double>(corner.i) + half),
                            lattice_.y_m(static_cast<double>(corner.j) + half),
                            middle_m_[static_cast<std::size_t>(shape.slot)]};
    std::memset(active, 0, vertices_);
    const float* error = half_curvature > 0 && !paper ? curved_errors(shape, half_curvature) : errors(shape.slot);
    for (const VertexEye& eye : eyes) {
        const LocalEye local{static_cast<float>(eye.eye.x - middle.x), static_cast<float>(eye.eye.y - middle.y),
                             static_cast<float>(eye.eye.z - middle.z)};
        const auto scale = static_cast<float>(eye.scale_px), tau = static_cast<float>(tau_px);
        if (paper)
            fails_uc(arrays, error, local, scale, tau, fails_.data());
        else if (half_curvature > 0)
            fails_ball_curved(arrays, error, radius_m_.data(), local, scale, static_cast<float>(kMetricFloor), tau,
                              static_cast<float>(half_curvature), fails_.data());
        else
            fails_ball(arrays, error, radius_m_.data(), local, scale, static_cast<float>(kMetricFloor), tau,
                       fails_.data());
        for (std::size_t v = 0; v < vertices_; ++v) active[v] |= fails_[v];
    }
    restrict_to(shape, active);
    // The test is monotone up the hierarchy but for its roundings, or not at all (the paper's).
    add_parents(shape, active);
}

void TileVertices::choose(const TileShape& shape, double threshold_m, double half_curvature, std::uint8_t* active) {
    const float* error = half_curvature > 0 ? curved_errors(shape, half_curvature) : errors(shape.slot);
    const auto threshold = static_cast<float>(threshold_m * (1 - 1e-6));
    fails_threshold(error, vertices_, threshold, active);
    restrict_to(shape, active);  // saturated errors are monotone: parents are there
}

bool TileVertices::complete_if_dense(const TileShape& shape, std::uint8_t* active) {
    std::size_t count = 0;
    for (std::size_t v = 0; v < vertices_; ++v) count += active[v];
    const double side = (m_ >> shape.geomip) + 1;
    if (static_cast<double>(count) <= kWholeShare * side * side) return false;
    const std::vector<std::uint8_t>& may = allowed(shape);
    for (std::size_t v = 0; v < vertices_; ++v) active[v] |= may[v];
    return true;
}

std::int64_t TileVertices::slot_cost(const Dataset& dataset, bool by_threshold) {
    const std::size_t halves = by_threshold ? 1 : 3;
    return static_cast<std::int64_t>(slot_vertex_count(dataset.lattice.tile_cells_log2) * halves *
                                         sizeof(std::uint16_t) +
                                     sizeof(double) + sizeof(float));
}

}  // namespace scree
