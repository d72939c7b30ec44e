#include "tools/pyramid/height_pyramid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "common/mesh/geometric_error.h"
#include "common/store/height_codec.h"

namespace scree {
namespace {

// Samples at multiples of m: every vertex that a coarsest block of any ancestor can have. Filled ahead of the pass.
class CornerGrid {
public:
    CornerGrid(const Lattice& lattice)
        : m_(lattice.tile_cells()),
          columns_((lattice.cells_x + m_ - 1) / m_ + 1),
          rows_((lattice.cells_y + m_ - 1) / m_ + 1),
          values_(static_cast<std::size_t>(columns_ * rows_)) {}

    std::int64_t rows() const { return rows_; }
    std::int64_t columns() const { return columns_; }
    std::int32_t& at(std::int64_t c, std::int64_t r) { return values_[static_cast<std::size_t>(r * columns_ + c)]; }
    /// Lattice vertex (i, j), multiples of m; beyond the data's extent the border is repeated.
    std::int32_t vertex(std::int64_t i, std::int64_t j) const {
        const std::int64_t c = std::min(i / m_, columns_ - 1), r = std::min(j / m_, rows_ - 1);
        return values_[static_cast<std::size_t>(r * columns_ + c)];
    }

private:
    std::int64_t m_, columns_, rows_;
    std::vector<std::int32_t> values_;
};

// What a band of one level has gathered about one tile.
struct TileRecord {
    bool exists = false;
    HeightBounds bounds;
    std::array<double, kMaxLevel + 1> ancestor_error{};  // deepest tiles: error of each ancestor's coarsest block here
    std::int64_t present_cells = 0;
    std::vector<std::uint8_t> payload;
    std::optional<BranchSummary> branch;  // what finer data makes of the tile
    Result<void> outcome;
};

struct ParentRecord {
    std::uint8_t child_mask = 0, leaf_mask = 0;
    std::array<HeightBounds, 4> children;
    double coarsest_error = 0;
};

struct LevelBand {
    std::int64_t step = 1;              // finest cells from sample to sample
    std::int64_t columns = 0;           // tiles
    std::int64_t width = 0;             // samples in a row, columns * m + 1
    std::int64_t band = 0;              // tile row being gathered
    std::int64_t rows = 0;              // rows of the band already there
    std::vector<std::int32_t> samples;  // (m + 1) rows
    std::vector<ParentRecord> parents;  // by tile column
};

class Builder {
public:
    explicit Builder(const HeightPyramidJob& job)
        : job_(job),
          lattice_(job.lattice),
          m_(job.lattice.tile_cells()),
          n_(job.lattice.tile_cells_log2),
          corners_(job.lattice) {
        result_.min_n = std::numeric_limits<std::int32_t>::max();
        result_.max_n = std::numeric_limits<std::int32_t>::min();
        for (int level = 0; level <= lattice_.deepest_level; ++level) {
            LevelBand band;
            band.step = lattice_.step(level);
            const std::int64_t extent = lattice_.tile_extent(level);
            band.columns = (lattice_.cells_x + extent - 1) / extent;
            band.width = band.columns * m_ + 1;
            band.samples.resize(static_cast<std::size_t>((m_ + 1) * band.width));
            band.parents.resize(static_cast<std::size_t>(band.columns));
            levels_.push_back(std::move(band));
        }
        valid_.resize(static_cast<std::size_t>((m_ + 1) * (lattice_.cells_x + 1)));
        raw_.resize(static_cast<std::size_t>(lattice_.cells_x + 1));
        row_.resize(levels_.back().samples.size() / static_cast<std::size_t>(m_ + 1));
        if (job.deep_tree != nullptr)
            branches_.emplace(job.finest, *job.deep_tree, *job.deep_heights,
                              [this](TileId id, std::vector<std::uint8_t> payload) { return put(id, std::move(payload)); });
    }

