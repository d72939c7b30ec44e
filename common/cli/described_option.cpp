#include "common/cli/described_option.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace scree {
namespace {

// CLI11 puts what is checked behind the type: "INT:INT in [0 - 1024]".
void take_type(std::string_view type, DescribedOption& out) {
    const std::size_t colon = type.find(':');
    out.value = type.substr(0, colon);
    if (colon == std::string_view::npos) return;
    const std::size_t open = type.find('[', colon), dash = type.find(" - ", colon), close = type.find(']', colon);
    if (open == std::string_view::npos || close == std::string_view::npos || !(open < dash && dash < close)) return;
    out.range = std::string(type.substr(open + 1, dash - open - 1)) + " to " +
                std::string(type.substr(dash + 3, close - dash - 3));
}

std::vector<std::string> names_of(const std::set<CLI::Option*>& options) {
    std::vector<std::string> names;
    for (const CLI::Option* option : options) names.push_back(option->get_name());
    std::sort(names.begin(), names.end());
    return names;
}

DescribedOption described(const CLI::Option& option) {
    DescribedOption out;
    out.positional = !option.nonpositional();
    if (out.positional) out.names.push_back(option.get_name(true));
    for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
    out.required = option.get_required();
    out.takes_value = option.get_items_expected_max() > 0;
    out.repeats = option.get_items_expected_max() > 1;
    if (out.takes_value) take_type(option.get_type_name(), out);
    out.text = option.get_description();
    out.by_default = option.get_default_str();
    out.needs = names_of(option.get_needs());
    out.excludes = names_of(option.get_excludes());
    return out;
}

std::vector<std::string_view> parts(std::string_view value) {
    std::vector<std::string_view> out;
    for (;;) {
        const std::size_t bar = value.find('|');
        out.push_back(value.substr(0, bar));
        if (bar == std::string_view::npos) return out;
        value.remove_prefix(bar + 1);
    }
}

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

}  // namespace

// Groups of options have a --help of their own, which is nobody's.
std::vector<DescribedOption> described_options(const CLI::App& app) {
    std::vector<DescribedOption> out;
    for (const CLI::Option* option : app.get_options())
        if (!option->get_group().empty() && (app.get_parent() == nullptr || option != app.get_help_ptr()))
            out.push_back(described(*option));
    for (const CLI::App* group : app.get_subcommands([](const CLI::App* a) { return a->get_name().empty(); }))
        for (DescribedOption& option : described_options(*group)) out.push_back(std::move(option));
    return out;
}

std::vector<std::string> choices(const DescribedOption& option) {
    std::vector<std::string> out;
    for (const std::string_view part : parts(option.value))
        if (!part.empty() && is_lower(part[0])) out.emplace_back(part);
    return out;
}

bool takes_file(const DescribedOption& option) {
    constexpr std::array<std::string_view, 4> kFiles{"FILE", "PATH", "CSV", "DIR"};
    const auto all = parts(option.value);
    return std::any_of(all.begin(), all.end(), [&](std::string_view part) {
        return std::find(kFiles.begin(), kFiles.end(), part) != kFiles.end();
    });
}

}  // namespace scree
