#include "tests/programs/land_store.h"

#include <gtest/gtest.h>

#include "tests/programs/child_program.h"

namespace scree::test {
namespace {

constexpr int kNoDisplay = 6;

}  // namespace

LandStore::LandStore(const std::string& name) : store_(folder_.file(name)) {
    const auto made = scree({"synth", "-o", folder_.file("land"), "--size", "257", "--imagery-scale", "2", "--quiet"});
    EXPECT_EQ(made.exit_code, 0) << describe(made);
    const auto built = scree({"build", folder_.file("land/dem.tif"), "--imagery", folder_.file("land/ortho.tif"), "-o",
                              store_, "--texture-size", "64", "--tile-size", "33", "--quiet"});
    EXPECT_EQ(built.exit_code, 0) << describe(built);
    can_draw_ = scree_view({"shot", store_, "-o", folder_.file("can.png"), "--size", "32x32"}).exit_code != kNoDisplay;
}

}  // namespace scree::test
