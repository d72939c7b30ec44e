// A file without a name: it vanishes with the process, and takes room only where something was written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/result.h"

namespace scree {

/// read(): any thread, beside write() elsewhere in the file too. Errors: ErrorCode::io.
class TemporaryFile {
public:
    /// `path`: what its name begins with, for the moment that it has one.
    static Result<std::unique_ptr<TemporaryFile>> create(const std::string& path);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    Result<void> write(std::int64_t at, std::span<const std::byte> bytes) const;
    /// Zeros where nothing was written.
    Result<void> read(std::int64_t at, std::span<std::byte> bytes) const;
    /// Gives the room back where the file system can; what is there is lost or not.
    void forget(std::int64_t at, std::int64_t bytes) const;
    /// Room that it takes now.
    std::int64_t bytes_taken() const;

private:
    TemporaryFile(int descriptor, std::string path);
    int descriptor_;
    std::string path_;
};

}  // namespace scree
