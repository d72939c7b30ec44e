// The file under the tiles: pages, schema, columns, keys, and rows that the walk over the tree did not meet.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/store/sqlite_store.h"
#include "tools/verify/problem_list.h"

namespace scree {

/// Page checksums, SQLite's own check, the schema and the types of every column.
/// False: the tables are not those of a store, or SQLite cannot walk them; their rows are not worth reading.
/// Errors: ErrorCode::io.
Result<bool> check_layout(const std::string& path, ProblemList& problems);

struct RowCounts {
    std::int64_t height = 0;
    std::int64_t texture = 0;
};

/// Every key in its place: ascending, a key of the lattice, of a level that exists. `go_on` is asked now and then.
/// Errors: ErrorCode::io, and ErrorCode::interrupted when go_on says no.
Result<RowCounts> check_keys(const SqliteStore& store, ProblemList& problems, const std::function<bool()>& go_on);

/// Names the rows of one kind that no parent leads to, and damage among them.
Result<void> name_unreached_rows(const SqliteStore& store, TileKind kind, ProblemList& problems,
                                 const std::function<bool()>& go_on);

}  // namespace scree
