// A membrane over a hole in a raster: the discrete Laplace equation (five-point stencil) with the samples around the
// hole as boundary values. Solved by variational multigrid in double precision, each coarse space spanned by the
// bilinear hats that lie wholly inside the hole (Kornhuber and Yserentant, "Multilevel methods for elliptic problems on
// domains not resolved by the coarse grid", 1994; Briggs, Henson and McCormick, "A Multigrid Tutorial", 2nd ed., ch.
// 10), so that islands and thin arms do no harm. One thread, one order of operations: the same values always.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace scree {

/// Reuse one object: its buffers grow to about 15 bytes a sample of the largest window. Not thread-safe.
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

    /// Every sample beside an unknown one is unknown or finite. The result lies within the rim's range, and what is
    /// left of the error is about 1e-7 of it. False: keep_going, asked once a cycle, said no.
    bool solve(const Window& window, const std::function<bool()>& keep_going);
    const Rim& rim() const { return rim_; }  ///< of the last window

private:
    struct Stencil {
        double centre, edge, corner;
    };
    struct Extent {
        std::int64_t begin = 0, end = 0;  ///< columns with unknowns
    };
    struct Level {
        std::int64_t width = 0, height = 0;
        Stencil stencil{};
        std::span<double> u;
        std::span<const double> right;  ///< empty: zero
        std::span<const std::uint8_t> unknown;
        std::vector<Extent> rows;
        std::vector<double> own_u, own_right;  ///< of coarse levels
        std::vector<std::uint8_t> own_unknown;
    };

    void find_extents(Level& level);
    bool coarsen(const Level& fine, Level& coarse);
    void measure_rim(const Level& level);
    void start(Level& level) const;
    double relax(Level& level, bool forward) const;
    void residual_row(const Level& level, std::int64_t y, double* out) const;
    void restrict_residual(const Level& fine, Level& coarse);
    double correct(const Level& coarse, Level& fine) const;
    double cycle(std::size_t l);

    std::vector<Level> levels_;
    std::size_t used_levels_ = 0;
    std::vector<double> residuals_;  ///< three rows
    Rim rim_;
};

}  // namespace scree
