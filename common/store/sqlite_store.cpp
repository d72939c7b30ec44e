#include "common/store/sqlite_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/store/byte_io.h"
#include "common/store/page_checksum_vfs.h"

namespace scree {
namespace {

constexpr std::int32_t kApplicationId = 0x53637265;  // "Scre"
constexpr int kPageBytes = 16384;
constexpr int kRowsPerCommit = 4096;
constexpr int kDatasetTable = 2;
constexpr std::array<const char*, 3> kTables{"height", "texture", "dataset"};

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close_v2)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

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

Error sqlite_error(const std::string& path, sqlite3* db, int rc) {
    return {code_of(rc), fmt::format("{}: {}", path, db != nullptr ? sqlite3_errmsg(db) : sqlite3_errstr(rc))};
}

Result<Database> open_database(const std::string& path, int flags, const char* vfs) {
    sqlite3* raw = nullptr;
    const int rc = sqlite3_open_v2(path.c_str(), &raw, flags, vfs);
    Database db(raw, sqlite3_close_v2);
    if (rc != SQLITE_OK) return sqlite_error(path, raw, rc);
    sqlite3_busy_timeout(raw, 10000);
    return db;
}

Result<Statement> prepare(const std::string& path, sqlite3* db, const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    const int rc = sqlite3_prepare_v2(db, sql.c_str(), -1, &raw, nullptr);
    Statement statement(raw, sqlite3_finalize);
    if (rc != SQLITE_OK) return sqlite_error(path, db, rc);
    return statement;
}

Result<void> execute(const std::string& path, sqlite3* db, const char* sql) {
    const int rc = sqlite3_exec(db, sql, nullptr, nullptr, nullptr);
    if (rc != SQLITE_OK) return sqlite_error(path, db, rc);
    return {};
}

Result<std::int64_t> query_integer(const std::string& path, sqlite3* db, const std::string& sql) {
    auto statement = prepare(path, db, sql);
    if (!statement) return statement.error();
    const int rc = sqlite3_step(statement->get());
    if (rc != SQLITE_ROW) return sqlite_error(path, db, rc);
    return sqlite3_column_int64(statement->get(), 0);
}

Result<Database> open_reading(const std::string& path) {
    auto db = open_database(path, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
    if (!db) return db;
    // The schema is as hostile as the rest of the file until it has been checked.
    sqlite3_db_config(db->get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(db->get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    // Eight pages: rows are read in no order, and the operating system keeps the file.
    if (auto ok = execute(path, db->get(), "PRAGMA mmap_size=0; PRAGMA cache_size=-128;"); !ok) return ok.error();
    return db;
}

std::span<const std::uint8_t> blob_of(sqlite3_stmt* statement, int column) {
    const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement, column));
    const int size = sqlite3_column_bytes(statement, column);
    return {data, data == nullptr ? 0 : static_cast<std::size_t>(size)};
}

// A row of (key, codec, checksum, payload) with its types checked.
struct Row {
    int codec = 0;
    bool checksum_ok = false;
    std::span<const std::uint8_t> payload;
};
Row row_of(sqlite3_stmt* statement, int table, std::int64_t key, int first_column) {
    Row row;
    const std::int64_t codec = sqlite3_column_int64(statement, first_column);
    row.codec = codec >= 0 && codec <= 255 ? static_cast<int>(codec) : -1;
    const auto stored = static_cast<std::uint64_t>(sqlite3_column_int64(statement, first_column + 1));
    row.payload = blob_of(statement, first_column + 2);
    row.checksum_ok = stored == row_checksum(table, key, row.codec, row.payload);
    return row;
}

class SqliteTileReader final : public TileReader {
public:
    SqliteTileReader(std::string path, Lattice lattice, Database db, Statement height, Statement texture)
        : path_(std::move(path)),
          lattice_(lattice),
          db_(std::move(db)),
          statements_{std::move(height), std::move(texture)} {}

    Result<bool> read(TileKind kind, TileId id, TileRow& row) override {
        const auto key = tile_key(lattice_, id);
        if (!key) return false;
        const int table = static_cast<int>(kind);
        sqlite3_stmt* statement = statements_[static_cast<std::size_t>(table)].get();
        sqlite3_reset(statement);
        sqlite3_bind_int64(statement, 1, *key);
        const int rc = sqlite3_step(statement);
        if (rc == SQLITE_DONE) return false;
        if (rc != SQLITE_ROW) return sqlite_error(path_, db_.get(), rc);
        const Row read = row_of(statement, table, *key, 0);
        if (!read.checksum_ok) {
            sqlite3_reset(statement);
            return Error{ErrorCode::store, "checksum does not match: the row is damaged"};
        }
        row.codec = read.codec;
        row.payload.assign(read.payload.begin(), read.payload.end());
        sqlite3_reset(statement);
        return true;
    }

private:
    std::string path_;
    Lattice lattice_;
    Database db_;
    std::array<Statement, 2> statements_;
};

Result<Dataset> read_dataset(const std::string& path, sqlite3* db) {
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
    // A view under one of the names could hold any query.
    auto tables = query_integer(
        path, db,
        "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('dataset', 'height', 'texture')");
    if (!tables) return tables.error();
    if (*tables != 3) return Error{ErrorCode::store, fmt::format("{}: the tables of a store are missing", path)};
    auto statement = prepare(path, db, "SELECT codec, checksum, payload FROM dataset WHERE key = 1");
    if (!statement) return statement.error();
    if (sqlite3_step(statement->get()) != SQLITE_ROW)
        return Error{ErrorCode::store, fmt::format("{}: the store has no description: it was not completed", path)};
    const Row row = row_of(statement->get(), kDatasetTable, 1, 0);
    if (!row.checksum_ok) return Error{ErrorCode::store, fmt::format("{}: the dataset row is damaged", path)};
    auto dataset = dataset_from_json(std::string(row.payload.begin(), row.payload.end()));
    if (!dataset) return Error{dataset.error().code, path + ": " + dataset.error().message};
    return dataset;
}

}  // namespace

std::uint64_t row_checksum(int table, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
    std::uint64_t seed = static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15u;
    seed ^= static_cast<std::uint64_t>(table + 1) << 56 ^ static_cast<std::uint64_t>(codec + 1) << 48;
    return XXH3_64bits_withSeed(payload.data(), payload.size(), seed);
}

Result<std::unique_ptr<SqliteStore>> SqliteStore::open(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return Error{ErrorCode::input, fmt::format("{}: {}", path, std::strerror(errno))};
    if (!S_ISREG(status.st_mode)) return Error{ErrorCode::input, fmt::format("{}: is not a file", path)};
    auto db = open_reading(path);
    if (!db) return db.error();
    auto dataset = read_dataset(path, db->get());
    if (!dataset) return dataset.error();
    return std::unique_ptr<SqliteStore>(new SqliteStore(path, std::move(*dataset)));
}

SqliteStore::~SqliteStore() = default;

Result<std::unique_ptr<TileReader>> SqliteStore::open_reader() const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    auto height = prepare(path_, db->get(), "SELECT codec, checksum, payload FROM height WHERE key = ?1");
    if (!height) return height.error();
    auto texture = prepare(path_, db->get(), "SELECT codec, checksum, payload FROM texture WHERE key = ?1");
    if (!texture) return texture.error();
    return std::unique_ptr<TileReader>(std::make_unique<SqliteTileReader>(path_, dataset_.lattice, std::move(*db),
                                                                          std::move(*height), std::move(*texture)));
}

