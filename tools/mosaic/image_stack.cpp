#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "tools/mosaic/layer_pixels.h"
#include "tools/mosaic/source_window.h"
#include "tools/mosaic/stack.h"

namespace scree {
namespace {

constexpr std::uint32_t kSolid = 128;
constexpr std::uint32_t kOpaque = 0xFF000000U;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
// Pieces that are sampled layer after layer: whole chunks of the map, and little enough to stay in the cache.
constexpr std::int64_t kPieceColumns = 8 * WarpMap::kChunk;
// A band of 64 grid rows would have to hold more than this many times as many rows of samples.
constexpr double kMostShrink = 4;
constexpr std::int64_t kBandRows = 64;
constexpr std::int64_t kDecoderBandBytes = std::int64_t{1} << 20;  // small strips are decoded so many at a time

// Points [i, i + columns) x [j, j + rows).
struct Area {
    std::int64_t i = 0, j = 0, columns = 0, rows = 0;
    std::int64_t count() const { return columns * rows; }
};

struct LayerOnGrid {
    Layer layer;
    WarpMap map;
    Kernel kernel = Kernel::bilinear;
    bool lattice = false;  ///< points of a column have one source column, those of a row one source row
    PixelPlace place = PixelPlace::disk;
    std::unique_ptr<LayerPixels> pixels;

    ResampleRule rule_at(std::int64_t i, std::int64_t j) const {
        return {kernel, map.shrink_at(chunk_middle(i), chunk_middle(j)), layer.half_sample_rim, layer.columns,
                layer.rows};
    }
};

// --- what points need ---

// Source positions of the points of an area.
struct MappedPoints {
    std::vector<double> column, row;

    MappedPoints(const LayerOnGrid& layer, const Area& area)
        : column(static_cast<std::size_t>(area.count())), row(column.size()) {
        layer.map.map(area.i, area.j, area.columns, area.rows, points());
    }
    SourcePoints points() { return {column, row}; }
};

// The columns of an area's columns and the rows of its rows.
struct MappedLines {
    std::vector<double> column, row;

    MappedLines(const LayerOnGrid& layer, const Area& area) {
        MappedPoints across(layer, {area.i, area.j, area.columns, 1}), down(layer, {area.i, area.j, 1, area.rows});
        column = std::move(across.column);
        row = std::move(down.row);
    }
};

std::optional<SampleRectangle> window_of(const LayerOnGrid& layer, const Area& area) {
    const auto bounds = layer.map.bounds(area.i, area.j, area.columns, area.rows);
    if (!bounds) return std::nullopt;
    return source_window(*bounds, layer.layer, layer.rule_at(area.i, area.j));
}

template <class Use>
void for_each_chunk(const Area& area, Use&& use) {
    constexpr std::int64_t kChunk = WarpMap::kChunk;
    for (std::int64_t j = area.j; j < area.j + area.rows;) {
        const std::int64_t j_end = std::min((chunk_of(j) + 1) * kChunk, area.j + area.rows);
        for (std::int64_t i = area.i; i < area.i + area.columns;) {
            const std::int64_t i_end = std::min((chunk_of(i) + 1) * kChunk, area.i + area.columns);
            use(Area{i, j, i_end - i, j_end - j});
            i = i_end;
        }
        j = j_end;
    }
}

void want(LayerOnGrid& layer, const Area& area) {
    const std::int64_t until = area.j + area.rows;
    const auto want_part = [&](const Area& part) {
        if (const auto window = window_of(layer, part)) layer.pixels->want(*window, until);
    };
    if (layer.lattice) return want_part(area);
    for_each_chunk(area, want_part);
}

// --- sampling ---

std::pair<Area, Area> halves_of(const Area& area) {
    const auto [a, b] = halves_of(SampleRectangle{area.i, area.j, area.columns, area.rows});
    return {{a.column, a.row, a.columns, a.rows}, {b.column, b.row, b.columns, b.rows}};
}

// Pixels in rows `pitch` apart: of an area, or of a part of it.
struct Canvas {
    std::uint32_t* pixels;
    std::int64_t pitch;

