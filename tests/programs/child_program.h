// Runs a program as a child process and says how it ended: what a user at a shell would see.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace scree::test {

struct ProgramRun {
    int exit_code = -1;  ///< as a shell says it: 128 + signal for a killed child
    bool timed_out = false;
    bool signalled = false;  ///< our own signal was sent before it ended
    std::string out, err;
    std::int64_t peak_rss_bytes = 0;
    double seconds = 0;
    double cpu_seconds = 0;  ///< with those of the processes that it waited for
};

struct ProgramOptions {
    double limit_s = 100;                  ///< killed after so long: a hang is a failure, not a stuck test run
    std::vector<std::string> environment;  ///< "NAME=VALUE" sets, "NAME" removes
    std::string standard_input;            ///< a file to read from instead of nothing
    std::string standard_output;           ///< a file to write to instead, such as /dev/full
    std::string standard_error;            ///< the same
    std::int64_t largest_file_bytes = -1;  ///< writes beyond fail as on a full disk
    int signal = 0;                        ///< sent once, as soon as `signal_when` says so
    std::function<bool()> signal_when;
    std::function<void()> meanwhile;  ///< called every few milliseconds
};

/// The defaults with another limit.
inline ProgramOptions within(double limit_s) {
    ProgramOptions options;
    options.limit_s = limit_s;
    return options;
}

ProgramRun run_program(const std::string& program, const std::vector<std::string>& arguments,
                       const ProgramOptions& options = {});

/// `scree` and `scree-view` of this build.
ProgramRun scree(const std::vector<std::string>& arguments, const ProgramOptions& options = {});
ProgramRun scree_view(const std::vector<std::string>& arguments, const ProgramOptions& options = {});

/// Is there such a program on PATH?
bool on_path(const std::string& name);

/// For failure messages.
std::string describe(const ProgramRun& run);

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kSanitized = true;  ///< resident memory says nothing
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace scree::test
