#include "tools/verify/verify_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "tools/verify/verify.h"

namespace scree {
namespace {

// Whole percents on stderr: one line rewritten on a terminal, a line every ten percent elsewhere.
class ProgressLine {
public:
    void show(double fraction) {
        const int percent = static_cast<int>(fraction * 100);
        if (percent < shown_ + (terminal_ ? 1 : 10) && !(percent == 100 && shown_ < 100)) return;
        shown_ = percent;
        if (terminal_)
            note("\rverify: {:3} %{}", percent, percent < 100 ? "" : "\n");
        else
            note("verify: {:3} %\n", percent);
    }

private:
    bool terminal_ = ::isatty(STDERR_FILENO) != 0;
    int shown_ = -1;
};

std::string to_json(const VerifyReport& report) {
    nlohmann::ordered_json json = {{"tiles_checked", report.tiles_checked},
                                   {"shared_samples_compared", report.shared_samples_compared},
                                   {"shared_samples_differing", report.shared_samples_differing},
                                   {"bounds_checked", report.bounds_checked},
                                   {"bound_violations", report.bound_violations},

                                   {"lon_lat_note", report.lon_lat.reason},
                                   {"problems", report.problems}};
    if (report.lon_lat.error_m) json["lon_lat_error_m"] = *report.lon_lat.error_m;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void print_summary(std::FILE* out, const std::string& path, const VerifyReport& report) {
    for (const std::string& problem : report.problems) fmt::print(out, "problem: {}\n", problem);
    fmt::print(out, "{}: {}\n", path, report.sound() ? "sound" : "NOT sound");
    fmt::print(out, "  tiles checked      {}\n", report.tiles_checked);
    fmt::print(out, "  shared samples     {} compared, {} differ\n", report.shared_samples_compared,
               report.shared_samples_differing);
    fmt::print(out, "  certified errors   {} checked, {} below the truth\n", report.bounds_checked,
               report.bound_violations);
    const auto& [error_m, reason, broken] = report.lon_lat;
    if (error_m)
        fmt::print(out, "  longitudes         off by {:.4f} m at most{}{}\n", *error_m, reason.empty() ? "" : "; ",
                   reason);
    else
        fmt::print(out, "  longitudes         not checked: {}\n", reason);
}

}  // namespace

int run_verify(int argc, char** argv) {
    std::string path, json_path;
    bool quiet = false;
    CLI::App app(
        "Checks everything that a store promises: pages, rows, shared samples, certified errors, transparency.",
        "scree verify");
    app.add_option("STORE", path, "the .scree file")->required();
    add_json_option(app, json_path);
    app.add_flag("--quiet", quiet, "no progress on standard error");
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;

    install_interrupt_handler();
    ProgressLine line;
    VerifyOptions options;
    options.stop = &interrupt_flag();
    if (!quiet) options.progress = [&line](double fraction) { line.show(fraction); };
    const auto report = verify_store(path, options);
    if (!report) return report_error("scree verify", report.error());
    print_summary(json_path == "-" ? stderr : stdout, path, *report);
    if (!json_path.empty())
        if (auto ok = write_text(json_path, to_json(*report)); !ok) return report_error("scree verify", ok.error());
    if (std::fflush(stdout) != 0) return static_cast<int>(ErrorCode::io);
    return report->sound() ? 0 : static_cast<int>(ErrorCode::check_failed);
}

}  // namespace scree