    std::uint32_t* row(std::int64_t r) const { return pixels + r * pitch; }
    Canvas part(const Area& whole, const Area& area) const {
        return {row(area.j - whole.j) + (area.i - whole.i), pitch};
    }
    void clear(const Area& area) const {
        for (std::int64_t r = 0; r < area.rows; ++r) std::fill_n(row(r), area.columns, 0U);
    }
};

void make_solid(std::uint32_t* pixels, std::int64_t count) {
    for (std::int64_t k = 0; k < count; ++k) pixels[k] = pixels[k] >> 24 >= kSolid ? pixels[k] | kOpaque : 0;
}

// Memory that is used again from piece to piece.
struct Scratch {
    std::vector<double> column, row;
    std::vector<std::uint32_t> pixels, fresh, below;
};

class LayerSampler {
public:
    LayerSampler(const LayerOnGrid& layer, Scratch& scratch) : layer_(layer), scratch_(scratch) {}

    /// As ImageStack::sample.
    Result<bool> sample(const Area& area, const Canvas& out) {
        if (layer_.lattice) return sample_lines(area, out);
        Result<void> result;
        for_each_chunk(area, [&](const Area& chunk) {
            if (result) result = sample_points(chunk, out.part(area, chunk));
        });
        if (!result) return result.error();
        return false;
    }

private:
    // Far more samples than points.
    Result<void> sample_halves(const Area& area, const Canvas& out) {
        const auto [first, second] = halves_of(area);
        for (const Area& part : {first, second})
            if (auto sampled = sample(part, out.part(area, part)); !sampled) return sampled.error();
        return {};
    }

    // In a chunk of the map.
    Result<void> sample_points(const Area& area, const Canvas& out) {
        const ResampleRule rule = layer_.rule_at(area.i, area.j);
        scratch_.column.resize(static_cast<std::size_t>(area.count()));
        scratch_.row.resize(scratch_.column.size());
        const SourcePoints points{scratch_.column, scratch_.row};
        layer_.map.map(area.i, area.j, area.columns, area.rows, points);
        return resample(area, source_window(points, layer_.layer, rule), out,
                        [&](const auto& window, auto fresh) { resample_colours(window, points, rule, fresh); });
    }

    Result<bool> sample_lines(const Area& area, const Canvas& out) {
        const MappedLines lines(layer_, area);
        if (layer_.kernel == Kernel::nearest) {
            const auto columns = run_of(lines.column, layer_.layer.columns),
                       rows = run_of(lines.row, layer_.layer.rows);
            if (columns && rows) return copy(*columns, *rows, area, out);
        }
        const ResampleRule rule = layer_.rule_at(area.i, area.j);
        auto done = resample(area, window_of(layer_, area), out, [&](const auto& window, auto fresh) {
            resample_colour_lines(window, {lines.column, lines.row}, rule, fresh);
        });
        if (!done) return done.error();
        return false;
    }

    template <class Make>
    Result<void> resample(const Area& area, const std::optional<SampleRectangle>& window, const Canvas& out,
                          Make&& make) {
        if (!window) {
            out.clear(area);
            return {};
        }
        if (window->count() > kMostWindowSamples && area.count() > 1) return sample_halves(area, out);
        std::vector<std::uint32_t>& pixels = scratch_.pixels;
        pixels.resize(static_cast<std::size_t>(window->count()));
        const auto opaque = layer_.pixels->read(*window, pixels.data(), window->columns);
        if (!opaque) return opaque.error();
        std::vector<std::uint32_t>& fresh = scratch_.fresh;
        fresh.resize(static_cast<std::size_t>(area.count()));
        make(SampleWindow<std::uint32_t>{window->column, window->row, window->columns, window->rows, pixels},
             std::span<std::uint32_t>(fresh));
        for (std::int64_t r = 0; r < area.rows; ++r) {
            std::copy_n(fresh.data() + r * area.columns, area.columns, out.row(r));
            if (!*opaque) make_solid(out.row(r), area.columns);
        }
        return {};
    }

