// What tests of placement share: points of one CRS in another, a store's tiles and points, and grids to place.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "tests/programs/placement_inputs.h"
#include "tools/source/crs.h"

namespace scree::test {

inline constexpr double kBoundSamples = 0.01;

// Points of one CRS in another.
class Move {
public:
    Move(const std::string& from, const std::string& to) : transform_(make(from, to)) {}
    void operator()(std::vector<double>& x, std::vector<double>& y) const { transform_.apply(x, y); }
    std::pair<double, double> one(double x, double y) const {
        std::vector<double> xs{x}, ys{y};
        transform_.apply(xs, ys);
        return {xs[0], ys[0]};
    }

private:
    static CrsTransform make(const std::string& from, const std::string& to) {
        const auto a = Crs::parse(from), b = Crs::parse(to);
        auto made = CrsTransform::make(*a, *b);
        EXPECT_TRUE(made) << from << " to " << to;
        return std::move(*made);
    }
    CrsTransform transform_;
};

class StoreUnderTest {
public:
    explicit StoreUnderTest(const std::string& path) : store_(open(path)), dataset_(store_->dataset()) {}

    const Dataset& dataset() const { return dataset_; }
    const Lattice& lattice() const { return dataset_.lattice; }
    const SqliteStore& store() const { return *store_; }
    std::int64_t pitch() const { return lattice().cells_x + 1; }
    std::size_t index(std::int64_t i, std::int64_t j) const { return static_cast<std::size_t>(j * pitch() + i); }

    std::vector<std::pair<TileId, HeightTile>> height_tiles() const {
        std::vector<std::pair<TileId, HeightTile>> tiles;
        const auto ok = store_->for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
            const auto id = tile_from_key(lattice(), row.key);
            auto tile = decode_height_tile(row.payload, lattice().tile_cells_log2, row.codec);
            EXPECT_TRUE(id && tile);
            if (id && tile) tiles.emplace_back(*id, std::move(*tile));
            return true;
        });
        EXPECT_TRUE(ok);
        return tiles;
    }

    /// Where the lattice's points are in a CRS.
    void points_in(const std::string& crs, std::vector<double>& x, std::vector<double>& y) const {
        const auto count = static_cast<std::size_t>(pitch() * (lattice().cells_y + 1));
        x.resize(count);
        y.resize(count);
        for (std::int64_t j = 0; j <= lattice().cells_y; ++j)
            for (std::int64_t i = 0; i <= lattice().cells_x; ++i) {
                x[index(i, j)] = lattice().x_m(static_cast<double>(i));
                y[index(i, j)] = lattice().y_m(static_cast<double>(j));
            }
        Move(dataset_.crs, crs)(x, y);
    }

private:
    static std::unique_ptr<SqliteStore> open(const std::string& path) {
        auto opened = SqliteStore::open(path);
        if (!opened) throw std::runtime_error(opened.error().message);
        return std::move(*opened);
    }
    std::unique_ptr<SqliteStore> store_;
    Dataset dataset_;
};

// Metres of the store between samples, the lesser of both ways.
inline double ground_step(const SampleGrid& g, const std::string& crs) {
    const Move move(g.crs, crs);
    const auto at = [&](int c, int r) { return move.one(g.x(c, r), g.y(c, r)); };
    const auto [x, y] = at(g.width / 2, g.height / 2);
    const auto [ex, ey] = at(g.width / 2 + 1, g.height / 2);
    const auto [sx, sy] = at(g.width / 2, g.height / 2 + 1);
    return std::min(std::hypot(ex - x, ey - y), std::hypot(sx - x, sy - y));
}

inline SampleGrid of_areas(SampleGrid grid) {
    grid.area = true;
    return grid;
}
inline SampleGrid south_up(const SampleGrid& g) {
    SampleGrid s = g;
    s.first_y = g.y(0, g.height - 1);
    s.row_y = -g.row_y;
    return s;
}

// Files of one patch: 2 x 2, whose inner borders share a sample or adjoin.
inline std::vector<std::array<int, 4>> quarters(const SampleGrid& g, int shared) {
    const int c = g.width / 2, r = g.height / 2;
    return {{0, 0, c + shared, r + shared},
            {c, 0, g.width - c, r + shared},
            {0, r, c + shared, g.height - r},
            {c, r, g.width - c, g.height - r}};
}

}  // namespace scree::test
