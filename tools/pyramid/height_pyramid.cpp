#include "tools/pyramid/height_pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include "common/mesh/geometric_error.h"
#include "common/store/height_codec.h"
#include "tools/pyramid/sample_range.h"
#include "tools/stage_clock.h"

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

// What finer tiles have found out about one tile.
struct ParentRecord {
    std::uint8_t child_mask = 0, leaf_mask = 0;
    std::array<HeightBounds, 4> children;
    std::atomic<double> coarsest_error{0};  ///< of its coarsest block over the leaves looked at so far

    void note_error(double error) {
        double known = coarsest_error.load(std::memory_order_relaxed);
        while (error > known && !coarsest_error.compare_exchange_weak(known, error, std::memory_order_relaxed)) {
        }
    }
};

struct LevelBand {
    std::int64_t step = 1;              // finest cells from sample to sample
    std::int64_t columns = 0;           // tiles
    std::int64_t width = 0;             // samples in a row, columns * m + 1
    std::int64_t band = 0;              // tile row being gathered
    std::int64_t rows = 0;              // rows of the band already there
    std::vector<std::int32_t> samples;  // (m + 1) rows
    std::vector<ParentRecord> parents;  // by tile column

    void start_next(std::int64_t m) {
        std::copy_n(samples.data() + m * width, width, samples.data());
        rows = 1;
        ++band;
        std::vector<ParentRecord>(parents.size()).swap(parents);
    }
};

// A tile of the band that is being made.
struct TileRecord {
    bool exists = false;
    HeightBounds bounds;
    std::int64_t present_cells = 0;
    std::vector<std::uint8_t> payload;
    std::optional<BranchSummary> branch;  // what finer data makes of the tile
    Result<void> outcome;
};

// Tiles that a thread makes together: sixteen share the work of their errors, and one clock reading.
std::int64_t tiles_at_once(int tile_cells_log2) { return tile_cells_log2 <= 5 ? 32 : tile_cells_log2 == 6 ? 16 : 4; }

// A tile on its way, and what its errors are made of.
struct TileDraft {
    TileRecord* record = nullptr;
    std::int64_t column = 0;
    HeightTile tile;
    std::vector<std::uint8_t> vertices;  // of present cells; empty: all
    bool deeper = false;

    FinestVertices finest(int n) const {
        return {tile.samples.data(), vertices.empty() ? nullptr : vertices.data(), n};
    }
};

class Builder {
public:
    explicit Builder(const HeightPyramidJob& job)
        : job_(job),
          lattice_(job.lattice),
          m_(job.lattice.tile_cells()),
          n_(job.lattice.tile_cells_log2),
          width_(job.lattice.cells_x + 1),
          corners_(job.lattice) {
        for (int level = 0; level <= lattice_.deepest_level; ++level) {
            LevelBand band;
            band.step = lattice_.step(level);
            const std::int64_t extent = lattice_.tile_extent(level);
            band.columns = (lattice_.cells_x + extent - 1) / extent;
            band.width = band.columns * m_ + 1;
            band.samples.resize(static_cast<std::size_t>((m_ + 1) * band.width));
            band.parents = std::vector<ParentRecord>(static_cast<std::size_t>(band.columns));
            levels_.push_back(std::move(band));
        }
        valid_.resize(static_cast<std::size_t>((m_ + 1) * width_));
        if (job.deep_tree != nullptr)
            branches_.emplace(job.finest, *job.deep_tree, *job.deep_heights,
                              [this](TileId id, const HeightTile& tile) { return put(id, encoded(tile)); });
    }

    Result<HeightPyramidResult> run() {
        auto made = job_.coverage == nullptr ? make_all() : make_covered();
        if (!made) return made.error();
        result_.tile_count = tile_count_;
        result_.min_n = range_.min_n;
        result_.max_n = range_.max_n;
        result_.worst_quantum_error_m = range_.worst_error_m;
        return std::move(result_);
    }

private:
    Result<void> make_all() {
        if (auto ok = gather_corners(); !ok) return ok;
        const std::int64_t bands = (lattice_.cells_y + m_ - 1) / m_;
        for (std::int64_t band = 0; band < bands; ++band)
            if (auto ok = make_band(); !ok) return ok;
        return flush();
    }

