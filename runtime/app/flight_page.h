// A flight as one page of HTML that needs nothing else: what it says in a sentence, charts over its frames, pictures
// along it, its settings and all its figures. Pure.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/app/flight_log.h"
#include "runtime/app/page_parts.h"

namespace scree {

/// In plain words: how fast, how true, how much memory.
std::string flight_verdict(const FlightLog& log, const FlightFacts& facts);

/// Errors: ErrorCode::io (no memory for a picture).
Result<std::string> flight_page(const FlightLog& log, const FlightFacts& facts,
                                const std::vector<PosePicture>& pictures);

}  // namespace scree