    // Points first .. first + count - 1 of a line stand on samples sample, sample + 1...; the others outside.
    struct Run {
        std::int64_t first = 0, sample = 0, count = 0;
    };
    std::optional<Run> run_of(const std::vector<double>& line, std::int64_t size) const {
        const auto sample_of = [&](std::int64_t k) {
            return nearest_sample(line[static_cast<std::size_t>(k)], size, layer_.layer.half_sample_rim);
        };
        std::int64_t first = 0, last = static_cast<std::int64_t>(line.size()) - 1;
        while (first <= last && sample_of(first) < 0) ++first;
        while (first <= last && sample_of(last) < 0) --last;
        if (first > last) return Run{};
        // Steps are even: if the last one is where it should be, so are all.
        const std::int64_t sample = sample_of(first);
        if (sample_of(last) - sample != last - first) return std::nullopt;
        return Run{first, sample, last - first + 1};
    }

    Result<bool> copy(const Run& columns, const Run& rows, const Area& area, const Canvas& out) const {
        const bool covered = columns.count == area.columns && rows.count == area.rows;
        if (!covered) out.clear(area);
        if (columns.count == 0 || rows.count == 0) return false;
        const Canvas inside{out.row(rows.first) + columns.first, out.pitch};
        const auto opaque =
            layer_.pixels->read({columns.sample, rows.sample, columns.count, rows.count}, inside.pixels, inside.pitch);
        if (!opaque) return opaque.error();
        for (std::int64_t r = 0; r < rows.count && !*opaque; ++r) make_solid(inside.row(r), columns.count);
        return covered && *opaque;
    }

