#include "tools/source/pixel_decoder.h"

#include <exception>
#include <utility>
#include <vector>

#include "tools/source/sample_memory.h"

namespace scree {
namespace {

class LocalDecoder final : public BandDecoder {
public:
    explicit LocalDecoder(std::unique_ptr<PixelDecoder> decoder) : decoder_(std::move(decoder)) {}

    const DecodedLayout& layout() const override { return decoder_->layout(); }

    Result<const std::byte*> decode(std::int64_t begin, std::int64_t end) override {
        const DecodedLayout& l = layout();
        std::int64_t bytes = 0;
        if (__builtin_mul_overflow((end - begin) * l.channels, l.width, &bytes) ||
            __builtin_mul_overflow(bytes, static_cast<std::int64_t>(memory_bytes(l.type)), &bytes))
            return Error{ErrorCode::input, "more bytes than can be counted"};
        try {
            band_.resize(static_cast<std::size_t>(bytes));
            if (Result<void> decoded = decoder_->decode(begin, end, band_.data()); !decoded) return decoded.error();
        } catch (const std::exception& problem) {
            return Error{ErrorCode::input, problem.what()};
        }
        return static_cast<const std::byte*>(band_.data());
    }

private:
    std::unique_ptr<PixelDecoder> decoder_;
    std::vector<std::byte> band_;
};

}  // namespace

std::size_t memory_bytes(SampleType type) {
    std::size_t bytes = 0;
    with_memory_type(type, [&](auto sample) { bytes = sizeof(sample); });
    return bytes;
}

std::unique_ptr<BandDecoder> decode_here(std::unique_ptr<PixelDecoder> decoder) {
    return std::make_unique<LocalDecoder>(std::move(decoder));
}

}  // namespace scree