    Result<HeightPyramidResult> run() {
        if (auto ok = gather_corners(); !ok) return ok.error();
        const std::int64_t padded = (lattice_.cells_y + m_ - 1) / m_ * m_;
        for (std::int64_t j = 0; j <= padded; ++j)
            if (auto ok = push_row(j); !ok) return ok.error();
        if (auto ok = flush(); !ok) return ok.error();
        result_.tile_count = tile_count_;
        return std::move(result_);
    }

private:
    Result<void> gather_corners() {
        std::vector<std::uint8_t> valid(static_cast<std::size_t>(lattice_.cells_x + 1));
        for (std::int64_t r = 0; r < corners_.rows(); ++r) {
            const std::int64_t j = std::min(r * m_, lattice_.cells_y);
            if (auto ok = job_.spool->read_row(j, raw_, valid); !ok) return ok;
            for (std::int64_t c = 0; c < corners_.columns(); ++c)
                corners_.at(c, r) =
                    job_.quantizer.quantize(raw_[static_cast<std::size_t>(std::min(c * m_, lattice_.cells_x))]);
        }
        return {};
    }

    // Row j of the padded lattice enters the deepest band and every coarser one that samples it.
    Result<void> push_row(std::int64_t j) {
        LevelBand& deepest = levels_.back();
        std::uint8_t* valid = valid_.data() + deepest.rows * (lattice_.cells_x + 1);
        if (j <= lattice_.cells_y) {
            if (auto ok = job_.spool->read_row(j, raw_, {valid, static_cast<std::size_t>(lattice_.cells_x + 1)}); !ok)
                return ok;
            quantize_row(valid);
            if (job_.on_rows && !job_.on_rows(j + 1)) return Error{ErrorCode::interrupted, "stopped"};
        } else {
            std::fill(valid, valid + lattice_.cells_x + 1, std::uint8_t{0});
        }
        for (int level = lattice_.deepest_level; level >= 0; --level) {
            LevelBand& band = levels_[static_cast<std::size_t>(level)];
            if (j % band.step != 0) break;
            if (auto ok = append(level, band); !ok) return ok;
        }
        return {};
    }

    void quantize_row(const std::uint8_t* valid) {
        const std::int64_t width = lattice_.cells_x + 1;
        const HeightQuantizer& q = job_.quantizer;
        for (std::int64_t i = 0; i < width; ++i) {
            const double raw = raw_[static_cast<std::size_t>(i)];
            const std::int32_t value = q.quantize(raw);
            row_[static_cast<std::size_t>(i)] = value;
            if (valid[i] != 0) {
                result_.min_n = std::min(result_.min_n, value);
                result_.max_n = std::max(result_.max_n, value);
                result_.worst_quantum_error_m = std::max(
                    result_.worst_quantum_error_m, std::abs(q.metres(raw) - (q.height_offset_m + value * q.quantum_m)));
            }
        }
        std::fill(row_.begin() + width, row_.end(), row_[static_cast<std::size_t>(width - 1)]);
    }

    // Appends the current row, subsampled, to a level's band; a full band is turned into tiles and its last row carried
    // over.
    Result<void> append(int level, LevelBand& band) {
        std::int32_t* out = band.samples.data() + band.rows * band.width;
        const std::int64_t last = static_cast<std::int64_t>(row_.size()) - 1;
        for (std::int64_t i = 0; i < band.width; ++i)
            out[i] = row_[static_cast<std::size_t>(std::min(i * band.step, last))];
        if (++band.rows <= m_) return {};
        auto ok = level == lattice_.deepest_level ? emit_deepest(band) : emit_coarser(level, band);
        if (!ok) return ok;
        std::copy_n(band.samples.data() + m_ * band.width, band.width, band.samples.data());
        if (level == lattice_.deepest_level)
            std::copy_n(valid_.data() + m_ * (lattice_.cells_x + 1), lattice_.cells_x + 1, valid_.data());
        band.rows = 1;
        ++band.band;
        std::fill(band.parents.begin(), band.parents.end(), ParentRecord{});
        return {};
    }

