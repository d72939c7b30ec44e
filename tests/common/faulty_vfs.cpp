#include "tests/common/faulty_vfs.h"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/common/test_support.h"

namespace scree::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

// What the disk holds of a file where that differs from what programs see.
struct Unsynced {
    std::map<std::int64_t, Bytes> sectors;  // as of the last sync; short or empty at and beyond the end of then
    std::int64_t durable_size = 0;
};

struct Ghost {  // a file that was deleted, and whose name may come back
    Bytes bytes;
    Unsynced unsynced;
};

// A name, and what it may lead to after a power loss: the file there now, one of those before, or none.
struct Name {
    std::optional<Unsynced> file;
    std::vector<Ghost> ghosts;
    bool may_be_absent = false;
};

struct FaultyFile {
    sqlite3_file base;
    FaultyVfs::Impl* disk;  // null: passed through
    std::string* path;
    bool new_journal;  // not synced yet
    int generation;
    sqlite3_file* inner() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

FaultyFile* self(sqlite3_file* f) { return reinterpret_cast<FaultyFile*>(f); }
sqlite3_file* inner(sqlite3_file* f) { return self(f)->inner(); }

std::int64_t size_of(sqlite3_file* f) {
    sqlite3_int64 size = 0;
    return inner(f)->pMethods->xFileSize(inner(f), &size) == SQLITE_OK ? size : 0;
}

}  // namespace

struct FaultyVfs::Impl {
    explicit Impl(std::uint64_t seed) : random(seed), sector_bytes(std::int64_t{512} << random() % 4) {}

    enum class Verdict { go_on, fail, run_full, cut };

    /// Counts an operation and says what becomes of it.
    Verdict next(bool takes_space) {
        ++count;
        if (!armed) return Verdict::go_on;
        const bool now = count == fault_at;
        const bool later = count > fault_at;
        hit = hit || now;
        switch (kind) {
            case FaultKind::io_error:
                return now ? Verdict::fail : Verdict::go_on;
            case FaultKind::io_errors:
                return now || later ? Verdict::fail : Verdict::go_on;
            case FaultKind::disk_full:
                return now ? Verdict::run_full : Verdict::go_on;
            case FaultKind::disk_stays_full:
                return now || (later && takes_space) ? Verdict::run_full : Verdict::go_on;
            case FaultKind::power_loss:
                return now ? Verdict::cut : Verdict::go_on;
        }
        return Verdict::go_on;
    }
    bool dead(sqlite3_file* f) const { return off || self(f)->generation != generation; }

    Name& name_of(const std::string& path) {
        auto [at, is_new] = names.try_emplace(path);
        std::error_code error;
        const auto size = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
        // Met for the first time: it is on the disk as it stands.
        if (is_new && !error) at->second.file = Unsynced{{}, size};
        return at->second;
    }
    Unsynced& file_of(sqlite3_file* f) {
        auto& file = name_of(*self(f)->path).file;
        if (!file) file = Unsynced{{}, size_of(f)};
        return *file;
    }

    void remember(sqlite3_file* f, std::int64_t from, std::int64_t to) {
        Unsynced& file = file_of(f);
        const std::int64_t size = size_of(f);
        for (std::int64_t sector = from / sector_bytes; sector * sector_bytes < to; ++sector) {
            auto [at, is_new] = file.sectors.try_emplace(sector);
            if (!is_new) continue;
            const std::int64_t start = sector * sector_bytes,
                               there = std::clamp<std::int64_t>(size - start, 0, sector_bytes);
            at->second.resize(static_cast<std::size_t>(there));
            if (there > 0) inner(f)->pMethods->xRead(inner(f), at->second.data(), static_cast<int>(there), start);
        }
    }

