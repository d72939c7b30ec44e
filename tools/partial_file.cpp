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

namespace {

Error system_error(const std::string& path) {
    return {ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno))};
}

std::string journal_of(const std::string& path) { return path + "-journal"; }

bool exists(const std::string& path) {
    struct stat status {};
    return ::lstat(path.c_str(), &status) == 0;
}

Result<void> remove_if_there(const std::string& path) {
    if (::unlink(path.c_str()) != 0 && errno != ENOENT) return system_error(path);
    return {};
}

void sync_folder_of(const std::string& path) {
    std::error_code ignored;
    const std::string folder = std::filesystem::absolute(path, ignored).parent_path().string();
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    ::fsync(fd);  // a file system that cannot is no reason to fail
    ::close(fd);
}

// An update of the file that is to be replaced was cut off: its journal would be played into the new one. Without the
// journal the old file is worth nothing, so it goes first.
Result<void> remove_with_journal(const std::string& path) {
    if (!exists(journal_of(path))) return {};
    if (auto ok = remove_if_there(path); !ok) return ok;
    sync_folder_of(path);
    if (auto ok = remove_if_there(journal_of(path)); !ok) return ok;
    sync_folder_of(path);
    return {};
}

}  // namespace

Result<std::unique_ptr<PartialFile>> PartialFile::lock(const std::string& path) {
    for (;;) {
        const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
        if (fd < 0) return system_error(path);
        std::unique_ptr<PartialFile> file(new PartialFile(path, fd));
        file->kept_ = true;  // it is not ours yet
        if (::flock(fd, LOCK_EX | LOCK_NB) != 0)
            return Error{ErrorCode::usage, fmt::format("{}: another run is writing it", path)};
        // The file may have been renamed or removed between opening and locking.
        struct stat held {
        }, named{};
        if (::fstat(fd, &held) == 0 && ::stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino) {
            file->kept_ = false;
            return file;
        }
    }
}

Result<std::unique_ptr<PartialFile>> PartialFile::create(const std::string& path) {
    auto file = lock(path);
    if (!file) return file;
    if (auto ok = (*file)->empty(); !ok) return ok.error();
    return file;
}

Result<std::unique_ptr<PartialFile>> PartialFile::open_or_create(const std::string& path) {
    auto file = lock(path);
    if (!file) return file;
    struct stat status {};
    if (::fstat((*file)->fd_, &status) != 0) return system_error(path);
    if (status.st_size == 0)  // a journal beside it is another file's
        if (auto ok = (*file)->empty(); !ok) return ok.error();
    return file;
}

PartialFile::~PartialFile() {
    if (!kept_) {
        (void)empty();  // were the journal gone and the file not, after a power loss, it would look like a whole one
        std::remove(path_.c_str());
    }
    ::close(fd_);
}

Result<void> PartialFile::empty() {
    if (::ftruncate(fd_, 0) != 0) return system_error(path_);
    if (!exists(journal_of(path_))) return {};
    // In this order on the disk, too: half a transaction whose journal has gone looks like a whole one.
    if (::fsync(fd_) != 0) return system_error(path_);
    return remove_if_there(journal_of(path_));
}

Result<void> PartialFile::rename_to(const std::string& final_path) {
    if (exists(journal_of(path_)))
        return Error{
            ErrorCode::io,
            fmt::format("{}: its journal is still there, so it is not complete: not renamed to {}", path_, final_path)};
    if (auto ok = remove_with_journal(final_path); !ok) return ok;
    if (std::rename(path_.c_str(), final_path.c_str()) != 0)
        return Error{ErrorCode::io,
                     fmt::format("{}: cannot rename to {}: {}", path_, final_path, std::strerror(errno))};
    kept_ = true;
    sync_folder_of(final_path);
    return {};
}

}  // namespace scree
