// The vertices selected in one block and the triangles that they make (Scree lod, 1.3). One object a block, or one
// reused for many: it only keeps its tables. Not thread safe.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/bisection.h"

namespace scree {

/// Adds a vertex and whatever it depends on to `active`, a byte a vertex. True if it was not there.
bool add_closed(const Bisection& bisection, std::int32_t vertex, std::uint8_t* active);
/// At most so many indices make a block.
inline std::size_t most_indices(const Bisection& bisection) {
    return 6 * static_cast<std::size_t>(bisection.cells()) * static_cast<std::size_t>(bisection.cells());
}

class BlockSelection {
public:
    explicit BlockSelection(const Bisection& bisection);

    bool is_active(std::int32_t vertex) const { return active_[static_cast<std::size_t>(vertex)] != 0; }
    std::span<const std::uint8_t> active() const { return active_; }
    /// Only the corners.
    void clear();

    /// Ueng & Chuang with active and lock (1.3), finest level first: the parent-closure of the vertices that `fails`
    /// says. Keeps the former state, and changes only what changes. fails(vertex) -> bool.
    template <class Fails>
    void update(const Fails& fails) {
        const auto order = bisection_->coarse_to_fine();
        for (std::size_t k = order.size(); k-- > 0;) {
            const std::int32_t v = order[k];
            const bool want = lock_[static_cast<std::size_t>(v)] > 0 || fails(v);
            if (want != is_active(v)) set(v, want);
        }
    }
    /// N* and BSK, whose tests are monotone: coarsest level first, stopping where nothing is selected. From clear().
    template <class Selects>
    void refine(const Selects& selects) {
        for (const BisectionTriangle& root : bisection_->roots()) refine(root, 1, selects);
    }
    /// Adds a vertex and whatever it depends on. Only beside refine(), which keeps no locks.
    void add(std::int32_t vertex);

    /// The drawn triangles, three indices each, appended: those of the whole block, or of the cell (x, y) of stride
    /// 2^stride_log2, whose sides' vertices must be active.
    void emit(std::vector<std::uint32_t>& indices) const;
    void emit(int stride_log2, int x, int y, std::vector<std::uint32_t>& indices) const;
    std::int64_t triangles() const;

private:
    void set(std::int32_t vertex, bool active);
    template <class Selects>
    void refine(const BisectionTriangle& t, int level, const Selects& selects) {
        if (level > bisection_->levels()) return;
        const std::int32_t v = t.middle();
        if (!is_active(v)) {
            if (!selects(v)) return;
            active_[static_cast<std::size_t>(v)] = 1;
        }
        refine(t.left_half(), level + 1, selects);
        refine(t.right_half(), level + 1, selects);
    }
    void emit(std::span<const BisectionTriangle> triangles, int level, std::vector<std::uint32_t>& indices) const;

    const Bisection* bisection_;
    std::vector<std::uint8_t> active_;
    std::vector<std::uint8_t> lock_;  ///< active children
};

/// Heights of the surface that a selection makes, at every vertex: the vertex's own where active, else the mean of its
/// hypotenuse's ends (1.3; for checks).
void surface_heights(const Bisection& bisection, std::span<const std::uint8_t> active, std::span<const double> z,
                     std::span<double> out);

}  // namespace scree
