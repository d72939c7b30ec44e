#include "tests/runtime/lod/synthetic_terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/geometric_error.h"
#include "common/mesh/vertex_slot.h"

namespace scree::test {
namespace {

std::uint64_t hash(std::uint64_t seed, std::int64_t a, std::int64_t b, int octave) {
    std::uint64_t h = seed + static_cast<std::uint64_t>(a) * 0x9E3779B97F4A7C15u +
                      static_cast<std::uint64_t>(b) * 0xC2B2AE3D27D4EB4Fu +
                      static_cast<std::uint64_t>(octave) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9u;
    h = (h ^ (h >> 27)) * 0x94D049BB133111EBu;
    return h ^ (h >> 31);
}

}  // namespace

SyntheticTerrain::SyntheticTerrain(const TerrainShape& shape, HeightFunction height, PresenceFunction present)
    : height_(std::move(height)),
      present_(std::move(present)),
      error_growth_(shape.error_growth),
      depth_(shape.depth),
      texture_depth_(shape.texture_depth_map) {
    auto lattice = make_lattice(shape.origin_x_m, shape.origin_y_m, shape.spacing_m, shape.cells_x, shape.cells_y,
                                shape.tile_cells_log2);
    EXPECT_TRUE(lattice.ok());
    dataset_.lattice = *lattice;
    dataset_.height_offset_m = 50;
    dataset_.height_quantum_m = shape.quantum_m;
    dataset_.texture_size_log2 = shape.texture_size_log2;
    dataset_.texture_deepest_level = std::min(shape.texture_depth, lattice->deepest_level + shape.tile_cells_log2);
    for (int level = lattice->deepest_level; level >= 0; --level)
        for (std::int64_t y = 0; y < lattice->tiles_y(level); ++y)
            for (std::int64_t x = 0; x < lattice->tiles_x(level); ++x)
                if (make_tile({level, x, y})) ids_.push_back({level, x, y});
    std::sort(ids_.begin(), ids_.end());
    double low = 1e9, high = -1e9;
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        indices_[ids_[k]] = static_cast<std::int32_t>(k);
        low = std::min(low, dataset_.height_m(stored_[ids_[k]].header.own.min_n));
        high = std::max(high, dataset_.height_m(stored_[ids_[k]].header.own.max_n));
    }
    if (depth_.varies()) map_leaves();
    int coarsest = lattice->deepest_level;
    for (const TileId id : ids_)
        if (is_leaf(id)) coarsest = std::min(coarsest, id.level);
    if (coarsest < lattice->deepest_level) dataset_.coarsest_leaf_level = coarsest;
    make_textures();
    dataset_.min_height_m = low;
    dataset_.max_height_m = high;
    dataset_.height_tiles = static_cast<std::int64_t>(ids_.size());
    EXPECT_TRUE(dataset_.check().ok()) << dataset_.check().error().message;
}

// A texture is stored wherever a present cell lies under it, down to one of a single cell.
void SyntheticTerrain::make_textures() {
    const Lattice& l = lattice();
    std::unordered_set<TileId, TileIdHash> stored;
    const int finest = l.deepest_level + l.tile_cells_log2;
    for (std::int64_t j = 0; j < l.cells_y; ++j)
        for (std::int64_t i = 0; i < l.cells_x; ++i)
            if (present(i, j))
                for (int level = 0; level <= dataset_.texture_deepest_level; ++level) {
                    const TileId id = ancestor_at({finest, i, j}, level);
                    stored.insert(id);
                    if (!texture_depth_.refined(id)) break;
                }
    texture_ids_.assign(stored.begin(), stored.end());
    std::sort(texture_ids_.begin(), texture_ids_.end());
    for (std::size_t k = 0; k < texture_ids_.size(); ++k)
        texture_indices_[texture_ids_[k]] = static_cast<std::int32_t>(k);
    dataset_.texture_tiles = static_cast<std::int64_t>(texture_ids_.size());
}

std::int32_t SyntheticTerrain::texture_index(TileId id) const {
    const auto found = texture_indices_.find(id);
    return found == texture_indices_.end() ? -1 : found->second;
}

