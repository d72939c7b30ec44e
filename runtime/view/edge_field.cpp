#include "runtime/view/edge_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr double kBandShare = 0.015;
// A cell's: a byte of OpenGL and, here, one and a third of one for the levels; the same once more, and the distances or
// sums that it is made with.
constexpr std::int64_t kBytes = 3, kBytesOfTwo = 10;
constexpr double kMostNarrow = 64;  // cells; only a raster ten times as long as it is wide has a band as wide

// BC1: of the four colours of a block whose first endpoint is not the greater one, the last is transparent.
bool is_opaque(std::span<const std::uint8_t> mip, int side_log2, std::int64_t x, std::int64_t y) {
    const std::int64_t blocks = side_log2 <= 2 ? 1 : std::int64_t{1} << (side_log2 - 2);
    const std::uint8_t* block = mip.data() + 8 * (y / 4 * blocks + x / 4);
    const int first = block[0] | block[1] << 8, second = block[2] | block[3] << 8;
    const int selector = block[4 + y % 4] >> (2 * (x % 4)) & 3;
    return first > second || selector != 3;
}

/// What of a dataset has ground, tile by tile.
class GroundReader {
public:
    GroundReader(const Dataset& dataset, TileReader& reader, const EdgeField::Shape& shape)
        : dataset_(dataset),
          reader_(reader),
          shape_(shape),
          level_(std::max(shape.root_cells_log2 - dataset.texture_size_log2, 0)),
          tile_log2_(shape.root_cells_log2 - level_),
          present_(static_cast<std::size_t>(shape.columns * shape.rows)) {}

    std::vector<std::uint8_t> read() {
        const std::int64_t side = std::int64_t{1} << tile_log2_;
        for (std::int64_t y = 0; y * side < shape_.rows; ++y)
            for (std::int64_t x = 0; x * side < shape_.columns; ++x) read_tile({level_, x, y});
        return std::move(present_);
    }

private:
    void read_tile(TileId id) {
        for (int level = level_; level >= 0; --level) {
            auto tile = read_texture_tile(reader_, dataset_, ancestor_at(id, level));
            if (tile) return take(*tile, id, level_ - level);
        }
        take_all(id);
    }

    template <class Has>
    void fill(TileId id, const Has& has) {
        const std::int64_t side = std::int64_t{1} << tile_log2_;
        for (std::int64_t y = id.y * side; y < std::min((id.y + 1) * side, shape_.rows); ++y)
            for (std::int64_t x = id.x * side; x < std::min((id.x + 1) * side, shape_.columns); ++x)
                present_[static_cast<std::size_t>(y * shape_.columns + x)] = has(x, y) ? 1 : 0;
    }

    // Of a tile so many levels above `id`.
    void take(const TextureTile& tile, TileId id, int up) {
        const int size_log2 = dataset_.texture_size_log2, mip = size_log2 - tile_log2_;
        const auto texels = std::span<const std::uint8_t>(tile.blocks)
                                .subspan(bc1_mip_offset(size_log2, mip), bc1_mip_bytes(size_log2, mip));
        const std::int64_t in_tile = (std::int64_t{1} << tile_log2_) - 1;
        fill(id, [&](std::int64_t x, std::int64_t y) {
            return is_opaque(texels, tile_log2_, x >> up & in_tile, y >> up & in_tile);
        });
    }

    // Nothing can be read: whatever ends here ends hard.
    void take_all(TileId id) {
        fill(id, [](std::int64_t, std::int64_t) { return true; });
    }

    const Dataset& dataset_;
    TileReader& reader_;
    EdgeField::Shape shape_;
    int level_, tile_log2_;
    std::vector<std::uint8_t> present_;
};

