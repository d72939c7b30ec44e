// Pictures of tiles that are drawn by meshes: with a pattern's triangles they are the pattern's, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/texture_tile.h"
#include "runtime/lod/mesh_pool.h"
#include "runtime/render/renderer.h"
#include "tests/common/counted_new.h"
#include "tests/common/test_support.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

using Items = std::vector<DrawItem>;

constexpr int kSize_px = 96;
constexpr int kTextureLog2 = 5;
constexpr double kWorld_m = 320;

struct Picture {
    std::vector<std::uint8_t> rgb;
    std::vector<float> depth;
    FrameTimes times;
};

/// Four textures of random blocks, two heights of random hills.
class MeshDrawTest : public GlTest {
protected:
    MeshDrawTest() : random_(test::seed()) {}

    void make(int tile_cells_log2, std::size_t mesh_indices, int max_array_layers = kMaxArrayLayers) {
        patterns_ = TilePatterns(tile_cells_log2);
        const std::size_t largest = patterns_.range(0, 0).count;
        pool_ = MeshPool(std::max(mesh_indices, largest), largest);
        passed_on_ = 0;
        const std::int64_t cells = std::int64_t{4} << tile_cells_log2;
        options_.lattice =
            *make_lattice(1000, 2000, kWorld_m / static_cast<double>(cells), cells, cells, tile_cells_log2);
        options_.texture_size_log2 = kTextureLog2;
        options_.height_slots = 2;
        options_.texture_slots = 5;
        options_.max_draws = 64;
        options_.max_array_layers = max_array_layers;
        options_.mesh_indices = pool_.capacity();
        auto created = Renderer::create(options_);
        ASSERT_TRUE(created.ok()) << created.error().message;
        renderer_ = std::move(*created);
        std::vector<SlotVertex> vertices(slot_vertex_count(tile_cells_log2));
        for (int slot = 0; slot < 2; ++slot) {
            fill_vertex_slot(test::random_samples(random_, tile_cells_log2, 8), tile_cells_log2, vertices);
            renderer_->upload_height(slot, vertices);
        }
        for (int slot = 0; slot < 5; ++slot) renderer_->upload_texture(slot, random_texture());
        auto target = RenderTarget::create({kSize_px, kSize_px, 0});
        ASSERT_TRUE(target.ok());
        target_ = std::make_unique<RenderTarget>(std::move(*target));
    }

    std::vector<std::uint8_t> random_texture() {
        std::vector<std::uint8_t> chain;
        while (chain.size() < bc1_chain_bytes(kTextureLog2)) {
            const auto any = [&] { return static_cast<std::uint16_t>(test::uniform(random_, 1, 65535)); };
            const auto block = bc1_block(any(), any(), any());
            chain.insert(chain.end(), block.begin(), block.end());
        }
        return chain;
    }

    /// The triangles of an item's pattern, as a mesh; the part's alone.
    DrawItem with_mesh(DrawItem item) {
        const PatternRange whole = patterns_.range(item.geomip, item.edge_mask);
        const PatternRange part = patterns_.range(item.geomip, item.edge_mask, item.part);
        const MeshRange mesh = pool_.put(std::span(patterns_.indices()).subspan(whole.first, whole.count));
        item.mesh = mesh.section(part.first - whole.first, part.count);
        return item;
    }
    Items with_meshes(Items items) {
        for (DrawItem& item : items) item = with_mesh(item);
        return items;
    }

    void pass_meshes_on() {
        for (const MeshPool::Piece& piece : pool_.written_since(passed_on_))
            renderer_->upload_mesh(piece.first, piece.indices);
        passed_on_ = pool_.written();
    }

    FrameTimes draw_once(const Items& items) {
        pass_meshes_on();
        return renderer_->draw(camera_, items, settings_, *target_);
    }
    Picture draw(const Items& items) {
        Picture picture;
        picture.times = draw_once(items);
        picture.rgb = target_->read_pixels();
        picture.depth = target_->read_depth();
        return picture;
    }
    void expect_same(const Items& items, const std::string& what) {
        const Picture expected = draw(items), drawn = draw(with_meshes(items));
        EXPECT_EQ(drawn.rgb, expected.rgb) << what;
        EXPECT_EQ(drawn.depth, expected.depth) << what;
        EXPECT_EQ(drawn.times.triangles, expected.times.triangles) << what;
        EXPECT_EQ(drawn.times.draws, items.size()) << what;
        EXPECT_NE(drawn.rgb, draw({}).rgb) << what;
    }

