// What a surface keeps in its index buffer from frame to frame, and that the picture is none the worse for it.
#include "runtime/render/surface_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

constexpr int kSize_px = 64, kCells = 8;

/// 9 x 9 vertices seen from above; three pieces of two rows of cells each, with room for so many.
class SurfaceTest : public GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        if (IsSkipped() || HasFatalFailure()) return;
        options_.lattice = *make_lattice(0, 80, 10, kCells, kCells, 3);
        options_.high_n = 40;
        for (int j = 0; j <= kCells; ++j)
            for (int i = 0; i <= kCells; ++i)
                vertices_.push_back({i, j, static_cast<float>((i * 7 + j * 5) % 40), 0, 0});
        auto target = RenderTarget::create({kSize_px, kSize_px, 0});
        ASSERT_TRUE(target.ok());
        target_ = std::make_unique<RenderTarget>(std::move(*target));
        renderer_ = make();
        camera_.eye = {40, 40, 150};
        camera_.forward = {0, 0, -1};
        camera_.up = {0, 1, 0};
        camera_.fov_deg = 40;
        camera_.width_px = camera_.height_px = kSize_px;
        settings_.magenta_background = true;
    }
    std::unique_ptr<SurfaceRenderer> make() {
        const std::array<std::uint32_t, 3> rooms{6 * 2 * kCells, 6 * 2 * kCells, 6 * 2 * kCells};
        auto made = SurfaceRenderer::create(options_, vertices_, rooms);
        EXPECT_TRUE(made.ok());
        return std::move(*made);
    }
    static std::vector<std::uint32_t> rows(int first, int cells = kCells) {
        std::vector<std::uint32_t> indices;
        for (int j = first; j < first + 2; ++j)
            for (int i = 0; i < cells; ++i) {
                const auto at = [](int x, int y) { return static_cast<std::uint32_t>(y * (kCells + 1) + x); };
                for (const std::uint32_t v :
                     {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1), at(i + 1, j), at(i, j + 1)})
                    indices.push_back(v);
            }
        return indices;
    }
    FrameTimes draw(SurfaceRenderer& renderer, const std::vector<SurfacePiece>& pieces) {
        return renderer.draw(camera_, pieces, settings_, *target_);
    }

    SurfaceOptions options_;
    std::vector<SurfaceVertex> vertices_;
    std::unique_ptr<SurfaceRenderer> renderer_;
    std::unique_ptr<RenderTarget> target_;
    Camera camera_;
    FrameSettings settings_;
};

TEST_F(SurfaceTest, SendsOnlyWhatChanged) {
    const auto a = rows(0), b = rows(2), c = rows(4), few = rows(2, 3);
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {1, 1, b}}).uploaded_bytes, 4 * (a.size() + b.size()));
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {1, 1, b}}).uploaded_bytes, 0u) << "a steady frame sends nothing";
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {2, 5, c}}).uploaded_bytes, 4 * c.size());
    EXPECT_EQ(draw(*renderer_, {{1, 1, b}, {2, 5, c}, {0, 1, a}}).uploaded_bytes, 0u)
        << "what was out of view is there";
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {1, 2, few}, {2, 5, c}}).uploaded_bytes, 4 * few.size());
}

TEST_F(SurfaceTest, APictureOfKeptPiecesIsThatOfFreshOnes) {
    const auto a = rows(0), b = rows(2), c = rows(4), few = rows(2, 3);
    draw(*renderer_, {{0, 1, a}, {1, 1, b}});
    draw(*renderer_, {{2, 1, c}});
    const std::vector<SurfacePiece> last{{2, 1, c}, {1, 2, few}, {0, 1, a}};
    const FrameTimes times = draw(*renderer_, last);
    EXPECT_EQ(times.triangles, (a.size() + few.size() + c.size()) / 3);
    const auto kept = target_->read_pixels();
    const auto fresh = make();
    draw(*fresh, last);
    EXPECT_EQ(kept, target_->read_pixels());
    draw(*fresh, {{0, 1, a}});
    EXPECT_NE(kept, target_->read_pixels()) << "all pieces are seen";
}

TEST_F(SurfaceTest, NeighboursInTheBufferAreDrawnAsOne) {
    const auto a = rows(0), b = rows(2), c = rows(4), few = rows(2, 3);
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {1, 1, b}, {2, 1, c}}).draws, 1u) << "full to their rooms' ends";
    EXPECT_EQ(draw(*renderer_, {{0, 1, a}, {1, 2, few}, {2, 1, c}}).draws, 2u);
    EXPECT_EQ(draw(*renderer_, {}).draws, 0u);
}

}  // namespace
}  // namespace scree
