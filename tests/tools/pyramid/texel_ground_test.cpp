#include "tools/pyramid/texel_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "common/store/height_codec.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

struct Case {
    int tile_cells_log2, texture_size_log2, deeper;  // levels that textures go below the heights
};

// Leaves with few present cells, or none, or all.
class Ground {
public:
    Ground(const Case& c, test::Random& random) : index_(lattice_of(c, random), lattice_.deepest_level + c.deeper) {
        dataset_.lattice = lattice_;
        dataset_.texture_size_log2 = c.texture_size_log2;
        dataset_.texture_deepest_level = lattice_.deepest_level + c.deeper;
        const int level = lattice_.deepest_level;
        for (std::int64_t y = 0; y < lattice_.tiles_y(level); ++y)
            for (std::int64_t x = 0; x < lattice_.tiles_x(level); ++x) add_leaf({level, x, y}, random);
        ground_ = std::make_unique<TexelGround>(
            dataset_, lattice_, index_,
            [this](TileId id, TileRow& row) -> Result<bool> {
                const auto found = rows_.find(id);
                if (found != rows_.end()) row = found->second;
                return found != rows_.end();
            },
            dataset_.texture_deepest_level);
    }

    const Dataset& dataset() const { return dataset_; }
    bool shows(TileId id) const {
        const auto shows = ground_->shows(id);
        EXPECT_TRUE(shows.ok());
        return shows && *shows;
    }
    // Texel by texel.
    bool any_centre(TileId id) const {
        const std::int64_t texels = std::int64_t{dataset_.texture_size()}
                                    << (dataset_.texture_deepest_level - id.level);
        const double cells = dataset_.texel_m(dataset_.texture_deepest_level) / lattice_.spacing_m;
        const auto cell = [&](std::int64_t texel) {
            return static_cast<std::int64_t>(std::floor((static_cast<double>(texel) + 0.5) * cells));
        };
        for (std::int64_t r = id.y * texels; r < (id.y + 1) * texels; ++r)
            for (std::int64_t c = id.x * texels; c < (id.x + 1) * texels; ++c)
                if (present(cell(c), cell(r))) return true;
        return false;
    }

private:
    const Lattice& lattice_of(const Case& c, test::Random& random) {
        const int m = 1 << c.tile_cells_log2;
        lattice_ = *make_lattice(0, 0, 10, test::uniform(random, m + 1, 2 * m), test::uniform(random, m + 1, 2 * m),
                                 c.tile_cells_log2);
        return lattice_;
    }
    void add_leaf(TileId id, test::Random& random) {
        const std::int64_t m = lattice_.tile_cells();
        HeightTile tile;
        tile.samples.assign(static_cast<std::size_t>((m + 1) * (m + 1)), 0);
        tile.presence.assign(static_cast<std::size_t>(m * m), 0);
        const int kind = test::uniform(random, 0, 5);
        bool any = false, all = true;
        for (std::int64_t j = 0; j < m; ++j)
            for (std::int64_t i = 0; i < m; ++i) {
                const bool inside = id.x * m + i < lattice_.cells_x && id.y * m + j < lattice_.cells_y;
                const bool chosen =
                    kind == 0 || (kind > 1 && test::uniform(random, 0, static_cast<int>(m * m) / 2) == 0);
                tile.presence[static_cast<std::size_t>(j * m + i)] = inside && chosen ? 1 : 0;
                any = any || (inside && chosen);
                all = all && inside && chosen;
            }
        if (!any) return;
        presence_[id] = tile.presence;
        if (all) tile.presence.clear();
        auto payload = encode_height_tile(tile, lattice_.tile_cells_log2, HeightCodec::plane);
        index_.note(id, payload);
        rows_[id] = {static_cast<int>(HeightCodec::plane), std::move(payload)};
    }
    bool present(std::int64_t i, std::int64_t j) const {
        const std::int64_t m = lattice_.tile_cells();
        const auto found = presence_.find({lattice_.deepest_level, i / m, j / m});
        return found != presence_.end() && found->second[static_cast<std::size_t>(j % m * m + i % m)] != 0;
    }

    Lattice lattice_;
    HeightIndex index_;
    Dataset dataset_;
    std::map<TileId, TileRow> rows_;
    std::map<TileId, std::vector<std::uint8_t>> presence_;
    std::unique_ptr<TexelGround> ground_;
};

// Texels of two cells, of one and of parts of one; tiles of many cells, of one and of parts of one.
TEST(TexelGround, ATileShowsSomethingWhereATexelsCentreLiesInAPresentCell) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int some = 0, none = 0;
    for (const Case& c : {Case{6, 4, 1}, Case{5, 4, 1}, Case{5, 4, 2}, Case{4, 4, 2}, Case{2, 4, 1}, Case{2, 4, 4}})
        for (int round = 0; round < 4; ++round) {
            const Ground ground(c, random);
            const Dataset& d = ground.dataset();
            for (int level = d.lattice.deepest_level + 1; level <= d.texture_deepest_level; ++level)
                for (int k = 0; k < 60; ++k) {
                    const TileId id{level, test::uniform(random, 0, static_cast<int>(d.lattice.tiles_x(level)) - 1),
                                    test::uniform(random, 0, static_cast<int>(d.lattice.tiles_y(level)) - 1)};
                    const bool expected = ground.any_centre(id);
                    ASSERT_EQ(ground.shows(id), expected)
                        << id.level << "/" << id.x << "/" << id.y << " over tiles of 2^" << c.tile_cells_log2
                        << " cells, textures of 2^" << c.texture_size_log2 << ", " << c.deeper << " levels deeper";
                    ++(expected ? some : none);
                }
        }
    EXPECT_GT(some, 100);
    EXPECT_GT(none, 100);
}

}  // namespace
}  // namespace scree
