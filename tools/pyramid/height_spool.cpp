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
#include <limits>
#include <type_traits>

#include "tools/source/value_range.h"

namespace scree {
namespace {

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

// --- values on their way to and from the file ---

// +infinity is a void too.
double as_stored(double v) { return v == INFINITY ? kVoidSample : v; }

template <class T>
std::span<const std::uint8_t> bytes_of(std::span<const T> values) {
    return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()};
}
template <class T>
std::span<std::uint8_t> writable_bytes_of(std::span<T> values) {
    return {reinterpret_cast<std::uint8_t*>(values.data()), values.size_bytes()};
}

void narrow(std::span<const double> values, std::span<float> out) {
    for (std::size_t i = 0; i < values.size(); ++i) out[i] = static_cast<float>(as_stored(values[i]));
}

// In float or double as the file holds them.
class Scratch {
public:
    std::span<float> floats(std::size_t count) { return sized(floats_, count); }
    std::span<double> doubles(std::size_t count) { return sized(doubles_, count); }

private:
    template <class T>
    static std::span<T> sized(std::vector<T>& values, std::size_t count) {
        if (values.size() < count) values.resize(count);
        return {values.data(), count};
    }
    std::vector<float> floats_;
    std::vector<double> doubles_;
};
Scratch& scratch() {
    thread_local Scratch of_thread;
    return of_thread;
}

// --- rows ---

template <class T>
void mark_valid(std::span<const T> row, std::span<std::uint8_t> valid) {
    constexpr T kGreatest = std::numeric_limits<T>::max();
    for (std::size_t i = 0; i < row.size(); ++i)
        valid[i] = static_cast<std::uint8_t>((row[i] >= -kGreatest) & (row[i] <= kGreatest));
}

// Linear between the nearest valid neighbours of the row, constant outside them; rounded as stored values are. At least
// one sample is valid.
template <class T>
void support_row(std::span<T> row) {
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
            const double a = static_cast<double>(row[from]), b = static_cast<double>(row[next]),
                         span = static_cast<double>(next - from);
            for (; i < next; ++i) row[i] = static_cast<T>(a + (b - a) * (static_cast<double>(i - from) / span));
        }
    }
}

}  // namespace

HeightSpool::Descriptor::~Descriptor() { ::close(fd); }

HeightSpool::HeightSpool(int fd, std::string path, std::int64_t width, std::int64_t height, bool wide,
                         const Coverage* coverage)
    : file_{fd},
      path_(std::move(path)),
      width_(width),
      height_(height),
      wide_(wide),
      coverage_(coverage == nullptr || coverage->everything() ? nullptr : coverage),
      row_bytes_(width * bytes_of_sample(wide)) {}

std::int64_t HeightSpool::bytes_needed(std::int64_t width, std::int64_t height, bool wide) {
    return height * width * bytes_of_sample(wide);
}

Result<std::unique_ptr<HeightSpool>> HeightSpool::create(const std::string& path, std::int64_t width,
                                                         std::int64_t height, bool wide, const Coverage* coverage) {
    std::string name = path + ".XXXXXX";
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return io_error(path, "cannot create");
    ::unlink(name.c_str());
    return std::unique_ptr<HeightSpool>(new HeightSpool(fd, path, width, height, wide, coverage));
}

template <class T>
void HeightSpool::note_values(std::span<const T> values, std::size_t& finite) {
    ValueRange<T> range = range_of_values(values);
    std::size_t count = values.size();
    if (!range.all_finite) {
        range = {};
        count = 0;
        for (const T v : values) {
            if (!std::isfinite(v)) continue;
            ++count;
            range.low = std::min(range.low, v);
            range.high = std::max(range.high, v);
        }
    }
    finite += count;
    if (count == 0) return;
    const auto low = static_cast<double>(range.low), high = static_cast<double>(range.high);
    summary_.min_raw = summary_.valid_samples == 0 ? low : std::min(summary_.min_raw, low);
    summary_.max_raw = summary_.valid_samples == 0 ? high : std::max(summary_.max_raw, high);
    summary_.valid_samples += static_cast<std::int64_t>(count);
}

void HeightSpool::note_row(std::size_t finite) {
    if (finite > 0) {
        last_supporting_ = static_cast<std::int64_t>(rows_.size());
        if (first_supporting_ < 0) first_supporting_ = last_supporting_;
    }
    rows_.push_back(finite == static_cast<std::size_t>(width_) ? RowState::all_valid
                    : finite > 0                               ? RowState::some_valid
                                                               : RowState::none_valid);
    supporting_above_.push_back(last_supporting_);
}

