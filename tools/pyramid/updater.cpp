#include "tools/pyramid/updater.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <tuple>

#include "common/process_usage.h"
#include "common/progress.h"
#include "tools/partial_file.h"
#include "tools/pyramid/build_record.h"
#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/height_stage.h"
#include "tools/pyramid/texture_stage.h"
#include "tools/source/fingerprint.h"
#include "tools/source/geo_grid_maker.h"
#include "tools/source/isolated_decoder.h"
#include "tools/source/sidecars.h"
#include "tools/source/source_list.h"

namespace scree {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeights = "heights";
constexpr const char* kImagery = "imagery";

Error interrupted() { return {ErrorCode::interrupted, "stopped; the store is as it was"}; }

std::string name_of(const std::string& path) { return fs::path(path).filename().string(); }

// Where the files of the store lie now.
class SourceFinder {
public:
    explicit SourceFinder(const UpdateOptions& options) {
        const auto add = [&](const fs::path& folder) {
            const fs::path f = folder.empty() ? fs::path(".") : folder;
            if (std::find(folders_.begin(), folders_.end(), f) == folders_.end()) folders_.push_back(f);
        };
        for (const std::string& folder : options.sources) add(folder);
        add(fs::path(options.store).parent_path());
        for (const auto* list : {&options.dems, &options.images})
            for (const std::string& path : *list) {
                std::error_code error;
                add(fs::is_directory(path, error) ? fs::path(path) : fs::path(path).parent_path());
            }
        add(".");
    }

    Result<std::string> find(const SourceRecord& record) const {
        bool seen = false;
        std::string sidecars;
        for (const fs::path& folder : folders_) {
            const fs::path path = folder / record.name;
            std::error_code error;
            const auto bytes = fs::file_size(path, error);
            if (error) continue;
            seen = true;
            if (static_cast<std::int64_t>(bytes) != record.bytes || fingerprint_of(path.string()) != record.fingerprint)
                continue;
            sidecars = sidecar_difference(record.sidecars, sidecar_prints(path.string()));
            if (sidecars.empty()) return path.string();
        }
        if (!sidecars.empty())
            return Error{ErrorCode::input,
                         fmt::format("{}: a source of the store whose sidecars are others now ({}): given again it is "
                                     "read anew, --remove {} takes it out",
                                     record.name, sidecars, record.name)};
        std::vector<std::string> names;
        for (const fs::path& folder : folders_) names.push_back(folder.string());
        return Error{ErrorCode::input,
                     fmt::format("{}: a source of the store, {} in {}: the update must read it where it shows; "
                                 "--sources FOLDER says where it is, --remove {} takes it out",
                                 record.name, seen ? "is another file now" : "was not found", fmt::join(names, ", "),
                                 record.name)};
    }

private:
    std::vector<fs::path> folders_;
};

// Finest cells, counted as the lattice's.
struct Box {
    double west = 0, north = 0, east = 0, south = 0;
};

class Update {
public:
    Update(const UpdateOptions& options, const std::atomic<bool>& stop) : options_(options), stop_(stop) {}

    Result<UpdateReport> run() {
        if (auto ok = open(); !ok) return ok.error();
        if (auto ok = plan(); !ok) return ok.error();
        if (auto ok = make(); !ok) return ok.error().code == ErrorCode::interrupted ? interrupted() : ok.error();
        if (stop_) return interrupted();
        if (auto ok = apply(); !ok) return ok.error();
        return std::move(report_);
    }

private:
    Result<void> open() {
        auto store = SqliteStore::open(options_.store);
        if (!store) return store.error();
        store_ = std::move(*store);
        for (const SourceRecord& s : dataset().sources)
            if (s.fingerprint.empty() || !s.box_m)
                return Error{ErrorCode::usage, fmt::format("{}: was built by a version that recorded neither the order "
                                                           "of its sources nor its options; build it anew",
                                                           options_.store)};
        for (const std::string& name : options_.remove)
            if (std::none_of(dataset().sources.begin(), dataset().sources.end(),
                             [&](const SourceRecord& s) { return s.name == name; }))
                return Error{
                    ErrorCode::usage,
                    fmt::format("--remove {}: the store has no source of that name; scree info lists them", name)};
        return {};
    }
    const Dataset& dataset() const { return store_->dataset(); }

