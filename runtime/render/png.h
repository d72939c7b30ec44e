// A picture as PNG, in memory or in a file. Any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "common/result.h"

namespace scree {

/// The bytes of a PNG file; `rgb` as below. Errors (ErrorCode::io): no memory.
Result<std::vector<std::uint8_t>> encode_png(int width_px, int height_px, std::span<const std::uint8_t> rgb);

/// `rgb`: sRGB RGB8, top row first, 3 * width_px * height_px bytes. The file appears whole under its name or not at
/// all; one that was there is replaced. Errors (ErrorCode::io) name the path and the cause.
Result<void> write_png(const std::filesystem::path& path, int width_px, int height_px,
                       std::span<const std::uint8_t> rgb);

}  // namespace scree
