#include "runtime/lod/block_truth.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "runtime/lod/block_selection.h"

namespace scree {
namespace {

std::size_t bin_of(double px) { return std::bit_cast<std::uint32_t>(static_cast<float>(px)) >> 17; }

constexpr double kRounding = 1e-4;  ///< of the selection's single precision, which the paper's test does not allow for

// m = h / r^2 of a vertex, by its place relative to the eye.
double magnification(const glm::dvec3& d) {
    const double h2 = d.x * d.x + d.y * d.y;
    return std::sqrt(h2) / (h2 + d.z * d.z);
}

// Pixels between the projections of a point and of the point so far above or below it (Scree lod, C1: exact).
class Projection {
public:
    explicit Projection(const Camera& camera)
        : frustum_(camera),
          eye_(camera.eye),
          right_(camera.right()),
          up_(camera.up),
          forward_(camera.forward),
          focal_px_(camera.focal_px()) {}

    bool sees(const glm::dvec3& point) const { return frustum_.contains(point); }
    double displacement_px(const glm::dvec3& point, double by_m) const {
        const glm::dvec3 d = point - eye_;
        const double x = glm::dot(d, right_), y = glm::dot(d, up_), z = glm::dot(d, forward_);
        const double end = z + by_m * forward_.z;
        if (!(end > 0)) return std::numeric_limits<float>::max();  // drawn behind the eye
        const double across = right_.z * z - forward_.z * x, along = up_.z * z - forward_.z * y;
        return focal_px_ * std::abs(by_m) * std::sqrt(across * across + along * along) / (z * end);
    }

private:
    Frustum frustum_;
    glm::dvec3 eye_, right_, up_, forward_;
    double focal_px_;
};

// The vertices of a world as the eye sees them: lowered by curvature.
class Bent {
public:
    Bent(const BlockWorld& world, const glm::dvec3& eye, double half_curvature)
        : world_(world), eye_(eye), half_curvature_(half_curvature) {}
    const BlockWorld& world() const { return world_; }
    glm::dvec3 at(int block, std::int32_t vertex) const {
        glm::dvec3 p = world_.position(static_cast<std::uint32_t>(block) * world_.vertices_per_block() +
                                       static_cast<std::uint32_t>(vertex));
        const double x = p.x - eye_.x, y = p.y - eye_.y;
        p.z -= (x * x + y * y) * half_curvature_;
        return p;
    }

private:
    const BlockWorld& world_;
    glm::dvec3 eye_;
    double half_curvature_;
};

struct BlockHeights {
    std::vector<double> full, drawn;
};

void judge_block(const Bent& bent, const Projection& projection, int block, BlockHeights& z, PixelErrors& errors) {
    const BlockWorld& world = bent.world();
    z.full.resize(world.vertices_per_block());
    z.drawn.resize(z.full.size());
    for (std::size_t v = 0; v < z.full.size(); ++v) z.full[v] = bent.at(block, static_cast<std::int32_t>(v)).z;
    surface_heights(world.bisection(), world.active(block), z.full, z.drawn);
    for (std::size_t v = 0; v < z.full.size(); ++v) {
        const glm::dvec3 point = bent.at(block, static_cast<std::int32_t>(v));
        if (projection.sees(point)) errors.add(projection.displacement_px(point, z.drawn[v] - z.full[v]));
    }
}

class Strip {
public:
    Strip(const Bent& bent, int strip) : bent_(bent), sides_(bent.world().sides(strip)) {
        const BlockWorld& world = bent.world();
        const std::int32_t m = world.bisection().cells();
        for (const bool on_b : {false, true})
            for (std::int32_t y = 0; y <= m; ++y) {
                const std::int32_t v = world.side_vertex(sides_.lie, on_b, y);
                const int block = on_b ? sides_.b : sides_.a;
                z_[on_b].push_back(bent.at(block, v).z);
                if (world.active(block)[static_cast<std::size_t>(v)] != 0) drawn_[on_b].push_back(y);
            }
    }

