// Rows of a grid whose values are made rectangle by rectangle: a band of rows at a time, its parts in parallel.
#pragma once

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "common/result.h"
#include "tools/source/warp_map.h"

namespace scree {

template <class T>
class RowBands {
public:
    /// Makes the rectangle [i, i + columns) x [j, j + rows), row-major; called from several threads.
    using Make = std::function<Result<void>(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                            std::span<T> out)>;
    /// Whether anything of the rectangle will be looked at; what is not is not made. Null: all is.
    using Wanted = std::function<bool(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows)>;
    RowBands(std::int64_t width, Make make, Wanted wanted = nullptr)
        : width_(width), make_(std::move(make)), wanted_(std::move(wanted)) {}

    /// Row r >= 0; cheap in ascending order. Valid until the next call.
    Result<std::span<const T>> row(std::int64_t r) {
        const std::int64_t band = r / kRows;
        if (band != band_)
            if (auto ok = load(band); !ok) return ok.error();
        return std::span<const T>(values_.data() + (r - band * kRows) * width_, static_cast<std::size_t>(width_));
    }

private:
    static constexpr std::int64_t kRows = WarpMap::kChunk;

    Result<void> load(std::int64_t band) {
        band_ = -1;
        values_.resize(static_cast<std::size_t>(kRows * width_));
        std::mutex mutex;
        Result<void> outcome;
        const std::int64_t parts = (width_ + WarpMap::kChunk - 1) / WarpMap::kChunk;
        tbb::parallel_for(std::int64_t{0}, parts, [&](std::int64_t part) {
            const std::int64_t i = part * WarpMap::kChunk, columns = std::min(WarpMap::kChunk, width_ - i);
            if (wanted_ && !wanted_(i, band * kRows, columns, kRows)) return;
            std::vector<T> out(static_cast<std::size_t>(columns * kRows));
            if (auto ok = make_(i, band * kRows, columns, kRows, out); !ok) {
                const std::lock_guard lock(mutex);
                if (outcome) outcome = ok;
                return;
            }
            for (std::int64_t r = 0; r < kRows; ++r)
                std::copy_n(out.data() + r * columns, columns, values_.data() + r * width_ + i);
        });
        if (outcome) band_ = band;
        return outcome;
    }

    std::int64_t width_;
    Make make_;
    Wanted wanted_;
    std::int64_t band_ = -1;
    std::vector<T> values_;
};

}  // namespace scree
