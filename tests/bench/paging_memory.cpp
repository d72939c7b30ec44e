// Whether a memory plan is true: scree_paging_memory STORE BUDGET_MIB [FRAMES]. Flies at random over the store with a
// sink that keeps nothing, and prints by how much the process grew beside what the plan allows for all but the slots'
// own bytes. Linux.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <random>

#include "common/store/sqlite_store.h"
#include "common/texture_tile.h"
#include "tests/runtime/paging/tile_planner.h"

namespace scree {
namespace {

class NoSink final : public TileSink {
public:
    void put_height(std::int32_t, std::span<const SlotVertex>) override {}
    void put_texture(std::int32_t, std::span<const std::uint8_t>) override {}
};

std::int64_t rss_bytes() {
    long pages = 0, resident = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
        if (std::fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
        std::fclose(file);
    }
    return std::int64_t{resident} * ::sysconf(_SC_PAGESIZE);
}

int fly(const SqliteStore& store, std::int64_t budget_bytes, int frames) {
    constexpr double kMebibyte = 1024 * 1024;
    const auto plan = plan_memory(store.dataset(), budget_bytes);
    if (!plan) {
        fmt::print(stderr, "{}\n", plan.error().message);
        return 2;
    }
    const Lattice& l = store.dataset().lattice;
    test::TilePlanner planner(store.dataset(), *plan, 0.05, true);
    planner.take_memory();
    NoSink sink;
    const std::int64_t before = rss_bytes();
    auto pager = Pager::create(store, {*plan, 2, 0, true}, sink);
    if (!pager) {
        fmt::print(stderr, "{}\n", pager.error().message);
        return 4;
    }
    std::mt19937_64 random(4242);
    std::uniform_real_distribution<double> x(0, static_cast<double>(l.cells_x)), y(0, static_cast<double>(l.cells_y));
    double i = x(random), j = y(random);
    const std::int64_t created = rss_bytes() - before;
    std::int64_t peak = 0;
    for (int frame = 0; frame < frames; ++frame) {
        if (frame % 60 == 0) {
            i = x(random);
            j = y(random);
        }
        // Now and then nothing is taken for a while: staging fills.
        if (frame % 60 > 20) (*pager)->take_arrivals(std::int64_t{4} << 20, frame % 3 == 0);
        (*pager)->request(planner.plan((*pager)->residency(), i += 1, j += 1).wishes());
        if (frame % 4 == 0) peak = std::max(peak, rss_bytes() - before);
    }
    const std::int64_t slots =
        plan->height_slots * static_cast<std::int64_t>(slot_bytes(l.tile_cells_log2)) +
        plan->texture_slots * static_cast<std::int64_t>(bc1_chain_bytes(store.dataset().texture_size_log2));
    const auto mib = [&](std::int64_t bytes) { return static_cast<double>(bytes) / kMebibyte; };
    fmt::print(
        "budget {:.1f} MiB: planned {:.1f} ({} height, {} texture, {} staging slots), of it {:.2f} beside the slots; "
        "grew by {:.2f} at the start, {:.2f} at most; {} tiles in, {} out\n",
        mib(budget_bytes), mib(plan->resident_bytes), plan->height_slots, plan->texture_slots, plan->staging_slots,
        mib(plan->resident_bytes - slots), mib(created), mib(peak), (*pager)->counters().tiles_paged_in,
        (*pager)->counters().tiles_paged_out);
    return peak <= plan->resident_bytes - slots ? 0 : 1;
}

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    if (argc < 3) {
        fmt::print(stderr, "usage: scree_paging_memory STORE BUDGET_MIB [FRAMES]\n");
        return 2;
    }
    auto store = scree::SqliteStore::open(argv[1]);
    if (!store) {
        fmt::print(stderr, "{}\n", store.error().message);
        return static_cast<int>(store.error().code);
    }
    return scree::fly(**store, static_cast<std::int64_t>(std::atof(argv[2]) * 1024 * 1024),
                      argc > 3 ? std::atoi(argv[3]) : 3000);
}
