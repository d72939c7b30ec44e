#include "tools/source/geo_grid_maker.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tools/source/crs.h"

namespace scree {
namespace {

constexpr double kMargin = 0.1;      // of the lattice's side, on each side
constexpr double kSeenShare = 0.95;  // of the greatest error that the places tried may have shown
constexpr double kAnywhere_m = 2e7;
constexpr double kErrorSteps = 1e4;  // a metre: it is rounded up to 0.1 mm

using Normals = std::vector<std::array<double, 3>>;

class Maker {
public:
    Maker(const Lattice& lattice, CrsTransform transform)
        : lattice_(lattice), transform_(std::move(transform)), tolerance_m_(geo_grid_tolerance_m(lattice)) {}

    std::optional<GeoGrid> make() const {
        auto wide = best_over(box(kMargin));
        if (wide && wide->error_m <= tolerance_m_) return wide;
        auto narrow = best_over(box(0));
        return narrow ? narrow : wide;
    }

private:
    std::array<double, 4> box(double margin) const {
        const auto cells_x = static_cast<double>(lattice_.cells_x), cells_y = static_cast<double>(lattice_.cells_y);
        return {lattice_.x_m(-margin * cells_x), lattice_.y_m((1 + margin) * cells_y),
                lattice_.x_m((1 + margin) * cells_x), lattice_.y_m(-margin * cells_y)};
    }

    std::optional<GeoGrid> best_over(const std::array<double, 4>& box) const {
        std::optional<GeoGrid> last;
        for (int nodes = 2; nodes <= GeoGrid::kMostNodes; ++nodes) {
            auto grid = grid_of(box, nodes);
            if (!grid) break;
            const auto error = error_of(*grid, tolerance_m_);
            if (!error) return std::nullopt;
            grid->error_m = *error;
            last = std::move(grid);
            if (*error <= tolerance_m_) return last;
        }
        // The largest, which may be off by more: by how much in all.
        if (!last) return last;
        const auto error = error_of(*last, 1e300);
        if (!error) return std::nullopt;
        last->error_m = *error;
        return last;
    }

    // With so many nodes along the longer side, as a store gives it back. None where a node has no place on the earth,
    // or the text would be too long.
    std::optional<GeoGrid> grid_of(const std::array<double, 4>& box, int nodes) const {
        GeoGrid grid;
        const double wide = box[2] - box[0], high = box[3] - box[1], longer = std::max(wide, high);
        const auto along = [&](double side) {
            return std::clamp(static_cast<int>(std::ceil((nodes - 1) * side / longer - 1e-9)) + 1, std::min(nodes, 4),
                              nodes);
        };
        grid.columns = along(wide);
        grid.rows = along(high);
        grid.box_m = box;
        std::vector<double> x, y;
        for (int j = 0; j < grid.rows; ++j)
            for (int i = 0; i < grid.columns; ++i) {
                x.push_back(x_at(grid, i));
                y.push_back(y_at(grid, j));
            }
        auto normals = normals_at(x, y);
        if (!normals) return std::nullopt;
        grid.normals = std::move(*normals);
        const std::string text = normals_to_text(grid);
        if (text.size() > kMostNormalsText) return std::nullopt;
        auto stored = normals_from_text(text, grid.columns, grid.rows);
        if (!stored) return std::nullopt;
        grid.normals = std::move(*stored);
        if (!grid.check()) return std::nullopt;
        return grid;
    }

    static double x_at(const GeoGrid& grid, double column) {
        return grid.box_m[0] + column / (grid.columns - 1) * (grid.box_m[2] - grid.box_m[0]);
    }
    static double y_at(const GeoGrid& grid, double row) {
        return grid.box_m[3] - row / (grid.rows - 1) * (grid.box_m[3] - grid.box_m[1]);
    }

    std::optional<Normals> normals_at(std::vector<double> x, std::vector<double> y) const {
        transform_.apply(x, y);
        Normals normals;
        for (std::size_t k = 0; k < x.size(); ++k) {
            if (!std::isfinite(x[k]) || !std::isfinite(y[k])) return std::nullopt;
            normals.push_back(normal_of({x[k], y[k]}));
        }
        return normals;
    }

    // Looks no further once it is above `enough_m`. None where a place between the nodes has none on the earth.
    std::optional<double> error_of(const GeoGrid& grid, double enough_m) const {
        double greatest_m = 0;
        for (const int row : rows_of_cells(grid.rows - 1)) {
            const auto error_m = row_error(grid, row);
            if (!error_m) return std::nullopt;
            greatest_m = std::max(greatest_m, *error_m);
            if (greatest_m > enough_m) break;
        }
        return std::ceil(greatest_m / kSeenShare * kErrorSteps) / kErrorSteps;
    }

    // The worst first: where interpolation is one-sided.
    static std::vector<int> rows_of_cells(int count) {
        std::vector<int> rows{0};
        if (count > 1) rows.push_back(count - 1);
        for (int row = 1; row < count - 1; ++row) rows.push_back(row);
        return rows;
    }

    std::optional<double> row_error(const GeoGrid& grid, int row) const {
        // Middles and, for the cells at the border, three tenths, where the polynomials stray farthest.
        const int parts = std::max(grid.columns, grid.rows) < 6 ? 15 : 5;
        std::vector<double> x, y;
        for (int part_y = 0; part_y < parts; ++part_y)
            for (int i = 0; i < (grid.columns - 1) * parts; ++i) {
                x.push_back(x_at(grid, (i + 0.5) / parts));
                y.push_back(y_at(grid, row + (part_y + 0.5) / parts));
            }
        const auto truth = normals_at(x, y);
        if (!truth) return std::nullopt;
        double greatest_m = 0;
        for (std::size_t k = 0; k < x.size(); ++k) {
            const auto at = grid.lon_lat(x[k], y[k]);
            // Nodes on opposite sides of the earth have nothing between them: it might be anywhere.
            greatest_m = std::max(greatest_m, at ? ground_distance_m(normal_of(*at), (*truth)[k]) : kAnywhere_m);
        }
        return greatest_m;
    }

    const Lattice& lattice_;
    CrsTransform transform_;
    double tolerance_m_;
};

}  // namespace

double geo_grid_tolerance_m(const Lattice& lattice) { return std::max(0.01, lattice.spacing_m / 1000); }

std::optional<GeoGrid> make_geo_grid(const Lattice& lattice, const std::string& crs) {
    if (crs.empty()) return std::nullopt;
    const auto from = Crs::parse(crs), degrees = Crs::parse("EPSG:4326");
    if (!from || !degrees) return std::nullopt;
    auto transform = CrsTransform::make(*from, *degrees);
    if (!transform) return std::nullopt;
    return Maker(lattice, std::move(*transform)).make();
}

}  // namespace scree
