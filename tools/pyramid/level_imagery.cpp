#include "tools/pyramid/level_imagery.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

// The layers of which some file asks for `level` or a coarser one. A layer stays whole, so that no kernel meets an edge
// between files that adjoin.
std::vector<Layer> layers_for(const BuildPlan& plan, int level) {
    std::vector<Layer> layers;
    for (const Layer& layer : plan.mosaic.image_layers)
        if (std::any_of(layer.members.begin(), layer.members.end(),
                        [&](const LayerMember& m) { return plan.image_level[m.file] <= level; }))
            layers.push_back(layer);
    return layers;
}

}  // namespace

TargetGrid texel_grid(const Dataset& d, int level) {
    const double texel = d.texel_m(level);
    return {d.lattice.origin_x_m + texel / 2, d.lattice.origin_y_m - texel / 2, texel};
}

Result<LevelImagery> LevelImagery::open(const BuildPlan& plan, const BuildOptions& options) {
    LevelImagery all;
    const int coarsest = all.coarsest_ = plan.textures.coarsest(), deepest = plan.textures.deepest();
    StackOptions stack{options.kernel, plan.open, options, options.out};
    stack.spool_memory_bytes /= deepest - coarsest + 1;
    for (int level = coarsest; level <= deepest; ++level) {
        std::unique_ptr<ImageStack> opened;
        if (auto layers = layers_for(plan, level); !layers.empty()) {
            auto made = ImageStack::open(plan.mosaic.imagery, std::move(layers), texel_grid(plan.dataset, level),
                                         plan.mosaic.crs, stack);
            if (!made) return made.error();
            opened = std::move(*made);
        }
        all.stacks_.push_back(std::move(opened));
    }
    return all;
}

ImageStack* LevelImagery::at(int level) const {
    const int k = level - coarsest_;
    return k < 0 || k >= static_cast<int>(stacks_.size()) ? nullptr : stacks_[static_cast<std::size_t>(k)].get();
}

std::int64_t LevelImagery::temporary_bytes(const BuildPlan& plan) {
    const int coarsest = plan.textures.coarsest();
    std::int64_t bytes = 0;
    for (std::size_t k = 0; k < plan.mosaic.imagery.size(); ++k) {
        const ImageInfo& info = plan.mosaic.imagery[k].info;
        const std::int64_t whole = image_stack_bytes({plan.mosaic.imagery[k]});
        // Its own level and the coarsest one may read all of it, others what lies around finer images: whole rows of
        // blocks.
        bytes += whole;
        for (int level = std::max(coarsest + 1, plan.image_level[k] + 1); level <= plan.textures.deepest(); ++level) {
            const double texels =
                static_cast<double>(plan.textures.count(level)) * std::ldexp(1.0, 2 * plan.dataset.texture_size_log2);
            const double share = plan.dataset.texel_m(level) / plan.mosaic.pixel_m[k];
            const double read = 4 * texels * share * share * 4 + 512.0 * 4 * static_cast<double>(info.width);
            bytes += static_cast<std::int64_t>(std::min(read, static_cast<double>(whole)));
        }
    }
    return bytes;
}

}  // namespace scree
