// Colours. Where all samples that count are opaque, means are sums of integers, the same ones for points one by one and
// for points in lines; elsewhere they are weighted by alpha, in doubles. SSE2 is part of every x86-64.
#include <emmintrin.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <vector>

#include "tools/source/resample.h"
#include "tools/source/resample_taps.h"

namespace scree {
namespace {

using namespace resampling;

std::uint32_t alpha_of(std::uint32_t rgba) { return rgba >> 24; }

// --- weighted by alpha ---

struct ColourMean {
    std::array<double, 3> sum{};  ///< of colour times alpha
    double alpha = 0, weight = 0;
    bool all_opaque = true;

    void operator()(std::uint32_t rgba, double w) {
        const double a = w * alpha_of(rgba);
        for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += a * (rgba >> (8 * channel) & 255);
        alpha += a;
        weight += w;
        all_opaque = all_opaque && alpha_of(rgba) == 255;
    }
    std::uint32_t rgba() const {
        const auto byte = [](double value, double least) {
            return static_cast<std::uint32_t>(std::clamp(value + 0.5, least, 255.0));
        };
        std::uint32_t out = byte(alpha / weight, 1) << 24;
        for (std::size_t channel = 0; channel < 3; ++channel) out |= byte(sum[channel] / alpha, 0) << (8 * channel);
        return out;
    }
};

std::uint32_t colour_at(Sampler& sampler, const Samples<std::uint32_t>& samples, double u, double v) {
    const std::uint32_t nearest = samples.at(sampler.columns.nearest(u), sampler.rows.nearest(v));
    if (alpha_of(nearest) == 0) return 0;
    if (sampler.rule.kernel == Kernel::nearest) return nearest;
    const auto mean_by = [&](Kernel kernel) {
        sampler.set(u, v, kernel);
        ColourMean mean;
        samples.each(sampler.column_taps, sampler.row_taps, [&](std::uint32_t rgba, double w) { mean(rgba, w); });
        return mean;
    };
    ColourMean mean = mean_by(sampler.rule.kernel);
    if (!mean.all_opaque && sampler.rule.kernel == Kernel::cubic) mean = mean_by(Kernel::bilinear);
    return mean.alpha > 0 && mean.weight > 0 ? mean.rgba() : nearest;
}

// --- opaque pixels in integers ---

/// Four channels of 32 bits, or of 16 bits in the lower half.
using Channels = __m128i;

/// The channels of two neighbours, as 16-bit numbers, side by side: red and red, green and green...
Channels paired(Channels two_pixels) {
    return _mm_unpacklo_epi8(_mm_unpacklo_epi8(two_pixels, _mm_srli_epi64(two_pixels, 32)), _mm_setzero_si128());
}
Channels two_pixels(const std::uint32_t* at) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at)); }
Channels one_pixel(std::uint32_t rgba) { return _mm_cvtsi32_si128(static_cast<int>(rgba)); }
/// Weights of 16 bits for such pairs.
std::int32_t weight_pair(std::int64_t first, std::int64_t second) {
    return static_cast<std::int32_t>((first & 0xFFFF) | second << 16);
}
std::uint32_t to_pixel(Channels levels) {
    const Channels words = _mm_packs_epi32(levels, levels);
    return static_cast<std::uint32_t>(_mm_cvtsi128_si32(_mm_packus_epi16(words, words)));
}
/// Of one or two pixels in the lower half, the rest set.
bool all_opaque(Channels both) {
    const Channels others = _mm_set1_epi32(0x00FFFFFF);
    return _mm_movemask_epi8(_mm_cmpeq_epi8(_mm_or_si128(both, others), _mm_set1_epi32(-1))) == 0xFFFF;
}
Channels set_upper(Channels lower) { return _mm_or_si128(lower, _mm_set_epi32(-1, -1, 0, 0)); }

/// Bilinear: weights are multiples of 2^-12 (a sixteenth of a level at most, whatever the contrast) and sum to 1, so
/// what is uniform stays what it is.
constexpr int kBilinearBits = 12;
constexpr std::int64_t kBilinearOne = std::int64_t{1} << kBilinearBits;

