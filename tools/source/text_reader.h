// A text file read through one buffer, by runs of what is not space and by fields of fixed width. Errors hold the bare
// reason, as ByteFile's do. For one thread.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "tools/source/byte_file.h"

namespace scree {

/// End-of-file marks of old systems count as space.
constexpr bool is_text_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0' || c == '\x1A'; }

class TextReader {
public:
    static constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

    /// The file must outlive it. A run of more than `longest_run` bytes (at most a quarter of the buffer) is an error.
    TextReader(const ByteFile& file, std::size_t longest_run)
        : file_(&file), buffer_(kBufferBytes), longest_run_(std::min(longest_run, kBufferBytes / 4)) {}

    void seek(std::int64_t offset);
    std::int64_t offset() const { return next_ - static_cast<std::int64_t>(end_ - at_); }

    /// The next `bytes`, fewer at the end of the file. Valid until the next call.
    Result<std::string_view> take(std::size_t bytes);
    /// What stands between space and space; empty at the end of the file. Valid until the next call.
    Result<std::string_view> take_run();
    /// The same, and it stays to be read: buffered() begins with it. `new_line`: set where a line ended before it.
    Result<std::string_view> find_run(bool* new_line = nullptr);

    std::string_view buffered() const { return {buffer_.data() + at_, end_ - at_}; }
    /// No more than is buffered.
    void skip(std::size_t bytes) { at_ += bytes; }

private:
    Result<void> refill();

    const ByteFile* file_;
    std::vector<char> buffer_;
    std::size_t longest_run_;
    std::size_t at_ = 0, end_ = 0;  ///< what of the buffer is still to be read
    std::int64_t next_ = 0;         ///< offset of the byte after the buffer
};

}  // namespace scree
