// The mesh that `shot --mesh` writes, asked for heights and looked over for cracks by arithmetic of its own: nothing
// here knows tiles, levels or the project's lattice.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace scree::test {

struct PlyMesh {
    std::vector<std::array<double, 3>> vertices;
    std::vector<std::array<std::int32_t, 3>> triangles;  ///< counter-clockwise from above where it is terrain
};

/// Binary little-endian PLY of double x, y, z and triangles. Throws std::runtime_error on anything else.
PlyMesh read_ply(const std::string& path);
/// The format that read_ply reads.
void write_ply(const std::string& path, const PlyMesh& mesh);

class PlySurface {
public:
    explicit PlySurface(PlyMesh mesh);

    /// Height straight above or below (x, y): the highest where triangles overlap; nullopt off the mesh. Borders of
    /// triangles belong to them, up to the rounding of a double.
    std::optional<double> height(double x, double y) const;
    /// Spread of heights over (x, y): 0 on a surface without cracks or overlaps in z.
    double spread(double x, double y) const;

    struct Seams {
        std::int64_t edges = 0;        ///< distinct pairs of positions that a triangle joins
        std::int64_t open_edges = 0;   ///< used by one triangle only, or twice in one direction: border or crack
        std::int64_t t_junctions = 0;  ///< open edges with another vertex inside them, seen from above
        std::int64_t cracks = 0;       ///< open edges with terrain on both sides, seen from above
        std::int64_t upside_down = 0;  ///< triangles that are not counter-clockwise from above
    };
    Seams seams() const;

    const PlyMesh& mesh() const { return mesh_; }

private:
    struct Heights {
        int count = 0;
        double lowest = 0, highest = 0;
    };
    Heights over(double x, double y) const;
    std::int64_t column_of(double x) const;
    std::int64_t row_of(double y) const;

    PlyMesh mesh_;
    double west_ = 0, south_ = 0, cell_ = 1;
    std::int64_t columns_ = 1, rows_ = 1;
    std::vector<std::size_t> first_;     ///< columns_ * rows_ + 1 entries into members_
    std::vector<std::int32_t> members_;  ///< triangles whose box meets the cell
};

}  // namespace scree::test
