// An option as its --help describes it, taken apart for the manual page and the completion.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace scree {

struct DescribedOption {
    std::vector<std::string> names;  ///< with their dashes; of a positional its name alone
    bool positional = false;
    bool required = false;
    bool takes_value = false;
    bool repeats = false;  ///< takes several values
    std::string value;     ///< what to write for a value: "FILE|-", "nearest|bilinear|cubic"
    std::string range;     ///< "1 to 10", or empty
    std::string text;
    std::string by_default;                    ///< or empty
    std::vector<std::string> needs, excludes;  ///< other options
};

/// Those of groups included, in the order in which they were added.
std::vector<DescribedOption> described_options(const CLI::App& app);

/// The words that an option may take: the parts of its `value` between bars that are written small; empty for others.
std::vector<std::string> choices(const DescribedOption& option);
/// One of the parts is FILE, PATH, CSV or DIR.
bool takes_file(const DescribedOption& option);

}  // namespace scree
