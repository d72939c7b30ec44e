// A file system for SQLite that fails when it is told to, and that loses at a power loss what a real one may lose.
//
//     FaultyVfs vfs(seed);
//     vfs.fail_at(k, FaultKind::power_loss);
//     ...                                     // code that ends with an error
//     vfs.reboot();                           // now the files are what a disk may hold after that
//
// It lies over the real one: the files are ordinary ones, and code that opens them by other means sees what the program
// under test has written. Every SQLite connection of the process goes through it, with and without page checksums. At a
// power loss
//   - each sector that was written since its file's last sync is old or new;
//   - a file's size is the old one, the new one or between them; what was never written there is zero or garbage;
//   - a file that was created or deleted since its folder's last sync is there or not, as it was or as it is.
// Model: what POSIX promises of fsync, and no more; that a sector is written wholly or not at all; that bytes beside a
// write stay (SQLITE_IOCAP_POWERSAFE_OVERWRITE, which SQLite takes for granted).
#pragma once

#include <cstdint>
#include <memory>

namespace scree::test {

enum class FaultKind {
    io_error,         ///< the operation fails, the next works
    io_errors,        ///< it and all after it fail
    disk_full,        ///< a part of the write lands; the next works
    disk_stays_full,  ///< so with all writes after it; deleting and truncating work
    power_loss,       ///< a part of the write lands; nothing works until reboot()
};

/// One at a time. Connections that were open before it are left alone, others are to be closed before it goes.
/// Thread-safe.
class FaultyVfs {
public:
    /// The same seed and the same operations lose the same.
    explicit FaultyVfs(std::uint64_t seed);
    ~FaultyVfs();
    FaultyVfs(const FaultyVfs&) = delete;
    FaultyVfs& operator=(const FaultyVfs&) = delete;

    /// Arms the `k`-th operation from now on (1 is the next): an open, write, truncate, sync or delete. Ends what an
    /// earlier fault left; reboot() first after a power loss.
    void fail_at(std::int64_t k, FaultKind kind);
    /// Nothing fails any more.
    void fail_no_more();
    /// Operations since the last fail_at(), or from the beginning.
    std::int64_t operations() const;
    /// The fault has come.
    bool struck() const;
    /// Writes what the disk holds after the power loss; without one, the power goes now. Connections of before are
    /// dead.
    void reboot();

    struct Impl;

private:
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree::test