    const LayerOnGrid& layer_;
    Scratch& scratch_;
};

bool complete(const Area& area, const Canvas& out) {
    for (std::int64_t r = 0; r < area.rows; ++r)
        if (std::find(out.row(r), out.row(r) + area.columns, 0U) != out.row(r) + area.columns) return false;
    return true;
}

Result<bool> sample_piece(const std::vector<LayerOnGrid>& layers, const Area& area, const Canvas& out,
                          Scratch& scratch) {
    bool empty = true;
    for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
        if (layer->lattice && !window_of(*layer, area)) continue;
        if (empty) {
            auto opaque = LayerSampler(*layer, scratch).sample(area, out);
            if (!opaque || *opaque) return opaque;
            empty = false;
            continue;
        }
        if (complete(area, out)) break;
        scratch.below.resize(static_cast<std::size_t>(area.count()));
        const Canvas below{scratch.below.data(), area.columns};
        if (auto sampled = LayerSampler(*layer, scratch).sample(area, below); !sampled) return sampled;
        for (std::int64_t r = 0; r < area.rows; ++r) {
            std::uint32_t* over = out.row(r);
            const std::uint32_t* under = below.row(r);
            for (std::int64_t c = 0; c < area.columns; ++c) over[c] = over[c] == 0 ? under[c] : over[c];
        }
    }
    if (empty) out.clear(area);
    return false;
}

// --- planning ---

// The most files of the layer that any of its rows meets, and their samples.
struct Abreast {
    std::int64_t files = 0, samples = 0;
};
Abreast abreast_of(const Layer& layer, const std::vector<PlacedFile>& files) {
    std::map<std::int64_t, Abreast> changes;  // at the row where they begin
    for (const LayerMember& member : layer.members) {
        const ImageInfo& info = files[member.file].info;
        Abreast& begin = changes[member.row];
        begin.files += 1;
        begin.samples += info.width;
        Abreast& end = changes[member.row + info.height];
        end.files -= 1;
        end.samples -= info.width;
    }
    Abreast now, most;
    for (const auto& [row, change] : changes) {
        now.files += change.files;
        now.samples += change.samples;
        most.files = std::max(most.files, now.files);
        most.samples = std::max(most.samples, now.samples);
    }
    return most;
}

struct Placing {
    const std::vector<PlacedFile>& files;
    const TargetGrid& grid;
    const Crs& grid_crs;
    Kernel kernel;
};

// `first`: what may wait in memory does.
Result<std::vector<LayerOnGrid>> place_on(const Placing& placing, std::vector<Layer> layers, PixelPlace first) {
    std::vector<LayerOnGrid> placed;
    std::int64_t open = 0;
    for (Layer& layer : layers) {
        auto map = WarpMap::make(placing.grid, placing.grid_crs, layer.where, layer.crs);
        if (!map) return map.error();
        // Points on samples take them as they are, with any kernel; nearest says so to the last bit.
        const Kernel used = on_grid(layer, placing.grid, placing.grid_crs) ? Kernel::nearest : placing.kernel;
        const bool lattice = map->exact() && layer.where.axis_aligned();
        const std::int64_t abreast = abreast_of(layer, placing.files).files;
        const bool rolls = first == PixelPlace::memory && lattice && layer.where.row_y < 0 &&
                           map->shrink_at(0, 0).rows <= kMostShrink &&
                           open + abreast <= static_cast<std::int64_t>(OpenImages::kMost);
        if (rolls) open += abreast;
        placed.push_back(
            {std::move(layer), std::move(*map), used, lattice, rolls ? PixelPlace::memory : PixelPlace::disk, nullptr});
    }
    return placed;
}

// The last grid row with points that read a part of the layer, or one further south.
class LastReader {
public:
    LastReader(const LayerOnGrid& layer, const TargetGrid& grid, const Crs& grid_crs)
        : where_(layer.layer.where),
          grid_(grid),
          lattice_(layer.lattice),
          reach_(static_cast<double>(
              kernel_reach(layer.kernel, lattice_ ? layer.map.shrink_at(0, 0).rows : kMostGuessedShrink) + 1)) {
        if (lattice_) return;
        if (auto transform = CrsTransform::make(layer.layer.crs, grid_crs)) transform_.emplace(std::move(*transform));
    }

    std::int64_t operator()(const SampleRectangle& part) const { return lattice_ ? exactly(part) : guess(part); }

private:
    static constexpr double kMostGuessedShrink = 16;
    static constexpr int kSteps = 16;
    static constexpr std::int64_t kGuessRows = 64;  // for what edges do between the points that are looked at

    static std::int64_t whole(double j) {
        return std::abs(j) < 0x1p52 ? static_cast<std::int64_t>(std::floor(j)) : kNever;
    }

    // Point j is at row (y_j - first_y) / row_y and reads the rows within reach_ of it.
    std::int64_t exactly(const SampleRectangle& part) const {
        const double row = where_.row_y < 0 ? static_cast<double>(part.row + part.rows) + reach_
                                            : static_cast<double>(part.row) - reach_ - 1;
        const std::int64_t last = whole((grid_.y_m - (where_.first_y + row * where_.row_y)) / grid_.step_m);
        return last == kNever ? kNever : last + 1;
    }

    std::int64_t guess(const SampleRectangle& part) const {
        if (!transform_) return kNever;
        std::vector<double> x, y;
        for (const double row :
             {static_cast<double>(part.row) - reach_, static_cast<double>(part.row + part.rows) + reach_})
            for (int k = 0; k <= kSteps; ++k) {
                const double column = static_cast<double>(part.column) + static_cast<double>(part.columns) * k / kSteps;
                x.push_back(where_.x(column, row));
                y.push_back(where_.y(column, row));
            }
        transform_->apply(x, y);
        double south = std::numeric_limits<double>::infinity();
        for (const double v : y) {
            if (!std::isfinite(v)) return kNever;
            south = std::min(south, v);
        }
        const std::int64_t last = whole((grid_.y_m - south) / grid_.step_m);
        return last == kNever ? kNever : last + kGuessRows;
    }

