#include "tools/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/store/sqlite_store.h"
#include "tools/verify/problem_list.h"
#include "tools/verify/store_layout.h"
#include "tools/verify/tile_walk.h"

namespace scree {
namespace {

// Shares of the whole in the progress shown: reading every page, every key, every tile.
constexpr double kLayoutShare = 0.1;
constexpr double kKeyShare = 0.02;

void compare_counts(const Dataset& dataset, const RowCounts& rows, ProblemList& problems) {
    if (rows.height != dataset.height_tiles)
        problems.add(fmt::format("dataset: {} height tiles, the table holds {}", dataset.height_tiles, rows.height));
    if (rows.texture != dataset.texture_tiles)
        problems.add(fmt::format("dataset: {} texture tiles, the table holds {}", dataset.texture_tiles, rows.texture));
}

Result<void> check_tiles(const SqliteStore& store, const VerifyOptions& options, VerifyReport& report,
                         ProblemList& problems) {
    const auto go_on = [&] { return options.stop == nullptr || !options.stop->load(std::memory_order_relaxed); };
    const auto show = [&](double fraction) {
        if (options.progress) options.progress(std::min(fraction, 1.0));
    };
    auto rows = check_keys(store, problems, go_on);
    if (!rows) return rows.error();
    compare_counts(store.dataset(), *rows, problems);
    show(kLayoutShare + kKeyShare);

    auto reader = store.open_reader();
    if (!reader) return reader.error();
    const auto total = static_cast<double>(std::max<std::int64_t>(1, rows->height + rows->texture));
    std::int64_t done = 0;
    TileWalk walk(store.dataset(), **reader, report, problems, [&] {
        ++done;
        show(kLayoutShare + kKeyShare + (1 - kLayoutShare - kKeyShare) * static_cast<double>(done) / total);
        return go_on();
    });
    if (auto ok = walk.run(); !ok) return ok;

    if (walk.height_rows() < rows->height)
        if (auto ok = name_unreached_rows(store, TileKind::height, problems, go_on); !ok) return ok;
    if (walk.texture_rows() < rows->texture)
        if (auto ok = name_unreached_rows(store, TileKind::texture, problems, go_on); !ok) return ok;
    const std::int64_t unread = rows->height + rows->texture - walk.height_rows() - walk.texture_rows();
    if (unread > 0) problems.add(fmt::format("{} rows were not checked: no sound tile leads to them", unread));
    return {};
}

GeoCheck check_lon_lat(const Dataset& d, ProblemList& problems) {
    GeoCheck check = check_geo_grid(d);
    if (check.broken)
        problems.add(fmt::format("dataset: longitudes and latitudes are off by {:.4f} m, {} m are stated",
                                 *check.error_m, d.geo_grid->error_m));
    return check;
}

}  // namespace

Result<VerifyReport> verify_store(const std::string& path, const VerifyOptions& options) {
    auto store = SqliteStore::open(path);
    if (!store) return store.error();
    VerifyReport report;
    ProblemList problems;
    report.lon_lat = check_lon_lat((*store)->dataset(), problems);
    auto readable = check_layout(path, problems);
    if (!readable) return readable.error();
    if (options.progress) options.progress(kLayoutShare);
    if (*readable) {
        auto ok = check_tiles(**store, options, report, problems);
        if (!ok && ok.error().code != ErrorCode::store)
            return Error{ok.error().code,
                         ok.error().code == ErrorCode::interrupted ? path + ": stopped" : ok.error().message};
        if (!ok) problems.add(ok.error().message);
    }
    if (options.progress) options.progress(1.0);
    report.problems = problems.take();
    return report;
}

}  // namespace scree
