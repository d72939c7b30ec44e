#include "tools/pyramid/membrane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace scree {
namespace {

using Extent = Membrane::Extent;
using Coarse = Membrane::Coarse;
using Window = Membrane::Window;

constexpr int kSweeps = 2;                 // before and after each coarse correction
constexpr int kCoarsestSweeps = 8;         // leave a fifth of the slowest error of 6 x 6 unknowns, cos(pi/7)^2 each
constexpr std::int64_t kCoarsestSide = 8;  // a window whose sides are no longer has no coarser level
constexpr int kMaxCycles = 64;             // seen: 5 to 15
constexpr double kTolerance = 1e-6;        // of the rim's range, on the largest change in a cycle
constexpr std::size_t kEntries = 5;

std::size_t at(std::int64_t x, std::int64_t y, std::int64_t width) { return static_cast<std::size_t>(y * width + x); }

template <class Unknown>
void find_extents(std::int64_t width, std::int64_t height, const Unknown& unknown, std::vector<Extent>& rows) {
    rows.assign(static_cast<std::size_t>(height), {});
    for (std::int64_t y = 0; y < height; ++y) {
        std::int64_t begin = 0, end = width;
        while (begin < width && !unknown(at(begin, y, width))) ++begin;
        if (begin == width) continue;
        while (!unknown(at(end - 1, y, width))) --end;
        rows[static_cast<std::size_t>(y)] = {begin, end};
    }
}

// --- operators, as the coarsening asks for them: the entry between (x, y) and its neighbour (dx, dy) ---

class FinestOperator {
public:
    explicit FinestOperator(const Window& window) : window_(window) {}
    std::int64_t width() const { return window_.width; }
    std::int64_t height() const { return window_.height; }
    bool unknown(std::int64_t x, std::int64_t y) const { return window_.unknown[at(x, y, window_.width)] != 0; }
    double entry(std::int64_t x, std::int64_t y, std::int64_t dx, std::int64_t dy) const {
        if (dx == 0 && dy == 0) return 4;
        return dx * dy == 0 && unknown(x + dx, y + dy) ? -1 : 0;
    }

private:
    const Window& window_;
};

class CoarseOperator {
public:
    explicit CoarseOperator(const Coarse& level) : level_(level) {}
    std::int64_t width() const { return level_.width; }
    std::int64_t height() const { return level_.height; }
    bool unknown(std::int64_t x, std::int64_t y) const { return level_.entries[kEntries * at(x, y, level_.width)] > 0; }
    double entry(std::int64_t x, std::int64_t y, std::int64_t dx, std::int64_t dy) const {
        if (dy < 0 || (dy == 0 && dx < 0)) return entry(x + dx, y + dy, -dx, -dy);
        const auto which = static_cast<std::size_t>(dy == 0 ? dx : dx + 3);
        return static_cast<double>(level_.entries[kEntries * at(x, y, level_.width) + which]);
    }

private:
    const Coarse& level_;
};

// A hat's value at that distance from its centre.
double hat(std::int64_t distance) { return distance == 0 ? 1 : distance == 1 || distance == -1 ? 0.5 : 0; }

// The node's row of P^T A P: over the samples under its hat, their neighbours, and the hats over those.
template <class Operator>
std::array<double, kEntries> galerkin_entries(const Operator& fine, std::int64_t x, std::int64_t y) {
    std::array<double, kEntries> sums{};
    const std::int64_t centre_x = 2 * x - 2, centre_y = 2 * y - 2;
    for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i) {
            const std::int64_t fx = centre_x + i, fy = centre_y + j;
            if (fx < 0 || fy < 0 || fx >= fine.width() || fy >= fine.height() || !fine.unknown(fx, fy)) continue;
            for (std::int64_t dy = -1; dy <= 1; ++dy)
                for (std::int64_t dx = -1; dx <= 1; ++dx) {
                    const double a = fine.entry(fx, fy, dx, dy) * hat(i) * hat(j);
                    if (a == 0) continue;
                    const std::int64_t u = i + dx, v = j + dy;
                    sums[0] += a * hat(u) * hat(v);
                    sums[1] += a * hat(u - 2) * hat(v);
                    sums[2] += a * hat(u + 2) * hat(v - 2);
                    sums[3] += a * hat(u) * hat(v - 2);
                    sums[4] += a * hat(u - 2) * hat(v - 2);
                }
        }
    return sums;
}