    int write(sqlite3_file* f, const void* buffer, int amount, std::int64_t offset) {
        const Verdict verdict = next(true);
        if (verdict == Verdict::fail) return SQLITE_IOERR_WRITE;
        if (verdict != Verdict::go_on)
            amount = static_cast<int>(std::min<std::int64_t>(
                amount, static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(amount / sector_bytes + 1)) *
                            sector_bytes));
        if (amount > 0) {
            remember(f, offset, offset + amount);
            const int rc = inner(f)->pMethods->xWrite(inner(f), buffer, amount, offset);
            if (rc != SQLITE_OK) return rc;
        }
        if (verdict == Verdict::run_full) return SQLITE_FULL;
        if (verdict == Verdict::cut) return cut(), SQLITE_IOERR_WRITE;
        return SQLITE_OK;
    }

    int truncate(sqlite3_file* f, std::int64_t size) {
        const Verdict verdict = next(false);
        if (verdict == Verdict::fail || verdict == Verdict::run_full) return SQLITE_IOERR_TRUNCATE;
        remember(f, size, std::max(size, size_of(f)));
        if (verdict == Verdict::cut && random() % 2 == 0) return cut(), SQLITE_IOERR_TRUNCATE;
        const int rc = inner(f)->pMethods->xTruncate(inner(f), size);
        if (verdict == Verdict::cut) return cut(), SQLITE_IOERR_TRUNCATE;
        return rc;
    }

    int sync(sqlite3_file* f) {
        const Verdict verdict = next(false);
        if (verdict == Verdict::fail || verdict == Verdict::run_full) return SQLITE_IOERR_FSYNC;
        if (verdict == Verdict::cut) return cut(), SQLITE_IOERR_FSYNC;
        file_of(f) = Unsynced{{}, size_of(f)};
        // SQLite's own layer syncs the folder with a journal's first sync, and with that alone.
        if (self(f)->new_journal) sync_folder(std::filesystem::path(*self(f)->path).parent_path());
        self(f)->new_journal = false;
        return SQLITE_OK;
    }

    void sync_folder(const std::filesystem::path& folder) {
        for (auto& [path, name] : names)
            if (std::filesystem::path(path).parent_path() == folder) {
                name.ghosts.clear();
                name.may_be_absent = false;
            }
    }

    int remove(sqlite3_vfs* base, const char* path, int sync_its_folder) {
        const Verdict verdict = next(false);
        if (verdict == Verdict::fail || verdict == Verdict::run_full) return SQLITE_IOERR_DELETE;
        if (verdict == Verdict::cut && random() % 2 == 0) return cut(), SQLITE_IOERR_DELETE;
        Name& name = name_of(path);
        if (name.file) name.ghosts.push_back({read_bytes(path), *name.file});
        name.file.reset();
        name.may_be_absent = true;
        const int rc = base->xDelete(base, path, 0);
        if (verdict == Verdict::cut) return cut(), SQLITE_IOERR_DELETE;
        if (rc == SQLITE_OK && sync_its_folder != 0) sync_folder(std::filesystem::path(path).parent_path());
        return rc;
    }

    /// Before the file is opened.
    int open(const char* path, int flags, bool& creates) {
        const Verdict verdict = next((flags & SQLITE_OPEN_CREATE) != 0);
        if (verdict == Verdict::cut) cut();
        if (verdict != Verdict::go_on) return SQLITE_CANTOPEN;
        Name& name = name_of(path);
        std::error_code error;
        const auto size = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
        creates = error && (flags & SQLITE_OPEN_CREATE) != 0;
        if (creates) {
            name.file = Unsynced{};
            name.may_be_absent = true;
        } else if (error) {
            name.file.reset();
        } else if (name.file && name.file->sectors.empty()) {
            name.file->durable_size = size;  // others may have emptied it meanwhile
        }
        return SQLITE_OK;
    }

    /// The power goes: decides what the disk holds.
    void cut() {
        off = true;
        for (auto& [path, name] : names) {
            // Somebody has renamed or removed it, which is not ours to undo.
            if (name.file && !std::filesystem::exists(path)) continue;
            const std::size_t choices = name.ghosts.size() + (name.file ? 1 : 0) + (name.may_be_absent ? 1 : 0);
            if (choices == 0) continue;
            std::size_t choice = random() % choices;
            if (name.file && choice-- == 0) {
                after[path] = image(*name.file, read_bytes(path));
            } else if (choice < name.ghosts.size()) {
                after[path] = image(name.ghosts[choice].unsynced, name.ghosts[choice].bytes);
            } else {
                after[path] = std::nullopt;
            }
        }
    }

    Bytes image(const Unsynced& file, const Bytes& now) {
        const auto new_size = static_cast<std::int64_t>(now.size());
        std::int64_t size = random() % 2 == 0 ? new_size : file.durable_size;
        if (random() % 4 == 0) {
            const auto [low, high] = std::minmax(new_size, file.durable_size);
            size = low +
                   static_cast<std::int64_t>(random() % static_cast<std::uint64_t>((high - low) / sector_bytes + 1)) *
                       sector_bytes;
        }
        Bytes result = now;
        result.resize(static_cast<std::size_t>(size));
        const int percent_old = uniform(random, 0, 4) * 25;
        for (const auto& [sector, old] : file.sectors) {
            const std::int64_t start = sector * sector_bytes, end = std::min(start + sector_bytes, size);
            if (start >= size) continue;
            const bool cut_off = start >= new_size;  // by truncating, which has not happened then
            const bool is_old = uniform(random, 0, 99) < percent_old || cut_off, garbage = random() % 2 == 0;
            for (std::int64_t at = start; at < end; ++at) {
                const auto k = static_cast<std::size_t>(at), in_sector = static_cast<std::size_t>(at - start);
                const bool written = is_old ? in_sector < old.size() : k < now.size();
                if (!written)
                    result[k] = garbage ? static_cast<std::uint8_t>(random()) : std::uint8_t{0};
                else if (is_old)
                    result[k] = old[in_sector];
            }
        }
        return result;
    }

    mutable std::mutex mutex;
    Random random;
    const std::int64_t sector_bytes;
    std::map<std::string, Name> names;
    std::map<std::string, std::optional<Bytes>> after;  // by path; absent: nullopt
    std::int64_t count = 0, fault_at = 0;
    FaultKind kind = FaultKind::io_error;
    bool armed = false, hit = false, off = false;
    int generation = 0;
};

