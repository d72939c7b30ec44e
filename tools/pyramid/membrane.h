// A membrane over a hole in a raster: the discrete Laplace equation (five-point stencil) with the samples around the
// hole as boundary values. Solved by variational multigrid: a coarse space is spanned by bilinear hats cut off at the
// hole's edge, and its operator is the Galerkin product (Kornhuber and Yserentant, "Multilevel methods for elliptic
// problems on domains not resolved by the coarse grid", 1994; Briggs, Henson and McCormick, "A Multigrid Tutorial", 2nd
// ed., ch. 10), so that no edge, island or thin arm does harm. One thread, one order of operations: the same values
// always. The finest level is in double; coarse levels, which only correct it, are in float.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace scree {

/// Reuse one object: its buffers grow to about 10 bytes a sample of the largest window, besides the window itself. Not
/// thread-safe.
class Membrane {
public:
    struct Window {
        std::span<double> values;               ///< row-major; what `unknown` marks is replaced
        std::span<const std::uint8_t> unknown;  ///< 1: a sample of the hole; none on the window's edge
        std::int64_t width = 0, height = 0;
    };
    /// The least and greatest of the valid samples beside (west, east, north, south of) the hole's.
    struct Rim {
        double low = 0, high = 0;
    };
    struct Extent {
        std::int64_t begin = 0, end = 0;  ///< columns with unknowns
    };
    /// Node (x, y) lies on (2x - 2, 2y - 2) of the level below it; those on the edge stand for nothing.
    struct Coarse {
        std::int64_t width = 0, height = 0;
        std::vector<Extent> rows;
        /// Of a node: the operator's entries for itself, east, south-west, south, south-east of it; the others are
        /// those nodes' own. Five zeros: the hat does not meet the hole.
        std::vector<float> entries;
        std::vector<float> u, right;
    };

    /// Every sample beside an unknown one is unknown or finite. The result lies within the rim's range, and what is
    /// left of the error is about 1e-6 of it. False: keep_going, asked once a cycle, said no.
    bool solve(const Window& window, const std::function<bool()>& keep_going);
    const Rim& rim() const { return rim_; }  ///< of the last window

private:
    double cycle_finest(const Window& window);
    void cycle_coarse(std::size_t l);

    std::vector<Extent> rows_;  ///< of the window
    std::vector<Coarse> coarse_;
    std::size_t levels_ = 0;  ///< of coarse_ that are in use
    std::vector<double> residuals_;
    Rim rim_;
};

}  // namespace scree