    Result<void> gather_corners() {
        std::vector<double> raw(static_cast<std::size_t>(width_));
        std::vector<std::uint8_t> valid(raw.size());
        for (std::int64_t r = 0; r < corners_.rows(); ++r) {
            const std::int64_t j = std::min(r * m_, lattice_.cells_y);
            if (auto ok = job_.spool->read_row(j, raw, valid); !ok) return ok;
            for (std::int64_t c = 0; c < corners_.columns(); ++c)
                corners_.at(c, r) =
                    job_.quantizer.quantize(raw[static_cast<std::size_t>(std::min(c * m_, lattice_.cells_x))]);
        }
        return {};
    }

    // --- rows ---

    // The deepest level's next band of tiles, and those of coarser levels that it completes.
    Result<void> make_band() {
        LevelBand& deepest = levels_.back();
        const std::int64_t first = deepest.band * m_ + deepest.rows;
        const std::int64_t end = std::min((deepest.band + 1) * m_, lattice_.cells_y) + 1;
        if (auto ok = read_rows(first, end); !ok) return ok;
        if (job_.on_rows)
            for (std::int64_t j = first; j < end; ++j)
                if (!job_.on_rows(j + 1)) return Error{ErrorCode::interrupted, "stopped"};
        repeat_last_row(end);
        deepest.rows = m_ + 1;
        if (auto ok = emit_deepest(deepest, {{0, deepest.columns}}); !ok) return ok;
        const std::int64_t last = (deepest.band + 1) * m_;
        deepest.start_next(m_);
        std::copy_n(valid_.data() + m_ * width_, width_, valid_.data());
        for (int level = lattice_.deepest_level - 1; level >= 0; --level) {
            LevelBand& band = levels_[static_cast<std::size_t>(level)];
            band.rows = std::min(last / band.step - band.band * m_, m_) + 1;
            if (band.rows <= m_) continue;
            if (auto ok = finish_coarser(level, band, {{0, band.columns}}); !ok) return ok;
            band.start_next(m_);
        }
        return {};
    }

    Result<void> read_rows(std::int64_t first, std::int64_t end) {
        std::mutex mutex;
        Result<void> outcome;
        tbb::parallel_for(first, end, [&](std::int64_t j) {
            auto range = job_.spool->wide() ? read_row<double>(j) : read_row<float>(j);
            const std::lock_guard lock(mutex);
            if (range)
                range_.include(*range);
            else
                outcome = range.error();
        });
        return outcome;
    }

    // Row j enters the deepest band and every coarser one that samples it.
    template <class T>
    Result<QuantizedRange> read_row(std::int64_t j) {
        thread_local std::vector<T> raw;
        raw.resize(static_cast<std::size_t>(width_));
        LevelBand& deepest = levels_.back();
        const std::int64_t r = j - deepest.band * m_;
        const std::span<std::uint8_t> valid(valid_.data() + r * width_, static_cast<std::size_t>(width_));
        {
            const StageClock::Scope clock(Stage::store);
            if (auto ok = job_.spool->read_row(j, std::span<T>(raw), valid); !ok) return ok.error();
        }
        const StageClock::Scope clock(Stage::encode);
        std::int32_t* row = deepest.samples.data() + r * deepest.width;
        const bool all_valid = !job_.spool->may_lack_samples(j);
        const auto range =
            job_.quantizer.quantize(std::span<const T>(raw), all_valid ? std::span<const std::uint8_t>{} : valid,
                                    {row, static_cast<std::size_t>(width_)});
        std::fill(row + width_, row + deepest.width, row[width_ - 1]);
        share_row(j, row);
        return range;
    }