    Result<void> plan() {
        build_.out = options_.store + ".update";
        build_.threads = options_.threads;
        build_.memory_bytes = options_.memory_bytes;
        build_.quiet = options_.quiet;
        build_.attribution = options_.attribution.value_or(dataset().attribution);
        if (auto ok = apply_record(dataset().options, build_); !ok)
            return Error{ok.error().code, fmt::format("{}: {}", options_.store, ok.error().message)};
        if (auto ok = list_files(); !ok) return ok;
        if (build_.dems.empty())
            return Error{ErrorCode::usage, fmt::format("{}: no source of heights would be left", options_.store)};
        auto planned = plan_build(build_);
        if (!planned) return planned.error();
        plan_ = std::make_unique<BuildPlan>(std::move(*planned));
        return check_reuse();
    }

    // The files of the store as it will be, bottom to top.
    Result<void> list_files() {
        const SourceFinder finder(options_);
        auto new_dems = listed(options_.dems), new_images = listed(options_.images);
        if (!new_dems) return new_dems.error();
        if (!new_images) return new_images.error();
        for (const SourceRecord& s : dataset().sources) {
            const bool heights = s.role == kHeights;
            auto& list = heights ? build_.dems : build_.images;
            if (std::find(options_.remove.begin(), options_.remove.end(), s.name) != options_.remove.end()) continue;
            auto& fresh = heights ? *new_dems : *new_images;
            const auto same = std::find_if(fresh.begin(), fresh.end(),
                                           [&](const std::string& path) { return name_of(path) == s.name; });
            if (same != fresh.end()) {
                list.push_back(*same);
                named_.push_back(s.name);
                fresh.erase(same);
                continue;
            }
            auto found = finder.find(s);
            if (!found) return found.error();
            list.push_back(std::move(*found));
        }
        build_.dems.insert(build_.dems.end(), new_dems->begin(), new_dems->end());
        build_.images.insert(build_.images.end(), new_images->begin(), new_images->end());
        return {};
    }

    static Result<std::vector<std::string>> listed(const std::vector<std::string>& paths) {
        if (paths.empty()) return std::vector<std::string>{};
        return list_sources(paths);
    }

    Result<void> check_reuse() const {
        const Dataset &was = dataset(), &is = plan_->dataset;
        std::string what;
        if (!(was.lattice == is.lattice))
            what = fmt::format(
                "the lattice would be {} x {} cells of {} m from {}, {} instead of {} x {} of {} m from {}, {}",
                is.lattice.cells_x, is.lattice.cells_y, is.lattice.spacing_m, is.lattice.origin_x_m,
                is.lattice.origin_y_m, was.lattice.cells_x, was.lattice.cells_y, was.lattice.spacing_m,
                was.lattice.origin_x_m, was.lattice.origin_y_m);
        else if (was.crs != is.crs)
            what = fmt::format("the CRS would be {} instead of {}", is.crs, was.crs);
        else if (was.options != is.options)
            what = "its options would be others";
        if (what.empty()) return {};
        return Error{ErrorCode::usage,
                     fmt::format("{}: {}: every tile would change; use scree build", options_.store, what)};
    }

    Result<void> make() {
        auto partial = PartialFile::create(build_.out);
        if (!partial) return partial.error();
        partial_ = std::move(*partial);
        auto side = SqliteStoreWriter::create(build_.out);
        if (!side) return side.error();
        side_ = std::move(*side);
        writer_ = std::make_unique<TileWriter>(*side_);
        Progress progress("updating", "MPix", options_.quiet);
        const Lattice base = plan_->mosaic.base_lattice();
        index_ = std::make_unique<HeightIndex>(base, plan_->dataset.texture_deepest_level);
        if (auto ok = make_heights(progress); !ok) return ok;
        return make_textures(progress);
    }

    bool same_heights() const {
        const auto records = [](const Dataset& d) {
            std::vector<std::tuple<std::string, std::int64_t, std::string, SidecarPrints>> list;
            for (const SourceRecord& s : d.sources)
                if (s.role == kHeights) list.emplace_back(s.name, s.bytes, s.fingerprint, s.sidecars);
            return list;
        };
        return records(dataset()) == records(plan_->dataset) && options_.dems.empty();
    }

