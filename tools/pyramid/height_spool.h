// HeightSpool: the lattice's heights as one row-major temporary file. The builder reads the source once, then knows
// range and voids before it quantises, and holds no image in memory. A sample without a height is a void (inside some
// file) or uncovered (no file reaches it); only interior voids can get one later (void_fill.h). Values are kept as they
// came, in float32 or double; what stands under absent samples is made when a row is read.
//
// Support rule (docs/building-pyramids.md): in a row, an absent sample reads as the value interpolated linearly between
// the nearest valid samples west and east of it, or the nearest one's where there is only one. A row without any valid
// sample repeats the row above it; such rows at the top repeat the first row that has one. Samples that write_samples
// made valid count as valid. Support is never drawn over present cells; it only gives coarse meshes at the data's edge
// somewhere to stand.
//
// Not thread-safe but where said otherwise: one thread at a time.
#pragma once

#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/pyramid/coverage.h"

namespace scree {

/// Samples without a height, as append takes and read_samples gives them.
constexpr double kVoidSample = std::numeric_limits<double>::quiet_NaN();
constexpr double kUncoveredSample = -std::numeric_limits<double>::infinity();

class HeightSpool {
public:
    struct Summary {
        std::int64_t valid_samples = 0;
        double min_raw = 0, max_raw = 0;  ///< over valid samples
    };

    /// A file of a new name that begins with `path`, unlinked at once: it vanishes with the process. `wide`: values do
    /// not fit float32. `coverage`: samples outside are uncovered and take no room; null: all may be covered. It must
    /// outlive the spool.
    static Result<std::unique_ptr<HeightSpool>> create(const std::string& path, std::int64_t width, std::int64_t height,
                                                       bool wide, const Coverage* coverage = nullptr);
    static std::int64_t bytes_needed(std::int64_t width, std::int64_t height, bool wide);

    /// Appends the next row, or several: -infinity marks an uncovered sample, NaN and +infinity a void. Floats only
    /// where the spool is not wide.
    Result<void> append(std::span<const double> rows);
    Result<void> append(std::span<const float> rows);
    /// One row, of which only what the coverage has is looked at. Empty: no file reaches it.
    Result<void> append_covered(std::span<const double> row);
    bool sparse() const { return coverage_ != nullptr; }
    /// Samples of row j that may be covered. Of a sparse spool.
    Coverage::Runs covered(std::int64_t j) const { return coverage_->samples(j); }
    /// After the last row. Errors: ErrorCode::input when no sample is valid.
    Result<Summary> finish();

    /// Row j: raw values, support where there is none, and one byte a sample, 1 = valid. Floats only where the spool is
    /// not wide. This and the following: any thread, while nothing is written.
    Result<void> read_row(std::int64_t j, std::span<double> values, std::span<std::uint8_t> valid) const;
    Result<void> read_row(std::int64_t j, std::span<float> values, std::span<std::uint8_t> valid) const;
    /// Validity alone.
    Result<void> read_valid(std::int64_t j, std::span<std::uint8_t> valid) const;

    /// Samples [i, i + columns) x [j, j + rows) as read_row gives them.
    Result<void> read_window(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                             std::span<double> values, std::span<std::uint8_t> valid) const;

    /// A row of a sparse spool: any sample as read_row gives it. Valid while the spool is; for one thread.
    class SparseRow {
    public:
        double at(std::int64_t i) const;
        bool valid(std::int64_t i) const;

    private:
        friend class HeightSpool;
        /// Of the first valid sample that is not west of i. Rows are mostly read from west to east.
        std::size_t first_from(std::int64_t i) const;

        mutable std::size_t last_ = 0;
        bool absent_ = false, wide_ = false;
        std::vector<std::int64_t> columns_;  // of valid samples, of the supporting row where this one has none
        std::vector<double> values_;
        const std::map<std::int64_t, double>* support_ = nullptr;
    };
    Result<void> read_sparse(std::int64_t j, SparseRow& row) const;

    /// False: every sample of row j was valid when it was appended.
    bool may_lack_samples(std::int64_t j) const;
    /// Samples [i, i + out.size()) of row j as they came: values, kVoidSample, kUncoveredSample.
    Result<void> read_samples(std::int64_t i, std::int64_t j, std::span<double> out) const;
    /// Replaces samples of row j, which must have a valid sample already. Summary is not changed by it.
    Result<void> write_samples(std::int64_t i, std::int64_t j, std::span<const double> values);

    /// What stands under absent samples in place of the rule above, by rows and columns. Once, before rows are read.
    using Support = std::map<std::int64_t, std::map<std::int64_t, double>>;
    void set_support(Support support) { support_ = std::move(support); }

    std::int64_t width() const { return width_; }
    std::int64_t height() const { return height_; }
    bool wide() const { return wide_; }

private:
    enum class RowState : std::uint8_t { all_valid, some_valid, none_valid };

    HeightSpool(int fd, std::string path, std::int64_t width, std::int64_t height, bool wide, const Coverage* coverage);
    template <class T>
    Result<void> read_file(std::int64_t i, std::int64_t j, std::span<T> out) const;
    template <class T>
    void note_values(std::span<const T> values, std::size_t& finite);
    void note_row(std::size_t finite);
    Result<void> write_file(std::int64_t i, std::int64_t j, std::span<const double> values);
    template <class T>
    Result<void> append_rows(std::span<const T> rows);
    /// The row whose values stand under row j where that has none.
    std::int64_t supporting_row(std::int64_t j) const;
    template <class T>
    Result<void> read_stored(std::int64_t i, std::int64_t j, std::span<T> out) const;
    /// Of absent samples among [i, i + values.size()) of row j.
    template <class T>
    void lay_support(std::int64_t i, std::int64_t j, std::span<T> values, std::span<const std::uint8_t> valid) const;
    template <class T>
    Result<void> read_supported(std::int64_t j, std::span<T> values, std::span<std::uint8_t> valid) const;

    struct Descriptor {
        int fd;
        ~Descriptor();
    } file_;
    std::string path_;
    std::int64_t width_, height_;
    bool wide_;
    const Coverage* coverage_;
    std::int64_t row_bytes_;
    std::vector<RowState> rows_;  ///< of the rows appended so far
    Summary summary_;
    std::vector<std::int64_t> supporting_above_;  ///< of each row: the last one up to it with a valid sample, or -1
    Support support_;
    std::int64_t first_supporting_ = -1, last_supporting_ = -1;
};

}  // namespace scree
