// Samples that lie in a file as they are in memory, but for the order of their bytes and rows: at
// first + row * row_bytes + column * pixel_bytes + channel * channel_bytes. Where the file begins with the southernmost
// row, `first` is its last row and row_bytes is negative: a lattice takes over as they are only samples that are
// north-up.
#pragma once

#include <cstdint>
#include <memory>

#include "common/result.h"
#include "tools/source/byte_file.h"
#include "tools/source/pixel_decoder.h"

namespace scree {

struct RawSamples {
    std::int64_t width = 0;
    std::int64_t height = 0;
    int channels = 1;
    SampleType type = SampleType::u8;  ///< not f16
    bool big_endian = false;
    std::int64_t first = 0;
    std::int64_t row_bytes = 0, pixel_bytes = 0, channel_bytes = 0;  ///< steps
};

/// `first` and the rows before it lie behind the file's beginning. Errors: ErrorCode::input where the file ends before
/// its last sample.
Result<std::unique_ptr<PixelDecoder>> make_raw_decoder(ByteFile file, const RawSamples& samples);

}  // namespace scree
