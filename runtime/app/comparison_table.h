// A comparison as CSV and as JSON: the same figures under the same names (docs/measuring.md). Pure.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "runtime/app/comparison.h"

namespace scree {

/// Stands for infinity, which JSON has no word for: an error that could not be measured.
inline constexpr double kBeyondMeasure = 1e9;
/// Errors that methods are compared at.
inline constexpr double kErrors_px[] = {0.25, 0.5, 1, 2, 4, 8, 16};

/// A header, and a line a case.
std::string comparison_csv(const Comparison& comparison);
nlohmann::ordered_json comparison_json(const Comparison& comparison, const std::optional<Wish>& wish);
/// For people at a terminal.
std::string comparison_text(const Comparison& comparison);

}  // namespace scree
