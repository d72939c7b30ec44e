#include "tools/pyramid/texture_stage.h"

#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <unordered_set>

#include "common/store/seed_codec.h"
#include "tools/pyramid/texture_filter.h"
#include "tools/pyramid/texture_pyramid.h"
#include "tools/stage_clock.h"

namespace scree {
namespace {

constexpr std::int64_t kSampledColumns = 2048;  // of a task
constexpr int kLeastDeepTexelsLog2 = 15;

Error interrupted() { return {ErrorCode::interrupted, "stopped"}; }

// Levels that a piece under one tile may span: 2^15 texels side by side.
int deepest_step(const Dataset& d) { return std::max(1, kLeastDeepTexelsLog2 - d.texture_size_log2); }

}  // namespace

int seed_level(const Dataset& d) { return std::max(0, d.least_texture_level() - kSeedLevelsUp); }

TextureStage::TextureStage(TextureStageJob job) : job_(std::move(job)), coarsest_(job_.dataset.least_texture_level()) {
    for (int level = coarsest_; level <= job_.dataset.texture_deepest_level; ++level)
        grounds_.push_back(std::make_unique<TexelGround>(job_.dataset, job_.base, *job_.index, job_.heights, level));
}

std::int64_t TextureStage::district_columns() const {
    const Dataset& d = job_.dataset;
    return TexturePyramid::padded_texels(job_.base.cells_x, job_.base, d.texture_size_log2, seed_level(d)) >>
           d.texture_size_log2;
}
std::int64_t TextureStage::district_rows() const {
    const Dataset& d = job_.dataset;
    return TexturePyramid::padded_texels(job_.base.cells_y, job_.base, d.texture_size_log2, seed_level(d)) >>
           d.texture_size_log2;
}

std::int64_t TextureStage::bytes_needed(const Dataset& d, std::int64_t texels_wide) {
    const std::int64_t seeds = (texels_wide >> kSeedLevelsUp << d.texture_size_log2) * 4;
    return TexturePyramid::bytes_needed(texels_wide, d.texture_size_log2) + 2 * seeds + (std::int64_t{24} << 20);
}

std::int64_t TextureStage::least_deep_texels(const Dataset& d) {
    const int deeper = d.texture_deepest_level - d.least_texture_level();
    return std::int64_t{1} << (d.texture_size_log2 + std::min(deepest_step(d), deeper));
}

// A rectangle of tiles of `root_level`, down to `deepest_level`.
struct TextureStage::Rectangle {
    int root_level = 0, deepest_level = 0;
    std::int64_t first_column = 0, first_row = 0, columns = 0, rows = 0;
};

// Makes the texels of a piece, from north to south: of its deepest level, and of tiles above that are not refined.
class TextureStage::Piece {
public:
    Piece(TextureStage& stage, const Rectangle& piece) : stage_(stage), depth_(*stage.job_.depth), piece_(piece) {
        const int down = piece.deepest_level - piece.root_level;
        first_tile_ = piece.first_column << down;
        size_ = stage.job_.dataset.texture_size();
        prepared_end_.resize(static_cast<std::size_t>(down) + 1);
    }

    /// Of a level, rows of `columns` texels; those of tiles that there are.
    Result<void> fill(int level, std::int64_t row, std::int64_t rows, std::int64_t columns, std::uint8_t* rgba) {
        const TextureStageJob& job = stage_.job_;
        if (job.stop != nullptr && *job.stop) return interrupted();
        const std::int64_t first = (piece_.first_column << (level - piece_.root_level)) * size_;
        if (level == piece_.deepest_level && level < depth_.deepest())
            if (auto ok = copy_below(row, rows, columns, rgba); !ok) return ok;
        const auto all = leaves_of(level, row, first, columns), leaves = with_heights(level, row, all);
        if (leaves != all) clear(all, first, rows, columns, rgba);
        if (leaves.empty()) return {};
        ImageStack* imagery = job.imagery == nullptr ? nullptr : job.imagery->at(level);
        if (imagery != nullptr)
            if (auto ok = prepare(*imagery, level, row, first, columns); !ok) return ok;
        for (const auto& [begin, end] : leaves) {
            const Part part{begin, row, end - begin, rows, rgba + (begin - first) * 4, columns * 4};
            bool opaque = false;
            if (imagery != nullptr) {
                auto sampled = sample(*imagery, part);
                if (!sampled) return sampled.error();
                opaque = *sampled;
            } else {
                for (std::int64_t r = 0; r < rows; ++r)
                    std::memset(part.rgba + r * part.row_bytes, 0, static_cast<std::size_t>(part.columns * 4));
            }
            auto ok =
                stage_.ground(level).finish(part.column, row, part.columns, rows, part.rgba, part.row_bytes, opaque);
            if (!ok) return ok;
        }
        return {};
    }

