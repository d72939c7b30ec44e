#include "runtime/app/block_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/lod/cut.h"
#include "runtime/view/curvature.h"
#include "runtime/view/frustum.h"

namespace scree {

Result<std::unique_ptr<BlockScene>> BlockScene::open(const TileStore& store, const SceneOptions& options,
                                                     const LoadProgress& progress) {
    // What is read and what is made of it take about as long.
    const auto half = [&progress](int which) -> LoadProgress {
        if (!progress) return {};
        return [&progress, which](double share) { return progress(0.5 * (which + share)); };
    };
    auto raster = read_height_raster(store, options.budget_bytes, kBytesPerSample, half(0));
    if (!raster) return raster.error();
    auto world = BlockWorld::make(*raster, {}, half(1));
    if (!world) return world.error();
    return std::unique_ptr<BlockScene>(new BlockScene(store.dataset(), options, std::move(*world)));
}

BlockScene::BlockScene(const Dataset& dataset, const SceneOptions& options, BlockWorld world)
    : dataset_(dataset),
      lod_(options.lod),
      curvature_(options.curvature),
      rules_(block_rules(options.lod, options.tau_px)),
      world_(std::move(world)),
      drawn_(static_cast<std::size_t>(world_.block_count())),
      at_end_(static_cast<std::size_t>(world_.block_count())) {
    if (options.soft_edge) make_edge_field();
}

// The band, and a field's cell, from any end; cells between blocks go with either.
void BlockScene::make_edge_field() {
    const double band_m = edge_band_m(dataset_.lattice);
    const std::int64_t row = world_.bisection().row(), samples_x = world_.columns() * row,
                       samples_y = world_.rows() * row;
    edge_field_ = EdgeField::of_box(dataset_.lattice, samples_x - 1, samples_y - 1, band_m);
    const double near = band_m / dataset_.lattice.spacing_m + 2 * edge_field_->shape().cell_side + 1;
    const auto reaches = [near](std::int64_t first, std::int64_t last, std::int64_t samples) {
        return static_cast<double>(first) < near || static_cast<double>(samples - 1 - last) < near;
    };
    for (std::int64_t y = 0; y < world_.rows(); ++y)
        for (std::int64_t x = 0; x < world_.columns(); ++x)
            at_end_[static_cast<std::size_t>(y * world_.columns() + x)] =
                reaches(x * row, (x + 1) * row - 1, samples_x) || reaches(y * row, (y + 1) * row - 1, samples_y) ? 1
                                                                                                                 : 0;
}

bool BlockScene::is_at_end(int block) const { return at_end_[static_cast<std::size_t>(block)] != 0; }

std::int64_t BlockScene::resident_bytes() const { return std::int64_t{world_.vertex_count()} * kBytesPerSample; }

std::optional<double> BlockScene::promise_px() const {
    if (!lod_.is_guaranteed()) return std::nullopt;
    return lod_.promise_px(rules_.tau_px);
}

const BlockFrame& BlockScene::select(const Camera& camera) {
    rules_.half_curvature = scree::half_curvature(curvature_, dataset_, camera);
    const BlockFrame& frame = world_.select(camera, rules_);
    std::fill(drawn_.begin(), drawn_.end(), std::uint8_t{0});
    pieces_.clear();
    for (const std::int32_t block : frame.blocks) {
        drawn_[static_cast<std::size_t>(block)] = 1;
        pieces_.push_back(
            {static_cast<std::uint32_t>(block), world_.mesh_version(block), world_.mesh(block), is_at_end(block)});
    }
    const auto first_strip = static_cast<std::uint32_t>(world_.block_count()),
               first_quad = first_strip + static_cast<std::uint32_t>(world_.strip_count());
    // Strips and quads are at the end where one of their blocks is.
    for (const std::int32_t strip : frame.strips) {
        const auto sides = world_.sides(strip);
        pieces_.push_back({first_strip + static_cast<std::uint32_t>(strip), world_.strip_version(strip),
                           world_.strip_mesh(strip), is_at_end(sides.a) || is_at_end(sides.b)});
    }
    for (const std::int32_t quad : frame.quads) {
        const auto mesh = world_.quad_mesh(quad);
        const bool at_end = std::any_of(mesh.begin(), mesh.end(), [this](std::uint32_t vertex) {
            return is_at_end(static_cast<int>(vertex / world_.vertices_per_block()));
        });
        pieces_.push_back({first_quad + static_cast<std::uint32_t>(quad), 1, mesh, at_end});
    }
    return frame;
}

std::vector<std::uint32_t> BlockScene::rooms() const {
    const auto m = static_cast<std::uint32_t>(world_.bisection().cells());
    std::vector<std::uint32_t> rooms(static_cast<std::size_t>(world_.block_count()), 6 * m * m);
    rooms.resize(rooms.size() + static_cast<std::size_t>(world_.strip_count()), 6 * m);
    rooms.resize(rooms.size() + static_cast<std::size_t>(world_.quad_count()), 6);
    return rooms;
}

LatticePoint BlockScene::lattice_point(std::uint32_t vertex) const {
    const std::int64_t row = world_.bisection().row();
    const std::int64_t in_block = vertex % world_.vertices_per_block(), block = vertex / world_.vertices_per_block();
    return {block % world_.columns() * row + in_block % row, block / world_.columns() * row + in_block / row};
}

float BlockScene::height_n(std::uint32_t vertex) const {
    const double n = (world_.position(vertex).z - dataset_.height_offset_m) / dataset_.height_quantum_m;
    return static_cast<float>(std::nearbyint(n));  // heights are whole quanta; only the division rounds
}

DrawnMesh BlockScene::drawn_mesh() const {
    DrawnMesh mesh;
    for (const SurfacePiece& piece : pieces_)
        for (const std::uint32_t vertex : piece.indices) {
            const LatticePoint at = lattice_point(vertex);
            mesh.corners.push_back(
                {static_cast<std::int32_t>(at.i), static_cast<std::int32_t>(at.j), height_n(vertex), 0});
        }
    return mesh;
}

bool BlockScene::is_drawn(std::int64_t x, std::int64_t y) const {
    return x < world_.columns() && y < world_.rows() && drawn_[static_cast<std::size_t>(y * world_.columns() + x)] != 0;
}

// By which blocks are drawn, and not by which strips and quads are: one that is missing leaves open edges.
bool BlockScene::covers(std::int64_t i, std::int64_t j) const {
    const std::int64_t row = world_.bisection().row(), x = i / row, y = j / row;
    if (i < 0 || j < 0) return false;
    const std::int64_t right = x + (i % row == row - 1 ? 1 : 0), below = y + (j % row == row - 1 ? 1 : 0);
    return is_drawn(x, y) && is_drawn(right, y) && is_drawn(x, below) && is_drawn(right, below);
}

CrackReport BlockScene::count_cracks() const {
    return scree::count_cracks(drawn_mesh(), [this](double i, double j) {
        return covers(static_cast<std::int64_t>(std::floor(i)), static_cast<std::int64_t>(std::floor(j)));
    });
}

std::int64_t BlockScene::count_holes(const Camera& camera) const {
    std::int64_t holes = 0;
    for (int block = 0; block < world_.block_count(); ++block) holes += count_holes(camera, block);
    return holes;
}

// Of a block, and of the cells between it and those east and south of it.
std::int64_t BlockScene::count_holes(const Camera& camera, int block) const {
    const std::int64_t x = block % world_.columns(), y = block / world_.columns(), row = world_.bisection().row();
    const std::int64_t right = std::min<std::int64_t>(x + 1, world_.columns() - 1),
                       below = std::min<std::int64_t>(y + 1, world_.rows() - 1);
    bool whole = true;
    Box box = world_.box(block);
    for (const auto& [bx, by] : {std::pair(x, y), std::pair(right, y), std::pair(x, below), std::pair(right, below)}) {
        whole = whole && is_drawn(bx, by);
        const Box& other = world_.box(static_cast<int>(by * world_.columns() + bx));
        box = {glm::min(box.low, other.low), glm::max(box.high, other.high)};
    }
    const Frustum frustum(camera);
    if (whole || !frustum.may_see(lowered_by_curvature(box, camera.eye, rules_.half_curvature))) return 0;
    const auto sees = [&](std::int64_t i, std::int64_t j) {
        const auto vertex = static_cast<std::uint32_t>(
            (j / row * world_.columns() + i / row) * world_.vertices_per_block() + j % row * row + i % row);
        glm::dvec3 point = world_.position(vertex);
        const double east = point.x - camera.eye.x, north = point.y - camera.eye.y;
        point.z -= (east * east + north * north) * rules_.half_curvature;
        return frustum.contains(point);
    };
    const std::int64_t end_i = std::min((x + 1) * row, world_.columns() * row - 1),
                       end_j = std::min((y + 1) * row, world_.rows() * row - 1);
    std::int64_t holes = 0;
    for (std::int64_t j = y * row; j < end_j; ++j)
        for (std::int64_t i = x * row; i < end_i; ++i)
            if (!covers(i, j) && (sees(i, j) || sees(i + 1, j) || sees(i, j + 1) || sees(i + 1, j + 1))) ++holes;
    return holes;
}

}  // namespace scree
