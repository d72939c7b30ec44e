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

std::int64_t bytes_of_sample(bool wide) { return wide ? 8 : 4; }

Error io_error(const std::string& path, const char* what) {
    return {ErrorCode::io, fmt::format("{}: {} the temporary height file: {}", path, what, std::strerror(errno))};
}

Result<void> write_at(int fd, const std::string& path, std::span<const std::uint8_t> bytes, std::int64_t offset) {
    while (!bytes.empty()) {
        const ssize_t n = ::pwrite(fd, bytes.data(), bytes.size(), offset);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path, "cannot write");
        bytes = bytes.subspan(static_cast<std::size_t>(n));
        offset += n;
    }
    return {};
}

Result<void> read_at(int fd, const std::string& path, std::span<std::uint8_t> bytes, std::int64_t offset) {
    while (!bytes.empty()) {
        const ssize_t n = ::pread(fd, bytes.data(), bytes.size(), offset);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path, "cannot read");
        bytes = bytes.subspan(static_cast<std::size_t>(n));
        offset += n;
    }
    return {};
}

// +infinity is a void too.
double as_stored(double v) { return v == INFINITY ? kVoidSample : v; }

void encode(std::span<const double> values, bool wide, std::uint8_t* bytes) {
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double value = as_stored(values[i]);
        if (wide) {
            std::memcpy(bytes + i * 8, &value, 8);
        } else {
            const float v = static_cast<float>(value);
            std::memcpy(bytes + i * 4, &v, 4);
        }
    }
}

void decode(const std::uint8_t* bytes, bool wide, std::span<double> values) {
    if (wide) {
        std::memcpy(values.data(), bytes, values.size_bytes());
        return;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
        float v = 0;
        std::memcpy(&v, bytes + i * 4, 4);
        values[i] = v;
    }
}

// Linear between the nearest valid neighbours of the row, constant outside them; rounded as stored values are. At least
// one sample is valid.
void support_row(std::span<double> row, bool wide) {
    const auto stored = [wide](double v) { return wide ? v : static_cast<double>(static_cast<float>(v)); };
    const std::size_t width = row.size();
    std::size_t i = 0;
    std::ptrdiff_t last_valid = -1;
    while (i < width) {
        if (std::isfinite(row[i])) {
            last_valid = static_cast<std::ptrdiff_t>(i++);
            continue;
        }
        std::size_t next = i;
        while (next < width && !std::isfinite(row[next])) ++next;
        if (last_valid < 0) {
            if (next == width) return;  // not met: some sample is valid
            for (; i < next; ++i) row[i] = row[next];
        } else if (next == width) {
            for (; i < width; ++i) row[i] = row[static_cast<std::size_t>(last_valid)];
        } else {
            const auto from = static_cast<std::size_t>(last_valid);
            const double a = row[from], b = row[next], span = static_cast<double>(next - from);
            for (; i < next; ++i) row[i] = stored(a + (b - a) * (static_cast<double>(i - from) / span));
        }
    }
}

}  // namespace

HeightSpool::Descriptor::~Descriptor() { ::close(fd); }

HeightSpool::HeightSpool(int fd, std::string path, std::int64_t width, std::int64_t height, bool wide)
    : file_{fd},
      path_(std::move(path)),
      width_(width),
      height_(height),
      wide_(wide),
      row_bytes_(width * bytes_of_sample(wide)) {}

std::int64_t HeightSpool::bytes_needed(std::int64_t width, std::int64_t height, bool wide) {
    return height * width * bytes_of_sample(wide);
}

Result<std::unique_ptr<HeightSpool>> HeightSpool::create(const std::string& path, std::int64_t width,
                                                         std::int64_t height, bool wide) {
    std::string name = path + ".XXXXXX";
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return io_error(path, "cannot create");
    ::unlink(name.c_str());
    return std::unique_ptr<HeightSpool>(new HeightSpool(fd, path, width, height, wide));
}

