#include "runtime/paging/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/height_tile.h"
#include "common/mesh/vertex_slot.h"
#include "common/texture_tile.h"
#include "runtime/paging/loader.h"
#include "runtime/paging/tile_cache.h"

namespace scree {
namespace {

constexpr std::int64_t kStagingSlots = 96;  // of each kind: what two threads decode in a frame of 30 ms
constexpr double kHeightShare = 0.27;       // 13.3 KB against 43.9 KB: a page for each texture and a quarter more
// A staged tile's names and header, the job that asked for it, and what malloc keeps of its buffer.
constexpr std::int64_t kStagedBytes = 640;
// What evictions are remembered by, lists of requests, code and tables of the libraries that reading touches first.
constexpr std::int64_t kFixedBytes = 768 * 1024;

constexpr double kMebibyte = 1024.0 * 1024;

}  // namespace

// Twice the tables: while a store's new state is taken up, those of the old one and those of the new.
std::int64_t height_slot_cost(const Dataset& d) {
    return static_cast<std::int64_t>(slot_bytes(d.lattice.tile_cells_log2)) + 2 * TileCache::bookkeeping_bytes();
}
std::int64_t texture_slot_cost(const Dataset& d) {
    return static_cast<std::int64_t>(bc1_chain_bytes(d.texture_size_log2)) + 2 * TileCache::bookkeeping_bytes();
}

std::int64_t fixed_cost(const Dataset& d, int loader_threads) {
    return kFixedBytes + std::max(loader_threads, 1) * loader_thread_bytes(d);
}

Result<MemoryPlan> plan_memory(const Dataset& d, std::int64_t budget_bytes, int loader_threads,
                               const MoreMemory& more) {
    const std::int64_t height = height_slot_cost(d) + more.per_height_slot, texture = texture_slot_cost(d);
    const std::int64_t fixed = fixed_cost(d, loader_threads) + more.fixed;
    const std::int64_t roots = d.lattice.root_rows * d.lattice.root_columns;
    const std::int64_t staged = height + texture + 2 * kStagedBytes;
    MemoryPlan plan;
    plan.staging_slots = std::clamp<std::int64_t>((budget_bytes - fixed) / 16 / staged, 2, kStagingSlots);
    const std::int64_t staging = plan.staging_slots * staged;
    const std::int64_t pinned = roots * (height + texture);
    // Besides the roots a split needs four tiles of each kind.
    const std::int64_t needed = fixed + std::max(8 * pinned, staging + pinned + 4 * (height + texture));
    if (budget_bytes < needed)
        return Error{
            ErrorCode::usage,
            fmt::format("--budget {:.1f} MiB is too small for this store: {:.1f} MiB are needed ({} pinned "
                        "root{} may take an eighth)",
                        static_cast<double>(budget_bytes) / kMebibyte,
                        std::ceil(static_cast<double>(needed) / kMebibyte * 10) / 10, roots, roots == 1 ? "" : "s")};
    const std::int64_t free = budget_bytes - fixed - staging;
    // Heights take their share, but leave textures room to split a root.
    const std::int64_t share = std::min(static_cast<std::int64_t>(kHeightShare * static_cast<double>(free)),
                                        free - std::min(roots + 4, d.texture_tiles) * texture);
    // Where all tiles fit, the roots of an update must still find room beside them.
    const std::int64_t most_heights = d.height_tiles + roots, most_textures = d.texture_tiles + roots;
    plan.height_slots = std::min(std::max(share / height, roots + 4), most_heights);
    plan.texture_slots = std::clamp<std::int64_t>((free - plan.height_slots * height) / texture, 1, most_textures);
    // What a small texture pyramid leaves over goes to heights.
    plan.height_slots = std::min((free - plan.texture_slots * texture) / height, most_heights);
    if (plan.height_slots == most_heights && plan.texture_slots == most_textures) {
        // Nothing is short: up to as much again, so that an update comes in beside what is drawn, and may add tiles.
        const auto spare = static_cast<double>(free - plan.height_slots * height - plan.texture_slots * texture);
        const auto heights = static_cast<double>(d.height_tiles), textures = static_cast<double>(d.texture_tiles);
        const double spare_share =
            std::min(1.0, spare / (heights * static_cast<double>(height) + textures * static_cast<double>(texture)));
        plan.height_slots += static_cast<std::int64_t>(spare_share * heights);
        plan.texture_slots += static_cast<std::int64_t>(spare_share * textures);
    }
    plan.resident_bytes = fixed + staging + plan.height_slots * height + plan.texture_slots * texture;
    return plan;
}

}  // namespace scree
