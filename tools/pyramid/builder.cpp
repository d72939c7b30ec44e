#include "tools/pyramid/builder.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/statvfs.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <thread>

#include "common/process_usage.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/store/page_checksum_vfs.h"
#include "tools/partial_file.h"
#include "tools/pyramid/build_state.h"
#include "tools/pyramid/height_stage.h"
#include "tools/pyramid/texture_stage.h"
#include "tools/source/geo_grid_maker.h"
#include "tools/source/isolated_decoder.h"
#include "tools/stage_clock.h"

namespace scree {
namespace {

double megapixels(const std::vector<PlacedFile>& files) {
    double sum = 0;
    for (const PlacedFile& f : files)
        sum += static_cast<double>(f.info.width) * static_cast<double>(f.info.height) / 1e6;
    return sum;
}

std::string partial_path(const BuildOptions& options) { return options.out + ".partial"; }

// A build from its file's first row to its last, wherever it stands.
class Build {
public:
    Build(const BuildPlan& plan, const BuildOptions& options, const std::atomic<bool>& stop)
        : plan_(plan),
          options_(options),
          stop_(stop),
          base_(plan.mosaic.base_lattice()),
          progress_("building", "MPix", options.quiet),
          index_(base_, plan.dataset.texture_deepest_level) {}

    /// Opens or takes up OUT.partial. Errors: ErrorCode::usage for one of another build.
    Result<void> open() {
        auto partial = PartialFile::open_or_create(partial_path(options_));
        if (!partial) return partial.error();
        partial_ = std::move(*partial);
        state_.identity = identity_of(plan_.dataset);
        if (!options_.force)
            if (auto ok = take_up(); !ok) {
                partial_->keep();
                return ok;
            }
        if (complete_) return {};
        if (!store_) {
            auto fresh = SqliteStoreWriter::create(partial_->path());
            if (!fresh) return fresh.error();
            store_ = std::move(*fresh);
        }
        writer_ = std::make_unique<TileWriter>(*store_);
        return {};
    }

    Result<void> run(BuildReport& report) {
        auto done = make(report);
        // What has been committed is worth keeping: the same command goes on from there.
        if (!done && (state_.heights_done || complete_)) partial_->keep();
        if (!done && done.error().code == ErrorCode::interrupted)
            return Error{ErrorCode::interrupted,
                         state_.heights_done ? fmt::format("stopped; the same command goes on from {} of {} rows",
                                                           state_.district_rows, rows_)
                                             : std::string("stopped; nothing was written")};
        return done;
    }

private:
    // What a build that was cut off left: rows and a state, a store that only lacks its name, or nothing of use.
    Result<void> take_up() {
        auto store = SqliteStoreWriter::resume(partial_->path());
        if (!store && store.error().code != ErrorCode::store) return store.error();
        if (!store || (*store)->state().empty()) {
            store = Error{};
            auto finished = SqliteStore::open(partial_->path());
            complete_ = finished && identity_of((*finished)->dataset()) == state_.identity && pages_sound();
            if (complete_) state_.dataset = (*finished)->dataset();
            return {};
        }
        auto state = BuildState::from_text((*store)->state());
        if (!state) return {};  // written by another version of the program: started anew
        if (auto difference = identity_difference(state->identity, state_.identity))
            return Error{ErrorCode::usage,
                         fmt::format("{}: was begun with {}; the command that began it goes on, --force starts anew",
                                     partial_->path(), *difference)};
        state_ = std::move(*state);
        store_ = std::move(*store);
        return {};
    }

    // A store that is to be had by giving it its name is read once more: one that is damaged is made anew.
    bool pages_sound() const {
        const auto scan = scan_page_checksums(partial_->path());
        return scan && scan->damaged.empty();
    }

