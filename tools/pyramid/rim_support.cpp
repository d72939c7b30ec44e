#include "tools/pyramid/rim_support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace scree {
namespace {

// Points looked at to each side of an absent sample, as far as the next base sample.
constexpr std::int64_t kReach = 8;
// Base samples from the rim on. Strides of less than that see no step beyond it.
constexpr int kRings = 8;

struct Place {
    std::int64_t i, j;
};

class RimSupport {
public:
    RimSupport(const HeightSpool& base, const HeightGrid& grid, int shift) : base_(base), grid_(grid), shift_(shift) {}

    // The absent base samples of [i0, i1] x [j0, j1] that have heights within a base cell.
    Result<void> begin_in(std::int64_t i0, std::int64_t j0, std::int64_t i1, std::int64_t j1) {
        i1 = std::min(i1, base_.width() - 1);
        j1 = std::min(j1, base_.height() - 1);
        if (i0 > i1) return {};
        std::vector<double> row(static_cast<std::size_t>(i1 - i0 + 1));
        for (std::int64_t j = j0; j <= j1; ++j) {
            if (!base_.may_lack_samples(j)) continue;
            if (auto ok = base_.read_samples(i0, j, row); !ok) return ok;
            for (std::int64_t i = i0; i <= i1; ++i) {
                if (std::isfinite(row[static_cast<std::size_t>(i - i0)]) || known({i, j})) continue;
                auto near = height_near({i, j});
                if (!near) return near.error();
                if (std::isfinite(*near)) add({i, j}, *near);
            }
        }
        return {};
    }

    // Means of what the ring before found beside each.
    Result<void> grow() {
        for (int ring = 1; ring < kRings && !last_.empty(); ++ring) {
            HeightSpool::Support fresh;
            for (const Place& p : last_)
                for (std::int64_t j = std::max<std::int64_t>(p.j - 1, 0); j <= std::min(p.j + 1, base_.height() - 1);
                     ++j)
                    for (std::int64_t i = std::max<std::int64_t>(p.i - 1, 0); i <= std::min(p.i + 1, base_.width() - 1);
                         ++i) {
                        if (known({i, j}) || (fresh.count(j) != 0 && fresh[j].count(i) != 0)) continue;
                        auto absent = is_absent({i, j});
                        if (!absent) return absent.error();
                        if (*absent) fresh[j][i] = mean_beside({i, j});
                    }
            last_.clear();
            for (const auto& [j, row] : fresh)
                for (const auto& [i, height] : row) add({i, j}, height);
        }
        return {};
    }

    HeightSpool::Support take() { return std::move(support_); }

private:
    bool known(const Place& p) const {
        const auto row = support_.find(p.j);
        return row != support_.end() && row->second.count(p.i) != 0;
    }
    void add(const Place& p, double height) {
        support_[p.j][p.i] = height;
        last_.push_back(p);
    }

    Result<bool> is_absent(const Place& p) const {
        double sample = 0;
        if (auto ok = base_.read_samples(p.i, p.j, {&sample, 1}); !ok) return ok.error();
        return !std::isfinite(sample);
    }

    // Of finer points, and of base samples (voids that were filled are in the base alone), the nearer the more.
    Result<double> height_near(const Place& p) const {
        const std::int64_t cell = std::int64_t{1} << shift_, reach = std::min(kReach, cell), step = cell / reach;
        const std::int64_t side = 2 * reach + 1;
        std::vector<double> points(static_cast<std::size_t>(side * side));
        if (auto ok =
                grid_.sample((p.i << shift_) - reach * step, (p.j << shift_) - reach * step, side, side, step, points);
            !ok)
            return ok.error();
        for (std::int64_t dj = -1; dj <= 1; ++dj)
            for (std::int64_t di = -1; di <= 1; ++di) {
                const std::int64_t i = p.i + di, j = p.j + dj;
                if (i < 0 || j < 0 || i >= base_.width() || j >= base_.height()) continue;
                double& point = points[static_cast<std::size_t>((dj + 1) * reach * side + (di + 1) * reach)];
                if (auto ok = base_.read_samples(i, j, {&point, 1}); !ok) return ok.error();
            }
        double sum = 0, weights = 0;
        for (std::int64_t r = 0; r < side; ++r)
            for (std::int64_t c = 0; c < side; ++c) {
                const double height = points[static_cast<std::size_t>(r * side + c)];
                if (!std::isfinite(height)) continue;
                const auto square = static_cast<double>((c - reach) * (c - reach) + (r - reach) * (r - reach));
                sum += height / (square * square);
                weights += 1 / (square * square);
            }
        return weights > 0 ? sum / weights : std::numeric_limits<double>::quiet_NaN();
    }

    double mean_beside(const Place& p) const {
        double sum = 0;
        int count = 0;
        for (std::int64_t j = p.j - 1; j <= p.j + 1; ++j) {
            const auto row = support_.find(j);
            if (row == support_.end()) continue;
            for (auto at = row->second.lower_bound(p.i - 1); at != row->second.end() && at->first <= p.i + 1; ++at) {
                sum += at->second;
                ++count;
            }
        }
        return sum / count;
    }

    const HeightSpool& base_;
    const HeightGrid& grid_;
    int shift_;
    HeightSpool::Support support_;
    std::vector<Place> last_;  // the outermost ring
};

}  // namespace

Result<HeightSpool::Support> rim_support(const HeightSpool& base, const HeightGrid& grid, const DeepTree& tree,
                                         int tile_cells_log2, int shift) {
    RimSupport support(base, grid, shift);
    const std::int64_t cells = std::int64_t{1} << tile_cells_log2;
    for (const TileId& id : tree.refined_base_tiles())
        if (auto ok = support.begin_in(id.x * cells, id.y * cells, (id.x + 1) * cells, (id.y + 1) * cells); !ok)
            return ok.error();
    if (auto ok = support.grow(); !ok) return ok.error();
    return support.take();
}

}  // namespace scree