    /// The four quadrants of the world, beside each other's textures.
    static Items quadrants() {
        Items items;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            DrawItem item;
            item.tile = child_of({0, 0, 0}, quadrant);
            item.height_slot = quadrant % 2;
            item.texture.slot = quadrant;
            const int x = quadrant % 2, y = quadrant / 2;
            std::size_t side = 0;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    if (dx == 0 && dy == 0) continue;
                    const bool inside = x + dx >= 0 && x + dx <= 1 && y + dy >= 0 && y + dy <= 1;
                    item.neighbour_textures[side++] = inside ? 2 * (y + dy) + x + dx : -1;
                }
            items.push_back(item);
        }
        return items;
    }
    /// The root in parts, some with textures of their own.
    static Items parts(int level) {
        Items items;
        for (int y = 0; y < 1 << level; ++y)
            for (int x = 0; x < 1 << level; ++x) {
                DrawItem item;
                item.part = {level, x, y};
                if ((x + y) % 3 != 0)
                    item.texture = {1 + (x + y) % 3, static_cast<float>(1 << level), static_cast<float>(-x),
                                    static_cast<float>(-y)};
                if (x % 2 == 1) item.neighbour_textures = {0, 1, 2, 3, 4, 0, 1, 2};
                items.push_back(item);
            }
        return items;
    }

    test::Random random_;
    Camera camera_ = *look_at({1160, 1640, 190}, {1160, 1850, 0}, 60, kSize_px, kSize_px);
    RendererOptions options_;
    FrameSettings settings_;
    TilePatterns patterns_{1};
    MeshPool pool_{1, 1};
    std::uint64_t passed_on_ = 0;
    std::unique_ptr<Renderer> renderer_;
    std::unique_ptr<RenderTarget> target_;
};

