// A temporary raster of heights of any size: 64 x 64 blocks in an unlinked file, where only what was written takes
// room. One thread writes; once it is done any number of threads may read.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/result.h"

namespace scree {

/// What may replace what: -infinity = no file reaches here, NaN = a file has a void here, else a value.
struct HeightCell {
    static bool replaces(double fresh, double held);
};

template <class T>
class RasterSpool {
public:
    static constexpr std::int64_t kBlock = 64;

    /// `path`: the file's name begins so; it vanishes with the process. `nothing` is what reads give where nothing was
    /// written.
    static Result<std::unique_ptr<RasterSpool>> create(const std::string& path, std::int64_t columns, std::int64_t rows,
                                                       T nothing);
    ~RasterSpool();
    RasterSpool(const RasterSpool&) = delete;
    RasterSpool& operator=(const RasterSpool&) = delete;

    /// Lays `values` (rows x columns, row-major) over what is there. The rectangle lies within the raster. Fastest
    /// where it covers whole blocks. Errors: ErrorCode::io.
    Result<void> lay(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                     std::span<const T> values);
    /// The window, row-major; outside the raster `nothing`. Errors: ErrorCode::io.
    Result<void> read(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                      std::span<T> out) const;

    /// False: reading the window would give `nothing` alone.
    bool holds_any(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows) const;

    /// First samples of the blocks that hold anything, by rows.
    struct Corner {
        std::int64_t column = 0, row = 0;
    };
    std::vector<Corner> corners() const;

    std::int64_t columns() const { return columns_; }
    std::int64_t rows() const { return rows_; }
    std::int64_t file_bytes() const { return slots_ * kBlockBytes; }

private:
    static constexpr std::int64_t kBlockBytes = kBlock * kBlock * static_cast<std::int64_t>(sizeof(T));

    RasterSpool(int fd, std::string path, std::int64_t columns, std::int64_t rows, T nothing);
    std::int64_t block_index(std::int64_t bx, std::int64_t by) const { return by * blocks_across_ + bx; }
    Result<void> load(std::int64_t slot, std::span<T> block) const;
    Result<void> save(std::int64_t slot, std::span<const T> block) const;

    int fd_;
    std::string path_;
    std::int64_t columns_, rows_, blocks_across_;
    T nothing_;
    std::int64_t slots_ = 0;
    std::unordered_map<std::int64_t, std::int64_t> slot_of_;
    std::vector<T> block_;
};

}  // namespace scree
