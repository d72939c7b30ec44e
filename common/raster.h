// Raster<T> owns width x height values; RasterView<T> looks at such values with a stride. Row 0 is the northernmost.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scree {

template <class T>
struct RasterView {
    T* data = nullptr;
    std::int64_t width = 0;
    std::int64_t height = 0;
    std::int64_t stride = 0;  ///< values from one row to the next

    T& at(std::int64_t column, std::int64_t row) const {
        assert(column >= 0 && column < width && row >= 0 && row < height);
        return data[row * stride + column];
    }
    T* row(std::int64_t r) const { return data + r * stride; }
    operator RasterView<const T>() const { return {data, width, height, stride}; }
};

template <class T>
class Raster {
public:
    Raster() = default;
    Raster(std::int64_t width, std::int64_t height, T fill = T{})
        : width_(width), height_(height), values_(static_cast<std::size_t>(width * height), fill) {}

    std::int64_t width() const { return width_; }
    std::int64_t height() const { return height_; }
    T& at(std::int64_t column, std::int64_t row) { return values_[index(column, row)]; }
    const T& at(std::int64_t column, std::int64_t row) const { return values_[index(column, row)]; }
    T* row(std::int64_t r) { return values_.data() + r * width_; }
    const T* row(std::int64_t r) const { return values_.data() + r * width_; }
    RasterView<T> view() { return {values_.data(), width_, height_, width_}; }
    RasterView<const T> view() const { return {values_.data(), width_, height_, width_}; }

private:
    std::size_t index(std::int64_t column, std::int64_t row) const {
        assert(column >= 0 && column < width_ && row >= 0 && row < height_);
        return static_cast<std::size_t>(row * width_ + column);
    }

    std::int64_t width_ = 0;
    std::int64_t height_ = 0;
    std::vector<T> values_;
};

}  // namespace scree
