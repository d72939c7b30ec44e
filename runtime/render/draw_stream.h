// DrawStream: the indirect commands and per-draw attributes of a frame, written straight into a buffer that stays
// mapped. Three regions take turns, so the CPU writes one while the GPU still reads the others. OpenGL thread only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/result.h"
#include "runtime/render/gl_handle.h"

struct __GLsync;

namespace scree {

/// As glMultiDrawElementsIndirect reads it.
struct DrawCommand {
    std::uint32_t index_count = 0;
    std::uint32_t instance_count = 1;
    std::uint32_t first_index = 0;
    std::int32_t base_vertex = 0;
    std::uint32_t base_instance = 0;
};
static_assert(sizeof(DrawCommand) == 20);

/// The attributes that every draw has, kTileAttribute to kEdgeMorphAttribute and kHighlightAttribute
/// (shaders/shared_constants.glsl).
struct DrawAttributes {
    std::int32_t lattice_i = 0, lattice_j = 0;  ///< the tile's north-west corner, finest cells
    std::int32_t step = 1;                      ///< finest cells from one sample to the next
    std::int32_t first_vertex = 0;
    float texture_layer = 0;
    float texture_scale = 1;
    float texture_offset_u = 0;
    float texture_offset_v = 0;
    std::int32_t stride = 1;  ///< samples from one vertex to the next
    std::uint32_t edge_mask = 0;
    float morph = 0;
    std::array<float, 4> edge_morph{};
    std::array<std::uint8_t, 4> highlight{};  ///< sRGB; of highlighted frames
};
static_assert(sizeof(DrawAttributes) == 64);

/// A texture that a blended draw looks at: unit << kTextureLayerBits | layer, or kNoTexture.
using TextureCode = std::uint16_t;

/// The further attributes of a blended draw, kCoarseAttribute to kNeighboursAttribute.
struct BlendAttributes {
    float coarse_scale = 1;
    float coarse_offset_u = 0;
    float coarse_offset_v = 0;
    float texture_share = 1;
    std::uint32_t own = 0, coarse = 0;        ///< TextureCodes
    std::array<TextureCode, 8> neighbours{};  ///< in TextureSide's order
};
static_assert(sizeof(BlendAttributes) == 40);

class DrawStream {
public:
    DrawStream() = default;
    DrawStream(DrawStream&&) = default;
    DrawStream& operator=(DrawStream&&) = default;
    ~DrawStream();
    /// Errors (ErrorCode::display): the driver has no memory for it.
    /// `more_commands`: those that draw again with the attributes of others.
    static Result<DrawStream> create(int max_draws, int more_commands = 0);

    /// One frame's share of the buffer: write (never read) max_draws of each, and more_commands; offsets are in bytes
    /// from the buffer's start.
    struct Region {
        std::span<DrawCommand> commands;
        std::span<DrawAttributes> attributes;
        std::span<BlendAttributes> blends;
        std::size_t commands_offset = 0;
        std::size_t attributes_offset = 0;
        std::size_t blends_offset = 0;
    };
    /// The next region, after the GPU has done with it (three frames ago: hardly ever a wait).
    Region begin_frame();
    /// After the last draw call that reads the region.
    void end_frame();

    int max_draws() const { return max_draws_; }
    std::uint32_t buffer() const { return buffer_.name(); }

private:
    static constexpr std::size_t kRegions = 3;
    struct Fence {
        Fence() = default;
        Fence(Fence&& other) noexcept : sync(std::exchange(other.sync, nullptr)) {}
        Fence& operator=(Fence&& other) noexcept {
            std::swap(sync, other.sync);
            return *this;
        }
        __GLsync* sync = nullptr;
    };
    std::size_t commands_offset(std::size_t region) const;
    std::size_t attributes_offset(std::size_t region) const;
    std::size_t blends_offset(std::size_t region) const;

    BufferHandle buffer_;
    std::byte* mapped_ = nullptr;
    int max_draws_ = 0;
    int max_commands_ = 0;
    std::size_t current_ = 0;
    std::array<Fence, kRegions> in_use_;
};

}  // namespace scree
