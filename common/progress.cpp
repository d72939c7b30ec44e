#include "common/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "common/report.h"

namespace scree {
namespace {
constexpr std::chrono::milliseconds kTerminalInterval{200};
constexpr std::chrono::milliseconds kPlainInterval{2000};
}  // namespace

Progress::Progress(std::string job, std::string unit, bool quiet)
    : job_(std::move(job)),
      unit_(std::move(unit)),
      quiet_(quiet),
      terminal_(::isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()),
      last_(start_) {}

Progress::~Progress() {
    if (printed_ && terminal_) std::fputc('\n', stderr);
}

void Progress::update(double done) {
    done_ = done;
    if (quiet_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < (terminal_ ? kTerminalInterval : kPlainInterval)) return;
    last_ = now;
    print(done, false);
}

void Progress::finish() {
    if (quiet_) return;
    print(total_, true);
    if (terminal_) std::fputc('\n', stderr);
    printed_ = false;
}

void Progress::print(double done, bool last) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const double share = std::clamp(total_ > 0 ? done / total_ : 1.0, 0.0, 1.0);
    const double rate = seconds > 0 ? done / seconds : 0;
    const double left = share > 0 ? seconds * (1 - share) / share : 0;
    std::string line = fmt::format("{}: {:3.0f} %  {:.1f} {}/s", job_, 100 * share, rate, unit_);
    line += last ? fmt::format("  {:.1f} s", seconds) : fmt::format("  {:.0f} s left", left);
    if (terminal_)
        note("\r{:<72}", line);
    else
        note("{}\n", line);
    std::fflush(stderr);
    printed_ = true;
}

}  // namespace scree