Result<void> SqliteStore::for_each(TileKind kind, const std::function<bool(const RowView&)>& visit) const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    const int table = static_cast<int>(kind);
    auto statement = prepare(path_, db->get(),
                             fmt::format("SELECT codec, checksum, payload, key FROM {} ORDER BY key",
                                         kTables[static_cast<std::size_t>(table)]));
    if (!statement) return statement.error();
    for (;;) {
        const int rc = sqlite3_step(statement->get());
        if (rc == SQLITE_DONE) return {};
        if (rc != SQLITE_ROW) return sqlite_error(path_, db->get(), rc);
        const std::int64_t key = sqlite3_column_int64(statement->get(), 3);
        const Row row = row_of(statement->get(), table, key, 0);
        if (!visit({key, row.codec, row.checksum_ok, row.payload})) return {};
    }
}

Result<SqliteStore::Contents> SqliteStore::contents() const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    Contents contents;
    const auto read = [&](const char* table, std::int64_t& rows, std::int64_t& bytes) -> Result<void> {
        auto statement =
            prepare(path_, db->get(), fmt::format("SELECT count(*), total(length(payload)) FROM {}", table));
        if (!statement) return statement.error();
        const int rc = sqlite3_step(statement->get());
        if (rc != SQLITE_ROW) return sqlite_error(path_, db->get(), rc);
        rows = sqlite3_column_int64(statement->get(), 0);
        bytes = static_cast<std::int64_t>(sqlite3_column_double(statement->get(), 1));
        return {};
    };
    if (auto ok = read("height", contents.height_rows, contents.height_bytes); !ok) return ok.error();
    if (auto ok = read("texture", contents.texture_rows, contents.texture_bytes); !ok) return ok.error();
    struct stat status {};
    if (::stat(path_.c_str(), &status) != 0)
        return Error{ErrorCode::io, fmt::format("{}: {}", path_, std::strerror(errno))};
    contents.file_bytes = status.st_size;
    return contents;
}

