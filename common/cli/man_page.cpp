#include "common/cli/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/cli/described_option.h"

namespace scree {
namespace {

// Running text: what roff would take for a command, and dashes that are to be typed.
std::string roff(std::string_view text) {
    std::string out;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const char c = text[k];
        const bool starts_line = k == 0 || text[k - 1] == '\n';
        if (starts_line && (c == '.' || c == '\'')) out += "\\&";
        if (c == '\\')
            out += "\\e";
        else if (c == '-' && (k == 0 || text[k - 1] == ' ' || text[k - 1] == '-'))
            out += "\\-";
        else if (c == '\n')
            out += "\n.PP\n";
        else
            out += c;
    }
    return out;
}

std::string dashes(std::string_view name) {
    std::string out;
    for (const char c : name) out += c == '-' ? "\\-" : std::string(1, c);
    return out;
}

std::string bold(std::string_view name) { return "\\fB" + dashes(name) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + dashes(text) + "\\fR"; }

std::string sentence(std::string text) {
    if (!text.empty() && text.back() != '.') text += '.';
    return text;
}

std::string joined(const std::vector<std::string>& names, std::string (*dress)(std::string_view)) {
    std::string out;
    for (const std::string& name : names) out += (out.empty() ? "" : ", ") + dress(name);
    return out;
}

std::string page_name(std::string_view title) {
    std::string name(title);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string head(std::string_view title, std::string summary) {
    if (!summary.empty() && summary.back() == '.') summary.pop_back();
    if (summary.size() > 1 && std::islower(static_cast<unsigned char>(summary[1])) != 0)
        summary[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(summary[0])));
    std::string upper = page_name(title);
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return fmt::format(".TH {} 1 \"\" \"scree {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", dashes(upper),
                       SCREE_VERSION, dashes(page_name(title)), roff(summary));
}

std::string value_of(const DescribedOption& option) {
    if (!option.takes_value) return {};
    return " " + italic(option.value) + (option.repeats ? "..." : "");
}

std::string item(const DescribedOption& option) {
    std::string out = ".TP\n";
    if (option.positional)
        out += italic(option.names[0]) + (option.repeats ? "..." : "");
    else
        out += joined(option.names, bold) + value_of(option);
    out += "\n" + roff(sentence(option.text)) + "\n";
    if (option.required && !option.positional) out += "Required.\n";
    if (!option.range.empty()) out += option.range + ".\n";
    if (!option.by_default.empty()) out += "Default: " + roff(option.by_default) + ".\n";
    if (!option.needs.empty()) out += "Needs " + joined(option.needs, bold) + ".\n";
    if (!option.excludes.empty()) out += "Not with " + joined(option.excludes, bold) + ".\n";
    return out;
}

std::string synopsis(std::string_view title, const std::vector<DescribedOption>& options) {
    std::string out = fmt::format(".SH SYNOPSIS\n{} [{}]", bold(title), italic("OPTIONS"));
    for (const DescribedOption& o : options) {
        if (!o.positional) continue;
        const std::string name = italic(o.names[0]) + (o.repeats ? "..." : "");
        out += o.required ? " " + name : " [" + name + "]";
    }
    return out + "\n";
}

std::string exit_status(std::string_view title) {
    const bool draws = title.substr(0, 10) == "scree-view";
    return fmt::format(
        ".SH EXIT STATUS\n0 done, 1 a check failed, 2 usage, 3 input missing or unusable, 4 store damaged or of "
        "another "
        "format, 5 I/O error or disk full, {}130 interrupted.\n",
        draws ? "6 no display or no OpenGL 4.5, " : "");
}

std::string see_also_of(std::vector<std::string> pages) {
    std::string out = ".SH SEE ALSO\n";
    for (std::size_t k = 0; k < pages.size(); ++k)
        out += fmt::format(".BR {} (1){}\n", dashes(pages[k]), k + 1 < pages.size() ? "," : "");
    return out;
}

// The first sentence names the command, all of it describes it.
std::string first_sentence(const std::string& text) { return text.substr(0, text.find_first_of(":.\n")); }

}  // namespace

std::string man_page(const CLI::App& app, const std::vector<std::string>& see_also) {
    const std::string title = app.get_name();
    const auto options = described_options(app);
    std::string out = head(title, first_sentence(app.get_description())) + synopsis(title, options);
    out += ".SH DESCRIPTION\n" + roff(app.get_description()) + "\n";
    for (const DescribedOption& option : options)
        if (option.positional) out += item(option);
    out += ".SH OPTIONS\n";
    for (const DescribedOption& option : options)
        if (!option.positional) out += item(option);
    std::vector<std::string> pages = see_also;
    const std::string program = title.substr(0, title.find(' '));
    pages.push_back(program == title ? "scree" : program);
    std::sort(pages.begin(), pages.end());
    return out + exit_status(title) + see_also_of(pages);
}

std::string man_page(const ProgramPage& program) {
    std::string out = head(program.name, std::string(program.summary));
    out += fmt::format(".SH SYNOPSIS\n{} {} [{}]\n.SH COMMANDS\n", bold(program.name), italic("COMMAND"),
                       italic("OPTIONS"));
    std::vector<std::string> pages{"scree-view"};
    for (const auto& [name, summary] : program.commands) {
        out += fmt::format(".TP\n{}\n{}\n", bold(name), roff(sentence(std::string(summary))));
        pages.push_back(fmt::format("{}-{}", program.name, name));
    }
    std::sort(pages.begin(), pages.end());
    return out + exit_status(program.name) + see_also_of(pages);
}

}  // namespace scree