    Result<void> make(BuildReport& report) {
        const double width = static_cast<double>(base_.cells_x + 1), height = static_cast<double>(base_.cells_y + 1);
        const double dem = megapixels(plan_.mosaic.heights), images = megapixels(plan_.mosaic.imagery);
        const double lattice = width * height / 1e6;
        progress_.set_total(dem + lattice + images);
        if (complete_) return give_name(report);
        if (state_.heights_done) {
            if (auto ok = take_up_heights(report); !ok) return ok;
            progress_.add(dem + lattice);
        } else {
            if (auto ok = make_heights(report); !ok) return ok;
            ::malloc_trim(0);  // what textures take should not come on top of it
        }
        if (auto ok = make_textures(images); !ok) return ok;
        return finish(report);
    }

    Result<void> make_heights(BuildReport& report) {
        auto heights = build_heights(plan_, options_, *writer_, index_, progress_, stop_);
        if (!heights) return heights.error();
        state_.heights_done = true;
        state_.dataset = std::move(heights->dataset);
        state_.warp_rms_m = heights->warp_rms_m;
        state_.filled_samples = heights->filled_samples;
        report.warnings = std::move(heights->warnings);
        report.notes = std::move(heights->notes);
        return writer_->checkpoint(state_.text());
    }

    Result<void> take_up_heights(BuildReport& report) {
        if (auto ok = index_.note_all(writer_->store(), plan_.dataset.lattice); !ok) return ok;
        const auto count = [&](std::int64_t) { ++report.reused_tiles; };
        for (const TileKind kind : {TileKind::height, TileKind::texture})
            if (auto ok = writer_->store().for_each_key(kind, count); !ok) return ok;
        return {};
    }

    Result<void> make_textures(double megapixels) {
        const Dataset& d = state_.dataset;
        auto imagery = LevelImagery::open(plan_, options_);
        if (!imagery) return imagery.error();
        TextureStageJob job;
        job.dataset = d;
        job.base = base_;
        job.index = &index_;
        job.heights = [&](TileId id, TileRow& row) {
            return writer_->read(TileKind::height, *tile_key(d.lattice, id), row);
        };
        job.depth = &plan_.textures;
        job.imagery = &*imagery;
        job.deep_texels_wide = plan_.deep_texels_wide;
        job.writer = writer_.get();
        job.quality = options_.texture_quality;
        job.codec = options_.texture_codec;
        job.stop = &stop_;
        TextureStage stage(std::move(job));
        rows_ = stage.district_rows();
        while (state_.district_rows < rows_) {
            if (stop_) return Error{ErrorCode::interrupted, "stopped"};
            if (auto ok = make_deep_rows(stage); !ok) return ok;
            if (auto ok = stage.build_districts(0, state_.district_rows, stage.district_columns(), 1); !ok) return ok;
            ++state_.district_rows;
            if (auto ok = writer_->checkpoint(state_.text()); !ok) return ok;
            progress_.add(megapixels / static_cast<double>(rows_));
        }
        return stage.build_crown();
    }

    // Deep districts under the next row of districts, a checkpoint a row of them.
    Result<void> make_deep_rows(TextureStage& stage) {
        const int down = state_.dataset.least_texture_level() - seed_level(state_.dataset);
        const std::int64_t end = std::min((state_.district_rows + 1) << down, stage.deep_rows());
        for (std::int64_t row = std::max(state_.deep_rows, state_.district_rows << down); row < end; ++row) {
            if (!stage.has_deep(row)) continue;
            if (auto ok = stage.build_deep_row(row); !ok) return ok;
            state_.deep_rows = row + 1;
            if (auto ok = writer_->checkpoint(state_.text()); !ok) return ok;
        }
        return {};
    }

    Result<void> finish(BuildReport& report) {
        if (auto ok = writer_->flush(); !ok) return ok;
        Dataset& d = state_.dataset;
        d.texture_tiles = 0;
        if (auto ok = store_->for_each_key(TileKind::texture, [&](std::int64_t) { ++d.texture_tiles; }); !ok) return ok;
        d.geo_grid = make_geo_grid(d.lattice, d.crs);
        if (auto ok = store_->finish(d); !ok) return ok;
        if (stop_) return Error{ErrorCode::interrupted, "stopped"};
        writer_.reset();
        store_.reset();
        complete_ = true;
        return give_name(report);
    }