/// Sums over rectangles of a raster, of 65535 at most: in between they may wrap.
class RectangleSums {
public:
    template <class At>
    RectangleSums(std::int64_t columns, std::int64_t rows, const At& at)
        : columns_(columns), rows_(rows), sums_(static_cast<std::size_t>((columns + 1) * (rows + 1))) {
        for (std::int64_t y = 0; y < rows; ++y)
            for (std::int64_t x = 0; x < columns; ++x)
                sums_[index(x + 1, y + 1)] = static_cast<std::uint16_t>((at(x, y) ? 1 : 0) + sums_[index(x, y + 1)] +
                                                                        sums_[index(x + 1, y)] - sums_[index(x, y)]);
    }
    /// Over columns [west, east) and rows [north, south), as far as there are any.
    int of(std::int64_t west, std::int64_t north, std::int64_t east, std::int64_t south) const {
        west = std::clamp<std::int64_t>(west, 0, columns_);
        east = std::clamp<std::int64_t>(east, 0, columns_);
        north = std::clamp<std::int64_t>(north, 0, rows_);
        south = std::clamp<std::int64_t>(south, 0, rows_);
        return static_cast<std::uint16_t>(sums_[index(east, south)] - sums_[index(west, south)] -
                                          sums_[index(east, north)] + sums_[index(west, north)]);
    }

private:
    std::size_t index(std::int64_t x, std::int64_t y) const { return static_cast<std::size_t>(y * (columns_ + 1) + x); }
    std::int64_t columns_, rows_;
    std::vector<std::uint16_t> sums_;
};

/// One row of the second pass: the lower envelope of parabolas over all cells.
class Envelope {
public:
    explicit Envelope(std::int64_t columns)
        : apex_(static_cast<std::size_t>(columns + 2)), from_(static_cast<std::size_t>(columns + 3)) {}

    /// squared[x] becomes the least of squared[k] + (x - k)^2, cells -1 and columns being 0.
    void lower(std::vector<double>& squared) {
        const auto columns = static_cast<std::int64_t>(squared.size());
        const auto height = [&](std::int64_t x) {
            return x < 0 || x >= columns ? 0.0 : squared[static_cast<std::size_t>(x)];
        };
        count_ = 0;
        for (std::int64_t x = -1; x <= columns; ++x) add(x, height);
        lowered_.resize(squared.size());
        std::size_t k = 0;
        for (std::int64_t x = 0; x < columns; ++x) {
            while (k + 1 < count_ && from_[k + 1] < static_cast<double>(x)) ++k;
            const auto away = static_cast<double>(x - apex_[k]);
            lowered_[static_cast<std::size_t>(x)] = away * away + height(apex_[k]);
        }
        squared.swap(lowered_);
    }

private:
    template <class Height>
    void add(std::int64_t x, const Height& height) {
        double from = -std::numeric_limits<double>::infinity();
        while (count_ > 0) {
            const std::int64_t last = apex_[count_ - 1];
            const auto far = static_cast<double>(x), near = static_cast<double>(last);
            from = ((height(x) + far * far) - (height(last) + near * near)) / (2 * (far - near));
            if (from > from_[count_ - 1]) break;
            --count_;
        }
        if (count_ == 0) from = -std::numeric_limits<double>::infinity();
        apex_[count_] = x;
        from_[count_++] = from;
    }

    std::vector<std::int64_t> apex_;
    std::vector<double> from_, lowered_;
    std::size_t count_ = 0;
};

}  // namespace

double edge_band_m(const Lattice& lattice) {
    return kBandShare * static_cast<double>(std::max(lattice.cells_x, lattice.cells_y)) * lattice.spacing_m;
}

