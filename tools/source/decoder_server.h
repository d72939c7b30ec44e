// The inside of a decoder program: a server that has its libraries loaded and forks one process for each file. The
// server itself never looks at a file, so it lives as long as the program that started it.
#pragma once

#include <memory>
#include <string>

#include "common/result.h"
#include "tools/source/pixel_decoder.h"

namespace scree {

struct DecoderProgram {
    void (*prepare)();  ///< once, before the first fork: what every file needs
    Result<std::unique_ptr<PixelDecoder>> (*open)(const std::string& path, const ImageHeader& header);
};

/// Serves at kServerDescriptor until the other side is gone; returns the exit code. Call it with no other thread about.
int serve_decoders(const DecoderProgram& program);

}  // namespace scree