    Result<void> give_name(BuildReport& report) {
        const Dataset& d = state_.dataset;
        if (auto ok = partial_->rename_to(options_.out); !ok) return ok;
        progress_.finish();
        report.warp_error_m = d.warp_error_m;
        report.warp_rms_m = state_.warp_rms_m;
        report.filled_samples = state_.filled_samples;
        report.height_tiles = d.height_tiles;
        report.texture_tiles = d.texture_tiles;
        return {};
    }

    const BuildPlan& plan_;
    const BuildOptions& options_;
    const std::atomic<bool>& stop_;
    Lattice base_;
    Progress progress_;
    HeightIndex index_;
    std::unique_ptr<PartialFile> partial_;
    std::unique_ptr<SqliteStoreWriter> store_;
    std::unique_ptr<TileWriter> writer_;
    BuildState state_;
    bool complete_ = false;  // the file only lacks its name
    std::int64_t rows_ = 0;
};

}  // namespace

Result<void> announce_build(const BuildPlan& plan, const BuildOptions& options) {
    std::error_code error;
    for (const auto* files : {&plan.mosaic.heights, &plan.mosaic.imagery})
        for (const PlacedFile& input : *files)
            if (std::filesystem::equivalent(input.path, options.out, error))
                return Error{ErrorCode::usage,
                             fmt::format("{}: is an input, and the output would replace it", options.out)};
    if (std::filesystem::exists(options.out, error) && !options.force)
        return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", options.out)};
    const auto folder = std::filesystem::absolute(options.out, error).parent_path();
    struct statvfs space {};
    if (::statvfs(folder.c_str(), &space) != 0)
        return Error{ErrorCode::io, fmt::format("{}: {}", folder.string(), std::strerror(errno))};
    const auto free_bytes = static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize);
    double needed = static_cast<double>(plan.temporary_bytes + plan.store_bytes_estimate);
    if (!options.quiet)
        note("disk: up to {:.1f} MB for the store and {:.1f} MB while building; {:.0f} MB are free\n",
             static_cast<double>(plan.store_bytes_estimate) / 1e6, static_cast<double>(plan.temporary_bytes) / 1e6,
             free_bytes / 1e6);
    // What stands in a file that was cut off need not be written again.
    const auto begun = std::filesystem::file_size(partial_path(options), error);
    if (!error) needed -= static_cast<double>(begun);
    if (needed > free_bytes)
        return Error{ErrorCode::io, fmt::format("{}: {:.0f} MB may be needed and {:.0f} MB are free", folder.string(),
                                                needed / 1e6, free_bytes / 1e6)};
    return {};
}

Result<BuildReport> build_store(BuildPlan plan, const BuildOptions& options, const std::atomic<bool>& stop) {
    const auto start = std::chrono::steady_clock::now();
    const int threads =
        options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    StageClock::reset();
    const double decoded_before = decoder_usage().cpu_seconds;
    BuildReport report;
    Build build(plan, options, stop);
    if (auto ok = build.open(); !ok) return ok.error();
    if (auto ok = build.run(report); !ok) return ok.error();

    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    report.cpu_seconds = usage.cpu_seconds + decoders.cpu_seconds;
    report.peak_rss_bytes = usage.peak_rss_bytes + decoders.peak_rss_bytes;
    for (std::size_t k = 0; k < kStages; ++k) report.stage_seconds[k] = StageClock::seconds(static_cast<Stage>(k));
    report.stage_seconds[static_cast<std::size_t>(Stage::decode)] += decoders.cpu_seconds - decoded_before;
    report.source_megapixels = megapixels(plan.mosaic.heights) + megapixels(plan.mosaic.imagery);
    std::error_code error;
    report.store_bytes = static_cast<std::int64_t>(std::filesystem::file_size(options.out, error));
    return report;
}

}  // namespace scree