Result<void> HeightSpool::append(std::span<const double> row) {
    const auto j = static_cast<std::int64_t>(rows_.size());
    assert(static_cast<std::int64_t>(row.size()) == width_ && j < height_);
    double low = INFINITY, high = -INFINITY;
    std::int64_t valid = 0;
    for (const double v : row) {
        if (!std::isfinite(v)) continue;
        ++valid;
        low = std::min(low, v);
        high = std::max(high, v);
    }
    if (valid > 0) {
        summary_.min_raw = summary_.valid_samples == 0 ? low : std::min(summary_.min_raw, low);
        summary_.max_raw = summary_.valid_samples == 0 ? high : std::max(summary_.max_raw, high);
        summary_.valid_samples += valid;
    }
    rows_.push_back(valid == width_ ? RowState::all_valid : valid > 0 ? RowState::some_valid : RowState::none_valid);
    record_.resize(static_cast<std::size_t>(row_bytes_));
    encode(row, wide_, record_.data());
    return write_at(file_.fd, path_, record_, j * row_bytes_);
}

Result<HeightSpool::Summary> HeightSpool::finish() {
    assert(static_cast<std::int64_t>(rows_.size()) == height_);
    if (summary_.valid_samples == 0)
        return Error{ErrorCode::input, "every height is a void: there is nothing to build"};
    return summary_;
}

Result<const std::uint8_t*> HeightSpool::row_bytes(std::int64_t j) {
    if (j < chunk_first_ || j >= chunk_first_ + chunk_rows_) {
        const std::int64_t rows = std::clamp<std::int64_t>(kReadChunkBytes / row_bytes_, 1, height_ - j);
        chunk_rows_ = 0;
        chunk_.resize(static_cast<std::size_t>(rows * row_bytes_));
        if (auto ok = read_at(file_.fd, path_, chunk_, j * row_bytes_); !ok) return ok.error();
        chunk_first_ = j;
        chunk_rows_ = rows;
    }
    return static_cast<const std::uint8_t*>(chunk_.data() + (j - chunk_first_) * row_bytes_);
}

// The rows around j that have no valid sample.
HeightSpool::Rows HeightSpool::rows_like(std::int64_t j) const {
    const auto lacks_all = [this](std::int64_t row) {
        return rows_[static_cast<std::size_t>(row)] == RowState::none_valid;
    };
    Rows rows{j, j};
    while (rows.first > 0 && lacks_all(rows.first - 1)) --rows.first;
    while (rows.end < height_ && lacks_all(rows.end)) ++rows.end;
    return rows;
}

std::int64_t HeightSpool::supporting_row(const Rows& lacking) const {
    assert(lacking.first > 0 || lacking.end < height_);
    return lacking.first > 0 ? lacking.first - 1 : lacking.end;
}

// The rows around j without a valid sample share one support.
Result<void> HeightSpool::load_support(std::int64_t j) {
    if (j >= support_first_ && j < support_end_) return {};
    const auto [first, end] = rows_like(j);
    const std::int64_t source = supporting_row({first, end});
    support_first_ = support_end_ = 0;
    support_.resize(static_cast<std::size_t>(width_));
    if (auto ok = read_samples(0, source, support_); !ok) return ok;
    support_row(support_, wide_);
    support_first_ = first;
    support_end_ = end;
    return {};
}

Result<void> HeightSpool::read_row(std::int64_t j, std::span<double> values, std::span<std::uint8_t> valid) {
    assert(j >= 0 && j < height_ && static_cast<std::int64_t>(values.size()) >= width_);
    values = values.first(static_cast<std::size_t>(width_));
    valid = valid.first(static_cast<std::size_t>(width_));
    const RowState state = rows_[static_cast<std::size_t>(j)];
    if (state == RowState::none_valid) {
        if (auto ok = load_support(j); !ok) return ok;
        std::copy(support_.begin(), support_.end(), values.begin());
        std::fill(valid.begin(), valid.end(), std::uint8_t{0});
        return {};
    }
    auto bytes = row_bytes(j);
    if (!bytes) return bytes.error();
    decode(*bytes, wide_, values);
    if (state == RowState::all_valid) {
        std::fill(valid.begin(), valid.end(), std::uint8_t{1});
        return {};
    }
    std::transform(values.begin(), values.end(), valid.begin(), [](double v) { return std::isfinite(v) ? 1 : 0; });
    support_row(values, wide_);
    return {};
}

