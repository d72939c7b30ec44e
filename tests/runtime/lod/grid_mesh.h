// GridMesh: meshes of one tile on the restricted square grid, made by recursive bisection of its two root triangles
// without the code of runtime/lod: for tests of what draws and judges meshes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tests/common/test_support.h"

namespace scree::test {

class GridMesh {
public:
    /// With its corners alone: two triangles.
    explicit GridMesh(int tile_cells_log2);

    /// Every vertex of a stride.
    void select_stride(int stride);
    /// Every vertex with a chance of `percent`.
    void select_random(Random& random, int percent);
    void set(int i, int j, bool selected) { selected_[index(i, j)] = selected ? 1 : 0; }
    /// Three indices a triangle, counter-clockwise from above, of the vertices selected and those that they depend on.
    std::vector<std::uint32_t> indices();

private:
    struct Vertex {
        int i, j;
    };
    using Triangle = std::array<Vertex, 3>;  ///< the apex, then the ends of the hypotenuse, counter-clockwise

    std::size_t index(int i, int j) const { return static_cast<std::size_t>(j * (cells_ + 1) + i); }
    bool is_selected(const Triangle& t) const;
    void close(const Triangle& t, int level, int wanted);
    void emit(const Triangle& t, int level, std::vector<std::uint32_t>& out) const;
    static std::array<Triangle, 2> halves(const Triangle& t);

    int cells_, levels_;
    std::array<Triangle, 2> roots_;
    std::vector<std::uint8_t> selected_;
};

}  // namespace scree::test
