#include "tests/common/query/small_world.h"

#include <algorithm>
#include <cmath>

#include "common/store/height_codec.h"

namespace scree::test {
namespace {

class SmallReader final : public TileReader {
public:
    explicit SmallReader(const SmallWorld& world) : world_(world) {}
    Result<bool> read(TileKind, TileId id, TileRow& row) override {
        ++world_.reads;
        const auto found = world_.tiles().find(id);
        if (found == world_.tiles().end() || world_.lost.contains(id)) return false;
        row.codec = static_cast<int>(HeightCodec::plane);
        row.payload = encode_height_tile(found->second, world_.lattice().tile_cells_log2, HeightCodec::plane);
        if (world_.cut.contains(id)) row.payload.resize(row.payload.size() / 2);
        return true;
    }

private:
    const SmallWorld& world_;
};

// Height at (u, v) of a cell split by the rule. Written out, apart from the code under test.
double in_cell(bool even, double nw, double ne, double sw, double se, double u, double v) {
    if (even) return u > v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
    if (u + v < 1) return nw + u * (ne - nw) + v * (sw - nw);
    return se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
}

}  // namespace

SmallWorld::SmallWorld(const WorldShape& s, Heights heights, Presence presence)
    : heights_(std::move(heights)), presence_(std::move(presence)), depth_(s.depth) {
    auto lattice = make_lattice(s.origin_x_m, s.origin_y_m, s.spacing_m, s.cells_x, s.cells_y, s.tile_cells_log2);
    EXPECT_TRUE(lattice.ok());
    dataset_.lattice = *lattice;
    dataset_.height_offset_m = s.height_offset_m;
    dataset_.height_quantum_m = s.quantum_m;
    dataset_.height_quantum_error_m = s.quantum_error_m;
    dataset_.warp_error_m = s.warp_error_m;
    for (int level = lattice->deepest_level; level >= 0; --level)
        for (std::int64_t y = 0; y < lattice->tiles_y(level); ++y)
            for (std::int64_t x = 0; x < lattice->tiles_x(level); ++x) make_tile({level, x, y});
}

Result<std::unique_ptr<TileReader>> SmallWorld::open_reader() const {
    return std::unique_ptr<TileReader>(new SmallReader(*this));
}

bool SmallWorld::source_present(std::int64_t i, std::int64_t j) const {
    return i >= 0 && j >= 0 && i < lattice().cells_x && j < lattice().cells_y && (!presence_ || presence_(i, j));
}

bool SmallWorld::present(std::int64_t i, std::int64_t j) const {
    if (!source_present(i, j)) return false;
    const LeafCell cell = leaf_cell(i, j);
    for (std::int64_t v = cell.j; v < cell.j + cell.side; ++v)
        for (std::int64_t u = cell.i; u < cell.i + cell.side; ++u)
            if (!source_present(u, v)) return false;
    return true;
}

SmallWorld::LeafCell SmallWorld::leaf_cell(std::int64_t ci, std::int64_t cj) const {
    const Lattice& l = lattice();
    const TileId deepest{l.deepest_level, ci >> l.tile_cells_log2, cj >> l.tile_cells_log2};
    int level = 0;
    while (level < l.deepest_level && depth_.refined(ancestor_at(deepest, level))) ++level;
    const std::int64_t side = l.step(level);
    return {level, ci / side * side, cj / side * side, side};
}

Vector3 SmallWorld::vertex(std::int64_t i, std::int64_t j) const {
    return {x_m(static_cast<double>(i)), y_m(static_cast<double>(j)), height_m(i, j)};
}

std::array<std::array<Vector3, 3>, 2> SmallWorld::triangles(std::int64_t ci, std::int64_t cj) const {
    const auto [level, i, j, side] = leaf_cell(ci, cj);
    const Vector3 nw = vertex(i, j), ne = vertex(i + side, j), sw = vertex(i, j + side),
                  se = vertex(i + side, j + side);
    if ((i / side + j / side) % 2 == 0) return {{{nw, sw, se}, {nw, se, ne}}};
    return {{{nw, sw, ne}, {ne, sw, se}}};
}

double SmallWorld::surface_n(std::int64_t ci, std::int64_t cj, double i, double j) const {
    const auto [level, wi, nj, side] = leaf_cell(ci, cj);
    const auto width = static_cast<double>(side);
    return in_cell((wi / side + nj / side) % 2 == 0, heights_(wi, nj), heights_(wi + side, nj), heights_(wi, nj + side),
                   heights_(wi + side, nj + side), (i - static_cast<double>(wi)) / width,
                   (j - static_cast<double>(nj)) / width);
}

double SmallWorld::surface_m(std::int64_t ci, std::int64_t cj, double i, double j) const {
    return dataset_.height_m(surface_n(ci, cj, i, j));
}

// Greatest distance of the tile's surface, drawn whole, to the finest one at any vertex of a present cell.
float SmallWorld::own_error(TileId id, const HeightTile& tile) const {
    const Lattice& l = lattice();
    const std::int64_t step = l.step(id.level), m = l.tile_cells(), extent = l.tile_extent(id.level);
    const LatticePoint corner = l.corner(id);
    const auto sample = [&](std::int64_t c, std::int64_t r) {
        return static_cast<double>(tile.samples[static_cast<std::size_t>(r * (m + 1) + c)]);
    };
    double worst = 0;
    for (std::int64_t j = 0; j < extent; ++j)
        for (std::int64_t i = 0; i < extent; ++i) {
            if (!present(corner.i + i, corner.j + j)) continue;
            for (int k = 0; k < 4; ++k) {
                const std::int64_t vi = i + k % 2, vj = j + k / 2;
                const std::int64_t c = std::min(vi / step, m - 1), r = std::min(vj / step, m - 1);
                const double z =
                    in_cell((c + r) % 2 == 0, sample(c, r), sample(c + 1, r), sample(c, r + 1), sample(c + 1, r + 1),
                            static_cast<double>(vi - c * step) / static_cast<double>(step),
                            static_cast<double>(vj - r * step) / static_cast<double>(step));
                worst = std::max(worst,
                                 std::abs(z - surface_n(corner.i + i, corner.j + j, static_cast<double>(corner.i + vi),
                                                        static_cast<double>(corner.j + vj))));
            }
        }
    return std::nextafter(static_cast<float>(worst), INFINITY);
}

bool SmallWorld::make_tile(TileId id) {
    if (!depth_.exists(id)) return false;
    const Lattice& l = lattice();
    const std::int64_t m = l.tile_cells(), step = l.step(id.level);
    const LatticePoint corner = l.corner(id);
    HeightTile tile;
    for (std::int64_t r = 0; r <= m; ++r)
        for (std::int64_t c = 0; c <= m; ++c)
            tile.samples.push_back(heights_(corner.i + c * step, corner.j + r * step));
    HeightBounds& own = tile.header.own;
    own.min_n = *std::min_element(tile.samples.begin(), tile.samples.end());
    own.max_n = *std::max_element(tile.samples.begin(), tile.samples.end());
    if (id.level == l.deepest_level || !depth_.refined(id)) {
        for (std::int64_t r = 0; r < m; ++r)
            for (std::int64_t c = 0; c < m; ++c)
                tile.presence.push_back(present(corner.i + c * step, corner.j + r * step) ? 1 : 0);
        const auto cells = std::count(tile.presence.begin(), tile.presence.end(), 1);
        if (cells == 0) return false;
        if (cells == m * m) tile.presence.clear();
        own.error_n.fill(12345);  // of thinned edges: nothing that a query draws
    } else {
        for (int q = 0; q < 4; ++q) {
            const auto child = tiles_.find(child_of(id, q));
            if (child == tiles_.end()) continue;
            tile.header.child_mask = static_cast<std::uint8_t>(tile.header.child_mask | 1 << q);
            if (child->second.header.is_leaf() && id.level + 1 < l.deepest_level)
                tile.header.leaf_mask = static_cast<std::uint8_t>(tile.header.leaf_mask | 1 << q);
            HeightBounds& bounds = tile.header.children[static_cast<std::size_t>(q)];
            bounds = child->second.header.own;
            own.min_n = std::min(own.min_n, bounds.min_n);
            own.max_n = std::max(own.max_n, bounds.max_n);
        }
        if (tile.header.child_mask == 0) return false;
        own.error_n.fill(own_error(id, tile));
    }
    // Only as many as the format has: others read back as 0.
    const auto zero_rest = [&](HeightBounds& b) {
        std::fill(b.error_n.begin() + geomip_level_count(l.tile_cells_log2), b.error_n.end(), 0.0f);
    };
    zero_rest(own);
    tiles_.emplace(id, std::move(tile));
    return true;
}

SmallWorld random_world(Random& random, bool varying) {
    WorldShape s;
    s.tile_cells_log2 = uniform(random, 2, 3);
    s.cells_x = uniform(random, 1, 40);
    s.cells_y = uniform(random, 0, 2) == 0 ? uniform(random, 1, 6) : uniform(random, 1, 40);
    if (uniform(random, 0, 3) > 0) {  // else the plain integers, where everything is exact
        s.origin_x_m = uniform_real(random, -5e5, 5e5);
        s.origin_y_m = uniform_real(random, -5e5, 5e5);
        s.spacing_m = std::exp(uniform_real(random, -2, 4));
        s.quantum_m = s.spacing_m * std::exp(uniform_real(random, -4, 0));
        s.height_offset_m = uniform_real(random, -500, 500);
    }
    s.quantum_error_m = uniform(random, 0, 1) * s.quantum_m / 2;
    s.warp_error_m = uniform(random, 0, 1) * uniform_real(random, 0, 3);
    const int amplitude = uniform(random, 0, 4) == 0 ? 0 : 1 << uniform(random, 0, 6);
    const std::int64_t pitch = 1024;
    std::vector<std::int32_t> noise(static_cast<std::size_t>(pitch * pitch / 16));
    for (auto& n : noise) n = uniform(random, -amplitude, amplitude);
    const int smooth = uniform(random, 1, 8);
    const auto heights = [=](std::int64_t i, std::int64_t j) {
        const auto at = [&](std::int64_t a, std::int64_t b) {
            return static_cast<std::int64_t>(noise[static_cast<std::size_t>(a + b * 181) % noise.size()]);
        };
        return static_cast<std::int32_t>((at(i, j) + smooth * at(i / smooth, j / smooth)) / 2);
    };
    const int holes = uniform(random, 0, 2) == 0 ? uniform(random, 10, 70) : 0;
    std::vector<std::uint8_t> mask(64 * 64);
    for (auto& cell : mask) cell = uniform(random, 0, 99) < holes ? 0 : 1;
    const int patch = uniform(random, 1, 5);
    const auto presence = [=](std::int64_t i, std::int64_t j) {
        return (i == 0 && j == 0) || mask[static_cast<std::size_t>(j / patch * 64 + i / patch)] != 0;
    };
    if (varying) {
        const auto lattice = make_lattice(0, 0, 1, s.cells_x, s.cells_y, s.tile_cells_log2);
        EXPECT_TRUE(lattice.ok());
        s.depth = DepthMap::random(random, *lattice, lattice->deepest_level, true);
    }
    return SmallWorld(s, heights, presence);
}

void PartialSource::drop(Random& random, int percent) {
    for (const auto& [id, tile] : world_.tiles())  // parents stand before their children
        if (id.level > 0 && (dropped_.contains(parent_of(id)) || uniform(random, 0, 99) < percent)) dropped_.insert(id);
}

Result<std::optional<HeightTileView>> PartialSource::view(TileId id) {
    ++views;
    const auto found = world_.tiles().find(id);
    EXPECT_TRUE(id.level == 0 || found != world_.tiles().end()) << "asked for a child that no header names";
    if (found == world_.tiles().end() || dropped_.contains(id)) {
        shown_ = {};
        return std::optional<HeightTileView>{};
    }
    shown_ = found->second;
    return std::optional<HeightTileView>{HeightTileView{&shown_.header, shown_.samples, shown_.presence}};
}

}  // namespace scree::test
