#include "runtime/report/machine.h"

#include <fmt/format.h>

#include <fstream>
#include <thread>

namespace scree {

std::string machine_name() {
    const unsigned cores = std::thread::hardware_concurrency();
    const std::string count = fmt::format("{} core{}", cores, cores == 1 ? "" : "s");
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        if (line.rfind("model name", 0) != 0) continue;
        const auto name = line.find_first_not_of(" \t", line.find(':') + 1);
        if (name != std::string::npos) return fmt::format("{}, {}", line.substr(name), count);
    }
    return count;
}

}  // namespace scree