struct Place {
    std::int64_t sample = 0, fraction = 0;  ///< 0..kBilinearOne
};
Place bilinear_place(const Axis& axis, double u) {
    const std::int64_t fine = rounded(u * static_cast<double>(kBilinearOne));
    const std::int64_t sample = std::min(fine >> kBilinearBits, axis.last_pair);
    return {sample, fine - sample * kBilinearOne};
}

/// Between four opaque pixels; false where one is not opaque or missing.
bool plain_bilinear(const Samples<std::uint32_t>& samples, const Axis& columns, const Axis& rows, double u, double v,
                    std::uint32_t& out) {
    const Place c = bilinear_place(columns, u), r = bilinear_place(rows, v);
    const std::uint32_t* at = samples.find(c.sample, r.sample, 2, 2);
    if (at == nullptr) return false;
    const Channels above = two_pixels(at), below = two_pixels(at + samples.pitch());
    if (!all_opaque(set_upper(_mm_and_si128(above, below)))) return false;
    const std::int64_t f = c.fraction, g = r.fraction;
    const std::int64_t w11 = (f * g + kBilinearOne / 2) >> kBilinearBits, w10 = f - w11, w01 = g - w11,
                       w00 = kBilinearOne - f - w01;
    const Channels sum = _mm_add_epi32(_mm_madd_epi16(paired(above), _mm_set1_epi32(weight_pair(w00, w10))),
                                       _mm_madd_epi16(paired(below), _mm_set1_epi32(weight_pair(w01, w11))));
    out = to_pixel(_mm_srli_epi32(_mm_add_epi32(sum, _mm_set1_epi32(kBilinearOne / 2)), kBilinearBits));
    return true;
}

/// Other kernels: along each axis weights in multiples of 2^-14 that sum to 1. A row's mean is rounded to 1/64 of a
/// level, then the mean of those to a level.
constexpr int kWeightBits = 14;
constexpr int kRowShift = 8, kLevelShift = 2 * kWeightBits - kRowShift;
constexpr double kWhole = 1 << kWeightBits;
/// Samples a point; wider means weigh samples too coarsely.
constexpr double kMostWholeShrink = 32;
constexpr std::size_t kMostTaps = 36;

/// Of samples first, first + 1...; the outermost are not 0. One more follows, 0, so that pairs can be taken.
struct WholeTaps {
    std::int64_t first = 0, count = 0;
    std::array<std::int16_t, kMostTaps> weight;

    /// Weights follow as their running sums, times kWhole: so rounded they sum to what they should.
    void start(std::int64_t at) {
        first = at;
        count = 0;
        sum_ = 0;
    }
    void add_up_to(double sum) {
        // Sums of the cubic are below 0, too.
        const auto whole = static_cast<std::int32_t>(sum + (kWhole + 0.5)) - (1 << kWeightBits);
        const std::int32_t w = whole - sum_;
        sum_ = whole;
        if (count == 0 && w == 0) {
            ++first;
            return;
        }
        weight[static_cast<std::size_t>(count++)] = static_cast<std::int16_t>(w);
    }
    void end() {
        while (count > 0 && weight[static_cast<std::size_t>(count - 1)] == 0) --count;
        weight[static_cast<std::size_t>(count)] = 0;
    }
    std::int32_t pair(std::int64_t k) const {
        std::int32_t both = 0;
        std::memcpy(&both, &weight[static_cast<std::size_t>(k)], sizeof both);
        return both;
    }

private:
    std::int32_t sum_ = 0;
};

void set_whole_linear(WholeTaps& taps, const Axis& axis, double u) {
    const std::int64_t pair = axis.pair(u);
    taps.start(pair);
    taps.add_up_to((1 - (u - static_cast<double>(pair))) * kWhole);
    taps.add_up_to(kWhole);
    taps.end();
}

/// As set_cubic.
void set_whole_cubic(WholeTaps& taps, const Axis& axis, double u) {
    const std::int64_t pair = axis.pair(u);
    if (pair < 1 || pair + 2 > axis.last) return set_whole_linear(taps, axis, u);
    const double f = u - static_cast<double>(pair), g = 1 - f;
    const double first = -0.5 * f * g * g, last = -0.5 * g * f * f, second = 1 + f * f * (1.5 * f - 2.5);
    taps.start(pair - 1);
    taps.add_up_to(first * kWhole);
    taps.add_up_to((first + second) * kWhole);
    taps.add_up_to((1 - last) * kWhole);
    taps.add_up_to(kWhole);
    taps.end();
}

