#include "tools/source/byte_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace scree {
namespace {

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

}  // namespace

Result<ByteFile> ByteFile::open(const std::string& path) {
    // Not blocking: a named pipe must not hold the program before it is known to be none.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) return unusable(path, fmt::format("cannot be opened ({})", std::strerror(errno)));
    struct stat facts {};
    if (::fstat(descriptor, &facts) != 0 || !S_ISREG(facts.st_mode)) {
        ::close(descriptor);
        return unusable(path, "not a regular file, so it cannot be read as a raster");
    }
    ByteFile file(path, descriptor, facts.st_size);
    if (file.size_ == 0) return unusable(path, "the file is empty, so there is nothing to read");
    return file;
}

ByteFile::~ByteFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

ByteFile::ByteFile(ByteFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

Result<void> ByteFile::read_at(std::int64_t offset, std::span<std::byte> out) const {
    std::size_t done = 0;
    while (done < out.size()) {
        const ssize_t read =
            ::pread(descriptor_, out.data() + done, out.size() - done, offset + static_cast<std::int64_t>(done));
        if (read < 0 && errno == EINTR) continue;
        if (read < 0) return Error{ErrorCode::input, fmt::format("reading failed: {}", std::strerror(errno))};
        if (read == 0)
            return Error{ErrorCode::input,
                         fmt::format("the file ends before byte {}", offset + static_cast<std::int64_t>(out.size()))};
        done += static_cast<std::size_t>(read);
    }
    return {};
}

Result<std::string> ByteFile::head(std::size_t bytes) const {
    std::string text(std::min(bytes, static_cast<std::size_t>(size_)), '\0');
    if (auto read = read_at(0, std::as_writable_bytes(std::span(text))); !read)
        return unusable(path_, read.error().message);
    return text;
}

Result<std::string> read_text_file(const std::string& path, std::int64_t max_bytes) {
    Result<ByteFile> file = ByteFile::open(path);
    if (!file) return file.error();
    if (file->size() > max_bytes)
        return unusable(path, fmt::format("{} bytes is too long for the short text that it should hold (at most {})",
                                          file->size(), max_bytes));
    return file->head(static_cast<std::size_t>(max_bytes));
}

}  // namespace scree
