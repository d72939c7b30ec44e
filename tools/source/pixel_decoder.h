// What turns rows of one open file into samples in memory: libtiff for TIFFs, our own readers for grids (grid_file.h),
// OpenImageIO for all others.
// One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/result.h"
#include "tools/source/image_header.h"
#include "tools/source/image_source.h"

namespace scree {

struct DecodedLayout {
    std::int64_t width = 0;
    std::int64_t height = 0;
    int channels = 0;
    int alpha_channel = -1;
    SampleType type = SampleType::u8;  ///< f16 is handed out widened to float
    std::int64_t tile_rows = 0;        ///< 0: strips or lines
};

/// Bytes of a sample in memory.
std::size_t memory_bytes(SampleType type);

class PixelDecoder {
public:
    virtual ~PixelDecoder() = default;
    virtual const DecodedLayout& layout() const = 0;
    /// Rows [begin, end), all channels interleaved, into out; begin is the first row of a strip or row of tiles.
    /// An Error holds the bare reason; the caller adds file and rows.
    virtual Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) = 0;
};

/// The same with memory of its own for the rows. One thread at a time.
class BandDecoder {
public:
    virtual ~BandDecoder() = default;
    virtual const DecodedLayout& layout() const = 0;
    /// Rows [begin, end) as PixelDecoder::decode gives them, in memory that is good until the next call.
    virtual Result<const std::byte*> decode(std::int64_t begin, std::int64_t end) = 0;
};

/// In this process: for readers of our own, which check all that a file claims. Others run apart
/// (isolated_decoder.h).
std::unique_ptr<BandDecoder> decode_here(std::unique_ptr<PixelDecoder> decoder);

/// What every file needs of OpenImageIO, ahead of the first one.
void load_openimageio();

/// Both return Errors (ErrorCode::input) with whole messages. make_tiff_decoder needs header.plain_tiff.
Result<std::unique_ptr<PixelDecoder>> make_tiff_decoder(const std::string& path, const ImageHeader& header);
Result<std::unique_ptr<PixelDecoder>> make_openimageio_decoder(const std::string& path, const ImageHeader& header);

}  // namespace scree
