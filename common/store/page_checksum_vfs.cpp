#include "common/store/page_checksum_vfs.h"

#include <fmt/format.h>
#include <sqlite3.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>

namespace scree {
namespace {

// SQLite allocates szOsFile bytes for a file object: ours, then the underlying VFS's.
struct ChecksumFile {
    sqlite3_file base;
    bool is_database;
    sqlite3_file* inner() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

ChecksumFile* self(sqlite3_file* f) { return reinterpret_cast<ChecksumFile*>(f); }
sqlite3_file* inner(sqlite3_file* f) { return self(f)->inner(); }
sqlite3_vfs* base_vfs(sqlite3_vfs* v) { return static_cast<sqlite3_vfs*>(v->pAppData); }

bool is_page(int amount) { return amount >= 512 && amount <= 65536 && (amount & (amount - 1)) == 0; }

int file_close(sqlite3_file* f) { return inner(f)->pMethods->xClose(inner(f)); }
int file_read(sqlite3_file* f, void* buffer, int amount, sqlite3_int64 offset) {
    return inner(f)->pMethods->xRead(inner(f), buffer, amount, offset);
}
int file_write(sqlite3_file* f, const void* buffer, int amount, sqlite3_int64 offset) {
    if (!self(f)->is_database || !is_page(amount) || offset % amount != 0)
        return inner(f)->pMethods->xWrite(inner(f), buffer, amount, offset);
    // Into SQLite's own copy of the page, in bytes that it does not use: so the journal of a later transaction holds a
    // page that is right again when any SQLite brings it back.
    auto* page = static_cast<std::uint8_t*>(const_cast<void*>(buffer));
    const auto size = static_cast<std::size_t>(amount);
    const std::uint64_t sum = page_checksum({page, size}, static_cast<std::uint64_t>(offset / amount) + 1);
    for (std::size_t k = 0; k < kPageChecksumBytes; ++k)
        page[size - kPageChecksumBytes + k] = static_cast<std::uint8_t>(sum >> (8 * k));
    return inner(f)->pMethods->xWrite(inner(f), buffer, amount, offset);
}
int file_truncate(sqlite3_file* f, sqlite3_int64 size) { return inner(f)->pMethods->xTruncate(inner(f), size); }
int file_sync(sqlite3_file* f, int flags) { return inner(f)->pMethods->xSync(inner(f), flags); }
int file_size(sqlite3_file* f, sqlite3_int64* size) { return inner(f)->pMethods->xFileSize(inner(f), size); }
int file_lock(sqlite3_file* f, int lock) { return inner(f)->pMethods->xLock(inner(f), lock); }
int file_unlock(sqlite3_file* f, int lock) { return inner(f)->pMethods->xUnlock(inner(f), lock); }
int file_check_lock(sqlite3_file* f, int* out) { return inner(f)->pMethods->xCheckReservedLock(inner(f), out); }
int file_control(sqlite3_file* f, int op, void* arg) { return inner(f)->pMethods->xFileControl(inner(f), op, arg); }
int file_sector_size(sqlite3_file* f) { return inner(f)->pMethods->xSectorSize(inner(f)); }
int file_characteristics(sqlite3_file* f) { return inner(f)->pMethods->xDeviceCharacteristics(inner(f)); }

// Version 1 methods: no shared memory (no WAL) and no memory map, both of which would pass the checksum by.
const sqlite3_io_methods kMethods = {
    1,           file_close,      file_read,    file_write,       file_truncate,        file_sync, file_size, file_lock,
    file_unlock, file_check_lock, file_control, file_sector_size, file_characteristics, nullptr,   nullptr,   nullptr,
    nullptr,     nullptr,         nullptr};

int vfs_open(sqlite3_vfs* v, const char* name, sqlite3_file* f, int flags, int* out_flags) {
    ChecksumFile* file = new (f) ChecksumFile{};
    const int rc = base_vfs(v)->xOpen(base_vfs(v), name, file->inner(), flags, out_flags);
    if (rc != SQLITE_OK) return rc;
    file->is_database = (flags & SQLITE_OPEN_MAIN_DB) != 0;
    file->base.pMethods = &kMethods;
    return SQLITE_OK;
}

}  // namespace

Result<void> register_page_checksum_vfs() {
    static std::mutex mutex;
    static bool registered = false;
    static sqlite3_vfs vfs;
    const std::lock_guard lock(mutex);
    if (registered) return {};
    sqlite3_vfs* base = sqlite3_vfs_find(nullptr);
    if (base == nullptr) return Error{ErrorCode::io, "SQLite offers no file system on this machine"};
    vfs = *base;
    vfs.pNext = nullptr;
    vfs.zName = kPageChecksumVfs;
    vfs.pAppData = base;
    vfs.szOsFile = static_cast<int>(sizeof(ChecksumFile)) + base->szOsFile;
    vfs.xOpen = vfs_open;
    vfs.xDelete = [](sqlite3_vfs* v, const char* n, int s) { return base_vfs(v)->xDelete(base_vfs(v), n, s); };
    vfs.xAccess = [](sqlite3_vfs* v, const char* n, int f, int* o) {
        return base_vfs(v)->xAccess(base_vfs(v), n, f, o);
    };
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
    if (sqlite3_vfs_register(&vfs, 0) != SQLITE_OK)
        return Error{ErrorCode::io, "SQLite refused the checksum file layer"};
    registered = true;
    return {};
}

std::uint64_t page_checksum(std::span<const std::uint8_t> page, std::uint64_t number) {
    return XXH3_64bits_withSeed(page.data(), page.size() - kPageChecksumBytes, number);
}

namespace {

std::uint32_t big_endian_u32(const std::uint8_t* at) {
    return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
}

bool checksum_matches(const std::vector<std::uint8_t>& page, std::int64_t number) {
    std::uint64_t stored = 0;
    for (std::size_t k = 0; k < kPageChecksumBytes; ++k)
        stored |= std::uint64_t{page[page.size() - kPageChecksumBytes + k]} << (8 * k);
    return stored == page_checksum(page, static_cast<std::uint64_t>(number));
}

// Pages that hold nothing (SQLite file format, 1.5, "The Freelist"): the leaves of a list of trunk pages. SQLite
// neither writes them when they become free nor saves them before it uses them again, so that anything may stand there.
std::vector<bool> free_pages(std::FILE* file, const std::uint8_t* header, std::size_t page_size, std::int64_t pages) {
    std::vector<bool> free(static_cast<std::size_t>(pages) + 1);
    std::vector<std::uint8_t> trunk(page_size);
    const std::size_t most_leaves = (page_size - kPageChecksumBytes) / 4 - 2;
    std::int64_t number = big_endian_u32(header + 32);
    for (std::int64_t steps = 0; number > 0 && number <= pages && steps < pages; ++steps) {
        if (::fseeko(file, (number - 1) * static_cast<std::int64_t>(page_size), SEEK_SET) != 0) break;
        if (std::fread(trunk.data(), 1, page_size, file) != page_size) break;
        if (!checksum_matches(trunk, number)) break;  // what it lists is not to be believed
        const std::size_t leaves = big_endian_u32(&trunk[4]);
        for (std::size_t k = 0; k < std::min(leaves, most_leaves); ++k)
            if (const std::int64_t leaf = big_endian_u32(&trunk[8 + 4 * k]); leaf <= pages)
                free[static_cast<std::size_t>(leaf)] = true;
        number = big_endian_u32(trunk.data());
    }
    return free;
}

}  // namespace

Result<PageScan> scan_page_checksums(const std::string& path) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    if (!file) return Error{ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno))};
    std::uint8_t header[100];
    if (std::fread(header, 1, sizeof header, file.get()) != sizeof header ||
        std::memcmp(header, "SQLite format 3", 16) != 0)
        return Error{ErrorCode::store, fmt::format("{}: not a SQLite database", path)};
    std::size_t page_size = static_cast<std::size_t>(header[16]) << 8 | header[17];
    if (page_size == 1) page_size = 65536;
    if (!is_page(static_cast<int>(page_size)) || header[20] != kPageChecksumBytes)
        return Error{ErrorCode::store, fmt::format("{}: pages of {} bytes with {} reserved; a store reserves {}", path,
                                                   page_size, int{header[20]}, kPageChecksumBytes)};
    if (::fseeko(file.get(), 0, SEEK_END) != 0) return Error{ErrorCode::io, fmt::format("{}: read error", path)};
    const auto whole_pages = static_cast<std::int64_t>(::ftello(file.get())) / static_cast<std::int64_t>(page_size);
    const std::vector<bool> free = free_pages(file.get(), header, page_size, whole_pages);
    std::rewind(file.get());
    PageScan scan;
    std::vector<std::uint8_t> page(page_size);
    const std::int64_t lock_page = 0x40000000 / static_cast<std::int64_t>(page_size) + 1;  // SQLite never writes it
    for (;;) {
        const std::size_t got = std::fread(page.data(), 1, page_size, file.get());
        if (got == 0) break;
        ++scan.pages;
        if (scan.pages == lock_page) continue;
        if (got == page_size && (checksum_matches(page, scan.pages) || free[static_cast<std::size_t>(scan.pages)]))
            continue;
        if (scan.damaged.size() < 100) scan.damaged.push_back(scan.pages);
    }
    if (std::ferror(file.get()) != 0) return Error{ErrorCode::io, fmt::format("{}: read error", path)};
    return scan;
}

}  // namespace scree
