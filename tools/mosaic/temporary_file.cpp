#include "tools/mosaic/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace scree {
namespace {

Error io_error(const std::string& path, const char* what) {
    return {ErrorCode::io, fmt::format("{}: {} the temporary raster: {}", path, what, std::strerror(errno))};
}

}  // namespace

TemporaryFile::TemporaryFile(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
TemporaryFile::~TemporaryFile() { ::close(descriptor_); }

Result<std::unique_ptr<TemporaryFile>> TemporaryFile::create(const std::string& path) {
    std::string name = path + ".XXXXXX";
    const int descriptor = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor < 0) return io_error(path, "cannot create");
    ::unlink(name.c_str());
    return std::unique_ptr<TemporaryFile>(new TemporaryFile(descriptor, path));
}

Result<void> TemporaryFile::write(std::int64_t at, std::span<const std::byte> bytes) const {
    while (!bytes.empty()) {
        const ssize_t n = ::pwrite(descriptor_, bytes.data(), bytes.size(), at);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path_, "cannot write");
        at += n;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return {};
}

Result<void> TemporaryFile::read(std::int64_t at, std::span<std::byte> bytes) const {
    while (!bytes.empty()) {
        const ssize_t n = ::pread(descriptor_, bytes.data(), bytes.size(), at);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return io_error(path_, "cannot read");
        if (n == 0) {
            std::memset(bytes.data(), 0, bytes.size());
            return {};
        }
        at += n;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return {};
}

void TemporaryFile::forget(std::int64_t at, std::int64_t bytes) const {
    (void)::fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, at, bytes);
}

std::int64_t TemporaryFile::bytes_taken() const {
    struct stat status {};
    constexpr std::int64_t kBlockBytes = 512;  // stat(2)
    return ::fstat(descriptor_, &status) == 0 ? status.st_blocks * kBlockBytes : 0;
}

}  // namespace scree
