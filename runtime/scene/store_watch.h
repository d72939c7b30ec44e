// StoreWatch: sees that a store was updated, and opens what it holds now, on a thread of its own, so that no frame
// waits for a disk or for a writer's lock.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/store/sqlite_store.h"
#include "runtime/paging/loader.h"
#include "runtime/view/edge_field.h"

namespace scree {

/// What is wanted of a store that is opened.
struct StoreReading {
    int readers = 1;
    std::int64_t edge_cells = 0;  ///< of an EdgeField at most; 0: none is wanted
};

/// A store as it was at one moment, with readers that were opened for it.
struct OpenedStore {
    std::shared_ptr<const SqliteStore> store;
    Loader::Readers readers;
    std::shared_ptr<const EdgeField> edge_field{};
};

/// Opens the store under `path`. Waits while another program commits. Errors: those of SqliteStore.
Result<OpenedStore> open_store(const std::string& path, const StoreOptions& options, const StoreReading& reading);

/// take() is for one thread, and never waits.
class StoreWatch {
public:
    /// Looks four times a second whether `store` has changed. What comes is opened with the same options.
    StoreWatch(std::shared_ptr<const SqliteStore> store, const StoreReading& reading);
    ~StoreWatch();
    StoreWatch(const StoreWatch&) = delete;
    StoreWatch& operator=(const StoreWatch&) = delete;

    /// What the store has become since the last call, once it could be opened.
    std::optional<OpenedStore> take();
    /// Why it cannot be opened just now, once for every cause; it is tried again.
    std::optional<std::string> take_trouble();

private:
    void run();
    void look();

    std::shared_ptr<const SqliteStore> latest_;  // of the thread
    const StoreReading reading_;
    std::mutex mutex_;
    std::condition_variable stop_;
    bool stopping_ = false;
    std::optional<OpenedStore> opened_;
    std::string last_trouble_;
    std::optional<std::string> trouble_;
    std::thread thread_;
};

}  // namespace scree