    void share_row(std::int64_t j, const std::int32_t* row) {
        for (int level = lattice_.deepest_level - 1; level >= 0; --level) {
            LevelBand& band = levels_[static_cast<std::size_t>(level)];
            if (j % band.step != 0) break;
            const std::int64_t r = j / band.step - band.band * m_, end = levels_.back().width;
            std::int32_t* out = band.samples.data() + r * band.width;
            const std::int64_t inside = std::min((end + band.step - 1) / band.step, band.width);
            for (std::int64_t i = 0; i < inside; ++i) out[i] = row[i * band.step];
            std::fill(out + inside, out + band.width, row[end - 1]);
        }
    }

    // Below the data's last row that row goes on, absent.
    void repeat_last_row(std::int64_t end) {
        LevelBand& deepest = levels_.back();
        const std::int64_t after = (deepest.band + 1) * m_ + 1;
        for (std::int64_t j = end; j < after; ++j) {
            const std::int64_t r = j - deepest.band * m_;
            std::int32_t* row = deepest.samples.data() + r * deepest.width;
            std::copy_n(row - deepest.width, deepest.width, row);
            std::fill_n(valid_.data() + r * width_, width_, std::uint8_t{0});
            share_row(j, row);
        }
    }

    // Bands that the last row left incomplete repeat it, from the deepest level up so that children come first.
    Result<void> flush() {
        for (int level = lattice_.deepest_level - 1; level >= 0; --level) {
            LevelBand& band = levels_[static_cast<std::size_t>(level)];
            if (band.band * lattice_.tile_extent(level) >= lattice_.cells_y) continue;
            repeat_to_end(band);
            if (auto ok = finish_coarser(level, band, {{0, band.columns}}); !ok) return ok;
            band.start_next(m_);
        }
        return {};
    }

    void repeat_to_end(LevelBand& band) {
        const std::int32_t* last = levels_.back().samples.data();  // of the band that would come next
        const std::int64_t end = levels_.back().width;
        for (; band.rows <= m_; ++band.rows) {
            std::int32_t* out = band.samples.data() + band.rows * band.width;
            for (std::int64_t i = 0; i < band.width; ++i) out[i] = last[std::min(i * band.step, end - 1)];
        }
    }

    // --- a sparse spool: only tiles that files may reach are looked at, with the same outcome ---

    Result<void> make_covered() {
        if (auto ok = gather_covered_corners(); !ok) return ok;
        const int deepest = lattice_.deepest_level;
        const std::int64_t bands = (lattice_.cells_y + m_ - 1) / m_;
        for (std::int64_t y = 0; y < bands; ++y) {
            for (std::int64_t j = y * m_ + (y > 0 ? 1 : 0);
                 job_.on_rows && j <= std::min((y + 1) * m_, lattice_.cells_y); ++j)
                if (!job_.on_rows(j + 1)) return Error{ErrorCode::interrupted, "stopped"};
            for (int level = deepest; level >= 0; --level) {
                const int down = deepest - level;
                const bool last = y + 1 == bands || (y + 1) % (std::int64_t{1} << down) == 0;
                if (!last) break;
                if (auto ok = make_covered_band(level, y >> down); !ok) return ok;
            }
        }
        return {};
    }

    Result<void> make_covered_band(int level, std::int64_t y) {
        const Coverage::Runs& runs = job_.coverage->tiles(level, y);
        LevelBand& band = levels_[static_cast<std::size_t>(level)];
        band.band = y;
        if (!runs.empty()) {
            if (auto ok = read_covered_rows(level, band, runs); !ok) return ok;
            auto made = level == lattice_.deepest_level ? emit_deepest(band, runs) : finish_coarser(level, band, runs);
            if (!made) return made;
        }
        // What comes next: tiles note what they are in the band above.
        band.band = y + 1;
        if (!runs.empty()) std::vector<ParentRecord>(band.parents.size()).swap(band.parents);
        return {};
    }

    Result<void> read_covered_rows(int level, LevelBand& band, const Coverage::Runs& runs) {
        std::mutex mutex;
        Result<void> outcome;
        tbb::parallel_for(std::int64_t{0}, m_ + 1, [&](std::int64_t r) {
            const StageClock::Scope clock(Stage::encode);
            QuantizedRange range;
            auto ok = read_covered_row(level, band, runs, r, range);
            const std::lock_guard lock(mutex);
            range_.include(range);
            if (!ok) outcome = ok;
        });
        return outcome;
    }