bool SyntheticTerrain::source_present(std::int64_t i, std::int64_t j) const {
    return i >= 0 && j >= 0 && i < lattice().cells_x && j < lattice().cells_y && (!present_ || present_(i, j));
}

// A leaf's cell is present where all of the source is.
bool SyntheticTerrain::cell_present(std::int64_t i, std::int64_t j, std::int64_t step) const {
    for (std::int64_t v = j; v < j + step; ++v)
        for (std::int64_t u = i; u < i + step; ++u)
            if (!source_present(u, v)) return false;
    return true;
}

std::optional<TileId> SyntheticTerrain::leaf_over(std::int64_t i, std::int64_t j) const {
    const Lattice& l = lattice();
    const std::int64_t width = l.root_columns * l.tile_extent(0), height = l.root_rows * l.tile_extent(0);
    if (i < 0 || j < 0 || i >= width || j >= height) return std::nullopt;
    if (!depth_.varies()) {
        const TileId id{l.deepest_level, i >> l.tile_cells_log2, j >> l.tile_cells_log2};
        return tile(id) != nullptr ? std::optional(id) : std::nullopt;
    }
    const std::int32_t leaf = leaves_[static_cast<std::size_t>(j * width + i)];
    return leaf < 0 ? std::nullopt : std::optional(ids_[static_cast<std::size_t>(leaf)]);
}

void SyntheticTerrain::map_leaves() {
    const Lattice& l = lattice();
    const std::int64_t width = l.root_columns * l.tile_extent(0), height = l.root_rows * l.tile_extent(0);
    leaves_.assign(static_cast<std::size_t>(width * height), -1);
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        if (!is_leaf(ids_[k])) continue;
        const LatticePoint corner = l.corner(ids_[k]);
        const std::int64_t extent = l.tile_extent(ids_[k].level);
        for (std::int64_t j = corner.j; j < corner.j + extent; ++j)
            std::fill_n(leaves_.begin() + (j * width + corner.i), extent, static_cast<std::int32_t>(k));
    }
}

bool SyntheticTerrain::present(std::int64_t i, std::int64_t j) const {
    if (!depth_.varies()) return source_present(i, j);
    const auto leaf = leaf_over(i, j);
    if (!leaf) return false;
    const LatticePoint corner = lattice().corner(*leaf);
    const std::int64_t step = lattice().step(leaf->level), m = lattice().tile_cells();
    const std::vector<std::uint8_t>& cells = tile(*leaf)->presence;
    return cells.empty() || cells[static_cast<std::size_t>((j - corner.j) / step * m + (i - corner.i) / step)] != 0;
}

double SyntheticTerrain::height_m(std::int64_t i, std::int64_t j) const {
    if (!depth_.varies()) return dataset_.height_m(height_(i, j));
    // Any leaf that touches the place; the one before a border as well as the one after.
    for (const std::int64_t cj : {j, j - 1})
        for (const std::int64_t ci : {i, i - 1})
            if (const auto leaf = leaf_over(ci, cj)) {
                const LatticePoint corner = lattice().corner(*leaf);
                return dataset_.height_m(drawn_height(tile(*leaf)->samples, lattice().tile_cells_log2, {}, i - corner.i,
                                                      j - corner.j, lattice().step(leaf->level))
                                             .quanta());
            }
    return dataset_.height_m(height_(i, j));
}

bool SyntheticTerrain::beside_coarser_leaf(TileId id) const {
    const LatticePoint c = lattice().corner(id);
    const std::int64_t extent = lattice().tile_extent(id.level);
    for (const LatticePoint beside : {LatticePoint{c.i - 1, c.j}, LatticePoint{c.i, c.j - 1},
                                      LatticePoint{c.i + extent, c.j}, LatticePoint{c.i, c.j + extent}})
        if (const auto leaf = leaf_over(beside.i, beside.j); leaf && leaf->level < id.level) return true;
    return false;
}

