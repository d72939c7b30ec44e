// A SQLite VFS that ends every page of a database with a checksum of the page, in the eight bytes a page that SQLite
// can be told to reserve. Row checksums find damaged payloads; this finds damage anywhere in the file, b-tree included.
// Any SQLite reads such a file; one that writes it without this VFS leaves pages that verify reports.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

inline constexpr int kPageChecksumBytes = 8;
inline constexpr const char* kPageChecksumVfs = "scree-page-checksum";

/// Registers the VFS with SQLite (once; thread-safe).
Result<void> register_page_checksum_vfs();

/// Checksum of page `number` (from 1): XXH3-64 of its bytes but the last eight, seeded with the number.
std::uint64_t page_checksum(std::span<const std::uint8_t> page, std::uint64_t number);

struct PageScan {
    std::int64_t pages = 0;
    std::vector<std::int64_t> damaged;  ///< page numbers, at most 100
};

/// Reads the file page by page. Pages that hold nothing (SQLite's free list) are not checked: nobody has to write them.
/// Errors: ErrorCode::io unreadable, ErrorCode::store when it is no database of this
/// layout.
Result<PageScan> scan_page_checksums(const std::string& path);

}  // namespace scree