template <class Operator>
void coarsen(const Operator& fine, const std::vector<Extent>& fine_rows, Coarse& coarse) {
    coarse.width = (fine.width() + 1) / 2 + 2;
    coarse.height = (fine.height() + 1) / 2 + 2;
    const std::size_t size = at(0, coarse.height, coarse.width);
    coarse.entries.assign(size * kEntries, 0);
    coarse.u.assign(size, 0);
    coarse.right.assign(size, 0);
    for (std::int64_t y = 1; y + 1 < coarse.height; ++y) {
        Extent reach{fine.width(), 0};
        for (std::int64_t fy = std::max<std::int64_t>(2 * y - 3, 0); fy <= std::min(2 * y - 1, fine.height() - 1); ++fy)
            if (const Extent e = fine_rows[static_cast<std::size_t>(fy)]; e.begin < e.end)
                reach = {std::min(reach.begin, e.begin), std::max(reach.end, e.end)};
        for (std::int64_t x = (reach.begin + 2) / 2; 2 * x - 3 < reach.end; ++x) {
            const auto entries = galerkin_entries(fine, x, y);
            std::transform(entries.begin(), entries.end(),
                           coarse.entries.begin() + static_cast<std::ptrdiff_t>(kEntries * at(x, y, coarse.width)),
                           [](double v) { return static_cast<float>(v); });
        }
    }
    find_extents(
        coarse.width, coarse.height, [&](std::size_t k) { return coarse.entries[kEntries * k] > 0; }, coarse.rows);
}

// --- the finest level ---

Membrane::Rim rim_of(const Window& window, const std::vector<Extent>& rows) {
    Membrane::Rim rim{INFINITY, -INFINITY};
    const auto width = static_cast<std::size_t>(window.width);
    for (std::int64_t y = 0; y < window.height; ++y)
        for (std::int64_t x = rows[static_cast<std::size_t>(y)].begin; x < rows[static_cast<std::size_t>(y)].end; ++x) {
            const std::size_t k = at(x, y, window.width);
            if (window.unknown[k] == 0) continue;
            for (const std::size_t beside : {k - 1, k + 1, k - width, k + width}) {
                if (window.unknown[beside] != 0) continue;
                rim.low = std::min(rim.low, window.values[beside]);
                rim.high = std::max(rim.high, window.values[beside]);
            }
        }
    return rim;
}

// Each row of the hole begins as the straight line between its ends.
void start(const Window& window, const std::vector<Extent>& rows) {
    for (std::int64_t y = 0; y < window.height; ++y)
        for (std::int64_t x = rows[static_cast<std::size_t>(y)].begin; x < rows[static_cast<std::size_t>(y)].end;) {
            const std::size_t k = at(x, y, window.width);
            std::size_t n = 0;
            while (window.unknown[k + n] != 0) ++n;
            const double a = window.values[k - 1], b = window.values[k + n];
            for (std::size_t i = 0; i < n; ++i)
                window.values[k + i] = a + (b - a) * (static_cast<double>(i + 1) / static_cast<double>(n + 1));
            x += static_cast<std::int64_t>(n) + 1;
        }
}

// A Gauss-Seidel sweep; the largest change. `step` 1: eastward and southward, -1: back.
double relax(const Window& window, const std::vector<Extent>& rows, std::ptrdiff_t step) {
    const std::ptrdiff_t width = window.width;
    double largest = 0;
    for (std::int64_t row = 0; row < window.height; ++row) {
        const std::int64_t y = step > 0 ? row : window.height - 1 - row;
        const Extent extent = rows[static_cast<std::size_t>(y)];
        if (extent.begin == extent.end) continue;
        const std::size_t first = at(step > 0 ? extent.begin : extent.end - 1, y, width);
        double* u = window.values.data() + first;
        const std::uint8_t* unknown = window.unknown.data() + first;
        double behind = u[-step];
        for (std::int64_t n = extent.end - extent.begin; n > 0; --n, u += step, unknown += step) {
            if (*unknown == 0) {
                behind = *u;
                continue;
            }
            behind = 0.25 * (behind + (u[step] + (u[-width] + u[width])));
            largest = std::max(largest, std::abs(behind - *u));
            *u = behind;
        }
    }
    return largest;
}

