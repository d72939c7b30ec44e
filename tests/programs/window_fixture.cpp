#include "tests/programs/window_fixture.h"

#include "tests/programs/reports.h"

namespace scree::test {

void WindowFixture::SetUp() {
    if (!on_path("Xvfb") || !on_path("xdotool")) GTEST_SKIP() << "needs Xvfb and xdotool";
    ASSERT_EQ(
        scree({"synth", "-o", folder_.file("land"), "--size", "129", "--imagery-scale", "2", "--quiet"}).exit_code, 0);
    build_store_from({folder_.file("land/dem.tif"), "--imagery", folder_.file("land/ortho.tif")}, store_);
    display_ = std::make_unique<VirtualDisplay>();
    ASSERT_NE(display_->name(), "") << "Xvfb did not start";
    options_.environment = {"DISPLAY=" + display_->name(), "WAYLAND_DISPLAY"};
    options_.limit_s = 90;
}

}  // namespace scree::test
