#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

#include "common/store/page_checksum_vfs.h"
#include "common/store/sqlite_handle.h"
#include "common/store/sqlite_store.h"

namespace scree {
namespace {

constexpr int kPageBytes = 16384;
constexpr std::int64_t kDatasetKey = 1, kStateKey = 2;

// A build writes on from where it was; the operating system keeps what it reads again.
constexpr int kBuildCacheKiB = 8 << 10;
// An update's changed pages wait here for the commit. What goes beyond is written early, and readers wait from then on.
constexpr int kAmendCacheKiB = 256 << 10;
// Long enough for somebody's commit of a few tiles, short enough to be told that another is at work.
constexpr int kSecondWriterWaitMs = 1000;

Error not_resumable(const std::string& path, const std::string& why) {
    return {ErrorCode::store, fmt::format("{}: {}: there is no checkpoint to go on from", path, why)};
}

// The journal holds what pages were, and is on the disk before they are overwritten. EXTRA syncs the folder, too, when
// it has gone: with FULL a power loss could bring the journal back, and with it the state before the commit. Deleted
// pages are overwritten, for a page that was never written has no checksum.
Result<void> set_up(const std::string& path, sqlite3* db, int cache_KiB) {
    return execute(path, db,
                   fmt::format("PRAGMA journal_mode=DELETE; PRAGMA synchronous=EXTRA; PRAGMA temp_store=MEMORY; "
                               "PRAGMA mmap_size=0; PRAGMA cache_size=-{};",
                               cache_KiB));
}

Result<void> create_table(const std::string& path, sqlite3* db, const char* table) {
    return execute(path, db,
                   fmt::format("CREATE TABLE {}(key INTEGER PRIMARY KEY, codec INTEGER NOT NULL, checksum INTEGER NOT "
                               "NULL, payload BLOB NOT NULL)",
                               table));
}

// The file first: were its journal gone before it, a power loss between would leave half a transaction.
Result<void> discard_old(const std::string& path) {
    if (::truncate(path.c_str(), 0) != 0 && errno != ENOENT)
        return Error{ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno))};
    const std::string journal = path + "-journal";
    if (::unlink(journal.c_str()) != 0 && errno != ENOENT)
        return Error{ErrorCode::io, fmt::format("{}: {}", journal, std::strerror(errno))};
    return {};
}

Result<void> check_pages(const std::string& path) {
    auto scan = scan_page_checksums(path);
    if (!scan) return scan.error();
    if (!scan->damaged.empty())
        return Error{ErrorCode::store, fmt::format("{}: page {} is damaged", path, scan->damaged.front())};
    return {};
}

}  // namespace

struct SqliteStoreWriter::Impl {
    std::string path;
    Database db{nullptr, sqlite3_close_v2};
    std::vector<Statement> put, remove, read;  // by table number; after `db`, so that they end before it
    const char* begin = "BEGIN EXCLUSIVE";     // nobody has any business in a file that grows
    bool amending = false;
    bool in_transaction = false;
    std::string state;
    // SQLite rolls the whole transaction back on some errors, so that what came after one would stand alone.
    std::optional<Error> failure;

    Impl(std::string file, Database opened) : path(std::move(file)), db(std::move(opened)) {}

    Result<void> start() {
        if (in_transaction) return {};
        if (auto ok = execute(path, db.get(), begin); !ok) return ok;
        in_transaction = true;
        return {};
    }

    Result<void> prepare_statements() {
        for (const char* table : kTables) {
            const auto add = [&](std::vector<Statement>& to, const char* sql) -> Result<void> {
                auto statement = prepare(path, db.get(), fmt::format(fmt::runtime(sql), table));
                if (!statement) return statement.error();
                to.push_back(std::move(*statement));
                return {};
            };
            if (auto ok = add(put, "INSERT OR REPLACE INTO {} VALUES(?1, ?2, ?3, ?4)"); !ok) return ok;
            if (auto ok = add(remove, "DELETE FROM {} WHERE key = ?1"); !ok) return ok;
            if (auto ok = add(read, "SELECT codec, checksum, payload FROM {} WHERE key = ?1"); !ok) return ok;
        }
        return {};
    }

    Result<void> step(sqlite3_stmt* statement) {
        const int rc = sqlite3_step(statement);
        Result<void> ok;
        if (rc != SQLITE_DONE) ok = sqlite_error(path, db.get(), rc);
        sqlite3_reset(statement);
        return ok;
    }

