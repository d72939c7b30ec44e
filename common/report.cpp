#include "common/report.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>

namespace scree {
namespace {

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void on_signal(int) {
    if (g_interrupted.exchange(true)) ::_exit(130);
}

}  // namespace

void guard_standard_descriptors() {
    for (int fd = 0; fd <= 2; ++fd)
        if (::fcntl(fd, F_GETFD) == -1 && errno == EBADF) (void)!::open("/dev/null", fd == 0 ? O_RDONLY : O_WRONLY);
}

int finish_output(const char* program, int code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    note("{}: cannot write to standard output\n", program);
    return code == 0 ? static_cast<int>(ErrorCode::io) : code;
}

int report_error(const char* program, const Error& error) {
    note("{}: {}\n", program, error.message);
    if (error.code == ErrorCode::display)
        note(
            "{}: shot, audit and fly --headless open no window; LIBGL_ALWAYS_SOFTWARE=1 draws without a GPU (Debian: "
            "libegl1, libgl1-mesa-dri)\n",
            program);
    return static_cast<int>(error.code);
}

Result<void> write_text(const std::string& file, const std::string& text) {
    if (file == "-") {
        if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
            return Error{ErrorCode::io, "cannot write to standard output"};
        return {};
    }
    struct stat status {};
    if (::stat(file.c_str(), &status) == 0 &&
        !S_ISREG(status.st_mode)) {  // a device or a pipe takes text, not a new name
        std::FILE* device = S_ISDIR(status.st_mode) ? nullptr : std::fopen(file.c_str(), "wb");
        const bool written = device != nullptr && std::fwrite(text.data(), 1, text.size(), device) == text.size();
        if (device == nullptr || std::fclose(device) != 0 || !written)
            return Error{ErrorCode::io, fmt::format("{}: cannot be written", file)};
        return {};
    }
    const std::string partial = file + ".partial";
    const auto failed = [&](const char* what) {
        const Error error{ErrorCode::io, fmt::format("{}: {}: {}", file, what, std::strerror(errno))};
        std::remove(partial.c_str());
        return error;
    };
    std::FILE* out = std::fopen(partial.c_str(), "wb");
    if (out == nullptr) return failed("cannot create");
    const bool written = std::fwrite(text.data(), 1, text.size(), out) == text.size();
    if (std::fclose(out) != 0 || !written) return failed("cannot write");
    if (std::rename(partial.c_str(), file.c_str()) != 0) return failed("cannot rename");
    return {};
}

std::optional<std::int64_t> parse_bytes(const std::string& text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || !std::isfinite(value) || value < 0) return std::nullopt;
    std::string suffix(end, text.data() + text.size());
    if (suffix.size() == 3 && suffix.substr(1) == "iB") suffix.resize(1);
    if (suffix.size() == 2 && suffix[1] == 'B') suffix.resize(1);
    double unit = 1;
    if (suffix == "K" || suffix == "k")
        unit = 1024;
    else if (suffix == "M" || suffix == "m")
        unit = 1024.0 * 1024;
    else if (suffix == "G" || suffix == "g")
        unit = 1024.0 * 1024 * 1024;
    else if (!suffix.empty())
        return std::nullopt;
    if (value * unit > 1e15) return std::nullopt;
    return static_cast<std::int64_t>(value * unit);
}

std::optional<std::pair<int, int>> parse_size(const std::string& text) {
    int width = 0, height = 0;
    const char* last = text.data() + text.size();
    const auto first = std::from_chars(text.data(), last, width);
    if (first.ec != std::errc{} || first.ptr == last || *first.ptr != 'x') return std::nullopt;
    const auto second = std::from_chars(first.ptr + 1, last, height);
    if (second.ec != std::errc{} || second.ptr != last || width < 1 || height < 1) return std::nullopt;
    return std::pair{width, height};
}

const std::atomic<bool>& interrupt_flag() { return g_interrupted; }

void install_interrupt_handler() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigemptyset(&action.sa_mask);
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

}  // namespace scree
