// The imagery of a build on the texels of each level at which textures may end. A level knows the images that ask for
// it or for a coarser one: where a finer one lies textures go deeper.
#pragma once

#include <memory>
#include <vector>

#include "common/dataset.h"
#include "tools/mosaic/stack.h"
#include "tools/pyramid/build_plan.h"

namespace scree {

/// The grid of the texel centres of a level.
TargetGrid texel_grid(const Dataset& dataset, int level);

class LevelImagery {
public:
    /// Reads no pixels yet. Errors: those of ImageStack::open.
    static Result<LevelImagery> open(const BuildPlan& plan, const BuildOptions& options);
    /// Null: no image asks for this level or a coarser one.
    ImageStack* at(int level) const;

    /// Temporary disk that the planned build's stacks may take.
    static std::int64_t temporary_bytes(const BuildPlan& plan);

private:
    int coarsest_ = 0;
    std::vector<std::unique_ptr<ImageStack>> stacks_;  // from the coarsest level on
};

}  // namespace scree
