// How a budget becomes slots: pools of equal slots taken once (docs/lod-and-paging.md, "Memory").
#pragma once

#include <cstdint>

#include "common/dataset.h"
#include "common/result.h"

namespace scree {

struct MemoryPlan {
    std::int64_t height_slots = 0;
    std::int64_t texture_slots = 0;
    std::int64_t staging_slots = 0;  ///< tiles of each kind between disk and GPU at once
    /// All of it with the loader's threads and the tables, in bytes: never above the budget. Slots are counted once,
    /// where a renderer or an arena keeps them.
    std::int64_t resident_bytes = 0;
};

/// Bytes that a method of level of detail takes besides.
struct MoreMemory {
    std::int64_t per_height_slot = 0;
    std::int64_t fixed = 0;
};

/// Bytes of one tile of each kind with its bookkeeping.
std::int64_t height_slot_cost(const Dataset& dataset);
std::int64_t texture_slot_cost(const Dataset& dataset);
/// What does not go by slots: the loader's threads and what libraries take.
std::int64_t fixed_cost(const Dataset& dataset, int loader_threads);

/// Errors: ErrorCode::usage when the pinned roots would take more than an eighth of the budget; names the budget
/// needed.
/// `more`: what else is kept.
Result<MemoryPlan> plan_memory(const Dataset& dataset, std::int64_t budget_bytes, int loader_threads = 2,
                               const MoreMemory& more = {});

}  // namespace scree