    Result<void> put_row(int table, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
        if (auto ok = start(); !ok) return ok;
        sqlite3_stmt* statement = put[static_cast<std::size_t>(table)].get();
        sqlite3_bind_int64(statement, 1, key);
        sqlite3_bind_int(statement, 2, codec);
        sqlite3_bind_int64(statement, 3, static_cast<std::int64_t>(row_checksum(table, key, codec, payload)));
        // A null pointer would be bound as NULL.
        const void* data = payload.empty() ? "" : static_cast<const void*>(payload.data());
        if (const int rc = sqlite3_bind_blob64(statement, 4, data, payload.size(), SQLITE_STATIC); rc != SQLITE_OK)
            return sqlite_error(path, db.get(), rc);
        return step(statement);
    }
    Result<void> put_text(std::int64_t key, const std::string& text) {
        return put_row(kDatasetTable, key, 0, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    }

    Result<void> remove_row(int table, std::int64_t key) {
        if (auto ok = start(); !ok) return ok;
        sqlite3_stmt* statement = remove[static_cast<std::size_t>(table)].get();
        sqlite3_bind_int64(statement, 1, key);
        return step(statement);
    }

    Result<bool> read_row(int table, std::int64_t key, TileRow& row) {
        sqlite3_stmt* statement = read[static_cast<std::size_t>(table)].get();
        sqlite3_bind_int64(statement, 1, key);
        const auto found = [&]() -> Result<bool> {
            const int rc = sqlite3_step(statement);
            if (rc == SQLITE_DONE) return false;
            if (rc != SQLITE_ROW) return sqlite_error(path, db.get(), rc);
            const StoredRow stored = row_of(statement, table, key, 0);
            if (!stored.checksum_ok)
                return Error{ErrorCode::store, fmt::format("{}: row {} of table '{}' is damaged", path, key,
                                                           kTables[static_cast<std::size_t>(table)])};
            row.codec = stored.codec;
            row.payload.assign(stored.payload.begin(), stored.payload.end());
            return true;
        }();
        sqlite3_reset(statement);
        return found;
    }

    Result<void> commit() {
        if (auto ok = execute(path, db.get(), "COMMIT"); !ok) return ok;
        in_transaction = false;
        return {};
    }

    // Does `work` unless something has failed before.
    template <class Work>
    Result<void> unless_failed(const Work& work) {
        if (failure) return *failure;
        Result<void> ok = work();
        if (!ok) failure = ok.error();
        return ok;
    }
};

SqliteStoreWriter::SqliteStoreWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SqliteStoreWriter::~SqliteStoreWriter() = default;

Result<std::unique_ptr<SqliteStoreWriter>> SqliteStoreWriter::create(const std::string& path) {
    if (auto ok = discard_old(path); !ok) return ok.error();
    auto opened = open_writing(path, true);
    if (!opened) return opened.error();
    auto impl = std::make_unique<Impl>(path, std::move(*opened));
    sqlite3* db = impl->db.get();
    int reserved = kPageChecksumBytes;
    if (sqlite3_file_control(db, "main", SQLITE_FCNTL_RESERVE_BYTES, &reserved) != SQLITE_OK)
        return Error{ErrorCode::io, fmt::format("{}: SQLite did not reserve bytes for page checksums", path)};
    if (auto ok = execute(path, db, fmt::format("PRAGMA page_size={}", kPageBytes)); !ok) return ok.error();
    if (auto ok = set_up(path, db, kBuildCacheKiB); !ok) return ok.error();
    // In the transaction of the first checkpoint: before it the file is empty.
    if (auto ok = impl->start(); !ok) return ok.error();
    if (auto ok = execute(
            path, db, fmt::format("PRAGMA application_id={}; PRAGMA user_version={}", kApplicationId, kFormatVersion));
        !ok)
        return ok.error();
    for (const char* table : kTables)
        if (auto ok = create_table(path, db, table); !ok) return ok.error();
    if (auto ok = impl->prepare_statements(); !ok) return ok.error();
    return std::unique_ptr<SqliteStoreWriter>(new SqliteStoreWriter(std::move(impl)));
}

Result<std::unique_ptr<SqliteStoreWriter>> SqliteStoreWriter::resume(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return not_resumable(path, std::strerror(errno));
    if (auto ok = roll_back(path); !ok) return ok.error();
    if (::stat(path.c_str(), &status) != 0 || status.st_size == 0) return not_resumable(path, "is empty");
    if (auto ok = check_pages(path); !ok) return ok.error();
    auto opened = open_writing(path, false);
    if (!opened) return opened.error();
    auto impl = std::make_unique<Impl>(path, std::move(*opened));
    sqlite3* db = impl->db.get();
    if (auto ok = check_is_store(path, db); !ok) return ok.error();
    auto seeds = has_seeds(path, db);
    if (!seeds) return seeds.error();
    if (!*seeds) return not_resumable(path, "has no table of seeds");
    if (auto ok = set_up(path, db, kBuildCacheKiB); !ok) return ok.error();
    if (auto ok = impl->prepare_statements(); !ok) return ok.error();
    TileRow row;
    auto found = impl->read_row(kDatasetTable, kStateKey, row);
    if (!found) return found.error();
    if (!*found) return not_resumable(path, "is no unfinished store");
    impl->state.assign(row.payload.begin(), row.payload.end());
    return std::unique_ptr<SqliteStoreWriter>(new SqliteStoreWriter(std::move(impl)));
}

Result<std::unique_ptr<SqliteStoreWriter>> SqliteStoreWriter::amend(const std::string& path) {
    if (auto store = SqliteStore::open(path); !store) return store.error();
    auto opened = open_writing(path, false);
    if (!opened) return opened.error();
    auto impl = std::make_unique<Impl>(path, std::move(*opened));
    sqlite3* db = impl->db.get();
    impl->amending = true;
    impl->begin = "BEGIN IMMEDIATE";  // keeps other writers out, and lets readers in until the commit
    if (auto ok = set_up(path, db, kAmendCacheKiB); !ok) return ok.error();
    sqlite3_busy_timeout(db, kSecondWriterWaitMs);
    if (auto ok = impl->start(); !ok) {
        if ((sqlite3_extended_errcode(db) & 0xFF) != SQLITE_BUSY) return ok.error();
        return Error{ErrorCode::usage, fmt::format("{}: another program is changing it", path)};
    }
    sqlite3_busy_timeout(db, kWriterWaitMs);
    // What was true before the lock may not be now.
    if (auto dataset = read_dataset(path, db); !dataset) return dataset.error();
    auto seeds = has_seeds(path, db);
    if (!seeds) return seeds.error();
    if (!*seeds)
        if (auto ok = create_table(path, db, kTables[kSeedTable]); !ok) return ok.error();
    if (auto ok = impl->prepare_statements(); !ok) return ok.error();
    return std::unique_ptr<SqliteStoreWriter>(new SqliteStoreWriter(std::move(impl)));
}

Result<void> SqliteStoreWriter::put(TileKind kind, std::int64_t key, int codec, std::span<const std::uint8_t> payload) {
    return impl_->unless_failed([&] { return impl_->put_row(static_cast<int>(kind), key, codec, payload); });
}

Result<void> SqliteStoreWriter::remove(TileKind kind, std::int64_t key) {
    return impl_->unless_failed([&] { return impl_->remove_row(static_cast<int>(kind), key); });
}

Result<bool> SqliteStoreWriter::read(TileKind kind, std::int64_t key, TileRow& row) const {
    if (impl_->failure) return *impl_->failure;
    return impl_->read_row(static_cast<int>(kind), key, row);
}

Result<void> SqliteStoreWriter::for_each_key(TileKind kind, const std::function<void(std::int64_t key)>& visit) const {
    if (impl_->failure) return *impl_->failure;
    const char* table = kTables[static_cast<std::size_t>(kind)];
    auto statement = prepare(impl_->path, impl_->db.get(), fmt::format("SELECT key FROM {} ORDER BY key", table));
    if (!statement) return statement.error();
    for (;;) {
        const int rc = sqlite3_step(statement->get());
        if (rc == SQLITE_DONE) return {};
        if (rc != SQLITE_ROW) return sqlite_error(impl_->path, impl_->db.get(), rc);
        visit(sqlite3_column_int64(statement->get(), 0));
    }
}

Result<void> SqliteStoreWriter::checkpoint(const std::string& state) {
    Impl& impl = *impl_;
    return impl.unless_failed([&]() -> Result<void> {
        if (impl.amending) return Error{ErrorCode::usage, fmt::format("{}: an update has no checkpoints", impl.path)};
        if (auto ok = impl.put_text(kStateKey, state); !ok) return ok;
        if (auto ok = impl.commit(); !ok) return ok;
        impl.state = state;
        return {};
    });
}

const std::string& SqliteStoreWriter::state() const { return impl_->state; }

Result<void> SqliteStoreWriter::finish(const Dataset& dataset) {
    Impl& impl = *impl_;
    auto ok = impl.unless_failed([&]() -> Result<void> {
        if (auto put = impl.put_text(kDatasetKey, dataset_to_json(dataset)); !put) return put;
        if (auto removed = impl.remove_row(kDatasetTable, kStateKey); !removed) return removed;
        return impl.commit();
    });
    if (!ok) return ok;
    impl.put.clear();
    impl.remove.clear();
    impl.read.clear();
    impl.db.reset();
    impl.failure = Error{ErrorCode::usage, fmt::format("{}: is finished", impl.path)};
    return {};
}

}  // namespace scree
