// What the heights of a build cost: one DEM, copied to the lattice, through every step up to the height tiles in the
// store, and no textures. scree_height_stage_bench DEM [THREADS [OUT]]
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "common/process_usage.h"
#include "tools/pyramid/build_plan.h"
#include "tools/pyramid/height_pyramid.h"
#include "tools/pyramid/spool_rows.h"
#include "tools/source/isolated_decoder.h"
#include "tools/stage_clock.h"

namespace {

using namespace scree;

template <class T>
T must(Result<T> result) {
    if (result) return std::move(*result);
    fmt::print(stderr, "{}\n", result.error().message);
    std::exit(1);
}
void must(const Result<void>& result) {
    if (result) return;
    fmt::print(stderr, "{}\n", result.error().message);
    std::exit(1);
}

class Clock {
public:
    double wall_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    double cpu_s() const { return process_usage().cpu_seconds - cpu_; }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    double cpu_ = process_usage().cpu_seconds;
};

void report(const char* what, const Clock& clock, double more_cpu_s = 0) {
    fmt::print("{:10} {:7.2f} s {:7.2f} CPU s\n", what, clock.wall_s(), clock.cpu_s() + more_cpu_s);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 1;
    const int threads = argc > 2 ? std::atoi(argv[2]) : static_cast<int>(std::thread::hardware_concurrency());
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    BuildOptions options;
    options.dems = {argv[1]};
    options.out = argc > 3 ? argv[3] : (std::filesystem::temp_directory_path() / "height_stage_bench.scree").string();
    BuildPlan plan = must(plan_build(options));
    if (!plan.heights_in_place) {
        fmt::print(stderr, "{}: is resampled\n", argv[1]);
        return 1;
    }
    const Lattice lattice = plan.mosaic.base_lattice();
    auto writer = must(SqliteStoreWriter::create(options.out));

    const Clock all;
    auto spool = must(
        HeightSpool::create(options.out + ".heights", lattice.cells_x + 1, lattice.cells_y + 1, plan.wide_heights));
    auto dem = must(open_heights(argv[1], plan.open));
    SuspectValues suspects(dem->info(), options);
    must(spool_rows(*dem, VoidRule(dem->info(), options), suspects, *spool, [](std::int64_t) { return true; }));
    const double decoder_s = decoder_usage().cpu_seconds;
    report("decode", all, decoder_s);
    const HeightSpool::Summary summary = must(spool->finish());
    const HeightUnits units = units_of(dem->info(), plan.mosaic.heights.front().where, options);
    FillRule rule = options.fill;
    rule.integer = plan.integer_heights;
    must(fill_interior_voids(*spool, rule, options.memory_bytes / 8, [] { return true; }));
    const HeightQuantizer quantizer =
        must(choose_quantizer({plan.integer_heights, units.scale, units.offset_m, options.height_quantum_m,
                               summary.min_raw, summary.max_raw}));
    const Clock tiles;
    HeightPyramidResult heights;
    {
        TileWriter rows(*writer);
        HeightPyramidJob job;
        job.spool = spool.get();
        job.writer = &rows;
        job.lattice = lattice;
        job.quantizer = quantizer;
        heights = must(build_height_pyramid(job));
        must(rows.checkpoint("{}"));
    }
    report("tiles", tiles);
    writer.reset();
    report("all", all, decoder_s);
    fmt::print("decoder {:.2f}; of the rest: decode {:.2f} store {:.2f} error {:.2f} encode {:.2f} CPU s\n", decoder_s,
               StageClock::seconds(Stage::decode), StageClock::seconds(Stage::store), StageClock::seconds(Stage::error),
               StageClock::seconds(Stage::encode));
    fmt::print("{} tiles, {:.1f} MB, peak {:.0f} MiB\n", heights.tile_count,
               static_cast<double>(std::filesystem::file_size(options.out)) / 1e6,
               static_cast<double>(process_usage().peak_rss_bytes) / 1048576);
    std::filesystem::remove(options.out);
}
