#include "tools/source/number_text.h"

#include <charconv>
#include <system_error>

namespace scree {

std::optional<double> parse_number(std::string_view text) {
    constexpr std::string_view kSpace(" \t\r\n\f\v\0", 7);
    const std::size_t first = text.find_first_not_of(kSpace);
    if (first == std::string_view::npos) return std::nullopt;
    text = text.substr(first, text.find_last_not_of(kSpace) - first + 1);
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (status != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

}  // namespace scree
