// Rows on their way into a store: a thread of its own writes them, so that making tiles does not wait for the disk.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/store/sqlite_store.h"

namespace scree {

class TileWriter {
public:
    explicit TileWriter(SqliteStoreWriter& store);
    ~TileWriter();
    TileWriter(const TileWriter&) = delete;
    TileWriter& operator=(const TileWriter&) = delete;

    /// Takes a row; waits while 2 MiB are under way. An error is that of any row before. Any thread.
    Result<void> put(TileKind kind, std::int64_t key, int codec, std::vector<std::uint8_t> payload);
    /// Waits until every row is in the store.
    Result<void> flush();
    Result<void> checkpoint(const std::string& state);
    /// A row that has been flushed. Any thread.
    Result<bool> read(TileKind kind, std::int64_t key, TileRow& row);
    /// After flush(), while nothing is put.
    SqliteStoreWriter& store() { return store_; }

private:
    struct Row {
        TileKind kind = TileKind::height;
        std::int64_t key = 0;
        int codec = 0;
        std::vector<std::uint8_t> payload;
    };
    void run();

    SqliteStoreWriter& store_;
    std::mutex database_;  // held by whoever talks to the store
    std::mutex mutex_;     // guards what follows
    std::condition_variable to_writer_, from_writer_;
    std::deque<Row> rows_;
    std::size_t bytes_ = 0;
    bool writing_ = false, done_ = false;
    Result<void> outcome_;
    std::thread thread_;
};

}  // namespace scree
