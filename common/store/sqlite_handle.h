// SQLite's handles with their ownership and errors, and the two ways of opening a store. For the files of this folder.
#pragma once

#include <sqlite3.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/dataset.h"
#include "common/result.h"

namespace scree {

inline constexpr std::int32_t kApplicationId = 0x53637265;  // "Scre"
/// By table number: heights, textures and seeds are those of TileKind. A store made before there were seeds has no
/// table 3.
inline constexpr std::array<const char*, 4> kTables{"height", "texture", "dataset", "seed"};
inline constexpr int kDatasetTable = 2, kSeedTable = 3;

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close_v2)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

/// ErrorCode::store for what is wrong in the file, ErrorCode::io for the rest. `rc` is an extended result code.
Error sqlite_error(const std::string& path, sqlite3* db, int rc);

Result<Statement> prepare(const std::string& path, sqlite3* db, const std::string& sql);
Result<void> execute(const std::string& path, sqlite3* db, const std::string& sql);
Result<std::int64_t> query_integer(const std::string& path, sqlite3* db, const std::string& sql);

/// A writer waits for readers, and readers for it: they the longer, so that it has given up, or has written what its
/// cache holds to a slow disk, before they do.
inline constexpr int kWriterWaitMs = 20000, kReaderWaitMs = 60000;

/// Read-only, as SQLite's own file layer has it. Rolls back first what a cut-off update left (roll_back).
Result<Database> open_reading(const std::string& path);
/// For writing, through the layer of page checksums; `create` an absent file. Errors: ErrorCode::io, too, where the
/// file may only be read.
Result<Database> open_writing(const std::string& path, bool create);
/// Rolls back a transaction that was cut off. Errors: ErrorCode::io where that is not permitted, and what to do.
Result<void> roll_back(const std::string& path);

/// Errors: ErrorCode::store for another kind of file, another format version (both are named), or missing tables.
Result<void> check_is_store(const std::string& path, sqlite3* db);
Result<bool> has_seeds(const std::string& path, sqlite3* db);
/// The description of a complete store. Errors: those of check_is_store; ErrorCode::store when there is none.
Result<Dataset> read_dataset(const std::string& path, sqlite3* db);

/// A row of (codec, checksum, payload) as it stands in the columns from `first_column` on.
struct StoredRow {
    int codec = 0;
    bool checksum_ok = false;
    std::span<const std::uint8_t> payload;  ///< until the statement moves on
};
StoredRow row_of(sqlite3_stmt* statement, int table, std::int64_t key, int first_column);

}  // namespace scree
