#include "experiments/claims/terrain.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "common/query/ground.h"
#include "common/store/sqlite_store.h"

namespace scree {
namespace {

constexpr std::int64_t kMostSamples = 4097;

// Integers only, so that every machine makes the same ground.
std::uint32_t hash(std::uint64_t seed, int octave, std::int64_t i, std::int64_t j) {
    std::uint64_t h = seed + 0x9E3779B97F4A7C15u * static_cast<std::uint64_t>(octave + 1);
    for (const std::int64_t part : {i, j}) {
        h ^= static_cast<std::uint64_t>(part) + 0x9E3779B97F4A7C15u + (h << 6) + (h >> 2);
        h *= 0xBF58476D1CE4E5B9u;
        h ^= h >> 29;
    }
    return static_cast<std::uint32_t>(h >> 32);
}

/// Noise of one wavelength, -1 .. 1, smooth over its cells.
double noise(std::uint64_t seed, int octave, double x, double y) {
    const double fx = std::floor(x), fy = std::floor(y);
    const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy);
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    const double u = smooth(x - fx), v = smooth(y - fy);
    const auto corner = [&](std::int64_t di, std::int64_t dj) {
        return static_cast<double>(hash(seed, octave, i + di, j + dj)) / 2147483648.0 - 1;
    };
    const double north = corner(0, 0) * (1 - u) + corner(1, 0) * u, south = corner(0, 1) * (1 - u) + corner(1, 1) * u;
    return north * (1 - v) + south * v;
}

/// Ridged multifractal: sharp crests where noise crosses 0, and detail that grows with height.
double ridges(std::uint64_t seed, double x_m, double y_m) {
    double sum = 0, weight = 1, gain = 1;
    double wavelength_m = 6000;
    for (int octave = 0; octave < 8; ++octave) {
        const double ridge = 1 - std::abs(noise(seed, octave, x_m / wavelength_m, y_m / wavelength_m));
        const double signal = ridge * ridge * weight;
        sum += signal * gain;
        weight = std::clamp(signal * 1.6, 0.0, 1.0);
        gain *= 0.5;
        wavelength_m *= 0.5;
    }
    return sum;
}

}  // namespace

double Terrain::highest_m() const { return quantum_m * *std::max_element(heights_n.begin(), heights_n.end()); }
double Terrain::lowest_m() const { return quantum_m * *std::min_element(heights_n.begin(), heights_n.end()); }

double Terrain::ground_m(double x, double y) const {
    const auto nearest = [&](double metres, int count) {
        return static_cast<int>(std::clamp(std::round(metres / spacing_m), 0.0, static_cast<double>(count - 1)));
    };
    return z_m(nearest(x, columns), nearest(-y, rows));
}

Result<Terrain> terrain_of_store(const std::string& path, int least_side) {
    auto store = SqliteStore::open(path);
    if (!store) return store.error();
    const Dataset& d = (*store)->dataset();
    const Lattice& l = d.lattice;
    if (std::min(l.cells_x, l.cells_y) + 1 < least_side || std::max(l.cells_x, l.cells_y) + 1 > kMostSamples)
        return Error{ErrorCode::input, fmt::format("{}: {} x {} samples; experiments are made on {} to {} a side", path,
                                                   l.cells_x + 1, l.cells_y + 1, least_side, kMostSamples)};
    auto ground = Ground::open(**store);
    if (!ground) return ground.error();
    Terrain terrain{std::filesystem::path(path).stem().string(),
                    static_cast<int>(l.cells_x) + 1,
                    static_cast<int>(l.cells_y) + 1,
                    l.spacing_m,
                    d.height_quantum_m,
                    {}};
    terrain.heights_n.reserve(static_cast<std::size_t>(terrain.columns) * static_cast<std::size_t>(terrain.rows));
    for (int j = 0; j < terrain.rows; ++j)
        for (int i = 0; i < terrain.columns; ++i) {
            const auto at = (*ground)->height(l.x_m(i), l.y_m(j));
            if (!at) return at.error();
            if (!at->has_value())
                return Error{
                    ErrorCode::input,
                    fmt::format("{}: no height at column {}, row {}; experiments need all of them", path, i, j)};
            const double quanta = (at->value().height_m - d.height_offset_m) / d.height_quantum_m;
            terrain.heights_n.push_back(static_cast<std::int32_t>(std::lround(quanta)));
        }
    return terrain;
}

Terrain ridged_terrain(int side, std::uint64_t seed) {
    Terrain terrain{"ridged", side, side, 40, 1.0 / 64, {}};
    std::vector<double> raw;
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) raw.push_back(ridges(seed, terrain.spacing_m * i, terrain.spacing_m * j));
    const auto [low, high] = std::minmax_element(raw.begin(), raw.end());
    const double base = *low, relief = std::max(*high - *low, 1e-9);
    for (const double value : raw)
        terrain.heights_n.push_back(
            static_cast<std::int32_t>(std::lround((2 + 1100 * (value - base) / relief) / terrain.quantum_m)));
    return terrain;
}

std::vector<std::int32_t> block_heights(const Terrain& terrain, int i, int j, int cells_log2) {
    std::vector<std::int32_t> heights;
    const int cells = 1 << cells_log2;
    heights.reserve(static_cast<std::size_t>(cells + 1) * static_cast<std::size_t>(cells + 1));
    for (int y = j; y <= j + cells; ++y)
        for (int x = i; x <= i + cells; ++x) heights.push_back(terrain.n(x, y));
    return heights;
}

}  // namespace scree
