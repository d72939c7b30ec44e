// scree_paper_tables: reproduces the tables of Ueng & Chuang over a store, with what they leave out: what a frame errs.

#include <algorithm>
#include <filesystem>

#include "common/report.h"
#include "common/store/sqlite_store.h"
#include "experiments/paper/report.h"
#include "experiments/program.h"

namespace {

using namespace scree;

constexpr const char* kProgram = "scree_paper_tables";

struct Options {
    std::string store, out, name = "store", title = "A store", budget = "256M";
    int frames = 0;
    bool quick = false;
};

Result<void> run(const Options& o) {
    const auto budget = parse_bytes(o.budget);
    if (!budget) return Error{ErrorCode::usage, fmt::format("--budget {} is not a size such as 256M", o.budget)};
    auto store = SqliteStore::open(o.store);
    if (!store) return store.error();
    auto raster = read_height_raster(**store, *budget, BlockWorld::kBytesPerSample);
    if (!raster) return raster.error();
    paper::TableOptions options;
    options.quick = o.quick;
    options.frames = o.frames > 1 ? o.frames : o.quick ? 300 : 800;
    std::error_code error;
    std::filesystem::create_directories(o.out, error);
    if (error) return Error{ErrorCode::io, fmt::format("{}: {}", o.out, error.message())};
    auto rows = paper::make_tables(*raster, options, [](const paper::Row& row) {
        note("{}: {}, {} m a frame, {}, cache {}, tau {}, s {}\n", row.table, row.flight, row.step_m,
             paper::name_of(row.rules.metric), paper::name_of(row.rules), row.rules.tau_px, row.rules.s_px);
    });
    if (!rows) return rows.error();
    const std::int64_t stride = 33, columns = raster->columns / stride, lines = raster->rows / stride;
    const auto [lowest, highest] = std::minmax_element(raster->z.begin(), raster->z.end());
    const paper::Subject subject{o.name,
                                 o.title,
                                 raster->columns,
                                 raster->rows,
                                 raster->columns % stride,
                                 raster->rows % stride,
                                 raster->spacing_m,
                                 *lowest,
                                 *highest,
                                 2 * (columns * stride - 1) * (lines * stride - 1),
                                 options.frames};
    if (auto ok = paper::write_report(o.out, subject, *rows); !ok) return ok;
    for (const paper::Row& row : *rows)
        if (!row.keeps_promise())
            return Error{ErrorCode::check_failed,
                         fmt::format("{} on flight {}: an error of {} px where {} are promised",
                                     paper::name_of(row.rules.metric), row.flight, row.max_px(), row.promise_px())};
    return {};
}

int main_of(int argc, char** argv) {
    CLI::App app{"Reproduces the tables of Ueng & Chuang over a store of whole heights of one depth.", kProgram};
    Options o;
    app.add_option("--store", o.store, "The store")->required();
    app.add_option("--out", o.out, "Folder for tables, charts and the page; made when missing")->required();
    app.add_option("--name", o.name, "In file names")->capture_default_str();
    app.add_option("--title", o.title, "For people")->capture_default_str();
    app.add_option("--frames", o.frames, "Of each flight; 0: 800, or 300 with --quick")->capture_default_str();
    app.add_option("--budget", o.budget, "Ceiling of memory for the raster")->capture_default_str();
    app.add_flag("--quick", o.quick, "Fewer rows and frames, each timed once");
    if (const int code = parse_words(app, argc, argv); code >= 0) return code;
    if (auto ok = run(o); !ok) return report_error(kProgram, ok.error());
    return 0;
}

}  // namespace

int main(int argc, char** argv) { return scree::run_program(kProgram, argc, argv, main_of); }
