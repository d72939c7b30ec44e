#include "tools/pyramid/height_quantizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/height_tile.h"

namespace scree {
namespace {

constexpr double kDefaultQuantum = 1.0 / 64;
constexpr double kGreatestHeight = 1e7;

bool fits(const HeightQuantizer& q, double low_m, double high_m) {
    return std::abs((low_m - q.height_offset_m) / q.quantum_m) <= kMaxHeightUnits - 1 &&
           std::abs((high_m - q.height_offset_m) / q.quantum_m) <= kMaxHeightUnits - 1;
}

// Doubles below 2^51 plus this have no bits left for a fraction: the sum is rounded, to even where halfway, as
// nearbyint does.
constexpr double kRounder = 6755399441055744.0;  // 1.5 * 2^52

// The same steps as HeightQuantizer::quantize and error_m, as loops that the compiler turns into vectors. The clamp
// comes first: its ends are integers, so that makes no difference.
template <class T>
class BlockQuantizer {
public:
    static constexpr std::size_t kBlock = 512;

    explicit BlockQuantizer(const HeightQuantizer& q) : q_(q) {
        int exponent = 0;
        // Powers of two, whose inverse is exact.
        exact_inverse_ = std::frexp(q.quantum_m, &exponent) == 0.5 && std::abs(exponent) < 1000;
    }

    void run(const T* raw, const std::uint8_t* valid, std::size_t count, std::int32_t* out, QuantizedRange& range) {
        const HeightQuantizer q = q_;
        for (std::size_t i = 0; i < count; ++i) metres_[i] = static_cast<double>(raw[i]) * q.scale + q.offset_m;
        if (exact_inverse_) {
            const double inverse = 1 / q.quantum_m;
            for (std::size_t i = 0; i < count; ++i) units_[i] = (metres_[i] - q.height_offset_m) * inverse;
        } else {
            for (std::size_t i = 0; i < count; ++i) units_[i] = (metres_[i] - q.height_offset_m) / q.quantum_m;
        }
        constexpr double kMost = kMaxHeightUnits;
        for (std::size_t i = 0; i < count; ++i) {
            double n = units_[i];
            n = n < -kMost ? -kMost : n;
            n = n > kMost ? kMost : n;
            units_[i] = n + kRounder - kRounder;
        }
        for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<std::int32_t>(units_[i]);
        for (std::size_t i = 0; i < count; ++i)
            metres_[i] = std::abs(metres_[i] - (q.height_offset_m + units_[i] * q.quantum_m));
        note(out, valid, count, range);
    }

private:
    void note(const std::int32_t* n, const std::uint8_t* valid, std::size_t count, QuantizedRange& range) {
        if (valid != nullptr) {
            for (std::size_t i = 0; i < count; ++i)
                if (valid[i] != 0) range.include({n[i], n[i], metres_[i]});
            return;
        }
        std::int32_t low = range.min_n, high = range.max_n;
        for (std::size_t i = 0; i < count; ++i) {
            low = std::min(low, n[i]);
            high = std::max(high, n[i]);
        }
        std::array<double, 8> worst{};
        std::fill(metres_.begin() + static_cast<std::ptrdiff_t>(count), metres_.end(), 0.0);
        for (std::size_t i = 0; i < kBlock; i += worst.size())
            for (std::size_t k = 0; k < worst.size(); ++k)
                worst[k] = metres_[i + k] > worst[k] ? metres_[i + k] : worst[k];
        range.include({low, high, *std::max_element(worst.begin(), worst.end())});
    }

    const HeightQuantizer& q_;
    bool exact_inverse_ = false;
    std::array<double, kBlock> metres_, units_;
};

template <class T>
QuantizedRange quantize_all(const HeightQuantizer& q, std::span<const T> raw, std::span<const std::uint8_t> valid,
                            std::span<std::int32_t> out) {
    BlockQuantizer<T> block(q);
    QuantizedRange range;
    for (std::size_t i = 0; i < raw.size(); i += BlockQuantizer<T>::kBlock)
        block.run(raw.data() + i, valid.empty() ? nullptr : valid.data() + i,
                  std::min(BlockQuantizer<T>::kBlock, raw.size() - i), out.data() + i, range);
    return range;
}

}  // namespace

void QuantizedRange::include(const QuantizedRange& other) {
    min_n = std::min(min_n, other.min_n);
    max_n = std::max(max_n, other.max_n);
    worst_error_m = std::max(worst_error_m, other.worst_error_m);
}

QuantizedRange HeightQuantizer::quantize(std::span<const float> raw, std::span<const std::uint8_t> valid,
                                         std::span<std::int32_t> out) const {
    return quantize_all(*this, raw, valid, out);
}
QuantizedRange HeightQuantizer::quantize(std::span<const double> raw, std::span<const std::uint8_t> valid,
                                         std::span<std::int32_t> out) const {
    return quantize_all(*this, raw, valid, out);
}

std::int32_t HeightQuantizer::quantize(double raw) const {
    const double n = std::nearbyint((metres(raw) - height_offset_m) / quantum_m);
    return static_cast<std::int32_t>(std::clamp<double>(n, -kMaxHeightUnits, kMaxHeightUnits));
}

double HeightQuantizer::error_m(double raw) const {
    return std::abs(metres(raw) - (height_offset_m + quantize(raw) * quantum_m));
}

Result<HeightQuantizer> choose_quantizer(const QuantizerInput& in) {
    HeightQuantizer q{in.scale, in.offset_m, in.offset_m, 1};
    const double low = q.metres(in.min_raw), high = q.metres(in.max_raw);
    if (!(std::abs(low) <= kGreatestHeight && std::abs(high) <= kGreatestHeight))
        return Error{
            ErrorCode::input,
            fmt::format("heights reach from {} to {} m, beyond 1e7 m: an undeclared nodata value, or the wrong "
                        "--height-scale",
                        low, high)};
    if (in.quantum_m) {
        q.quantum_m = *in.quantum_m;
        if (!fits(q, low, high))
            q.height_offset_m +=
                std::nearbyint((low + high) / 2 / q.quantum_m - in.offset_m / q.quantum_m) * q.quantum_m;
        if (!fits(q, low, high))
            return Error{ErrorCode::usage,
                         fmt::format("--height-quantum {} m cannot hold heights from {} to {} m in 23 bits",
                                     *in.quantum_m, low, high)};
        return q;
    }
    q.quantum_m = in.integer_source ? in.scale : kDefaultQuantum;
    if (!in.integer_source) q.height_offset_m = 0;
    while (!fits(q, low, high)) {
        HeightQuantizer centred = q;
        centred.height_offset_m += std::nearbyint(((low + high) / 2 - q.height_offset_m) / q.quantum_m) * q.quantum_m;
        if (fits(centred, low, high)) return centred;
        q.quantum_m *= 2;
    }
    return q;
}

}  // namespace scree
