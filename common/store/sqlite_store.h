// A store in one SQLite file (docs/store-format.md): tables dataset, height, texture and seed of the same shape, a
// checksum a row, a checksum a page.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/store/tile_store.h"

namespace scree {

/// How a store is seen.
struct StoreOptions {
    /// Heights so many times as high, 0.01..100: those of the Dataset handed out and all that is made of it, errors and
    /// bounds included. Rows are as they are, for they count in quanta.
    double exaggeration = 1;
};

/// Opens read-only. A store whose last update was cut off is brought back first, which needs the right to write it and
/// its folder. Errors: ErrorCode::input missing or unreadable, ErrorCode::store not a store, damaged, or of another
/// format version (both are named), ErrorCode::io.
/// While another program commits an update, readers wait for it (a minute at most, then ErrorCode::io).
class SqliteStore final : public TileStore {
public:
    /// Errors: also ErrorCode::usage for an exaggeration that is out of range.
    static Result<std::unique_ptr<SqliteStore>> open(const std::string& path, const StoreOptions& options = {});
    ~SqliteStore() override;

    const Dataset& dataset() const override { return dataset_; }
    Result<std::unique_ptr<TileReader>> open_reader() const override;
    const std::string& path() const { return path_; }
    /// What it was opened with: opened so again it shows the same.
    const StoreOptions& open_options() const { return options_; }

    struct RowView {
        std::int64_t key = 0;
        int codec = 0;
        bool checksum_ok = false;
        std::span<const std::uint8_t> payload;  ///< valid during the call
    };
    /// Every row of a table in key order. The visitor returns false to stop.
    Result<void> for_each(TileKind kind, const std::function<bool(const RowView&)>& visit) const;

    struct Contents {
        std::int64_t height_rows = 0, texture_rows = 0, seed_rows = 0;
        std::int64_t height_bytes = 0, texture_bytes = 0, seed_bytes = 0;  ///< payloads
        std::int64_t file_bytes = 0;
        std::vector<std::int64_t> texture_rows_of_level;  ///< from level 0 to the textures' deepest
    };
    Result<Contents> contents() const;
    /// SQLite's own structural check; empty text when sound.
    Result<std::string> integrity_problems() const;
    /// SHA-256 over (table, key, codec, payload) of every row in key order, hexadecimal: of the file as it is now.
    Result<std::string> digest() const;
    /// The file under the path is no longer what was opened: updated in place, or replaced. Cheap: one stat().
    bool has_changed() const;
    /// Updated in place. A file that was moved away or replaced reads as ever through what was opened before. Cheap.
    bool is_rewritten() const override;

private:
    struct FileIdentity {
        std::uint64_t device = 0, inode = 0;
        std::int64_t bytes = 0, modified_s = 0, modified_ns = 0;
        bool operator==(const FileIdentity&) const = default;
    };
    static std::optional<FileIdentity> identity_of(const std::string& path);
    SqliteStore(std::string path, const StoreOptions& options, Dataset dataset, std::optional<FileIdentity> file)
        : path_(std::move(path)), options_(options), dataset_(std::move(dataset)), file_(file) {}
    std::string path_;
    StoreOptions options_;
    Dataset dataset_;
    std::optional<FileIdentity> file_;
};

/// Writes a store. Single thread. A build goes on under a temporary name until finish() returned ok; the caller
/// renames.
///
/// Crash safety: the file is at its last checkpoint() whatever happens at any write (SQLite's rollback journal,
/// synced).
class SqliteStoreWriter {
public:
    /// A new, empty file; an existing one is emptied.
    static Result<std::unique_ptr<SqliteStoreWriter>> create(const std::string& path);
    /// A file that was cut off, brought back to its last checkpoint; reads all of it once. Errors: ErrorCode::store
    /// where there is none to go back to (no file or an empty one, not ours, damaged pages, another format version, and
    /// a complete store, which SqliteStore::open takes).
    static Result<std::unique_ptr<SqliteStoreWriter>> resume(const std::string& path);
    /// A finished store, to be changed in one transaction that finish() commits; readers go on meanwhile and see all
    /// of it or nothing. They wait during the commit, and from the first put beyond 256 MiB of changed pages on; a
    /// reader that does not let go for 20 s makes it fail. Without finish() nothing changes, and there are no
    /// checkpoints. Errors: those of SqliteStore::open; ErrorCode::usage when another writer is changing it.
    static Result<std::unique_ptr<SqliteStoreWriter>> amend(const std::string& path);
    ~SqliteStoreWriter();
    SqliteStoreWriter(const SqliteStoreWriter&) = delete;
    SqliteStoreWriter& operator=(const SqliteStoreWriter&) = delete;

    /// Adds a row, or replaces the one of this key. Any order will do; subtree by subtree, and within one by key, fills
    /// pages best.
    Result<void> put(TileKind kind, std::int64_t key, int codec, std::span<const std::uint8_t> payload);
    Result<void> remove(TileKind kind, std::int64_t key);
    /// Reads a row, committed or not. False: there is none.
    Result<bool> read(TileKind kind, std::int64_t key, TileRow& row) const;
    /// Keys of a table, ascending.
    Result<void> for_each_key(TileKind kind, const std::function<void(std::int64_t key)>& visit) const;

    /// Makes everything so far durable, with a text that resume() hands back.
    Result<void> checkpoint(const std::string& state);
    /// Of the last checkpoint; empty before the first.
    const std::string& state() const;

    /// Writes the dataset row, drops the state, commits, syncs the file and closes it.
    Result<void> finish(const Dataset& dataset);

private:
    struct Impl;
    explicit SqliteStoreWriter(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// The checksum of a row: XXH3-64 over table number, key, codec and payload.
std::uint64_t row_checksum(int table, std::int64_t key, int codec, std::span<const std::uint8_t> payload);

}  // namespace scree
