// The tables of the paper's reproduction: which flights by which rules make them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "experiments/paper/measure.h"
#include "runtime/lod/height_raster.h"

namespace scree::paper {

struct Row {
    std::string table;   ///< caching, truth, views, speed, rigour
    std::string flight;  ///< loop, low, steep
    double step_m = 15;
    BlockRules rules;
    bool dike_aware = false;
    Figures figures;

    bool is_guaranteed() const {
        return dike_aware && rules.reuse != ReuseTest::paper &&
               (rules.metric == BlockMetric::guaranteed || rules.metric == BlockMetric::by_block);
    }
    double promise_px() const { return rules.tau_px + (rules.reuse == ReuseTest::off ? 0 : rules.s_px); }
    double max_px() const;       ///< of blocks and dikes
    bool keeps_promise() const;  ///< true where none is made
};

struct TableOptions {
    int frames = 800;
    bool quick = false;  ///< fewer rows, frames and repeats: for tests
};

/// `say` is told of every row before it is measured.
Result<std::vector<Row>> make_tables(const HeightRaster& raster, const TableOptions& options,
                                     const std::function<void(const Row&)>& say);

std::string name_of(BlockMetric metric);       ///< UC, N*, N*K, BSK
std::string name_of(const BlockRules& rules);  ///< off, P1, P2, exact

}  // namespace scree::paper
