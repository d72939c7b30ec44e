#include "tools/pyramid/coverage.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

// Samples around a file's box that resampling may reach.
constexpr double kAround = 8;

void join(Coverage::Runs& runs) {
    std::sort(runs.begin(), runs.end(), [](const auto& a, const auto& b) { return a.begin < b.begin; });
    Coverage::Runs joined;
    for (const Coverage::Run& run : runs) {
        if (!joined.empty() && run.begin <= joined.back().end)
            joined.back().end = std::max(joined.back().end, run.end);
        else
            joined.push_back(run);
    }
    runs = std::move(joined);
}

std::int64_t tiles_along(const Lattice& l, std::int64_t cells, int level) {
    return (cells + l.tile_extent(level) - 1) / l.tile_extent(level);
}

}  // namespace

Coverage::Coverage(const Lattice& base, std::span<const Box> files) : lattice_(base) {
    const int deepest = base.deepest_level;
    levels_.resize(static_cast<std::size_t>(deepest) + 1);
    const auto m = static_cast<double>(base.tile_cells());
    const std::int64_t columns = tiles_along(base, base.cells_x, deepest),
                       all_rows = tiles_along(base, base.cells_y, deepest);
    const auto tile = [&](double at, std::int64_t count) {
        return static_cast<std::int64_t>(std::clamp(std::floor(at / m), 0.0, static_cast<double>(count - 1)));
    };
    for (const Box& b : files) {
        const Run run{tile(b.west - kAround, columns), tile(b.east + kAround, columns) + 1};
        for (std::int64_t y = tile(b.north - kAround, all_rows); y <= tile(b.south + kAround, all_rows); ++y)
            levels_.back()[y].push_back(run);
    }
    for (int level = deepest; level >= 0; --level)
        for (auto& [y, runs] : levels_[static_cast<std::size_t>(level)]) {
            join(runs);
            if (level == 0) continue;
            Runs& above = levels_[static_cast<std::size_t>(level) - 1][y >> 1];
            for (const Run& run : runs) above.push_back({run.begin >> 1, (run.end + 1) >> 1});
        }
    if (2 * tile_count(*this, base, deepest) >= static_cast<double>(columns) * static_cast<double>(all_rows))
        levels_.clear();
}

const Coverage::Runs& Coverage::tiles(int level, std::int64_t y) const {
    static const Runs kNone;
    const auto& of_level = rows(level);
    const auto row = of_level.find(y);
    return row == of_level.end() ? kNone : row->second;
}

Coverage::Runs Coverage::samples(std::int64_t j) const {
    const std::int64_t m = lattice_.tile_cells();
    const auto of = [&](std::int64_t y) {
        Runs runs = tiles(lattice_.deepest_level, y);
        for (Run& run : runs) run = {run.begin * m, std::min(run.end * m, lattice_.cells_x) + 1};
        return runs;
    };
    Runs runs = of(j / m);
    if (j % m == 0 && j > 0) {  // the last row of the tiles above, too
        const Runs above = of(j / m - 1);
        runs.insert(runs.end(), above.begin(), above.end());
        join(runs);
    }
    return runs;
}

bool Coverage::reaches(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t count) const {
    const std::int64_t m = lattice_.tile_cells();
    const auto& of_level = rows(lattice_.deepest_level);
    for (auto row = of_level.lower_bound((std::max<std::int64_t>(j, 1) - 1) / m);
         row != of_level.end() && row->first * m < j + count; ++row)
        for (const Run& run : row->second)
            if (run.begin * m < i + columns && run.end * m >= i) return true;
    return false;
}

double Coverage::tile_count(const Coverage& coverage, const Lattice& base, int level) {
    if (coverage.everything())
        return static_cast<double>(tiles_along(base, base.cells_x, level)) *
               static_cast<double>(tiles_along(base, base.cells_y, level));
    double count = 0;
    for (const auto& [y, runs] : coverage.rows(level))
        for (const Run& run : runs) count += static_cast<double>(run.end - run.begin);
    return count;
}

}  // namespace scree
