#include "runtime/report/report_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "common/report.h"

namespace scree {

namespace fs = std::filesystem;

Result<ReportFolder> ReportFolder::prepare(const std::string& name, std::vector<std::string> files, bool force) {
    ReportFolder folder;
    folder.files_ = std::move(files);
    folder.path_ = fs::absolute(name).lexically_normal();
    if (folder.path_.filename().empty()) folder.path_ = folder.path_.parent_path();
    std::error_code failed;
    const fs::file_status there = fs::symlink_status(folder.path_, failed);
    if (!fs::exists(there)) return folder;
    if (!fs::is_directory(there))
        return Error{ErrorCode::usage, fmt::format("--report {}: is there, and no folder", name)};
    fs::directory_iterator entries(folder.path_, failed);
    if (failed) return Error{ErrorCode::io, fmt::format("--report {}: {}", name, failed.message())};
    for (; !failed && entries != fs::directory_iterator(); entries.increment(failed)) {
        const std::string file = entries->path().filename().string();
        // Nothing but an earlier report is ever removed.
        if (std::find(folder.files_.begin(), folder.files_.end(), file) == folder.files_.end())
            return Error{ErrorCode::usage,
                         fmt::format("--report {}: has {}, which is of no report; name another folder", name, file)};
        if (!force) return Error{ErrorCode::usage, fmt::format("--report {}: is not empty; --force replaces it", name)};
    }
    return folder;
}

Result<void> ReportFolder::write(const std::vector<ReportFile>& report) const {
    const fs::path partial = sibling("partial"), old = sibling("old");
    if (auto ok = fill(partial, report); !ok) {
        discard(partial);
        return ok;
    }
    std::error_code failed, none;
    const bool replaced = fs::exists(path_, none);
    if (replaced) fs::rename(path_, old, failed);
    if (!failed) {
        fs::rename(partial, path_, failed);
        if (failed && replaced) fs::rename(old, path_, none);
    }
    if (failed) {
        discard(partial);
        return Error{ErrorCode::io, fmt::format("{}: {}", path_.string(), failed.message())};
    }
    if (replaced) discard(old);
    return {};
}

fs::path ReportFolder::sibling(const char* what) const {
    return path_.parent_path() / fmt::format("{}.{}.{}", path_.filename().string(), getpid(), what);
}

Result<void> ReportFolder::fill(const fs::path& folder, const std::vector<ReportFile>& report) const {
    std::error_code failed;
    fs::create_directory(folder, failed);
    if (failed) return Error{ErrorCode::io, fmt::format("{}: {}", folder.string(), failed.message())};
    for (const ReportFile& file : report)
        if (auto ok = write_text((folder / file.name).string(), file.text); !ok) return ok;
    return {};
}

// File by file: whatever else somebody has put there meanwhile stays.
void ReportFolder::discard(const fs::path& folder) const {
    std::error_code ignored;
    for (const std::string& file : files_) fs::remove(folder / file, ignored);
    fs::remove(folder, ignored);
}

}  // namespace scree
