// What every program of the experiments does alike: its command line, and what a run ends with.
#pragma once

#include <CLI/CLI.hpp>
#include <exception>

#include "common/report.h"

namespace scree {

/// Parses argv; -1 to go on, else the exit code.
inline int parse_words(CLI::App& app, int argc, char** argv) {
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    return -1;
}

/// The program itself: `main_of(argc, argv)` gives its exit code.
template <class Main>
int run_program(const char* name, int argc, char** argv, const Main& main_of) {
    guard_standard_descriptors();
    try {
        return finish_output(name, main_of(argc, argv));
    } catch (const std::exception& error) {
        note("{}: {}\n", name, error.what());
    }
    return static_cast<int>(ErrorCode::io);
}

}  // namespace scree
