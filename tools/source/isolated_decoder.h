// Decoders that run in processes of their own (docs/decisions/0009-decoders-run-apart.md). Whatever a file does to its
// decoder - abort it, overflow its stack, make it spin or allocate without end - comes back as that file's Error.
// The programs `scree-decoder` (libtiff) and `scree-decoder-openimageio` are looked for in the folder that
// $SCREE_DECODERS names, in ../libexec/scree of the running program and beside it. All functions: any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/result.h"
#include "tools/source/image_header.h"
#include "tools/source/pixel_decoder.h"

namespace scree {

struct DecoderLimits {
    /// Memory that the decoding of one file may add to the decoder's own; 0: no limit. Smaller refuses more formats
    /// that decode whole frames, larger lets a hostile file take more.
    std::int64_t memory_bytes = 0;
    /// Processor time for a request that decodes nothing. Decoding gets a second more for every bytes_per_second.
    std::int64_t cpu_seconds = 4;
    std::int64_t bytes_per_second = std::int64_t{2} << 20;  ///< slowest decoders do five times as much
    /// Without an answer for so long a decoder that neither computes nor waits for a disk is given up; by the same
    /// rule.
    std::int64_t wall_seconds = 60;
};

/// Reads headers (a mask's, too) and georeference of a file where nothing can come to harm, before the caller does so
/// itself. Errors: those of read_image_header, or what became of the process (ErrorCode::input); ErrorCode::io where
/// there is no decoder program.
Result<void> try_headers(const std::string& path, const DecoderLimits& limits = {});

/// By libtiff for header.plain_tiff (of a mask, too), else by OpenImageIO. Errors as above and the decoder's.
Result<std::unique_ptr<BandDecoder>> open_isolated_decoder(const std::string& path, const ImageHeader& header,
                                                           const DecoderLimits& limits = {});

/// What all decoder processes took so far: processor time, and the peak of the memory that they held at one time.
struct DecoderUsage {
    double cpu_seconds = 0;
    std::int64_t peak_rss_bytes = 0;
};
DecoderUsage decoder_usage();

}  // namespace scree
