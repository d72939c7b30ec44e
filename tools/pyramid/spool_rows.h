// The rows of one DEM into a spool of the same size, without resampling.
#pragma once

#include <cstdint>
#include <functional>

#include "common/result.h"
#include "tools/pyramid/height_spool.h"
#include "tools/source/height_source.h"
#include "tools/source/suspect_values.h"

namespace scree {

/// Bytes that spool_rows holds besides the decoder's.
std::int64_t spool_rows_bytes(std::int64_t width);

/// A band is decoded while the one before is searched for voids and written. `on_rows` after each, with the number of
/// its rows; false stops it (ErrorCode::interrupted). Errors: those of the file, and ErrorCode::io.
Result<void> spool_rows(ImageSource& dem, const VoidRule& voids, SuspectValues& suspects, HeightSpool& spool,
                        const std::function<bool(std::int64_t rows)>& on_rows);

}  // namespace scree
