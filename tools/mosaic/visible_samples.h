// The samples of a stack's layers that are not hidden: what the surface made from the stack is to be judged by. A
// sample is hidden where a layer above it has a value at its place, as resample.h understands it: within the raster,
// the nearest sample valid. Immutable; every call from any thread.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "common/result.h"
#include "tools/mosaic/stack.h"

namespace scree {

inline constexpr double kHiddenSample = std::numeric_limits<double>::infinity();

class VisibleSamples {
public:
    /// The stack must outlive it. Errors: CrsTransform::make's.
    static Result<VisibleSamples> make(const HeightStack& stack);

    /// As HeightStack::samples, but +infinity for hidden samples and NaN for voids and uncovered ones. The rectangle
    /// lies within the layer.
    Result<void> read(std::size_t layer, std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                      std::span<double> out) const;

    VisibleSamples(VisibleSamples&&) noexcept;
    VisibleSamples& operator=(VisibleSamples&&) noexcept;
    ~VisibleSamples();

private:
    struct Impl;
    explicit VisibleSamples(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
