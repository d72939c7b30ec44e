// GlTest: tests that need OpenGL. One headless context serves the whole program; without any EGL the tests are skipped
// and say so. Each test must leave no OpenGL error behind.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "common/mesh/vertex_slot.h"
#include "runtime/render/context.h"

namespace scree {

class GlTest : public testing::Test {
protected:
    static void SetUpTestSuite();
    static void TearDownTestSuite();
    void SetUp() override;
    void TearDown() override;

    static GlContext* context();
};

/// One BC1 block: 16 texels of two RGB565 colours; texel k takes `second` where bit k of `mask` is set (k = 4 * row +
/// column). Where `transparent_mask` has bits, the block is in three-colour mode and those texels have alpha 0.
std::vector<std::uint8_t> bc1_block(std::uint16_t first, std::uint16_t second, std::uint16_t mask,
                                    std::uint16_t transparent_mask = 0);

inline constexpr std::uint16_t kRed565 = 0xF800;
inline constexpr std::uint16_t kGreen565 = 0x07E0;
inline constexpr std::uint16_t kBlue565 = 0x001F;
inline constexpr std::uint16_t kWhite565 = 0xFFFF;
inline constexpr std::uint16_t kGrey565 = 0x8410;  // sRGB 132, 130, 132

/// A texture of one colour, all mips.
std::vector<std::uint8_t> plain_texture(int size_log2, std::uint16_t colour);

/// A slot whose every height is `height_n`.
std::vector<SlotVertex> flat_slot(int tile_cells_log2, float height_n);

}  // namespace scree
