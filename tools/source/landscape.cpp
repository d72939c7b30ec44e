// Gradient noise with analytic derivatives (K. Perlin, "Improving Noise", 2002) summed as the slope-warped ridged
// multifractal that G. de Carpentier calls Swiss turbulence ("Scape: procedural extensions", 2011): each octave is
// moved by the slope of those before it, which pulls ridges sharp and lets flanks run down in gullies as erosion does.
#include "tools/source/landscape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace scree {
namespace {

// 11 km ridges halved nine times reach 21 m, two samples at 10 m spacing.
constexpr double kRidgeWavelength_m = 11000;
constexpr int kRidgeOctaves = 10;
constexpr double kRangeWavelength_m = 52000;  // where there are mountains at all
constexpr double kBendWavelength_m = 4100;
constexpr double kKnollWavelength_m = 1900;  // what makes shores wind
constexpr double kBend_m = 420;
constexpr double kFloorWavelength_m = 21000;  // how high the valley floors lie

struct Noise {
    float value = 0;  ///< about -1..1
    float slope_x = 0;
    float slope_y = 0;
};

struct Cell {
    std::int32_t x = 0;
    std::int32_t y = 0;
    float u = 0;  ///< place within the cell, 0..1
    float v = 0;
};

std::int32_t floor_to_int(double value) {
    const auto truncated = static_cast<std::int32_t>(value);
    return truncated - (value < truncated ? 1 : 0);
}

Cell cell_of(double x, double y) {
    const std::int32_t i = floor_to_int(x);
    const std::int32_t j = floor_to_int(y);
    return {i, j, static_cast<float>(x - i), static_cast<float>(y - j)};
}

std::uint32_t mix(std::uint32_t h) {
    h ^= h >> 15;
    h *= 0x2C1B3C6Du;
    h ^= h >> 12;
    h *= 0x297A2D39u;
    h ^= h >> 15;
    return h;
}

std::uint32_t hash(std::int32_t x, std::int32_t y, std::uint32_t salt) {
    return mix(static_cast<std::uint32_t>(x) * 0x9E3779B1u + static_cast<std::uint32_t>(y) * 0x85EBCA77u + salt);
}

float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

float fade_slope(float t) { return 30 * t * t * (t * (t - 2) + 1); }

struct Gradient {
    float x, y;
};

Gradient gradient(std::int32_t x, std::int32_t y, std::uint32_t salt) {
    constexpr float kScale = 1.0f / 32768;
    const std::uint32_t h = hash(x, y, salt);
    return {static_cast<float>(static_cast<std::int32_t>(h & 0xFFFFu) - 32768) * kScale,
            static_cast<float>(static_cast<std::int32_t>(h >> 16) - 32768) * kScale};
}

Noise gradient_noise(double x, double y, std::uint32_t salt) {
    constexpr float kToUnitRange = 1.7f;
    const Cell c = cell_of(x, y);
    const Gradient g00 = gradient(c.x, c.y, salt);
    const Gradient g10 = gradient(c.x + 1, c.y, salt);
    const Gradient g01 = gradient(c.x, c.y + 1, salt);
    const Gradient g11 = gradient(c.x + 1, c.y + 1, salt);
    const float a = g00.x * c.u + g00.y * c.v;
    const float b = g10.x * (c.u - 1) + g10.y * c.v;
    const float d = g01.x * c.u + g01.y * (c.v - 1);
    const float e = g11.x * (c.u - 1) + g11.y * (c.v - 1);
    const float u = fade(c.u);
    const float v = fade(c.v);
    const float twist = a - b - d + e;
    const float value = a + u * (b - a) + v * (d - a) + u * v * twist;
    const float slope_x = g00.x + u * (g10.x - g00.x) + v * (g01.x - g00.x) + u * v * (g00.x - g10.x - g01.x + g11.x) +
                          fade_slope(c.u) * (b - a + v * twist);
    const float slope_y = g00.y + u * (g10.y - g00.y) + v * (g01.y - g00.y) + u * v * (g00.y - g10.y - g01.y + g11.y) +
                          fade_slope(c.v) * (d - a + u * twist);
    return {value * kToUnitRange, slope_x * kToUnitRange, slope_y * kToUnitRange};
}

// Bilinear with a cubic fade: coarser than gradient noise, a third of its cost; for grain, not for ground. 0..1.
float value_noise(double x, double y, std::uint32_t salt) {
    constexpr float kScale = 1.0f / 16777216;
    const Cell c = cell_of(x, y);
    const auto corner = [&](std::int32_t dx, std::int32_t dy) {
        return static_cast<float>(hash(c.x + dx, c.y + dy, salt) >> 8) * kScale;
    };
    const float u = c.u * c.u * (3 - 2 * c.u);
    const float v = c.v * c.v * (3 - 2 * c.v);
    const float top = corner(0, 0) + u * (corner(1, 0) - corner(0, 0));
    const float bottom = corner(0, 1) + u * (corner(1, 1) - corner(0, 1));
    return top + v * (bottom - top);
}

float clamp01(float value) { return std::min(1.0f, std::max(0.0f, value)); }

float smoothstep(float low, float high, float value) {
    const float t = clamp01((value - low) / (high - low));
    return t * t * (3 - 2 * t);
}

// The larger of two, rounded over a height of k.
float smooth_max(float a, float b, float k) {
    const float d = a - b;
    return 0.5f * (a + b + std::sqrt(d * d + k * k));
}

// One place's sum so far. Octaves of one place wait for each other; places side by side do not, and keep the processor
// busy: hence lanes.
struct Ridges {
    double x = 0;
    double y = 0;
    float sum = 0;
    float amplitude = 1;
    float warp_x = 0;
    float warp_y = 0;
};
constexpr std::size_t kLanes = 16;

void swiss_turbulence(std::span<Ridges> lanes, std::uint32_t salt) {
    constexpr float kGain = 0.475f;
    constexpr float kWarp = 0.125f;
    float frequency = 1;
    // The crests of the largest ridges are rounded, or they would run for miles as one crease.
    float rounding = 0.05f;
    // Octaves are turned by the angle of the 3-4-5 triangle, so that their lattices never line up.
    float cosine = 1;
    float sine = 0;
    for (int octave = 0; octave < kRidgeOctaves; ++octave) {
        const std::uint32_t octave_salt = salt + static_cast<std::uint32_t>(octave) * 0x632BE5ABu;
        for (Ridges& lane : lanes) {
            const double px = (lane.x + static_cast<double>(kWarp * lane.warp_x)) * static_cast<double>(frequency);
            const double py = (lane.y + static_cast<double>(kWarp * lane.warp_y)) * static_cast<double>(frequency);
            const Noise n =
                gradient_noise(static_cast<double>(cosine) * px - static_cast<double>(sine) * py,
                               static_cast<double>(sine) * px + static_cast<double>(cosine) * py, octave_salt);
            const float fold = std::sqrt(n.value * n.value + rounding * rounding);
            lane.sum += lane.amplitude * (1 - fold);
            const float toward = -lane.amplitude * n.value;
            lane.warp_x += toward * (cosine * n.slope_x + sine * n.slope_y);
            lane.warp_y += toward * (cosine * n.slope_y - sine * n.slope_x);
            lane.amplitude *= kGain * clamp01(lane.sum);
        }
        rounding *= 0.6f;
        frequency *= 2;
        const float turned = 0.8f * cosine - 0.6f * sine;
        sine = 0.6f * cosine + 0.8f * sine;
        cosine = turned;
    }
}

struct Shade {
    float red, green, blue;
};

Shade blend(const Shade& from, const Shade& to, float t) {
    return {from.red + t * (to.red - from.red), from.green + t * (to.green - from.green),
            from.blue + t * (to.blue - from.blue)};
}

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::min(255.0f, std::max(0.0f, value)) + 0.5f); }

}  // namespace