std::vector<float> distance_to_absence(std::span<const std::uint8_t> present, std::int64_t columns, float most) {
    const auto wide = static_cast<std::size_t>(columns), high = wide == 0 ? 0 : present.size() / wide;
    std::vector<float> distance(present.size());
    // Along columns, from above and from below.
    for (std::size_t y = 0; y < high; ++y)
        for (std::size_t x = 0; x < wide; ++x) {
            const float above = y == 0 ? 0 : distance[(y - 1) * wide + x];
            distance[y * wide + x] = present[y * wide + x] == 0 ? 0 : std::min(above + 1, most);
        }
    for (std::size_t y = high; y-- > 0;)
        for (std::size_t x = 0; x < wide; ++x) {
            const float below = y + 1 == high ? 0 : distance[(y + 1) * wide + x];
            distance[y * wide + x] = std::min(distance[y * wide + x], below + 1);
        }
    Envelope envelope(columns);
    std::vector<double> squared(wide);
    for (std::size_t y = 0; y < high; ++y) {
        float* row = distance.data() + y * wide;
        std::transform(row, row + wide, squared.begin(),
                       [](float d) { return static_cast<double>(d) * static_cast<double>(d); });
        envelope.lower(squared);
        std::transform(squared.begin(), squared.end(), row, [](double s) { return static_cast<float>(std::sqrt(s)); });
    }
    return distance;
}

std::vector<std::uint8_t> without_narrow_absence(std::span<const std::uint8_t> present, std::int64_t columns,
                                                 std::int64_t width) {
    assert(width >= 1 && width <= 64);
    const std::int64_t rows = columns == 0 ? 0 : std::ssize(present) / columns;
    const auto at = [&](std::int64_t x, std::int64_t y) { return present[static_cast<std::size_t>(y * columns + x)]; };
    std::vector<std::uint8_t> wide(present.begin(), present.end());
    if (std::find(wide.begin(), wide.end(), 0) == wide.end()) return wide;
    const RectangleSums ground(columns, rows, at);
    // Squares by their north-west cells, those that reach into the raster from beyond it included.
    const std::int64_t first = 1 - width;
    const RectangleSums squares(columns - first, rows - first, [&](std::int64_t x, std::int64_t y) {
        return ground.of(x + first, y + first, x + first + width, y + first + width) == 0;
    });
    const std::int64_t reach = width / 2;
    for (std::int64_t y = 0; y < rows; ++y)
        for (std::int64_t x = 0; x < columns; ++x) {
            if (at(x, y) != 0) continue;
            const std::int64_t i = x - first, j = y - first;
            const bool near =
                x < reach || y < reach || x >= columns - reach || y >= rows - reach ||
                squares.of(i - width + 1 - reach, j - width + 1 - reach, i + reach + 1, j + reach + 1) > 0;
            wide[static_cast<std::size_t>(y * columns + x)] = near ? 0 : 1;
        }
    return wide;
}

EdgeField::Shape EdgeField::shape_of(const Lattice& l, int most_root_cells_log2, std::int64_t most_cells) {
    const int lattice_log2 = l.deepest_level + l.tile_cells_log2;
    Shape shape;
    for (int log2 = 0; log2 <= most_root_cells_log2; ++log2) {
        const double side = std::ldexp(1.0, lattice_log2 - log2);
        const auto cells = [side](std::int64_t extent) {
            return static_cast<std::int64_t>(std::ceil(static_cast<double>(extent) / side));
        };
        const std::int64_t columns = cells(l.cells_x), rows = cells(l.cells_y);
        if (log2 > 0 && columns * rows > most_cells) break;
        shape = {log2, columns, rows, side};
    }
    return shape;
}

EdgeField::Shape EdgeField::shape_of(const Dataset& d, std::int64_t most_cells) {
    return shape_of(d.lattice, d.texture_size_log2 + d.texture_deepest_level, most_cells);
}

std::int64_t EdgeField::bytes(const Shape& shape, bool of_two) {
    return shape.columns * shape.rows * (of_two ? kBytesOfTwo : kBytes);
}

std::int64_t EdgeField::cells_in(std::int64_t bytes, bool of_two) {
    return std::clamp<std::int64_t>(bytes / (of_two ? kBytesOfTwo : kBytes), 1, kMostCells);
}

