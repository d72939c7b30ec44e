// The ground that experiments are made on: a plain grid of heights, from a store or made up. x east, y north, metres,
// from the north-west sample at (0, 0).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "common/result.h"

namespace scree {

struct Terrain {
    std::string name;  ///< for captions
    int columns = 0, rows = 0;
    double spacing_m = 1;
    double quantum_m = 1;
    std::vector<std::int32_t> heights_n;  ///< quanta, row by row from the north-west

    std::int32_t n(int i, int j) const {
        return heights_n[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(i)];
    }
    double z_m(int i, int j) const { return quantum_m * n(i, j); }
    glm::dvec3 place(int i, int j) const { return {spacing_m * i, -spacing_m * j, z_m(i, j)}; }
    double width_m() const { return spacing_m * (columns - 1); }
    double depth_m() const { return spacing_m * (rows - 1); }
    double highest_m() const;
    double lowest_m() const;
    /// Of the sample nearest to a place, which may lie outside.
    double ground_m(double x, double y) const;
};

/// Every sample of the finest stored surface. Errors: those of the store; ErrorCode::input where it is larger than 4097
/// samples a side, smaller than `least_side`, or not present all over.
Result<Terrain> terrain_of_store(const std::string& path, int least_side);

/// Ridges of several wavelengths, 40 m cells, 2 to 1102 m. The same for the same seed and side, on any machine.
Terrain ridged_terrain(int side, std::uint64_t seed);

/// The (m + 1)^2 heights of a block with its north-west sample at (i, j), m = 2^cells_log2.
std::vector<std::int32_t> block_heights(const Terrain& terrain, int i, int j, int cells_log2);

}  // namespace scree
