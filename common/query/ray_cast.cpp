#include "common/query/ray_cast.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/mesh/drawn_surface.h"
#include "common/query/height_query.h"

namespace scree {
namespace {

constexpr double kFarthest_m = 1e15;  // doubles tell no metre from the next much farther out

// A coordinate of the ray in lattice units (cells, quanta) by distance in metres.
struct Line {
    double start = 0, slope = 0;
    double at(double distance) const { return start + distance * slope; }
    /// slope != 0. Monotone in `value`, so that lines are passed in their order.
    double distance_to(double value) const { return (value - start) / slope; }
};

struct Span {
    double from = 0, to = 0;  // distances
};

// i0..i0+2^size_log2 cells east, likewise south.
struct Square {
    std::int64_t i = 0, j = 0;
    int size_log2 = 0;
};

struct Part {
    int quadrant = 0;
    Square square;
    Span span;
};

// The quarters of a square that a ray passes, in its order: three at most.
struct Parts {
    std::array<Part, 3> parts;
    std::size_t count = 0;
    const Part* begin() const { return parts.data(); }
    const Part* end() const { return parts.data() + count; }
};

struct LatticeRay {
    Line i, j, n;
    // The side of a line between cells that a ray which runs along it belongs to.
    bool east_of_lines = false, south_of_lines = false;
};

// Where a line at `middle` cuts the span; beyond its end where it does not.
double cut_of(const Line& line, double middle, Span span) {
    const double distance = line.slope == 0 ? span.to : line.distance_to(middle);
    return distance > span.from && distance < span.to ? distance : span.to;
}

// Is the ray past `middle` (east or south of it) from distance `from` on?
bool beyond(const Line& line, double middle, double from, bool on_line) {
    if (line.slope == 0) return line.start > middle || (line.start == middle && on_line);
    const bool passed = from >= line.distance_to(middle);
    return line.slope > 0 ? passed : !passed;
}

Parts quarters(const LatticeRay& ray, const Square& square, Span span) {
    const std::int64_t half = std::int64_t{1} << (square.size_log2 - 1);
    const auto mid_i = static_cast<double>(square.i + half), mid_j = static_cast<double>(square.j + half);
    const double cut_i = cut_of(ray.i, mid_i, span), cut_j = cut_of(ray.j, mid_j, span);
    const std::array<double, 3> ends{std::min(cut_i, cut_j), std::max(cut_i, cut_j), span.to};
    Parts out;
    double from = span.from;
    for (const double to : ends) {
        if (out.count > 0 && to <= from) continue;
        const bool east = beyond(ray.i, mid_i, from, ray.east_of_lines),
                   south = beyond(ray.j, mid_j, from, ray.south_of_lines);
        out.parts[out.count++] = {(south ? 2 : 0) | (east ? 1 : 0),
                                  {square.i + (east ? half : 0), square.j + (south ? half : 0), square.size_log2 - 1},
                                  {from, to}};
        from = to;
    }
    return out;
}

class RayWalk {
public:
    RayWalk(HeightSource& source, const LatticeRay& ray)
        : source_(source), lattice_(source.dataset().lattice), ray_(ray) {}

    struct Hit {
        double distance_m = 0, error_bound_m = 0;
    };
    const std::optional<Hit>& hit() const { return hit_; }

    /// A square of one root or of many.
    Result<void> walk_roots(const Square& square, Span span) {
        if (square.size_log2 == lattice_.deepest_level + lattice_.tile_cells_log2) return walk_root(square, span);
        for (const Part& part : quarters(ray_, square, span)) {
            if (auto ok = walk_roots(part.square, part.span); !ok) return ok;
            if (hit_) break;
        }
        return {};
    }

private:
    // A surface to meet: a tile's own.
    struct Surface {
        HeightTileView tile;
        LatticePoint corner;
        int step_log2 = 0;
        double error_m = 0;
    };