TEST_F(MeshDrawTest, AMeshOfAPatternsTrianglesIsThePatternsPicture) {
    SCREE_TRACE_SEED();
    make(4, 20'000);
    for (const bool wires : {false, true})
        for (const bool by_level : {false, true})
            for (int geomip = 0; geomip < 4; ++geomip) {
                settings_.wireframe = wires;
                settings_.highlight = by_level ? Highlight::level : Highlight::none;
                settings_.half_curvature = geomip % 2 == 0 ? 0 : 1e-4;
                DrawItem item;
                item.geomip = geomip;
                item.edge_mask = static_cast<std::uint32_t>(test::uniform(random_, 0, 15));
                expect_same({item}, "geomip " + std::to_string(geomip));
            }
}

TEST_F(MeshDrawTest, OfEveryTileSizeIndicesOf16AndOf32BitsAlike) {
    SCREE_TRACE_SEED();
    for (int cells_log2 = kMinTileCellsLog2; cells_log2 <= kMaxTileCellsLog2; ++cells_log2) {
        make(cells_log2, 0);  // room for one mesh
        expect_same({DrawItem{}}, "2^" + std::to_string(cells_log2));
    }
}

TEST_F(MeshDrawTest, PartsAreDrawnByTheirShareOfAMesh) {
    SCREE_TRACE_SEED();
    make(4, 100'000);
    for (int level = 1; level <= 3; ++level) expect_same(parts(level), "level " + std::to_string(level));
}

TEST_F(MeshDrawTest, MeshesBesideOtherTexturesAreFilteredAcrossTheirBorders) {
    SCREE_TRACE_SEED();
    const Camera oblique = camera_;
    for (const int layers : {5, 2, 1}) {
        camera_ = oblique;
        make(4, 100'000, layers);
        Items items = quadrants();
        for (DrawItem& item : items) item.geomip = 3;  // too coarse for a ring: patterns are blended whole too
        expect_same(items, std::to_string(layers) + " layers an array");
        for (DrawItem& item : items) {
            item.texture_share = 0.3f;
            item.coarse_texture = {4, 0.5f, 0.25f, 0.25f};
        }
        expect_same(items, "fading, " + std::to_string(layers) + " layers an array");
        // A pattern's inner blocks are drawn by another program: alike but for rounding where textures are magnified.
        camera_ = *look_at({1160, 1840, 140}, {1160, 1840, 0}, 60, kSize_px, kSize_px);
        for (const int slot : {0, 1}) renderer_->upload_height(slot, flat_slot(4, 3));
        items = quadrants();
        const Picture ringed = draw(items), meshed = draw(with_meshes(items));
        EXPECT_EQ(meshed.depth, ringed.depth);
        EXPECT_EQ(meshed.times.draws, 4u);
        EXPECT_EQ(meshed.times.blended_draws, 4u);
        EXPECT_EQ(meshed.times.triangles, ringed.times.triangles);
        int largest = 0;
        for (std::size_t k = 0; k < meshed.rgb.size(); ++k)
            largest = std::max(largest, std::abs(meshed.rgb[k] - ringed.rgb[k]));
        EXPECT_LE(largest, 2);
    }
}

TEST_F(MeshDrawTest, FramesAreRightWhileThePoolGoesRoundAndRound) {
    SCREE_TRACE_SEED();
    make(4, 7'000);
    std::uint64_t triangles = 0;
    for (int frame = 0; frame < 30; ++frame) {
        Items items = quadrants();
        for (DrawItem& item : items) {
            item.neighbour_textures.fill(-1);
            item.geomip = test::uniform(random_, 0, 3);
            item.edge_mask = static_cast<std::uint32_t>(test::uniform(random_, 0, 15));
        }
        if (frame == 20) pool_.clear();
        const Picture expected = draw(items);
        const Items meshed = with_meshes(items);
        for (const DrawItem& item : meshed) ASSERT_TRUE(pool_.holds(item.mesh));
        ASSERT_EQ(draw(meshed).rgb, expected.rgb) << "frame " << frame;
        triangles += expected.times.triangles;
    }
    EXPECT_GT(3 * triangles, 5 * pool_.capacity());
}

TEST_F(MeshDrawTest, ATileOfTwoTrianglesIsFlatBetweenItsCorners) {
    make(4, 2'000);
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    settings_.magenta_background = true;
    constexpr std::uint32_t kEast = 16, kSouth = 17 * 16;
    const std::vector<std::uint32_t> mesh{kEast, 0, kSouth + kEast, kSouth, kSouth + kEast, 0};
    std::vector<SlotVertex> hills = flat_slot(4, 100);
    for (const std::uint32_t corner : mesh) hills[corner] = {0, 0};
    renderer_->upload_height(0, hills);
    DrawItem item;
    item.mesh = pool_.put(mesh);
    const Picture two = draw({item});
    renderer_->upload_height(0, flat_slot(4, 0));
    EXPECT_EQ(two.times.triangles, 2u);
    const Picture flat = draw({DrawItem{}});
    EXPECT_EQ(two.rgb, flat.rgb);
}

TEST_F(MeshDrawTest, SteadyFramesOfNewMeshesAllocateNothing) {
    make(4, 20'000);
    Items items = quadrants();
    const auto frame = [&] {
        for (DrawItem& item : items) item = with_mesh(item);
        draw_once(items);
    };
    // A driver may allocate now and then; what is ours would do so every time.
    std::int64_t fewest = 1000;
    for (int k = 0; k < 12; ++k) {
        const std::int64_t before = test::allocations();
        frame();
        fewest = std::min(fewest, test::allocations() - before);
    }
    EXPECT_EQ(fewest, 0);
}

TEST_F(MeshDrawTest, MeshesAreCountedInTheBudget) {
    for (const auto& [cells_log2, bytes] : {std::pair{5, 2}, {7, 2}, {8, 4}}) {
        RendererOptions with, without;
        with.lattice = without.lattice = *make_lattice(0, 0, 1, 256, 256, cells_log2);
        with.mesh_indices = 12'345;
        EXPECT_EQ(renderer_bytes(with) - renderer_bytes(without), static_cast<std::size_t>(12'345 * bytes));
    }
}

TEST_F(MeshDrawTest, MoreMeshesThanIndicesReachAreRefused) {
    RendererOptions options;
    options.lattice = *make_lattice(0, 0, 1, 64, 64, 4);
    options.mesh_indices = std::size_t{1} << 40;
    const auto created = Renderer::create(options);
    ASSERT_FALSE(created.ok());
    EXPECT_EQ(created.error().code, ErrorCode::display);
}

}  // namespace
}  // namespace scree
