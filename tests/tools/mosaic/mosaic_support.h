// Files of the tests as a plan would place them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/common/test_support.h"
#include "tools/mosaic/stack.h"

namespace scree::test {

inline PlacedFile placed(const std::string& path) {
    auto dem = open_heights(path, {});
    EXPECT_TRUE(dem.ok()) << path;
    auto crs = Crs::parse((*dem)->georeference()->crs);
    EXPECT_TRUE(crs.ok());
    return {path, (*dem)->info(), *(*dem)->georeference(), std::move(*crs)};
}

inline std::unique_ptr<HeightStack> stack_of(const std::vector<std::string>& paths, const std::string& temporary,
                                             Kernel kernel = Kernel::bilinear) {
    std::vector<PlacedFile> files;
    for (const std::string& path : paths) files.push_back(placed(path));
    auto layers = group_layers(files);
    EXPECT_TRUE(layers.ok());
    StackOptions options;
    options.kernel = kernel;
    options.temporary = temporary;
    auto stack = HeightStack::read(files, std::move(*layers), false, options, {});
    EXPECT_TRUE(stack.ok());
    return std::move(*stack);
}

}  // namespace scree::test