    /// visit(point of the full mesh, how far the strip is above it).
    template <class Visit>
    void for_each_error(const Visit& visit) const {
        std::size_t i = 0, j = 0;
        walk_zipper(drawn_[0], drawn_[1], [&](bool on_b, std::int32_t, std::int32_t) {
            ++(on_b ? j : i);
            const std::int32_t ya = drawn_[0][i], yb = drawn_[1][j];
            for_each_crossing(ya, yb, [&](double t, std::int32_t ja, std::int32_t jb) {
                visit((1 - t) * point(false, ja) + t * point(true, jb),
                      crossing_error_m(z_[0], z_[1], ya, yb, t, ja, jb));
            });
        });
    }

private:
    glm::dvec3 point(bool on_b, std::int32_t y) const {
        return bent_.at(on_b ? sides_.b : sides_.a, bent_.world().side_vertex(sides_.lie, on_b, y));
    }

    const Bent& bent_;
    BlockWorld::StripSides sides_;
    std::array<std::vector<double>, 2> z_;
    std::array<std::vector<std::int32_t>, 2> drawn_;
};

}  // namespace

void PixelErrors::add(double px) {
    ++count_;
    sum_ += px;
    max_ = std::max(max_, px);
    ++bins_[bin_of(px)];
}

double PixelErrors::quantile_px(double share) const {
    std::int64_t below = 0;
    for (std::size_t k = 0; k < bins_.size(); ++k) {
        below += bins_[k];
        if (static_cast<double>(below) >= share * static_cast<double>(count_) && below > 0)
            return std::min(max_, static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(k + 1) << 17)));
    }
    return max_;
}

void judge_frame(const BlockWorld& world, const Camera& camera, const BlockFrame& frame, double limit_px,
                 BlockTruth& truth, double half_curvature) {
    const Projection projection(camera);
    const Bent bent(world, camera.eye, half_curvature);
    BlockHeights heights;
    for (const std::int32_t block : frame.blocks) judge_block(bent, projection, block, heights, truth.blocks);
    for (const std::int32_t index : frame.strips) {
        bool seen = false;
        double worst = 0;
        Strip(bent, index).for_each_error([&](const glm::dvec3& point, double by_m) {
            if (!projection.sees(point)) return;
            const double px = projection.displacement_px(point, by_m);
            truth.dikes.add(px);
            worst = std::max(worst, px);
            seen = true;
        });
        truth.strips += seen ? 1 : 0;
        truth.strips_above += worst > limit_px ? 1 : 0;
    }
}

void judge_selection(const BlockWorld& world, const Camera& camera, const BlockFrame& frame, const BlockRules& rules,
                     SelectionTruth& truth) {
    const double f = camera.focal_px();
    std::vector<std::uint8_t> anew(world.vertices_per_block());
    for (const std::int32_t block : frame.blocks) {
        world.select_anew(block, camera, rules, anew);
        const auto active = world.active(block);
        const std::uint32_t base = static_cast<std::uint32_t>(block) * world.vertices_per_block();
        double worst_px = 0;
        for (const std::int32_t v : world.bisection().coarse_to_fine()) {
            const auto k = static_cast<std::size_t>(v);
            const double px = f * static_cast<double>(world.local_correction_m(block, v)) *
                              magnification(world.position(base + static_cast<std::uint32_t>(v)) - camera.eye);
            truth.wanted += anew[k];
            truth.failing += px > rules.tau_px ? 1 : 0;
            if (active[k] != 0) continue;
            truth.missing += anew[k];
            truth.failing_missing += px > rules.tau_px ? 1 : 0;
            worst_px = std::max(worst_px, px);
        }
        ++truth.blocks;
        truth.blocks_lacking += worst_px > rules.tau_px * (1 + kRounding) ? 1 : 0;
        truth.blocks_above += worst_px > (rules.tau_px + rules.s_px) * (1 + kRounding) ? 1 : 0;
        truth.worst_px = std::max(truth.worst_px, worst_px);
    }
}

}  // namespace scree