    // Beyond the data's extent its border goes on, absent.
    Result<void> read_covered_row(int level, LevelBand& band, const Coverage::Runs& runs, std::int64_t r,
                                  QuantizedRange& range) {
        thread_local HeightSpool::SparseRow row;
        const std::int64_t j = (band.band * m_ + r) * band.step;
        if (auto ok = job_.spool->read_sparse(std::min(j, lattice_.cells_y), row); !ok) return ok;
        const bool deepest = level == lattice_.deepest_level;
        for (const auto& [begin, end] : runs)
            for (std::int64_t c = begin * m_; c <= end * m_; ++c) {
                const std::int64_t i = std::min(c * band.step, lattice_.cells_x);
                const double raw = row.at(i);
                const std::int32_t n = job_.quantizer.quantize(raw);
                band.samples[static_cast<std::size_t>(r * band.width + c)] = n;
                if (!deepest || c > lattice_.cells_x) continue;
                const bool valid = j <= lattice_.cells_y && row.valid(i);
                valid_[static_cast<std::size_t>(r * width_ + c)] = static_cast<std::uint8_t>(valid);
                if (valid) range.include({n, n, job_.quantizer.error_m(raw)});
            }
        return {};
    }

    // Those that a coarsest block of a tile above the deepest level has.
    Result<void> gather_covered_corners() {
        HeightSpool::SparseRow row;
        for (int level = 0; level < lattice_.deepest_level; ++level) {
            const std::int64_t stride = lattice_.tile_extent(level) / 2 / m_;  // corners
            for (const auto& [y, runs] : job_.coverage->rows(level))
                for (std::int64_t k = 0; k <= 2; ++k) {
                    const std::int64_t r = std::min((2 * y + k) * stride, corners_.rows() - 1);
                    if (auto ok = job_.spool->read_sparse(std::min(r * m_, lattice_.cells_y), row); !ok) return ok;
                    for (const auto& [begin, end] : runs)
                        for (std::int64_t x = 2 * begin; x <= 2 * end; ++x) {
                            const std::int64_t c = std::min(x * stride, corners_.columns() - 1);
                            corners_.at(c, r) = job_.quantizer.quantize(row.at(std::min(c * m_, lattice_.cells_x)));
                        }
                }
        }
        return {};
    }

    // --- deepest tiles ---

    Result<void> emit_deepest(LevelBand& band, const Coverage::Runs& runs) {
        records_.clear();
        records_.resize(static_cast<std::size_t>(band.columns));
        const std::int64_t chunk = tiles_at_once(n_);
        const bool all_valid = job_.coverage == nullptr && std::memchr(valid_.data(), 0, valid_.size()) == nullptr;
        for (const auto& [begin, end] : runs)
            tbb::parallel_for(
                std::int64_t{0}, (end - begin + chunk - 1) / chunk, [&, first = begin, last = end](std::int64_t k) {
                    make_deepest(band, first + k * chunk, std::min(first + (k + 1) * chunk, last), all_valid);
                });
        for (std::int64_t x = 0; x < band.columns; ++x) {
            TileRecord& record = records_[static_cast<std::size_t>(x)];
            if (!record.outcome) return record.outcome;
            if (!record.exists) continue;
            if (record.branch) {
                result_.coarsest_leaf_level = std::min(result_.coarsest_leaf_level, record.branch->coarsest_leaf);
                range_.include({record.branch->min_n, record.branch->max_n, record.branch->worst_quantum_error_m});
            }
            result_.present_cells += record.present_cells;
            if (auto ok = store({lattice_.deepest_level, x, band.band}, record, !record.branch); !ok) return ok;
        }
        return {};
    }