Result<void> HeightSpool::append_covered(std::span<const double> row) {
    assert(sparse());
    const auto j = static_cast<std::int64_t>(rows_.size());
    std::size_t finite = 0;
    if (row.empty()) {
        note_row(finite);
        return {};
    }
    for (const auto& [begin, end] : covered(j)) {
        const auto values = row.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
        note_values(values, finite);
        if (auto ok = write_file(begin, j, values); !ok) return ok;
    }
    note_row(finite);
    return {};
}

template <class T>
Result<void> HeightSpool::append_rows(std::span<const T> rows) {
    const auto width = static_cast<std::size_t>(width_);
    assert(rows.size() % width == 0);
    const std::int64_t offset = static_cast<std::int64_t>(rows_.size()) * row_bytes_;
    bool all_valid = true;
    for (auto rest = rows; !rest.empty(); rest = rest.subspan(width)) {
        std::size_t finite = 0;
        note_values(rest.first(width), finite);
        note_row(finite);
        all_valid = all_valid && rows_.back() == RowState::all_valid;
    }
    assert(static_cast<std::int64_t>(rows_.size()) <= height_);
    if (std::is_same_v<T, double> && !wide_) {
        const auto record = scratch().floats(rows.size());
        std::transform(rows.begin(), rows.end(), record.begin(),
                       [](T v) { return static_cast<float>(as_stored(static_cast<double>(v))); });
        return write_at(file_.fd, path_, bytes_of<float>(record), offset);
    }
    assert(wide_ == (std::is_same_v<T, double>));
    if (all_valid) return write_at(file_.fd, path_, bytes_of(rows), offset);
    std::vector<T> record(rows.begin(), rows.end());
    for (T& v : record) v = static_cast<T>(as_stored(static_cast<double>(v)));
    return write_at(file_.fd, path_, bytes_of<T>(record), offset);
}

Result<void> HeightSpool::append(std::span<const double> rows) { return append_rows(rows); }
Result<void> HeightSpool::append(std::span<const float> rows) { return append_rows(rows); }

Result<HeightSpool::Summary> HeightSpool::finish() {
    assert(static_cast<std::int64_t>(rows_.size()) == height_);
    if (summary_.valid_samples == 0)
        return Error{ErrorCode::input, "every height is a void: there is nothing to build"};
    return summary_;
}

std::int64_t HeightSpool::supporting_row(std::int64_t j) const {
    const std::int64_t above = supporting_above_[static_cast<std::size_t>(j)];
    return above >= 0 ? above : first_supporting_;
}

template <class T>
Result<void> HeightSpool::read_stored(std::int64_t i, std::int64_t j, std::span<T> out) const {
    if (!sparse()) return read_file(i, j, out);
    std::fill(out.begin(), out.end(), static_cast<T>(kUncoveredSample));
    for (const auto& [first, last] : covered(j)) {
        const std::int64_t begin = std::max(first, i), end = std::min(last, i + static_cast<std::int64_t>(out.size()));
        if (begin >= end) continue;
        auto part = out.subspan(static_cast<std::size_t>(begin - i), static_cast<std::size_t>(end - begin));
        if (auto ok = read_file(begin, j, part); !ok) return ok;
    }
    return {};
}

Result<void> HeightSpool::read_sparse(std::int64_t j, SparseRow& row) const {
    row.absent_ = rows_[static_cast<std::size_t>(j)] == RowState::none_valid;
    row.wide_ = wide_;
    const auto support = support_.find(j);
    row.support_ = support == support_.end() ? nullptr : &support->second;
    row.last_ = 0;
    row.columns_.clear();
    row.values_.clear();
    const std::int64_t from = row.absent_ ? supporting_row(j) : j;
    std::vector<double> part;
    for (const auto& [begin, end] : covered(from)) {
        part.resize(static_cast<std::size_t>(end - begin));
        if (auto ok = read_file<double>(begin, from, part); !ok) return ok;
        for (std::size_t k = 0; k < part.size(); ++k) {
            if (!std::isfinite(part[k])) continue;
            row.columns_.push_back(begin + static_cast<std::int64_t>(k));
            row.values_.push_back(part[k]);
        }
    }
    return {};
}

