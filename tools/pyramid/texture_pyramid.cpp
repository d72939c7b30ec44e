#include "tools/pyramid/texture_pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <mutex>
#include <tuple>
#include <unordered_set>

#include "tools/pyramid/texture_filter.h"
#include "tools/stage_clock.h"

namespace scree {
namespace {

constexpr int kRowsPerPush = 8;              // 16 rows of 64 K texels are 4 MB
constexpr std::int64_t kChunkTexels = 2048;  // of a row, for one task: 32 K texels of a push, about 50 us
constexpr std::int64_t kTilesTogether = 32;  // that wait for the store packed, 30 KB each

using Runs = TextureDepth::Runs;

std::int64_t round_up(std::int64_t v, std::int64_t multiple) { return (v + multiple - 1) / multiple * multiple; }

// Texels of the data's extent at texture level `level`, rounded up.
std::int64_t texels(std::int64_t cells, const Lattice& lattice, int size_log2, int level) {
    const int shift = lattice.deepest_level - level + lattice.tile_cells_log2 - size_log2;  // log2 cells a texel
    return shift >= 0 ? (cells + (std::int64_t{1} << shift) - 1) >> shift : cells << -shift;
}

// One level of the pyramid, or (above the root level) a mip of its tiles.
struct Level {
    int id = 0;                  // may be negative
    std::int64_t width = 0;      // texels
    std::int64_t band_rows = 0;  // texel rows of a band of tiles
    int capacity = 4;            // rows gathered before they are encoded
    int gathered = 0;
    std::int64_t rows_done = 0;
    std::vector<std::uint32_t> rows;   // capacity * width RGBA
    std::vector<std::uint8_t> blocks;  // band_rows/4 * width/4 BC1 blocks

    std::uint8_t* row(std::int64_t r) { return reinterpret_cast<std::uint8_t*>(rows.data() + r * width); }
    const std::uint8_t* row(std::int64_t r) const {
        return reinterpret_cast<const std::uint8_t*>(rows.data() + r * width);
    }
};

TextureDepth::Run common_part(const TextureDepth::Run& a, const TextureDepth::Run& b) {
    return {std::max(a.begin, b.begin), std::min(a.end, b.end)};
}

}  // namespace

struct TexturePyramid::Impl {
    TexturePyramidJob job;
    std::int64_t size = 256;
    Extent extent;
    std::vector<Level> levels;          // deepest first
    std::vector<std::uint32_t> second;  // the other buffer of the deepest level's rows
    int buffer = 0;                     // the one that stands in levels.front().rows
    std::unordered_set<TileId, TileIdHash> tiles;
    Seeds seeds;

    Level& level_of(int id) { return levels[static_cast<std::size_t>(job.deepest_level - id)]; }
    bool makes_tiles(const Level& level) const { return level.id >= job.root_level; }
    bool varies(const Level& level) const { return job.depth != nullptr && makes_tiles(level); }

    // Which of a level's tiles the runs are wanted of, in pixels of the rectangle; `row`: of the level, within it.
    using Choice = Runs (TextureDepth::*)(int, std::int64_t, std::int64_t, std::int64_t) const;
    Runs pixel_runs(const Level& level, std::int64_t row, Choice choice) const {
        if (!makes_tiles(level)) return {{0, level.width}};
        const int down = level.id - job.root_level;
        const std::int64_t first = job.first_column << down, y = (job.first_row << down) + row / size;
        Runs runs{{first, first + level.width / size}};
        if (varies(level)) runs = (job.depth->*choice)(level.id, y, first, first + level.width / size);
        if (job.has_heights) runs = runs_where(runs, [&](std::int64_t x) { return job.has_heights({level.id, x, y}); });
        for (TextureDepth::Run& run : runs) run = {(run.begin - first) * size, (run.end - first) * size};
        return runs;
    }

