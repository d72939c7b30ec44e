#include "tools/source/resample.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "tools/source/resample_taps.h"

namespace scree {
namespace {

using namespace resampling;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct HeightMean {
    double sum = 0, weight = 0;
    bool void_met = false;

    void operator()(double z, double w) {
        const bool valid = z == z;
        sum += valid ? w * z : 0;
        weight += valid ? w : 0;
        void_met |= !valid;
    }
};

/// Any kernel, any neighbourhood, for a point in the raster.
double height_at(Sampler& sampler, const Samples<double>& samples, double u, double v) {
    const double nearest = samples.at(sampler.columns.nearest(u), sampler.rows.nearest(v));
    if (!(nearest == nearest) || sampler.rule.kernel == Kernel::nearest) return nearest;
    const auto mean_by = [&](Kernel kernel) {
        sampler.set(u, v, kernel);
        HeightMean mean;
        samples.each(sampler.column_taps, sampler.row_taps, [&](double z, double w) { mean(z, w); });
        return mean;
    };
    HeightMean mean = mean_by(sampler.rule.kernel);
    // Without some of its samples the cubic's negative weights would count for too much.
    if (mean.void_met && sampler.rule.kernel == Kernel::cubic) mean = mean_by(Kernel::bilinear);
    return mean.weight > 0 ? mean.sum / mean.weight : nearest;
}

/// NaN where one of the four is void or missing.
double plain_bilinear(const Samples<double>& samples, const Axis& columns, const Axis& rows, double u, double v) {
    const std::int64_t c = columns.pair(u), r = rows.pair(v);
    const double* z = samples.find(c, r, 2, 2);
    if (z == nullptr) return kNaN;
    const double f = u - static_cast<double>(c), g = v - static_cast<double>(r);
    const double* below = z + samples.pitch();
    return (1 - g) * ((1 - f) * z[0] + f * z[1]) + g * ((1 - f) * below[0] + f * below[1]);
}

}  // namespace

std::int64_t kernel_reach(Kernel kernel, double shrink) {
    if (kernel == Kernel::nearest) return 1;
    const std::int64_t reach = kernel == Kernel::cubic ? 2 : 1;
    if (!(shrink > 1)) return reach;
    return static_cast<std::int64_t>(std::ceil(std::min(shrink, 0x1p40) / 2)) + 1;
}

void resample_heights(const SampleWindow<double>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<double> out) {
    assert(points.column.size() == out.size() && points.row.size() == out.size());
    const Samples<double> samples(window, kNaN);
    Sampler sampler(rule, Mean::surface);
    const Axis columns = sampler.columns, rows = sampler.rows;
    const bool plain = rule.kernel == Kernel::bilinear && !sampler.shrinks();
    for (std::size_t k = 0; k < out.size(); ++k) {
        double u = points.column[k], v = points.row[k];
        if (!columns.holds(u) || !rows.holds(v)) {
            out[k] = kNaN;
            continue;
        }
        u = columns.onto(u);
        v = rows.onto(v);
        double z = plain ? plain_bilinear(samples, columns, rows, u, v) : kNaN;
        if (!(z == z)) z = height_at(sampler, samples, u, v);
        out[k] = z;
    }
}

}  // namespace scree
