#include "common/store/sqlite_store.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/store/byte_io.h"
#include "common/store/sqlite_handle.h"

namespace scree {
namespace {

using Statements = std::array<Statement, kTables.size()>;

class SqliteTileReader final : public TileReader {
public:
    SqliteTileReader(std::string path, Lattice lattice, Database db, Statements statements)
        : path_(std::move(path)), lattice_(lattice), db_(std::move(db)), statements_(std::move(statements)) {}

    Result<bool> read(TileKind kind, TileId id, TileRow& row) override {
        const auto key = tile_key(lattice_, id);
        const int table = static_cast<int>(kind);
        sqlite3_stmt* statement = statements_[static_cast<std::size_t>(table)].get();
        if (!key || statement == nullptr) return false;
        auto found = read_once(statement, table, *key, row);
        // A program that died while it updated the store has left this connection nothing it may read.
        const bool cut_off = !found && sqlite3_extended_errcode(db_.get()) == SQLITE_READONLY_ROLLBACK;
        sqlite3_reset(statement);  // a reader at rest holds no lock
        if (!cut_off) return found;
        if (auto ok = roll_back(path_); !ok) return ok.error();
        found = read_once(statement, table, *key, row);
        sqlite3_reset(statement);
        return found;
    }

private:
    Result<bool> read_once(sqlite3_stmt* statement, int table, std::int64_t key, TileRow& row) {
        sqlite3_bind_int64(statement, 1, key);
        const int rc = sqlite3_step(statement);
        if (rc == SQLITE_DONE) return false;
        if (rc != SQLITE_ROW) return sqlite_error(path_, db_.get(), rc);
        const StoredRow read = row_of(statement, table, key, 0);
        if (!read.checksum_ok) return Error{ErrorCode::store, "checksum does not match: the row is damaged"};
        row.codec = read.codec;
        row.payload.assign(read.payload.begin(), read.payload.end());
        return true;
    }

    std::string path_;
    Lattice lattice_;
    Database db_;
    Statements statements_;
};

using Visit = std::function<bool(const SqliteStore::RowView&)>;

Result<void> visit_rows(const std::string& path, sqlite3* db, TileKind kind, const Visit& visit) {
    const int table = static_cast<int>(kind);
    if (table == kSeedTable) {
        auto stored = has_seeds(path, db);
        if (!stored) return stored.error();
        if (!*stored) return {};
    }
    auto statement = prepare(path, db,
                             fmt::format("SELECT codec, checksum, payload, key FROM {} ORDER BY key",
                                         kTables[static_cast<std::size_t>(table)]));
    if (!statement) return statement.error();
    for (;;) {
        const int rc = sqlite3_step(statement->get());
        if (rc == SQLITE_DONE) return {};
        if (rc != SQLITE_ROW) return sqlite_error(path, db, rc);
        const std::int64_t key = sqlite3_column_int64(statement->get(), 3);
        const StoredRow row = row_of(statement->get(), table, key, 0);
        if (!visit({key, row.codec, row.checksum_ok, row.payload})) return {};
    }
}

}  // namespace

std::uint64_t row_checksum(int table, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
    std::uint64_t seed = static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15u;
    seed ^= static_cast<std::uint64_t>(table + 1) << 56 ^ static_cast<std::uint64_t>(codec + 1) << 48;
    return XXH3_64bits_withSeed(payload.data(), payload.size(), seed);
}

Result<std::unique_ptr<SqliteStore>> SqliteStore::open(const std::string& path, const StoreOptions& options) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return Error{ErrorCode::input, fmt::format("{}: {}", path, std::strerror(errno))};
    if (!S_ISREG(status.st_mode)) return Error{ErrorCode::input, fmt::format("{}: is not a file", path)};
    auto db = open_reading(path);
    if (!db) return db.error();
    // After what opening may have rolled back, and before anything is read: a later change is then never missed.
    const auto file = identity_of(path);
    auto dataset = read_dataset(path, db->get());
    if (!dataset) return dataset.error();
    if (options.exaggeration != 1)
        if (auto ok = dataset->exaggerate(options.exaggeration); !ok)
            return Error{ok.error().code, fmt::format("{}: {}", path, ok.error().message)};
    return std::unique_ptr<SqliteStore>(new SqliteStore(path, options, std::move(*dataset), file));
}

SqliteStore::~SqliteStore() = default;

std::optional<SqliteStore::FileIdentity> SqliteStore::identity_of(const std::string& path) {
    struct stat s {};
    if (::stat(path.c_str(), &s) != 0) return std::nullopt;
    return FileIdentity{s.st_dev, s.st_ino, s.st_size, s.st_mtim.tv_sec, s.st_mtim.tv_nsec};
}

bool SqliteStore::has_changed() const { return identity_of(path_) != file_; }

bool SqliteStore::is_rewritten() const {
    const auto now = identity_of(path_);
    return now && file_ && now->device == file_->device && now->inode == file_->inode && *now != *file_;
}

Result<std::unique_ptr<TileReader>> SqliteStore::open_reader() const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    auto seeds = has_seeds(path_, db->get());
    if (!seeds) return seeds.error();
    Statements statements{Statement(nullptr, sqlite3_finalize), Statement(nullptr, sqlite3_finalize),
                          Statement(nullptr, sqlite3_finalize), Statement(nullptr, sqlite3_finalize)};
    for (const TileKind kind : kTileKinds) {
        if (kind == TileKind::seed && !*seeds) continue;
        const auto table = static_cast<std::size_t>(kind);
        auto statement = prepare(path_, db->get(),
                                 fmt::format("SELECT codec, checksum, payload FROM {} WHERE key = ?1", kTables[table]));
        if (!statement) return statement.error();
        statements[table] = std::move(*statement);
    }
    return std::unique_ptr<TileReader>(
        std::make_unique<SqliteTileReader>(path_, dataset_.lattice, std::move(*db), std::move(statements)));
}

Result<void> SqliteStore::for_each(TileKind kind, const std::function<bool(const RowView&)>& visit) const {
    auto db = open_reading(path_);
    if (!db) return db.error();
    return visit_rows(path_, db->get(), kind, visit);
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
    const Lattice& l = dataset_.lattice;
    for (int level = 0; level <= dataset_.texture_deepest_level; ++level) {
        const std::int64_t first = (std::int64_t{1} << (2 * level)) * l.root_rows * l.root_columns;
        auto rows = query_integer(
            path_, db->get(),
            fmt::format("SELECT count(*) FROM texture WHERE key BETWEEN {} AND {}", first, first + (first - 1)));
        if (!rows) return rows.error();
        contents.texture_rows_of_level.push_back(*rows);
    }
    auto seeds = has_seeds(path_, db->get());
    if (!seeds) return seeds.error();
    if (*seeds)
        if (auto ok = read("seed", contents.seed_rows, contents.seed_bytes); !ok) return ok.error();
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
    // One transaction: a store that is updated meanwhile has the old digest or the new one.
    auto db = open_reading(path_);
    if (!db) return db.error();
    if (auto ok = execute(path_, db->get(), "BEGIN"); !ok) return ok.error();
    auto dataset = read_dataset(path_, db->get());
    if (!dataset) return dataset.error();
    const std::string description = dataset_to_json(*dataset);
    add(kDatasetTable, 1, 0, {reinterpret_cast<const std::uint8_t*>(description.data()), description.size()});
    for (const TileKind kind : kTileKinds) {
        bool damaged = false;
        auto ok = visit_rows(path_, db->get(), kind, [&](const RowView& row) {
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

}  // namespace scree