    // Tiles [begin, end) of the band.
    void make_deepest(const LevelBand& band, std::int64_t begin, std::int64_t end, bool all_valid) {
        // A tile that goes deeper waits for others, and its thread may take up a chunk meanwhile.
        std::vector<TileDraft> drafts = take_drafts(static_cast<std::size_t>(end - begin));
        std::size_t count = 0;
        {
            const StageClock::Scope clock(Stage::error);
            for (std::int64_t x = begin; x < end; ++x)
                if (start_tile(band, x, all_valid, drafts[count])) ++count;
            certify(band, std::span(drafts).first(count));
        }
        for (TileDraft& draft : std::span(drafts).first(count))
            if (draft.deeper)
                draft.record->outcome =
                    deepen({lattice_.deepest_level, draft.column, band.band}, draft.tile, *draft.record);
        const StageClock::Scope clock(Stage::encode);
        for (TileDraft& draft : std::span(drafts).first(count)) {
            if (draft.deeper) continue;
            draft.tile.header.own = draft.record->bounds;
            draft.record->payload = encoded(draft.tile);
        }
        give_back(std::move(drafts));
    }

    // Drafts keep their memory from band to band.
    std::vector<TileDraft> take_drafts(std::size_t count) {
        std::vector<TileDraft> drafts;
        {
            const std::lock_guard lock(drafts_mutex_);
            if (!idle_drafts_.empty()) {
                drafts = std::move(idle_drafts_.back());
                idle_drafts_.pop_back();
            }
        }
        if (drafts.size() < count) drafts.resize(count);
        return drafts;
    }
    void give_back(std::vector<TileDraft> drafts) {
        const std::lock_guard lock(drafts_mutex_);
        idle_drafts_.push_back(std::move(drafts));
    }

    // False: the tile holds nothing.
    bool start_tile(const LevelBand& band, std::int64_t column, bool all_valid, TileDraft& draft) {
        TileRecord& record = records_[static_cast<std::size_t>(column)];
        draft.record = &record;
        draft.column = column;
        draft.tile.header = {};
        draft.tile.presence.clear();
        if (all_valid && (column + 1) * m_ <= lattice_.cells_x)
            record.present_cells = m_ * m_;
        else
            record.present_cells = cell_presence(column, draft.tile.presence);
        draft.deeper = branches_ && job_.deep_tree->refined({lattice_.deepest_level, column, band.band});
        if (record.present_cells == 0 && !draft.deeper) return false;
        record.exists = true;
        copy_samples(band, column, draft.tile.samples);
        if (record.present_cells == m_ * m_) draft.tile.presence.clear();
        draft.vertices = present_vertices(draft.tile.presence, n_);
        const SampleRange range = range_of(draft.tile.samples);
        record.bounds.min_n = range.low;
        record.bounds.max_n = range.high;
        return true;
    }

    void copy_samples(const LevelBand& band, std::int64_t column, std::vector<std::int32_t>& out) const {
        out.resize(static_cast<std::size_t>((m_ + 1) * (m_ + 1)));
        for (std::int64_t r = 0; r <= m_; ++r)
            std::copy_n(band.samples.data() + r * band.width + column * m_, m_ + 1, out.data() + r * (m_ + 1));
    }

    std::int64_t cell_presence(std::int64_t column, std::vector<std::uint8_t>& cells) const {
        cells.assign(static_cast<std::size_t>(m_ * m_), 0);
        std::int64_t count = 0;
        const std::int64_t columns = std::min(m_, lattice_.cells_x - column * m_);
        for (std::int64_t r = 0; r < m_; ++r) {
            const std::uint8_t* v = valid_.data() + r * width_ + column * m_;
            std::uint8_t* out = cells.data() + r * m_;
            for (std::int64_t c = 0; c < columns; ++c)
                out[c] = static_cast<std::uint8_t>(v[c] & v[c + 1] & v[c + width_] & v[c + width_ + 1]);
            for (std::int64_t c = 0; c < columns; ++c) count += out[c];
        }
        return count;
    }

