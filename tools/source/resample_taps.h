// The inside of resample.h: which samples a point takes along each axis, and with what weights.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/source/resample.h"

namespace scree::resampling {

/// How far outside the raster a point may be by the rounding of a map.
inline constexpr double kOutsideTolerance = 1e-6;
/// A box of less than that (samples) weighs as the point in it, to a thousandth.
inline constexpr double kNarrowBox = 1e-3;

/// To the nearest whole number, halves up, of what is not negative: truncation is an instruction, lround a call.
inline std::int64_t rounded(double value) {
    constexpr double kHalf = 0.5;
    return static_cast<std::int64_t>(value + kHalf);
}

/// Columns or rows of a raster.
struct Axis {
    double low = 0, high = -1;   ///< where points may be
    double end = 0;              ///< the outermost sample
    std::int64_t last = 0;       ///< the same
    std::int64_t last_pair = 0;  ///< the one before it, if there is one

    Axis(std::int64_t size, bool half_sample_rim) {
        if (size <= 0) return;
        last = size - 1;
        last_pair = std::max<std::int64_t>(last - 1, 0);
        end = static_cast<double>(last);
        const double rim = (half_sample_rim ? 0.5 : 0.0) + kOutsideTolerance;
        low = -rim;
        high = end + rim;
    }
    bool holds(double u) const { return u >= low && u <= high; }  // false for NaN
    double onto(double u) const { return u < 0 ? 0 : u > end ? end : u; }
    /// Of u in the raster or at its rim.
    std::int64_t nearest(double u) const { return std::min(rounded(u), last); }
    /// The first of the two samples that u lies between; at the last sample the pair that ends with it.
    std::int64_t pair(double u) const { return std::min(static_cast<std::int64_t>(u), last_pair); }
};

/// Samples first, first + 1... and their weights; those at the ends are not 0.
struct Taps {
    std::int64_t first = 0;
    std::vector<double> weights;  ///< longer than `count` after a wider one
    std::size_t count = 0;