    // Encodes the gathered rows and halves them into `next` (null: nowhere), a stretch of columns after the other, so
    // that they are read once.
    void encode_and_halve(Level& level, Level* next) {
        // Refined tiles of the deepest level are made with what lies below them.
        const bool deepest = level.id == job.deepest_level;
        const Runs encoded =
            pixel_runs(level, level.rows_done, deepest ? &TextureDepth::leaf_runs : &TextureDepth::runs);
        Runs halved;
        if (next != nullptr) halved = pixel_runs(*next, level.rows_done / 2, &TextureDepth::refined_runs);
        const std::int64_t chunks = (level.width + kChunkTexels - 1) / kChunkTexels;
        const auto stretch = [&](std::int64_t k) {
            const std::int64_t begin = k * kChunkTexels, end = std::min(begin + kChunkTexels, level.width);
            StageClock::Scope clock(Stage::encode);
            for (const TextureDepth::Run& run : encoded) encode(level, common_part(run, {begin, end}));
            clock.change(Stage::filter);
            for (const TextureDepth::Run& run : halved) halve(level, common_part(run, {begin / 2, end / 2}), *next);
        };
        if (chunks > 1)
            tbb::parallel_for(std::int64_t{0}, chunks, stretch);
        else
            stretch(0);
        if (next == nullptr) return;
        for (std::int64_t r = next->gathered; r < next->gathered + level.gathered / 2; ++r)
            clear_between(halved, level.width / 2, next->width, next->row(r));
    }

    void encode(Level& level, const TextureDepth::Run& run) const {
        if (run.begin >= run.end) return;
        const std::int64_t first_row = (level.rows_done % level.band_rows) / 4;
        for (std::int64_t r = 0; r < level.gathered / 4; ++r)
            encode_bc1_row(level.row(4 * r) + run.begin * 4, static_cast<std::size_t>(level.width * 4),
                           static_cast<std::size_t>((run.end - run.begin) / 4),
                           level.blocks.data() + ((first_row + r) * level.width + run.begin) / 4 * 8, job.quality);
    }

    // `run`: of the next level's columns.
    static void halve(const Level& level, const TextureDepth::Run& run, Level& next) {
        if (run.begin >= run.end) return;
        for (std::int64_t r = 0; r < level.gathered / 2; ++r)
            downsample_rgba_row(level.row(2 * r) + run.begin * 8, level.row(2 * r + 1) + run.begin * 8,
                                run.end - run.begin, next.row(next.gathered + r) + run.begin * 4);
    }

    // All gathered rows of a level are encoded and halved into the next coarser one.
    Result<void> process(std::size_t index) {
        Level& level = levels[index];
        if (varies(level) && level.id < job.deepest_level) {
            const std::int64_t row = (job.first_row << (level.id - job.root_level)) * size + level.rows_done;
            if (auto ok = job.leaves(level.id, row, level.gathered, level.width, level.row(0)); !ok) return ok;
        }
        Level* next = index + 1 < levels.size() ? &levels[index + 1] : nullptr;
        if (next != nullptr && next->gathered == next->capacity) next->gathered = 0;
        encode_and_halve(level, next);
        if (level.id == job.root_level) keep_seeds(level);
        if (next != nullptr) next->gathered += level.gathered / 2;
        level.rows_done += level.gathered;
        if (next != nullptr && next->gathered == next->capacity) return process(index + 1);
        return {};
    }

    // The pixels of a row that no run has, and those beyond `width`.
    static void clear_between(const Runs& runs, std::int64_t width, std::int64_t all, std::uint8_t* row) {
        std::int64_t at = 0;
        const auto clear_to = [&](std::int64_t end) {
            if (end > at) std::memset(row + at * 4, 0, static_cast<std::size_t>((end - at) * 4));
        };
        for (const auto& [begin, end] : runs) {
            clear_to(std::min(begin, width));
            at = std::min(end, width);
        }
        clear_to(all);
    }

