// scree-view: the runtime program. `scree-view STORE` opens the window, as `scree-view view STORE` does; shot, fly,
// audit and compare are commands.
#include <fmt/format.h>

#include <array>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "common/cli/completion.h"
#include "common/report.h"
#include "runtime/app/commands.h"

namespace {

struct Command {
    std::string_view name;
    std::string_view summary;
    int (*run)(int, char**);
};

constexpr std::array<Command, 5> kCommands{
    {{"view", "Shows terrain in a window", scree::run_view},
     {"shot", "Renders one picture", scree::run_shot},
     {"fly", "Flies a path and measures it", scree::run_fly},
     {"audit", "Measures the drawn surface against the finest data", scree::run_audit},
     {"compare", "Compares the methods", scree::run_compare}}};

// For the build, which installs what this prints.
int print_completion(scree::Shell shell) {
    scree::CompletedProgram program{"scree-view", {}, {}, true, "view"};
    for (const Command& c : kCommands) program.commands.emplace_back(c.name, c.summary);
    fmt::print("{}", scree::completion_head(program, shell));
    std::string name = "scree-view", flag = scree::completion_flag(shell);
    std::array<char*, 3> arguments{name.data(), flag.data(), nullptr};
    for (const Command& c : kCommands)
        if (c.run != scree::run_view) c.run(2, arguments.data());
    scree::run_view(2, arguments.data());  // all others
    fmt::print("{}", scree::completion_tail(program, shell));
    return 0;
}

int dispatch(int argc, char** argv) {
    const std::string_view name = argc > 1 ? argv[1] : "";
    if (const auto shell = scree::completion_asked(name)) return print_completion(*shell);
    for (const Command& c : kCommands)
        if (c.name == name) return c.run(argc - 1, argv + 1);
    return scree::run_view(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
    scree::guard_standard_descriptors();
    try {
        return scree::finish_output("scree-view", dispatch(argc, argv));
    } catch (const std::bad_alloc&) {
        scree::note("scree-view: out of memory\n");
    } catch (const std::exception& error) {
        scree::note("scree-view: {}\n", error.what());
    }
    return 5;
}
