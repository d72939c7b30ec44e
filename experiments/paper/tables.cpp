#include "experiments/paper/tables.h"

#include <algorithm>
#include <map>

#include "experiments/paper/flights.h"

namespace scree::paper {
namespace {

BlockRules rules_of(BlockMetric metric, double tau_px, ReuseTest reuse = ReuseTest::off, double s_px = 0) {
    BlockRules rules;
    rules.metric = metric;
    rules.tau_px = tau_px;
    rules.reuse = reuse;
    rules.s_px = s_px;
    return rules;
}

struct Planned {
    std::vector<Row> rows;
    void add(const char* table, const char* flight, double step_m, const BlockRules& rules, bool dike_aware) {
        rows.push_back({table, flight, step_m, rules, dike_aware, {}});
    }
};

// Tables 1 to 3: triangles and time without and with a cache, what a cache misses.
void plan_caching(Planned& plan, bool quick) {
    const std::vector<std::pair<double, std::vector<double>>> allowances =
        quick ? std::vector<std::pair<double, std::vector<double>>>{{1, {0.1}}}
              : std::vector<std::pair<double, std::vector<double>>>{
                    {0.5, {0.05, 0.1}}, {1, {0.05, 0.1, 0.2}}, {2, {0.1, 0.2}}};
    for (const auto& [tau, all_s] : allowances)
        for (const BlockMetric metric : {BlockMetric::uc, BlockMetric::guaranteed}) {
            const bool aware = metric == BlockMetric::guaranteed;
            plan.add("caching", "loop", 15, rules_of(metric, tau), aware);
            // The cache without an allowance: nothing may differ.
            if (quick) plan.add("caching", "loop", 15, rules_of(metric, tau, ReuseTest::exact, 0), aware);
            for (const double s : all_s)
                for (const ReuseTest reuse : {ReuseTest::paper, ReuseTest::exact})
                    if (!aware || reuse == ReuseTest::exact)
                        plan.add("caching", "loop", 15, rules_of(metric, tau, reuse, s), aware);
        }
}

// The error of every method against the full mesh.
void plan_truth(Planned& plan, bool quick) {
    for (const double tau : quick ? std::vector<double>{1} : std::vector<double>{0.5, 1, 2, 4})
        for (const BlockMetric metric :
             {BlockMetric::uc, BlockMetric::nested, BlockMetric::guaranteed, BlockMetric::by_block}) {
            BlockRules rules = rules_of(metric, tau);
            if (metric == BlockMetric::nested) rules.floor = 0;
            plan.add("truth", "loop", 15, rules, false);
            if (metric == BlockMetric::guaranteed || metric == BlockMetric::by_block)
                plan.add("truth", "loop", 15, rules, true);
        }
}

// Where the paper's reuse test breaks.
void plan_views(Planned& plan) {
    for (const auto& [flight, step_m] : {std::pair{"low", 5.0}, std::pair{"steep", 15.0}}) {
        for (const bool each_corner : {false, true}) {
            BlockRules rules = rules_of(BlockMetric::uc, 1, ReuseTest::paper, 0.1);
            rules.each_corner = each_corner;
            plan.add("views", flight, step_m, rules, false);
        }
        plan.add("views", flight, step_m, rules_of(BlockMetric::uc, 1, ReuseTest::exact, 0.1), false);
        plan.add("views", flight, step_m, rules_of(BlockMetric::guaranteed, 1, ReuseTest::exact, 0.1), true);
    }
}

void plan_speed(Planned& plan, bool quick) {
    for (const double step_m : quick ? std::vector<double>{5, 30} : std::vector<double>{2, 5, 15, 30, 60}) {
        plan.add("speed", "loop", step_m, rules_of(BlockMetric::uc, 1, ReuseTest::paper, 0.1), false);
        plan.add("speed", "loop", step_m, rules_of(BlockMetric::uc, 1, ReuseTest::exact, 0.1), false);
        plan.add("speed", "loop", step_m, rules_of(BlockMetric::guaranteed, 1, ReuseTest::exact, 0.1), true);
    }
}

// What the floor of the metric buys where the eye looks down.
void plan_rigour(Planned& plan, bool quick) {
    for (const char* flight : {"loop", "steep"})
        for (const double floor : quick ? std::vector<double>{0.3} : std::vector<double>{0, 0.1, 0.3, 0.6, 1}) {
            BlockRules rules = rules_of(BlockMetric::guaranteed, 1, ReuseTest::exact, 0.1);
            rules.floor = floor;
            plan.add("rigour", flight, 15, rules, true);
        }
}

std::vector<Camera> cameras_of(const Row& row, const HeightRaster& raster, int frames) {
    if (row.flight == "low") return low(raster, row.step_m, frames);
    if (row.flight == "steep") return steep(raster, row.step_m, frames);
    return loop(raster, row.step_m, frames);
}

}  // namespace

double Row::max_px() const { return std::max(figures.truth.blocks.max_px(), figures.truth.dikes.max_px()); }
bool Row::keeps_promise() const { return !is_guaranteed() || max_px() <= promise_px(); }

Result<std::vector<Row>> make_tables(const HeightRaster& raster, const TableOptions& options,
                                     const std::function<void(const Row&)>& say) {
    Planned plan;
    plan_caching(plan, options.quick);
    plan_truth(plan, options.quick);
    plan_views(plan);
    plan_speed(plan, options.quick);
    plan_rigour(plan, options.quick);
    std::map<bool, BlockWorld> worlds;
    for (const bool dike_aware : {false, true}) {
        BlockWorldOptions world_options;
        world_options.dike_aware = dike_aware;
        auto world = BlockWorld::make(raster, world_options);
        if (!world) return world.error();
        worlds.emplace(dike_aware, std::move(*world));
    }
    MeasureOptions measuring;
    if (options.quick) measuring = {4, 1};
    for (Row& row : plan.rows) {
        say(row);
        row.figures = measure(worlds.at(row.dike_aware), cameras_of(row, raster, options.frames), row.rules, measuring);
    }
    return std::move(plan.rows);
}

std::string name_of(BlockMetric metric) {
    switch (metric) {
        case BlockMetric::uc:
            return "UC";
        case BlockMetric::nested:
            return "N*";
        case BlockMetric::guaranteed:
            return "N*K";
        case BlockMetric::by_block:
            return "BSK";
    }
    return "";
}

std::string name_of(const BlockRules& rules) {
    switch (rules.reuse) {
        case ReuseTest::off:
            return "off";
        case ReuseTest::paper:
            return rules.each_corner ? "P2" : "P1";
        case ReuseTest::exact:
            return "exact";
    }
    return "";
}

}  // namespace scree::paper
