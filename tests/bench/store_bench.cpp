// What writing and reading a store's rows costs, by the rows of a real one: scree_store_bench STORE.scree COPY.scree
// [CHECKPOINTS]. The copy is written in the order of a build (bands from north to south, a level's band once its
// children's are there) with so many checkpoints, then read in random order.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>
#include <tuple>
#include <vector>

#include "common/store/sqlite_store.h"

namespace {

using scree::SqliteStore;
using scree::SqliteStoreWriter;
using scree::TileId;
using scree::TileKind;

struct Row {
    TileKind kind;
    TileId id;
    std::int64_t key;
    int codec;
    std::vector<std::uint8_t> payload;
};

struct Clock {
    std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
    double cpu = cpu_now();
    static double cpu_now() {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        const auto seconds = [](const timeval& t) {
            return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
        };
        return seconds(usage.ru_utime) + seconds(usage.ru_stime);
    }
    void report(const char* what, std::size_t rows) const {
        const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
        const double cpu_s = cpu_now() - cpu, n = static_cast<double>(rows);
        fmt::print("{:<28} {:>7} rows  {:6.1f} us CPU  {:6.1f} us wall a row\n", what, rows, cpu_s * 1e6 / n,
                   wall_s * 1e6 / n);
    }
};

std::vector<Row> rows_of(const SqliteStore& store) {
    std::vector<Row> rows;
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        auto ok = store.for_each(kind, [&](const SqliteStore::RowView& view) {
            const auto id = scree::tile_from_key(store.dataset().lattice, view.key);
            if (id) rows.push_back({kind, *id, view.key, view.codec, {view.payload.begin(), view.payload.end()}});
            return true;
        });
        if (!ok) std::exit(static_cast<int>(ok.error().code));
    }
    const auto place = [&](const Row& row) {
        const int deepest = row.kind == TileKind::height ? store.dataset().lattice.deepest_level
                                                         : store.dataset().texture_deepest_level;
        const std::int64_t southern_edge = (row.id.y + 1) << (deepest - row.id.level);
        return std::tuple(static_cast<int>(row.kind), southern_edge, -row.id.level, row.id.x);
    };
    std::sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) { return place(a) < place(b); });
    return rows;
}

int fail(const scree::Error& error) {
    fmt::print(stderr, "{}\n", error.message);
    return static_cast<int>(error.code);
}

int write(const std::string& path, const std::vector<Row>& rows, const scree::Dataset& dataset, int checkpoints) {
    const Clock clock;
    auto writer = SqliteStoreWriter::create(path);
    if (!writer) return fail(writer.error());
    const std::size_t between = rows.size() / static_cast<std::size_t>(checkpoints + 1) + 1;
    for (std::size_t k = 0; k < rows.size(); ++k) {
        if (auto ok = (*writer)->put(rows[k].kind, rows[k].key, rows[k].codec, rows[k].payload); !ok)
            return fail(ok.error());
#ifndef NO_CHECKPOINT
        if ((k + 1) % between == 0)
            if (auto ok = (*writer)->checkpoint("bench"); !ok) return fail(ok.error());
#else
        (void)between;
#endif
    }
    if (auto ok = (*writer)->finish(dataset); !ok) return fail(ok.error());
    clock.report("write", rows.size());
    return 0;
}

int read(const SqliteStore& store, const std::vector<Row>& rows, TileKind kind) {
    auto reader = store.open_reader();
    if (!reader) return fail(reader.error());
    const Clock clock;
    scree::TileRow row;
    std::size_t count = 0;
    for (const Row& wanted : rows) {
        if (wanted.kind != kind) continue;
        auto found = (*reader)->read(kind, wanted.id, row);
        if (!found) return fail(found.error());
        ++count;
    }
    clock.report(kind == TileKind::height ? "read heights, any order" : "read textures, any order", count);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) return 2;
    auto source = SqliteStore::open(argv[1]);
    if (!source) return fail(source.error());
    auto rows = rows_of(**source);
    std::int64_t payloads = 0;
    for (const Row& row : rows) payloads += static_cast<std::int64_t>(row.payload.size());
    if (const int code = write(argv[2], rows, (*source)->dataset(), argc > 3 ? std::atoi(argv[3]) : 0); code != 0)
        return code;
    auto copy = SqliteStore::open(argv[2]);
    if (!copy) return fail(copy.error());
    const auto contents = (*copy)->contents();
    if (!contents) return fail(contents.error());
    fmt::print("{} bytes of payload, {} of file: {:.1f} % over\n", payloads, contents->file_bytes,
               100.0 * (static_cast<double>(contents->file_bytes) / static_cast<double>(payloads) - 1));
    std::shuffle(rows.begin(), rows.end(), std::mt19937_64(1));
    for (const TileKind kind : {TileKind::height, TileKind::texture})
        if (const int code = read(**copy, rows, kind); code != 0) return code;
    return 0;
}
