// What every command does alike: JSON reports, exit codes, interruption, sizes on the command line.
#pragma once

#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

#include "common/result.h"

namespace scree {

/// Text for people on standard error; one that cannot be written (a closed or full target) is lost, nothing else.
template <class... Args>
void note(fmt::format_string<Args...> text, Args&&... args) {
    const std::string line = fmt::format(text, std::forward<Args>(args)...);
    (void)!std::fwrite(line.data(), 1, line.size(), stderr);
}

/// At the start of a program: descriptors 0 to 2 that are closed are opened on /dev/null, lest a file of ours takes
/// their number and messages end up in it.
void guard_standard_descriptors();

/// At the end of a program: its exit code, or 5 when standard output did not take all that was written to it.
int finish_output(const char* program, int code);

/// Prints the error on stderr and returns its exit code.
int report_error(const char* program, const Error& error);

/// Writes `text` to FILE whole or not at all (temporary name, rename); "-" is standard output.
Result<void> write_text(const std::string& file, const std::string& text);

/// "256M", "1.5G", "65536": bytes with an optional binary suffix K, M, G. Nullopt for anything else.
std::optional<std::int64_t> parse_bytes(const std::string& text);

/// "800x600" to two positive integers.
std::optional<std::pair<int, int>> parse_size(const std::string& text);

/// Set by SIGINT and SIGTERM once install_interrupt_handler() was called; a second signal ends the process at once.
const std::atomic<bool>& interrupt_flag();
void install_interrupt_handler();

}  // namespace scree
