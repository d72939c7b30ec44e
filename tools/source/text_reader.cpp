#include "tools/source/text_reader.h"

#include <fmt/format.h>

#include <cstring>
#include <span>

namespace scree {

void TextReader::seek(std::int64_t offset) {
    const std::int64_t buffered = next_ - static_cast<std::int64_t>(end_);
    if (offset >= buffered && offset <= next_) {
        at_ = static_cast<std::size_t>(offset - buffered);
        return;
    }
    at_ = end_ = 0;
    next_ = std::min(offset, file_->size());
}

Result<std::string_view> TextReader::take(std::size_t bytes) {
    if (end_ - at_ < bytes)
        if (auto filled = refill(); !filled) return filled.error();
    const std::string_view taken = buffered().substr(0, bytes);
    skip(taken.size());
    return taken;
}

Result<std::string_view> TextReader::take_run() {
    Result<std::string_view> run = find_run();
    if (run) skip(run->size());
    return run;
}

Result<std::string_view> TextReader::find_run(bool* new_line) {
    while (true) {
        for (; at_ < end_ && is_text_space(buffer_[at_]); ++at_)
            if (new_line != nullptr && (buffer_[at_] == '\n' || buffer_[at_] == '\r')) *new_line = true;
        std::size_t stop = at_;
        while (stop < end_ && !is_text_space(buffer_[stop])) ++stop;
        if (stop - at_ > longest_run_)
            return Error{ErrorCode::input, fmt::format("'{}...' is no number", buffered().substr(0, 20))};
        if (stop < end_ || next_ == file_->size()) return buffered().substr(0, stop - at_);
        if (auto filled = refill(); !filled) return filled.error();
    }
}

Result<void> TextReader::refill() {
    std::memmove(buffer_.data(), buffer_.data() + at_, end_ - at_);
    end_ -= at_;
    at_ = 0;
    const auto bytes = static_cast<std::size_t>(
        std::min<std::int64_t>(file_->size() - next_, static_cast<std::int64_t>(buffer_.size() - end_)));
    if (auto read = file_->read_at(next_, std::as_writable_bytes(std::span(buffer_.data() + end_, bytes))); !read)
        return read;
    end_ += bytes;
    next_ += static_cast<std::int64_t>(bytes);
    return {};
}

}  // namespace scree
