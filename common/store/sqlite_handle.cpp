#include "common/store/sqlite_handle.h"

#include <fmt/format.h>

#include "common/store/page_checksum_vfs.h"
#include "common/store/sqlite_store.h"

namespace scree {
namespace {

ErrorCode code_of(int rc) {
    switch (rc & 0xFF) {
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
        case SQLITE_ERROR:
        case SQLITE_FORMAT:
        case SQLITE_MISMATCH:
        case SQLITE_SCHEMA:
            return ErrorCode::store;
        default:
            return ErrorCode::io;
    }
}

Result<Database> open_database(const std::string& path, int flags, const char* vfs) {
    sqlite3* raw = nullptr;
    // One thread a connection: SQLite's own locking would be paid for nothing.
    const int rc = sqlite3_open_v2(path.c_str(), &raw, flags | SQLITE_OPEN_NOMUTEX, vfs);
    Database db(raw, sqlite3_close_v2);
    if (rc != SQLITE_OK) return sqlite_error(path, raw, rc);
    sqlite3_extended_result_codes(raw, 1);
    // The schema is as hostile as the rest of the file until it has been checked.
    sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    return db;
}

// SQLite opens a file before it looks into it; this makes it look.
Result<void> touch(const std::string& path, sqlite3* db) {
    auto version = query_integer(path, db, "PRAGMA schema_version");
    if (!version) return version.error();
    return {};
}

}  // namespace

Error sqlite_error(const std::string& path, sqlite3* db, int rc) {
    if ((rc & 0xFF) == SQLITE_BUSY)
        return {ErrorCode::io, fmt::format("{}: another program has kept it locked for too long", path)};
    const char* reason = db != nullptr ? sqlite3_errmsg(db) : sqlite3_errstr(rc);
    switch (rc & 0xFF) {
        case SQLITE_NOTADB:
            return {ErrorCode::store, fmt::format("{}: not a Scree store ({})", path, reason)};
        case SQLITE_CORRUPT:
            return {ErrorCode::store,
                    fmt::format("{}: damaged or cut short ({}); copy it anew or build it again", path, reason)};
        case SQLITE_FULL:
            return {ErrorCode::io, fmt::format("{}: no space left on its disk ({})", path, reason)};
        default:
            return {code_of(rc), fmt::format("{}: {}", path, reason)};
    }
}

Result<Statement> prepare(const std::string& path, sqlite3* db, const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    const int rc = sqlite3_prepare_v2(db, sql.c_str(), -1, &raw, nullptr);
    Statement statement(raw, sqlite3_finalize);
    if (rc != SQLITE_OK) return sqlite_error(path, db, rc);
    return statement;
}

Result<void> execute(const std::string& path, sqlite3* db, const std::string& sql) {
    const int rc = sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr);
    if (rc != SQLITE_OK) return sqlite_error(path, db, rc);
    return {};
}

Result<std::int64_t> query_integer(const std::string& path, sqlite3* db, const std::string& sql) {
    auto statement = prepare(path, db, sql);
    if (!statement) return statement.error();
    const int rc = sqlite3_step(statement->get());
    if (rc == SQLITE_DONE) return Error{ErrorCode::store, fmt::format("{}: SQLite has no answer to {}", path, sql)};
    if (rc != SQLITE_ROW) return sqlite_error(path, db, rc);
    return sqlite3_column_int64(statement->get(), 0);
}

Result<Database> open_reading(const std::string& path) {
    for (bool rolled_back = false;; rolled_back = true) {
        auto db = open_database(path, SQLITE_OPEN_READONLY, nullptr);
        if (!db) return db;
        sqlite3_busy_timeout(db->get(), kReaderWaitMs);
        auto ok = touch(path, db->get());
        // Eight pages: rows are read in no order, and the operating system keeps the file.
        if (ok) ok = execute(path, db->get(), "PRAGMA mmap_size=0; PRAGMA cache_size=-128;");
        if (ok) return db;
        if (rolled_back || sqlite3_extended_errcode(db->get()) != SQLITE_READONLY_ROLLBACK) return ok.error();
        db->reset();
        if (ok = roll_back(path); !ok) return ok.error();
    }
}