/// As set_area_mean.
void set_whole_mean(WholeTaps& taps, const Axis& axis, double u, double shrink) {
    const double low = std::max(u - shrink / 2, -0.5), high = std::min(u + shrink / 2, axis.end + 0.5);
    const std::int64_t last = axis.nearest(high);
    const double scale = kWhole / (high - low);
    taps.start(axis.nearest(low));
    for (std::int64_t c = taps.first; c < last; ++c) taps.add_up_to((static_cast<double>(c) + 0.5 - low) * scale);
    taps.add_up_to(kWhole);
    taps.end();
}

void set_whole(WholeTaps& taps, const Axis& axis, double u, Kernel kernel, double shrink) {
    if (shrink > 1) return set_whole_mean(taps, axis, u, shrink);
    kernel == Kernel::cubic ? set_whole_cubic(taps, axis, u) : set_whole_linear(taps, axis, u);
}

/// Of pixels from the first tap on, in 1/64 of a level; `both` gathers what all of them have set.
Channels row_mean(const std::uint32_t* at, const WholeTaps& taps, Channels& both) {
    Channels sum = _mm_setzero_si128();
    std::int64_t k = 0;
    for (; k + 2 <= taps.count; k += 2) {
        const Channels pixels = two_pixels(at + k);
        both = _mm_and_si128(both, set_upper(pixels));
        sum = _mm_add_epi32(sum, _mm_madd_epi16(paired(pixels), _mm_set1_epi32(taps.pair(k))));
    }
    if (k < taps.count) {
        const Channels pixel = one_pixel(at[k]);
        both = _mm_and_si128(both, _mm_or_si128(pixel, _mm_set_epi32(-1, -1, -1, 0)));
        sum = _mm_add_epi32(sum, _mm_madd_epi16(paired(pixel), _mm_set1_epi32(taps.pair(k))));
    }
    return _mm_srai_epi32(_mm_add_epi32(sum, _mm_set1_epi32(1 << (kRowShift - 1))), kRowShift);
}

Channels to_levels(Channels sum) {
    return _mm_srai_epi32(_mm_add_epi32(sum, _mm_set1_epi32(1 << (kLevelShift - 1))), kLevelShift);
}

/// Over opaque pixels; false where one is not opaque or missing.
bool plain_mean(const Samples<std::uint32_t>& samples, const WholeTaps& columns, const WholeTaps& rows,
                std::uint32_t& out) {
    const std::uint32_t* at = samples.find(columns.first, rows.first, columns.count, rows.count);
    if (at == nullptr) return false;
    Channels sum = _mm_setzero_si128(), both = _mm_set1_epi32(-1);
    for (std::int64_t r = 0; r < rows.count; ++r, at += samples.pitch()) {
        const Channels mean = row_mean(at, columns, both);
        const Channels words = _mm_unpacklo_epi16(_mm_packs_epi32(mean, mean), _mm_setzero_si128());
        const std::int32_t w = rows.weight[static_cast<std::size_t>(r)];
        sum = _mm_add_epi32(sum, _mm_madd_epi16(words, _mm_set1_epi32(w & 0xFFFF)));
    }
    if (!all_opaque(both)) return false;
    out = to_pixel(to_levels(sum));
    return true;
}

// --- points ---

/// What all points of a call share.
class ColourSampler {
public:
    ColourSampler(const SampleWindow<std::uint32_t>& window, const ResampleRule& rule)
        : samples_(window, 0), sampler_(rule, Mean::area) {
        if (rule.kernel == Kernel::nearest) return;
        const double shrink = std::max(rule.shrink.columns, rule.shrink.rows);
        if (rule.kernel == Kernel::bilinear && !(shrink > 1))
            way_ = Way::bilinear;
        else if (shrink <= kMostWholeShrink)
            way_ = Way::whole;
    }

    enum class Way { by_alpha, bilinear, whole };
    Way way() const { return way_; }
    const Axis& columns() const { return sampler_.columns; }
    const Axis& rows() const { return sampler_.rows; }
    const ResampleRule& rule() const { return sampler_.rule; }

