#include "tools/cli/synth_command.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <string>

#include <unistd.h>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/source/synth.h"

namespace scree {
namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

extern "C" void request_stop(int) { stop_requested.store(true, std::memory_order_relaxed); }

// One line on a terminal, rewritten; plain lines, a tenth at a time, elsewhere.
class ProgressText {
public:
    void operator()(const SynthProgress& progress) {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
        const double share = static_cast<double>(progress.pixels_done) / static_cast<double>(progress.pixels_total);
        const int tenth = static_cast<int>(share * 10);
        if (!terminal_ && tenth == last_tenth_) return;
        last_tenth_ = tenth;
        const double rate = seconds > 0 ? static_cast<double>(progress.pixels_done) / seconds / 1e6 : 0;
        const double left_s = share > 0 ? seconds * (1 - share) / share : 0;
        fmt::print(stderr, "{}{:<5} {:3.0f} %  {:6.1f} Mpixel/s  {:.0f} s left{}", terminal_ ? "\r" : "",
                   progress.phase, share * 100, rate, left_s, terminal_ ? "   " : "\n");
        std::fflush(stderr);
    }
    void end_line() const {
        if (terminal_) fmt::print(stderr, "\n");
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    bool terminal_ = ::isatty(STDERR_FILENO) == 1;
    int last_tenth_ = -1;
};

bool write_json(const SynthOptions& options, const SynthReport& report, const std::string& target) {
    nlohmann::ordered_json json;
    json["command"] = "synth";
    json["dem"] = {{"path", report.dem_path},     {"samples", report.dem_samples}, {"spacing_m", options.spacing_m},
                   {"lowest_m", report.lowest_m}, {"highest_m", report.highest_m}, {"seconds", report.dem_seconds}};
    if (!report.ortho_path.empty())
        json["ortho"] = {
            {"path", report.ortho_path}, {"pixels", report.ortho_pixels}, {"seconds", report.ortho_seconds}};
    json["seed"] = options.seed;
    json["bytes"] = report.bytes;
    const std::string text = json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    std::FILE* file = target == "-" ? stdout : std::fopen(target.c_str(), "wb");
    if (file == nullptr) return false;
    const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    const bool flushed = target == "-" ? std::fflush(file) == 0 : std::fclose(file) == 0;
    return written && flushed;
}

}  // namespace

int run_synth(int argc, char** argv) {
    SynthOptions options;
    bool quiet = false;
    std::string json_target;
    CLI::App app("Makes a mountain landscape to try things on: DIR/dem.tif (float32 heights) and DIR/ortho.tif (RGB).",
                 argv[0]);
    app.add_option("-o,--output", options.directory, "Directory for dem.tif and ortho.tif; made when missing")
        ->required()
        ->type_name("DIR");
    app.add_option("--size", options.size, "Height samples a side, 3 to 1048576; time and bytes grow with its square")
        ->capture_default_str();
    app.add_option("--spacing", options.spacing_m,
                   "Metres between samples; less is a closer look at less of the same land")
        ->capture_default_str();
    app.add_option("--seed", options.seed, "Another number, another landscape")->capture_default_str();
    app.add_option("--imagery-scale", options.imagery_scale, "Image pixels per cell side, 0 to 64; 0 makes no image")
        ->capture_default_str();
    app.add_option("--threads", options.threads, "Threads; 0 is all cores. The bytes made do not depend on it")
        ->capture_default_str();
    app.add_flag("--force", options.force, "Replace dem.tif and ortho.tif when they exist");
    app.add_flag("--quiet", quiet, "No progress on standard error");
    app.add_option("--json", json_target, "Write a report there; - is standard output")->type_name("FILE|-");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& problem) {
        return app.exit(problem) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }

    std::signal(SIGINT, request_stop);
    std::signal(SIGTERM, request_stop);
    options.stop = &stop_requested;
    ProgressText text;
    const Result<SynthReport> report = synthesize(
        options, quiet ? ProgressSink{} : [&text](const SynthProgress& p) { text(p); });
    if (!quiet) text.end_line();
    if (!report) {
        fmt::print(stderr, "{}: {}\n", argv[0], report.error().message);
        return static_cast<int>(report.error().code);
    }
    if (!quiet) {
        fmt::print(stderr, "{}: {} x {} samples, {:.0f} to {:.0f} m, {:.1f} s\n", report->dem_path, report->dem_samples,
                   report->dem_samples, report->lowest_m, report->highest_m, report->dem_seconds);
        if (!report->ortho_path.empty())
            fmt::print(stderr, "{}: {} x {} pixels, {:.1f} s\n", report->ortho_path, report->ortho_pixels,
                       report->ortho_pixels, report->ortho_seconds);
    }
    if (!json_target.empty() && !write_json(options, *report, json_target)) {
        fmt::print(stderr, "{}: {}: the report cannot be written\n", argv[0], json_target);
        return static_cast<int>(ErrorCode::io);
    }
    return 0;
}

}  // namespace scree
