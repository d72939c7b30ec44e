// Completion for bash, from what --help says.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace scree {

/// A branch of the case over commands: "scree build" makes that of build; a program without a command makes the rest.
std::string completion_case(const CLI::App& app);

/// What goes before and after the branches. `words`: what may come first. `opens_stores`: so may a store.
std::string completion_head(std::string_view program, const std::vector<std::string>& words, bool opens_stores);
std::string completion_tail(std::string_view program);

}  // namespace scree
