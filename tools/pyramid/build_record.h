// The options of a build as its store records them, by their names on the command line; only what was given, or what
// later updates must keep (the stretch that was chosen).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/pyramid/build_plan.h"

namespace scree {

/// `stretch`: as given or chosen.
std::map<std::string, std::string> options_record(const BuildOptions& options, const std::optional<Stretch>& stretch);

/// The names of all that can be recorded: what bears on the bytes of a store.
std::vector<std::string> recorded_options();

/// Sets the recorded options. Errors: ErrorCode::store for an option or a value that this program does not know.
Result<void> apply_record(const std::map<std::string, std::string>& record, BuildOptions& options);

/// As --fill takes it. Errors: ErrorCode::usage.
Result<FillRule> parse_fill(const std::string& text);

}  // namespace scree
