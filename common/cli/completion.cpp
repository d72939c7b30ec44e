#include "common/cli/completion.h"

#include <fmt/format.h>

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
    return fmt::format("                {}) kind={} words=\"{}\" ;;\n", joined(option.names, " | "), kind,
                       joined(words, " "));
}

std::string_view positional_kind(const std::vector<DescribedOption>& options) {
    for (const DescribedOption& option : options)
        if (option.positional) return option.names[0] == "STORE" ? "stores" : "files";
    return "nothing";
}

}  // namespace

std::string completion_case(const CLI::App& app) {
    const std::string title = app.get_name();
    const std::size_t space = title.find(' ');
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
        space == std::string::npos ? "*" : title.substr(space + 1), joined(names, " "), positional_kind(options),
        values);
}

std::string completion_head(std::string_view program, const std::vector<std::string>& words, bool opens_stores) {
    return fmt::format(
        "# bash completion for {0}, from what its --help says\n"
        "_{1}() {{\n"
        "    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}\n"
        "    local options='' words='' kind=nothing command=${{COMP_WORDS[1]}}\n"
        "    ((COMP_CWORD > 1)) || command='' previous=''\n"
        "    case $command in\n"
        "{2}",
        program, program == "scree" ? "scree" : "scree_view",
        opens_stores ? fmt::format("        '') words=\"{}\" kind=words_or_stores ;;\n", joined(words, " "))
                     : fmt::format("        '') words=\"{}\" kind=words ;;\n", joined(words, " ")));
}

std::string completion_tail(std::string_view program) {
    return fmt::format(
        "    esac\n"
        "    COMPREPLY=()\n"
        "    if [[ $current == -* && $kind != words ]]; then\n"
        "        mapfile -t COMPREPLY < <(compgen -W \"$options $words\" -- \"$current\")\n"
        "        return\n"
        "    fi\n"
        "    [[ $kind != words* ]] || mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
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
        program, program == "scree" ? "scree" : "scree_view");
}

}  // namespace scree