    std::uint32_t at(double u, double v) {
        if (!columns().holds(u) || !rows().holds(v)) return 0;
        return inside(columns().onto(u), rows().onto(v));
    }

private:
    std::uint32_t inside(double u, double v) {
        std::uint32_t out = 0;
        if (way_ == Way::bilinear && plain_bilinear(samples_, columns(), rows(), u, v, out)) return out;
        if (way_ == Way::whole) {
            set_whole(column_taps_, columns(), u, rule().kernel, rule().shrink.columns);
            set_whole(row_taps_, rows(), v, rule().kernel, rule().shrink.rows);
            if (plain_mean(samples_, column_taps_, row_taps_, out)) return out;
        }
        return colour_at(sampler_, samples_, u, v);
    }

    Samples<std::uint32_t> samples_;
    Sampler sampler_;
    Way way_ = Way::by_alpha;
    WholeTaps column_taps_, row_taps_;
};

// --- points in lines ---

/// The columns of points that all rows of them have, relative to the window.
struct BilinearColumns {
    std::vector<std::int32_t> sample, fraction;  ///< as many as are a multiple of 4
    std::vector<std::size_t> outside;

    /// False where the window has not all of them.
    bool set(const Axis& axis, std::span<const double> columns, const SampleWindow<std::uint32_t>& window) {
        const std::size_t padded = (columns.size() + 3) / 4 * 4;
        sample.assign(padded, 0);
        fraction.assign(padded, 0);
        for (std::size_t k = 0; k < columns.size(); ++k) {
            if (!axis.holds(columns[k])) {
                outside.push_back(k);
                continue;
            }
            const Place place = bilinear_place(axis, axis.onto(columns[k]));
            const std::int64_t c = place.sample - window.first_column;
            if (c < 0 || c + 2 > window.columns) return false;
            sample[k] = static_cast<std::int32_t>(c);
            fraction[k] = static_cast<std::int32_t>(place.fraction);
        }
        return true;
    }
};

struct BilinearRow {
    const std::uint32_t *above, *below;
    std::int32_t fraction;
};

/// Four points; false where one of their pixels is not opaque.
bool four_bilinear(const BilinearColumns& columns, std::size_t k, const BilinearRow& row, std::uint32_t* out) {
    const __m128i one = _mm_set1_epi32(kBilinearOne), half = _mm_set1_epi32(kBilinearOne / 2);
    const __m128i f = _mm_loadu_si128(reinterpret_cast<const __m128i*>(&columns.fraction[k]));
    const __m128i g = _mm_set1_epi32(row.fraction);
    const __m128i w11 = _mm_srli_epi32(_mm_add_epi32(_mm_madd_epi16(f, g), half), kBilinearBits);
    const __m128i w10 = _mm_sub_epi32(f, w11), w01 = _mm_sub_epi32(g, w11);
    const __m128i w00 = _mm_sub_epi32(_mm_sub_epi32(one, f), w01);
    const __m128i upper = _mm_or_si128(w00, _mm_slli_epi32(w10, 16)),
                  lower = _mm_or_si128(w01, _mm_slli_epi32(w11, 16));
    __m128i both = _mm_set1_epi32(-1);
    const auto point = [&](std::size_t n, __m128i upper_weights, __m128i lower_weights) {
        const std::int32_t c = columns.sample[k + n];
        const __m128i above = two_pixels(row.above + c), below = two_pixels(row.below + c);
        both = _mm_and_si128(both, _mm_and_si128(above, below));
        const __m128i sum =
            _mm_add_epi32(_mm_madd_epi16(paired(above), upper_weights), _mm_madd_epi16(paired(below), lower_weights));
        return _mm_srli_epi32(_mm_add_epi32(sum, half), kBilinearBits);
    };
    const __m128i p0 = point(0, _mm_shuffle_epi32(upper, 0x00), _mm_shuffle_epi32(lower, 0x00));
    const __m128i p1 = point(1, _mm_shuffle_epi32(upper, 0x55), _mm_shuffle_epi32(lower, 0x55));
    const __m128i p2 = point(2, _mm_shuffle_epi32(upper, 0xAA), _mm_shuffle_epi32(lower, 0xAA));
    const __m128i p3 = point(3, _mm_shuffle_epi32(upper, 0xFF), _mm_shuffle_epi32(lower, 0xFF));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out),
                     _mm_packus_epi16(_mm_packs_epi32(p0, p1), _mm_packs_epi32(p2, p3)));
    return all_opaque(set_upper(both));
}

