#include "tests/programs/child_program.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>

namespace scree::test {
namespace {

using Clock = std::chrono::steady_clock;

std::string contents_of(int fd) {
    std::string text;
    ::lseek(fd, 0, SEEK_SET);
    char buffer[65536];
    for (ssize_t n; (n = ::read(fd, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
    return text;
}

int open_output(const std::string& file) {
    return file.empty() ? ::memfd_create("output", MFD_CLOEXEC) : ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
}

[[noreturn]] void become(const std::string& program, std::vector<char*>& argv, const ProgramOptions& options, int out,
                         int err) {
    for (const std::string& entry : options.environment) {
        const std::size_t equals = entry.find('=');
        if (equals == std::string::npos)
            ::unsetenv(entry.c_str());
        else
            ::setenv(entry.substr(0, equals).c_str(), entry.c_str() + equals + 1, 1);
    }
    if (options.largest_file_bytes >= 0) {
        const auto bytes = static_cast<rlim_t>(options.largest_file_bytes);
        const rlimit limit{bytes, bytes};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        ::signal(SIGXFSZ, SIG_IGN);
    }
    const std::string& input = options.standard_input;
    ::dup2(::open(input.empty() ? "/dev/null" : input.c_str(), O_RDONLY | O_CLOEXEC), STDIN_FILENO);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    ::execvp(program.c_str(), argv.data());
    ::_exit(127);
}

}  // namespace

ProgramRun run_program(const std::string& program, const std::vector<std::string>& arguments,
                       const ProgramOptions& options) {
    const int out = open_output(options.standard_output), err = open_output(options.standard_error);
    if (out < 0 || err < 0) throw std::runtime_error("no place for a child's output");
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);

    const auto start = Clock::now();
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("fork");
    if (child == 0) become(program, argv, options, out, err);

    ProgramRun run;
    rusage usage{};
    int status = 0;
    for (;;) {
        const pid_t ended = ::wait4(child, &status, WNOHANG, &usage);
        if (ended == child) break;
        run.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        if (!run.signalled && options.signal != 0 && options.signal_when && options.signal_when()) {
            ::kill(child, options.signal);
            run.signalled = true;
        }
        if (options.meanwhile) options.meanwhile();
        if (run.seconds > options.limit_s && !run.timed_out) {
            ::kill(child, SIGKILL);
            run.timed_out = true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    run.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    run.peak_rss_bytes = std::int64_t{usage.ru_maxrss} * 1024;
    const auto seconds = [](timeval t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    run.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    if (options.standard_output.empty()) run.out = contents_of(out);
    if (options.standard_error.empty()) run.err = contents_of(err);
    ::close(out);
    ::close(err);
    return run;
}

ProgramRun scree(const std::vector<std::string>& arguments, const ProgramOptions& options) {
    return run_program(SCREE_PROGRAM, arguments, options);
}

ProgramRun scree_view(const std::vector<std::string>& arguments, const ProgramOptions& options) {
    return run_program(SCREE_VIEW_PROGRAM, arguments, options);
}

bool on_path(const std::string& name) {
    const char* path = std::getenv("PATH");
    const std::string folders = path == nullptr ? "" : path;
    for (std::size_t from = 0; from <= folders.size();) {
        const std::size_t to = std::min(folders.find(':', from), folders.size());
        if (to > from && ::access((folders.substr(from, to - from) + "/" + name).c_str(), X_OK) == 0) return true;
        from = to + 1;
    }
    return false;
}

std::string describe(const ProgramRun& run) {
    return "exit " + std::to_string(run.exit_code) + (run.timed_out ? " (killed: too slow)" : "") + "\n--- stdout\n" +
           run.out + "\n--- stderr\n" + run.err;
}

}  // namespace scree::test