// --- coarse levels ---

// What the node's neighbours add to its equation.
float neighbours(const Coarse& level, std::size_t k) {
    const auto width = static_cast<std::ptrdiff_t>(level.width);
    const float* u = level.u.data() + k;
    const float* e = level.entries.data() + kEntries * k;
    const auto stride = static_cast<std::ptrdiff_t>(kEntries);
    const float* north = e - stride * width;
    return ((e[1] * u[1] + e[1 - stride] * u[-1]) + (e[3] * u[width] + north[3] * u[-width])) +
           ((e[2] * u[width - 1] + e[4] * u[width + 1]) +
            (north[4 - stride] * u[-width - 1] + north[2 + stride] * u[-width + 1]));
}

void relax(Coarse& level, std::ptrdiff_t step) {
    for (std::int64_t row = 0; row < level.height; ++row) {
        const std::int64_t y = step > 0 ? row : level.height - 1 - row;
        const Extent extent = level.rows[static_cast<std::size_t>(y)];
        for (std::int64_t n = 0; n < extent.end - extent.begin; ++n) {
            const std::size_t k = at(step > 0 ? extent.begin + n : extent.end - 1 - n, y, level.width);
            const float centre = level.entries[kEntries * k];
            if (centre > 0) level.u[k] = (level.right[k] - neighbours(level, k)) / centre;
        }
    }
}

// --- between levels ---

// Residuals of a row, zero where nothing is unknown.
void residual_row(const Window& window, const Extent& extent, std::int64_t y, double* out) {
    const std::ptrdiff_t width = window.width;
    std::fill(out, out + width, 0.0);
    for (std::int64_t x = extent.begin; x < extent.end; ++x) {
        const std::size_t k = at(x, y, width);
        if (window.unknown[k] == 0) continue;
        const double* u = window.values.data() + k;
        out[x] = ((u[-1] + u[1]) + (u[-width] + u[width])) - 4 * *u;
    }
}
void residual_row(const Coarse& level, const Extent& extent, std::int64_t y, double* out) {
    std::fill(out, out + level.width, 0.0);
    for (std::int64_t x = extent.begin; x < extent.end; ++x) {
        const std::size_t k = at(x, y, level.width);
        const float centre = level.entries[kEntries * k];
        if (centre > 0) out[x] = static_cast<double>(level.right[k] - centre * level.u[k] - neighbours(level, k));
    }
}

// The coarse level's right side is P^T of the residual; its correction begins as zero. `rows` holds three rows with a
// zero sample before and two behind each.
template <class Fine>
void restrict_residual(const Fine& fine, const std::vector<Extent>& fine_rows, Coarse& coarse,
                       std::vector<double>& buffer) {
    const std::size_t pitch = static_cast<std::size_t>(fine.width) + 3;
    buffer.assign(3 * pitch, 0);
    double* above = buffer.data() + 1;
    double* middle = above + pitch;
    double* below = middle + pitch;
    const auto load = [&](std::int64_t y, double* out) {
        if (y >= 0 && y < fine.height)
            residual_row(fine, fine_rows[static_cast<std::size_t>(y)], y, out);
        else
            std::fill(out, out + fine.width, 0.0);
    };
    for (std::int64_t y = 1; y + 1 < coarse.height; ++y) {
        std::swap(above, below);  // zero before the first row
        load(2 * y - 2, middle);
        load(2 * y - 1, below);
        const Extent extent = coarse.rows[static_cast<std::size_t>(y)];
        for (std::int64_t x = extent.begin; x < extent.end; ++x) {
            const std::size_t k = at(x, y, coarse.width);
            const std::int64_t f = 2 * x - 2;
            coarse.u[k] = 0;
            coarse.right[k] =
                static_cast<float>(middle[f] + 0.5 * ((middle[f - 1] + middle[f + 1]) + (above[f] + below[f])) +
                                   0.25 * ((above[f - 1] + above[f + 1]) + (below[f - 1] + below[f + 1])));
        }
    }
}