Result<Database> open_writing(const std::string& path, bool create) {
    if (auto ok = register_page_checksum_vfs(); !ok) return ok.error();
    auto db = open_database(path, SQLITE_OPEN_READWRITE | (create ? SQLITE_OPEN_CREATE : 0), kPageChecksumVfs);
    if (!db) return db;
    if (sqlite3_db_readonly(db->get(), "main") != 0)
        return Error{ErrorCode::io, fmt::format("{}: no right to write it", path)};
    sqlite3_busy_timeout(db->get(), kWriterWaitMs);
    return db;
}

Result<void> roll_back(const std::string& path) {
    auto db = open_writing(path, false);
    auto ok = db ? touch(path, db->get()) : Result<void>(db.error());
    if (ok) return {};
    return Error{ok.error().code,
                 fmt::format("{}; its last update was cut off, and {}-journal holds what it was before. Open it once "
                             "with the right to write it and its folder",
                             ok.error().message, path)};
}

Result<void> check_is_store(const std::string& path, sqlite3* db) {
    auto id = query_integer(path, db, "PRAGMA application_id");
    if (!id) return id.error();
    if (*id != kApplicationId)
        return Error{ErrorCode::store,
                     fmt::format("{}: a SQLite file, but not a Scree store (application id {})", path, *id)};
    auto version = query_integer(path, db, "PRAGMA user_version");
    if (!version) return version.error();
    if (*version != kFormatVersion)
        return Error{ErrorCode::store, fmt::format("{}: format version {}; this program reads version {}", path,
                                                   *version, kFormatVersion)};
    // A view under one of the names could hold any query, a virtual table run any module: neither has a root page.
    auto tables = query_integer(path, db,
                                "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND rootpage > 0 AND "
                                "name IN ('dataset', 'height', 'texture')");
    if (!tables) return tables.error();
    if (*tables != 3) return Error{ErrorCode::store, fmt::format("{}: the tables of a store are missing", path)};
    return {};
}

Result<bool> has_seeds(const std::string& path, sqlite3* db) {
    auto tables = query_integer(
        path, db, "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND rootpage > 0 AND name = 'seed'");
    if (!tables) return tables.error();
    return *tables != 0;
}

Result<Dataset> read_dataset(const std::string& path, sqlite3* db) {
    if (auto ok = check_is_store(path, db); !ok) return ok.error();
    auto statement = prepare(path, db, "SELECT codec, checksum, payload FROM dataset WHERE key = 1");
    if (!statement) return statement.error();
    const int rc = sqlite3_step(statement->get());
    if (rc == SQLITE_DONE)
        return Error{ErrorCode::store, fmt::format("{}: the store has no description: it was not completed", path)};
    if (rc != SQLITE_ROW) return sqlite_error(path, db, rc);
    const StoredRow row = row_of(statement->get(), kDatasetTable, 1, 0);
    if (!row.checksum_ok) return Error{ErrorCode::store, fmt::format("{}: the dataset row is damaged", path)};
    auto dataset = dataset_from_json(std::string(row.payload.begin(), row.payload.end()));
    if (!dataset) return Error{dataset.error().code, path + ": " + dataset.error().message};
    return dataset;
}

StoredRow row_of(sqlite3_stmt* statement, int table, std::int64_t key, int first_column) {
    StoredRow row;
    const std::int64_t codec = sqlite3_column_int64(statement, first_column);
    row.codec = codec >= 0 && codec <= 255 ? static_cast<int>(codec) : -1;
    const auto stored = static_cast<std::uint64_t>(sqlite3_column_int64(statement, first_column + 1));
    // In this order: asking for the blob decides its type, and its size goes with the type.
    const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement, first_column + 2));
    const int size = sqlite3_column_bytes(statement, first_column + 2);
    row.payload = {data, data == nullptr ? 0 : static_cast<std::size_t>(size)};
    row.checksum_ok = stored == row_checksum(table, key, row.codec, row.payload);
    return row;
}

}  // namespace scree