    // Bands that the last row left incomplete repeat it, from the deepest level up so that children come first.
    Result<void> flush() {
        for (int level = lattice_.deepest_level - 1; level >= 0; --level) {
            LevelBand& band = levels_[static_cast<std::size_t>(level)];
            while (band.band * lattice_.tile_extent(level) < lattice_.cells_y)
                if (auto ok = append(level, band); !ok) return ok;
        }
        return {};
    }

    void copy_samples(const LevelBand& band, std::int64_t column, std::vector<std::int32_t>& out) const {
        out.resize(static_cast<std::size_t>((m_ + 1) * (m_ + 1)));
        for (std::int64_t r = 0; r <= m_; ++r)
            std::copy_n(band.samples.data() + r * band.width + column * m_, m_ + 1, out.data() + r * (m_ + 1));
    }

    std::vector<std::uint8_t> cell_presence(std::int64_t column, std::int64_t& count) const {
        std::vector<std::uint8_t> cells(static_cast<std::size_t>(m_ * m_));
        count = 0;
        const std::int64_t width = lattice_.cells_x + 1;
        for (std::int64_t r = 0; r < m_; ++r)
            for (std::int64_t c = 0; c < m_; ++c) {
                const std::int64_t i = column * m_ + c;
                if (i >= lattice_.cells_x) continue;
                const std::uint8_t* v = valid_.data() + r * width + i;
                const std::uint8_t present = v[0] & v[1] & v[width] & v[width + 1];
                cells[static_cast<std::size_t>(r * m_ + c)] = present;
                count += present;
            }
        return cells;
    }

    TileRecord make_deepest(const LevelBand& band, std::int64_t column) const {
        TileRecord record;
        HeightTile tile;
        tile.presence = cell_presence(column, record.present_cells);
        const TileId id{lattice_.deepest_level, column, band.band};
        const bool deeper = branches_ && job_.deep_tree->refined(id);
        if (record.present_cells == 0 && !deeper) return record;
        record.exists = true;
        copy_samples(band, column, tile.samples);
        if (record.present_cells == m_ * m_) tile.presence.clear();
        const auto vertices = present_vertices(tile.presence, n_);
        const FinestVertices finest{tile.samples.data(), vertices.empty() ? nullptr : vertices.data(), n_};

        const auto [low, high] = std::minmax_element(tile.samples.begin(), tile.samples.end());
        record.bounds.min_n = *low;
        record.bounds.max_n = *high;
        const std::int64_t i = column * m_, j = band.band * m_;
        if (deeper) {
            record.outcome = deepen(id, tile, record);
            return record;
        }
        const auto errors = leaf_errors(finest);
        for (int g = 0; g < n_; ++g)
            record.bounds.error_n[static_cast<std::size_t>(g)] = round_up_to_float(errors[static_cast<std::size_t>(g)]);
        let_errors_grow(record.bounds, n_);
        for (int level = 0; level < lattice_.deepest_level; ++level) {
            const AncestorBlock block = ancestor_block(level, i, j);
            record.ancestor_error[static_cast<std::size_t>(level)] =
                coarse_block_error(block.vertices, block.stride, block.offset_i, block.offset_j, finest);
        }
        tile.header.own = record.bounds;
        record.payload = encode_height_tile(tile, n_, HeightCodec::plane);
        return record;
    }

    AncestorBlock ancestor_block(int level, std::int64_t i, std::int64_t j) const {
        const std::int64_t extent = lattice_.tile_extent(level), stride = extent / 2;
        const std::int64_t bi = i / extent * extent, bj = j / extent * extent;
        AncestorBlock block{{}, stride, i - bi, j - bj};
        for (std::int64_t k = 0; k < 9; ++k)
            block.vertices[static_cast<std::size_t>(k)] = corners_.vertex(bi + k % 3 * stride, bj + k / 3 * stride);
        return block;
    }