namespace {

FaultyVfs::Impl* active = nullptr;
std::mutex active_mutex;

template <class Work>
int with_disk(sqlite3_file* f, int rc_when_dead, const Work& work) {
    FaultyVfs::Impl* disk = self(f)->disk;
    if (disk == nullptr) return work();
    const std::lock_guard lock(disk->mutex);
    return disk->dead(f) ? rc_when_dead : work();
}

int file_close(sqlite3_file* f) {
    delete self(f)->path;
    return inner(f)->pMethods->xClose(inner(f));
}
int file_read(sqlite3_file* f, void* buffer, int amount, sqlite3_int64 offset) {
    return with_disk(f, SQLITE_IOERR_READ, [&] { return inner(f)->pMethods->xRead(inner(f), buffer, amount, offset); });
}
int file_write(sqlite3_file* f, const void* buffer, int amount, sqlite3_int64 offset) {
    return with_disk(f, SQLITE_IOERR_WRITE, [&] {
        return self(f)->disk != nullptr ? self(f)->disk->write(f, buffer, amount, offset)
                                        : inner(f)->pMethods->xWrite(inner(f), buffer, amount, offset);
    });
}
int file_truncate(sqlite3_file* f, sqlite3_int64 size) {
    return with_disk(f, SQLITE_IOERR_TRUNCATE, [&] {
        return self(f)->disk != nullptr ? self(f)->disk->truncate(f, size)
                                        : inner(f)->pMethods->xTruncate(inner(f), size);
    });
}
int file_sync(sqlite3_file* f, int flags) {
    return with_disk(f, SQLITE_IOERR_FSYNC, [&] {
        return self(f)->disk != nullptr ? self(f)->disk->sync(f) : inner(f)->pMethods->xSync(inner(f), flags);
    });
}
int file_size(sqlite3_file* f, sqlite3_int64* size) {
    return with_disk(f, SQLITE_IOERR_FSTAT, [&] { return inner(f)->pMethods->xFileSize(inner(f), size); });
}
int file_lock(sqlite3_file* f, int lock) {
    return with_disk(f, SQLITE_IOERR_LOCK, [&] { return inner(f)->pMethods->xLock(inner(f), lock); });
}
int file_unlock(sqlite3_file* f, int lock) { return inner(f)->pMethods->xUnlock(inner(f), lock); }
int file_check_lock(sqlite3_file* f, int* out) {
    return with_disk(f, SQLITE_IOERR_CHECKRESERVEDLOCK,
                     [&] { return inner(f)->pMethods->xCheckReservedLock(inner(f), out); });
}
int file_control(sqlite3_file* f, int op, void* arg) { return inner(f)->pMethods->xFileControl(inner(f), op, arg); }
int file_sector_size(sqlite3_file* f) { return inner(f)->pMethods->xSectorSize(inner(f)); }
int file_characteristics(sqlite3_file* f) { return inner(f)->pMethods->xDeviceCharacteristics(inner(f)); }

// Version 1: no memory map, which would pass by all this.
const sqlite3_io_methods kMethods = {
    1,           file_close,      file_read,    file_write,       file_truncate,        file_sync, file_size, file_lock,
    file_unlock, file_check_lock, file_control, file_sector_size, file_characteristics, nullptr,   nullptr,   nullptr,
    nullptr,     nullptr,         nullptr};

sqlite3_vfs* base_vfs(sqlite3_vfs* v) { return static_cast<sqlite3_vfs*>(v->pAppData); }

int vfs_open(sqlite3_vfs* v, const char* name, sqlite3_file* f, int flags, int* out_flags) {
    FaultyFile* file = new (f) FaultyFile{};
    const auto open = [&] { return base_vfs(v)->xOpen(base_vfs(v), name, file->inner(), flags, out_flags); };
    const std::lock_guard active_lock(active_mutex);
    int rc = SQLITE_OK;
    if (active == nullptr || name == nullptr) {
        rc = open();
    } else {
        const std::lock_guard lock(active->mutex);
        bool creates = false;
        rc = active->off ? SQLITE_CANTOPEN : active->open(name, flags, creates);
        if (rc == SQLITE_OK) rc = open();
        file->disk = active;
        file->new_journal = creates && (flags & SQLITE_OPEN_MAIN_JOURNAL) != 0;
        file->generation = active->generation;
    }
    if (rc != SQLITE_OK) return rc;
    file->path = new std::string(name == nullptr ? "" : name);
    file->base.pMethods = &kMethods;
    return SQLITE_OK;
}

int vfs_delete(sqlite3_vfs* v, const char* name, int sync_folder) {
    const std::lock_guard active_lock(active_mutex);
    if (active == nullptr) return base_vfs(v)->xDelete(base_vfs(v), name, sync_folder);
    const std::lock_guard lock(active->mutex);
    return active->off ? SQLITE_IOERR_DELETE : active->remove(base_vfs(v), name, sync_folder);
}

int vfs_access(sqlite3_vfs* v, const char* name, int flags, int* out) {
    const std::lock_guard active_lock(active_mutex);
    if (active != nullptr) {
        const std::lock_guard lock(active->mutex);
        if (active->off) return SQLITE_IOERR_ACCESS;
    }
    return base_vfs(v)->xAccess(base_vfs(v), name, flags, out);
}

// As the default, and before anything else could ask for it: the layer of page checksums lies over what it finds first.
bool install() {
    sqlite3_vfs* base = sqlite3_vfs_find(nullptr);
    if (base == nullptr) std::abort();
    static sqlite3_vfs vfs;
    vfs = *base;
    vfs.pNext = nullptr;
    vfs.zName = "scree-faulty";
    vfs.pAppData = base;
    vfs.szOsFile = static_cast<int>(sizeof(FaultyFile)) + base->szOsFile;
    vfs.xOpen = vfs_open;
    vfs.xDelete = vfs_delete;
    vfs.xAccess = vfs_access;
    vfs.xFullPathname = [](sqlite3_vfs* v, const char* n, int c, char* o) {
        return base_vfs(v)->xFullPathname(base_vfs(v), n, c, o);
    };
    vfs.xRandomness = [](sqlite3_vfs* v, int n, char* o) { return base_vfs(v)->xRandomness(base_vfs(v), n, o); };
    vfs.xSleep = [](sqlite3_vfs* v, int us) { return base_vfs(v)->xSleep(base_vfs(v), us); };
    vfs.xCurrentTime = [](sqlite3_vfs* v, double* t) { return base_vfs(v)->xCurrentTime(base_vfs(v), t); };
    vfs.xCurrentTimeInt64 = [](sqlite3_vfs* v, sqlite3_int64* t) {
        return base_vfs(v)->xCurrentTimeInt64(base_vfs(v), t);
    };
    vfs.xGetLastError = [](sqlite3_vfs* v, int n, char* o) { return base_vfs(v)->xGetLastError(base_vfs(v), n, o); };
    if (sqlite3_vfs_register(&vfs, 1) != SQLITE_OK) std::abort();
    return true;
}
const bool installed = install();

}  // namespace