    // The errors of leaves, and what every ancestor's coarsest block misses them by.
    void certify(const LevelBand& band, std::span<const TileDraft> drafts) {
        thread_local std::vector<FinestVertices> uneven;
        thread_local std::vector<LeafErrors> uneven_errors, errors;
        uneven.clear();
        const auto is_uneven = [](const TileDraft& d) {
            return !d.deeper && d.record->bounds.min_n < d.record->bounds.max_n;
        };
        for (const TileDraft& d : drafts)
            if (is_uneven(d)) uneven.push_back(d.finest(n_));
        uneven_errors.resize(uneven.size());
        leaf_errors(uneven, uneven_errors);
        errors.assign(drafts.size(), LeafErrors{});  // a flat tile has none
        std::size_t next = 0;
        for (std::size_t k = 0; k < drafts.size(); ++k)
            if (is_uneven(drafts[k])) errors[k] = uneven_errors[next++];
        for (std::size_t k = 0; k < drafts.size(); ++k) {
            if (drafts[k].deeper) continue;
            HeightBounds& bounds = drafts[k].record->bounds;
            for (std::size_t g = 0; g < static_cast<std::size_t>(n_); ++g)
                bounds.error_n[g] = round_up_to_float(errors[k][g]);
            let_errors_grow(bounds, n_);
        }
        for (int level = 0; level < lattice_.deepest_level; ++level)
            for (std::size_t k = 0; k < drafts.size(); ++k) {
                if (drafts[k].deeper) continue;
                const AncestorBlock block = ancestor_block(level, drafts[k].column * m_, band.band * m_);
                ParentRecord& parent = parent_of({lattice_.deepest_level, drafts[k].column, band.band}, level);
                parent.note_error(greatest_block_error(block.vertices, block.stride, block.offset_i, block.offset_j,
                                                       drafts[k].finest(n_), errors[k],
                                                       parent.coarsest_error.load(std::memory_order_relaxed)));
            }
    }