    Georeference where_;
    TargetGrid grid_;
    bool lattice_;
    double reach_;
    std::optional<CrsTransform> transform_;
};

// Bytes of what waits for a band of 64 rows.
std::int64_t waiting_bytes(const LayerOnGrid& layer, const std::vector<PlacedFile>& files) {
    const WarpMap::Shrink shrink = layer.map.shrink_at(0, 0);
    if (layer.place == PixelPlace::disk) return 0;
    const auto rows = static_cast<std::int64_t>(std::ceil(static_cast<double>(kBandRows) * shrink.rows)) +
                      2 * (kernel_reach(layer.kernel, shrink.rows) + 1) + 2 + 2 * RowPixels::kBandRows;
    return rows * abreast_of(layer.layer, files).samples * 4;
}

}  // namespace

std::int64_t image_stack_bytes(const std::vector<PlacedFile>& files) {
    std::int64_t bytes = 0;
    for (const PlacedFile& file : files) bytes += SpooledPixels::file_bytes(file.info);
    return bytes;
}

struct ImageStack::Impl {
    Impl(const std::vector<PlacedFile>& given, const StackOptions& options)
        : files(given), images(files, options.open) {
        memory.bytes = options.spool_memory_bytes;
    }

    std::vector<PlacedFile> files;
    OpenImages images;
    SpoolMemory memory;
    std::vector<LayerOnGrid> layers;  ///< bottom to top
    std::vector<LastReader> readers;  ///< of each

    static Result<std::unique_ptr<Impl>> make(const Placing& placing, std::vector<Layer> layers, PixelPlace first,
                                              const StackOptions& options) {
        auto impl = std::make_unique<Impl>(placing.files, options);
        auto placed = place_on(placing, std::move(layers), first);
        if (!placed) return placed.error();
        impl->layers = std::move(*placed);
        for (LayerOnGrid& layer : impl->layers) {
            auto pixels = LayerPixels::create(layer.layer, impl->files, layer.place, options.temporary, impl->memory);
            if (!pixels) return pixels.error();
            layer.pixels = std::move(*pixels);
            impl->readers.emplace_back(layer, placing.grid, placing.grid_crs);
        }
        return impl;
    }

    Result<void> fetch(const ReadProgress& progress) {
        for (LayerOnGrid& layer : layers)
            if (auto ok = layer.pixels->fetch(images, progress); !ok) return ok;
        return {};
    }
};

ImageStack::ImageStack(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ImageStack::~ImageStack() = default;

Result<std::unique_ptr<ImageStack>> ImageStack::open(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                     const TargetGrid& grid, const Crs& grid_crs,
                                                     const StackOptions& options) {
    auto impl = Impl::make({files, grid, grid_crs, options.kernel}, std::move(layers), PixelPlace::memory, options);
    if (!impl) return impl.error();
    return std::unique_ptr<ImageStack>(new ImageStack(std::move(*impl)));
}

Result<std::unique_ptr<ImageStack>> ImageStack::read(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                     const TargetGrid& grid, const Crs& grid_crs,
                                                     const StackOptions& options, const ReadProgress& progress) {
    auto impl = Impl::make({files, grid, grid_crs, options.kernel}, std::move(layers), PixelPlace::disk, options);
    if (!impl) return impl.error();
    (*impl)->memory.bytes = 0;
    for (LayerOnGrid& layer : (*impl)->layers) layer.pixels->want_all(kNever);
    if (auto ok = (*impl)->fetch(progress); !ok) return ok.error();
    return std::unique_ptr<ImageStack>(new ImageStack(std::move(*impl)));
}

Result<void> ImageStack::prepare(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                 const ReadProgress& progress) {
    if (columns <= 0 || rows <= 0) return {};
    for (LayerOnGrid& layer : impl_->layers) want(layer, {i, j, columns, rows});
    return impl_->fetch(progress);
}

void ImageStack::release_north_of(std::int64_t j) {
    for (std::size_t k = 0; k < impl_->layers.size(); ++k)
        impl_->layers[k].pixels->release(j, std::cref(impl_->readers[k]), impl_->images);
}

Result<bool> ImageStack::sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                std::uint32_t* out, std::int64_t pitch) const {
    const Area area{i, j, columns, rows};
    const Canvas canvas{out, pitch};
    Scratch scratch;
    bool all_opaque = true;
    for (std::int64_t top = j; top < j + rows;) {
        const std::int64_t bottom = std::min((chunk_of(top) + 1) * WarpMap::kChunk, j + rows);
        for (std::int64_t left = i; left < i + columns; left += kPieceColumns) {
            const Area piece{left, top, std::min(kPieceColumns, i + columns - left), bottom - top};
            const auto opaque = sample_piece(impl_->layers, piece, canvas.part(area, piece), scratch);
            if (!opaque) return opaque;
            all_opaque = all_opaque && *opaque;
        }
        top = bottom;
    }
    return all_opaque;
}

