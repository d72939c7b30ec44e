// A comparison as one page of HTML that needs nothing else: curves and pictures are inside it, for light and dark
// screens. Pure.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "runtime/app/comparison.h"

namespace scree {

/// `command`: what was recommended, as it can be typed; empty where nothing was. Errors: ErrorCode::io (no memory for a
/// picture).
Result<std::string> comparison_page(const Comparison& comparison, const std::optional<Wish>& wish,
                                    const std::string& command);

}  // namespace scree
