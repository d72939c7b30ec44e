#include "tools/mosaic/layer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace scree {
namespace {

constexpr double kPhaseTolerance = 1e-3;  // samples
constexpr double kMaxSide = static_cast<double>(std::int64_t{1} << 40);
constexpr int kBoxSteps = 16;

struct Offset {
    double column = 0, row = 0;
};

// Column and row of a place in the grid of `where`.
Offset position_in(const Georeference& where, double x, double y) {
    const double dx = x - where.first_x, dy = y - where.first_y;
    const double determinant = where.column_x * where.row_y - where.column_y * where.row_x;
    return {(dx * where.row_y - dy * where.row_x) / determinant,
            (dy * where.column_x - dx * where.column_y) / determinant};
}

// The member's place in the layer's grid when all of its samples fall on the grid's.
std::optional<LayerMember> place_in(const Layer& layer, const PlacedFile& file, std::size_t index) {
    if (!layer.crs.same_as(file.crs)) return std::nullopt;
    const auto last_column = static_cast<double>(file.info.width - 1),
               last_row = static_cast<double>(file.info.height - 1);
    const Offset first = position_in(layer.where, file.where.first_x, file.where.first_y);
    const double column = std::nearbyint(first.column), row = std::nearbyint(first.row);
    if (!(std::abs(column) <= kMaxSide && std::abs(row) <= kMaxSide)) return std::nullopt;
    for (const auto& [c, r] :
         {Offset{0, 0}, Offset{last_column, 0}, Offset{0, last_row}, Offset{last_column, last_row}}) {
        const Offset at = position_in(layer.where, file.where.x(c, r), file.where.y(c, r));
        if (!(std::abs(at.column - column - c) <= kPhaseTolerance && std::abs(at.row - row - r) <= kPhaseTolerance))
            return std::nullopt;
    }
    return LayerMember{index, static_cast<std::int64_t>(column), static_cast<std::int64_t>(row)};
}

void add(Layer& layer, const LayerMember& member, const PlacedFile& file) {
    // The grid grows to the west and north, too: then all members move.
    const std::int64_t west = std::max<std::int64_t>(0, -member.column), north = std::max<std::int64_t>(0, -member.row);
    const double first_x = layer.where.x(static_cast<double>(-west), static_cast<double>(-north));
    layer.where.first_y = layer.where.y(static_cast<double>(-west), static_cast<double>(-north));
    layer.where.first_x = first_x;
    layer.members.push_back(member);
    for (LayerMember& m : layer.members) {
        m.column += west;
        m.row += north;
    }
    const LayerMember& placed = layer.members.back();
    layer.columns = std::max(layer.columns + west, placed.column + file.info.width);
    layer.rows = std::max(layer.rows + north, placed.row + file.info.height);
    layer.half_sample_rim = layer.half_sample_rim && !file.where.raster_is_point;
}

}  // namespace

Result<std::vector<Layer>> group_layers(const std::vector<PlacedFile>& files) {
    std::vector<Layer> layers;
    for (std::size_t i = 0; i < files.size(); ++i) {
        std::optional<LayerMember> member;
        if (!layers.empty()) member = place_in(layers.back(), files[i], i);
        if (!member) {
            layers.push_back({files[i].where, files[i].crs, 0, 0, true, {}});
            member = LayerMember{i, 0, 0};
        }
        add(layers.back(), *member, files[i]);
        if (static_cast<double>(layers.back().columns) > kMaxSide || static_cast<double>(layers.back().rows) > kMaxSide)
            return Error{
                ErrorCode::input,
                fmt::format("{}: lies so far from the files before it that their grid would be {} x {} samples",
                            files[i].path, layers.back().columns, layers.back().rows)};
    }
    return layers;
}

namespace {

PlaneBox box_around(const std::vector<double>& x, const std::vector<double>& y) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    PlaneBox box{kInfinity, kInfinity, -kInfinity, -kInfinity};
    for (std::size_t k = 0; k < x.size(); ++k) {
        if (!std::isfinite(x[k]) || !std::isfinite(y[k])) continue;
        box.west = std::min(box.west, x[k]);
        box.east = std::max(box.east, x[k]);
        box.south = std::min(box.south, y[k]);
        box.north = std::max(box.north, y[k]);
    }
    return box;
}

// Each within half a turn of the one before it, the first of a row of that of the row before.
void follow(std::vector<double>& x, double turn) {
    constexpr std::size_t kSide = kBoxSteps + 1;
    for (std::size_t k = 1; k < x.size(); ++k) {
        const double before = x[k % kSide == 0 ? k - kSide : k - 1];
        if (std::isfinite(before)) x[k] -= turn * std::nearbyint((x[k] - before) / turn);
    }
}

}  // namespace

Result<PlaneBox> box_of(const PlacedFile& file, const Crs& to) {
    auto transform = CrsTransform::make(file.crs, to);
    if (!transform) return Error{transform.error().code, fmt::format("{}: {}", file.path, transform.error().message)};
    std::vector<double> x, y;
    const auto last_column = static_cast<double>(file.info.width - 1),
               last_row = static_cast<double>(file.info.height - 1);
    for (int r = 0; r <= kBoxSteps; ++r)
        for (int c = 0; c <= kBoxSteps; ++c) {
            x.push_back(file.where.x(last_column * c / kBoxSteps, last_row * r / kBoxSteps));
            y.push_back(file.where.y(last_column * c / kBoxSteps, last_row * r / kBoxSteps));
        }
    const double first_x = x.front(), first_y = y.front();
    transform->apply(x, y);
    PlaneBox box = box_around(x, y);
    // Longitudes of a projected raster jump at the antimeridian. Followed from point to point they go on beyond it;
    // what holds a pole or spans half the Earth has no narrow box either way.
    if (to.turn() > 0 && box.east - box.west > to.turn() / 2) {
        follow(x, to.turn());
        const PlaneBox followed = box_around(x, y);
        if (followed.east - followed.west < to.turn() / 2) box = followed;
    }
    if (!(box.west <= box.east))
        return Error{ErrorCode::input,
                     fmt::format("{}: its first sample lies at ({}, {}) in {}, and nothing of it has a place in {}",
                                 file.path, first_x, first_y, file.crs.name(), to.name())};
    return box;
}

Result<void> check_unchanged(const PlacedFile& file, const ImageInfo& now) {
    if (file.info.width == now.width && file.info.height == now.height && file.info.channels == now.channels) return {};
    return Error{ErrorCode::input, fmt::format("{}: has changed while it was read", file.path)};
}

void turn_towards(double longitude, PlacedFile& file) {
    if (!file.crs.geographic()) return;
    const double middle =
        file.where.x(static_cast<double>(file.info.width - 1) / 2, static_cast<double>(file.info.height - 1) / 2);
    file.where.first_x -= 360 * std::nearbyint((middle - longitude) / 360);
}

}  // namespace scree
