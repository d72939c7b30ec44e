// A little landscape by `scree synth`, built once for a suite of tests.
#pragma once

#include <memory>
#include <string>

#include "tests/common/test_support.h"

namespace scree::test {

class LandStore {
public:
    /// 257^2 heights and 512^2 texels in small tiles, under this file name. Records failures.
    explicit LandStore(const std::string& name);

    const std::string& store() const { return store_; }
    std::string file(const std::string& name) const { return folder_.file(name); }
    /// False where OpenGL 4.5 by surfaceless EGL is not to be had.
    bool can_draw() const { return can_draw_; }

private:
    TemporaryFolder folder_;
    std::string store_;
    bool can_draw_ = false;
};

}  // namespace scree::test