    /// Tiles of the deepest level that are refined: was this one stored?
    bool stored_below(TileId id) const {
        const std::lock_guard lock(below_mutex_);
        return below_stored_.count(id) != 0;
    }

private:
    // Texels [column, column + columns) x [row, row + rows) of a level.
    struct Part {
        std::int64_t column, row, columns, rows;
        std::uint8_t* rgba;
        std::int64_t row_bytes;
    };

    TextureDepth::Runs leaves_of(int level, std::int64_t row, std::int64_t first, std::int64_t columns) const {
        if (!depth_.varies()) return {{first, first + columns}};
        auto runs = depth_.leaf_runs(level, row / size_, first / size_, (first + columns) / size_);
        for (TextureDepth::Run& run : runs) run = {run.begin * size_, run.end * size_};
        return runs;
    }

    // Those parts of runs of pixels, in whole tiles, over which there are heights.
    TextureDepth::Runs with_heights(int level, std::int64_t row, TextureDepth::Runs runs) const {
        for (TextureDepth::Run& run : runs) run = {run.begin / size_, run.end / size_};
        runs = runs_where(runs, [&](std::int64_t x) { return stage_.has_heights({level, x, row / size_}); });
        for (TextureDepth::Run& run : runs) run = {run.begin * size_, run.end * size_};
        return runs;
    }

    void clear(const TextureDepth::Runs& runs, std::int64_t first, std::int64_t rows, std::int64_t columns,
               std::uint8_t* rgba) const {
        for (const auto& [begin, end] : runs)
            for (std::int64_t r = 0; r < rows; ++r)
                std::memset(rgba + (r * columns + begin - first) * 4, 0, static_cast<std::size_t>((end - begin) * 4));
    }

    // Rows are made ready before they are sampled, more of them at a time.
    Result<void> prepare(ImageStack& imagery, int level, std::int64_t row, std::int64_t first, std::int64_t columns) {
        std::int64_t& prepared_end = prepared_end_[static_cast<std::size_t>(level - piece_.root_level)];
        if (row < prepared_end) return {};
        imagery.release_north_of(row);
        const std::int64_t piece_end = (piece_.first_row + piece_.rows) << (level - piece_.root_level);
        const std::int64_t end = std::min(row + imagery.rows_at_once(), piece_end * size_);
        const std::atomic<bool>* stop = stage_.job_.stop;
        const auto go_on = [&](std::int64_t) { return stop == nullptr || !*stop; };
        for (std::int64_t top = row; top < end;) {
            // Tiles of a row have the same leaves throughout; where the depth does not vary, all rows have.
            const std::int64_t bottom = depth_.varies() ? std::min((top / size_ + 1) * size_, end) : end;
            for (const auto& [begin, last] : with_heights(level, top, leaves_of(level, top, first, columns)))
                if (auto ok = imagery.prepare(begin, top, last - begin, bottom - top, go_on); !ok) return ok;
            top = bottom;
        }
        prepared_end = end;
        return {};
    }