bool SyntheticTerrain::texture_ends(TileId id) const {
    return id.level < dataset_.texture_deepest_level && !(texture_depth_.exists(id) && texture_depth_.refined(id));
}

template <class Visit>
void SyntheticTerrain::for_each_leaf(TileId id, const Visit& visit) const {
    const auto found = stored_.find(id);
    if (found == stored_.end()) return;
    if (found->second.header.is_leaf()) return visit(id, found->second);
    for (int q = 0; q < 4; ++q) for_each_leaf(child_of(id, q), visit);
}

void SyntheticTerrain::grow_errors(HeightBounds& bounds) const {
    for (std::size_t g = 1; g < static_cast<std::size_t>(lattice().tile_cells_log2); ++g)
        bounds.error_n[g] = std::max(bounds.error_n[g], error_growth_ * bounds.error_n[g - 1]);
}

bool SyntheticTerrain::make_leaf(TileId id, HeightTile& tile) {
    const int n = lattice().tile_cells_log2;
    const std::int64_t m = lattice().tile_cells(), step = lattice().step(id.level);
    const LatticePoint corner = lattice().corner(id);
    std::int64_t cells = 0;
    for (std::int64_t r = 0; r < m; ++r)
        for (std::int64_t c = 0; c < m; ++c) {
            tile.presence.push_back(cell_present(corner.i + c * step, corner.j + r * step, step) ? 1 : 0);
            cells += tile.presence.back();
        }
    if (cells == 0) return false;
    dataset_.present_cells += cells;
    if (cells == m * m) tile.presence.clear();
    const auto vertices = present_vertices(tile.presence, n);
    const auto errors = leaf_errors({tile.samples.data(), vertices.empty() ? nullptr : vertices.data(), n});
    HeightBounds& own = tile.header.own;
    for (std::size_t g = 0; g < errors.size(); ++g) own.error_n[g] = round_up_to_float(errors[g]);
    grow_errors(own);
    return true;
}

bool SyntheticTerrain::make_tile(TileId id) {
    if (!depth_.exists(id)) return false;
    const Lattice& l = lattice();
    const int n = l.tile_cells_log2;
    const std::int64_t m = l.tile_cells(), step = l.step(id.level);
    const LatticePoint corner = l.corner(id);
    HeightTile tile;
    for (std::int64_t r = 0; r <= m; ++r)
        for (std::int64_t c = 0; c <= m; ++c) tile.samples.push_back(height_(corner.i + c * step, corner.j + r * step));
    HeightBounds& own = tile.header.own;
    own.min_n = *std::min_element(tile.samples.begin(), tile.samples.end());
    own.max_n = *std::max_element(tile.samples.begin(), tile.samples.end());
    tile.header.texture_ends = texture_ends(id);
    if (id.level == l.deepest_level || !depth_.refined(id)) {
        if (!make_leaf(id, tile)) return false;
        stored_.emplace(id, std::move(tile));
        return true;
    }
    for (int q = 0; q < 4; ++q) {
        const auto child = stored_.find(child_of(id, q));
        if (child == stored_.end()) continue;
        const HeightBounds& bounds = child->second.header.own;
        const unsigned bit = 1u << q;
        tile.header.child_mask = static_cast<std::uint8_t>(tile.header.child_mask | bit);
        if (child->second.header.is_leaf() && id.level + 1 < l.deepest_level)
            tile.header.leaf_mask = static_cast<std::uint8_t>(tile.header.leaf_mask | bit);
        if (child->second.header.texture_ends)
            tile.header.texture_end_mask = static_cast<std::uint8_t>(tile.header.texture_end_mask | bit);
        tile.header.children[static_cast<std::size_t>(q)] = bounds;
        own.min_n = std::min(own.min_n, bounds.min_n);
        own.max_n = std::max(own.max_n, bounds.max_n);
        for (std::size_t g = 0; g + 1 < static_cast<std::size_t>(n); ++g)
            own.error_n[g] = std::max(own.error_n[g], bounds.error_n[g + 1]);
    }
    if (tile.header.is_leaf()) return false;
    // The coarsest surface is one block: compared with every leaf under it, in the leaf's own cells.
    BlockVertices block{};
    for (std::int64_t k = 0; k < 9; ++k)
        block[static_cast<std::size_t>(k)] = tile.samples[static_cast<std::size_t>((k / 3 * (m + 1) + k % 3) * m / 2)];
    double worst = 0;
    for (int q = 0; q < 4; ++q)
        for_each_leaf(child_of(id, q), [&](TileId at, const HeightTile& leaf) {
            const std::int64_t cell = l.step(at.level);
            const LatticePoint from = l.corner(at);
            const auto vertices = present_vertices(leaf.presence, n);
            worst = std::max(
                worst, coarse_block_error(block, l.tile_extent(id.level) / 2 / cell, (from.i - corner.i) / cell,
                                          (from.j - corner.j) / cell,
                                          {leaf.samples.data(), vertices.empty() ? nullptr : vertices.data(), n}));
        });
    own.error_n[static_cast<std::size_t>(n - 1)] = round_up_to_float(worst);
    grow_errors(own);
    stored_.emplace(id, std::move(tile));
    return true;
}

