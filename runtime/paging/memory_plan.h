// How a budget becomes slots: pools of equal slots taken once (docs/lod-and-paging.md, "Memory").
#pragma once

#include <cstdint>

#include "common/dataset.h"
#include "common/result.h"

namespace scree {

struct MemoryPlan {
    std::int64_t height_slots = 0;
    std::int64_t texture_slots = 0;
    std::int64_t staging_slots = 0;   ///< tiles of each kind between disk and GPU at once
    std::int64_t resident_bytes = 0;  ///< everything above, in bytes: never above the budget
};

/// Bytes of one tile of each kind with its bookkeeping.
std::int64_t height_slot_cost(const Dataset& dataset);
std::int64_t texture_slot_cost(const Dataset& dataset);

/// Errors: ErrorCode::usage when the pinned roots would take more than an eighth of the budget; names the budget
/// needed.
Result<MemoryPlan> plan_memory(const Dataset& dataset, std::int64_t budget_bytes);

}  // namespace scree
