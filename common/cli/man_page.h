// Manual pages in roff (man(7)), from what --help says.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scree {

/// Of one command. An app called "scree build" makes scree-build(1).
std::string man_page(const CLI::App& app, const std::vector<std::string>& see_also = {});

struct ProgramPage {
    std::string_view name, summary;
    std::vector<std::pair<std::string_view, std::string_view>> commands;  ///< name, summary
};
/// Of a program that does nothing without a command.
std::string man_page(const ProgramPage& program);

}  // namespace scree
