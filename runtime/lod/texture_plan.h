// TexturePlan: which textures a cut deserves, and which one each of its leaves is drawn with. Textures are a pyramid of
// their own on the same addresses, each as deep by place as its data: a leaf of the cut wants the coarsest level whose
// texel covers no more than the tolerance, and its ancestors, which stand in. Where textures go deeper than heights, a
// page that is a leaf of the stored pyramid is drawn in parts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/lod/cut.h"
#include "runtime/lod/draw_list.h"
#include "runtime/paging/residency.h"
#include "runtime/paging/tile_request.h"

namespace scree {

class TexturePlan {
public:
    explicit TexturePlan(const Dataset& dataset);

    /// Somewhere, perhaps.
    bool deeper_than_heights() const { return dataset_.texture_deepest_level > dataset_.least_leaf_level(); }

    /// Works out what the leaves of `cut` want; returns how many textures that is, all roots included. The arguments
    /// must outlive the calls below.
    std::int64_t wish(const Cut& cut, std::span<const LodView> views, const CutSettings& settings,
                      const Residency& residency);
    /// Slots of what is wanted and resident, coarse before fine, and requests for the rest; `missing`, by node of the
    /// cut: becomes true where something is asked for at or under the node itself.
    void hand_over(const Cut& cut, std::vector<std::int32_t>& planned, std::vector<TileRequest>& requests,
                   std::vector<bool>& missing) const;
    /// Sets the texture of a leaf: the one wanted, or the nearest resident ancestor. `fade_s`: a texture younger than
    /// that is blended in over its ancestor's. False: an ancestor's stands in for a texture that is missing.
    bool place(const Cut& cut, std::int32_t leaf, double fade_s, DrawItem& item);
    /// Appends the leaf whole, or in parts of the deepest textures that they deserve and have.
    void emit_parts(const Cut& cut, std::int32_t leaf, const DrawItem& item, DrawList& out);
    /// Appends the slots that place() has dealt out since wish().
    void used(std::vector<std::int32_t>& slots) const;
    /// A texture dealt out since wish() is still being blended in.
    bool fading() const { return fading_; }

private:
    struct DeepWish {
        TileId id;
        std::int32_t slot;
        double need;
        std::size_t node;  ///< of the cut, whose part it is
    };
    struct Part;
    double texel_m(int level) const { return texel_m_[static_cast<std::size_t>(level)]; }
    int wanted_steps_up(const CutNode& node) const;
    double texel_per_px(const CutNode& node, TilePart part) const;
    template <class Visit>
    void for_each_deep_child(const CutNode& node, const Part& part, const Visit& visit) const;
    void wish_deep(const CutNode& node, std::size_t index, const Part& part);
    void emit_part(const CutNode& node, const Part& part, const DrawItem& item, DrawList& out);
    std::int32_t wanted_slot_at(TileId texture) const;
    std::int32_t wanted_beside(std::int32_t slot, TileId texture, TextureSide side);
    void mark_wanted(std::int32_t slot);
    void add_neighbours(TileId texture, double texel_px, DrawItem& item);

    const Dataset& dataset_;
    std::vector<double> texel_m_;  ///< by level
    std::span<const LodView> views_;
    CutSettings settings_;
    const Residency* residency_ = nullptr;
    std::vector<double> needs_;  ///< by node of the cut; 0: its texture is not wanted
    std::vector<bool> wanted_;   ///< by texture slot
    /// The wanted textures round one, as far as somebody has asked since wish(): several pages lie under one texture.
    struct Beside {
        std::uint64_t asked_in = 0;  ///< wishes_ then
        std::uint32_t known = 0;     ///< bit s: slots[s] has been looked up
        std::array<std::int32_t, 8> slots{};
    };
    std::vector<Beside> beside_;  ///< by texture slot
    std::uint64_t wishes_ = 0;
    std::vector<DeepWish> deep_;
    std::vector<std::int32_t> used_;
    bool fading_ = false;
};

}  // namespace scree
