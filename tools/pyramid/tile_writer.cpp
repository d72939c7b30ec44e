#include "tools/pyramid/tile_writer.h"

#include <utility>

#include "tools/stage_clock.h"

namespace scree {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{2} << 20;

}  // namespace

TileWriter::TileWriter(SqliteStoreWriter& store) : store_(store), thread_([this] { run(); }) {}

TileWriter::~TileWriter() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    to_writer_.notify_one();
    thread_.join();
}

void TileWriter::run() {
    std::deque<Row> taken;
    for (;;) {
        {
            std::unique_lock lock(mutex_);
            writing_ = false;
            from_writer_.notify_all();
            to_writer_.wait(lock, [&] { return done_ || !rows_.empty(); });
            if (rows_.empty() || !outcome_) return;
            taken.swap(rows_);
            writing_ = true;
        }
        Result<void> outcome;
        std::size_t bytes = 0;
        {
            const std::lock_guard lock(database_);
            const StageClock::Scope clock(Stage::store);
            for (const Row& row : taken) {
                if (outcome) outcome = store_.put(row.kind, row.key, row.codec, row.payload);
                bytes += row.payload.size();
            }
        }
        taken.clear();
        const std::lock_guard lock(mutex_);
        bytes_ -= bytes;
        if (!outcome) outcome_ = outcome;
    }
}

Result<void> TileWriter::put(TileKind kind, std::int64_t key, int codec, std::vector<std::uint8_t> payload) {
    std::unique_lock lock(mutex_);
    from_writer_.wait(lock, [&] { return bytes_ <= kMaxBytes || !outcome_; });
    if (!outcome_) return outcome_;
    bytes_ += payload.size();
    rows_.push_back({kind, key, codec, std::move(payload)});
    to_writer_.notify_one();
    return {};
}

Result<void> TileWriter::flush() {
    std::unique_lock lock(mutex_);
    from_writer_.wait(lock, [&] { return (rows_.empty() && !writing_) || !outcome_; });
    return outcome_;
}

Result<void> TileWriter::checkpoint(const std::string& state) {
    if (auto ok = flush(); !ok) return ok;
    const std::lock_guard lock(database_);
    const StageClock::Scope clock(Stage::store);
    return store_.checkpoint(state);
}

Result<bool> TileWriter::read(TileKind kind, std::int64_t key, TileRow& row) {
    const std::lock_guard lock(database_);
    return store_.read(kind, key, row);
}

}  // namespace scree
