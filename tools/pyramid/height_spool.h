// HeightSpool: the source heights as one row-major temporary file, voids filled, with a validity bit a sample. The
// builder reads the source once, then knows range and fill before it quantises, and holds no image in memory.
//
// Fill rule (docs/building-pyramids.md): in a row, a void takes the value interpolated linearly between the nearest
// valid samples west and east of it, or the nearest one's where there is only one. A row without any valid sample
// repeats the row above it; such rows at the top repeat the first row that has one. Filled samples are never drawn over
// present cells; they only give coarse meshes at the data's edge somewhere to stand.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

class HeightSpool {
public:
    struct Summary {
        std::int64_t valid_samples = 0;
        double min_raw = 0, max_raw = 0;  ///< over valid samples
    };

    /// A file of a new name that begins with `path`, unlinked at once: it vanishes with the process. `wide`: values do
    /// not fit float32.
    static Result<std::unique_ptr<HeightSpool>> create(const std::string& path, std::int64_t width, std::int64_t height,
                                                       bool wide);
    static std::int64_t bytes_needed(std::int64_t width, std::int64_t height, bool wide);

    /// Appends the next row; NaN marks a void.
    Result<void> append(std::span<const double> row);
    /// After the last row. Errors: ErrorCode::input when no sample is valid.
    Result<Summary> finish();

    /// Row j: filled raw values and one byte a sample, 1 = valid.
    Result<void> read_row(std::int64_t j, std::span<double> values, std::span<std::uint8_t> valid);
    /// Validity alone.
    Result<void> read_valid(std::int64_t j, std::span<std::uint8_t> valid);

    /// Samples [i, i + columns) x [j, j + rows), row-major. Any thread, once finish() is through.
    Result<void> read_window(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                             std::span<double> values, std::span<std::uint8_t> valid) const;

    std::int64_t width() const { return width_; }
    std::int64_t height() const { return height_; }

private:
    HeightSpool(int fd, std::string path, std::int64_t width, std::int64_t height, bool wide);
    Result<void> write_row(std::int64_t j, bool all_void);
    Result<const std::uint8_t*> row_bytes(std::int64_t j);

    struct Descriptor {
        int fd;
        ~Descriptor();
    } file_;
    std::string path_;
    std::int64_t width_, height_;
    bool wide_;
    std::int64_t row_bytes_;
    std::int64_t rows_ = 0;
    std::int64_t leading_void_rows_ = 0;
    std::vector<double> filled_;
    std::vector<std::uint8_t> record_;
    std::vector<std::uint8_t> chunk_;
    std::int64_t chunk_first_ = 0, chunk_rows_ = 0;
    Summary summary_;
};

}  // namespace scree
