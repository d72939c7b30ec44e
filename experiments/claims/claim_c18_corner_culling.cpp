// C18: a tile may be in view though none of its corners is.
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/sampling.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

constexpr int kCells = 16;  // of a tile, to see whether any of its ground is in view

/// The terrain over and over, mirrored at its sides, stretched in plan so that a tile has kCells cells.
class Tiling {
public:
    Tiling(const Terrain& terrain, double tile_m) : terrain_(terrain), cell_m_(tile_m / kCells) {}
    glm::dvec3 place(std::int64_t i, std::int64_t j) const {
        return {cell_m_ * static_cast<double>(i), cell_m_ * static_cast<double>(j),
                terrain_.z_m(mirrored(i, terrain_.columns), mirrored(j, terrain_.rows))};
    }
    double tile_m() const { return cell_m_ * kCells; }

private:
    static int mirrored(std::int64_t k, int count) {
        const std::int64_t period = 2 * (static_cast<std::int64_t>(count) - 1);
        const std::int64_t at = ((k % period) + period) % period;
        return static_cast<int>(std::min(at, period - at));
    }
    const Terrain& terrain_;
    double cell_m_;
};

struct Seen {
    bool ground = false, ground_corner = false, box_corner = false, box = false;
};

Seen look(const Tiling& tiling, const Frustum& frustum, std::int64_t x, std::int64_t y) {
    Box box{{1e30, 1e30, 1e30}, {-1e30, -1e30, -1e30}};
    std::vector<glm::dvec3> places;
    for (std::int64_t j = 0; j <= kCells; ++j)
        for (std::int64_t i = 0; i <= kCells; ++i) {
            places.push_back(tiling.place(x * kCells + i, y * kCells + j));
            box.low = glm::min(box.low, places.back());
            box.high = glm::max(box.high, places.back());
        }
    Seen seen;
    seen.box = frustum.may_see(box);
    for (int k = 0; k < 8; ++k)
        seen.box_corner |=
            frustum.contains({k % 2 == 0 ? box.low.x : box.high.x, k / 2 % 2 == 0 ? box.low.y : box.high.y,
                              k / 4 == 0 ? box.low.z : box.high.z});
    for (const std::size_t corner : {0, kCells, kCells * (kCells + 1), (kCells + 1) * (kCells + 1) - 1})
        seen.ground_corner |= frustum.contains(places[corner]);
    for (const glm::dvec3& place : places) seen.ground |= frustum.contains(place);
    return seen;
}

}  // namespace

Figure claim_c18_corner_culling(const ClaimBench& bench) {
    const int cameras = bench.amount(2000, 150);
    constexpr double kReach_m = 15'000;  // tiles no further than this are counted
    Figure figure{
        "C18",
        "Of the tiles in view the corner test loses some, of large ones a good part; the box test loses none.",
        "KE section 4",
        "A tile is visible if one of its four corners is in the view frustum.",
        fmt::format("{} stretched over tiles of {} cells, {} random cameras a row, 5 m to 2000 m above the ground, 40 "
                    "degrees, square picture; tiles with ground in view within {:g} km",
                    bench.terrain.name, kCells, cameras, kReach_m / 1000),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"tile (m)", "tiles in view", "lost by four ground corners (%)", "lost by eight box corners (%)",
                       "lost by box against planes (%)", "out of view and kept by the box test (%)"},
                      {}};
    BarChart chart{"Tiles in view that are lost",
                   figure.setting,
                   "tile (m)",
                   {},
                   {"lost (%)", false, {}},
                   {{"four ground corners (KE)", {}}, {"eight box corners", {}}, {"box against planes", {}}},
                   {}};
    double least = 100, most = 0, by_box = 0;
    for (const double tile_m : {1320.0, 5280.0, 21120.0}) {
        const Tiling tiling(bench.terrain, tile_m);
        Sampler random(bench.seed + 18);
        std::int64_t visible = 0, lost4 = 0, lost8 = 0, lost_box = 0, hidden = 0, kept = 0;
        for (int k = 0; k < cameras; ++k) {
            const double x = random.uniform(0, 4 * 21120), y = random.uniform(0, 4 * 21120);
            const auto cell = [&](double metres) {
                return static_cast<std::int64_t>(std::floor(metres / tile_m * kCells));
            };
            const double ground = tiling.place(cell(x), cell(y)).z;
            const Camera camera = camera_at({x, y, ground + random.log_uniform(5, 2000)},
                                            random.uniform(0, 6.283185307179586), random.uniform(-0.8, 0.1));
            const Frustum frustum(camera);
            const auto reach = static_cast<std::int64_t>(std::ceil(kReach_m / tile_m));
            const auto tx = static_cast<std::int64_t>(std::floor(x / tile_m)),
                       ty = static_cast<std::int64_t>(std::floor(y / tile_m));
            for (std::int64_t v = ty - reach; v <= ty + reach; ++v)
                for (std::int64_t u = tx - reach; u <= tx + reach; ++u) {
                    const Box column{{static_cast<double>(u) * tile_m, static_cast<double>(v) * tile_m, -1e5},
                                     {static_cast<double>(u + 1) * tile_m, static_cast<double>(v + 1) * tile_m, 1e5}};
                    if (distance_to_box(camera.eye, column) > kReach_m) continue;
                    if (!frustum.may_see(column)) {
                        ++hidden;
                        continue;
                    }
                    const Seen seen = look(tiling, frustum, u, v);
                    if (seen.ground) {
                        ++visible;
                        lost4 += seen.ground_corner ? 0 : 1;
                        lost8 += seen.box_corner ? 0 : 1;
                        lost_box += seen.box ? 0 : 1;
                    } else {
                        ++hidden;
                        kept += seen.box ? 1 : 0;
                    }
                }
        }
        const auto percent = [](std::int64_t part, std::int64_t of) {
            return of > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(of) : 0.0;
        };
        const double four = percent(lost4, visible);
        table.rows.push_back({tile_m, static_cast<double>(visible), four, percent(lost8, visible),
                              percent(lost_box, visible), percent(kept, hidden)});
        chart.groups.push_back(fmt::format("{:g}", tile_m));
        chart.series[0].values.push_back(four);
        chart.series[1].values.push_back(percent(lost8, visible));
        chart.series[2].values.push_back(percent(lost_box, visible));
        least = std::min(least, four);
        most = std::max(most, four);
        by_box += static_cast<double>(lost_box);
    }
    // In the middle of a tile of 20 km, looking at its middle: no corner in view.
    const Camera inside = camera_at({0, 0, 500}, 0, -0.5);
    bool corner = false;
    for (const double x : {-10'000.0, 10'000.0})
        for (const double y : {-10'000.0, 10'000.0}) corner |= Frustum(inside).contains({x, y, 0});
    const bool box = Frustum(inside).may_see({{-10'000, -10'000, 0}, {10'000, 10'000, 0}});
    figure.checks = {at_least("four corners: tiles lost at the least tile size (%)", least, 0.2),
                     at_least("four corners: tiles lost at the worst tile size (%)", most, 10),
                     at_most("box against planes: tiles lost", by_box, 0),
                     at_most("eye in a tile of 20 km looking at its middle: corners in view", corner ? 1 : 0, 0),
                     at_least("the same: the box test sees it", box ? 1 : 0, 1)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
