// The file that grows under OUT.partial: locked, so that two runs with one output cannot meet in it, and removed unless
// it is given its final name. Outputs are whole or absent.
#pragma once

#include <memory>
#include <string>

#include "common/result.h"

namespace scree {

class PartialFile {
public:
    /// Creates it, or empties an abandoned one. Errors: ErrorCode::usage when another run holds it, ErrorCode::io.
    static Result<std::unique_ptr<PartialFile>> create(const std::string& path);
    static Result<std::unique_ptr<PartialFile>> open_or_create(const std::string& path);
    void keep();
    ~PartialFile();
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    const std::string& path() const { return path_; }
    int descriptor() const { return fd_; }  ///< open for reading and writing
    /// Replaces `final_path`, durably. Errors: ErrorCode::io.
    Result<void> rename_to(const std::string& final_path);

private:
    PartialFile(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
    std::string path_;
    int fd_;
    bool kept_ = false;
};

}  // namespace scree