Result<std::string> SqliteStore::integrity_problems() const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    auto statement = prepare(path_, db->get(), "PRAGMA integrity_check(20)");
    if (!statement) return statement.error();
    std::string problems;
    for (;;) {
        const int rc = sqlite3_step(statement->get());
        if (rc == SQLITE_DONE) break;
        if (rc != SQLITE_ROW) return sqlite_error(path_, db->get(), rc);
        const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement->get(), 0));
        if (text != nullptr && std::strcmp(text, "ok") != 0)
            problems += std::string(problems.empty() ? "" : "; ") + text;
    }
    return problems;
}

Result<std::string> SqliteStore::digest() const {
    const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
    if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1)
        return Error{ErrorCode::io, "SHA-256 is not available"};
    std::vector<std::uint8_t> head;
    const auto add = [&](int table, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
        head.clear();
        ByteWriter out(head);
        out.u8(static_cast<std::uint8_t>(table));
        out.u32(static_cast<std::uint32_t>(key));
        out.u32(static_cast<std::uint32_t>(static_cast<std::uint64_t>(key) >> 32));
        out.u8(static_cast<std::uint8_t>(codec));
        out.u32(static_cast<std::uint32_t>(payload.size()));
        EVP_DigestUpdate(context.get(), head.data(), head.size());
        EVP_DigestUpdate(context.get(), payload.data(), payload.size());
    };
    const std::string description = dataset_to_json(dataset_);
    add(kDatasetTable, 1, 0, {reinterpret_cast<const std::uint8_t*>(description.data()), description.size()});
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        bool damaged = false;
        auto ok = for_each(kind, [&](const RowView& row) {
            damaged = damaged || !row.checksum_ok;
            add(static_cast<int>(kind), row.key, row.codec, row.payload);
            return !damaged;
        });
        if (!ok) return ok.error();
        if (damaged)
            return Error{ErrorCode::store,
                         fmt::format("{}: a row is damaged, so there is no digest; run scree verify", path_)};
    }
    std::array<unsigned char, 32> hash{};
    unsigned size = 0;
    EVP_DigestFinal_ex(context.get(), hash.data(), &size);
    std::string text;
    for (unsigned char byte : hash) text += fmt::format("{:02x}", byte);
    return text;
}

struct SqliteStoreWriter::Impl {
    std::string path;
    Database db{nullptr, sqlite3_close_v2};
    std::vector<Statement> insert;
    int rows_in_transaction = 0;
};

SqliteStoreWriter::SqliteStoreWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SqliteStoreWriter::~SqliteStoreWriter() = default;