Landscape::Landscape(std::uint64_t seed)
    : salt_(mix(static_cast<std::uint32_t>(seed) ^ mix(static_cast<std::uint32_t>(seed >> 32) + 0x9E3779B9u))) {}

void Landscape::heights_m(double first_east_m, double step_m, double south_m, std::span<float> out) const {
    std::array<Ridges, kLanes> ridges;
    std::array<Range, kLanes> ranges;
    for (std::size_t begin = 0; begin < out.size(); begin += kLanes) {
        const std::size_t count = std::min(kLanes, out.size() - begin);
        for (std::size_t i = 0; i < count; ++i) {
            const double east_m = first_east_m + static_cast<double>(begin + i) * step_m;
            ranges[i] = range_at(east_m, south_m);
            // Bending the plan makes the long ridges wind and their spurs differ.
            const double bend_x = east_m / kBendWavelength_m;
            const double bend_y = south_m / kBendWavelength_m;
            const auto bend_east = static_cast<double>(gradient_noise(bend_x, bend_y, salt_ + 4).value);
            const auto bend_south = static_cast<double>(gradient_noise(bend_x, bend_y, salt_ + 5).value);
            ridges[i] = {.x = (east_m + kBend_m * bend_east) / kRidgeWavelength_m,
                         .y = (south_m + kBend_m * bend_south) / kRidgeWavelength_m};
        }
        swiss_turbulence(std::span(ridges).first(count), salt_ + 3);
        for (std::size_t i = 0; i < count; ++i) {
            const float rise = std::max(0.0f, ridges[i].sum - 0.62f);
            const float mountain = 250 + 2250 * ranges[i].uplift * rise * (0.45f + 0.45f * rise);
            const float floor_m = ranges[i].floor_m + 0.04f * mountain;
            out[begin + i] = std::max(kLakeLevel_m, smooth_max(mountain, floor_m, 150) - 40);
        }
    }
}

