// Completion for bash, zsh and fish, from what --help says.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scree {

enum class Shell { bash, zsh, fish };

/// What a program's completion begins and ends with. `commands`: name and summary of each; `opens_stores`: the first
/// word may also be a store.
struct CompletedProgram {
    std::string name;
    std::vector<std::pair<std::string, std::string>> commands;
    std::vector<std::string> other_words;  ///< that may come first: "--help"
    bool opens_stores = false;
    std::string meant{};  ///< the command that is meant where none is named; empty: there must be one
};
std::string completion_head(const CompletedProgram& program, Shell shell);
std::string completion_tail(const CompletedProgram& program, Shell shell);

/// What there is to say of one command, between the two: "scree build" makes that of build; a program without a command
/// makes the rest, after all others. bash and zsh have the same.
std::string completion_of(const CLI::App& app, Shell shell);

/// "--completion", "--completion-zsh", "--completion-fish": what asks a program for all of it.
std::optional<Shell> completion_asked(std::string_view argument);
/// "--completion-case", "--completion-lines": what asks a command for its part.
std::string completion_flag(Shell shell);

}  // namespace scree
