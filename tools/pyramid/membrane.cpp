#include "tools/pyramid/membrane.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace scree {
namespace {

constexpr int kSweeps = 2;              // before and after each coarse correction
constexpr int kCoarsestSweeps = 8;      // a hole without a coarser level is at most some 4 samples thick
constexpr int kMaxCycles = 64;          // met cases take 8 to 20
constexpr double kTolerance = 1e-7;     // of the rim's range, on the largest change in a cycle
constexpr std::size_t kMaxLevels = 24;  // halves 2^24 samples to one

std::size_t at(std::int64_t x, std::int64_t y, std::int64_t width) { return static_cast<std::size_t>(y * width + x); }

// One-dimensional factors of the tensor stencil k (x) m + m (x) k: k begins as [-1 2 -1], m as [0 1 0]; each coarsening
// makes P^T k P and P^T m P with P = [1/2 1 1/2].
struct Factor {
    double centre, side;
    Factor coarser() const { return {1.5 * centre + 2 * side, 0.25 * centre + side}; }
};

}  // namespace

void Membrane::find_extents(Level& level) {
    level.rows.assign(static_cast<std::size_t>(level.height), {});
    for (std::int64_t y = 0; y < level.height; ++y) {
        const auto row = level.unknown.subspan(at(0, y, level.width), static_cast<std::size_t>(level.width));
        const auto first = std::find(row.begin(), row.end(), 1);
        if (first == row.end()) continue;
        const auto last = std::find(row.rbegin(), row.rend(), 1);
        level.rows[static_cast<std::size_t>(y)] = {first - row.begin(), row.rend() - last};
    }
}

// A coarse sample is unknown where the nine fine samples under its hat all are. False: there is none.
bool Membrane::coarsen(const Level& fine, Level& coarse) {
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    const std::size_t size = at(0, coarse.height, coarse.width);
    coarse.own_unknown.assign(size, 0);
    bool any = false;
    for (std::int64_t y = 0; y < coarse.height; ++y) {
        const Extent extent = fine.rows[static_cast<std::size_t>(2 * y)];
        for (std::int64_t x = (extent.begin + 1) / 2; 2 * x < extent.end; ++x) {
            const std::uint8_t* centre = fine.unknown.data() + at(2 * x, 2 * y, fine.width);
            bool inside = true;
            for (std::int64_t dy = -1; inside && dy <= 1; ++dy)
                for (std::int64_t dx = -1; inside && dx <= 1; ++dx) inside = centre[dy * fine.width + dx] != 0;
            coarse.own_unknown[at(x, y, coarse.width)] = inside;
            any |= inside;
        }
    }
    if (!any) return false;
    coarse.own_u.assign(size, 0);
    coarse.own_right.assign(size, 0);
    coarse.u = coarse.own_u;
    coarse.right = coarse.own_right;
    coarse.unknown = coarse.own_unknown;
    find_extents(coarse);
    return true;
}

void Membrane::measure_rim(const Level& level) {
    rim_ = {INFINITY, -INFINITY};
    const auto meet = [&](std::size_t k) {
        if (level.unknown[k] != 0) return;
        rim_.low = std::min(rim_.low, level.u[k]);
        rim_.high = std::max(rim_.high, level.u[k]);
    };
    const auto width = static_cast<std::size_t>(level.width);
    for (std::int64_t y = 0; y < level.height; ++y) {
        const Extent extent = level.rows[static_cast<std::size_t>(y)];
        for (std::int64_t x = extent.begin; x < extent.end; ++x) {
            const std::size_t k = at(x, y, level.width);
            if (level.unknown[k] == 0) continue;
            for (const std::size_t beside : {k - 1, k + 1, k - width, k + width}) meet(beside);
        }
    }
}

// Each row of the hole begins as the straight line between its ends.
void Membrane::start(Level& level) const {
    for (std::int64_t y = 0; y < level.height; ++y) {
        const Extent extent = level.rows[static_cast<std::size_t>(y)];
        for (std::int64_t x = extent.begin; x < extent.end;) {
            const std::size_t k = at(x, y, level.width);
            if (level.unknown[k] == 0) {
                ++x;
                continue;
            }
            std::size_t n = 1;
            while (level.unknown[k + n] != 0) ++n;
            const double a = level.u[k - 1], b = level.u[k + n];
            for (std::size_t i = 0; i < n; ++i)
                level.u[k + i] = a + (b - a) * (static_cast<double>(i + 1) / static_cast<double>(n + 1));
            x += static_cast<std::int64_t>(n);
        }
    }
}

// A Gauss-Seidel sweep; the largest change.
double Membrane::relax(Level& level, bool forward) const {
    const Stencil s = level.stencil;
    const double by_centre = 1 / s.centre;
    const std::ptrdiff_t width = level.width;
    double largest = 0;
    for (std::int64_t row = 0; row < level.height; ++row) {
        const std::int64_t y = forward ? row : level.height - 1 - row;
        const Extent extent = level.rows[static_cast<std::size_t>(y)];
        for (std::int64_t column = extent.begin; column < extent.end; ++column) {
            const std::size_t k = at(forward ? column : extent.begin + extent.end - 1 - column, y, width);
            if (level.unknown[k] == 0) continue;
            double* u = level.u.data() + k;
            double sum = level.right.empty() ? 0 : level.right[k];
            sum -= s.edge * ((u[-1] + u[1]) + (u[-width] + u[width]));
            if (s.corner != 0) sum -= s.corner * ((u[-width - 1] + u[-width + 1]) + (u[width - 1] + u[width + 1]));
            const double value = sum * by_centre;
            largest = std::max(largest, std::abs(value - *u));
            *u = value;
        }
    }
    return largest;
}

