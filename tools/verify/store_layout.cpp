#include "tools/verify/store_layout.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "common/store/page_checksum_vfs.h"
#include "common/store/seed_codec.h"

namespace scree {
namespace {

// Stores made before there were seeds lack the last.
constexpr std::array<std::string_view, 4> kTables{"height", "texture", "dataset", "seed"};
constexpr std::size_t kRequiredTables = 3;
constexpr int kPageBytes = 16384;
constexpr int kRowsBetweenAsking = 1024;

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close_v2)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

// A connection that trusts nothing in the file: no functions from its schema, no writes.
class Connection {
public:
    static Result<Connection> open(const std::string& path) {
        sqlite3* raw = nullptr;
        const int rc = sqlite3_open_v2(path.c_str(), &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
        Connection connection(path, Database(raw, sqlite3_close_v2));
        if (rc != SQLITE_OK) return connection.error(rc);
        sqlite3_busy_timeout(raw, 60000);  // somebody may be committing an update
        sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
        sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
        return connection;
    }

    /// Steps through a query; the visitor returns false to stop. Errors as `error` maps them.
    Result<void> query(const std::string& sql, const std::function<bool(sqlite3_stmt*)>& visit) {
        sqlite3_stmt* raw = nullptr;
        int rc = sqlite3_prepare_v2(db_.get(), sql.c_str(), -1, &raw, nullptr);
        const Statement statement(raw, sqlite3_finalize);
        if (rc != SQLITE_OK) return error(rc);
        while ((rc = sqlite3_step(raw)) == SQLITE_ROW)
            if (!visit(raw)) return {};
        if (rc != SQLITE_DONE) return error(rc);
        return {};
    }
    Result<std::int64_t> integer(const std::string& sql) {
        std::int64_t value = 0;
        auto ok = query(sql, [&](sqlite3_stmt* row) {
            value = sqlite3_column_int64(row, 0);
            return false;
        });
        if (!ok) return ok.error();
        return value;
    }

private:
    Connection(std::string path, Database db) : path_(std::move(path)), db_(std::move(db)) {}
    Error error(int rc) const {
        const int primary = rc & 0xFF;
        const bool from_outside = primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN || primary == SQLITE_NOMEM ||
                                  primary == SQLITE_BUSY || primary == SQLITE_LOCKED || primary == SQLITE_PERM;
        return {from_outside ? ErrorCode::io : ErrorCode::store,
                fmt::format("{}: {}", path_, db_ ? sqlite3_errmsg(db_.get()) : sqlite3_errstr(rc))};
    }
    std::string path_;
    Database db_;
};

std::string text_of(sqlite3_stmt* row, int column) {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
    return text == nullptr ? std::string() : std::string(text);
}

// An error of the store becomes a problem; any other is handed on.
Result<bool> sound(const Result<void>& result, ProblemList& problems) {
    if (result) return true;
    if (result.error().code != ErrorCode::store) return result.error();
    problems.add(result.error().message);
    return false;
}

Result<bool> check_schema(Connection& db, std::vector<std::string>& found, ProblemList& problems) {
    bool usable = true;
    auto listed = sound(db.query("SELECT type, name FROM sqlite_master ORDER BY name",
                                 [&](sqlite3_stmt* row) {
                                     const std::string type = text_of(row, 0), name = text_of(row, 1);
                                     bool known = false;
                                     for (const auto table : kTables)
                                         known = known || (type == "table" && name == table);
                                     if (known) {
                                         found.push_back(name);
                                     } else {
                                         problems.add(fmt::format("schema: unexpected {} '{}'", type, name));
                                     }
                                     return true;
                                 }),
                        problems);
    if (!listed || !*listed) return listed;
    const auto required = kTables.begin() + kRequiredTables;
    const auto there = std::count_if(kTables.begin(), required, [&](std::string_view table) {
        return std::find(found.begin(), found.end(), table) != found.end();
    });
    if (static_cast<std::size_t>(there) != kRequiredTables) {
        problems.add(fmt::format("schema: {} of the {} tables of a store", there, kRequiredTables));
        return false;
    }
    for (const auto& table : found) {
        std::string columns;
        auto read =
            sound(db.query(fmt::format("SELECT name, type, \"notnull\", pk FROM pragma_table_info('{}')", table),
                           [&](sqlite3_stmt* row) {
                               columns += fmt::format("{} {} {} {},", text_of(row, 0), text_of(row, 1),
                                                      sqlite3_column_int(row, 2), sqlite3_column_int(row, 3));
                               return true;
                           }),
                  problems);
        if (!read || !*read) return read;
        if (columns != "key INTEGER 0 1,codec INTEGER 1 0,checksum INTEGER 1 0,payload BLOB 1 0,") {
            problems.add(fmt::format("schema: table '{}' has other columns than key, codec, checksum, payload", table));
            usable = false;
        }
    }
    return usable;
}

Result<void> check_column_types(Connection& db, const std::vector<std::string>& tables, ProblemList& problems) {
    for (const auto& table : tables) {
        auto wrong =
            db.integer(fmt::format("SELECT count(*) FROM {} WHERE typeof(codec) <> 'integer' OR "
                                   "typeof(checksum) <> 'integer' OR typeof(payload) <> 'blob'",
                                   table));
        if (!wrong) return wrong.error();
        if (*wrong != 0) problems.add(fmt::format("{} rows of table '{}' hold values of other types", *wrong, table));
    }
    auto descriptions = db.integer("SELECT count(*) FROM dataset");
    if (!descriptions) return descriptions.error();
    if (*descriptions != 1) problems.add(fmt::format("table 'dataset' has {} rows instead of 1", *descriptions));
    auto codec = db.integer("SELECT codec FROM dataset WHERE key = 1");
    if (!codec) return codec.error();
    if (*codec != 0) problems.add(fmt::format("the dataset row has codec {} instead of 0", *codec));
    return {};
}

}  // namespace

Result<bool> check_layout(const std::string& path, ProblemList& problems) {
    std::int64_t pages = -1;
    auto scan = scan_page_checksums(path);
    if (!scan && scan.error().code != ErrorCode::store) return scan.error();
    if (!scan) {
        problems.add(scan.error().message);
    } else {
        pages = scan->pages;
        for (const std::int64_t page : scan->damaged) problems.add(fmt::format("page {} is damaged", page));
    }
    auto db = Connection::open(path);
    if (!db) return db.error();
    auto page_size = db->integer("PRAGMA page_size");
    auto page_count = db->integer("PRAGMA page_count");
    for (const auto* value : {&page_size, &page_count}) {
        if (*value) continue;
        if (value->error().code != ErrorCode::store) return value->error();
        problems.add(value->error().message);
        return false;
    }
    if (*page_size != kPageBytes) problems.add(fmt::format("pages of {} bytes instead of {}", *page_size, kPageBytes));
    if (pages >= 0 && pages != *page_count)
        problems.add(fmt::format("the file holds {} pages, its header says {}", pages, *page_count));
    std::vector<std::string> tables;
    auto usable = check_schema(*db, tables, problems);
    if (!usable || !*usable) return usable;

    bool walkable = true;
    auto ran = sound(db->query("PRAGMA integrity_check(20)",
                               [&](sqlite3_stmt* row) {
                                   const std::string text = text_of(row, 0);
                                   if (text == "ok") return true;
                                   problems.add("SQLite: " + text);
                                   walkable = false;
                                   return true;
                               }),
                     problems);
    if (!ran) return ran;
    // Full scans of a tree whose pages are entangled could take for ever; row by row (check_keys) they cannot.
    if (!*ran || !walkable) return true;
    auto types = sound(check_column_types(*db, tables, problems), problems);
    if (!types) return types;
    return true;
}

namespace {

using Tiles = std::unordered_set<TileId, TileIdHash>;

// The tiles of level `level` that have textures of level `below` under them; keys of a level follow each other.
Result<void> for_each_over(const SqliteStore& store, Connection& db, int level, int below,
                           const std::function<void(TileId id)>& visit) {
    const Lattice& l = store.dataset().lattice;
    const std::int64_t first = (std::int64_t{1} << (2 * below)) * l.root_rows * l.root_columns;
    return db.query(fmt::format("SELECT key FROM texture WHERE key BETWEEN {} AND {}", first, first + (first - 1)),
                    [&](sqlite3_stmt* row) {
                        const auto id = tile_from_key(l, sqlite3_column_int64(row, 0));
                        if (id) visit(ancestor_at(*id, level));
                        return true;
                    });
}

// Where textures go kSeedLevelsUp levels deeper than the coarsest of them there are seeds of that level, too.
Result<void> check_deep_seeds(const SqliteStore& store, Connection& db, const Tiles& deep_seeds,
                              ProblemList& problems) {
    const int level = store.dataset().least_texture_level();
    if (level + kSeedLevelsUp > store.dataset().texture_deepest_level) return {};
    Tiles wanting;
    auto ok = for_each_over(store, db, level, level + kSeedLevelsUp, [&](TileId id) {
        if (deep_seeds.count(id) == 0) wanting.insert(id);
    });
    if (!ok) return ok;
    for (const TileId id : wanting)
        problems.add(
            fmt::format("table 'seed': none for texture tile {}/{}/{}, under which there are {} levels and more",
                        id.level, id.x, id.y, kSeedLevelsUp));
    return {};
}

// As many of the districts' level as textures of it.
Result<void> check_seed_count(const SqliteStore& store, int level, std::int64_t seeds, const Tiles& deep_seeds,
                              ProblemList& problems) {
    auto db = Connection::open(store.path());
    if (!db) return db.error();
    auto tables = db->integer("SELECT count(*) FROM sqlite_master WHERE name = 'seed'");
    if (!tables) return tables.error();
    // A store that no update can go on from needs none.
    const std::vector<SourceRecord>& sources = store.dataset().sources;
    const bool for_updates =
        std::any_of(sources.begin(), sources.end(), [](const SourceRecord& s) { return s.box_m.has_value(); });
    if (*tables == 0 || (seeds == 0 && deep_seeds.empty() && !for_updates)) return {};
    if (level > 0) {
        std::int64_t textures = 0;
        if (auto ok = for_each_over(store, *db, level, level, [&](TileId) { ++textures; }); !ok) return ok;
        if (textures != seeds)
            problems.add(fmt::format("table 'seed': {} rows for {} textures of level {}", seeds, textures, level));
    }
    return store.dataset().coarsest_texture_level ? check_deep_seeds(store, *db, deep_seeds, problems) : Result<void>{};
}

// No tile leads to a seed, so that each is met here.
Result<void> check_seeds(const SqliteStore& store, ProblemList& problems, const std::function<bool()>& go_on) {
    const Dataset& dataset = store.dataset();
    const int coarsest = dataset.least_texture_level(), seed_level = coarsest - kSeedLevelsUp;
    const int size = dataset.texture_size();
    const auto row_bytes = static_cast<std::size_t>(size) * 4;
    std::vector<std::uint8_t> pixels(row_bytes * static_cast<std::size_t>(size));
    std::optional<std::int64_t> previous;
    std::int64_t count = 0, of_districts = 0;
    Tiles deep_seeds;
    auto ok = store.for_each(TileKind::seed, [&](const SqliteStore::RowView& row) {
        if (previous && row.key <= *previous) {
            problems.add(fmt::format("table 'seed': key {} follows key {}", row.key, *previous));
            return false;  // the tree of pages may have a cycle
        }
        previous = row.key;
        const auto id = tile_from_key(dataset.lattice, row.key);
        const bool deep = id && id->level == coarsest && dataset.coarsest_texture_level;
        if (deep)
            deep_seeds.insert(*id);
        else
            ++of_districts;
        if (!id)
            problems.add(fmt::format("table 'seed': {} is no key of this lattice", row.key));
        else if (!deep && id->level != seed_level)
            problems.add(fmt::format("seed {}/{}/{} is not of the seed level {}", id->level, id->x, id->y, seed_level));
        else if (!row.checksum_ok)
            problems.add(
                fmt::format("seed {}/{}/{}: checksum does not match: the row is damaged", id->level, id->x, id->y));
        else if (auto decoded = decode_seed(row.payload, row.codec, size, pixels.data(), row_bytes); !decoded)
            problems.add(fmt::format("seed {}/{}/{}: {}", id->level, id->x, id->y, decoded.error().message));
        return ++count % kRowsBetweenAsking != 0 || go_on();
    });
    auto read = sound(ok, problems);
    if (!read) return read.error();
    if (!*read || !go_on()) return {};
    return check_seed_count(store, seed_level, of_districts, deep_seeds, problems);
}

}  // namespace

Result<RowCounts> check_keys(const SqliteStore& store, ProblemList& problems, const std::function<bool()>& go_on) {
    auto db = Connection::open(store.path());
    if (!db) return db.error();
    const Dataset& dataset = store.dataset();
    RowCounts counts;
    bool stopped = false;
    const auto scan = [&](std::string_view table, int deepest_level, std::int64_t& count) -> Result<void> {
        std::optional<std::int64_t> previous;
        auto ok = db->query(fmt::format("SELECT key FROM {} ORDER BY key", table), [&](sqlite3_stmt* row) {
            const std::int64_t key = sqlite3_column_int64(row, 0);
            if (previous && key <= *previous) {
                problems.add(fmt::format("table '{}': key {} follows key {}", table, key, *previous));
                return false;  // the tree of pages may have a cycle
            }
            previous = key;
            ++count;
            const auto id = tile_from_key(dataset.lattice, key);
            if (!id)
                problems.add(fmt::format("table '{}': {} is no key of this lattice", table, key));
            else if (id->level > deepest_level)
                problems.add(fmt::format("{} tile {}/{}/{} lies below the deepest level {}", table, id->level, id->x,
                                         id->y, deepest_level));
            stopped = count % kRowsBetweenAsking == 0 && !go_on();
            return !stopped;
        });
        auto read = sound(ok, problems);
        if (!read) return read.error();
        return {};
    };
    if (auto ok = scan("height", dataset.lattice.deepest_level, counts.height); !ok) return ok.error();
    if (!stopped)
        if (auto ok = scan("texture", dataset.texture_deepest_level, counts.texture); !ok) return ok.error();
    if (!stopped)
        if (auto ok = check_seeds(store, problems, [&] { return !(stopped = !go_on()); }); !ok) return ok.error();
    if (stopped) return Error{ErrorCode::interrupted, store.path() + ": stopped"};
    return counts;
}

Result<void> name_unreached_rows(const SqliteStore& store, TileKind kind, ProblemList& problems,
                                 const std::function<bool()>& go_on) {
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    const Lattice& lattice = store.dataset().lattice;
    const char* name = kind == TileKind::height ? "height" : "texture";
    std::optional<Error> failure;
    std::optional<std::int64_t> previous;
    std::int64_t count = 0;
    TileRow row;
    // Present, missing, or (nullopt) damaged and already named by the walk.
    const auto read = [&](TileKind of_kind, TileId id) -> std::optional<bool> {
        auto found = (*reader)->read(of_kind, id, row);
        if (found) return *found;
        if (found.error().code != ErrorCode::store && !failure) failure = found.error();
        return std::nullopt;
    };
    // Textures may be deeper than the leaf over them.
    const auto has_heights = [&](TileId id) {
        TileId over = ancestor_at(id, std::min(id.level, lattice.deepest_level));
        for (;; over = parent_of(over)) {
            const auto height = read(TileKind::height, over);
            if (!height) return true;
            if (*height) return over == id || (!row.payload.empty() && (row.payload[0] & 15) == 0);
            if (over.level == 0) return false;
        }
    };
    auto ok = store.for_each(kind, [&](const SqliteStore::RowView& view) {
        if (previous && view.key <= *previous) return false;
        previous = view.key;
        const auto id = tile_from_key(lattice, view.key);
        if (!id) return true;
        const std::string tile = fmt::format("{} tile {}/{}/{}", name, id->level, id->x, id->y);
        if (!view.checksum_ok) problems.add(tile + ": checksum does not match: the row is damaged");
        if (id->level > 0) {
            const auto parent = read(kind, parent_of(*id));
            if (parent && !*parent)
                problems.add(tile + " is an orphan: its parent is not stored");
            else if (parent && (row.payload.empty() || (row.payload[0] >> quadrant_of(*id) & 1) == 0))
                problems.add(tile + " is an orphan: its parent does not know it");
        }
        if (kind == TileKind::texture && !has_heights(*id)) problems.add(tile + " has no height tile");
        if (++count % kRowsBetweenAsking == 0 && !go_on() && !failure)
            failure = Error{ErrorCode::interrupted, store.path() + ": stopped"};
        return !failure;
    });
    if (failure) return *failure;
    auto read_through = sound(ok, problems);
    if (!read_through) return read_through.error();
    return {};
}

}  // namespace scree