    void keep_seeds(const Level& level) {
        seeds.columns = level.width;
        seeds.rows += level.gathered;
        seeds.rgba.insert(seeds.rgba.end(), level.row(0), level.row(level.gathered));
    }

    std::uint8_t child_mask(TileId id) const {
        if (id.level == job.deepest_level) return job.children_below ? job.children_below(id) : std::uint8_t{0};
        std::uint8_t mask = 0;
        for (int q = 0; q < 4; ++q)
            if (tiles.count(child_of(id, q)) != 0) mask = static_cast<std::uint8_t>(mask | (1 << q));
        return mask;
    }

    bool exists(TileId id) const {
        return job.depth == nullptr || id.level == job.root_level || job.depth->refined(parent_of(id));
    }
    bool is_made_below(TileId id) const {
        return job.depth != nullptr && id.level == job.deepest_level && job.depth->refined(id);
    }

    // `x`, `y`: within the rectangle.
    TextureTile assemble(int level_id, std::int64_t x, std::int64_t y) {
        TextureTile tile;
        const int log2 = job.texture_size_log2;
        tile.blocks.resize(bc1_chain_bytes(log2));
        for (int mip = 0; log2 - mip >= 2; ++mip) {
            const Level& level = level_of(level_id - mip);
            const std::int64_t side = size >> mip, blocks = side / 4;
            const std::int64_t row0 = (y * side % level.band_rows) / 4, column0 = x * blocks;
            std::uint8_t* out = tile.blocks.data() + bc1_mip_offset(log2, mip);
            for (std::int64_t r = 0; r < blocks; ++r)
                std::memcpy(out + r * blocks * 8, level.blocks.data() + ((row0 + r) * (level.width / 4) + column0) * 8,
                            static_cast<std::size_t>(blocks * 8));
        }
        // The last two mips: from the four gathered rows in which the 4 x 4 mip has just been completed.
        const Level& level = level_of(level_id - (log2 - 2));
        std::array<std::uint8_t, 16> two{};
        std::array<std::uint8_t, 4> one{};
        const std::uint8_t* pixels = level.row(level.gathered - 4) + x * 16;
        for (int r = 0; r < 2; ++r)
            downsample_rgba_row(pixels + 2 * r * level.width * 4, pixels + (2 * r + 1) * level.width * 4, 2,
                                two.data() + 8 * r);
        downsample_rgba_row(two.data(), two.data() + 8, 1, one.data());
        std::array<std::uint8_t, 64> repeated{};
        for (std::size_t t = 0; t < 16; ++t)
            std::memcpy(repeated.data() + 4 * t, two.data() + 4 * ((t / 4 % 2) * 2 + t % 2), 4);
        encode_bc1_row(repeated.data(), 16, 1, tile.blocks.data() + bc1_mip_offset(log2, log2 - 1), job.quality);
        for (std::size_t t = 0; t < 16; ++t) std::memcpy(repeated.data() + 4 * t, one.data(), 4);
        encode_bc1_row(repeated.data(), 16, 1, tile.blocks.data() + bc1_mip_offset(log2, log2), job.quality);
        return tile;
    }

    static bool any_opaque(const TextureTile& tile, int log2) {
        const std::uint8_t* b = tile.blocks.data() + bc1_mip_offset(log2, 0);
        for (std::size_t k = 0; k < bc1_mip_bytes(log2, 0); k += 8) {
            const unsigned c0 = b[k] | b[k + 1] << 8, c1 = b[k + 2] | b[k + 3] << 8;
            if (c0 > c1) return true;
            for (std::size_t s = 4; s < 8; ++s)
                for (int t = 0; t < 8; t += 2)
                    if ((b[k + s] >> t & 3) != 3) return true;
        }
        return false;
    }