// What is read in order, by whole rows, waits in as few of them as a decoder's band holds; what the map is asked about
// chunk by chunk is asked for by chunks.
std::int64_t ImageStack::rows_at_once() const {
    const bool rolls = std::all_of(impl_->layers.begin(), impl_->layers.end(),
                                   [](const LayerOnGrid& layer) { return layer.place == PixelPlace::memory; });
    return rolls ? RowPixels::kBandRows : kBandRows;
}

std::int64_t ImageStack::bytes_needed(const std::vector<PlacedFile>& files, const std::vector<Layer>& layers,
                                      const TargetGrid& grid, const Crs& grid_crs, std::int64_t) {
    std::int64_t unit = 0, bytes = 0, open = 0, spooled = 0, spooled_band = 0;
    for (const PlacedFile& file : files) unit = std::max(unit, file.info.unit_bytes);
    // Where nothing can be placed, opening says so.
    if (auto placed = place_on({files, grid, grid_crs, Kernel::cubic}, layers, PixelPlace::memory))
        for (const LayerOnGrid& layer : *placed) {
            bytes += waiting_bytes(layer, files);
            open += abreast_of(layer.layer, files).files;
            for (const LayerMember& member : layer.layer.members) {
                if (layer.place == PixelPlace::memory) continue;
                const ImageInfo& info = files[member.file].info;
                spooled += SpooledPixels::file_bytes(info);
                spooled_band =
                    std::max(spooled_band, 2 * SpooledPixels::kBlock * (info.width + SpooledPixels::kBlock) * 4);
            }
        }
    return bytes + spooled_band + std::min(spooled, StackOptions().spool_memory_bytes) +
           std::min(open, static_cast<std::int64_t>(OpenImages::kMost)) * (unit + kDecoderBandBytes);
}

std::int64_t ImageStack::temporary_bytes(const std::vector<PlacedFile>& files, const std::vector<Layer>& layers,
                                         const TargetGrid& grid, const Crs& grid_crs) {
    std::int64_t bytes = 0;
    if (auto placed = place_on({files, grid, grid_crs, Kernel::cubic}, layers, PixelPlace::memory))
        for (const LayerOnGrid& layer : *placed)
            if (layer.place == PixelPlace::disk)
                for (const LayerMember& member : layer.layer.members)
                    bytes += SpooledPixels::file_bytes(files[member.file].info);
    return bytes;
}

std::int64_t ImageStack::temporary_bytes_taken() const {
    std::int64_t bytes = 0;
    for (const LayerOnGrid& layer : impl_->layers) bytes += layer.pixels->temporary_bytes_taken();
    return bytes;
}

}  // namespace scree