const HeightTile* SyntheticTerrain::tile(TileId id) const {
    const auto found = stored_.find(id);
    return found == stored_.end() ? nullptr : &found->second;
}

std::int32_t SyntheticTerrain::index(TileId id) const {
    const auto found = indices_.find(id);
    return found == indices_.end() ? -1 : found->second;
}

std::uint8_t SyntheticTerrain::texture_children(TileId id) const {
    unsigned mask = 0;
    for (int q = 0; q < 4; ++q)
        if (has_texture(child_of(id, q))) mask |= 1u << q;
    return static_cast<std::uint8_t>(mask);
}

TextureTile SyntheticTerrain::texture(TileId id) const {
    TextureTile texture;
    texture.child_mask = texture_children(id);
    texture.blocks.assign(bc1_chain_bytes(dataset_.texture_size_log2), 0);
    // The tile's own index, so that a slot's content says whose it is.
    for (std::size_t k = 0; k < 4; ++k) texture.blocks[k] = static_cast<std::uint8_t>(texture_index(id) >> (8 * k));
    return texture;
}

Box SyntheticTerrain::box_of(TileId id) const {
    const Lattice& l = lattice();
    const LatticePoint c = l.corner(id);
    const HeightBounds& own = tile(id)->header.own;
    const auto east = static_cast<double>(std::min(c.i + l.tile_extent(id.level), l.cells_x));
    const auto south = static_cast<double>(std::min(c.j + l.tile_extent(id.level), l.cells_y));
    return {{l.x_m(static_cast<double>(c.i)), l.y_m(south), dataset_.height_m(own.min_n)},
            {l.x_m(east), l.y_m(static_cast<double>(c.j)), dataset_.height_m(own.max_n)}};
}

HeightFunction rough_heights(std::uint64_t seed, int amplitude) {
    return [seed, amplitude](std::int64_t i, std::int64_t j) {
        double sum = 0;
        for (int octave = 0; octave < 6; ++octave) {
            const std::int64_t cell = std::int64_t{1} << (5 - octave);
            const double u = static_cast<double>(i % cell) / static_cast<double>(cell);
            const double v = static_cast<double>(j % cell) / static_cast<double>(cell);
            const auto corner = [&](int a, int b) {
                return static_cast<double>(hash(seed, i / cell + a, j / cell + b, octave) >> 40) / 8388608.0 - 1;
            };
            const double north = corner(0, 0) * (1 - u) + corner(1, 0) * u;
            const double south = corner(0, 1) * (1 - u) + corner(1, 1) * u;
            sum += std::ldexp(north * (1 - v) + south * v, -octave - 1);
        }
        return static_cast<std::int32_t>(std::lround(sum * amplitude));
    };
}

