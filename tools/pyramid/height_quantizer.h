// How raw source values become integers of the height quantum (docs/architecture.md, "One height quantum").
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "common/result.h"

namespace scree {

/// What a set of quantised values reaches.
struct QuantizedRange {
    std::int32_t min_n = std::numeric_limits<std::int32_t>::max(), max_n = std::numeric_limits<std::int32_t>::min();
    double worst_error_m = 0;  ///< greatest distance from a raw value to what is stored

    void include(const QuantizedRange& other);
};

/// z = raw * scale + offset in metres; n = round((z - height_offset) / quantum).
struct HeightQuantizer {
    double scale = 1;
    double offset_m = 0;
    double height_offset_m = 0;
    double quantum_m = 1;

    double metres(double raw) const { return raw * scale + offset_m; }
    std::int32_t quantize(double raw) const;
    /// Distance from a raw value to what is stored, in metres.
    double error_m(double raw) const;
    /// Many values at once, and what they reach where `valid` is 1 (empty: everywhere).
    QuantizedRange quantize(std::span<const float> raw, std::span<const std::uint8_t> valid,
                            std::span<std::int32_t> out) const;
    QuantizedRange quantize(std::span<const double> raw, std::span<const std::uint8_t> valid,
                            std::span<std::int32_t> out) const;
};

struct QuantizerInput {
    bool integer_source = false;
    double scale = 1, offset_m = 0;
    std::optional<double> quantum_m;  ///< asked for by the user
    double min_raw = 0, max_raw = 0;
};

/// Integer sources keep their own unit; others take 2^-6 m or the next coarser that fits 2^23.
/// Errors: ErrorCode::input for heights beyond +-1e7 m (an undeclared nodata value, usually), ErrorCode::usage for a
/// quantum that cannot hold the range.
Result<HeightQuantizer> choose_quantizer(const QuantizerInput& input);

}  // namespace scree