    // True: all texels are opaque.
    Result<bool> sample(const ImageStack& imagery, const Part& part) {
        std::mutex mutex;
        Result<bool> outcome = true;
        const std::int64_t parts = (part.columns + kSampledColumns - 1) / kSampledColumns;
        tbb::parallel_for(std::int64_t{0}, parts, [&](std::int64_t k) {
            const StageClock::Scope clock(Stage::warp);
            const std::int64_t first = k * kSampledColumns, count = std::min(kSampledColumns, part.columns - first);
            auto* out = reinterpret_cast<std::uint32_t*>(part.rgba) + first;  // words (TexturePyramid::rows)
            const auto opaque =
                imagery.sample(part.column + first, part.row, count, part.rows, out, part.row_bytes / 4);
            if (opaque && *opaque) return;
            const std::lock_guard lock(mutex);
            if (outcome) outcome = opaque;
        });
        return outcome;
    }

    // --- tiles of the deepest level that are refined ---

    Result<void> copy_below(std::int64_t row, std::int64_t rows, std::int64_t columns, std::uint8_t* rgba) {
        const std::int64_t y = row / size_;
        if (y != below_row_) {
            below_.clear();
            below_row_ = y;
            for (const TextureDepth::Run& run :
                 depth_.refined_runs(piece_.deepest_level, y, first_tile_, first_tile_ + columns / size_))
                if (auto ok = load_below(run); !ok) return ok;
        }
        for (const Below& tiles : below_)
            for (std::int64_t r = 0; r < rows; ++r)
                std::memcpy(rgba + (r * columns + (tiles.run.begin - first_tile_) * size_) * 4,
                            tiles.rgba.data() + (row + r - y * size_) * tiles.row_bytes(size_),
                            static_cast<std::size_t>(tiles.row_bytes(size_)));
        return {};
    }

    // Their seeds, where they have some; nothing, where there are no heights; else they are made now.
    Result<void> load_below(const TextureDepth::Run& run) {
        Below& tiles = below_.emplace_back();
        tiles.run = run;
        tiles.rgba.assign(static_cast<std::size_t>(size_ * tiles.row_bytes(size_)), 0);
        for (std::int64_t x = run.begin; x < run.end;) {
            const TileId id{piece_.deepest_level, x, below_row_};
            if (!stage_.has_heights(id)) {
                ++x;
            } else if (depth_.seeded(id)) {
                if (auto ok = load_seed(tiles, id); !ok) return ok;
                ++x;
            } else {
                std::int64_t end = x + 1;
                while (end < run.end && !depth_.seeded({id.level, end, id.y}) &&
                       stage_.has_heights({id.level, end, id.y}))
                    ++end;
                if (auto ok = make(tiles, {x, end}); !ok) return ok;
                x = end;
            }
        }
        return {};
    }

    struct Below {
        TextureDepth::Run run;
        std::vector<std::uint8_t> rgba;  // of the run's tiles, a row of tiles high
        std::int64_t row_bytes(std::int64_t size) const { return (run.end - run.begin) * size * 4; }
        std::uint8_t* at(std::int64_t x, std::int64_t size) { return rgba.data() + (x - run.begin) * size * 4; }
    };

    Result<void> load_seed(Below& tiles, TileId id) {
        TileRow row;
        auto found = stage_.read_seed(id, row);
        if (!found) return found.error();
        if (!*found) return {};  // it shows nothing
        note_stored(id);
        return decode_seed(row.payload, row.codec, static_cast<int>(size_), tiles.at(id.x, size_),
                           static_cast<std::size_t>(tiles.row_bytes(size_)));
    }

    Result<void> make(Below& tiles, const TextureDepth::Run& run) {
        const int level = piece_.deepest_level;
        return stage_.build_run(
            level, below_row_, run,
            [&](const TexturePyramid& pyramid, std::int64_t first, std::int64_t columns) -> Result<void> {
                const TexturePyramid::Seeds& seeds = pyramid.seeds();
                for (std::int64_t r = 0; r < size_; ++r)
                    std::memcpy(tiles.at(first, size_) + r * tiles.row_bytes(size_),
                                seeds.rgba.data() + r * seeds.columns * 4,
                                static_cast<std::size_t>(columns * size_ * 4));
                for (std::int64_t x = first; x < first + columns; ++x)
                    if (pyramid.stored({level, x, below_row_})) note_stored({level, x, below_row_});
                return {};
            });
    }

