// JSON reports as the commands promise them, and the checks that every built store must pass.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/programs/child_program.h"

namespace scree::test {

/// Parses what a run printed on stdout; expects exit code 0, nothing but JSON, and every number finite.
nlohmann::json report_of(const ProgramRun& run);
/// Records a failure for every key that is missing.
void expect_keys(const nlohmann::json& report, const std::vector<std::string>& keys);

/// build -o store, with more arguments; expects success and the promised report.
nlohmann::json build_store_from(const std::vector<std::string>& inputs, const std::string& store);
/// info, verify, audit at each tau and fly at each budget: every promise of a whole store.
nlohmann::json expect_sound_store(const std::string& store, const std::vector<double>& taus = {0.5, 1, 2, 8},
                                  const std::vector<std::string>& budgets = {"4M", "8M"});
std::string digest_of(const std::string& store);

/// Nothing that a stopped or refused program leaves behind: no OUT.partial, OUT.heights, journals.
void expect_only(const std::string& folder, const std::vector<std::string>& names);
/// What a build of `store` that was cut off may leave in the store's folder: OUT.partial and its journal, besides
/// `others`.
void expect_at_most_partial(const std::string& store, const std::vector<std::string>& others = {});

}  // namespace scree::test
