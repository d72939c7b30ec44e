#include "tools/mosaic/raster_spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace scree {
namespace {

Error io_error(const std::string& path, const char* what) {
    return {ErrorCode::io, fmt::format("{}: {} the temporary raster: {}", path, what,
                                       errno != 0 ? std::strerror(errno) : "it ends early")};
}

}  // namespace

bool HeightCell::replaces(double fresh, double held) {
    return std::isfinite(fresh) || (std::isnan(fresh) && !std::isfinite(held));
}

template <class T>
RasterSpool<T>::RasterSpool(int fd, std::string path, std::int64_t columns, std::int64_t rows, T nothing)
    : fd_(fd),
      path_(std::move(path)),
      columns_(columns),
      rows_(rows),
      blocks_across_((columns + kBlock - 1) / kBlock),
      nothing_(nothing),
      block_(static_cast<std::size_t>(kBlock * kBlock)) {}

template <class T>
RasterSpool<T>::~RasterSpool() {
    ::close(fd_);
}

template <class T>
Result<std::unique_ptr<RasterSpool<T>>> RasterSpool<T>::create(const std::string& path, std::int64_t columns,
                                                               std::int64_t rows, T nothing) {
    std::string name = path + ".XXXXXX";
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return io_error(path, "cannot create");
    ::unlink(name.c_str());
    return std::unique_ptr<RasterSpool>(new RasterSpool(fd, path, columns, rows, nothing));
}

template <class T>
Result<void> RasterSpool<T>::load(std::int64_t slot, std::span<T> block) const {
    auto* to = reinterpret_cast<char*>(block.data());
    std::int64_t done = 0;
    while (done < kBlockBytes) {
        errno = 0;
        const ssize_t n =
            ::pread(fd_, to + done, static_cast<std::size_t>(kBlockBytes - done), slot * kBlockBytes + done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path_, "cannot read");
        done += n;
    }
    return {};
}

template <class T>
Result<void> RasterSpool<T>::save(std::int64_t slot, std::span<const T> block) const {
    const auto* from = reinterpret_cast<const char*>(block.data());
    std::int64_t done = 0;
    while (done < kBlockBytes) {
        errno = 0;
        const ssize_t n =
            ::pwrite(fd_, from + done, static_cast<std::size_t>(kBlockBytes - done), slot * kBlockBytes + done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return io_error(path_, "cannot write");
        done += n;
    }
    return {};
}

template <class T>
Result<void> RasterSpool<T>::lay(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                                 std::span<const T> values) {
    assert(column >= 0 && row >= 0 && column + columns <= columns_ && row + rows <= rows_);
    for (std::int64_t by = row / kBlock; by * kBlock < row + rows; ++by) {
        const std::int64_t top = std::max(row, by * kBlock), bottom = std::min(row + rows, (by + 1) * kBlock);
        for (std::int64_t bx = column / kBlock; bx * kBlock < column + columns; ++bx) {
            const std::int64_t left = std::max(column, bx * kBlock),
                               right = std::min(column + columns, (bx + 1) * kBlock);
            const auto found = slot_of_.find(block_index(bx, by));
            const bool held = found != slot_of_.end();
            if (held) {
                if (auto ok = load(found->second, block_); !ok) return ok;
            } else {
                std::fill(block_.begin(), block_.end(), nothing_);
            }
            bool changed = false;
            for (std::int64_t y = top; y < bottom; ++y) {
                const T* from = values.data() + (y - row) * columns + (left - column);
                T* to = block_.data() + (y - by * kBlock) * kBlock + (left - bx * kBlock);
                for (std::int64_t x = 0; x < right - left; ++x) {
                    if (!HeightCell::replaces(from[x], to[x])) continue;
                    to[x] = from[x];
                    changed = true;
                }
            }
            if (!changed) continue;
            const std::int64_t slot = held ? found->second : slots_++;
            if (!held) slot_of_.emplace(block_index(bx, by), slot);
            if (auto ok = save(slot, block_); !ok) return ok;
        }
    }
    return {};
}

template <class T>
Result<void> RasterSpool<T>::read(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                                  std::span<T> out) const {
    assert(static_cast<std::int64_t>(out.size()) >= columns * rows);
    std::fill_n(out.begin(), columns * rows, nothing_);
    const std::int64_t x0 = std::max<std::int64_t>(column, 0), x1 = std::min(column + columns, columns_);
    const std::int64_t y0 = std::max<std::int64_t>(row, 0), y1 = std::min(row + rows, rows_);
    if (x0 >= x1 || y0 >= y1) return {};
    std::array<T, static_cast<std::size_t>(kBlock * kBlock)> block;
    for (std::int64_t by = y0 / kBlock; by * kBlock < y1; ++by) {
        for (std::int64_t bx = x0 / kBlock; bx * kBlock < x1; ++bx) {
            const auto found = slot_of_.find(block_index(bx, by));
            if (found == slot_of_.end()) continue;
            if (auto ok = load(found->second, block); !ok) return ok;
            const std::int64_t left = std::max(x0, bx * kBlock), right = std::min(x1, (bx + 1) * kBlock);
            for (std::int64_t y = std::max(y0, by * kBlock); y < std::min(y1, (by + 1) * kBlock); ++y)
                std::copy_n(block.data() + (y - by * kBlock) * kBlock + (left - bx * kBlock), right - left,
                            out.data() + (y - row) * columns + (left - column));
        }
    }
    return {};
}

template <class T>
bool RasterSpool<T>::holds_any(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows) const {
    const std::int64_t x0 = std::max<std::int64_t>(column, 0), x1 = std::min(column + columns, columns_);
    const std::int64_t y0 = std::max<std::int64_t>(row, 0), y1 = std::min(row + rows, rows_);
    for (std::int64_t by = y0 / kBlock; by * kBlock < y1; ++by)
        for (std::int64_t bx = x0 / kBlock; bx * kBlock < x1; ++bx)
            if (slot_of_.contains(block_index(bx, by))) return true;
    return false;
}

template <class T>
std::vector<typename RasterSpool<T>::Corner> RasterSpool<T>::corners() const {
    std::vector<std::int64_t> indices;
    for (const auto& [index, slot] : slot_of_) indices.push_back(index);
    std::sort(indices.begin(), indices.end());
    std::vector<Corner> corners;
    for (const std::int64_t index : indices)
        corners.push_back({index % blocks_across_ * kBlock, index / blocks_across_ * kBlock});
    return corners;
}

template class RasterSpool<float>;
template class RasterSpool<double>;

}  // namespace scree