    void note_stored(TileId id) {
        const std::lock_guard lock(below_mutex_);
        below_stored_.insert(id);
    }

    TextureStage& stage_;
    const TextureDepth& depth_;
    Rectangle piece_;
    std::int64_t first_tile_ = 0, size_ = 256;
    std::vector<std::int64_t> prepared_end_;  // by level, from the root's on
    std::int64_t below_row_ = -1;
    std::vector<Below> below_;
    mutable std::mutex below_mutex_;  // rows are made while the last are encoded
    std::unordered_set<TileId, TileIdHash> below_stored_;
};

Result<void> TextureStage::sink(TileId id, std::vector<std::uint8_t> payload) {
    return job_.writer->put(TileKind::texture, *tile_key(job_.dataset.lattice, id), static_cast<int>(job_.codec),
                            std::move(payload));
}

// No heights at all, by what is known of the dense part.
bool TextureStage::has_heights(TileId id) const {
    if (id.level <= job_.base.deepest_level) return job_.index->stored(id);
    return job_.index->stored(ancestor_at(id, job_.base.deepest_level));
}

Result<std::unique_ptr<TexturePyramid>> TextureStage::build_piece(const Rectangle& rectangle) {
    const Dataset& d = job_.dataset;
    TexturePyramidJob job;
    job.lattice = job_.base;
    job.texture_size_log2 = d.texture_size_log2;
    job.deepest_level = rectangle.deepest_level;
    job.root_level = rectangle.root_level;
    job.first_column = rectangle.first_column;
    job.first_row = rectangle.first_row;
    job.columns = rectangle.columns;
    job.rows = rectangle.rows;
    job.quality = job_.quality;
    job.codec = job_.codec;
    job.stored = [&](TileId id) { return job_.index->stored(id); };
    job.has_heights = [&](TileId id) { return has_heights(id); };
    job.shared_levels = job_.base.deepest_level;
    job.sink = [&](TileId id, std::vector<std::uint8_t> payload) { return sink(id, std::move(payload)); };
    Piece piece(*this, rectangle);
    if (job_.depth->varies()) {
        job.depth = job_.depth;
        job.leaves = [&](int level, std::int64_t row, std::int64_t rows, std::int64_t columns, std::uint8_t* rgba) {
            return piece.fill(level, row, rows, columns, rgba);
        };
        job.made_below = [&](TileId id) { return piece.stored_below(id); };
        job.shows = [&](TileId id) { return ground(coarsest_).shows(id); };
    }
    auto pyramid = std::make_unique<TexturePyramid>(std::move(job));

    const TexturePyramid::Extent extent = pyramid->extent();
    const std::int64_t step = pyramid->rows_per_push(), end = extent.first_row + extent.rows;
    const auto fill = [&](std::int64_t row, std::uint8_t* rgba) {
        return piece.fill(rectangle.deepest_level, row, step, extent.columns, rgba);
    };
    // The next rows are made while the last are encoded.
    int buffer = 0;
    if (auto ok = fill(extent.first_row, pyramid->rows(buffer)); !ok) return ok.error();
    for (std::int64_t row = extent.first_row; row < end; row += step, buffer = 1 - buffer) {
        Result<void> filled;
        tbb::task_group group;
        std::uint8_t* next = pyramid->rows(1 - buffer);
        if (row + step < end) group.run([&] { filled = fill(row + step, next); });
        auto pushed = pyramid->push(buffer);
        group.wait();
        if (!pushed) return pushed.error();
        if (!filled) return filled.error();
        if (job_.on_texels) job_.on_texels(step * extent.columns);
    }
    if (auto stored = pyramid->finish(); !stored) return stored.error();
    return pyramid;
}

// The subtrees under refined tiles side by side, as many at a time as there is memory for.
Result<void> TextureStage::build_run(
    int level, std::int64_t row, TextureDepth::Run run,
    const std::function<Result<void>(const TexturePyramid& pyramid, std::int64_t first_column, std::int64_t columns)>&
        use) {
    const Dataset& d = job_.dataset;
    for (std::int64_t x = run.begin; x < run.end;) {
        const int local = job_.depth->deepest_under(level, row, x, run.end);
        const int deepest = std::min(local, level + deepest_step(d));
        const std::int64_t wide = std::int64_t{d.texture_size()} << (deepest - level);
        const std::int64_t columns = std::min(std::max<std::int64_t>(job_.deep_texels_wide / wide, 1), run.end - x);
        auto pyramid = build_piece({level, deepest, x, row, columns, 1});
        if (!pyramid) return pyramid.error();
        if (auto ok = use(**pyramid, x, columns); !ok) return ok;
        x += columns;
    }
    return {};
}

std::int64_t TextureStage::deep_rows() const { return job_.depth->rows(coarsest_); }

bool TextureStage::has_deep(std::int64_t row) const {
    if (!job_.depth->varies()) return false;
    for (const auto& [begin, end] : job_.depth->refined_runs(coarsest_, row, 0, job_.depth->columns(coarsest_)))
        for (std::int64_t x = begin; x < end; ++x)
            if (job_.depth->seeded({coarsest_, x, row})) return true;
    return false;
}

Result<void> TextureStage::build_deep_row(std::int64_t row) {
    const auto wanted = [&](std::int64_t x) {
        const TileId id{coarsest_, x, row};
        return job_.depth->seeded(id) && has_heights(id) && (!job_.deep_wanted || job_.deep_wanted(id));
    };
    for (const auto& [begin, end] : job_.depth->refined_runs(coarsest_, row, 0, job_.depth->columns(coarsest_)))
        for (std::int64_t x = begin; x < end; ++x) {
            const std::int64_t first = x;
            while (x < end && wanted(x)) ++x;
            if (x == first) continue;
            auto ok = build_run(coarsest_, row, {first, x},
                                [&](const TexturePyramid& pyramid, std::int64_t column, std::int64_t columns) {
                                    Result<void> put;
                                    for (std::int64_t c = 0; c < columns && put; ++c)
                                        put = put_seed(pyramid, {coarsest_, column + c, row}, c, 0);
                                    return put;
                                });
            if (!ok) return ok;
        }
    return {};
}

Result<void> TextureStage::build_districts(std::int64_t first_column, std::int64_t first_row, std::int64_t columns,
                                           std::int64_t rows) {
    const Dataset& d = job_.dataset;
    // Seeds of deep districts are read back.
    if (job_.depth->varies())
        if (auto ok = job_.writer->flush(); !ok) return ok;
    for (std::int64_t y = first_row; y < first_row + rows; ++y)
        for (const TextureDepth::Run& run : runs_where({{first_column, first_column + columns}}, [&](std::int64_t x) {
                 return has_heights({seed_level(d), x, y});
             }))
            if (auto ok = build_district_run(run, y); !ok) return ok;
    return {};
}

Result<void> TextureStage::build_district_run(const TextureDepth::Run& run, std::int64_t y) {
    const Dataset& d = job_.dataset;
    auto pyramid = build_piece({seed_level(d), coarsest_, run.begin, y, run.end - run.begin, 1});
    if (!pyramid) return pyramid.error();
    if (seed_level(d) == 0) return {};
    for (std::int64_t x = run.begin; x < run.end; ++x)
        if (auto ok = put_seed(**pyramid, {seed_level(d), x, y}, x - run.begin, 0); !ok) return ok;
    return {};
}

// `column`, `row`: in tiles of the pyramid's rectangle.
Result<void> TextureStage::put_seed(const TexturePyramid& pyramid, TileId id, std::int64_t column, std::int64_t row) {
    if (!pyramid.stored(id)) return {};
    const StageClock::Scope clock(Stage::encode);
    const TexturePyramid::Seeds& seeds = pyramid.seeds();
    const std::int64_t size = job_.dataset.texture_size();
    auto payload = encode_seed(seeds.rgba.data() + (row * size * seeds.columns + column * size) * 4,
                               static_cast<std::size_t>(seeds.columns * 4), static_cast<int>(size));
    return job_.writer->put(TileKind::seed, *tile_key(job_.dataset.lattice, id), static_cast<int>(SeedCodec::left),
                            std::move(payload));
}

Result<bool> TextureStage::read_seed(TileId id, TileRow& row) {
    const std::int64_t key = *tile_key(job_.dataset.lattice, id);
    auto found = job_.writer->read(TileKind::seed, key, row);
    if (!found || *found || !job_.other_seeds) return found;
    return job_.other_seeds(key, row);
}

// The seeds of a row of districts side by side, transparent where there is none.
Result<void> TextureStage::load_seeds(std::int64_t y, std::int64_t columns, std::vector<std::uint8_t>& band,
                                      std::vector<std::uint8_t>& stored) {
    const Dataset& d = job_.dataset;
    const std::int64_t size = d.texture_size();
    std::fill(band.begin(), band.end(), std::uint8_t{0});
    TileRow row;
    for (std::int64_t x = 0; x < columns; ++x) {
        auto found = read_seed({seed_level(d), x, y}, row);
        if (!found) return found.error();
        if (!*found) continue;
        stored[static_cast<std::size_t>(y * columns + x)] = 1;
        auto decoded = decode_seed(row.payload, row.codec, static_cast<int>(size), band.data() + x * size * 4,
                                   static_cast<std::size_t>(columns * size * 4));
        if (!decoded) return decoded;
    }
    return {};
}

Result<void> TextureStage::build_crown() {
    const Dataset& d = job_.dataset;
    const int seeds = seed_level(d);
    if (seeds == 0) return {};
    if (auto ok = job_.writer->flush(); !ok) return ok;
    const std::int64_t columns = district_columns(), rows = district_rows(), size = d.texture_size();
    std::vector<std::uint8_t> stored(static_cast<std::size_t>(columns * rows));
    std::vector<std::uint8_t> band(static_cast<std::size_t>(size * columns * size * 4));

    TexturePyramidJob job;
    job.lattice = job_.base;
    job.texture_size_log2 = d.texture_size_log2;
    job.deepest_level = seeds - 1;
    job.quality = job_.quality;
    job.codec = job_.codec;
    job.stored = [&](TileId id) { return job_.index->stored(id); };
    job.shared_levels = job_.base.deepest_level;
    job.children_below = [&](TileId id) {
        std::uint8_t mask = 0;
        for (int q = 0; q < 4; ++q) {
            const TileId child = child_of(id, q);
            if (child.x < columns && child.y < rows && stored[static_cast<std::size_t>(child.y * columns + child.x)])
                mask = static_cast<std::uint8_t>(mask | (1 << q));
        }
        return mask;
    };
    job.sink = [&](TileId id, std::vector<std::uint8_t> payload) { return sink(id, std::move(payload)); };
    TexturePyramid pyramid(std::move(job));

    const std::int64_t width = pyramid.extent().columns, height = pyramid.extent().rows, step = pyramid.rows_per_push();
    std::int64_t loaded = -1;
    for (std::int64_t row = 0; row < height; row += step) {
        std::uint8_t* out = pyramid.rows(0);
        for (std::int64_t r = row; r < row + step; ++r, out += width * 4) {
            std::memset(out, 0, static_cast<std::size_t>(width * 4));
            const std::int64_t y = 2 * r / size;
            if (y >= rows) continue;
            if (y != loaded)
                if (auto ok = load_seeds(y, columns, band, stored); !ok) return ok;
            loaded = y;
            const std::uint8_t* upper = band.data() + (2 * r - y * size) * columns * size * 4;
            downsample_rgba_row(upper, upper + columns * size * 4, columns * size / 2, out);
        }
        if (auto ok = pyramid.push(0); !ok) return ok;
    }
    auto done = pyramid.finish();
    if (!done) return done.error();
    return {};
}

}  // namespace scree