Result<std::unique_ptr<SqliteStoreWriter>> SqliteStoreWriter::create(const std::string& path) {
    if (auto ok = register_page_checksum_vfs(); !ok) return ok.error();
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    auto db = open_database(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, kPageChecksumVfs);
    if (!db) return db.error();
    impl->db = std::move(*db);
    int reserved = kPageChecksumBytes;
    if (sqlite3_file_control(impl->db.get(), "main", SQLITE_FCNTL_RESERVE_BYTES, &reserved) != SQLITE_OK)
        return Error{ErrorCode::io, fmt::format("{}: SQLite did not reserve bytes for page checksums", path)};
    // The file has a temporary name until it is complete: a journal would protect nothing. finish() syncs.
    const std::string setup = fmt::format(
        "PRAGMA page_size={}; PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA locking_mode=EXCLUSIVE;"
        "PRAGMA cache_size=-8192; PRAGMA application_id={}; PRAGMA user_version={};",
        kPageBytes, kApplicationId, kFormatVersion);
    if (auto ok = execute(path, impl->db.get(), setup.c_str()); !ok) return ok.error();
    for (const char* table : kTables) {
        const std::string sql = fmt::format(
            "CREATE TABLE {}(key INTEGER PRIMARY KEY, codec INTEGER NOT NULL, checksum INTEGER NOT NULL, payload BLOB "
            "NOT NULL)",
            table);
        if (auto ok = execute(path, impl->db.get(), sql.c_str()); !ok) return ok.error();
    }
    for (const char* table : kTables) {
        auto statement = prepare(path, impl->db.get(), fmt::format("INSERT INTO {} VALUES(?1, ?2, ?3, ?4)", table));
        if (!statement) return statement.error();
        impl->insert.push_back(std::move(*statement));
    }
    return std::unique_ptr<SqliteStoreWriter>(new SqliteStoreWriter(std::move(impl)));
}

namespace {

Result<void> insert_row(const std::string& path, sqlite3* db, sqlite3_stmt* statement, int table, std::int64_t key,
                        int codec, std::span<const std::uint8_t> payload) {
    sqlite3_reset(statement);
    sqlite3_bind_int64(statement, 1, key);
    sqlite3_bind_int(statement, 2, codec);
    sqlite3_bind_int64(statement, 3, static_cast<std::int64_t>(row_checksum(table, key, codec, payload)));
    sqlite3_bind_blob64(statement, 4, payload.data(), payload.size(), SQLITE_STATIC);
    const int rc = sqlite3_step(statement);
    sqlite3_reset(statement);
    if (rc != SQLITE_DONE) return sqlite_error(path, db, rc);
    return {};
}

}  // namespace

Result<void> SqliteStoreWriter::put(TileKind kind, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
    Impl& impl = *impl_;
    if (impl.rows_in_transaction == 0)
        if (auto ok = execute(impl.path, impl.db.get(), "BEGIN"); !ok) return ok;
    const int table = static_cast<int>(kind);
    if (auto ok = insert_row(impl.path, impl.db.get(), impl.insert[static_cast<std::size_t>(table)].get(), table, key,
                             codec, payload);
        !ok)
        return ok;
    if (++impl.rows_in_transaction < kRowsPerCommit) return {};
    impl.rows_in_transaction = 0;
    return execute(impl.path, impl.db.get(), "COMMIT");
}

Result<void> SqliteStoreWriter::finish(const Dataset& dataset) {
    Impl& impl = *impl_;
    if (impl.rows_in_transaction == 0)
        if (auto ok = execute(impl.path, impl.db.get(), "BEGIN"); !ok) return ok;
    const std::string description = dataset_to_json(dataset);
    if (auto ok = insert_row(impl.path, impl.db.get(), impl.insert[kDatasetTable].get(), kDatasetTable, 1, 0,
                             {reinterpret_cast<const std::uint8_t*>(description.data()), description.size()});
        !ok)
        return ok;
    if (auto ok = execute(impl.path, impl.db.get(), "COMMIT"); !ok) return ok;
    impl.insert.clear();
    impl.db.reset();
    const int fd = ::open(impl.path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0 || ::fsync(fd) != 0) {
        const Error error{ErrorCode::io, fmt::format("{}: {}", impl.path, std::strerror(errno))};
        if (fd >= 0) ::close(fd);
        return error;
    }
    ::close(fd);
    return {};
}

}  // namespace scree