    // Every level whose band the last rows completed is turned into tiles, finest first: a tile's mips stand in the
    // coarser levels' blocks, which are reused only after their own band is complete.
    Result<void> emit(std::size_t from) {
        for (std::size_t index = from; index < levels.size() && makes_tiles(levels[index]); ++index) {
            Level& level = levels[index];
            if (level.rows_done == 0 || level.rows_done % level.band_rows != 0 || level.gathered != level.capacity)
                break;
            if (auto ok = emit_band(level, level.rows_done / level.band_rows - 1); !ok) return ok;
        }
        return {};
    }

    Result<void> emit_band(Level& level, std::int64_t y) {
        const std::int64_t columns = level.width / size;
        for (std::int64_t x = 0; x < columns; x += kTilesTogether)
            if (auto ok = emit_tiles(level, y, x, std::min(x + kTilesTogether, columns)); !ok) return ok;
        return {};
    }

    Result<void> emit_tiles(Level& level, std::int64_t y, std::int64_t begin, std::int64_t end) {
        const int down = level.id - job.root_level;
        const TileId corner{level.id, job.first_column << down, (job.first_row << down) + y};
        std::vector<std::vector<std::uint8_t>> payloads(static_cast<std::size_t>(end - begin));
        std::mutex mutex;
        Result<void> outcome;
        tbb::parallel_for(begin, end, [&](std::int64_t x) {
            auto payload = packed_tile({level.id, corner.x + x, corner.y}, x, y);
            const std::lock_guard lock(mutex);
            if (payload)
                payloads[static_cast<std::size_t>(x - begin)] = std::move(*payload);
            else
                outcome = payload.error();
        });
        if (!outcome) return outcome;
        for (std::int64_t x = begin; x < end; ++x) {
            auto& payload = payloads[static_cast<std::size_t>(x - begin)];
            const TileId id{level.id, corner.x + x, corner.y};
            if (is_made_below(id) && job.made_below(id)) tiles.insert(id);
            if (payload.empty()) continue;
            tiles.insert(id);
            if (auto ok = job.sink(id, std::move(payload)); !ok) return ok;
        }
        return {};
    }

