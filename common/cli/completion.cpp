#include "common/cli/completion.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/cli/described_option.h"

namespace scree {
namespace {

std::string joined(const std::vector<std::string>& words, const char* between) {
    std::string out;
    for (const std::string& word : words) out += (out.empty() ? "" : between) + word;
    return out;
}

// What the word after an option may be: nothing that a shell could know, where it is a number or a text.
std::string value_case(const DescribedOption& option) {
    const auto words = choices(option);
    const char* kind = takes_file(option) ? "files" : words.empty() ? "nothing" : "words";
    return fmt::format("                {}) kind={} choices=\"{}\" ;;\n", joined(option.names, " | "), kind,
                       joined(words, " "));
}

std::string_view positional_kind(const std::vector<DescribedOption>& options) {
    for (const DescribedOption& option : options)
        if (option.positional) return option.names[0] == "STORE" ? "stores" : "files";
    return "nothing";
}

std::string first_words(const CompletedProgram& program) {
    std::vector<std::string> words;
    for (const auto& command : program.commands) words.push_back(command.first);
    words.insert(words.end(), program.other_words.begin(), program.other_words.end());
    return joined(words, " ");
}

// "build" of "scree build"; empty: of a program without a command.
std::string command_of(const CLI::App& app) {
    const std::string title = app.get_name();
    const std::size_t space = title.find(' ');
    return space == std::string::npos ? "" : title.substr(space + 1);
}

// A branch of the case over commands.
std::string case_branch(const CLI::App& app) {
    const std::string command = command_of(app);
    const auto options = described_options(app);
    std::vector<std::string> names;
    std::string values;
    for (const DescribedOption& option : options) {
        if (option.positional) continue;
        names.insert(names.end(), option.names.begin(), option.names.end());
        if (option.takes_value) values += value_case(option);
    }
    return fmt::format(
        "        {})\n"
        "            options=\"{}\" kind={}\n"
        "            case $previous in\n"
        "{}"
        "            esac\n"
        "            ;;\n",
        command.empty() ? "*" : command, joined(names, " "), positional_kind(options), values);
}

// In single quotes: fish knows two escapes there.
std::string fish_quoted(std::string_view text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'' || c == '\\') out += '\\';
        out += c;
    }
    return out + "'";
}

