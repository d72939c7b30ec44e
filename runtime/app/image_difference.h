// How far one picture is from another: PSNR over all sRGB bytes, and SSIM over luma (Wang, Bovik, Sheikh & Simoncelli,
// "Image Quality Assessment: From Error Visibility to Structural Similarity", IEEE TIP 13(4), 2004: 11 x 11 Gaussian
// window of sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255, windows inside the picture only). Any thread.
#pragma once

#include <cstdint>
#include <span>

namespace scree {

/// Stands for infinity: the pictures are the same.
inline constexpr double kSamePsnr_db = 100;

/// Mean of the squared differences of bytes, 0 .. 65025. Pictures of one size, not empty.
double mean_squared_difference(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b);
/// 10 log10(255^2 / mse), at most kSamePsnr_db.
double psnr_db(double mean_squared_difference);
/// -1 .. 1, 1 for the same picture. RGB8, luma 0.299 R + 0.587 G + 0.114 B of the bytes (ITU-R BT.601). Pictures
/// narrower or lower than the window are one window.
double ssim(int width_px, int height_px, std::span<const std::uint8_t> a, std::span<const std::uint8_t> b);

}  // namespace scree