Result<void> HeightSpool::pread_samples(std::int64_t i, std::int64_t j, std::span<double> out,
                                        std::vector<std::uint8_t>& bytes) const {
    bytes.resize(out.size() * static_cast<std::size_t>(bytes_of_sample(wide_)));
    if (auto ok = read_at(file_.fd, path_, bytes, j * row_bytes_ + i * bytes_of_sample(wide_)); !ok) return ok;
    decode(bytes.data(), wide_, out);
    return {};
}

Result<void> HeightSpool::read_window(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                      std::span<double> values, std::span<std::uint8_t> valid) const {
    assert(i >= 0 && j >= 0 && i + columns <= width_ && j + rows <= height_);
    const auto width = static_cast<std::size_t>(columns);
    std::vector<std::uint8_t> bytes;
    std::vector<double> whole;
    for (std::int64_t r = 0; r < rows; ++r) {
        const RowState state = rows_[static_cast<std::size_t>(j + r)];
        const std::span<double> row = values.subspan(static_cast<std::size_t>(r) * width, width);
        const std::span<std::uint8_t> flags = valid.subspan(static_cast<std::size_t>(r) * width, width);
        std::int64_t source = j + r;
        if (state == RowState::none_valid) {
            source = supporting_row(rows_like(j + r));
            std::fill(flags.begin(), flags.end(), std::uint8_t{0});
        }
        if (auto ok = pread_samples(i, source, row, bytes); !ok) return ok;
        if (state != RowState::none_valid)
            std::transform(row.begin(), row.end(), flags.begin(), [](double v) { return std::isfinite(v) ? 1 : 0; });
        if (std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); })) continue;
        whole.resize(static_cast<std::size_t>(width_));
        if (auto ok = pread_samples(0, source, whole, bytes); !ok) return ok;
        support_row(whole, wide_);
        std::copy_n(whole.begin() + i, columns, row.begin());
    }
    return {};
}

Result<void> HeightSpool::read_valid(std::int64_t j, std::span<std::uint8_t> valid) {
    const RowState state = rows_[static_cast<std::size_t>(j)];
    valid = valid.first(static_cast<std::size_t>(width_));
    if (state != RowState::some_valid) {
        std::fill(valid.begin(), valid.end(), static_cast<std::uint8_t>(state == RowState::all_valid));
        return {};
    }
    auto bytes = row_bytes(j);
    if (!bytes) return bytes.error();
    for (std::size_t i = 0; i < valid.size(); ++i) {
        double v = 0;
        decode(*bytes + static_cast<std::int64_t>(i) * bytes_of_sample(wide_), wide_, {&v, 1});
        valid[i] = std::isfinite(v) ? 1 : 0;
    }
    return {};
}

bool HeightSpool::may_lack_samples(std::int64_t j) const {
    return rows_[static_cast<std::size_t>(j)] != RowState::all_valid;
}

Result<void> HeightSpool::read_samples(std::int64_t i, std::int64_t j, std::span<double> out) {
    assert(i >= 0 && i + static_cast<std::int64_t>(out.size()) <= width_ && j >= 0 && j < height_);
    record_.resize(out.size() * static_cast<std::size_t>(bytes_of_sample(wide_)));
    if (auto ok = read_at(file_.fd, path_, record_, j * row_bytes_ + i * bytes_of_sample(wide_)); !ok) return ok;
    decode(record_.data(), wide_, out);
    return {};
}

Result<void> HeightSpool::write_samples(std::int64_t i, std::int64_t j, std::span<const double> values) {
    assert(i >= 0 && i + static_cast<std::int64_t>(values.size()) <= width_ && j >= 0 && j < height_);
    assert(rows_[static_cast<std::size_t>(j)] != RowState::none_valid);
    chunk_rows_ = 0;
    support_first_ = support_end_ = 0;
    record_.resize(values.size() * static_cast<std::size_t>(bytes_of_sample(wide_)));
    encode(values, wide_, record_.data());
    return write_at(file_.fd, path_, record_, j * row_bytes_ + i * bytes_of_sample(wide_));
}

}  // namespace scree