std::size_t HeightSpool::SparseRow::first_from(std::int64_t i) const {
    for (const std::size_t k : {last_, last_ + 1})
        if (k <= columns_.size() && (k == 0 || columns_[k - 1] < i) && (k == columns_.size() || columns_[k] >= i))
            return last_ = k;
    return last_ = static_cast<std::size_t>(std::lower_bound(columns_.begin(), columns_.end(), i) - columns_.begin());
}

bool HeightSpool::SparseRow::valid(std::int64_t i) const {
    const std::size_t k = first_from(i);
    return !absent_ && k < columns_.size() && columns_[k] == i;
}

// As support_row has it.
double HeightSpool::SparseRow::at(std::int64_t i) const {
    const std::size_t k = first_from(i);
    const bool on_sample = k < columns_.size() && columns_[k] == i;
    if (on_sample && !absent_) return values_[k];
    const auto rounded = [&](double v) { return wide_ ? v : static_cast<double>(static_cast<float>(v)); };
    if (support_ != nullptr)
        if (const auto known = support_->find(i); known != support_->end()) return rounded(known->second);
    if (on_sample) return values_[k];
    if (k == 0) return values_.front();
    if (k == columns_.size()) return values_.back();
    const double a = values_[k - 1], b = values_[k], span = static_cast<double>(columns_[k] - columns_[k - 1]);
    return rounded(a + (b - a) * (static_cast<double>(i - columns_[k - 1]) / span));
}

template <class T>
Result<void> HeightSpool::read_file(std::int64_t i, std::int64_t j, std::span<T> out) const {
    const std::int64_t offset = j * row_bytes_ + i * bytes_of_sample(wide_);
    if (wide_ == std::is_same_v<T, double>) return read_at(file_.fd, path_, writable_bytes_of(out), offset);
    const auto convert = [&](auto stored) -> Result<void> {
        if (auto ok = read_at(file_.fd, path_, writable_bytes_of(stored), offset); !ok) return ok;
        std::transform(stored.begin(), stored.end(), out.begin(), [](auto v) { return static_cast<T>(v); });
        return {};
    };
    return wide_ ? convert(scratch().doubles(out.size())) : convert(scratch().floats(out.size()));
}

template <class T>
void HeightSpool::lay_support(std::int64_t i, std::int64_t j, std::span<T> values,
                              std::span<const std::uint8_t> valid) const {
    const auto row = support_.find(j);
    if (row == support_.end()) return;
    const auto end = row->second.lower_bound(i + static_cast<std::int64_t>(values.size()));
    for (auto at = row->second.lower_bound(i); at != end; ++at) {
        const auto k = static_cast<std::size_t>(at->first - i);
        // Rounded as stored values are.
        if (valid[k] == 0) values[k] = static_cast<T>(wide_ ? at->second : static_cast<float>(at->second));
    }
}

template <class T>
Result<void> HeightSpool::read_supported(std::int64_t j, std::span<T> values, std::span<std::uint8_t> valid) const {
    assert(j >= 0 && j < height_ && static_cast<std::int64_t>(values.size()) >= width_);
    values = values.first(static_cast<std::size_t>(width_));
    valid = valid.first(static_cast<std::size_t>(width_));
    const RowState state = rows_[static_cast<std::size_t>(j)];
    if (auto ok = read_stored(0, state == RowState::none_valid ? supporting_row(j) : j, values); !ok) return ok;
    if (state == RowState::some_valid)
        mark_valid<T>(values, valid);
    else
        std::fill(valid.begin(), valid.end(), static_cast<std::uint8_t>(state == RowState::all_valid));
    if (state == RowState::all_valid) return {};
    support_row(values);
    lay_support<T>(0, j, values, valid);
    return {};
}

Result<void> HeightSpool::read_row(std::int64_t j, std::span<double> values, std::span<std::uint8_t> valid) const {
    if (wide_) return read_supported(j, values, valid);
    // Support is rounded as stored values are.
    const auto stored = scratch().floats(static_cast<std::size_t>(width_));
    if (auto ok = read_supported(j, stored, valid); !ok) return ok;
    std::copy(stored.begin(), stored.end(), values.begin());
    return {};
}

Result<void> HeightSpool::read_row(std::int64_t j, std::span<float> values, std::span<std::uint8_t> valid) const {
    assert(!wide_);
    return read_supported(j, values, valid);
}

