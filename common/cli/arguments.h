// The command line that every command of both programs has alike. One description of its options makes --help, the
// manual page (--man-page) and the shell's completion (--completion-case); the last two are for the build and stand in
// no help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace scree {

/// --json FILE|-
void add_json_option(CLI::App& app, std::string& file);

/// Parses argv; -1 to go on, else the exit code. `see_also`: other manual pages, besides that of the program.
int parse_arguments(CLI::App& app, int argc, char** argv, const std::vector<std::string>& see_also = {});

}  // namespace scree
