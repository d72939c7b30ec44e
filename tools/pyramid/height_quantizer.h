// How raw source values become integers of the height quantum (docs/architecture.md, "One height quantum").
#pragma once

#include <cstdint>
#include <optional>

#include "common/result.h"

namespace scree {

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
