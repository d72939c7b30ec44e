// What is drawn moves continuously with the eye and with time: no vertex pops (docs/lod-and-paging.md, "Morphing").
#include <gtest/gtest.h>

#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/probed_surface.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

std::vector<glm::dvec2> random_places(test::Random& random, const test::SyntheticTerrain& terrain, int count) {
    const Lattice& l = terrain.lattice();
    std::vector<glm::dvec2> places;
    for (int k = 0; k < count; ++k)
        places.push_back({test::uniform_real(random, 0, static_cast<double>(l.cells_x)),
                          test::uniform_real(random, 0, static_cast<double>(l.cells_y))});
    return places;
}

/// Greatest difference of two surfaces over all places, and where.
struct Jump {
    double height_m = 0;
    std::size_t place = 0;
};

Jump greatest_jump(const std::vector<double>& a, const std::vector<double>& b) {
    Jump jump;
    for (std::size_t k = 0; k < a.size(); ++k)
        if (std::abs(a[k] - b[k]) > jump.height_m) jump = {std::abs(a[k] - b[k]), k};
    return jump;
}

/// What stays of the greatest jump between parameters `from` and `to`, when the two come as near as `resolution`.
template <class Heights>
Jump pop_between(double from, double to, double resolution, double threshold_m, const Heights& heights) {
    std::vector<double> low = heights(from), high = heights(to);
    Jump jump = greatest_jump(low, high);
    while (to - from > resolution && jump.height_m > threshold_m) {
        const double middle = from + (to - from) / 2;
        std::vector<double> between = heights(middle);
        const Jump first = greatest_jump(low, between), second = greatest_jump(between, high);
        if (first.height_m > second.height_m) {
            to = middle;
            high = std::move(between);
            jump = first;
        } else {
            from = middle;
            low = std::move(between);
            jump = second;
        }
    }
    return jump.height_m > threshold_m ? jump : Jump{};
}

// A flight along a segment that sees all of the terrain all the time.
class Flight {
public:
    Flight(const test::SyntheticTerrain& terrain, const SelectionSettings& settings, glm::dvec3 from, glm::dvec3 to,
           std::vector<glm::dvec2> places)
        : terrain_(terrain),
          settings_(settings),
          from_(from),
          to_(to),
          places_(std::move(places)),
          arena_(test::arena_of(terrain)),
          surface_(terrain, arena_),
          residency_(terrain),
          selector_(terrain.dataset()) {
        residency_.add_all();
        // Of how many quanta a level is worth one step of its fixed point, and a little for the rest.
        threshold_m_ = 1e-3 + 2e-4 * (terrain.dataset().max_height_m - terrain.dataset().min_height_m);
    }
    double length_m() const { return glm::length(to_ - from_); }
    std::vector<double> heights(double metres) {
        const glm::dvec3 eye = from_ + (to_ - from_) * (metres / length_m());
        const Selection& s = selector_.select(test::views_all_round(eye), settings_, residency_);
        EXPECT_TRUE(s.complete);
        const DrawList draws = test::drawn_together(s);
        levels_.clear();
        for (const DrawItem& item : draws) {
            by_texture += item.tile.level > 0 && item.geomip >= 1 ? 1 : 0;
            levels_.insert(item.tile.level);
        }
        mixed += levels_.size() > 1 ? 1 : 0;
        return surface_.heights_m(draws, places_, eye, settings_.half_curvature);
    }
    /// Pops met in so many steps along the way; the drop of a curved world is taken off, as it moves anyway.
    int pops(int steps) {
        int found = 0;
        const double step = length_m() / steps;
        for (int k = 0; k < steps; ++k) {
            const Jump pop = pop_between(k * step, (k + 1) * step, 1e-7, threshold_m_,
                                         [&](double metres) { return heights(metres); });
            if (pop.height_m > 0) {
                ++found;
                worst_m = std::max(worst_m, pop.height_m);
                if (first_m < 0) first_m = k * step;
            }
        }
        return found;
    }
    std::int64_t by_texture = 0, mixed = 0;
    double worst_m = 0, first_m = -1;

private:
    const test::SyntheticTerrain& terrain_;
    SelectionSettings settings_;
    glm::dvec3 from_, to_;
    std::vector<glm::dvec2> places_;
    CpuArena arena_;
    test::ProbedSurface surface_;
    test::FakeResidency residency_;
    Selector selector_;
    std::set<int> levels_;
    double threshold_m_;
};

struct FlightKind {
    int texture_depth = 0;
    bool curved = false;
    bool morph = true;
};

struct FlightResult {
    int pops = 0, flights = 0;
    std::int64_t by_texture = 0, mixed = 0;
    double worst_m = 0;
};

FlightResult fly(test::Random& random, const FlightKind& kind, int worlds) {
    FlightResult result;
    for (int world = 0; world < worlds; ++world) {
        const auto terrain = test::random_terrain(random, kind.texture_depth);
        const Lattice& l = terrain.lattice();
        const double top = terrain.dataset().max_height_m, extent_m = l.spacing_m * static_cast<double>(l.cells_x);
        for (int flight = 0; flight < 3; ++flight) {
            const auto point = [&] {
                return glm::dvec3(l.x_m(test::uniform_real(random, -0.2, 1.2) * static_cast<double>(l.cells_x)),
                                  l.y_m(test::uniform_real(random, -0.2, 1.2) * static_cast<double>(l.cells_y)),
                                  top + extent_m * std::exp(test::uniform_real(random, -5, 0.5)) - 30);
            };
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, 0, 5)));
            settings.texture_tau_px = kind.texture_depth == 0 ? 1e9 : std::exp(test::uniform_real(random, -2, 2));
            settings.morph = kind.morph;
            if (kind.curved) settings.half_curvature = test::random_half_curvature(random, terrain);
            const glm::dvec3 from = point(), to = point();
            Flight f(terrain, settings, from, to, random_places(random, terrain, 80));
            const int pops = f.pops(60);
            result.pops += pops;
            if (std::getenv("SCREE_TRACE_POPS") != nullptr && pops > 0)
                std::printf("world %d flight %d: %d pops, worst %g m, first at %g m\n", world, flight, pops, f.worst_m,
                            f.first_m);
            result.by_texture += f.by_texture;
            result.mixed += f.mixed;
            result.worst_m = std::max(result.worst_m, f.worst_m);
            ++result.flights;
        }
    }
    return result;
}

TEST(ContinuityInSpace, NoVertexPopsWherePagesAreSplitForTheirShape) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {}, 25);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.mixed, 500);
}

TEST(ContinuityInSpace, NoVertexPopsOverACurvedEarth) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.curved = true}, 15);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.mixed, 300);
}

TEST(ContinuityInSpace, NoVertexPopsWherePagesAreSplitForTheirTextures) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.texture_depth = 3}, 25);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.by_texture, 500);
}

TEST(ContinuityInSpace, NoVertexPopsUnderTexturesDeeperThanTheHeights) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.texture_depth = test::kDeepTextures}, 15);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.by_texture, 500);
}

TEST(ContinuityInSpace, WithoutMorphingTheSameFlightsFindPops) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    EXPECT_GT(fly(random, {.morph = false}, 4).pops, 20);
}

}  // namespace
}  // namespace scree