    Result<void> walk_root(const Square& square, Span span) {
        const TileId id{0, square.i >> square.size_log2, square.j >> square.size_log2};
        if (!lattice_.contains(id)) return over_nothing();
        auto tile = source_.view(id);
        if (!tile) return tile.error();
        if (!*tile) return over_nothing();
        if (passes_by((*tile)->header->own, span)) return {};
        return walk_tile(id, **tile, square, span);
    }

    Result<void> walk_tile(TileId id, const HeightTileView& tile, const Square& square, Span span) {
        if (tile.header->is_leaf() || id.level == lattice_.deepest_level)
            return walk_cells(surface_of(id, tile), square, span), Result<void>{};
        const HeightTileHeader header = *tile.header;  // the view ends with the first child asked for
        for (const Part& part : quarters(ray_, square, span)) {
            if (auto ok = walk_child(id, header, part); !ok) return ok;
            if (hit_) break;
        }
        return {};
    }

    Result<void> walk_child(TileId parent, const HeightTileHeader& header, const Part& part) {
        if ((header.child_mask >> part.quadrant & 1) == 0) return over_nothing();
        if (passes_by(header.children[static_cast<std::size_t>(part.quadrant)], part.span)) return {};
        const TileId id = child_of(parent, part.quadrant);
        auto tile = source_.view(id);
        if (!tile) return tile.error();
        if (*tile) return walk_tile(id, **tile, part.square, part.span);
        tile = source_.view(parent);
        if (!tile) return tile.error();
        if (!*tile) return over_nothing();
        walk_cells(surface_of(parent, **tile), part.square, part.span);
        return {};
    }

    Surface surface_of(TileId id, const HeightTileView& tile) const {
        return {tile, lattice_.corner(id), lattice_.deepest_level - id.level,
                surface_error_m(source_.dataset(), *tile.header)};
    }

    void walk_cells(const Surface& surface, const Square& square, Span span) {
        if (square.size_log2 == surface.step_log2) return meet_cell(surface, square, span);
        for (const Part& part : quarters(ray_, square, span)) {
            walk_cells(surface, part.square, part.span);
            if (hit_) return;
        }
    }

    // Above the surface of the tile along the span, the ray's height less the surface's, in quanta, is linear in each
    // of the cell's two triangles.
    void meet_cell(const Surface& surface, const Square& square, Span span) {
        const std::int64_t c = (square.i - surface.corner.i) >> surface.step_log2,
                           r = (square.j - surface.corner.j) >> surface.step_log2;
        const std::int64_t m = lattice_.tile_cells();
        if (!surface.tile.presence.empty() && surface.tile.presence[static_cast<std::size_t>(r * m + c)] == 0) {
            side_ = 0;
            return;
        }
        const auto off_diagonal = [&](double distance) {
            const double u = across(ray_.i, distance, surface.corner.i, surface) - static_cast<double>(c),
                         v = across(ray_.j, distance, surface.corner.j, surface) - static_cast<double>(r);
            return (c + r) % 2 == 0 ? u - v : u + v - 1;
        };
        const double before = off_diagonal(span.from), after = off_diagonal(span.to);
        if (before * after < 0) {
            const double cut = between(span, before, after);
            meet_triangle(surface, {span.from, cut});
            if (!hit_) meet_triangle(surface, {cut, span.to});
        } else {
            meet_triangle(surface, span);
        }
    }

    void meet_triangle(const Surface& surface, Span span) {
        const double above_from = above(surface, span.from), above_to = above(surface, span.to);
        if (enter(span.from, above_from, reach_m(surface, above_from))) return;
        if (side_of(above_to) != side_)
            hit_ = Hit{between(span, above_from, above_to), surface.error_m};
        else
            side_reach_m_ = reach_m(surface, above_to);
    }