    void start(std::int64_t at) {
        first = at;
        count = 0;
    }
    void add(double weight) {
        if (count == 0 && weight == 0) {
            ++first;
            return;
        }
        if (count == weights.size()) weights.resize(2 * count + 8);
        weights[count++] = weight;
    }
    void end() {
        while (count > 0 && weights[count - 1] == 0) --count;
    }
};

inline void set_linear(Taps& taps, const Axis& axis, double u) {
    const std::int64_t pair = axis.pair(u);
    const double f = u - static_cast<double>(pair);
    taps.start(pair);
    taps.add(1 - f);
    taps.add(f);
    taps.end();
}

/// Keys 1981, equation 4: a = -1/2.
inline void set_cubic(Taps& taps, const Axis& axis, double u) {
    const std::int64_t pair = axis.pair(u);
    if (pair < 1 || pair + 2 > axis.last) return set_linear(taps, axis, u);
    const double f = u - static_cast<double>(pair), g = 1 - f;
    taps.start(pair - 1);
    taps.add(-0.5 * f * g * g);
    taps.add(1 + f * f * (1.5 * f - 2.5));
    taps.add(1 + g * g * (1.5 * g - 2.5));
    taps.add(-0.5 * g * f * f);
    taps.end();
}

/// The integral of a sample's hat (1 at the sample, 0 at its neighbours) up to x from the sample.
inline double hat_up_to(double x) {
    if (x <= -1) return 0;
    if (x >= 1) return 1;
    return x < 0 ? (1 + x) * (1 + x) / 2 : 1 - (1 - x) * (1 - x) / 2;
}

/// The same of a sample's own area.
inline double area_up_to(double x) { return std::clamp(x + 0.5, 0.0, 1.0); }

template <class UpTo>
void set_mean(Taps& taps, double low, double high, std::int64_t first, std::int64_t last, UpTo up_to) {
    const double scale = 1 / (high - low);
    taps.start(first);
    for (std::int64_t c = first; c <= last; ++c) {
        const double at = static_cast<double>(c);
        taps.add((up_to(high - at) - up_to(low - at)) * scale);
    }
    taps.end();
}

/// The mean of the linear interpolant over a box about u. Towards the raster's edge the box shrinks on both sides, or
/// slopes would be pulled inward.
inline void set_surface_mean(Taps& taps, const Axis& axis, double u, double shrink) {
    const double width = shrink < 2 ? 2 * (shrink - 1) : shrink;
    const double half = std::min({width / 2, u, axis.end - u});
    if (half < kNarrowBox) return set_linear(taps, axis, u);
    const double low = std::max(u - half, 0.0), high = std::min(u + half, axis.end);
    set_mean(taps, low, high, static_cast<std::int64_t>(low), axis.pair(high) + 1, hat_up_to);
}

/// The mean of pixels over the part of a box about u that lies in the raster.
inline void set_area_mean(Taps& taps, const Axis& axis, double u, double shrink) {
    const double low = std::max(u - shrink / 2, -0.5), high = std::min(u + shrink / 2, axis.end + 0.5);
    set_mean(taps, low, high, axis.nearest(low), axis.nearest(high), area_up_to);
}

enum class Mean { surface, area };

inline void set_taps(Taps& taps, const Axis& axis, double u, Kernel kernel, double shrink, Mean mean) {
    if (shrink > 1) {
        return mean == Mean::surface ? set_surface_mean(taps, axis, u, shrink) : set_area_mean(taps, axis, u, shrink);
    }
    kernel == Kernel::cubic ? set_cubic(taps, axis, u) : set_linear(taps, axis, u);
}

/// A window with bounds: what it does not hold is void.
template <class T>
class Samples {
public:
    Samples(const SampleWindow<T>& window, T nothing) : window_(window), nothing_(nothing) {
        assert(window.columns >= 0 && window.rows >= 0);
        assert(window.values.size() == static_cast<std::size_t>(window.columns * window.rows));
    }
    T at(std::int64_t column, std::int64_t row) const {
        const T* sample = find(column, row, 1, 1);
        return sample != nullptr ? *sample : nothing_;
    }
    /// The first of columns x rows samples; null where the window has not all of them.
    const T* find(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows) const {
        const std::int64_t c = column - window_.first_column, r = row - window_.first_row;
        if (c < 0 || r < 0 || c > window_.columns - columns || r > window_.rows - rows) return nullptr;
        return window_.values.data() + (r * window_.columns + c);
    }
    std::ptrdiff_t pitch() const { return static_cast<std::ptrdiff_t>(window_.columns); }

    /// visit(sample, weight) for all taps, row by row.
    template <class Visit>
    void each(const Taps& columns, const Taps& rows, Visit visit) const {
        const auto count = static_cast<std::int64_t>(columns.count);
        const double* const weights = columns.weights.data();
        for (std::size_t r = 0; r < rows.count; ++r) {
            const std::int64_t row = rows.first + static_cast<std::int64_t>(r);
            const double row_weight = rows.weights[r];
            if (const T* line = find(columns.first, row, count, 1)) {
                for (std::int64_t c = 0; c < count; ++c) visit(line[c], row_weight * weights[c]);
            } else {
                for (std::int64_t c = 0; c < count; ++c) visit(at(columns.first + c, row), row_weight * weights[c]);
            }
        }
    }

private:
    const SampleWindow<T>& window_;
    T nothing_;
};

/// What all points of a call share, and its scratch.
struct Sampler {
    explicit Sampler(const ResampleRule& given, Mean mean_of)
        : rule(given),
          columns(given.source_columns, given.half_sample_rim),
          rows(given.source_rows, given.half_sample_rim),
          mean(mean_of) {}

    bool shrinks() const { return rule.shrink.columns > 1 || rule.shrink.rows > 1; }
    void set(double u, double v, Kernel kernel) {
        set_taps(column_taps, columns, u, kernel, rule.shrink.columns, mean);
        set_taps(row_taps, rows, v, kernel, rule.shrink.rows, mean);
    }

    const ResampleRule& rule;
    Axis columns, rows;
    Mean mean;
    Taps column_taps, row_taps;
};

}  // namespace scree::resampling