    // Builds what lies under a tile of the deepest level of this lattice, and the tile over it.
    Result<void> deepen(TileId id, HeightTile& tile, TileRecord& record) const {
        std::vector<AncestorBlock> blocks;
        for (int level = 0; level < id.level; ++level) blocks.push_back(ancestor_block(level, id.x * m_, id.y * m_));
        AncestorBlock own{{}, m_ / 2, 0, 0};
        for (std::int64_t k = 0; k < 9; ++k)
            own.vertices[static_cast<std::size_t>(k)] =
                tile.samples[static_cast<std::size_t>(k / 3 * (m_ / 2) * (m_ + 1) + k % 3 * (m_ / 2))];
        blocks.push_back(own);
        auto built = branches_->build(id, blocks);
        if (!built) return built.error();
        BranchSummary all;
        all.min_n = std::numeric_limits<std::int32_t>::max();
        all.max_n = std::numeric_limits<std::int32_t>::min();
        std::vector<HeightBounds> existing;
        for (std::size_t q = 0; q < 4; ++q) {
            const BranchSummary& child = built->quadrant[q];
            if (!child.exists) continue;
            existing.push_back(child.bounds);
            set_child(tile.header, static_cast<int>(q), child.bounds,
                      child.leaf && id.level + 1 < job_.finest.deepest_level);
            all.coarsest_leaf = std::min(all.coarsest_leaf, child.coarsest_leaf);
            all.present_cells += child.present_cells;
            all.min_n = std::min(all.min_n, child.min_n);
            all.max_n = std::max(all.max_n, child.max_n);
            all.worst_quantum_error_m = std::max(all.worst_quantum_error_m, child.worst_quantum_error_m);
            for (std::size_t level = 0; level < all.ancestor_error.size(); ++level)
                all.ancestor_error[level] = std::max(all.ancestor_error[level], child.ancestor_error[level]);
        }
        record.exists = !existing.empty();
        if (!record.exists) return {};
        record.present_cells = all.present_cells;
        record.ancestor_error = all.ancestor_error;
        record.bounds = bounds_over(existing, tile.samples, all.ancestor_error[static_cast<std::size_t>(id.level)], n_);
        tile.presence.clear();
        tile.header.own = record.bounds;
        record.payload = encode_height_tile(tile, n_, HeightCodec::plane);
        record.branch = all;
        return {};
    }

    Result<void> emit_deepest(const LevelBand& band) {
        const int level = lattice_.deepest_level;
        std::vector<TileRecord> records(static_cast<std::size_t>(band.columns));
        tbb::parallel_for(std::int64_t{0}, band.columns,
                          [&](std::int64_t x) { records[static_cast<std::size_t>(x)] = make_deepest(band, x); });
        for (std::int64_t x = 0; x < band.columns; ++x) {
            TileRecord& record = records[static_cast<std::size_t>(x)];
            if (!record.outcome) return record.outcome;
            if (!record.exists) continue;
            if (record.branch) {
                result_.coarsest_leaf_level = std::min(result_.coarsest_leaf_level, record.branch->coarsest_leaf);
                result_.min_n = std::min(result_.min_n, record.branch->min_n);
                result_.max_n = std::max(result_.max_n, record.branch->max_n);
                result_.worst_quantum_error_m =
                    std::max(result_.worst_quantum_error_m, record.branch->worst_quantum_error_m);
            }
            const TileId id{level, x, band.band};
            result_.present_cells += record.present_cells;
            for (int up = 0; up < level; ++up) {
                ParentRecord& ancestor =
                    levels_[static_cast<std::size_t>(up)].parents[static_cast<std::size_t>(x >> (level - up))];
                ancestor.coarsest_error =
                    std::max(ancestor.coarsest_error, record.ancestor_error[static_cast<std::size_t>(up)]);
            }
            if (auto ok = store(id, record.bounds, std::move(record.payload), !record.branch); !ok) return ok;
        }
        return {};
    }

