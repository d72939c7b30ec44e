// A file read by offset: what the readers of the DEM formats stand on. Thread-safe but for moving.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/result.h"

namespace scree {

class ByteFile {
public:
    /// Errors: ErrorCode::input, naming the file: missing, not a regular file, empty, unreadable.
    static Result<ByteFile> open(const std::string& path);
    ~ByteFile();
    ByteFile(ByteFile&& other) noexcept;
    ByteFile& operator=(ByteFile&&) = delete;

    const std::string& path() const { return path_; }
    std::int64_t size() const { return size_; }
    /// Exactly out.size() bytes from offset. An Error holds the bare reason, for the caller to add file and place.
    Result<void> read_at(std::int64_t offset, std::span<std::byte> out) const;
    /// At most `bytes` from the start.
    Result<std::string> head(std::size_t bytes) const;

private:
    ByteFile(std::string path, int descriptor, std::int64_t size)
        : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

    std::string path_;
    int descriptor_ = -1;
    std::int64_t size_ = 0;
};

/// The whole of a small text file (a sidecar). Errors: ErrorCode::input where it is larger than max_bytes or
/// unreadable.
Result<std::string> read_text_file(const std::string& path, std::int64_t max_bytes);

}  // namespace scree
