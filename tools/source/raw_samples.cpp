#include "tools/source/raw_samples.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/grid_file.h"

namespace scree {
namespace {

void swap_bytes(std::byte* samples, std::int64_t count, std::size_t bytes) {
    for (std::int64_t i = 0; i < count; ++i, samples += bytes) std::reverse(samples, samples + bytes);
}

class RawDecoder final : public PixelDecoder {
public:
    RawDecoder(ByteFile file, const RawSamples& samples)
        : file_(std::move(file)), samples_(samples), sample_bytes_(memory_bytes(samples.type)) {
        layout_ = {samples.width, samples.height, samples.channels, -1, samples.type, 0};
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        const auto sample_bytes = static_cast<std::int64_t>(sample_bytes_);
        const std::int64_t row_samples = samples_.width * samples_.channels;
        const bool interleaved =
            samples_.pixel_bytes == samples_.channels * sample_bytes && samples_.channel_bytes == sample_bytes;
        for (std::int64_t row = begin; row < end; ++row, out += row_samples * sample_bytes) {
            const std::int64_t at = samples_.first + row * samples_.row_bytes;
            const auto read = interleaved
                                  ? file_.read_at(at, {out, static_cast<std::size_t>(row_samples) * sample_bytes_})
                                  : gather_row(at, out);
            if (!read) return read;
            if (samples_.big_endian) swap_bytes(out, row_samples, sample_bytes_);
        }
        return {};
    }

private:
    // Each channel's samples of a row lie together (they do in all layouts but the interleaved one).
    Result<void> gather_row(std::int64_t at, std::byte* out) {
        assert(samples_.pixel_bytes == static_cast<std::int64_t>(sample_bytes_));
        line_.resize(static_cast<std::size_t>(samples_.width) * sample_bytes_);
        for (int channel = 0; channel < samples_.channels; ++channel) {
            if (auto read = file_.read_at(at + channel * samples_.channel_bytes, line_); !read) return read;
            std::byte* to = out + static_cast<std::size_t>(channel) * sample_bytes_;
            for (std::size_t from = 0; from < line_.size(); from += sample_bytes_) {
                std::memcpy(to, line_.data() + from, sample_bytes_);
                to += static_cast<std::size_t>(samples_.channels) * sample_bytes_;
            }
        }
        return {};
    }

    ByteFile file_;
    RawSamples samples_;
    std::size_t sample_bytes_;
    DecodedLayout layout_;
    std::vector<std::byte> line_;
};

// Bytes up to the end of the sample that lies farthest, saturated. Where rows go backwards that is one of the first.
std::int64_t bytes_needed(const RawSamples& s) {
    const auto last = [](std::int64_t count, std::int64_t step) {
        std::int64_t product = 0;
        return __builtin_mul_overflow(count - 1, std::max<std::int64_t>(step, 0), &product)
                   ? std::numeric_limits<std::int64_t>::max()
                   : product;
    };
    std::int64_t sum = static_cast<std::int64_t>(memory_bytes(s.type));
    for (const std::int64_t part :
         {s.first, last(s.height, s.row_bytes), last(s.width, s.pixel_bytes), last(s.channels, s.channel_bytes)}) {
        if (__builtin_add_overflow(sum, part, &sum)) return std::numeric_limits<std::int64_t>::max();
    }
    return sum;
}

}  // namespace

Result<std::unique_ptr<PixelDecoder>> make_raw_decoder(ByteFile file, const RawSamples& samples) {
    assert(samples.width > 0 && samples.height > 0 && samples.channels > 0 && samples.type != SampleType::f16);
    assert(samples.first + (samples.height - 1) * std::min<std::int64_t>(samples.row_bytes, 0) >= 0);
    assert(samples.first >= 0 && samples.pixel_bytes >= 0 && samples.channel_bytes >= 0);
    const std::int64_t needed = bytes_needed(samples);
    if (needed > file.size())
        return unusable_grid(file.path(),
                             fmt::format("{} x {} samples of {} channels need {} bytes, but the file has {}; it is cut "
                                         "off or its header is another file's",
                                         samples.width, samples.height, samples.channels, needed, file.size()));
    return std::unique_ptr<PixelDecoder>(std::make_unique<RawDecoder>(std::move(file), samples));
}

}  // namespace scree
