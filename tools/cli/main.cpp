// scree: the offline program. One subcommand a file.
#include <fmt/format.h>

#include <array>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "common/cli/completion.h"
#include "common/cli/man_page.h"
#include "common/report.h"
#include "tools/cli/build_command.h"
#include "tools/cli/export_command.h"
#include "tools/cli/height_command.h"
#include "tools/cli/info_command.h"
#include "tools/cli/samples_command.h"
#include "tools/cli/synth_command.h"
#include "tools/cli/update_command.h"
#include "tools/verify/verify_command.h"

namespace {

struct Command {
    std::string_view name, summary;
    int (*run)(int, char**);
};

constexpr std::array<Command, 8> kCommands{{
    {"synth", "make a mountain landscape to try things on", scree::run_synth},
    {"build", "cut a DEM and an image into a pyramid", scree::run_build},
    {"update", "lay new, changed or removed sources over a store", scree::run_update},
    {"info", "say what a store holds", scree::run_info},
    {"height", "say how high the terrain is at points, or where a ray meets it", scree::run_height},
    {"verify", "check a store: bounds, edges, checksums, completeness", scree::run_verify},
    {"export", "write part of a store in a common format", scree::run_export},
    {"samples", "write a DEM's samples raw, to judge a store by", scree::run_samples},
}};

void print_help() {
    fmt::print("scree {}: terrain pyramids for scree-view\n\nUsage: scree COMMAND [OPTIONS]\n\n", SCREE_VERSION);
    for (const Command& c : kCommands) fmt::print("  {:<8} {}\n", c.name, c.summary);
    fmt::print(
        "\nscree COMMAND --help tells more. Exit codes: 0 done, 1 a check failed, 2 usage, 3 input, 4 store, 5 I/O, "
        "130 interrupted.\n");
}

// For the build, which installs what these print.
void print_man_page() {
    scree::ProgramPage page{"scree", "terrain pyramids for scree-view", {}};
    for (const Command& c : kCommands) page.commands.emplace_back(c.name, c.summary);
    fmt::print("{}", scree::man_page(page));
}

void print_completion(scree::Shell shell) {
    scree::CompletedProgram program{"scree", {}, {"--help", "--version"}, false};
    for (const Command& c : kCommands) program.commands.emplace_back(c.name, c.summary);
    fmt::print("{}", scree::completion_head(program, shell));
    for (const Command& c : kCommands) {
        std::string title = fmt::format("scree {}", c.name), flag = scree::completion_flag(shell);
        std::array<char*, 3> arguments{title.data(), flag.data(), nullptr};
        c.run(2, arguments.data());
    }
    fmt::print("{}", scree::completion_tail(program, shell));
}

}  // namespace

int main(int argc, char** argv) {
    scree::guard_standard_descriptors();
    const std::string_view name = argc > 1 ? argv[1] : "";
    if (name == "--help" || name == "-h") return print_help(), 0;
    if (name == "--version") return fmt::print("scree {}\n", SCREE_VERSION), 0;
    if (name == "--man-page") return print_man_page(), 0;
    if (const auto shell = scree::completion_asked(name)) return print_completion(*shell), 0;
    for (const Command& c : kCommands) {
        if (c.name != name) continue;
        std::string title = "scree " + std::string(name);
        argv[1] = title.data();
        try {
            return scree::finish_output(title.c_str(), c.run(argc - 1, argv + 1));
        } catch (const std::bad_alloc&) {
            scree::note("{}: out of memory\n", title);
            return 5;
        } catch (const std::exception& error) {
            scree::note("{}: {}\n", title, error.what());
            return 5;
        }
    }
    if (name.empty())
        scree::note("scree: a command is missing; scree --help lists them\n");
    else
        scree::note("scree: no command '{}'; scree --help lists them\n", name);
    return 2;
}
