#include "tools/pyramid/texture_stage.h"

#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cstring>
#include <mutex>

#include "common/store/seed_codec.h"
#include "common/store/texture_codec.h"
#include "tools/pyramid/texture_filter.h"
#include "tools/pyramid/texture_pyramid.h"
#include "tools/stage_clock.h"

namespace scree {
namespace {

constexpr std::int64_t kSampledColumns = 512;  // of a task
constexpr std::int64_t kPreparedRows = 64;

Error interrupted() { return {ErrorCode::interrupted, "stopped"}; }

}  // namespace

int seed_level(const Dataset& d) { return std::max(0, d.texture_deepest_level - kSeedLevelsUp); }

TargetGrid texel_grid(const Dataset& d) {
    const double texel = d.texel_m(d.texture_deepest_level);
    return {d.lattice.origin_x_m + texel / 2, d.lattice.origin_y_m - texel / 2, texel};
}

TextureStage::TextureStage(TextureStageJob job)
    : job_(std::move(job)), ground_(job_.dataset, job_.base, *job_.index, job_.heights) {}

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

// Makes the texel rows of a rectangle of districts, from north to south.
class TextureStage::Piece {
public:
    Piece(TextureStage& stage, TexturePyramid::Extent extent) : stage_(stage), extent_(extent) {}

    Result<void> fill(std::int64_t row, std::int64_t rows, std::uint8_t* rgba) {
        const TextureStageJob& job = stage_.job_;
        if (job.stop != nullptr && *job.stop) return interrupted();
        const std::int64_t bytes = extent_.columns * 4 * rows;
        if (job.imagery == nullptr)
            std::memset(rgba, 0, static_cast<std::size_t>(bytes));
        else if (auto ok = sample(row, rows, rgba); !ok)
            return ok;
        return stage_.ground_.finish(extent_.first_column, row, extent_.columns, rows, rgba);
    }

private:
    Result<void> sample(std::int64_t row, std::int64_t rows, std::uint8_t* rgba) {
        const TextureStageJob& job = stage_.job_;
        ImageStack& imagery = *job.imagery;
        if (row >= prepared_end_) {
            imagery.release_north_of(row);
            const std::int64_t end = std::min(row + kPreparedRows, extent_.first_row + extent_.rows);
            const auto go_on = [&](std::int64_t) { return job.stop == nullptr || !*job.stop; };
            if (auto ok = imagery.prepare(extent_.first_column, row, extent_.columns, end - row, go_on); !ok) return ok;
            prepared_end_ = end;
        }
        std::mutex mutex;
        Result<void> outcome;
        const std::int64_t parts = (extent_.columns + kSampledColumns - 1) / kSampledColumns;
        tbb::parallel_for(std::int64_t{0}, parts, [&](std::int64_t part) {
            const StageClock::Scope clock(Stage::warp);
            const std::int64_t first = part * kSampledColumns,
                               count = std::min(kSampledColumns, extent_.columns - first);
            thread_local std::vector<std::uint32_t> values;
            values.resize(static_cast<std::size_t>(count * rows));
            if (auto ok = imagery.sample(extent_.first_column + first, row, count, rows, values); !ok) {
                const std::lock_guard lock(mutex);
                if (outcome) outcome = ok;
                return;
            }
            for (std::int64_t r = 0; r < rows; ++r)
                std::memcpy(rgba + (r * extent_.columns + first) * 4, values.data() + r * count,
                            static_cast<std::size_t>(count * 4));
        });
        return outcome;
    }

    TextureStage& stage_;
    TexturePyramid::Extent extent_;
    std::int64_t prepared_end_ = 0;
};

Result<void> TextureStage::sink(TileId id, std::vector<std::uint8_t> payload) {
    return job_.writer->put(TileKind::texture, *tile_key(job_.dataset.lattice, id),
                            static_cast<int>(TextureCodec::split), std::move(payload));
}

Result<void> TextureStage::build_districts(std::int64_t first_column, std::int64_t first_row, std::int64_t columns,
                                           std::int64_t rows) {
    const Dataset& d = job_.dataset;
    TexturePyramidJob job;
    job.lattice = job_.base;
    job.texture_size_log2 = d.texture_size_log2;
    job.deepest_level = d.texture_deepest_level;
    job.root_level = seed_level(d);
    job.first_column = first_column;
    job.first_row = first_row;
    job.columns = columns;
    job.rows = rows;
    job.quality = job_.quality;
    job.stored = [&](TileId id) { return job_.index->stored(id); };
    job.shared_levels = job_.base.deepest_level;
    job.sink = [&](TileId id, std::vector<std::uint8_t> payload) { return sink(id, std::move(payload)); };
    TexturePyramid pyramid(std::move(job));

    const TexturePyramid::Extent extent = pyramid.extent();
    const std::int64_t step = pyramid.rows_per_push(), end = extent.first_row + extent.rows;
    Piece piece(*this, extent);
    // The next rows are made while the last are encoded.
    int buffer = 0;
    if (auto ok = piece.fill(extent.first_row, step, pyramid.rows(buffer)); !ok) return ok;
    for (std::int64_t row = extent.first_row; row < end; row += step, buffer = 1 - buffer) {
        Result<void> filled;
        tbb::task_group group;
        std::uint8_t* next = pyramid.rows(1 - buffer);
        if (row + step < end) group.run([&] { filled = piece.fill(row + step, step, next); });
        auto pushed = pyramid.push(buffer);
        group.wait();
        if (!pushed) return pushed;
        if (!filled) return filled;
        if (job_.on_texels) job_.on_texels(step * extent.columns);
    }
    if (auto stored = pyramid.finish(); !stored) return stored.error();
    return seed_level(d) > 0 ? put_seeds(pyramid, first_column, first_row) : Result<void>{};
}

Result<void> TextureStage::put_seeds(const TexturePyramid& pyramid, std::int64_t first_column, std::int64_t first_row) {
    const Dataset& d = job_.dataset;
    const TexturePyramid::Seeds& seeds = pyramid.seeds();
    const std::int64_t size = d.texture_size();
    for (std::int64_t y = 0; y < seeds.rows / size; ++y)
        for (std::int64_t x = 0; x < seeds.columns / size; ++x) {
            const TileId id{seed_level(d), first_column + x, first_row + y};
            if (!pyramid.stored(id)) continue;
            const StageClock::Scope clock(Stage::encode);
            auto payload = encode_seed(seeds.rgba.data() + (y * size * seeds.columns + x * size) * 4,
                                       static_cast<std::size_t>(seeds.columns * 4), static_cast<int>(size));
            if (auto ok = job_.writer->put(TileKind::seed, *tile_key(d.lattice, id), static_cast<int>(SeedCodec::left),
                                           std::move(payload));
                !ok)
                return ok;
        }
    return {};
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