PresenceFunction with_absent_discs(Random& random, const TerrainShape& shape, int discs) {
    struct Disc {
        int i, j, radius;
    };
    std::vector<Disc> all;
    const int x = static_cast<int>(shape.cells_x), y = static_cast<int>(shape.cells_y);
    for (int k = 0; k < discs; ++k)
        all.push_back(
            {uniform(random, 0, x), uniform(random, 0, y), uniform(random, 1, std::max(2, std::min(x, y) / 3))});
    return [all](std::int64_t i, std::int64_t j) {
        return std::none_of(all.begin(), all.end(), [&](const Disc& d) {
            return (i - d.i) * (i - d.i) + (j - d.j) * (j - d.j) < std::int64_t{d.radius} * d.radius;
        });
    };
}

SyntheticTerrain random_terrain(Random& random, int texture_depth, float error_growth, Depth depth) {
    TerrainShape shape;
    shape.error_growth = error_growth;
    shape.tile_cells_log2 = uniform(random, 2, 4);
    const int m = 1 << shape.tile_cells_log2;
    const int tiles = 1 << uniform(random, 2, shape.tile_cells_log2 == 4 ? 3 : 4);  // 3 to 5 levels with one root
    shape.cells_x = m * tiles - uniform(random, 0, 1) * uniform(random, 0, m);
    shape.cells_y = m * tiles - uniform(random, 0, 1) * uniform(random, 0, m * tiles / 2);
    if (uniform(random, 0, 3) == 0) shape.cells_y = std::max<std::int64_t>(m, shape.cells_x / uniform(random, 2, 5));
    shape.texture_depth = texture_depth;
    const int amplitude = 1 << uniform(random, 4, 11);
    const std::uint64_t seed = random();
    const HeightFunction rough = rough_heights(seed, amplitude);
    const std::int64_t flat_from = uniform(random, 0, 2) == 0 ? shape.cells_x / 2 : shape.cells_x * 4;
    const bool noise = uniform(random, 0, 4) == 0;
    const HeightFunction heights = [=](std::int64_t i, std::int64_t j) -> std::int32_t {
        if (i >= flat_from) return 7;
        if (noise) return static_cast<std::int32_t>(hash(seed, i, j, 99) % static_cast<std::uint64_t>(amplitude));
        return rough(i, j);
    };
    const int discs = uniform(random, 0, 3);
    if (depth == Depth::varying) {
        const auto lattice = make_lattice(0, 0, 1, shape.cells_x, shape.cells_y, shape.tile_cells_log2);
        EXPECT_TRUE(lattice.ok());
        shape.depth = DepthMap::random(random, *lattice, lattice->deepest_level, true);
        const int textures = std::min(texture_depth, lattice->deepest_level + shape.tile_cells_log2);
        shape.texture_depth_map = DepthMap::random(random, *lattice, textures, false);
    }
    return SyntheticTerrain(shape, heights, discs > 0 ? with_absent_discs(random, shape, discs) : PresenceFunction{});
}

Camera random_camera(Random& random, const SyntheticTerrain& terrain) {
    const Lattice& l = terrain.lattice();
    const auto at = [&](double u, double v, double z) {
        return glm::dvec3(l.x_m(u * static_cast<double>(l.cells_x)), l.y_m(v * static_cast<double>(l.cells_y)), z);
    };
    const double margin = uniform(random, 0, 2) == 0 ? 1.0 : 0.0;
    const double ground = terrain.dataset().max_height_m, extent = l.spacing_m * static_cast<double>(l.cells_x);
    const glm::dvec3 eye = at(uniform_real(random, -margin, 1 + margin), uniform_real(random, -margin, 1 + margin),
                              ground + extent * std::exp(uniform_real(random, -8, 1.5)) - uniform(random, 0, 3) * 5);
    const glm::dvec3 look =
        at(uniform_real(random, 0, 1), uniform_real(random, 0, 1), uniform_real(random, ground - 100, ground));
    auto camera =
        look_at(eye, look, uniform_real(random, 5, 120), uniform(random, 50, 2000), uniform(random, 50, 2000));
    EXPECT_TRUE(camera.ok());
    return *camera;
}

