#include "tools/partial_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace scree {

Result<std::unique_ptr<PartialFile>> PartialFile::create(const std::string& path) {
    auto file = open_or_create(path);
    if (file && ::ftruncate((*file)->fd_, 0) != 0)
        return Error{ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno))};
    return file;
}

void PartialFile::keep() { kept_ = true; }

Result<std::unique_ptr<PartialFile>> PartialFile::open_or_create(const std::string& path) {
    for (;;) {
        const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
        if (fd < 0) return Error{ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno))};
        std::unique_ptr<PartialFile> file(new PartialFile(path, fd));
        if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
            file->kept_ = true;
            return Error{ErrorCode::usage, fmt::format("{}: another run is writing it", path)};
        }
        // The file may have been renamed or removed between opening and locking.
        struct stat held {
        }, named{};
        if (::fstat(fd, &held) == 0 && ::stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino) {
            return file;
        }
        file->kept_ = true;
    }
}

PartialFile::~PartialFile() {
    if (!kept_) std::remove(path_.c_str());
    ::close(fd_);
}

Result<void> PartialFile::rename_to(const std::string& final_path) {
    if (std::rename(path_.c_str(), final_path.c_str()) != 0)
        return Error{ErrorCode::io,
                     fmt::format("{}: cannot rename to {}: {}", path_, final_path, std::strerror(errno))};
    kept_ = true;
    std::error_code ignored;
    const std::string folder = std::filesystem::absolute(final_path, ignored).parent_path().string();
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        ::fsync(fd);  // makes the new name durable; a file system that cannot is no reason to fail
        ::close(fd);
    }
    return {};
}

}  // namespace scree
