// Writes a picture as PNG. Any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "common/result.h"

namespace scree {

/// `rgb`: sRGB RGB8, top row first, 3 * width_px * height_px bytes. The file appears whole under its name or not at
/// all; one that was there is replaced. Errors (ErrorCode::io) name the path and the cause.
Result<void> write_png(const std::filesystem::path& path, int width_px, int height_px,
                       std::span<const std::uint8_t> rgb);

}  // namespace scree
