#include "common/cli/arguments.h"

#include <fmt/format.h>

#include <string_view>

#include "common/cli/completion.h"
#include "common/cli/man_page.h"
#include "common/result.h"

namespace scree {

void add_json_option(CLI::App& app, std::string& file) {
    app.add_option("--json", file, "Write the report as JSON to a file, or - for standard output")->type_name("FILE|-");
}

int parse_arguments(CLI::App& app, int argc, char** argv, const std::vector<std::string>& see_also) {
    const std::string_view only = argc == 2 ? argv[1] : "";
    if (only == "--man-page") return fmt::print("{}", man_page(app, see_also)), 0;
    for (const Shell shell : {Shell::bash, Shell::fish})
        if (only == completion_flag(shell)) return fmt::print("{}", completion_of(app, shell)), 0;
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    return -1;
}

}  // namespace scree
