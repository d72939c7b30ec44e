#include "tools/pyramid/height_spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace scree {
namespace {

constexpr std::int64_t kReadChunkBytes = 1 << 20;

std::int64_t bytes_of_row(std::int64_t width, bool wide) { return width * (wide ? 8 : 4) + (width + 7) / 8; }

Error io_error(const std::string& path, const char* what) {
    return {ErrorCode::io, fmt::format("{}: {} the temporary height file: {}", path, what, std::strerror(errno))};
}

Result<void> write_at(int fd, const std::string& path, const std::uint8_t* data, std::int64_t size,
                      std::int64_t offset) {
    while (size > 0) {
        const ssize_t n = ::pwrite(fd, data, static_cast<std::size_t>(size), offset);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path, "cannot write");
        data += n;
        size -= n;
        offset += n;
    }
    return {};
}

Result<void> read_at(int fd, const std::string& path, std::uint8_t* data, std::int64_t size, std::int64_t offset) {
    std::int64_t done = 0;
    while (done < size) {
        errno = 0;
        const ssize_t n = ::pread(fd, data + done, static_cast<std::size_t>(size - done), offset + done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path, "cannot read");
        done += n;
    }
    return {};
}

// Linear between the nearest valid neighbours of the row, constant outside them. False: no valid sample.
bool fill_row(std::vector<double>& row) {
    const std::size_t width = row.size();
    std::size_t i = 0;
    std::ptrdiff_t last_valid = -1;
    while (i < width) {
        if (!std::isnan(row[i])) {
            last_valid = static_cast<std::ptrdiff_t>(i++);
            continue;
        }
        std::size_t next = i;
        while (next < width && std::isnan(row[next])) ++next;
        if (last_valid < 0 && next == width) return false;
        if (last_valid < 0) {
            for (; i < next; ++i) row[i] = row[next];
        } else if (next == width) {
            for (; i < width; ++i) row[i] = row[static_cast<std::size_t>(last_valid)];
        } else {
            const auto from = static_cast<std::size_t>(last_valid);
            const double a = row[from], b = row[next], span = static_cast<double>(next - from);
            for (; i < next; ++i) row[i] = a + (b - a) * (static_cast<double>(i - from) / span);
        }
    }
    return true;
}

}  // namespace

HeightSpool::Descriptor::~Descriptor() { ::close(fd); }

HeightSpool::HeightSpool(int fd, std::string path, std::int64_t width, std::int64_t height, bool wide)
    : file_{fd},
      path_(std::move(path)),
      width_(width),
      height_(height),
      wide_(wide),
      row_bytes_(bytes_of_row(width, wide)) {
    record_.resize(static_cast<std::size_t>(row_bytes_));
}

std::int64_t HeightSpool::bytes_needed(std::int64_t width, std::int64_t height, bool wide) {
    return height * bytes_of_row(width, wide);
}

Result<std::unique_ptr<HeightSpool>> HeightSpool::create(const std::string& path, std::int64_t width,
                                                         std::int64_t height, bool wide) {
    std::string name = path + ".XXXXXX";
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return io_error(path, "cannot create");
    ::unlink(name.c_str());
    return std::unique_ptr<HeightSpool>(new HeightSpool(fd, path, width, height, wide));
}

Result<void> HeightSpool::write_row(std::int64_t j, bool all_void) {
    const std::size_t value_bytes = wide_ ? 8 : 4;
    for (std::size_t i = 0; i < filled_.size(); ++i) {
        if (wide_) {
            std::memcpy(record_.data() + i * 8, &filled_[i], 8);
        } else {
            const float v = static_cast<float>(filled_[i]);
            std::memcpy(record_.data() + i * 4, &v, 4);
        }
    }
    if (all_void)
        std::fill(record_.begin() + width_ * static_cast<std::int64_t>(value_bytes), record_.end(), std::uint8_t{0});
    return write_at(file_.fd, path_, record_.data(), row_bytes_, j * row_bytes_);
}

