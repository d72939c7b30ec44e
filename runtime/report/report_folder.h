// A report as a folder that appears whole under its name or not at all. Any thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

struct ReportFile {
    std::string name;
    std::string text;
};

/// What the reports of a flight and of an audit consist of.
inline const std::vector<std::string> kFlightReport{"index.html", "flight.csv", "flight.json"};
inline const std::vector<std::string> kAuditReport{"index.html", "audit.json"};

class ReportFolder {
public:
    /// `files`: what a report of this kind is made of; nothing else is ever removed. `force`: an earlier report is
    /// replaced. Touches nothing yet: ask before anything is measured. Errors: ErrorCode::usage where there is
    /// something that must not be replaced; ErrorCode::io.
    static Result<ReportFolder> prepare(const std::string& name, std::vector<std::string> files, bool force);

    /// All of the report; its names are among `files`. Errors: ErrorCode::io names the file.
    Result<void> write(const std::vector<ReportFile>& report) const;

private:
    std::filesystem::path sibling(const char* what) const;
    Result<void> fill(const std::filesystem::path& folder, const std::vector<ReportFile>& report) const;
    void discard(const std::filesystem::path& folder) const;

    std::filesystem::path path_;
    std::vector<std::string> files_;
};

}  // namespace scree