LevelCorrections corrections_of(const SyntheticTerrain& terrain, TileId id) {
    const int n = terrain.lattice().tile_cells_log2;
    std::vector<SlotVertex> vertices(slot_vertex_count(n));
    fill_vertex_slot(terrain.tile(id)->samples, n, vertices);
    return level_corrections(vertices, n);
}

FakeResidency::FakeResidency(const SyntheticTerrain& terrain) : terrain_(&terrain) {
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        ResidentPages& pages = tables_.of(kind);
        const std::size_t count = ids(kind).size();
        states_[static_cast<std::size_t>(kind)].assign(count, State::absent);
        pages.arrived_s.assign(count, -std::numeric_limits<double>::infinity());
        pages.children.resize(count);
        pages.headers.resize(count);
        for (std::size_t slot = 0; slot < count; ++slot) {
            const TileId id = ids(kind)[slot];
            if (kind == TileKind::height)
                pages.headers[slot] = terrain.tile(id)->header;
            else
                pages.headers[slot].child_mask = terrain.texture_children(id);
        }
    }
}

void FakeResidency::add_all() {
    for (const TileId id : terrain_->tiles()) add(id);
    for (const TileId id : terrain_->textures()) add_texture(id);
}

void FakeResidency::add_roots() {
    for (const TileId id : terrain_->tiles())
        if (id.level == 0) {
            add(id);
            add_texture(id);
        }
}

void FakeResidency::add_random(Random& random, int percent) {
    add_roots();
    for (const TileId id : terrain_->tiles())
        if (uniform(random, 0, 99) < percent) add(id);
    for (const TileId id : terrain_->textures())
        if (uniform(random, 0, 99) < percent) add_texture(id);
}

FakeResidency::State FakeResidency::state(TileKind kind, TileId id) const {
    const std::int32_t slot = index(kind, id);
    return slot < 0 ? State::absent : states_[static_cast<std::size_t>(kind)][static_cast<std::size_t>(slot)];
}

bool FakeResidency::reaches(TileKind kind, TileId id) const {
    for (int level = 0; level <= id.level; ++level)
        if (state(kind, ancestor_at(id, level)) != State::resident) return false;
    return true;
}

void FakeResidency::change(TileKind kind, TileId id, State to) {
    const std::int32_t slot = index(kind, id);
    if (slot < 0) return;  // not stored
    states_[static_cast<std::size_t>(kind)][static_cast<std::size_t>(slot)] = to;
    stale_ = true;
}

void FakeResidency::set_arrived(TileKind kind, TileId id, double seconds) {
    tables_.of(kind).arrived_s.at(static_cast<std::size_t>(index(kind, id))) = seconds;
}

void FakeResidency::set_has_textures(bool has) {
    tables_.has_textures = has;
    stale_ = true;
}

void FakeResidency::keep_corrections() {
    tables_.heights.corrections.clear();
    for (const TileId id : terrain_->tiles()) tables_.heights.corrections.push_back(corrections_of(*terrain_, id));
}

const Residency& FakeResidency::tables() const {
    if (stale_) {
        link(TileKind::height);
        link(TileKind::texture);
        stale_ = false;
    }
    return tables_;
}

std::int32_t FakeResidency::entry(TileKind kind, TileId id) const {
    if (kind == TileKind::texture && !tables_.has_textures) return kNotResident;
    switch (state(kind, id)) {
        case State::absent:
            return kNotResident;
        case State::unavailable:
            return kUnavailable;
        case State::resident:
            return index(kind, id);
    }
    return kNotResident;
}

void FakeResidency::link(TileKind kind) const {
    ResidentPages& pages = tables_.of(kind);
    const Lattice& l = terrain_->lattice();
    pages.roots.clear();
    for (std::int64_t y = 0; y < l.root_rows; ++y)
        for (std::int64_t x = 0; x < l.root_columns; ++x) pages.roots.push_back(entry(kind, {0, x, y}));
    for (std::size_t slot = 0; slot < ids(kind).size(); ++slot)
        for (int q = 0; q < 4; ++q)
            pages.children[slot][static_cast<std::size_t>(q)] = entry(kind, child_of(ids(kind)[slot], q));
}

}  // namespace scree::test