    // Position in the tile's own samples. Rounding must not leave the tile.
    double across(const Line& line, double distance, std::int64_t corner, const Surface& surface) const {
        const double samples = std::ldexp(line.at(distance) - static_cast<double>(corner), -surface.step_log2);
        return std::clamp(samples, 0.0, static_cast<double>(lattice_.tile_cells()));
    }

    double above(const Surface& surface, double distance) const {
        return ray_.n.at(distance) - drawn_height_at(surface.tile.samples, lattice_.tile_cells_log2, {0, 0},
                                                     across(ray_.i, distance, surface.corner.i, surface),
                                                     across(ray_.j, distance, surface.corner.j, surface));
    }

    // Where a linear function with these values at the span's ends is zero, if it is; as exact as the value at its
    // start, however long the span.
    static double between(Span span, double from, double to) {
        if (from == to) return span.to;
        return std::clamp(span.from + from * ((span.to - span.from) / (from - to)), span.from, span.to);
    }

    static int side_of(double above) { return above > 0 ? 1 : above < 0 ? -1 : 0; }

    // How far from the ray, up or down, the true surface can be.
    double reach_m(const Surface& surface, double above) const {
        return surface.error_m + std::abs(above) * source_.dataset().height_quantum_m;
    }

    // From here on the ray is above (> 0) or below (< 0) the surface: a hit where it was not before. At such a step
    // either side may turn out to be absent, so the bound holds for both.
    bool enter(double distance, double above, double reach_m) {
        const int side = side_of(above);
        if (side == 0 || (side_ != 0 && side != side_))
            hit_ = Hit{distance, side_ == 0 ? reach_m : std::max(reach_m, side_reach_m_)};
        side_ = side;
        return hit_.has_value();
    }

    // True where the ray passes above or below all of a height range. A much coarser neighbour's border may lie outside
    // it, so that the ray may have changed sides at the step.
    bool passes_by(const HeightBounds& bounds, Span span) {
        const double a = ray_.n.at(span.from), b = ray_.n.at(span.to);
        // More than rounding makes of a ray that touches.
        const double margin = 16 * std::numeric_limits<double>::epsilon() *
                              (std::abs(ray_.n.start) + std::abs(a) + std::abs(b) + kMaxHeightUnits);
        const bool over = std::min(a, b) > bounds.max_n + margin;
        if (!over && !(std::max(a, b) < bounds.min_n - margin)) return false;
        const auto reach_at = [&](double n) {
            return std::max(std::abs(n - bounds.min_n), std::abs(n - bounds.max_n)) *
                   source_.dataset().height_quantum_m;
        };
        if (!enter(span.from, over ? 1 : -1, reach_at(a))) side_reach_m_ = reach_at(b);
        return true;
    }

    Result<void> over_nothing() {
        side_ = 0;
        return {};
    }

