#include "runtime/scene/store_watch.h"

#include <chrono>
#include <utility>

namespace scree {
namespace {

constexpr std::chrono::milliseconds kLook{250};

}  // namespace

Result<OpenedStore> open_store(const std::string& path, const StoreOptions& options, const StoreReading& reading) {
    auto store = SqliteStore::open(path, options);
    if (!store) return store.error();
    OpenedStore opened{std::move(*store), {}};
    for (int k = 0; k < reading.readers; ++k) {
        auto reader = opened.store->open_reader();
        if (!reader) return reader.error();
        opened.readers.push_back(std::move(*reader));
    }
    if (reading.edge_cells > 0)
        opened.edge_field =
            EdgeField::read(*opened.store, edge_band_m(opened.store->dataset().lattice), reading.edge_cells);
    return opened;
}

StoreWatch::StoreWatch(std::shared_ptr<const SqliteStore> store, const StoreReading& reading)
    : latest_(std::move(store)), reading_(reading), thread_([this] { run(); }) {}

StoreWatch::~StoreWatch() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    stop_.notify_all();
    thread_.join();
}

std::optional<OpenedStore> StoreWatch::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(opened_, std::nullopt);
}

std::optional<std::string> StoreWatch::take_trouble() {
    const std::lock_guard lock(mutex_);
    return std::exchange(trouble_, std::nullopt);
}

void StoreWatch::run() {
    std::unique_lock lock(mutex_);
    while (!stop_.wait_for(lock, kLook, [this] { return stopping_; })) {
        lock.unlock();
        look();
        lock.lock();
    }
}

void StoreWatch::look() {
    if (!latest_->has_changed()) return;
    auto opened = open_store(latest_->path(), latest_->open_options(), reading_);
    // Changed again meanwhile: the readers may see more than the store says. Next time, then.
    if (opened && opened->store->has_changed()) return;
    std::optional<OpenedStore> old;  // closed after the lock is gone
    const std::lock_guard lock(mutex_);
    if (!opened) {
        if (opened.error().message != last_trouble_) trouble_ = opened.error().message;
        last_trouble_ = opened.error().message;
        return;
    }
    last_trouble_.clear();
    latest_ = opened->store;
    old = std::exchange(opened_, std::move(*opened));
}

}  // namespace scree