std::string fish_option(const DescribedOption& option, const std::string& start) {
    std::string line = start;
    for (const std::string& name : option.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    const auto words = choices(option);
    if (takes_file(option))
        line += " -r -F";
    else if (!words.empty())
        line += " -x -a " + fish_quoted(joined(words, " "));
    else if (option.takes_value)
        line += " -x";
    return line + " -d " + fish_quoted(option.text) + "\n";
}

// Of options, and of files where they may stand.
std::string fish_lines(const CLI::App& app) {
    const std::string title = app.get_name(), program = title.substr(0, title.find(' ')), command = command_of(app);
    const std::string when = command.empty() ? "not __scree_view_command" : "__fish_seen_subcommand_from " + command;
    const std::string start = fmt::format("complete -c {} -n {}", program, fish_quoted(when));
    const auto options = described_options(app);
    const std::string_view kind = positional_kind(options);
    std::string lines;
    for (const DescribedOption& option : options)
        if (!option.positional) lines += fish_option(option, start);
    if (kind == "files") lines += start + " -F\n";
    if (kind == "stores") lines += start + " -k -a '(__fish_complete_suffix .scree)'\n";
    return lines;
}

std::string function_of(const CompletedProgram& program) {
    std::string name = program.name;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

std::string bash_head(const CompletedProgram& program) {
    return fmt::format(
        "# bash completion for {0}, from what its --help says\n"
        "_{1}() {{\n"
        "    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}\n"
        "    local options='' choices='' kind=nothing command=${{COMP_WORDS[1]}}\n"
        "    ((COMP_CWORD > 1)) || command='' previous=''\n"
        "    case $command in\n",
        program.name, function_of(program));
}

std::string zsh_head(const CompletedProgram& program) {
    return fmt::format(
        "#compdef {0}\n"
        "# zsh completion for {0}, from what its --help says\n"
        "local current=${{words[CURRENT]}} previous=${{words[CURRENT - 1]}}\n"
        "local options='' choices='' kind=nothing command=${{words[2]}}\n"
        "((CURRENT > 2)) || {{ command='' previous='' }}\n"
        "    case $command in\n",
        program.name);
}

std::string fish_head(const CompletedProgram& program) {
    std::string head =
        fmt::format("# fish completion for {0}, from what its --help says\ncomplete -c {0} -f\n", program.name);
    std::vector<std::string> names;
    for (const auto& [name, summary] : program.commands) {
        head += fmt::format("complete -c {} -n __fish_use_subcommand -a {} -d {}\n", program.name, name,
                            fish_quoted(summary));
        if (name != program.meant) names.push_back(name);
    }
    for (const std::string& word : program.other_words)
        if (word.starts_with("--"))
            head += fmt::format("complete -c {} -n __fish_use_subcommand -l {}\n", program.name, word.substr(2));
    if (program.opens_stores)
        head +=
            fmt::format("function __scree_view_command\n    __fish_seen_subcommand_from {}\nend\n", joined(names, " "));
    return head;
}

std::string bash_tail(const CompletedProgram& program) {
    return fmt::format(
        "    esac\n"
        "    COMPREPLY=()\n"
        "    if [[ $current == -* && $kind != words ]]; then\n"
        "        mapfile -t COMPREPLY < <(compgen -W \"$options $choices\" -- \"$current\")\n"
        "        return\n"
        "    fi\n"
        "    [[ $kind != words* ]] || mapfile -t COMPREPLY < <(compgen -W \"$choices\" -- \"$current\")\n"
        "    if [[ $kind == *stores ]]; then\n"
        "        mapfile -t -O ${{#COMPREPLY[@]}} COMPREPLY < <(compgen -f -X '!*.scree' -- \"$current\"\n"
        "            compgen -d -- \"$current\")\n"
        "        compopt -o filenames 2>/dev/null\n"
        "    elif [[ $kind == files ]]; then\n"
        "        mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n"
        "        compopt -o filenames 2>/dev/null\n"
        "    fi\n"
        "}}\n"
        "complete -F _{1} {0}\n",
        program.name, function_of(program));
}

constexpr std::string_view kZshTail =
    "    esac\n"
    "    if [[ $current == -* && $kind != words ]]; then\n"
    "        compadd -- ${=options} ${=choices}\n"
    "        return\n"
    "    fi\n"
    "    [[ $kind != words* ]] || compadd -- ${=choices}\n"
    "    if [[ $kind == *stores ]]; then\n"
    "        _files -g '*.scree'\n"
    "    elif [[ $kind == files ]]; then\n"
    "        _files\n"
    "    fi\n";

}  // namespace

std::string completion_head(const CompletedProgram& program, Shell shell) {
    if (shell == Shell::fish) return fish_head(program);
    return (shell == Shell::bash ? bash_head(program) : zsh_head(program)) +
           fmt::format("        '') choices=\"{}\" kind={} ;;\n", first_words(program),
                       program.opens_stores ? "words_or_stores" : "words");
}

std::string completion_tail(const CompletedProgram& program, Shell shell) {
    return shell == Shell::bash ? bash_tail(program) : shell == Shell::zsh ? std::string(kZshTail) : "";
}

std::string completion_of(const CLI::App& app, Shell shell) {
    return shell == Shell::fish ? fish_lines(app) : case_branch(app);
}

std::optional<Shell> completion_asked(std::string_view argument) {
    if (argument == "--completion") return Shell::bash;
    if (argument == "--completion-zsh") return Shell::zsh;
    if (argument == "--completion-fish") return Shell::fish;
    return std::nullopt;
}

std::string completion_flag(Shell shell) { return shell == Shell::fish ? "--completion-lines" : "--completion-case"; }

}  // namespace scree