    // Empty where the tile is not stored.
    Result<std::vector<std::uint8_t>> packed_tile(TileId id, std::int64_t x, std::int64_t y) {
        const std::vector<std::uint8_t> nothing;
        const bool may_show = id.level > job.shared_levels, stored = job.stored(id);
        if ((!stored && !may_show) || !exists(id) || is_made_below(id)) return nothing;
        const std::uint8_t children = child_mask(id);
        const bool above_deepest = job.depth != nullptr && id.level < job.depth->deepest();
        const StageClock::Scope clock(Stage::encode);
        if (!stored && children == 0 && above_deepest) {
            const auto shows = job.shows(id);
            if (!shows) return shows.error();
            if (!*shows) return nothing;
        }
        TextureTile tile = assemble(id.level, x, y);
        if (!stored && children == 0 && !above_deepest && !any_opaque(tile, job.texture_size_log2)) return nothing;
        tile.child_mask = children;
        return encode_texture_tile(tile, job.texture_size_log2, job.codec);
    }
};

TexturePyramid::TexturePyramid(TexturePyramidJob job) : impl_(std::make_unique<Impl>()) {
    Impl& m = *impl_;
    m.size = std::int64_t{1} << job.texture_size_log2;
    const int log2 = job.texture_size_log2, down = job.deepest_level - job.root_level;
    const auto span = [&](std::int64_t cells, std::int64_t first, std::int64_t count) {
        const std::int64_t all = padded_texels(cells, job.lattice, log2, job.deepest_level) >> log2;  // tiles
        const std::int64_t begin = first << down;
        const std::int64_t end = count > (all >> down) ? all : std::min(all, (first + count) << down);
        return std::pair(begin << log2, std::max<std::int64_t>(0, end - begin) << log2);
    };
    std::tie(m.extent.first_column, m.extent.columns) = span(job.lattice.cells_x, job.first_column, job.columns);
    std::tie(m.extent.first_row, m.extent.rows) = span(job.lattice.cells_y, job.first_row, job.rows);
    std::int64_t width = m.extent.columns;
    int capacity = static_cast<int>(std::min<std::int64_t>(kRowsPerPush, m.size));
    for (int id = job.deepest_level; id >= job.root_level - (log2 - 2); --id) {
        Level level;
        level.id = id;
        level.width = width;
        level.band_rows = id >= job.root_level ? m.size : m.size >> (job.root_level - id);
        level.capacity = capacity;
        level.rows.resize(static_cast<std::size_t>(capacity * width));
        level.blocks.resize(static_cast<std::size_t>(level.band_rows / 4 * (width / 4) * 8));
        m.levels.push_back(std::move(level));
        width = id > job.root_level ? round_up(width / 2, m.size) : width / 2;
        capacity = std::max(4, capacity / 2);
    }
    m.second.resize(m.levels.front().rows.size());
    // Growing step by step they would take three times as much.
    const Level& root = m.levels[static_cast<std::size_t>(down)];
    m.seeds.rgba.reserve(static_cast<std::size_t>(round_up(m.extent.rows >> down, m.size) * root.width * 4));
    m.job = std::move(job);
}

TexturePyramid::~TexturePyramid() = default;

TexturePyramid::Extent TexturePyramid::extent() const { return impl_->extent; }
int TexturePyramid::rows_per_push() const { return impl_->levels.front().capacity; }
std::uint8_t* TexturePyramid::rows(int buffer) {
    auto& words = buffer == impl_->buffer ? impl_->levels.front().rows : impl_->second;
    return reinterpret_cast<std::uint8_t*>(words.data());
}

Result<void> TexturePyramid::push(int buffer) {
    Level& front = impl_->levels.front();
    if (buffer != impl_->buffer) {
        std::swap(front.rows, impl_->second);
        impl_->buffer = buffer;
    }
    front.gathered = front.capacity;
    if (auto ok = impl_->process(0); !ok) return ok;
    return impl_->emit(0);
}

Result<std::int64_t> TexturePyramid::finish() {
    // Levels whose band is incomplete are filled up with transparent rows, finest first.
    for (std::size_t index = 1; index < impl_->levels.size(); ++index) {
        Level& level = impl_->levels[index];
        while ((level.rows_done + (level.gathered == level.capacity ? 0 : level.gathered)) % level.band_rows != 0) {
            if (level.gathered == level.capacity) level.gathered = 0;
            std::memset(level.row(level.gathered), 0,
                        static_cast<std::size_t>((level.capacity - level.gathered) * level.width * 4));
            level.gathered = level.capacity;
            if (auto ok = impl_->process(index); !ok) return ok.error();
            if (auto ok = impl_->emit(index); !ok) return ok.error();
        }
    }
    return static_cast<std::int64_t>(impl_->tiles.size());
}

const TexturePyramid::Seeds& TexturePyramid::seeds() const { return impl_->seeds; }
bool TexturePyramid::stored(TileId id) const { return impl_->tiles.count(id) != 0; }

std::int64_t TexturePyramid::padded_texels(std::int64_t cells, const Lattice& lattice, int texture_size_log2,
                                           int level) {
    return round_up(texels(cells, lattice, texture_size_log2, level), std::int64_t{1} << texture_size_log2);
}

std::int64_t TexturePyramid::bytes_needed(std::int64_t texels_wide, int texture_size_log2) {
    const std::int64_t size = std::int64_t{1} << texture_size_log2;
    const std::int64_t width = round_up(texels_wide, size);
    const std::int64_t rows = 3 * kRowsPerPush * width * 4;
    const std::int64_t blocks = 2 * size / 2 * width;            // half a byte a texel, all levels
    const std::int64_t payloads = size / 2 * width * 4 / 3 * 2;  // a band of tiles, assembled and packed
    return rows + blocks + payloads + (std::int64_t{4} << 20);
}

}  // namespace scree