bool bilinear_lines(ColourSampler& sampler, const SampleWindow<std::uint32_t>& window, const SourceLines& lines,
                    std::uint32_t* out) {
    BilinearColumns columns;
    if (sampler.columns().last < 1 || sampler.rows().last < 1 || !columns.set(sampler.columns(), lines.column, window))
        return false;
    const std::size_t count = lines.column.size();
    for (const double v : lines.row) {
        if (!sampler.rows().holds(v)) {
            std::fill_n(out, count, 0U);
            out += count;
            continue;
        }
        const Place place = bilinear_place(sampler.rows(), sampler.rows().onto(v));
        const std::int64_t r = place.sample - window.first_row;
        if (r < 0 || r + 2 > window.rows) return false;
        const std::uint32_t* above = window.values.data() + r * window.columns;
        const BilinearRow row{above, above + window.columns, static_cast<std::int32_t>(place.fraction)};
        std::array<std::uint32_t, 4> rest;
        for (std::size_t k = 0; k < count; k += 4) {
            const std::size_t n = std::min<std::size_t>(4, count - k);
            std::uint32_t* to = n == 4 ? out + k : rest.data();
            if (!four_bilinear(columns, k, row, to))
                for (std::size_t m = 0; m < n; ++m) to[m] = sampler.at(lines.column[k + m], v);
            if (n < 4) std::copy_n(rest.data(), n, out + k);
        }
        for (const std::size_t k : columns.outside) out[k] = 0;
        out += count;
    }
    return true;
}

/// Samples first .. last of an axis that points take.
struct TapRange {
    std::int64_t first = INT64_MAX, last = -1;
    void include(const WholeTaps& taps) {
        first = std::min(first, taps.first);
        last = std::max(last, taps.first + taps.count - 1);
    }
    std::int64_t count() const { return last - first + 1; }
};

std::vector<WholeTaps> taps_of(const Axis& axis, std::span<const double> at, Kernel kernel, double shrink,
                               TapRange& range) {
    std::vector<WholeTaps> taps(at.size());
    for (std::size_t k = 0; k < at.size(); ++k) {
        if (!axis.holds(at[k])) continue;
        set_whole(taps[k], axis, axis.onto(at[k]), kernel, shrink);
        range.include(taps[k]);
    }
    return taps;
}

bool opaque_part(const Samples<std::uint32_t>& samples, const TapRange& columns, const TapRange& rows) {
    const std::uint32_t* at = samples.find(columns.first, rows.first, columns.count(), rows.count());
    if (at == nullptr) return false;
    for (std::int64_t r = 0; r < rows.count(); ++r, at += samples.pitch()) {
        std::uint32_t all = ~0U;
        for (std::int64_t c = 0; c < columns.count(); ++c) all &= at[c];
        if (alpha_of(all) != 255) return false;
    }
    return true;
}

/// Means along the rows of the window, made when they are first needed: as many rows are kept as one point takes.
class RowMeans {
public:
    RowMeans(const Samples<std::uint32_t>& samples, const std::vector<WholeTaps>& columns, std::int64_t rows_a_point)
        : samples_(samples),
          columns_(columns),
          pitch_((columns.size() + 1) / 2 * 8),
          kept_(static_cast<std::size_t>(rows_a_point), -1),
          means_(kept_.size() * pitch_) {}

    /// Four 16-bit channels a point.
    const std::int16_t* row(std::int64_t row) {
        const auto slot = static_cast<std::size_t>(row) % kept_.size();
        std::int16_t* means = means_.data() + slot * pitch_;
        if (kept_[slot] == row) return means;
        kept_[slot] = row;
        Channels unused = _mm_setzero_si128();
        for (std::size_t k = 0; k < columns_.size(); ++k) {
            const WholeTaps& taps = columns_[k];
            Channels mean = _mm_setzero_si128();
            if (taps.count > 0) mean = row_mean(samples_.find(taps.first, row, taps.count, 1), taps, unused);
            _mm_storel_epi64(reinterpret_cast<__m128i*>(means + 4 * k), _mm_packs_epi32(mean, mean));
        }
        return means;
    }

private:
    const Samples<std::uint32_t>& samples_;
    const std::vector<WholeTaps>& columns_;
    std::size_t pitch_;
    std::vector<std::int64_t> kept_;
    std::vector<std::int16_t> means_;
};

