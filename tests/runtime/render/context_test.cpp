#include "runtime/render/context.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "runtime/render/render_target.h"
#include "runtime/render/window_context.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

class ContextTest : public GlTest {};

TEST_F(ContextTest, HeadlessSaysWhatDraws) {
    EXPECT_FALSE(context()->renderer().empty());
    EXPECT_NE(context()->version().find("4."), std::string::npos);
    EXPECT_EQ(context()->is_software(), context()->renderer().find("llvmpipe") != std::string::npos);
    EXPECT_EQ(context()->window(), nullptr);
}

TEST_F(ContextTest, OneThatIsBorrowedIsTheOneThatIsCurrentAndStaysSo) {
    {
        auto borrowed = borrow_current_context();
        ASSERT_TRUE(borrowed.ok()) << borrowed.error().message;
        EXPECT_EQ((*borrowed)->renderer(), context()->renderer());
        EXPECT_EQ((*borrowed)->version(), context()->version());
        EXPECT_EQ((*borrowed)->window(), nullptr);
        (*borrowed)->swap_buffers();
    }
    EXPECT_TRUE(RenderTarget::create({16, 16, 0}).ok());
}

TEST(WindowTest, ShowsWhatWasBlittedOrSaysThereIsNoDisplay) {
    WindowOptions options;
    options.width_px = 64;
    options.height_px = 48;
    options.wait_for_refresh = false;
    auto created = create_window_context(options);
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) {
        ASSERT_FALSE(created.ok());
        EXPECT_EQ(created.error().code, ErrorCode::display);
        EXPECT_NE(created.error().message.find("no display"), std::string::npos) << created.error().message;
        return;
    }
    if (!created) GTEST_SKIP() << "there is a display, but: " << created.error().message;
    ASSERT_NE((*created)->window(), nullptr);
    {
        auto target = RenderTarget::create({64, 48, 0});
        ASSERT_TRUE(target.ok());
        glEnable(GL_FRAMEBUFFER_SRGB);
        const float half_light[4] = {0.5f, 1, 0, 1};
        glClearNamedFramebufferfv(target->framebuffer(), GL_COLOR, 0, half_light);
        target->blit_to_window(64, 48);
        unsigned char pixel[4] = {};
        glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
        glReadPixels(20, 20, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel);
        EXPECT_NEAR(pixel[0], 188, 1) << "linear 0.5 is sRGB 188";
        EXPECT_EQ(pixel[1], 255);
        EXPECT_EQ(pixel[2], 0);
    }
    (*created)->swap_buffers();
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

}  // namespace
}  // namespace scree
