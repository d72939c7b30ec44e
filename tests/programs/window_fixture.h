// The window over a little landscape, on a display of its own.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"
#include "tests/programs/virtual_display.h"

namespace scree::test {

/// Skips where Xvfb or xdotool is missing.
class WindowFixture : public ::testing::Test {
protected:
    void SetUp() override;

    TemporaryFolder folder_;
    std::string store_ = folder_.file("s.scree");
    std::unique_ptr<VirtualDisplay> display_;
    ProgramOptions options_;  ///< of programs that are to find the display
};

}  // namespace scree::test