EdgeField::EdgeField(const Shape& shape, std::span<const std::uint8_t> present, double band_cells)
    : shape_(shape), values_(present.size()) {
    assert(std::ssize(present) == shape.columns * shape.rows && band_cells > 0);
    const std::vector<float> distance =
        distance_to_absence(present, shape.columns, static_cast<float>(std::ceil(band_cells + 2)));
    // The ground may end a cell farther in than the middle of one that is absent: half of a cell that is present may
    // have none. The band ends where it would.
    const double wide_cells = std::max(band_cells - 1, 0.5);
    std::transform(distance.begin(), distance.end(), values_.begin(), [wide_cells](float d) {
        const double share = std::max(static_cast<double>(d) - 1, 0.0) / wide_cells;
        return static_cast<std::uint8_t>(std::lround(kFar * std::min(share, 1.0)));
    });
    make_levels();
}

std::shared_ptr<const EdgeField> EdgeField::read(const TileStore& store, double band_m, std::int64_t most_cells) {
    auto reader = store.open_reader();
    if (!reader) return nullptr;
    const Dataset& d = store.dataset();
    const Shape shape = shape_of(d, most_cells);
    const double band_cells = band_m / (shape.cell_side * d.lattice.spacing_m);
    const std::vector<std::uint8_t> present =
        without_narrow_absence(GroundReader(d, **reader, shape).read(), shape.columns,
                               static_cast<std::int64_t>(std::clamp(std::ceil(band_cells), 1.0, kMostNarrow)));
    return std::make_shared<EdgeField>(shape, present, band_cells);
}

std::shared_ptr<const EdgeField> EdgeField::of_box(const Lattice& lattice, std::int64_t cells_x, std::int64_t cells_y,
                                                   double band_m) {
    const Shape shape = shape_of(lattice, lattice.deepest_level + lattice.tile_cells_log2);
    std::vector<std::uint8_t> present(static_cast<std::size_t>(shape.columns * shape.rows));
    const auto inside = [&](std::int64_t cell, std::int64_t cells) {
        return (static_cast<double>(cell) + 0.5) * shape.cell_side <= static_cast<double>(cells);
    };
    for (std::int64_t y = 0; y < shape.rows; ++y)
        for (std::int64_t x = 0; x < shape.columns; ++x)
            present[static_cast<std::size_t>(y * shape.columns + x)] = inside(x, cells_x) && inside(y, cells_y) ? 1 : 0;
    return std::make_shared<EdgeField>(shape, present, band_m / (shape.cell_side * lattice.spacing_m));
}

void EdgeField::make_levels() {
    const auto at = [](const std::vector<std::uint8_t>& from, std::int64_t columns, std::int64_t x, std::int64_t y) {
        return from[static_cast<std::size_t>(y * columns + x)];
    };
    const auto make = [&](const std::vector<std::uint8_t>& from, std::int64_t columns, std::int64_t rows,
                          std::int64_t reach) {
        Level level{(columns + 1) / 2, (rows + 1) / 2, {}};
        for (std::int64_t y = 0; y < level.rows; ++y)
            for (std::int64_t x = 0; x < level.columns; ++x) {
                std::uint8_t least = kFar;
                for (std::int64_t j = std::max<std::int64_t>(2 * y - reach, 0); j < std::min(2 * y + 2 + reach, rows);
                     ++j)
                    for (std::int64_t i = std::max<std::int64_t>(2 * x - reach, 0);
                         i < std::min(2 * x + 2 + reach, columns); ++i)
                        least = std::min(least, at(from, columns, i, j));
                level.least.push_back(least);
            }
        return level;
    };
    levels_.push_back(make(values_, shape_.columns, shape_.rows, 1));
    while (std::ssize(levels_) < shape_.root_cells_log2)
        levels_.push_back(make(levels_.back().least, levels_.back().columns, levels_.back().rows, 0));
}

bool EdgeField::is_near_end(int depth, std::int64_t x, std::int64_t y) const {
    const int log2 = shape_.root_cells_log2 - depth;  // of the square's side in cells
    const int used = std::clamp(log2, 1, static_cast<int>(levels_.size()));
    x >>= used - log2;
    y >>= used - log2;
    const Level& level = levels_[static_cast<std::size_t>(used - 1)];
    if (x >= level.columns || y >= level.rows) return false;
    return level.least[static_cast<std::size_t>(y * level.columns + x)] < kFar;
}

}  // namespace scree
