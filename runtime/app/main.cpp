// scree-view: the runtime program. `scree-view STORE` opens the window, as `scree-view view STORE` does; shot, fly,
// audit and compare are commands.
#include <fmt/format.h>

#include <array>
#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "common/report.h"
#include "runtime/app/commands.h"

namespace {

struct Command {
    std::string_view name;
    int (*run)(int, char**);
};

constexpr std::array<Command, 5> kCommands{{{"view", scree::run_view},
                                            {"shot", scree::run_shot},
                                            {"fly", scree::run_fly},
                                            {"audit", scree::run_audit},
                                            {"compare", scree::run_compare}}};

int dispatch(int argc, char** argv) {
    const std::string_view name = argc > 1 ? argv[1] : "";
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