    HeightSource& source_;
    const Lattice& lattice_;
    LatticeRay ray_;
    int side_ = 0;             // of the last place looked at: 1 above, -1 below, 0 nothing there
    double side_reach_m_ = 0;  // reach_m there
    std::optional<Hit> hit_;
};

// Narrows the span to where a coordinate is within 0..cells; empty (from > to) where it never is.
void clip(const Line& line, std::int64_t cells, Span& span) {
    const auto last = static_cast<double>(cells);
    if (line.slope == 0) {
        if (!(line.start >= 0 && line.start <= last)) span.to = -1;
        return;
    }
    const double a = line.distance_to(0), b = line.distance_to(last);
    span.from = std::max(span.from, std::min(a, b));
    span.to = std::min(span.to, std::max(a, b));
}

bool usable(const Vector3& v, double limit) {
    return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;  // false for NaN
}

Result<Vector3> unit(const Vector3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!usable(v, std::numeric_limits<double>::max()) || largest == 0)
        return Error{ErrorCode::usage, fmt::format("ray: ({}, {}, {}) is no direction", v.x, v.y, v.z)};
    // Scaled first: no square overflows or vanishes.
    const Vector3 scaled{v.x / largest, v.y / largest, v.z / largest};
    const double length = std::hypot(scaled.x, scaled.y, scaled.z);
    return Vector3{scaled.x / length, scaled.y / length, scaled.z / length};
}

// No point that a store can hold is farther from the origin.
double farthest_m(const Dataset& d, const Vector3& o) {
    const Lattice& l = d.lattice;
    const auto reach = [](double from, double a, double b) { return std::max(std::abs(a - from), std::abs(b - from)); };
    return 1.001 * std::hypot(reach(o.x, l.x_m(0), l.x_m(static_cast<double>(l.cells_x))),
                              reach(o.y, l.y_m(0), l.y_m(static_cast<double>(l.cells_y))),
                              reach(o.z, d.height_m(-kMaxHeightUnits), d.height_m(kMaxHeightUnits)));
}

LatticeRay lattice_ray(const Dataset& d, const Vector3& origin, const Vector3& unit_direction) {
    const Lattice& l = d.lattice;
    LatticeRay ray{{l.i_of(origin.x), unit_direction.x / l.spacing_m},
                   {l.j_of(origin.y), -unit_direction.y / l.spacing_m},
                   {(origin.z - d.height_offset_m) / d.height_quantum_m, unit_direction.z / d.height_quantum_m}};
    if (ray.i.slope == 0) ray.i.start = on_lattice(ray.i.start, origin.x, l.origin_x_m, l.spacing_m);
    if (ray.j.slope == 0) ray.j.start = on_lattice(ray.j.start, origin.y, l.origin_y_m, l.spacing_m);
    return ray;
}

// Runs along a line between cells, and so belongs to those on both sides.
bool along_a_line(const Line& line) { return line.slope == 0 && line.start == std::floor(line.start); }

Square all_roots(const Lattice& l) {
    Square square{0, 0, l.deepest_level + l.tile_cells_log2};
    for (std::int64_t roots = 1; roots < std::max(l.root_columns, l.root_rows); roots *= 2) ++square.size_log2;
    return square;
}

}  // namespace

Result<std::optional<RayHit>> cast_ray(HeightSource& source, const Vector3& origin, const Vector3& direction,
                                       double max_distance_m) {
    if (!usable(origin, kFarthest_m))
        return Error{ErrorCode::usage, fmt::format("ray: ({}, {}, {}) is no place within {} m", origin.x, origin.y,
                                                   origin.z, kFarthest_m)};
    if (!(max_distance_m >= 0)) return Error{ErrorCode::usage, fmt::format("ray: {} m is no distance", max_distance_m)};
    const auto along = unit(direction);
    if (!along) return along.error();
    const Dataset& d = source.dataset();
    LatticeRay ray = lattice_ray(d, origin, *along);
    Span span{0, std::min(max_distance_m, farthest_m(d, origin))};
    clip(ray.i, d.lattice.cells_x, span);
    clip(ray.j, d.lattice.cells_y, span);
    if (!(span.from <= span.to)) return std::optional<RayHit>{};

    std::optional<RayWalk::Hit> nearest;
    const int tries_i = along_a_line(ray.i) ? 2 : 1, tries_j = along_a_line(ray.j) ? 2 : 1;
    for (int k = 0; k < tries_i * tries_j; ++k) {
        ray.east_of_lines = k % tries_i != 0;
        ray.south_of_lines = k / tries_i != 0;
        RayWalk walk(source, ray);
        if (auto ok = walk.walk_roots(all_roots(d.lattice), span); !ok) return ok.error();
        if (walk.hit() && (!nearest || walk.hit()->distance_m < nearest->distance_m)) nearest = walk.hit();
    }
    if (!nearest) return std::optional<RayHit>{};
    const double t = nearest->distance_m;
    return std::optional<RayHit>{
        RayHit{{origin.x + t * along->x, origin.y + t * along->y, origin.z + t * along->z}, t, nearest->error_bound_m}};
}

}  // namespace scree
