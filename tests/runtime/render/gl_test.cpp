#include "tests/runtime/render/gl_test.h"

#include <epoxy/gl.h>

#include <memory>
#include <string>

#include "common/texture_tile.h"

namespace scree {
namespace {

std::unique_ptr<GlContext> shared_context;
std::string reason;

}  // namespace

void GlTest::SetUpTestSuite() {
    auto created = create_headless_context();
    if (created)
        shared_context = std::move(*created);
    else
        reason = created.error().message;
}

void GlTest::TearDownTestSuite() { shared_context.reset(); }

void GlTest::SetUp() {
    if (!shared_context) GTEST_SKIP() << "needs OpenGL 4.5 through EGL: " << reason;
}

void GlTest::TearDown() {
    if (shared_context) {
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    }
}

GlContext* GlTest::context() { return shared_context.get(); }

std::vector<std::uint8_t> bc1_block(std::uint16_t first, std::uint16_t second, std::uint16_t mask,
                                    std::uint16_t transparent_mask) {
    // Four-colour mode needs c0 > c1; three colours and transparency come with c0 <= c1.
    const bool three_colours = transparent_mask != 0;
    const bool swapped = three_colours ? first > second : first < second;
    const std::uint16_t c0 = swapped ? second : first;
    const std::uint16_t c1 = swapped ? first : second;
    std::uint32_t codes = 0;
    for (unsigned k = 0; k < 16; ++k) {
        std::uint32_t code = ((mask >> k) & 1u) ^ (swapped ? 1u : 0u);
        if ((transparent_mask >> k) & 1u) code = 3;
        codes |= code << (2 * k);
    }
    std::vector<std::uint8_t> block;
    for (const std::uint32_t value : {std::uint32_t{c0}, std::uint32_t{c1}})
        for (unsigned shift : {0u, 8u}) block.push_back(static_cast<std::uint8_t>((value >> shift) & 255u));
    for (unsigned shift : {0u, 8u, 16u, 24u}) block.push_back(static_cast<std::uint8_t>((codes >> shift) & 255u));
    return block;
}

std::vector<std::uint8_t> plain_texture(int size_log2, std::uint16_t colour) {
    std::vector<std::uint8_t> chain;
    const auto block = bc1_block(colour, 0, 0);
    for (std::size_t k = 0; k < bc1_chain_bytes(size_log2) / 8; ++k)
        chain.insert(chain.end(), block.begin(), block.end());
    return chain;
}

std::vector<SlotVertex> flat_slot(int tile_cells_log2, float height_n) {
    return std::vector<SlotVertex>(slot_vertex_count(tile_cells_log2), SlotVertex{height_n, height_n});
}

}  // namespace scree
