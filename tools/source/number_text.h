// Numbers in files, read alike in every locale.
#pragma once

#include <optional>
#include <string_view>

namespace scree {

/// The whole text, but for white space around it, as a decimal number ("1e-3", "+5", "nan", "-inf"); nullopt otherwise.
std::optional<double> parse_number(std::string_view text);

}  // namespace scree