    Result<void> make_heights(Progress& progress) {
        heights_made_ = !same_heights();
        if (!heights_made_) {
            dataset_ = dataset();
            dataset_.sources = plan_->dataset.sources;
            dataset_.options = plan_->dataset.options;
            dataset_.attribution = plan_->dataset.attribution;
            dataset_.has_imagery = plan_->dataset.has_imagery;
            dataset_.texture_deepest_level = plan_->dataset.texture_deepest_level;
            dataset_.coarsest_texture_level = plan_->dataset.coarsest_texture_level;
            if (auto ok = index_->note_all(*store_); !ok) return ok;
            return mark_texture_ends();
        }
        auto made = build_heights(*plan_, build_, *writer_, *index_, progress, stop_);
        if (!made) return made.error();
        dataset_ = std::move(made->dataset);
        report_.warnings = std::move(made->warnings);
        return writer_->flush();
    }

    // Heights that stay say where textures end all the same.
    Result<void> mark_texture_ends() {
        if (!dataset().coarsest_texture_level && !dataset_.coarsest_texture_level) return {};
        Result<void> outcome;
        std::vector<std::uint8_t> payload;
        auto ok = store_->for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
            payload.assign(row.payload.begin(), row.payload.end());
            say_where_textures_end(payload, *tile_from_key(dataset_.lattice, row.key), plan_->textures);
            if (std::equal(payload.begin(), payload.end(), row.payload.begin())) return true;
            outcome = writer_->put(TileKind::height, row.key, row.codec, payload);
            return outcome.ok() && !stop_;
        });
        if (ok && stop_) return interrupted();
        return ok ? outcome : ok;
    }

    Result<bool> read_heights(TileId id, TileRow& row) {
        const std::int64_t key = *tile_key(dataset_.lattice, id);
        if (heights_made_) return writer_->read(TileKind::height, key, row);
        const std::lock_guard lock(reading_);
        return reader_->read(TileKind::height, id, row);
    }

    Result<void> make_textures(Progress& progress) {
        auto reader = store_->open_reader();
        if (!reader) return reader.error();
        reader_ = std::move(*reader);
        auto imagery = LevelImagery::open(*plan_, build_);
        if (!imagery) return imagery.error();
        TextureStageJob job;
        job.dataset = dataset_;
        job.base = plan_->mosaic.base_lattice();
        job.index = index_.get();
        job.heights = [&](TileId id, TileRow& row) { return read_heights(id, row); };
        job.depth = &plan_->textures;
        job.imagery = &*imagery;
        job.deep_texels_wide = plan_->deep_texels_wide;
        job.deep_wanted = [&](TileId id) { return is_deep_dirty(id); };
        job.writer = writer_.get();
        job.quality = build_.texture_quality;
        job.codec = build_.texture_codec;
        job.other_seeds = [&](std::int64_t key, TileRow& row) -> Result<bool> {
            if (was_made_again(TileKind::seed, key)) return false;  // it has none now
            const TileId id = *tile_from_key(dataset_.lattice, key);
            const std::lock_guard lock(reading_);
            return reader_->read(TileKind::seed, id, row);
        };
        job.stop = &stop_;
        TextureStage stage(std::move(job));
        columns_ = stage.district_columns();
        rows_ = stage.district_rows();
        if (auto ok = find_dirty(); !ok) return ok;
        progress.set_total(static_cast<double>(report_.districts_built));
        for (std::int64_t row = 0; row < stage.deep_rows(); ++row) {
            if (stop_) return interrupted();
            if (auto ok = stage.build_deep_row(row); !ok) return ok;
        }
        for (std::int64_t y = 0; y < rows_; ++y)
            for (std::int64_t x = 0; x < columns_; ++x) {
                if (!is_dirty(x, y)) continue;
                std::int64_t end = x + 1;
                while (end < columns_ && is_dirty(end, y)) ++end;
                if (stop_) return interrupted();
                if (auto ok = stage.build_districts(x, y, end - x, 1); !ok) return ok;
                progress.add(static_cast<double>(end - x));
                x = end;
            }
        if (report_.districts_built > 0)
            if (auto ok = stage.build_crown(); !ok) return ok;
        return writer_->flush();
    }

    bool is_dirty(std::int64_t x, std::int64_t y) const {
        return dirty_[static_cast<std::size_t>(y * columns_ + x)] != 0;
    }

    bool is_deep_dirty(TileId id) const { return deep_dirty_[static_cast<std::size_t>(id.y * deep_columns_ + id.x)]; }

    // A box of finest cells, and all tiles of the textures' coarsest level that it touches.
    void mark(const Box& cells) {
        const int level = dataset_.least_texture_level(), up = level - seed_level(dataset_);
        const double side = std::ldexp(1.0, dataset_.lattice.deepest_level - level + dataset_.lattice.tile_cells_log2);
        const auto clip = [&](double v, std::int64_t count) {
            return static_cast<std::int64_t>(std::clamp(v, 0.0, static_cast<double>(count)));
        };
        const std::int64_t west = clip(std::floor(cells.west / side), deep_columns_),
                           east = clip(std::ceil(cells.east / side), deep_columns_),
                           south = clip(std::ceil(cells.south / side), deep_rows_);
        for (std::int64_t y = clip(std::floor(cells.north / side), deep_rows_); y < south; ++y)
            for (std::int64_t x = west; x < east; ++x) {
                deep_dirty_[static_cast<std::size_t>(y * deep_columns_ + x)] = true;
                dirty_[static_cast<std::size_t>((y >> up) * columns_ + (x >> up))] = 1;
            }
    }

    Result<void> find_dirty() {
        deep_columns_ = plan_->textures.columns(dataset_.least_texture_level());
        deep_rows_ = plan_->textures.rows(dataset_.least_texture_level());
        deep_dirty_.assign(static_cast<std::size_t>(deep_columns_ * deep_rows_), false);
        dirty_.assign(static_cast<std::size_t>(columns_ * rows_), 0);
        report_.districts = columns_ * rows_;
        // The tint's colours span the range of heights.
        const bool range =
            dataset_.min_height_m != dataset().min_height_m || dataset_.max_height_m != dataset().max_height_m;
        // Where depth varies the dense part, which the tint is made of, may have another depth.
        const bool depth = plan_->mosaic.base_shift > 0 || dataset().coarsest_leaf_level;
        // Districts begin elsewhere; or which textures beyond the heights exist goes by other texels' centres.
        all_dirty_ = (heights_made_ && (range || depth)) ||
                     dataset_.least_texture_level() != dataset().least_texture_level() ||
                     (depth && dataset_.texture_deepest_level != dataset().texture_deepest_level);
        if (all_dirty_) {
            std::fill(dirty_.begin(), dirty_.end(), std::uint8_t{1});
            std::fill(deep_dirty_.begin(), deep_dirty_.end(), true);
        } else {
            mark_images();
        }
        if (heights_made_ && !all_dirty_)
            if (auto ok = mark_heights(); !ok) return ok;
        report_.districts_built = std::count(dirty_.begin(), dirty_.end(), 1);
        return {};
    }

    // Files that came, went or changed; and those whose layer's grid begins elsewhere now, because positions are
    // counted from there.
    void mark_images() {
        mark_differences(dataset(), plan_->dataset);
        mark_differences(plan_->dataset, dataset());
    }

    void mark_differences(const Dataset& in, const Dataset& other) {
        for (const SourceRecord& s : in.sources) {
            if (s.role != kImagery) continue;
            // What the user names is made again, whatever its fingerprint, which is of a part of the file.
            const bool named =
                std::find(named_.begin(), named_.end(), s.name) != named_.end() ||
                std::find(options_.remove.begin(), options_.remove.end(), s.name) != options_.remove.end();
            const auto same = std::find_if(other.sources.begin(), other.sources.end(), [&](const SourceRecord& o) {
                return o.role == s.role && o.name == s.name && o.bytes == s.bytes && o.fingerprint == s.fingerprint &&
                       o.sidecars == s.sidecars;
            });
            if (named || same == other.sources.end())
                mark_box(s, *s.box_m);
            else if (same->layer != s.layer)
                mark_sides(s, *same);
        }
    }

    // The file is the same, its layer is not: all of it where samples are counted from elsewhere, else the sides that
    // were the layer's, or are.
    void mark_sides(const SourceRecord& s, const SourceRecord& other) {
        const auto [west, south, east, north] = *s.box_m;
        const std::size_t grid = s.layer.size() < 2 ? 0 : s.layer.size() - 2;
        const auto digits = [&](const std::string& layer) {
            return static_cast<unsigned>(std::strtoul(layer.c_str() + std::min(grid, layer.size()), nullptr, 16));
        };
        const unsigned mine = digits(s.layer), changed = mine ^ digits(other.layer);
        if (s.layer.compare(0, grid, other.layer, 0, grid) != 0 || (mine & kStraight) == 0 ||
            (changed & kStraight) != 0)
            return mark_box(s, *s.box_m);
        if ((changed & kWestSide) != 0) mark_box(s, {west, south, west, north});
        if ((changed & kEastSide) != 0) mark_box(s, {east, south, east, north});
        if ((changed & kNorthSide) != 0) mark_box(s, {west, north, east, north});
        if ((changed & kSouthSide) != 0) mark_box(s, {west, south, east, south});
    }

    void mark_box(const SourceRecord& s, const std::array<double, 4>& box) {
        const auto [west, south, east, north] = box;
        const double wide = (*s.box_m)[2] - (*s.box_m)[0], high = (*s.box_m)[3] - (*s.box_m)[1];
        // What a kernel reads around a point, in pixels; and what a curved side may reach out between the points that
        // the box was made of.
        const double pixel = std::max(wide / static_cast<double>(s.width), high / static_cast<double>(s.height));
        const double texel = dataset_.texel_m(dataset_.least_texture_level());
        const double reach = 4 * std::max(pixel, texel) + 0.01 * std::max(wide, high);
        const Lattice& l = dataset_.lattice;
        mark({l.i_of(west - reach), l.j_of(north + reach), l.i_of(east + reach), l.j_of(south - reach)});
    }

    // Where leaves differ, presence and tint may.
    Result<void> mark_heights() {
        const Lattice& l = dataset_.lattice;
        return for_each_changed_height([&](std::int64_t key, bool) -> Result<void> {
            const TileId id = *tile_from_key(l, key);
            if (id.level < plan_->mosaic.base_lattice().deepest_level) return {};
            const auto side = static_cast<double>(l.tile_extent(id.level));
            const auto at = [&](std::int64_t tile) { return static_cast<double>(tile) * side; };
            mark({at(id.x), at(id.y), at(id.x + 1), at(id.y + 1)});
            return {};
        });
    }

    // Visits (key, stored now?) of the height tiles that are not as they were.
    Result<void> for_each_changed_height(const std::function<Result<void>(std::int64_t key, bool stored)>& visit) {
        std::vector<std::int64_t> now, was;
        if (auto ok = side_->for_each_key(TileKind::height, [&](std::int64_t key) { now.push_back(key); }); !ok)
            return ok;
        TileRow fresh, held;
        for (const std::int64_t key : now) {
            auto read = writer_->read(TileKind::height, key, fresh);
            if (!read) return read.error();
            const std::lock_guard lock(reading_);
            auto found = reader_->read(TileKind::height, *tile_from_key(dataset_.lattice, key), held);
            if (!found) return found.error();
            say_where_textures_end(held.payload, *tile_from_key(dataset_.lattice, key), plan_->textures);
            if (*found && held.codec == fresh.codec && held.payload == fresh.payload) continue;
            if (auto ok = visit(key, true); !ok) return ok;
        }
        Result<void> outcome;
        auto ok = store_->for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
            if (!std::binary_search(now.begin(), now.end(), row.key)) outcome = visit(row.key, false);
            return outcome.ok();
        });
        return ok ? outcome : ok;
    }

    // One transaction.
    Result<void> apply() {
        if (auto ok = writer_->flush(); !ok) return ok;
        auto target = SqliteStoreWriter::amend(options_.store);
        if (!target) return target.error();
        for (const TileKind kind : {TileKind::height, TileKind::texture, TileKind::seed})
            if (auto ok = apply(**target, kind); !ok) return ok;
        if (auto ok = count(**target, TileKind::height, dataset_.height_tiles); !ok) return ok;
        if (auto ok = count(**target, TileKind::texture, dataset_.texture_tiles); !ok) return ok;
        dataset_.geo_grid = make_geo_grid(dataset_.lattice, dataset_.crs);
        if (auto ok = (*target)->finish(dataset_); !ok) return ok;
        writer_.reset();
        return {};
    }

    static Result<void> count(const SqliteStoreWriter& store, TileKind kind, std::int64_t& rows) {
        rows = 0;
        return store.for_each_key(kind, [&](std::int64_t) { ++rows; });
    }

    // Tiles that were made again: those that differ are written, those that are no more removed.
    Result<void> apply(SqliteStoreWriter& target, TileKind kind) {
        std::vector<std::int64_t> made, gone;
        if (auto ok = side_->for_each_key(kind, [&](std::int64_t key) { made.push_back(key); }); !ok) return ok;
        if (auto ok = target.for_each_key(kind,
                                          [&](std::int64_t key) {
                                              if (!std::binary_search(made.begin(), made.end(), key) &&
                                                  was_made_again(kind, key))
                                                  gone.push_back(key);
                                          });
            !ok)
            return ok;
        std::int64_t& written = kind == TileKind::height ? report_.height_tiles_written : report_.texture_tiles_written;
        TileRow fresh, held;
        for (const std::int64_t key : made) {
            auto read = side_->read(kind, key, fresh);
            if (!read) return read.error();
            auto found = target.read(kind, key, held);
            if (!found) return found.error();
            if (*found && held.codec == fresh.codec && held.payload == fresh.payload) continue;
            if (auto ok = target.put(kind, key, fresh.codec, fresh.payload); !ok) return ok;
            if (kind != TileKind::seed) ++written;
        }
        for (const std::int64_t key : gone)
            if (auto ok = target.remove(kind, key); !ok) return ok;
        if (kind != TileKind::seed) report_.tiles_removed += static_cast<std::int64_t>(gone.size());
        return {};
    }

    bool was_made_again(TileKind kind, std::int64_t key) const {
        if (kind == TileKind::height) return heights_made_;
        if (report_.districts_built == 0) return false;
        if (all_dirty_) return true;
        const auto id = tile_from_key(dataset_.lattice, key);
        const int seeds = seed_level(dataset_), coarsest = dataset_.least_texture_level();
        if (!id || id->level < seeds) return id.has_value();
        const TileId district = ancestor_at(*id, seeds);
        if (district.x >= columns_ || district.y >= rows_ || !is_dirty(district.x, district.y)) return false;
        if (id->level < coarsest) return true;
        // Deep districts that nothing touches have their seeds.
        const TileId deep = ancestor_at(*id, coarsest);
        return !plan_->textures.seeded(deep) || is_deep_dirty(deep);
    }

    const UpdateOptions& options_;
    const std::atomic<bool>& stop_;
    UpdateReport report_;
    std::unique_ptr<SqliteStore> store_;
    std::unique_ptr<BuildPlan> plan_;
    BuildOptions build_;
    std::vector<std::string> named_;  // sources that new files replace
    std::unique_ptr<PartialFile> partial_;
    std::unique_ptr<SqliteStoreWriter> side_;
    std::unique_ptr<TileWriter> writer_;
    std::unique_ptr<HeightIndex> index_;
    std::unique_ptr<TileReader> reader_;  // of the store as it is
    std::mutex reading_;
    Dataset dataset_;  // as it will be
    bool heights_made_ = false;
    std::int64_t columns_ = 0, rows_ = 0;  // of districts
    std::vector<std::uint8_t> dirty_;
    std::int64_t deep_columns_ = 0, deep_rows_ = 0;  // tiles of the textures' coarsest level
    std::vector<bool> deep_dirty_;                   // of them; those of deep districts matter
    bool all_dirty_ = false;
};

}  // namespace

Result<UpdateReport> update_store(const UpdateOptions& options, const std::atomic<bool>& stop) {
    const auto start = std::chrono::steady_clock::now();
    const int threads =
        options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    auto report = Update(options, stop).run();
    if (!report) return report;
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report->cpu_seconds = usage.cpu_seconds + decoders.cpu_seconds;
    report->peak_rss_bytes = usage.peak_rss_bytes + decoders.peak_rss_bytes;
    return report;
}

}  // namespace scree
