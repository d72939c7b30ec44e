// The file that grows under OUT.partial: locked, so that two runs with one output cannot meet in it, and removed unless
// it is given its final name or is to be gone on with. Outputs are whole or absent. Where it is a SQLite file its
// rollback journal, OUT.partial-journal, belongs to it.
#pragma once

#include <memory>
#include <string>

#include "common/result.h"

namespace scree {

class PartialFile {
public:
    /// Creates it, or empties an abandoned one. Errors: ErrorCode::usage when another run holds it, ErrorCode::io.
    static Result<std::unique_ptr<PartialFile>> create(const std::string& path);
    /// Creates it, or takes up what an abandoned one holds. Errors: as create.
    static Result<std::unique_ptr<PartialFile>> open_or_create(const std::string& path);
    ~PartialFile();
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    const std::string& path() const { return path_; }
    int descriptor() const { return fd_; }  ///< open for reading and writing
    /// The file stays when this object goes, for a later run.
    void keep() { kept_ = true; }
    /// Empties it, for a run that cannot use what it holds. Errors: ErrorCode::io.
    Result<void> empty();
    /// Replaces `final_path`, durably. Errors: ErrorCode::io, also where a journal says that the file is not complete.
    Result<void> rename_to(const std::string& final_path);

private:
    PartialFile(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
    static Result<std::unique_ptr<PartialFile>> lock(const std::string& path);
    std::string path_;
    int fd_;
    bool kept_ = false;
};

}  // namespace scree