Result<void> HeightSpool::append(std::span<const double> row) {
    assert(static_cast<std::int64_t>(row.size()) == width_ && rows_ < height_);
    std::vector<double> candidate(row.begin(), row.end());
    const bool any = fill_row(candidate);
    if (!any) {
        if (summary_.valid_samples == 0) {
            ++leading_void_rows_;
            ++rows_;
            return {};
        }
        return write_row(rows_++, true);  // repeats filled_
    }
    filled_ = std::move(candidate);
    std::uint8_t* bits = record_.data() + width_ * (wide_ ? 8 : 4);
    if (leading_void_rows_ > 0 && summary_.valid_samples == 0)
        for (std::int64_t j = 0; j < leading_void_rows_; ++j)
            if (auto ok = write_row(j, true); !ok) return ok;
    std::fill(bits, record_.data() + row_bytes_, std::uint8_t{0});
    for (std::size_t i = 0; i < row.size(); ++i) {
        const double v = row[i];
        if (std::isnan(v)) continue;
        bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | (1u << (i % 8)));
        if (summary_.valid_samples == 0) summary_.min_raw = summary_.max_raw = v;
        summary_.min_raw = std::min(summary_.min_raw, v);
        summary_.max_raw = std::max(summary_.max_raw, v);
        ++summary_.valid_samples;
    }
    return write_row(rows_++, false);
}

Result<HeightSpool::Summary> HeightSpool::finish() {
    assert(rows_ == height_);
    if (summary_.valid_samples == 0)
        return Error{ErrorCode::input, "every height is a void: there is nothing to build"};
    return summary_;
}

Result<const std::uint8_t*> HeightSpool::row_bytes(std::int64_t j) {
    if (j < chunk_first_ || j >= chunk_first_ + chunk_rows_) {
        chunk_first_ = j;
        chunk_rows_ = std::clamp<std::int64_t>(kReadChunkBytes / row_bytes_, 1, height_ - j);
        chunk_.resize(static_cast<std::size_t>(chunk_rows_ * row_bytes_));
        if (auto ok = read_at(file_.fd, path_, chunk_.data(), chunk_rows_ * row_bytes_, chunk_first_ * row_bytes_); !ok)
            return ok.error();
    }
    return static_cast<const std::uint8_t*>(chunk_.data() + (j - chunk_first_) * row_bytes_);
}

Result<void> HeightSpool::read_row(std::int64_t j, std::span<double> values, std::span<std::uint8_t> valid) {
    assert(j >= 0 && j < height_ && static_cast<std::int64_t>(values.size()) >= width_);
    auto bytes = row_bytes(j);
    if (!bytes) return bytes.error();
    for (std::int64_t i = 0; i < width_; ++i) {
        if (wide_) {
            std::memcpy(&values[static_cast<std::size_t>(i)], *bytes + i * 8, 8);
        } else {
            float v = 0;
            std::memcpy(&v, *bytes + i * 4, 4);
            values[static_cast<std::size_t>(i)] = v;
        }
    }
    return read_valid(j, valid);
}

Result<void> HeightSpool::read_window(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                      std::span<double> values, std::span<std::uint8_t> valid) const {
    assert(i >= 0 && j >= 0 && i + columns <= width_ && j + rows <= height_);
    const std::int64_t value_bytes = wide_ ? 8 : 4, bits_at = width_ * value_bytes;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(columns * value_bytes)),
        bits(static_cast<std::size_t>(columns / 8 + 2));
    for (std::int64_t r = 0; r < rows; ++r) {
        const std::int64_t at = (j + r) * row_bytes_, first_bit = i / 8, end_bit = (i + columns + 7) / 8;
        if (auto ok = read_at(file_.fd, path_, bytes.data(), columns * value_bytes, at + i * value_bytes); !ok)
            return ok;
        if (auto ok = read_at(file_.fd, path_, bits.data(), end_bit - first_bit, at + bits_at + first_bit); !ok)
            return ok;
        for (std::int64_t c = 0; c < columns; ++c) {
            const auto k = static_cast<std::size_t>(r * columns + c);
            if (wide_) {
                std::memcpy(&values[k], bytes.data() + c * 8, 8);
            } else {
                float v = 0;
                std::memcpy(&v, bytes.data() + c * 4, 4);
                values[k] = v;
            }
            const std::int64_t bit = i + c - first_bit * 8;
            valid[k] = (bits[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1;
        }
    }
    return {};
}

Result<void> HeightSpool::read_valid(std::int64_t j, std::span<std::uint8_t> valid) {
    auto bytes = row_bytes(j);
    if (!bytes) return bytes.error();
    const std::uint8_t* bits = *bytes + width_ * (wide_ ? 8 : 4);
    for (std::int64_t i = 0; i < width_; ++i) valid[static_cast<std::size_t>(i)] = (bits[i / 8] >> (i % 8)) & 1;
    return {};
}

}  // namespace scree
