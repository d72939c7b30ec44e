#include "runtime/app/image_difference.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace scree {
namespace {

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 255 * 0.01 * 255, kC2 = 0.03 * 255 * 0.03 * 255;

// Doubles: a variance is a small difference of squares.
struct Plane {
    int width = 0, height = 0;
    std::vector<double> values;
    double* row(int y) { return values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }
    const double* row(int y) const {
        return values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    }
};

Plane plane_of(int width, int height) {
    return {width, height, std::vector<double>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
}

Plane luma(int width, int height, std::span<const std::uint8_t> rgb) {
    Plane plane = plane_of(width, height);
    for (std::size_t k = 0; k < plane.values.size(); ++k)
        plane.values[k] = 0.299 * rgb[3 * k] + 0.587 * rgb[3 * k + 1] + 0.114 * rgb[3 * k + 2];
    return plane;
}

Plane product(const Plane& a, const Plane& b) {
    Plane p = plane_of(a.width, a.height);
    for (std::size_t k = 0; k < p.values.size(); ++k) p.values[k] = a.values[k] * b.values[k];
    return p;
}

std::vector<double> window(int length) {
    std::vector<double> w(static_cast<std::size_t>(length));
    double sum = 0;
    const auto weight = [&](int k) {
        const double x = k - (length - 1) / 2.0;
        return std::exp(-x * x / (2 * kSigma * kSigma));
    };
    for (int k = 0; k < length; ++k) sum += weight(k);
    for (int k = 0; k < length; ++k) w[static_cast<std::size_t>(k)] = weight(k) / sum;
    return w;
}

// Weighted means over the windows that lie inside.
Plane blurred(const Plane& p, const std::vector<double>& across, const std::vector<double>& down) {
    Plane rows = plane_of(p.width - static_cast<int>(across.size()) + 1, p.height);
    for (int y = 0; y < rows.height; ++y)
        for (std::size_t k = 0; k < across.size(); ++k) {
            const double* from = p.row(y) + k;
            double* to = rows.row(y);
            for (int x = 0; x < rows.width; ++x) to[x] += across[k] * from[x];
        }
    Plane all = plane_of(rows.width, rows.height - static_cast<int>(down.size()) + 1);
    for (int y = 0; y < all.height; ++y)
        for (std::size_t k = 0; k < down.size(); ++k) {
            const double* from = rows.row(y + static_cast<int>(k));
            double* to = all.row(y);
            for (int x = 0; x < all.width; ++x) to[x] += down[k] * from[x];
        }
    return all;
}

}  // namespace

double mean_squared_difference(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
    assert(a.size() == b.size() && !a.empty());
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        const double d = static_cast<double>(a[k]) - b[k];
        sum += d * d;
    }
    return sum / static_cast<double>(a.size());
}

double psnr_db(double mse) {
    if (!(mse > 0)) return kSamePsnr_db;
    return std::min(kSamePsnr_db, 10 * std::log10(255.0 * 255.0 / mse));
}

double ssim(int width, int height, std::span<const std::uint8_t> rgb_a, std::span<const std::uint8_t> rgb_b) {
    assert(width >= 1 && height >= 1 && rgb_a.size() == rgb_b.size());
    assert(rgb_a.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const std::vector<double> across = window(std::min(width, 2 * kRadius + 1)),
                              down = window(std::min(height, 2 * kRadius + 1));
    const Plane a = luma(width, height, rgb_a), b = luma(width, height, rgb_b);
    const Plane mean_a = blurred(a, across, down), mean_b = blurred(b, across, down),
                square_a = blurred(product(a, a), across, down), square_b = blurred(product(b, b), across, down),
                both = blurred(product(a, b), across, down);
    double sum = 0;
    for (std::size_t k = 0; k < mean_a.values.size(); ++k) {
        const double ma = mean_a.values[k], mb = mean_b.values[k];
        const double variance_a = std::max(0.0, square_a.values[k] - ma * ma),
                     variance_b = std::max(0.0, square_b.values[k] - mb * mb), covariance = both.values[k] - ma * mb;
        sum += (2 * ma * mb + kC1) * (2 * covariance + kC2) /
               ((ma * ma + mb * mb + kC1) * (variance_a + variance_b + kC2));
    }
    return sum / static_cast<double>(mean_a.values.size());
}

}  // namespace scree