Result<void> HeightSpool::read_window(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                      std::span<double> values, std::span<std::uint8_t> valid) const {
    assert(i >= 0 && j >= 0 && i + columns <= width_ && j + rows <= height_);
    const auto width = static_cast<std::size_t>(columns);
    if (sparse()) {
        SparseRow row;
        std::size_t k = 0;
        for (std::int64_t r = 0; r < rows; ++r) {
            if (auto ok = read_sparse(j + r, row); !ok) return ok;
            for (std::int64_t c = 0; c < columns; ++c, ++k) {
                values[k] = row.at(i + c);
                valid[k] = static_cast<std::uint8_t>(row.valid(i + c));
            }
        }
        return {};
    }
    std::vector<double> whole;
    std::vector<std::uint8_t> whole_valid;
    for (std::int64_t r = 0; r < rows; ++r) {
        const RowState state = rows_[static_cast<std::size_t>(j + r)];
        const std::span<double> row = values.subspan(static_cast<std::size_t>(r) * width, width);
        const std::span<std::uint8_t> flags = valid.subspan(static_cast<std::size_t>(r) * width, width);
        const bool absent = state == RowState::none_valid;
        if (auto ok = read_stored(i, absent ? supporting_row(j + r) : j + r, row); !ok) return ok;
        mark_valid<double>(row, flags);
        const bool complete = std::all_of(flags.begin(), flags.end(), [](std::uint8_t v) { return v != 0; });
        if (absent) std::fill(flags.begin(), flags.end(), std::uint8_t{0});
        if (complete) {
            if (absent) lay_support<double>(i, j + r, row, flags);
            continue;
        }
        whole.resize(static_cast<std::size_t>(width_));
        whole_valid.resize(whole.size());
        if (auto ok = read_row(j + r, whole, whole_valid); !ok) return ok;
        std::copy_n(whole.begin() + i, columns, row.begin());
    }
    return {};
}

Result<void> HeightSpool::read_valid(std::int64_t j, std::span<std::uint8_t> valid) const {
    const RowState state = rows_[static_cast<std::size_t>(j)];
    valid = valid.first(static_cast<std::size_t>(width_));
    if (state != RowState::some_valid) {
        std::fill(valid.begin(), valid.end(), static_cast<std::uint8_t>(state == RowState::all_valid));
        return {};
    }
    const auto mark = [&](auto stored) -> Result<void> {
        if (auto ok = read_stored(0, j, stored); !ok) return ok;
        mark_valid<typename decltype(stored)::value_type>(stored, valid);
        return {};
    };
    return wide_ ? mark(scratch().doubles(valid.size())) : mark(scratch().floats(valid.size()));
}

bool HeightSpool::may_lack_samples(std::int64_t j) const {
    return rows_[static_cast<std::size_t>(j)] != RowState::all_valid;
}

Result<void> HeightSpool::read_samples(std::int64_t i, std::int64_t j, std::span<double> out) const {
    assert(i >= 0 && i + static_cast<std::int64_t>(out.size()) <= width_ && j >= 0 && j < height_);
    return read_stored(i, j, out);
}

Result<void> HeightSpool::write_samples(std::int64_t i, std::int64_t j, std::span<const double> values) {
    assert(i >= 0 && i + static_cast<std::int64_t>(values.size()) <= width_ && j >= 0 && j < height_);
    assert(rows_[static_cast<std::size_t>(j)] != RowState::none_valid);
    if (!sparse()) return write_file(i, j, values);
    for (const auto& [first, last] : covered(j)) {
        const std::int64_t begin = std::max(first, i),
                           end = std::min(last, i + static_cast<std::int64_t>(values.size()));
        if (begin >= end) continue;
        auto part = values.subspan(static_cast<std::size_t>(begin - i), static_cast<std::size_t>(end - begin));
        if (auto ok = write_file(begin, j, part); !ok) return ok;
    }
    return {};
}

Result<void> HeightSpool::write_file(std::int64_t i, std::int64_t j, std::span<const double> values) {
    const std::int64_t offset = j * row_bytes_ + i * bytes_of_sample(wide_);
    if (wide_) {
        const auto record = scratch().doubles(values.size());
        std::transform(values.begin(), values.end(), record.begin(), as_stored);
        return write_at(file_.fd, path_, bytes_of<double>(record), offset);
    }
    const auto record = scratch().floats(values.size());
    narrow(values, record);
    return write_at(file_.fd, path_, bytes_of<float>(record), offset);
}

}  // namespace scree