// Within the row's extent, zero where nothing is unknown.
void Membrane::residual_row(const Level& level, std::int64_t y, double* out) const {
    const Stencil s = level.stencil;
    const std::ptrdiff_t width = level.width;
    const Extent extent = level.rows[static_cast<std::size_t>(y)];
    for (std::int64_t x = extent.begin; x < extent.end; ++x) {
        const std::size_t k = at(x, y, width);
        out[x] = 0;
        if (level.unknown[k] == 0) continue;
        const double* u = level.u.data() + k;
        double sum = level.right.empty() ? 0 : level.right[k];
        sum -= s.centre * *u + s.edge * ((u[-1] + u[1]) + (u[-width] + u[width]));
        if (s.corner != 0) sum -= s.corner * ((u[-width - 1] + u[-width + 1]) + (u[width - 1] + u[width + 1]));
        out[x] = sum;
    }
}

// The transpose of the interpolation. A hat lies inside the hole, so no sample outside a row's extent is read.
void Membrane::restrict_residual(const Level& fine, Level& coarse) {
    residuals_.resize(static_cast<std::size_t>(3 * fine.width));
    double* above = residuals_.data();
    double* middle = above + fine.width;
    double* below = middle + fine.width;
    std::int64_t below_is = -1;
    for (std::int64_t y = 0; y < coarse.height; ++y) {
        const Extent extent = coarse.rows[static_cast<std::size_t>(y)];
        if (extent.begin == extent.end) continue;
        if (below_is == 2 * y - 1)
            std::swap(above, below);
        else
            residual_row(fine, 2 * y - 1, above);
        residual_row(fine, 2 * y, middle);
        residual_row(fine, 2 * y + 1, below);
        below_is = 2 * y + 1;
        for (std::int64_t x = extent.begin; x < extent.end; ++x) {
            const std::size_t k = at(x, y, coarse.width);
            coarse.own_u[k] = 0;
            if (coarse.unknown[k] == 0) continue;
            const std::int64_t f = 2 * x;
            coarse.own_right[k] = middle[f] + 0.5 * ((middle[f - 1] + middle[f + 1]) + (above[f] + below[f])) +
                                  0.25 * ((above[f - 1] + above[f + 1]) + (below[f - 1] + below[f + 1]));
        }
    }
}

// Adds the bilinear interpolation of the coarse level; at least its largest change.
double Membrane::correct(const Level& coarse, Level& fine) const {
    double largest = 0;
    const std::ptrdiff_t width = fine.width;
    for (std::int64_t y = 0; y < coarse.height; ++y) {
        const Extent extent = coarse.rows[static_cast<std::size_t>(y)];
        for (std::int64_t x = extent.begin; x < extent.end; ++x) {
            const double v = coarse.u[at(x, y, coarse.width)];
            largest = std::max(largest, std::abs(v));
            if (v == 0) continue;
            double* u = fine.u.data() + at(2 * x, 2 * y, width);
            u[0] += v;
            for (const std::ptrdiff_t side : {std::ptrdiff_t{-1}, std::ptrdiff_t{1}, -width, width}) u[side] += 0.5 * v;
            for (const std::ptrdiff_t corner : {-width - 1, -width + 1, width - 1, width + 1}) u[corner] += 0.25 * v;
        }
    }
    return largest;
}

// One V-cycle from level l down; the largest change of any of its steps on level l.
double Membrane::cycle(std::size_t l) {
    Level& level = levels_[l];
    const bool coarsest = l + 1 == used_levels_;
    double largest = 0;
    for (int sweep = 0; sweep < (coarsest ? kCoarsestSweeps / 2 : kSweeps); ++sweep)
        largest = std::max(largest, relax(level, true));
    if (!coarsest) {
        restrict_residual(level, levels_[l + 1]);
        cycle(l + 1);
        largest = std::max(largest, correct(levels_[l + 1], level));
    }
    for (int sweep = 0; sweep < (coarsest ? kCoarsestSweeps / 2 : kSweeps); ++sweep)
        largest = std::max(largest, relax(level, false));
    return largest;
}

bool Membrane::solve(const Window& window, const std::function<bool()>& keep_going) {
    levels_.resize(kMaxLevels);  // buffers of levels not used this time are kept
    Level& finest = levels_[0];
    finest.width = window.width;
    finest.height = window.height;
    finest.u = window.values;
    finest.right = {};
    finest.unknown = window.unknown;
    find_extents(finest);
    Factor k{2, -1}, m{1, 0};
    for (used_levels_ = 0; used_levels_ < kMaxLevels; ++used_levels_) {
        if (used_levels_ > 0 && !coarsen(levels_[used_levels_ - 1], levels_[used_levels_])) break;
        levels_[used_levels_].stencil = {2 * k.centre * m.centre, k.centre * m.side + k.side * m.centre,
                                         2 * k.side * m.side};
        k = k.coarser();
        m = m.coarser();
    }
    measure_rim(finest);
    start(finest);
    const double enough = kTolerance * (rim_.high - rim_.low);
    for (int i = 0; i < kMaxCycles; ++i) {
        if (keep_going && !keep_going()) return false;
        if (cycle(0) <= enough) break;
    }
    for (std::int64_t y = 0; y < finest.height; ++y) {
        const Extent extent = finest.rows[static_cast<std::size_t>(y)];
        for (std::int64_t x = extent.begin; x < extent.end; ++x)
            if (const std::size_t i = at(x, y, finest.width); finest.unknown[i] != 0)
                finest.u[i] = std::isnan(finest.u[i]) ? rim_.low  // differences of the rim's heights overflow
                                                      : std::clamp(finest.u[i], rim_.low, rim_.high);
    }
    return true;
}

}  // namespace scree