    Result<void> emit_coarser(int level, const LevelBand& band) {
        std::vector<TileRecord> records(static_cast<std::size_t>(band.columns));
        tbb::parallel_for(std::int64_t{0}, band.columns, [&](std::int64_t x) {
            const ParentRecord& parent = band.parents[static_cast<std::size_t>(x)];
            if (parent.child_mask != 0) records[static_cast<std::size_t>(x)] = make_coarser(band, x, parent);
        });
        for (std::int64_t x = 0; x < band.columns; ++x) {
            TileRecord& record = records[static_cast<std::size_t>(x)];
            if (record.exists)
                if (auto ok = store({level, x, band.band}, record.bounds, std::move(record.payload), false); !ok) return ok;
        }
        return {};
    }

    TileRecord make_coarser(const LevelBand& band, std::int64_t column, const ParentRecord& parent) const {
        TileRecord record;
        record.exists = true;
        HeightTile tile;
        copy_samples(band, column, tile.samples);
        std::vector<HeightBounds> existing;
        for (int q = 0; q < 4; ++q)
            if ((parent.child_mask >> q & 1) != 0) existing.push_back(parent.children[static_cast<std::size_t>(q)]);
        record.bounds = bounds_over(existing, tile.samples, parent.coarsest_error, n_);
        tile.header.child_mask = parent.child_mask;
        tile.header.leaf_mask = parent.leaf_mask;
        tile.header.own = record.bounds;
        tile.header.children = parent.children;
        record.payload = encode_height_tile(tile, n_, HeightCodec::plane);
        return record;
    }

    Result<void> store(TileId id, const HeightBounds& bounds, std::vector<std::uint8_t> payload, bool leaf) {
        if (leaf) result_.coarsest_leaf_level = std::min(result_.coarsest_leaf_level, id.level);
        if (id.level > 0) {
            LevelBand& band = levels_[static_cast<std::size_t>(id.level - 1)];
            ParentRecord& parent = band.parents[static_cast<std::size_t>(id.x >> 1)];
            const int q = quadrant_of(id);
            parent.child_mask = static_cast<std::uint8_t>(parent.child_mask | (1 << q));
            if (leaf && branches_) parent.leaf_mask = static_cast<std::uint8_t>(parent.leaf_mask | (1 << q));
            parent.children[static_cast<std::size_t>(q)] = bounds;
        }
        return put(id, std::move(payload));
    }

    // Any thread.
    Result<void> put(TileId id, std::vector<std::uint8_t> payload) {
        ++tile_count_;
        if (job_.index != nullptr) job_.index->note(id, payload);
        return job_.writer->put(TileKind::height, *tile_key(lattice_, id), static_cast<int>(HeightCodec::plane),
                                std::move(payload));
    }

    const HeightPyramidJob& job_;
    const Lattice lattice_;
    const std::int64_t m_;
    const int n_;
    CornerGrid corners_;
    std::vector<LevelBand> levels_;
    std::vector<std::uint8_t> valid_;  // (m + 1) rows of the deepest band
    std::vector<double> raw_;
    std::vector<std::int32_t> row_;  // current row, padded
    HeightPyramidResult result_;
    std::optional<DeepBranches> branches_;
    std::atomic<std::int64_t> tile_count_{0};
};

}  // namespace

std::int64_t height_pyramid_bytes(const Lattice& lattice) {
    const std::int64_t m = lattice.tile_cells();
    const std::int64_t width = lattice.cells_x + 2 * m;
    const std::int64_t bands = 2 * (m + 1) * width * 4 + (m + 1) * width;
    const std::int64_t corners = (lattice.cells_x / m + 2) * (lattice.cells_y / m + 2) * 4;
    const std::int64_t records =
        width / m * static_cast<std::int64_t>(sizeof(TileRecord) + 2 * sizeof(ParentRecord) + 4096);
    return bands + corners + records + width * 12 + (std::int64_t{2} << 20);
}

Result<HeightPyramidResult> build_height_pyramid(const HeightPyramidJob& job) { return Builder(job).run(); }

}  // namespace scree