    ParentRecord& parent_of(TileId id, int level) {
        return levels_[static_cast<std::size_t>(level)].parents[static_cast<std::size_t>(id.x >> (id.level - level))];
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
    Result<void> deepen(TileId id, HeightTile& tile, TileRecord& record) {
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
        for (int level = 0; level < id.level; ++level)
            parent_of(id, level).note_error(all.ancestor_error[static_cast<std::size_t>(level)]);
        record.bounds = bounds_over(existing, tile.samples, all.ancestor_error[static_cast<std::size_t>(id.level)], n_);
        tile.presence.clear();
        tile.header.own = record.bounds;
        record.payload = encoded(tile);
        record.branch = all;
        return {};
    }

    // --- coarser tiles ---

    Result<void> finish_coarser(int level, LevelBand& band, const Coverage::Runs& runs) {
        records_.clear();
        records_.resize(static_cast<std::size_t>(band.columns));
        const std::int64_t chunk = tiles_at_once(n_);
        for (const auto& [begin, end] : runs)
            tbb::parallel_for(
                std::int64_t{0}, (end - begin + chunk - 1) / chunk, [&, first = begin, last = end](std::int64_t k) {
                    const StageClock::Scope clock(Stage::encode);
                    for (std::int64_t x = first + k * chunk; x < std::min(first + (k + 1) * chunk, last); ++x)
                        make_coarser(band, x, records_[static_cast<std::size_t>(x)]);
                });
        for (std::int64_t x = 0; x < band.columns; ++x)
            if (TileRecord& record = records_[static_cast<std::size_t>(x)]; record.exists)
                if (auto ok = store({level, x, band.band}, record, false); !ok) return ok;
        return {};
    }

    void make_coarser(const LevelBand& band, std::int64_t column, TileRecord& record) const {
        const ParentRecord& parent = band.parents[static_cast<std::size_t>(column)];
        if (parent.child_mask == 0) return;
        record.exists = true;
        thread_local HeightTile tile;
        copy_samples(band, column, tile.samples);
        std::array<HeightBounds, 4> existing;
        std::size_t count = 0;
        for (std::size_t q = 0; q < 4; ++q)
            if ((parent.child_mask >> q & 1) != 0) existing[count++] = parent.children[q];
        record.bounds = bounds_over(std::span(existing).first(count), tile.samples, parent.coarsest_error.load(), n_);
        tile.header.child_mask = parent.child_mask;
        tile.header.leaf_mask = parent.leaf_mask;
        tile.header.own = record.bounds;
        tile.header.children = parent.children;
        record.payload = encoded(tile);
    }

    // --- finished tiles ---

    Result<void> store(TileId id, TileRecord& record, bool leaf) {
        if (leaf) result_.coarsest_leaf_level = std::min(result_.coarsest_leaf_level, id.level);
        if (id.level > 0) {
            ParentRecord& parent = parent_of(id, id.level - 1);
            const int q = quadrant_of(id);
            parent.child_mask = static_cast<std::uint8_t>(parent.child_mask | (1 << q));
            if (leaf && branches_) parent.leaf_mask = static_cast<std::uint8_t>(parent.leaf_mask | (1 << q));
            parent.children[static_cast<std::size_t>(q)] = record.bounds;
        }
        return put(id, std::move(record.payload));
    }

    // The codec is named here and in put() alone: a row's number must be that of what made its payload. Any thread.
    std::vector<std::uint8_t> encoded(const HeightTile& tile) const { return encode_height_tile(tile, n_, job_.codec); }

    // Any thread.
    Result<void> put(TileId id, std::vector<std::uint8_t> payload) {
        ++tile_count_;
        if (job_.textures != nullptr) say_where_textures_end(payload, id, *job_.textures);
        if (job_.index != nullptr) job_.index->note(id, payload);
        return job_.writer->put(TileKind::height, *tile_key(lattice_, id), static_cast<int>(job_.codec),
                                std::move(payload));
    }

    const HeightPyramidJob& job_;
    const Lattice lattice_;
    const std::int64_t m_;
    const int n_;
    const std::int64_t width_;  // samples in a row of the data
    CornerGrid corners_;
    std::vector<LevelBand> levels_;
    std::vector<std::uint8_t> valid_;  // (m + 1) rows of the deepest band
    std::vector<TileRecord> records_;  // of the band that is being made
    QuantizedRange range_;             // over valid samples
    HeightPyramidResult result_;
    std::optional<DeepBranches> branches_;
    std::atomic<std::int64_t> tile_count_{0};
    std::mutex drafts_mutex_;
    std::vector<std::vector<TileDraft>> idle_drafts_;
};

}  // namespace

void say_where_textures_end(std::span<std::uint8_t> payload, TileId id, const TextureDepth& textures) {
    std::uint8_t children = 0;
    for (int q = 0; q < 4; ++q)
        if (textures.ends(child_of(id, q))) children = static_cast<std::uint8_t>(children | 1 << q);
    set_texture_ends(payload, textures.ends(id), children);
}

std::int64_t height_pyramid_bytes(const Lattice& lattice, HeightCodec codec) {
    const std::int64_t m = lattice.tile_cells();
    const std::int64_t width = lattice.cells_x + 2 * m;
    const std::int64_t bands = 2 * (m + 1) * width * 4 + (m + 1) * width;
    const std::int64_t corners = (lattice.cells_x / m + 2) * (lattice.cells_y / m + 2) * 4;
    const std::int64_t payload = named(codec).bytes_a_sample * (m + 1) * (m + 1) + 512;
    const std::int64_t records =
        width / m * (static_cast<std::int64_t>(sizeof(TileRecord) + 2 * sizeof(ParentRecord)) + payload);
    // A thread's rows and drafts.
    const std::int64_t threads = std::max(1u, std::thread::hardware_concurrency());
    const std::int64_t drafts =
        threads * (width * 12 + (tiles_at_once(lattice.tile_cells_log2) + 32) * (m + 1) * (m + 1) * 6);
    return bands + corners + records + drafts + (std::int64_t{2} << 20);
}

Result<HeightPyramidResult> build_height_pyramid(const HeightPyramidJob& job) { return Builder(job).run(); }

}  // namespace scree