/// Two points at a time, two rows at a time.
void mean_of_rows(RowMeans& means, const WholeTaps& rows, std::size_t count, std::uint32_t* out) {
    std::array<const std::int16_t*, kMostTaps> row;
    for (std::int64_t r = 0; r < rows.count; ++r) row[static_cast<std::size_t>(r)] = means.row(rows.first + r);
    // The weight of the row beyond the last is 0.
    row[static_cast<std::size_t>(rows.count)] = row[0];
    for (std::size_t k = 0; k < count; k += 2) {
        Channels first = _mm_setzero_si128(), second = first;
        for (std::int64_t r = 0; r < rows.count; r += 2) {
            const auto* a = reinterpret_cast<const __m128i*>(row[static_cast<std::size_t>(r)] + 4 * k);
            const auto* b = reinterpret_cast<const __m128i*>(row[static_cast<std::size_t>(r + 1)] + 4 * k);
            const __m128i above = _mm_loadu_si128(a), below = _mm_loadu_si128(b), w = _mm_set1_epi32(rows.pair(r));
            first = _mm_add_epi32(first, _mm_madd_epi16(_mm_unpacklo_epi16(above, below), w));
            second = _mm_add_epi32(second, _mm_madd_epi16(_mm_unpackhi_epi16(above, below), w));
        }
        const __m128i words = _mm_packs_epi32(to_levels(first), to_levels(second));
        const __m128i pixels = _mm_packus_epi16(words, words);
        if (k + 2 <= count)
            _mm_storel_epi64(reinterpret_cast<__m128i*>(out + k), pixels);
        else
            out[k] = static_cast<std::uint32_t>(_mm_cvtsi128_si32(pixels));
    }
}

bool mean_lines(ColourSampler& sampler, const SampleWindow<std::uint32_t>& window, const SourceLines& lines,
                std::uint32_t* out) {
    const ResampleRule& rule = sampler.rule();
    TapRange column_range, row_range;
    const std::vector<WholeTaps> columns =
        taps_of(sampler.columns(), lines.column, rule.kernel, rule.shrink.columns, column_range);
    const std::vector<WholeTaps> rows = taps_of(sampler.rows(), lines.row, rule.kernel, rule.shrink.rows, row_range);
    const std::size_t count = columns.size();
    if (column_range.last < 0 || row_range.last < 0) {
        std::fill_n(out, count * rows.size(), 0U);
        return true;
    }
    const Samples<std::uint32_t> samples(window, 0);
    if (!opaque_part(samples, column_range, row_range)) return false;
    std::int64_t most = 1;
    for (const WholeTaps& taps : rows) most = std::max(most, taps.count);
    RowMeans means(samples, columns, most);
    for (const WholeTaps& taps : rows) {
        if (taps.count == 0)
            std::fill_n(out, count, 0U);
        else
            mean_of_rows(means, taps, count, out);
        out += count;
    }
    return true;
}

}  // namespace

std::int64_t nearest_sample(double u, std::int64_t size, bool half_sample_rim) {
    const Axis axis(size, half_sample_rim);
    return axis.holds(u) ? axis.nearest(axis.onto(u)) : -1;
}

void resample_colours(const SampleWindow<std::uint32_t>& window, const SourcePoints& points, const ResampleRule& rule,
                      std::span<std::uint32_t> out) {
    assert(points.column.size() == out.size() && points.row.size() == out.size());
    ColourSampler sampler(window, rule);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = sampler.at(points.column[k], points.row[k]);
}

void resample_colour_lines(const SampleWindow<std::uint32_t>& window, const SourceLines& lines,
                           const ResampleRule& rule, std::span<std::uint32_t> out) {
    assert(lines.column.size() * lines.row.size() == out.size());
    ColourSampler sampler(window, rule);
    if (sampler.way() == ColourSampler::Way::bilinear && bilinear_lines(sampler, window, lines, out.data())) return;
    if (sampler.way() == ColourSampler::Way::whole && mean_lines(sampler, window, lines, out.data())) return;
    std::size_t k = 0;
    for (const double v : lines.row)
        for (const double u : lines.column) out[k++] = sampler.at(u, v);
}

}  // namespace scree