// The bilinear interpolation of the coarse level at fine sample (x, y).
float interpolated(const Coarse& coarse, std::int64_t x, std::int64_t y) {
    const std::size_t k = at(x / 2 + 1, y / 2 + 1, coarse.width);
    const float* u = coarse.u.data() + k;
    const std::int64_t down = y % 2 != 0 ? coarse.width : 0, right = x % 2;
    return 0.25f * ((u[0] + u[right]) + (u[down] + u[down + right]));
}

}  // namespace

void Membrane::cycle_coarse(std::size_t l) {
    Coarse& level = coarse_[l];
    const bool coarsest = l + 1 == levels_;
    const int sweeps = coarsest ? kCoarsestSweeps / 2 : kSweeps;
    for (int i = 0; i < sweeps; ++i) relax(level, 1);
    if (!coarsest) {
        restrict_residual(level, level.rows, coarse_[l + 1], residuals_);
        cycle_coarse(l + 1);
        for (std::int64_t y = 0; y < level.height; ++y)
            for (std::int64_t x = level.rows[static_cast<std::size_t>(y)].begin;
                 x < level.rows[static_cast<std::size_t>(y)].end; ++x)
                if (const std::size_t k = at(x, y, level.width); level.entries[kEntries * k] > 0)
                    level.u[k] += interpolated(coarse_[l + 1], x, y);
    }
    for (int i = 0; i < sweeps; ++i) relax(level, -1);
}

// One V-cycle; the largest change of any of its steps.
double Membrane::cycle_finest(const Window& window) {
    const int sweeps = levels_ == 0 ? kCoarsestSweeps / 2 : kSweeps;
    double largest = 0;
    for (int i = 0; i < sweeps; ++i) largest = std::max(largest, relax(window, rows_, 1));
    if (levels_ > 0) {
        restrict_residual(window, rows_, coarse_[0], residuals_);
        cycle_coarse(0);
        for (std::int64_t y = 0; y < window.height; ++y)
            for (std::int64_t x = rows_[static_cast<std::size_t>(y)].begin; x < rows_[static_cast<std::size_t>(y)].end;
                 ++x) {
                const std::size_t k = at(x, y, window.width);
                if (window.unknown[k] == 0) continue;
                const auto change = static_cast<double>(interpolated(coarse_[0], x, y));
                largest = std::max(largest, std::abs(change));
                window.values[k] += change;
            }
    }
    for (int i = 0; i < sweeps; ++i) largest = std::max(largest, relax(window, rows_, -1));
    return largest;
}

bool Membrane::solve(const Window& window, const std::function<bool()>& keep_going) {
    find_extents(
        window.width, window.height, [&](std::size_t k) { return window.unknown[k] != 0; }, rows_);
    std::int64_t side = std::max(window.width, window.height);
    for (levels_ = 0; side > kCoarsestSide; ++levels_) {
        if (levels_ == coarse_.size()) coarse_.emplace_back();
        Coarse& coarse = coarse_[levels_];
        if (levels_ == 0)
            coarsen(FinestOperator(window), rows_, coarse);
        else
            coarsen(CoarseOperator(coarse_[levels_ - 1]), coarse_[levels_ - 1].rows, coarse);
        side = std::max(coarse.width, coarse.height);
    }
    rim_ = rim_of(window, rows_);
    start(window, rows_);
    const double enough = kTolerance * (rim_.high - rim_.low);
    for (int i = 0; i < kMaxCycles; ++i) {
        if (keep_going && !keep_going()) return false;
        if (cycle_finest(window) <= enough) break;
    }
    for (std::size_t k = 0; k < window.values.size(); ++k)
        if (double& v = window.values[k]; window.unknown[k] != 0)
            v = std::isnan(v) ? rim_.low : std::clamp(v, rim_.low, rim_.high);  // NaN: the rim's differences overflow
    return true;
}

}  // namespace scree