float Landscape::height_m(double east_m, double south_m) const {
    float height = 0;
    heights_m(east_m, 0, south_m, std::span(&height, 1));
    return height;
}

Landscape::Range Landscape::range_at(double east_m, double south_m) const {
    const Noise range =
        gradient_noise(east_m / kRangeWavelength_m + 0.37, south_m / kRangeWavelength_m + 0.61, salt_ + 1);
    const Noise floor_noise = gradient_noise(east_m / kFloorWavelength_m, south_m / kFloorWavelength_m, salt_ + 2);
    const Noise knolls = gradient_noise(east_m / kKnollWavelength_m, south_m / kKnollWavelength_m, salt_ + 6);
    return {0.62f + 0.38f * smoothstep(-0.55f, 0.55f, range.value + 0.35f * floor_noise.value),
            520 + 260 * floor_noise.value + 26 * knolls.value};
}

Cover Landscape::cover(double east_m, double south_m) const {
    return {value_noise((0.8 * east_m - 0.6 * south_m) / 260, (0.6 * east_m + 0.8 * south_m) / 230, salt_ + 22),
            value_noise(east_m / 1700 + 0.1, south_m / 1500, salt_ + 23)};
}

Colour Landscape::colour(double east_m, double south_m, const Ground& place) const {
    const auto& [ground_m, slope_east, slope_south, cover_here] = place;
    const auto& [patch, wide] = cover_here;
    const float grain = value_noise(east_m / 4.5, south_m / 4.5, salt_ + 20);
    const float clump = value_noise(east_m / 19 + 0.3, south_m / 17, salt_ + 21);
    const float steep = std::sqrt(slope_east * slope_east + slope_south * slope_south);

    constexpr Shade kForest{66, 86, 54};
    constexpr Shade kMeadow{100, 112, 66};
    constexpr Shade kField{136, 134, 92};
    constexpr Shade kTurf{112, 108, 74};
    constexpr Shade kRock{122, 114, 104};
    constexpr Shade kScree{146, 139, 128};
    constexpr Shade kSnow{238, 241, 246};
    constexpr Shade kShore{112, 110, 84};
    constexpr Shade kDeep{24, 46, 62};

    if (ground_m <= kLakeLevel_m) {
        const float ripple = 3 * (wide - 0.5f) + 2 * (clump - 0.5f);
        return {to_byte(kDeep.red + ripple), to_byte(kDeep.green + ripple), to_byte(kDeep.blue + ripple)};
    }

    const float ruggedness = 120 * (patch - 0.5f) + 260 * (wide - 0.5f) + 50 * (clump - 0.5f);
    // Valley floors are farmed where flat, forest climbs to the tree line, turf and rock above it, snow on top.
    Shade ground = blend(kMeadow, kField, smoothstep(0.2f, 0.8f, patch + 0.3f * (clump - 0.5f)));
    const float wooded =
        smoothstep(0.05f, 0.13f, steep + 0.10f * (patch - 0.5f) + 0.10f * (wide - 0.35f) + 0.0004f * (ground_m - 600));
    ground = blend(ground, kForest, wooded);
    const float tree_line = 1560 + ruggedness;
    ground = blend(ground, kTurf, smoothstep(tree_line - 90, tree_line + 130, ground_m));
    const float bare = std::max(smoothstep(0.72f, 1.05f, steep + 0.25f * (clump - 0.5f) + 0.0001f * (ground_m - 1500)),
                                smoothstep(1950 + ruggedness, 2350 + ruggedness, ground_m));
    ground = blend(ground, blend(kRock, kScree, clamp01(1.6f * clump - 0.3f)), bare);
    ground = blend(kShore, ground, smoothstep(kLakeLevel_m, kLakeLevel_m + 5, ground_m));
    // Snow lies lower on the north side (the ground rises southward there) and slides off what is steep.
    const float snow_line = 2320 + 0.7f * ruggedness - 260 * std::min(1.0f, std::max(-1.0f, slope_south));
    const float snow = smoothstep(snow_line - 60, snow_line + 160, ground_m) *
                       (1 - smoothstep(0.95f, 1.45f, steep + 0.3f * (clump - 0.5f)));
    ground = blend(ground, kSnow, snow);

    // Sun from the north-west at 45 degrees; the sky keeps what it does not reach at more than half.
    const float facing = (0.5f * slope_east + 0.5f * slope_south + 0.7071068f) / std::sqrt(1 + steep * steep);
    const float light = 0.50f + 0.70f * std::max(0.0f, facing);
    const float roughness = snow > 0.5f ? 0.05f : 0.16f + 0.10f * wooded;
    const float tone = light * (1 + roughness * (grain + 0.8f * clump - 0.9f));
    return {to_byte(ground.red * tone), to_byte(ground.green * tone), to_byte(ground.blue * tone)};
}

}  // namespace scree
