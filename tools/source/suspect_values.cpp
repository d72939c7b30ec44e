#include "tools/source/suspect_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/source/value_range.h"

namespace scree {
namespace {

constexpr double kNeighbourhood = 100;  // raw units

template <class T>
std::vector<double> extremes() {
    return {static_cast<double>(std::numeric_limits<T>::lowest()), static_cast<double>(std::numeric_limits<T>::max())};
}

// What a marker would be in this type. Zero is sea level, not a suspect; 8 bits are too few to set one apart.
std::vector<double> markers_of(SampleType type) {
    const auto with_usual = [](std::vector<double> values) {
        values.insert(values.end(), {-9999, -32768, -32767});
        return values;
    };
    const auto of_float = [&](std::vector<double> values) {
        values.insert(values.end(), {65535, static_cast<double>(1.70141e38f),
                                     static_cast<double>(std::numeric_limits<float>::lowest()),
                                     static_cast<double>(std::numeric_limits<float>::max())});
        return with_usual(values);
    };
    switch (type) {
        case SampleType::u8:
        case SampleType::i8:
            return {};
        case SampleType::u16:
            return {65535};
        case SampleType::i16:
            return with_usual(extremes<std::int16_t>());
        case SampleType::u32:
            return {65535, static_cast<double>(std::numeric_limits<std::uint32_t>::max())};
        case SampleType::i32:
            return with_usual(extremes<std::int32_t>());
        case SampleType::u64:
            return {65535, static_cast<double>(std::numeric_limits<std::uint64_t>::max())};
        case SampleType::i64:
            return with_usual(extremes<std::int64_t>());
        case SampleType::f16:
            return with_usual({-65504, 65504});
        case SampleType::f32:
            return of_float({});
        case SampleType::f64:
            return of_float(extremes<double>());
    }
    return {};
}

std::string grouped(std::int64_t n) {
    std::string digits = fmt::format("{}", n);
    for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
    return digits;
}

}  // namespace

SuspectValues::SuspectValues(const ImageInfo& dem, const HeightReading& reading)
    : tag_(dem.nodata),
      user_(reading.nodata),
      ordinary_above_(-std::numeric_limits<double>::infinity()),
      ordinary_below_(std::numeric_limits<double>::infinity()) {
    if (user_ && dem.type == SampleType::f32) user_ = static_cast<double>(static_cast<float>(*user_));
    std::vector<double> markers = markers_of(dem.type);
    std::sort(markers.begin(), markers.end());
    markers.erase(std::unique(markers.begin(), markers.end()), markers.end());
    for (const double value : markers) {
        if (is_declared(value)) continue;
        suspects_.push_back({value});
        if (value < 0)
            ordinary_above_ = std::max(ordinary_above_, value + kNeighbourhood);
        else
            ordinary_below_ = std::min(ordinary_below_, value - kNeighbourhood);
    }
}

bool SuspectValues::is_declared(double v) const { return (tag_ && v == *tag_) || (user_ && v == *user_); }

void SuspectValues::look_at(double v) {
    const auto same = std::find_if(suspects_.begin(), suspects_.end(), [&](const Suspect& s) { return s.value == v; });
    if (same != suspects_.end()) {
        ++same->samples;
        return;
    }
    if (is_declared(v)) return;
    for (Suspect& s : suspects_) s.has_neighbours |= std::abs(v - s.value) <= kNeighbourhood;
}

// Most values matter to nobody: whole groups are passed over by their range.
template <class T>
void SuspectValues::add_all(std::span<const T> values) {
    constexpr std::size_t kGroup = 1024;
    if (suspects_.empty()) return;
    for (std::size_t first = 0; first < values.size(); first += kGroup) {
        const auto group = values.subspan(first, std::min(kGroup, values.size() - first));
        const ValueRange<T> range = range_of_values(group);
        if (range.low > ordinary_above_ && range.high < ordinary_below_) continue;
        for (const T v : group)
            if (v <= ordinary_above_ || v >= ordinary_below_) look_at(v);
    }
}

void SuspectValues::add(std::span<const double> values) { add_all(values); }
void SuspectValues::add(std::span<const float> values) { add_all(values); }

std::optional<std::string> SuspectValues::warning(const std::string& path) const {
    const Suspect* accused = nullptr;
    for (const Suspect& s : suspects_)
        if (s.samples > 0 && !s.has_neighbours && (accused == nullptr || s.samples > accused->samples)) accused = &s;
    if (accused == nullptr) return std::nullopt;
    const bool one = accused->samples == 1;
    const std::string declared = tag_ || user_ ? fmt::format("the declared nodata value is {}", tag_ ? *tag_ : *user_)
                                               : std::string("no nodata value is declared");
    return fmt::format("{}: {} {} {} and {}; if {} say --nodata {}", path, grouped(accused->samples),
                       one ? "sample is" : "samples are", accused->value, declared,
                       one ? "it is a void" : "they are voids", accused->value);
}

}  // namespace scree