FaultyVfs::FaultyVfs(std::uint64_t seed) : impl_(std::make_unique<Impl>(seed)) {
    const std::lock_guard lock(active_mutex);
    if (!installed || active != nullptr) std::abort();
    active = impl_.get();
}

FaultyVfs::~FaultyVfs() {
    const std::lock_guard lock(active_mutex);
    active = nullptr;
}

void FaultyVfs::fail_at(std::int64_t k, FaultKind kind) {
    const std::lock_guard lock(impl_->mutex);
    impl_->count = 0;
    impl_->fault_at = k;
    impl_->kind = kind;
    impl_->armed = true;
    impl_->hit = false;
}

void FaultyVfs::fail_no_more() {
    const std::lock_guard lock(impl_->mutex);
    impl_->armed = false;
}

std::int64_t FaultyVfs::operations() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->count;
}

bool FaultyVfs::struck() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->hit;
}

void FaultyVfs::reboot() {
    const std::lock_guard lock(impl_->mutex);
    if (!impl_->off) impl_->cut();
    for (const auto& [path, bytes] : impl_->after) {
        std::error_code ignored;
        if (bytes)
            write_bytes(path, *bytes);
        else
            std::filesystem::remove(path, ignored);
    }
    impl_->names.clear();
    impl_->after.clear();
    impl_->off = impl_->armed = false;
    ++impl_->generation;
}

}  // namespace scree::test
